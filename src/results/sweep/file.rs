//! Reads the file of a sweep.

use std::ops::Range;
use std::path::Path;

use super::schema::{DIGEST, FAILURES, INPUT_CASE, POINT};
use crate::results::schema;
use crate::results::source::{DatasetInfo, Object, Source};
use crate::results::{Reason, ResultError};

/// A sweep file, open for reading.
#[derive(Debug)]
pub struct SweepFile {
    pub(super) source: Source,
}

impl SweepFile {
    /// Opens the file of a sweep.
    ///
    /// # Errors
    /// A file that is not there, is no sweep file, is damaged, or is of a newer version of the program.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let source = Source::open_known(path)?;
        let file = SweepFile { source };
        match file.text(schema::root::FORMAT).as_deref() {
            Some(schema::SWEEP_FORMAT) => Ok(file),
            Some(schema::SWEEP_SHARD_FORMAT) => Err(Reason::OnlyAShard.of(path)),
            _ => Err(Reason::NotASweep.of(path)),
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// A text attribute of the file, such as `title`, `status` or `study_digest`, or of a group, as in
    /// `boundary/criterion`.
    pub fn text(&self, name: &str) -> Option<String> {
        let (group, name) = name.rsplit_once('/').unwrap_or(("", name));
        self.source.text_attribute(group, name).ok()?
    }

    /// The base case with what the study sets, in TOML; `None` of a file that does not say it.
    pub fn case_text(&self) -> Option<String> {
        self.source
            .text(&format!("{}/{INPUT_CASE}", schema::group::INPUT))
            .ok()?
    }

    /// The digest of its study.
    pub fn digest(&self) -> Option<String> {
        self.text(DIGEST)
    }

    /// A text attribute of a variable.
    pub fn attribute(&self, variable: &str, name: &str) -> Option<String> {
        self.source.text_attribute(variable, name).ok()?
    }

    /// The names of the variables in a group, `/` for the points themselves; none if there is no such group.
    pub fn variables(&self, group: &str) -> Vec<String> {
        let members = self.source.members(group.trim_matches('/')).unwrap_or_default();
        let variables = members
            .into_iter()
            .filter(|member| !matches!(member.is, Object::Group(_)));
        variables.map(|member| member.name).collect()
    }

    /// The dimensions of a variable.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn shape(&self, variable: &str) -> Result<Vec<usize>, ResultError> {
        self.dataset(variable).map(|info| info.shape)
    }

    pub(super) fn dataset(&self, variable: &str) -> Result<DatasetInfo, ResultError> {
        self.source.dataset(variable)?.ok_or_else(|| self.missing(variable))
    }

    /// A whole variable as numbers, the last dimension fastest; whole numbers are converted.
    ///
    /// # Errors
    /// If there is none of that name, or it cannot be read.
    pub fn numbers(&self, variable: &str) -> Result<Vec<f64>, ResultError> {
        let info = self.dataset(variable)?;
        let all: Vec<Range<usize>> = info.shape.iter().map(|&length| 0..length).collect();
        self.source.read(variable, &all)
    }

    /// A whole variable as numbers, NaN where it has its fill value.
    ///
    /// # Errors
    /// If there is none of that name, or it cannot be read.
    pub fn values(&self, variable: &str) -> Result<Vec<f64>, ResultError> {
        let mut values = self.numbers(variable)?;
        if let Some(fill) = self.source.described(variable)?.count_fill() {
            for value in values.iter_mut().filter(|value| **value == fill as f64) {
                *value = f64::NAN;
            }
        }
        Ok(values)
    }

    /// The codes of a variable and what they mean; none of one whose values are numbers.
    pub fn flags(&self, variable: &str) -> Vec<(i64, String)> {
        self.source
            .described(variable)
            .map_or_else(|_| Vec::new(), |described| described.flags)
    }

    /// A number among the attributes of the file, or of a group, as in `meta/default_rtol`.
    pub fn number(&self, name: &str) -> Option<f64> {
        let (group, name) = name.rsplit_once('/').unwrap_or(("", name));
        self.source.attribute(group, name).ok()??.number()
    }

    /// Whether the values of a variable are whole numbers.
    pub fn is_whole(&self, variable: &str) -> bool {
        let described = self.source.described(variable);
        described.is_ok_and(|described| described.count_fill().is_some())
    }

    /// Whether its points lie in a grid, whose axes are its dimensions.
    pub fn is_grid(&self) -> bool {
        !self.variables("/").iter().any(|name| name == POINT)
    }

    /// The points that failed, each with its message.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn failures(&self) -> Result<Vec<(u64, String)>, ResultError> {
        let group = FAILURES.0;
        let point = format!("{group}/{POINT}");
        if self.source.dataset(&point)?.is_none() {
            return Ok(Vec::new());
        }
        let numbers = self.numbers(&point)?;
        let texts = self.source.texts(&format!("{group}/message"))?;
        Ok(numbers.into_iter().map(|number| number as u64).zip(texts).collect())
    }

    pub(super) fn missing(&self, what: &str) -> ResultError {
        self.source.missing(format!("variable {what}"))
    }
}
