//! The text of a study and where it is from.

use crate::case::builtin::{self, BuiltIn};
use crate::case::{CaseError, CaseSource, Origin, toml_text};
use std::path::{MAIN_SEPARATOR, Path, PathBuf};

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
    /// The study that a name stands for: a file, or one of the built-in studies of a kind.
    ///
    /// # Errors
    /// If the file cannot be read, or is not UTF-8 text; if there is no study of that name: the text lists those there are.
    pub fn find(name: &str, built_in: &[BuiltIn]) -> Result<StudySource, CaseError> {
        let path = Path::new(name);
        if !path.exists() && !name.contains(MAIN_SEPARATOR) && path.extension().is_none() {
            return builtin::find("study", built_in, name).map(|study| StudySource::text(name, study.text));
        }
        let name = path
            .file_stem()
            .map_or_else(|| "study".into(), |stem| stem.to_string_lossy());
        Ok(StudySource {
            text: toml_text(path, "study")?,
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

    /// How messages refer to it.
    pub fn label(&self) -> String {
        match &self.path {
            Some(path) => path.display().to_string(),
            None => format!("built-in study {}", self.name),
        }
    }

    /// The folder from which the names of its files count.
    pub(crate) fn folder(&self) -> PathBuf {
        let folder = self.path.as_ref().and_then(|path| path.parent());
        folder.map_or_else(PathBuf::new, Path::to_owned)
    }

    /// A base case as an argument of a command: a built-in name, or a file relative to the folder of the study.
    pub(crate) fn named(&self, base: &CaseSource) -> String {
        let folder = self.folder();
        match &base.origin {
            Origin::BuiltIn(name) => name.clone(),
            // No study has its base case from there.
            Origin::StandardInput | Origin::Text => "-".to_owned(),
            Origin::File(path) | Origin::Result(path) => {
                path.strip_prefix(&folder).unwrap_or(path).display().to_string()
            }
        }
    }
}
