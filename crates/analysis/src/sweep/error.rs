//! Errors of a sweep.

use super::journal::JournalError;
use super::runner::Stopped;
use stickslip_files::ResultError;

/// Error of a sweep.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum SweepError {
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    File(#[from] ResultError),
    #[error("{0}")]
    Storage(String),
    /// Impossible request, found before any computation.
    #[error("{0}")]
    Refused(String),
    /// The executor has no workers left, or one cannot compute the points.
    #[error("the executor failed: {0}")]
    Executor(String),
}

impl From<Stopped<JournalError>> for SweepEnd {
    fn from(stopped: Stopped<JournalError>) -> Self {
        match stopped {
            Stopped::Interrupted => SweepEnd::Interrupted,
            Stopped::Delivery(error) => SweepEnd::Error(error.into()),
            Stopped::Storage(message) => SweepEnd::Error(SweepError::Storage(message)),
        }
    }
}

pub(super) enum SweepEnd {
    Interrupted,
    Error(SweepError),
}

impl From<JournalError> for SweepEnd {
    fn from(error: JournalError) -> Self {
        SweepEnd::Error(error.into())
    }
}
