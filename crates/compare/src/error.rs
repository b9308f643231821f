//! Errors of a comparison: what is wrong, where, and the remedy.

use std::path::{Path, PathBuf};
use stickslip_files::ResultError;

/// An error of a reference, a candidate, or its mapping. Each message names the file, the place and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// A result file that cannot be read.
    #[error(transparent)]
    Result(#[from] ResultError),
    /// Contents of a file that cannot be compared.
    #[error("{path}{}: {what}; {remedy}", at(.place))]
    Content {
        /// The file.
        path: PathBuf,
        /// Line, row, column or key; empty for the whole file.
        place: String,
        /// What is wrong there.
        what: String,
        /// The remedy.
        remedy: String,
    },
    /// A wrong option of the command line.
    #[error("{0}")]
    Option(String),
}

fn at(place: &str) -> String {
    let comma = if place.is_empty() { "" } else { ", " };
    format!("{comma}{place}")
}

impl CompareError {
    pub(super) fn content(
        path: &Path,
        place: impl Into<String>,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        CompareError::Content {
            path: path.to_owned(),
            place: place.into(),
            what: what.into(),
            remedy: remedy.into(),
        }
    }

    pub(super) fn whole(path: &Path, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        CompareError::content(path, "", what, remedy)
    }

    /// An error of a temporary file, for which the candidate is not to blame.
    pub(super) fn temporary(error: std::io::Error) -> Self {
        CompareError::whole(
            &std::env::temp_dir(),
            format!("the folder for temporary files: {error}"),
            "free some space there, or name another folder in the environment variable TMPDIR",
        )
    }

    pub(super) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        move |error| {
            let (what, remedy) = match error.kind() {
                std::io::ErrorKind::NotFound => ("no such file".to_owned(), "check the name"),
                std::io::ErrorKind::PermissionDenied => {
                    ("no permission to read it".to_owned(), "change its permissions")
                }
                _ => (format!("reading failed: {error}"), "check the file and its disk"),
            };
            CompareError::whole(path, what, remedy)
        }
    }
}
