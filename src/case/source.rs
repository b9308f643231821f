//! The text of a case and where it is from.

use std::path::{Path, PathBuf};

use super::builtin;
use super::error::CaseError;

/// The text of a case file, and where it is from for messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CaseSource {
    /// The TOML text.
    pub text: String,
    /// Where it is from.
    pub origin: Origin,
}

/// Where the text of a case is from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// A TOML file.
    File(PathBuf),
    /// One of [`builtin::all`].
    BuiltIn(String),
    /// The input kept in a result file.
    Result(PathBuf),
    /// Standard input.
    StandardInput,
    /// A program that has the text at hand.
    Text,
}

/// How messages call standard input.
const STANDARD_INPUT: &str = "standard input";

impl CaseSource {
    /// Reads a case file.
    ///
    /// # Errors
    /// If the file cannot be read, or is not UTF-8 text.
    pub fn file(path: &Path) -> Result<CaseSource, CaseError> {
        Ok(CaseSource {
            text: toml_text(path, "case")?,
            origin: Origin::File(path.to_owned()),
        })
    }

    /// A case that comes through standard input.
    ///
    /// # Errors
    /// If it cannot be read, or is not UTF-8 text.
    pub fn standard_input() -> Result<CaseSource, CaseError> {
        let read = crate::input::text_of(std::io::stdin().lock());
        Ok(CaseSource {
            text: checked(read, STANDARD_INPUT, "case")?,
            origin: Origin::StandardInput,
        })
    }

    /// A built-in case.
    ///
    /// # Errors
    /// If there is none of that name; the text lists those there are.
    pub fn built_in(name: &str) -> Result<CaseSource, CaseError> {
        let case = builtin::find("case", &builtin::all(), name)?;
        Ok(CaseSource {
            text: case.text.to_owned(),
            origin: Origin::BuiltIn(case.name.to_owned()),
        })
    }

    /// A case that a program has at hand.
    pub fn text(text: &str) -> CaseSource {
        CaseSource {
            text: text.to_owned(),
            origin: Origin::Text,
        }
    }

    /// The case text kept in a result file.
    pub fn result(path: &Path, text: String) -> CaseSource {
        CaseSource {
            text,
            origin: Origin::Result(path.to_owned()),
        }
    }

    /// How messages refer to the text: `paper.toml`, `built-in case paper`, `the case in paper.h5`.
    pub fn label(&self) -> String {
        match &self.origin {
            Origin::File(path) => path.display().to_string(),
            Origin::BuiltIn(name) => format!("built-in case {name}"),
            Origin::Result(path) => format!("the case in {}", path.display()),
            Origin::StandardInput => STANDARD_INPUT.to_owned(),
            Origin::Text => "the case".to_owned(),
        }
    }

    /// The name of the case, after which results are named: the file's without extension.
    pub fn name(&self) -> String {
        let stem = |path: &Path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        match &self.origin {
            Origin::File(path) | Origin::Result(path) => stem(path).unwrap_or_else(|| "case".to_owned()),
            Origin::BuiltIn(name) => name.clone(),
            Origin::StandardInput | Origin::Text => "case".to_owned(),
        }
    }
}

/// The text of a TOML file of this kind: "case", "study".
pub(crate) fn toml_text(path: &Path, kind: &str) -> Result<String, CaseError> {
    checked(crate::input::text(path), &path.display().to_string(), kind)
}

/// What was read, as a text.
fn checked(read: std::io::Result<Result<String, Option<usize>>>, label: &str, kind: &str) -> Result<String, CaseError> {
    let text = read.map_err(|error| {
        let message = format!("the {kind} file cannot be read: {}", words(&error));
        CaseError::one(label, "", message)
    })?;
    text.map_err(|line| {
        let message = format!("not a {kind} file: expected TOML, which is UTF-8 text");
        match line {
            Some(line) => CaseError::one(format!("{label}:{line}"), "", message + "; save the file as UTF-8"),
            None => CaseError::one(label, "", message),
        }
    })
}

/// The operating system's error with what to do about it.
pub(crate) fn words(error: &std::io::Error) -> String {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::NotFound => "no such file; check the name".to_owned(),
        ErrorKind::IsADirectory => "this is a folder; give a TOML file in it".to_owned(),
        ErrorKind::PermissionDenied => "no permission; change the permissions of the file".to_owned(),
        _ => error.to_string(),
    }
}
