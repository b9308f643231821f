//! Reader of sweep files.

use std::ops::Range;
use std::path::Path;

use super::schema::{AXES_GROUP, DIGEST, FAILURES, INPUT_CASE, POINT};
use crate::schema;
use crate::source::{DatasetInfo, FileSource, Object, uneven};
use crate::{Reason, ResultError};

/// A sweep file, open for reading.
#[derive(Debug)]
pub struct SweepFile {
    pub(super) source: FileSource,
}

impl SweepFile {
    /// Opens a sweep file. Fails if it is missing, not a sweep file, damaged, or of a newer version.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let source = FileSource::open_known(path)?;
        let file = SweepFile { source };
        match file.text(schema::root::FORMAT).as_deref() {
            Some(schema::SWEEP_FORMAT) => file.source.check_tables().map(|()| file),
            Some(schema::SWEEP_SHARD_FORMAT) => Err(Reason::OnlyAShard.of(path)),
            _ => Err(Reason::NotASweep.of(path)),
        }
    }

    /// Whether the file at `path` is a sweep file.
    pub fn is_one(path: &Path) -> bool {
        FileSource::is_of_format(path, schema::SWEEP_FORMAT)
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// A text attribute of the file (`title`, `status`, `study_digest`) or of a group (`boundary/criterion`).
    pub fn text(&self, name: &str) -> Option<String> {
        let (group, name) = name.rsplit_once('/').unwrap_or(("", name));
        self.source.text_attribute(group, name).ok()?
    }

    /// Base case with the study's settings, in TOML.
    pub fn case_text(&self) -> Option<String> {
        self.source
            .text(&format!("{}/{INPUT_CASE}", schema::group::INPUT))
            .ok()?
    }

    /// Digest of the study.
    pub fn digest(&self) -> Option<String> {
        self.text(DIGEST)
    }

    /// A text attribute of a variable.
    pub fn attribute(&self, variable: &str, name: &str) -> Option<String> {
        self.source.text_attribute(variable, name).ok()?
    }

    /// Names of a group's variables (`/` for the points); none if there is no such group.
    pub fn variables(&self, group: &str) -> Vec<String> {
        let members = self.source.members(group.trim_matches('/')).unwrap_or_default();
        let variables = members
            .into_iter()
            .filter(|member| !matches!(member.is, Object::Group(_)));
        variables.map(|member| member.name).collect()
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
        self.source
            .described(variable)
            .map_or_else(|_| Vec::new(), |described| described.flags)
    }

    /// A numeric attribute of the file, or of a group (`meta/default_rtol`).
    pub fn number(&self, name: &str) -> Option<f64> {
        let (group, name) = name.rsplit_once('/').unwrap_or(("", name));
        self.source.attribute(group, name).ok()??.number()
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
