//! File of a continuation: branches, points, and curves of special points. It is small, and written at the end.

use std::path::{Path, PathBuf};

use super::attributes::{write_attributes, write_input, write_root};
use super::certificate::Addition;
use super::source::{FileSource, Holds, TableReader};
use super::table::{create_file, create_group};
use super::target::Reservation;
use super::{AttributeValue, ResultError, Status, schema};

const INPUT_STUDY: &str = "study";
const INPUT_CASE: &str = "case";
const INPUT_SETTINGS: &str = "settings";

/// Contents of a continuation's file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContinuationFile {
    /// Root attribute `title`.
    pub title: String,
    /// Root attribute `source`.
    pub source: String,
    /// Root attribute `history`.
    pub history: String,
    /// The study's TOML text as given.
    pub study: String,
    /// Text of the base case.
    pub case: String,
    /// Settings in the base case, KEY=VALUE in each line.
    pub settings: String,
    /// Attributes of /meta.
    pub meta: Vec<(String, AttributeValue)>,
    /// /branches, /points and /curves.
    pub groups: Vec<Addition>,
}

impl ContinuationFile {
    /// Writes the file at a reserved place: under its own name if the study is complete, otherwise as its partial
    /// file. Returns the path.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, place: &Reservation, status: &Status) -> Result<PathBuf, ResultError> {
        place.put(status, |made| self.store(made, status))
    }

    fn store(&self, path: &Path, status: &Status) -> hdf5::Result<()> {
        let file = create_file(path)?;
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
            "overrides of the case, KEY=VALUE in each line",
        )?;
        write_attributes(&create_group(&file, schema::group::META)?, &self.meta)?;
        file.flush()
    }
}

/// A variable of /branches, /points or /curves.
#[derive(Debug, Clone, PartialEq)]
pub struct ContinuationColumn {
    /// Group without a slash.
    pub group: &'static str,
    /// Name of the variable.
    pub name: String,
    /// Lengths of its one or two dimensions.
    pub shape: Vec<usize>,
    /// Values, the last dimension fastest.
    pub values: Vec<f64>,
    /// UDUNITS unit; "1" for a pure number.
    pub units: String,
    /// Description.
    pub long_name: String,
    /// Meanings of codes; empty if there are none.
    pub flags: Vec<(i64, String)>,
    /// Whether the values are integers.
    pub whole: bool,
}

const GROUPS: [&str; 3] = ["branches", "points", "curves"];

/// Branches read from a file, as columns by name. All readers fail if the file is damaged.
#[derive(Debug)]
pub struct StoredContinuation {
    source: FileSource,
}

impl StoredContinuation {
    /// Whether the file at `path` is a continuation file.
    pub fn is_one(path: &Path) -> bool {
        FileSource::is_of_format(path, schema::CONTINUATION_FORMAT)
    }

    /// Opens a continuation file. Fails if it is missing, of another kind, of a newer version, or damaged.
    pub fn open(path: &Path) -> Result<StoredContinuation, ResultError> {
        Ok(StoredContinuation {
            source: FileSource::open_format(path, schema::CONTINUATION_FORMAT)?,
        })
    }

    /// Root attribute `title`.
    pub fn title(&self) -> Result<String, ResultError> {
        Ok(self.source.text_attribute("", schema::root::TITLE)?.unwrap_or_default())
    }

    /// Root attribute `status`: complete or interrupted.
    pub fn status(&self) -> Result<String, ResultError> {
        Ok(self
            .source
            .text_attribute("", schema::root::STATUS)?
            .unwrap_or_default())
    }

    /// Every variable of /branches, /points and /curves.
    pub fn columns(&self) -> Result<Vec<ContinuationColumn>, ResultError> {
        let mut found = Vec::new();
        for group in GROUPS {
            for name in self.members(group)? {
                let path = format!("{group}/{name}");
                let Some(info) = self.source.dataset(&path)? else {
                    continue;
                };
                let described = self.source.described(&path)?;
                let whole: Vec<_> = info.shape.iter().map(|&length| 0..length).collect();
                found.push(ContinuationColumn {
                    group,
                    values: self.source.read(&path, &whole)?,
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
    pub fn text_attribute(&self, group: &str, name: &str) -> Result<Option<String>, ResultError> {
        self.source.text_attribute(group, name)
    }

    /// A text of /input.
    pub fn input(&self, name: &str) -> Result<String, ResultError> {
        Ok(self.source.text(&format!("input/{name}"))?.unwrap_or_default())
    }

    /// The columns of a group, for reading.
    pub fn table(&self, group: &'static str) -> Result<TableReader<'_>, ResultError> {
        self.source.table(group)
    }

    /// Names of the variables of a group.
    pub fn members(&self, group: &str) -> Result<Vec<String>, ResultError> {
        Ok(self
            .source
            .members(group)?
            .into_iter()
            .map(|member| member.name)
            .collect())
    }

    /// Codes of a variable with their meanings.
    pub fn words(&self, path: &str) -> Result<Vec<(i64, String)>, ResultError> {
        Ok(self.source.described(path)?.flags)
    }

    /// The unit of a variable.
    pub fn unit(&self, path: &str) -> Result<String, ResultError> {
        Ok(self.source.described(path)?.units.unwrap_or_default())
    }
}
