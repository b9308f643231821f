//! Files of studies: their head, and readers of all kinds.

use std::path::{Path, PathBuf};

use super::attributes::{write_attributes, write_changed, write_input, write_root};
use super::parts::Addition;
use super::schema::{StorageKind, Variable};
use super::source::{DatasetInfo, FileSource, Holds, Object, TableReader, joined, uneven, whole};
use super::sweep::{AXES_GROUP, FAILURES, POINT};
use super::table::{create_file, create_group};
use super::target::Reservation;
use super::{AttributeValue, Reason, ResultError, Status, schema};

pub(super) const DIGEST: &str = "study_digest";
pub(super) const INPUT_STUDY: &str = "study";

/// Column of any number of dimensions: its variable, its shape, and its values with the last dimension fastest.
pub type ShapedColumn = (Variable, Vec<usize>, Vec<f64>);

/// Head of a study's file: root attributes, texts of /input, and attributes of /meta.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StudyHeader {
    /// Root attribute `title`.
    pub title: String,
    /// Program with its version; root attribute `source`.
    pub source: String,
    /// Root attribute `history`. In a sweep it has no time, so that the same study gives the same file.
    pub history: String,
    /// Publication of the model; root attribute `references` of a sweep.
    pub references: Option<String>,
    /// Digest that identifies the study; root attribute `study_digest` of a sweep, otherwise empty.
    pub digest: String,
    /// /input/study: the study's TOML text as given.
    pub study: String,
    /// Further texts of /input: name, description, text.
    pub inputs: Vec<(&'static str, &'static str, String)>,
    /// Overrides of the base case that are not in the study, such as `friction.decay = 4 s/rad`.
    pub changed: Vec<String>,
    /// Attributes of /meta.
    pub meta: Vec<(String, AttributeValue)>,
}

impl StudyHeader {
    /// The base case of a sweep as a text of /input.
    pub fn case_of_sweep(text: String) -> (&'static str, &'static str, String) {
        (schema::INPUT_CASE, "the base case (TOML)", text)
    }

    /// Creates a file with the root attributes. A file that grows gets its status at the end.
    pub(super) fn create(&self, path: &Path, format: &str, status: Option<&Status>) -> hdf5::Result<hdf5::File> {
        let file = create_file(path)?;
        let mut texts = vec![
            (schema::root::CONVENTIONS, schema::CONVENTIONS),
            (schema::root::TITLE, &self.title),
            (schema::root::SOURCE, &self.source),
            (schema::root::HISTORY, &self.history),
        ];
        let references = self.references.iter();
        texts.extend(references.map(|text| (schema::root::REFERENCES, text.as_str())));
        texts.push((schema::root::FORMAT, format));
        texts.extend(Some((DIGEST, self.digest.as_str())).filter(|digest| !digest.1.is_empty()));
        texts.extend(status.map(|status| (schema::root::STATUS, status.name())));
        write_root(&file, &texts)?;
        Ok(file)
    }

    /// Writes /input and /meta.
    pub(super) fn write_input(&self, file: &hdf5::File) -> hdf5::Result<()> {
        let input = create_group(file, schema::group::INPUT)?;
        write_input(&input, INPUT_STUDY, &self.study, "the study as it was given (TOML)")?;
        for (name, long_name, text) in &self.inputs {
            write_input(&input, name, text, long_name)?;
        }
        write_changed(&input, &self.changed)?;
        write_attributes(&create_group(file, schema::group::META)?, &self.meta)
    }

    /// Writes the file of a work-precision study or a continuation, which is of the format `format`, with its groups at a
    /// reserved place: under its own name if the study is complete, otherwise as its partial file. Returns the path.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(
        &self,
        format: &'static str,
        groups: &[Addition],
        place: &Reservation,
        status: &Status,
    ) -> Result<PathBuf, ResultError> {
        place.put(status, |made| {
            let file = self.create(made, format, Some(status))?;
            groups.iter().try_for_each(|group| group.write(&file))?;
            self.write_input(&file)?;
            file.flush()
        })
    }
}

/// The file of a study, open for reading.
#[derive(Debug)]
pub struct StudyFile {
    pub(super) source: FileSource,
}

impl StudyFile {
    /// Opens the file of a study in a format of [`schema`]. Fails if it is missing, of another format, of a newer version,
    /// or damaged.
    pub fn open(path: &Path, format: &'static str) -> Result<Self, ResultError> {
        let source = FileSource::open_format(path, format)?;
        Ok(StudyFile { source })
    }

    /// Whether the file at `path` is of this format.
    pub fn is(path: &Path, format: &'static str) -> bool {
        let is_uneven = |error: ResultError| matches!(error.reason, Reason::Uneven { .. });
        Self::open(path, format).map_or_else(is_uneven, |_| true)
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// A text attribute by its path: `title` of the file, `boundary/criterion` of a group, `points/period/units` of a
    /// variable. `None` without such an attribute. Fails if it is unreadable.
    pub fn text(&self, path: &str) -> Result<Option<String>, ResultError> {
        let (owner, name) = path.rsplit_once('/').unwrap_or(("", path));
        self.source.text_attribute(owner, name)
    }

    /// A numeric attribute by its path, like [`Self::text`].
    pub fn number(&self, path: &str) -> Result<Option<f64>, ResultError> {
        let (owner, name) = path.rsplit_once('/').unwrap_or(("", path));
        Ok(self.source.attribute(owner, name)?.and_then(|value| value.number()))
    }

    /// A text of /input. Fails if it is unreadable.
    pub fn input(&self, name: &str) -> Result<Option<String>, ResultError> {
        self.source.text(&format!("{}/{name}", schema::group::INPUT))
    }

    /// Overrides of the base case that are not in the study, in words.
    pub fn changed(&self) -> Vec<String> {
        self.source.changed()
    }

    /// Digest of the study. Fails if it is unreadable.
    pub fn digest(&self) -> Result<Option<String>, ResultError> {
        self.text(DIGEST)
    }

    /// Names of a group's variables, of the points for an empty name; none without such a group. Fails if they are
    /// unreadable.
    pub fn names(&self, group: &str) -> Result<Vec<String>, ResultError> {
        if !group.is_empty() && !self.source.has(group)? {
            return Ok(Vec::new());
        }
        // Earlier versions stored checksums next to the variables.
        let variables = self.source.members(group)?.into_iter();
        let variables =
            variables.filter(|one| matches!(one.is, Object::Dataset(_) | Object::Not(_)) && one.name != schema::SUMS);
        Ok(variables.map(|member| member.name).collect())
    }

    /// The columns of a group, for reading.
    pub fn table(&self, group: &str) -> Result<TableReader<'_>, ResultError> {
        self.source.table(group)
    }

    /// Every variable of a group, with NaN instead of fill values. Fails if one is unreadable.
    pub fn columns(&self, group: &str) -> Result<Vec<ShapedColumn>, ResultError> {
        let mut found = Vec::new();
        for name in self.names(group)? {
            let path = joined(group, &name);
            let (variable, shape) = (self.variable(&path)?, self.shape(&path)?);
            let mut values = self.source.read(&path, &whole(&shape))?;
            if let Some(fill) = variable.fill {
                let missing = values.iter_mut().filter(|value| **value == fill as f64);
                missing.for_each(|value| *value = f64::NAN);
            }
            found.push((variable, shape, values));
        }
        Ok(found)
    }

    /// Type, unit, description and codes of a variable. Fails if there is no such variable.
    pub fn variable(&self, path: &str) -> Result<Variable, ResultError> {
        let kind = match self.dataset(path)?.holds {
            Holds::Integers(_) => StorageKind::Int64,
            _ => StorageKind::Float64,
        };
        let name = path.rsplit('/').next().unwrap_or(path).to_owned();
        Ok(self.source.described(path)?.variable(name, kind))
    }

    /// Dimensions of a variable. Fails if there is no such variable.
    pub fn shape(&self, path: &str) -> Result<Vec<usize>, ResultError> {
        self.dataset(path).map(|info| info.shape)
    }

    pub(super) fn dataset(&self, path: &str) -> Result<DatasetInfo, ResultError> {
        self.source.dataset(path)?.ok_or_else(|| self.missing(path))
    }

    /// A whole variable as doubles, the last dimension fastest. Fails if it is missing or unreadable, or if it is in
    /// a group and not as long as the group's other variables.
    pub fn numbers(&self, path: &str) -> Result<Vec<f64>, ResultError> {
        // The axes of a shard's grid are dimensions, each with its own length.
        if let Some((group, name)) = path.rsplit_once('/')
            && group != AXES_GROUP
        {
            return self.source.table(group)?.column(name);
        }
        self.source.read(path, &whole(&self.shape(path)?))
    }

    /// Whether the points form a grid, whose axes are its dimensions. Fails if the file is unreadable.
    pub fn is_grid(&self) -> Result<bool, ResultError> {
        Ok(self.source.dataset(POINT)?.is_none())
    }

    /// Failed points with their messages. Fails if they are unreadable.
    pub fn failures(&self) -> Result<Vec<(u64, String)>, ResultError> {
        let group = FAILURES.0;
        let point = format!("{group}/{POINT}");
        if self.source.dataset(&point)?.is_none() {
            return Ok(Vec::new());
        }
        let numbers = self.numbers(&point)?;
        let texts = self.source.texts(&format!("{group}/message"))?;
        if texts.len() != numbers.len() {
            return Err(uneven(&format!("{group}/message"), &[texts.len()], &[numbers.len()]).of(self.path()));
        }
        Ok(numbers.into_iter().map(|number| number as u64).zip(texts).collect())
    }

    pub(super) fn missing(&self, what: &str) -> ResultError {
        self.source.missing(format!("variable {what}"))
    }
}
