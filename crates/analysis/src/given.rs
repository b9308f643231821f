//! A case as it is given to a computation: a file, a result whose case is repeated, a built-in case or a text, with its overrides.

use crate::error::Error;
use std::path::{Path, PathBuf};
use stickslip_case::{CaseError, CaseSource, Origin, Override, changed};
use stickslip_files::{ResultError, is_hdf5, open_sound};

const STANDARD_INPUT: &str = "-";

/// A case as it is given.
#[derive(Debug, Clone)]
pub struct GivenCase {
    /// The text from which the case is read.
    pub source: CaseSource,
    /// Text for /input/case. A repeated run passes on the text of the first run.
    pub text: String,
    /// Files from which the case is read. No result replaces them.
    pub files: Vec<PathBuf>,
    /// Overrides with which a repeated run was made, in words.
    changed: Vec<String>,
}

impl From<CaseSource> for GivenCase {
    fn from(source: CaseSource) -> GivenCase {
        let files = match &source.origin {
            Origin::File(path) | Origin::Result(path) => vec![path.clone()],
            _ => Vec::new(),
        };
        GivenCase {
            text: source.text.clone(),
            files,
            source,
            changed: Vec::new(),
        }
    }
}

impl GivenCase {
    /// Reads a file, a result whose case is repeated, a built-in case, or for `-` standard input.
    ///
    /// # Errors
    /// The file cannot be read or is damaged; there is no such built-in case.
    pub fn read(case: &str) -> Result<GivenCase, Error> {
        let path = Path::new(case);
        if path.is_file() && (is_hdf5(path) || path.extension().is_some_and(|e| e == "h5")) {
            return Ok(GivenCase::of_result(path)?);
        }
        let source = if case == STANDARD_INPUT {
            CaseSource::standard_input()?
        } else if path.exists() || looks_like_a_path(case) {
            CaseSource::file(path)?
        } else {
            CaseSource::built_in(case)?
        };
        Ok(source.into())
    }

    /// The case of a result file.
    ///
    /// # Errors
    /// The file cannot be read, is damaged, or is no result.
    pub fn of_result(path: &Path) -> Result<GivenCase, ResultError> {
        let file = open_sound(path)?;
        Ok(GivenCase {
            text: file.case_text()?,
            changed: file.changed(),
            ..CaseSource::result(path, file.resolved()?).into()
        })
    }

    /// What distinguishes the case with these overrides from the one that was written, in words.
    pub fn changed(&self, changes: &[Override]) -> Vec<String> {
        let new = changed(&self.source, &[], changes);
        let key = |line: &str| line.split_once(" = ").map(|(key, _)| key.to_owned());
        let is_kept = |line: &&String| new.iter().all(|new| key(new) != key(line));
        let mut all: Vec<String> = self.changed.iter().filter(is_kept).cloned().collect();
        all.extend(new);
        all
    }

    /// The path of a result as `named`, or the name of the case with a suffix.
    ///
    /// # Errors
    /// A case from standard input has no name.
    pub fn output(&self, named: Option<&Path>, suffix: &str) -> Result<PathBuf, Error> {
        match (named, &self.source.origin) {
            (Some(path), _) => Ok(path.to_owned()),
            (None, Origin::StandardInput) => Err(Error::input(
                "a case from standard input has no name after which its result could be called; name the file with -o, for \
                 example -o result.h5",
            )),
            (None, _) => Ok(PathBuf::from(format!("{}{suffix}", self.source.name()))),
        }
    }
}

/// The overrides of a case from the settings `KEY=VALUE`.
///
/// # Errors
/// A setting is malformed. A key is given twice: one of the values would be lost in silence.
pub fn overrides(settings: &[String]) -> Result<Vec<Override>, CaseError> {
    let parsed = settings.iter().map(|setting| Override::parse(setting));
    let parsed = parsed.collect::<Result<Vec<_>, _>>()?;
    let twice = |(at, change): &(usize, &Override)| parsed[..*at].iter().any(|other| other.key() == change.key());
    match parsed.iter().enumerate().find(twice) {
        None => Ok(parsed),
        Some((_, change)) => {
            let key = change.key();
            let given = parsed.iter().filter(|other| other.key() == key).map(Override::argument);
            let given = given.collect::<Vec<_>>().join(" and ");
            Err(CaseError::one(
                format!("--set {key}"),
                "",
                format!("given twice, as {given}; leave one of them out"),
            ))
        }
    }
}

fn looks_like_a_path(name: &str) -> bool {
    name.contains(std::path::MAIN_SEPARATOR) || Path::new(name).extension().is_some()
}
