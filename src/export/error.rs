//! Why a table cannot be exported: what, where, and what to do.

use crate::compare::CompareError;
use crate::results::ResultError;
use std::io;
use std::path::{Path, PathBuf};

/// An error of an export; each message names the file and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A result file that cannot be read.
    #[error(transparent)]
    Result(#[from] ResultError),
    /// A run that cannot be evaluated between its samples.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Something is asked for that the file does not have, or the format cannot hold.
    #[error("{0}")]
    Asked(String),
    /// Writing failed.
    #[error("{path}: {action} failed: {source}; check the folder and its disk, or choose another with -o")]
    Io {
        /// The file that is written.
        path: PathBuf,
        /// What was being done.
        action: &'static str,
        /// By the operating system.
        source: io::Error,
    },
}

impl ExportError {
    /// An error of the operating system.
    pub(super) fn io(path: &Path, action: &'static str, source: io::Error) -> ExportError {
        ExportError::Io {
            path: path.to_owned(),
            action,
            source,
        }
    }
}
