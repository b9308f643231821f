//! Files of studies: their head, and readers of all kinds.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::attributes::{write_attributes, write_changed, write_input, write_root};
use super::parts::Addition;
use super::schema::{StorageKind, TableSchema, Variable};
use super::source::{DatasetInfo, FileSource, Holds, Object, TableReader, uneven};
use super::sweep::{AXES_GROUP, FAILURES, POINT};
use super::table::{TableWriter, create_file, create_group};
use super::target::Reservation;
use super::{AttributeValue, Reason, ResultError, Status, schema};

pub(super) const DIGEST: &str = "study_digest";
pub(super) const INPUT_STUDY: &str = "study";

/// Column of any number of dimensions: its variable, its shape, and its values with the last dimension fastest.
pub type ShapedColumn = (Variable, Vec<usize>, Vec<f64>);

/// Table of a study's file: schema, rows with a number for each variable, and attributes of the group.
pub type StudyTable = (TableSchema, Vec<Vec<f64>>, Vec<(String, AttributeValue)>);

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

    /// Writes the file of a work-precision study with its tables at a reserved place: under its own name if the study is
    /// complete, otherwise as its partial file. Returns the path.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_work_precision(
        &self,
        tables: &[StudyTable],
        place: &Reservation,
        status: &Status,
    ) -> Result<PathBuf, ResultError> {
        self.write(schema::WORK_PRECISION_FORMAT, place, status, |file| {
            for (schema, rows, attributes) in tables {
                let mut table = TableWriter::create(file, schema)?;
                for row in rows {
                    table.push(&[row]);
                }
                table.append()?;
                write_attributes(&file.group(schema.group)?, attributes)?;
            }
            Ok(())
        })
    }

    /// Writes the file of a continuation with its groups /branches, /points and /curves at a reserved place: under its
    /// own name if the study is complete, otherwise as its partial file. Returns the path.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_continuation(
        &self,
        groups: &[Addition],
        place: &Reservation,
        status: &Status,
    ) -> Result<PathBuf, ResultError> {
        self.write(schema::CONTINUATION_FORMAT, place, status, |file| {
            groups.iter().try_for_each(|group| group.write(file))
        })
    }

    fn write(
        &self,
        format: &str,
        place: &Reservation,
        status: &Status,
        content: impl FnOnce(&hdf5::File) -> hdf5::Result<()>,
    ) -> Result<PathBuf, ResultError> {
        place.put(status, |made| {
            let file = self.create(made, format, Some(status))?;
            content(&file)?;
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

    /// A text attribute of the file (`title`, `status`, `study_digest`) or of a group (`boundary/criterion`).
    pub fn text(&self, name: &str) -> Option<String> {
        let (group, name) = name.rsplit_once('/').unwrap_or(("", name));
        self.attribute(group, name)
    }

    /// Like [`Self::text`]; fails if the attribute is unreadable.
    pub fn text_attribute(&self, group: &str, name: &str) -> Result<Option<String>, ResultError> {
        self.source.text_attribute(group, name)
    }

    /// A text of /input. Fails if it is unreadable.
    pub fn input(&self, name: &str) -> Result<Option<String>, ResultError> {
        self.source.text(&format!("{}/{name}", schema::group::INPUT))
    }

    /// Overrides of the base case that are not in the study, in words.
    pub fn changed(&self) -> Vec<String> {
        self.source.changed()
    }

    /// Base case with the study's settings, in TOML.
    pub fn case_text(&self) -> Option<String> {
        self.input(schema::INPUT_CASE).ok()?
    }

    /// Digest of the study.
    pub fn digest(&self) -> Option<String> {
        self.text(DIGEST)
    }

    /// A text attribute of a variable.
    pub fn attribute(&self, variable: &str, name: &str) -> Option<String> {
        self.text_attribute(variable, name).ok()?
    }

    /// Names of a group's variables (`/` for the points); none if there is no such group.
    pub fn variables(&self, group: &str) -> Vec<String> {
        let members = self.source.members(group.trim_matches('/')).unwrap_or_default();
        let variables = members
            .into_iter()
            .filter(|member| !matches!(member.is, Object::Group(_)));
        variables.map(|member| member.name).collect()
    }

    /// The columns of a group, for reading.
    pub fn table(&self, group: &str) -> Result<TableReader<'_>, ResultError> {
        self.source.table(group)
    }

    /// Every variable of a group. Fails if one is unreadable.
    pub fn columns(&self, group: &str) -> Result<Vec<ShapedColumn>, ResultError> {
        let mut found = Vec::new();
        for member in self.source.members(group)? {
            let path = format!("{group}/{}", member.name);
            let Some(info) = self.source.dataset(&path)? else {
                continue;
            };
            let kind = match info.holds {
                Holds::Integers(_) => StorageKind::Int64,
                _ => StorageKind::Float64,
            };
            let variable = self.source.described(&path)?.variable(member.name, kind);
            let all: Vec<Range<usize>> = info.shape.iter().map(|&length| 0..length).collect();
            let values = self.source.read(&path, &all)?;
            found.push((variable, info.shape, values));
        }
        Ok(found)
    }

    /// Dimensions of a variable. Fails if there is no such variable.
    pub fn shape(&self, variable: &str) -> Result<Vec<usize>, ResultError> {
        self.dataset(variable).map(|info| info.shape)
    }

    pub(super) fn dataset(&self, variable: &str) -> Result<DatasetInfo, ResultError> {
        self.source.dataset(variable)?.ok_or_else(|| self.missing(variable))
    }

    /// A whole variable as doubles, the last dimension fastest. Fails if it is missing or unreadable, or if it is in
    /// a group and not as long as the group's other variables.
    pub fn numbers(&self, variable: &str) -> Result<Vec<f64>, ResultError> {
        // The axes of a shard's grid are dimensions, each with its own length.
        if let Some((group, name)) = variable.rsplit_once('/')
            && group != AXES_GROUP
        {
            return self.source.table(group)?.column(name);
        }
        let info = self.dataset(variable)?;
        let all: Vec<Range<usize>> = info.shape.iter().map(|&length| 0..length).collect();
        self.source.read(variable, &all)
    }

    /// Like [`Self::numbers`], with NaN instead of the fill value.
    pub fn values(&self, variable: &str) -> Result<Vec<f64>, ResultError> {
        let mut values = self.numbers(variable)?;
        if let Some(fill) = self.source.described(variable)?.count_fill() {
            for value in values.iter_mut().filter(|value| **value == fill as f64) {
                *value = f64::NAN;
            }
        }
        Ok(values)
    }

    /// Codes of a variable with their meanings; none for numbers.
    pub fn flags(&self, variable: &str) -> Vec<(i64, String)> {
        self.words(variable).unwrap_or_default()
    }

    /// Words of a variable's codes. Fails if they are unreadable.
    pub fn words(&self, variable: &str) -> Result<Vec<(i64, String)>, ResultError> {
        Ok(self.source.described(variable)?.flags)
    }

    /// Names of the members of a group; none if there is no such group. Fails if they are unreadable.
    pub fn names(&self, group: &str) -> Result<Vec<String>, ResultError> {
        let members = self.source.members(group)?.into_iter();
        Ok(members.map(|member| member.name).collect())
    }

    /// A numeric attribute of a group. Fails if it is unreadable.
    pub fn number_attribute(&self, group: &str, name: &str) -> Result<Option<f64>, ResultError> {
        Ok(self.source.attribute(group, name)?.and_then(|value| value.number()))
    }

    /// A numeric attribute of the file, or of a group (`meta/default_rtol`).
    pub fn number(&self, name: &str) -> Option<f64> {
        let (group, name) = name.rsplit_once('/').unwrap_or(("", name));
        self.number_attribute(group, name).ok()?
    }

    /// Whether a variable has integer values.
    pub fn is_whole(&self, variable: &str) -> bool {
        let described = self.source.described(variable);
        described.is_ok_and(|described| described.count_fill().is_some())
    }

    /// Whether the points form a grid, whose axes are its dimensions.
    pub fn is_grid(&self) -> bool {
        !self.variables("/").iter().any(|name| name == POINT)
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
