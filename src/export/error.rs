//! Errors of exports, with place and remedy.

use std::io;
use std::path::{Path, PathBuf};
use stickslip_compare::CompareError;
use stickslip_files::ResultError;

/// An error of an export. The message names the file and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A result file cannot be read.
    #[error(transparent)]
    Result(#[from] ResultError),
    /// A run cannot be evaluated between its samples.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// The request names something that the file does not have, or that the format cannot store.
    #[error("{0}")]
    Asked(String),
    /// A temporary file cannot be written.
    #[error(
        "{folder}: the folder for temporary files: {source}; free some space there, or name another folder in the environment \
         variable TMPDIR"
    )]
    Temporary {
        /// The folder.
        folder: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The export cannot be written.
    #[error("{path}: {action} failed: {source}; check the folder and its disk, or choose another with -o")]
    Io {
        /// The file.
        path: PathBuf,
        /// The action that failed.
        action: &'static str,
        /// The system's error.
        source: io::Error,
    },
}

impl ExportError {
    pub(super) fn temporary(source: io::Error) -> ExportError {
        ExportError::Temporary {
            folder: std::env::temp_dir(),
            source,
        }
    }

    pub(super) fn io(path: &Path, action: &'static str, source: io::Error) -> ExportError {
        ExportError::Io {
            path: path.to_owned(),
            action,
            source,
        }
    }
}
