//! Text of a case, and its origin.

use std::path::{Path, PathBuf};

use super::builtin;
use super::document::CaseError;

/// The text of a case file. Its origin is named in messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CaseSource {
    /// The TOML text.
    pub text: String,
    /// Origin of the text.
    pub origin: Origin,
}

/// Origin of the text of a case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// A TOML file.
    File(PathBuf),
    /// One of [`builtin::all`].
    BuiltIn(String),
    /// The input that a result file contains.
    Result(PathBuf),
    /// Standard input.
    StandardInput,
    /// A text in memory.
    Text,
}

const STANDARD_INPUT: &str = "standard input";

impl CaseSource {
    /// Reads a case file.
    ///
    /// # Errors
    /// The file cannot be read, or is not UTF-8 text.
    pub fn file(path: &Path) -> Result<CaseSource, CaseError> {
        Ok(CaseSource {
            text: toml_text(path, "case")?,
            origin: Origin::File(path.to_owned()),
        })
    }

    /// Reads a case from standard input.
    ///
    /// # Errors
    /// Standard input cannot be read, or is not UTF-8 text.
    pub fn standard_input() -> Result<CaseSource, CaseError> {
        let read = crate::input::text_of(std::io::stdin().lock());
        Ok(CaseSource {
            text: checked(read, STANDARD_INPUT, "case")?,
            origin: Origin::StandardInput,
        })
    }

    /// Finds a built-in case.
    ///
    /// # Errors
    /// There is no such name; the message lists the known ones.
    pub fn built_in(name: &str) -> Result<CaseSource, CaseError> {
        let case = builtin::find("case", &builtin::all(), name)?;
        Ok(CaseSource {
            text: case.text.to_owned(),
            origin: Origin::BuiltIn(case.name.to_owned()),
        })
    }

    /// A case from a text in memory.
    pub fn text(text: &str) -> CaseSource {
        CaseSource {
            text: text.to_owned(),
            origin: Origin::Text,
        }
    }

    /// A case from the text that a result file contains.
    pub fn result(path: &Path, text: String) -> CaseSource {
        CaseSource {
            text,
            origin: Origin::Result(path.to_owned()),
        }
    }

    /// Name of the text in messages: `paper.toml`, `built-in case paper`, `the case in paper.h5`.
    pub fn label(&self) -> String {
        match &self.origin {
            Origin::File(path) => path.display().to_string(),
            Origin::BuiltIn(name) => format!("built-in case {name}"),
            Origin::Result(path) => format!("the case in {}", path.display()),
            Origin::StandardInput => STANDARD_INPUT.to_owned(),
            Origin::Text => "the case".to_owned(),
        }
    }

    /// Name of the case, which result files get: the file name without its extension.
    pub fn name(&self) -> String {
        let stem = |path: &Path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        match &self.origin {
            Origin::File(path) | Origin::Result(path) => stem(path).unwrap_or_else(|| "case".to_owned()),
            Origin::BuiltIn(name) => name.clone(),
            Origin::StandardInput | Origin::Text => "case".to_owned(),
        }
    }
}

/// Reads the text of a TOML file. `kind` ("case", "study") is a noun for messages.
pub fn toml_text(path: &Path, kind: &str) -> Result<String, CaseError> {
    checked(crate::input::text(path), &path.display().to_string(), kind)
}

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

/// Text of an error of the operating system, with advice.
pub fn words(error: &std::io::Error) -> String {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::NotFound => "no such file; check the name".to_owned(),
        ErrorKind::IsADirectory => "this is a folder; give a TOML file in it".to_owned(),
        ErrorKind::PermissionDenied => "no permission; change the permissions of the file".to_owned(),
        _ => error.to_string(),
    }
}
