//! The text of a study and where it is from.

use crate::case::builtin::{self, BuiltIn};
use crate::case::{CaseError, toml_text};
use std::path::{Path, PathBuf};

/// Every built-in study: the files of `data/studies`.
pub const STUDIES: &[BuiltIn] = &[
    BuiltIn {
        name: "critical-curve",
        text: include_str!("../../data/studies/critical-curve.toml"),
    },
    BuiltIn {
        name: "groan-speed",
        text: include_str!("../../data/studies/groan-speed.toml"),
    },
    BuiltIn {
        name: "belt-stability",
        text: include_str!("../../data/studies/belt-stability.toml"),
    },
];

/// The text of a study, and where it is from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StudySource {
    /// TOML.
    pub text: String,
    /// The file; `None` for a built-in study.
    pub path: Option<PathBuf>,
    /// After which results are named.
    pub name: String,
}

impl StudySource {
    /// Reads a study file.
    ///
    /// # Errors
    /// If the file cannot be read, or is not UTF-8 text.
    pub fn file(path: &Path) -> Result<StudySource, CaseError> {
        let text = toml_text(path, "study")?;
        let name = path
            .file_stem()
            .map_or_else(|| "study".into(), |stem| stem.to_string_lossy());
        Ok(StudySource {
            text,
            name: name.into_owned(),
            path: Some(path.to_owned()),
        })
    }

    /// A study that is at hand.
    pub fn text(name: &str, text: &str) -> StudySource {
        StudySource {
            text: text.to_owned(),
            path: None,
            name: name.to_owned(),
        }
    }

    /// A built-in study.
    ///
    /// # Errors
    /// If there is none of that name; the text lists those there are.
    pub fn built_in(name: &str) -> Result<StudySource, CaseError> {
        StudySource::among(STUDIES, name)
    }

    /// The built-in study of a name among those of one kind.
    pub(crate) fn among(studies: &[BuiltIn], name: &str) -> Result<StudySource, CaseError> {
        builtin::find("study", studies, name).map(|study| StudySource::text(name, study.text))
    }

    /// How messages refer to it.
    pub fn label(&self) -> String {
        match &self.path {
            Some(path) => path.display().to_string(),
            None => format!("built-in study {}", self.name),
        }
    }

    pub(super) fn folder(&self) -> PathBuf {
        let folder = self.path.as_ref().and_then(|path| path.parent());
        folder.map_or_else(PathBuf::new, Path::to_owned)
    }
}
