//! What can go wrong with a page: what, where, and what to do.

use std::io;
use std::path::{Path, PathBuf};

use crate::results::ResultError;

/// An error of the page; each message names the file and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PageError {
    /// The result file cannot be read.
    #[error(transparent)]
    Result(#[from] ResultError),
    /// Nothing to show.
    #[error(
        "{path}: has no samples yet, so there is nothing to show; wait until the run has written some, or repeat it"
    )]
    Empty {
        /// The result file.
        path: PathBuf,
    },
    /// The page would replace what it is made from.
    #[error("{path}: this is the result file that the page is made from; choose another name with --html")]
    IsInput {
        /// The page.
        path: PathBuf,
    },
    /// A folder stands where the page goes.
    #[error("{path}: this is a folder; name a file in it, for example --html {}", .path.join("report.html").display())]
    IsFolder {
        /// The page.
        path: PathBuf,
    },
    /// The path has no last part.
    #[error("{path}: not a usable file name; name the page with --html, for example --html report.html")]
    NoFileName {
        /// The page.
        path: PathBuf,
    },
    /// Nowhere to put the page.
    #[error("{path}: the folder {folder} does not exist; create it, or choose another with --html")]
    NoFolder {
        /// The page.
        path: PathBuf,
        /// What is missing.
        folder: PathBuf,
    },
    /// Somebody else's file.
    #[error(
        "{path}: exists and is not a page of this program, so it is not replaced; choose another name with --html, or replace it with --force"
    )]
    Foreign {
        /// The page.
        path: PathBuf,
    },
    /// A file that its owner protects.
    #[error("{path}: exists and is write-protected; choose another name with --html, or replace it with --force")]
    Protected {
        /// The page.
        path: PathBuf,
    },
    /// The operating system refuses.
    #[error("{path}: {action} failed: {source}; check the folder and its disk, or choose another with --html")]
    Io {
        /// The page.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The operating system's error.
        source: io::Error,
    },
    /// Never for the documents of this program, whose keys are texts.
    #[error("{path}: the page's data cannot be written as JSON: {source}; report this as an error of the program")]
    Json {
        /// The page.
        path: PathBuf,
        /// The serialiser's error.
        source: serde_json::Error,
    },
}

impl PageError {
    pub(super) fn io(path: &Path, action: &'static str, source: io::Error) -> Self {
        PageError::Io {
            path: path.to_owned(),
            action,
            source,
        }
    }
}
