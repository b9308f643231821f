//! Text and origin of a study.

use std::path::{MAIN_SEPARATOR, Path, PathBuf};
use stickslip_case::builtin::{self, BuiltIn};
use stickslip_case::{CaseError, CaseSource, Origin, toml_text};

/// Text and origin of a study.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StudySource {
    /// TOML text.
    pub text: String,
    /// File; `None` for a built-in study.
    pub path: Option<PathBuf>,
    /// Name of the study in results.
    pub name: String,
}

impl StudySource {
    /// Finds a study by name: a readable file, or a built-in study of this kind. The error lists the built-in studies.
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

    /// Study from a text.
    pub fn text(name: &str, text: &str) -> StudySource {
        StudySource {
            text: text.to_owned(),
            path: None,
            name: name.to_owned(),
        }
    }

    /// Name of the study in messages.
    pub fn label(&self) -> String {
        match &self.path {
            Some(path) => path.display().to_string(),
            None => format!("built-in study {}", self.name),
        }
    }

    pub(crate) fn folder(&self) -> PathBuf {
        let folder = self.path.as_ref().and_then(|path| path.parent());
        folder.map_or_else(PathBuf::new, Path::to_owned)
    }

    /// Base case as an argument of a command: a built-in name, or a file relative to the study's folder.
    pub(crate) fn named(&self, base: &CaseSource) -> String {
        let folder = self.folder();
        match &base.origin {
            Origin::BuiltIn(name) => name.clone(),
            // These do not occur in a study.
            Origin::StandardInput | Origin::Text => "-".to_owned(),
            Origin::File(path) | Origin::Result(path) => {
                path.strip_prefix(&folder).unwrap_or(path).display().to_string()
            }
        }
    }
}
