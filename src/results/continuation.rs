//! The file of a continuation: branches, their points, and curves of special points; small, so written whole at the end.

use std::path::{Path, PathBuf};

use super::attributes::{write_attributes, write_input, write_root};
use super::certificate::Addition;
use super::source::{Holds, Source};
use super::table::{LibraryVersion, create_file, create_group};
use super::target::Reservation;
use super::{AttributeValue, ResultError, Status, schema};

/// The study as given, in /input.
const INPUT_STUDY: &str = "study";
/// The base case as given, in /input.
const INPUT_CASE: &str = "case";
/// What the study sets in it, in /input.
const INPUT_SETTINGS: &str = "settings";

/// What the file of a continuation holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct ContinuationFile {
    /// Root attribute `title`.
    pub title: String,
    /// Root attribute `source`.
    pub source: String,
    /// Root attribute `history`.
    pub history: String,
    /// The study's TOML text as given.
    pub study: String,
    /// The text of the base case.
    pub case: String,
    /// What is set in it, KEY=VALUE in each line.
    pub settings: String,
    /// Attributes of /meta.
    pub meta: Vec<(String, AttributeValue)>,
    /// /branches, /points and /curves.
    pub groups: Vec<Addition>,
}

impl ContinuationFile {
    /// Writes the file where a place is reserved: under its name if the study is complete, else as its partial file. Returns where it
    /// is.
    ///
    /// # Errors
    /// Any failure to write.
    pub fn write(&self, place: &Reservation, status: &Status) -> Result<PathBuf, ResultError> {
        place.put(status, |made| self.store(made, status))
    }

    fn store(&self, path: &Path, status: &Status) -> hdf5::Result<()> {
        let file = create_file(path, LibraryVersion::Earliest)?;
        let texts = [
            (schema::root::CONVENTIONS, schema::CONVENTIONS),
            (schema::root::TITLE, &self.title),
            (schema::root::SOURCE, &self.source),
            (schema::root::HISTORY, &self.history),
            (schema::root::FORMAT, schema::CONTINUATION_FORMAT),
            (schema::root::STATUS, status.name()),
        ];
        write_root(&file, &texts)?;
        self.groups.iter().try_for_each(|group| group.write(&file))?;
        let input = create_group(&file, schema::group::INPUT)?;
        write_input(&input, INPUT_STUDY, &self.study, "the study as it was given (TOML)")?;
        write_input(&input, INPUT_CASE, &self.case, "the base case as it was given (TOML)")?;
        write_input(
            &input,
            INPUT_SETTINGS,
            &self.settings,
            "what is set in it, KEY=VALUE in each line",
        )?;
        write_attributes(&create_group(&file, schema::group::META)?, &self.meta)?;
        super::checksums::write(&file, &super::checksums::Known::default())?;
        file.flush()
    }
}

/// A variable of /branches, /points or /curves.
#[derive(Debug, Clone, PartialEq)]
pub struct ContinuationColumn {
    /// Without a slash.
    pub group: &'static str,
    /// Of the variable.
    pub name: String,
    /// One or two lengths.
    pub shape: Vec<usize>,
    /// The last dimension fastest.
    pub values: Vec<f64>,
    /// UDUNITS; "1" of a pure number.
    pub units: String,
    /// What it is.
    pub long_name: String,
    /// What its codes mean; empty where it has none.
    pub flags: Vec<(i64, String)>,
    /// Whether its values are whole numbers.
    pub whole: bool,
}

/// Groups of branches, in their order.
const GROUPS: [&str; 3] = ["branches", "points", "curves"];

/// The branches that a file holds, as columns by name.
#[derive(Debug)]
pub struct StoredContinuation {
    source: Source,
}

impl StoredContinuation {
    /// Whether the file at `path` is one of a continuation.
    pub fn is_one(path: &Path) -> bool {
        Source::open_format(path, schema::CONTINUATION_FORMAT).is_ok()
    }

    /// Opens a file of a continuation.
    ///
    /// # Errors
    /// A file that is not there, of another kind, of a newer version of the program, or damaged.
    pub fn open(path: &Path) -> Result<StoredContinuation, ResultError> {
        Ok(StoredContinuation {
            source: Source::open_format(path, schema::CONTINUATION_FORMAT)?,
        })
    }

    /// Root attribute `title`.
    ///
    /// # Errors
    /// A damaged file.
    pub fn title(&self) -> Result<String, ResultError> {
        Ok(self.source.text_attribute("", schema::root::TITLE)?.unwrap_or_default())
    }

    /// Root attribute `status`: complete, or interrupted.
    ///
    /// # Errors
    /// A damaged file.
    pub fn status(&self) -> Result<String, ResultError> {
        Ok(self
            .source
            .text_attribute("", schema::root::STATUS)?
            .unwrap_or_default())
    }

    /// Every variable of /branches, /points and /curves.
    ///
    /// # Errors
    /// A damaged file.
    pub fn columns(&self) -> Result<Vec<ContinuationColumn>, ResultError> {
        let mut found = Vec::new();
        for group in GROUPS {
            for name in self.members(group)? {
                let path = format!("{group}/{name}");
                let Some(info) = self.source.dataset(&path)? else {
                    continue;
                };
                let described = self.source.described(&path)?;
                found.push(ContinuationColumn {
                    group,
                    values: self.column(&path)?.unwrap_or_default(),
                    shape: info.shape,
                    units: described.units.unwrap_or_else(|| "1".to_owned()),
                    long_name: described.long_name.unwrap_or_default(),
                    flags: described.flags,
                    whole: matches!(info.holds, Holds::Integers(_)),
                    name,
                });
            }
        }
        Ok(found)
    }

    /// A text attribute of a group.
    ///
    /// # Errors
    /// A damaged file.
    pub fn text_attribute(&self, group: &str, name: &str) -> Result<Option<String>, ResultError> {
        self.source.text_attribute(group, name)
    }

    /// A text of /input.
    ///
    /// # Errors
    /// A damaged file.
    pub fn input(&self, name: &str) -> Result<String, ResultError> {
        Ok(self.source.text(&format!("input/{name}"))?.unwrap_or_default())
    }

    /// All values of a variable, the last dimension fastest; none where the file has no such variable.
    ///
    /// # Errors
    /// A damaged file.
    pub fn column(&self, path: &str) -> Result<Option<Vec<f64>>, ResultError> {
        let Some(info) = self.source.dataset(path)? else {
            return Ok(None);
        };
        let whole: Vec<_> = info.shape.iter().map(|&length| 0..length).collect();
        self.source.read(path, &whole).map(Some)
    }

    /// Names of the variables of a group.
    ///
    /// # Errors
    /// A damaged file.
    pub fn members(&self, group: &str) -> Result<Vec<String>, ResultError> {
        Ok(self
            .source
            .members(group)?
            .into_iter()
            .map(|member| member.name)
            .collect())
    }

    /// The words behind the codes of a variable.
    ///
    /// # Errors
    /// A damaged file.
    pub fn words(&self, path: &str) -> Result<Vec<(i64, String)>, ResultError> {
        Ok(self.source.described(path)?.flags)
    }

    /// The unit of a variable.
    ///
    /// # Errors
    /// A damaged file.
    pub fn unit(&self, path: &str) -> Result<String, ResultError> {
        Ok(self.source.described(path)?.units.unwrap_or_default())
    }
}
