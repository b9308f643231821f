//! Why a sweep ends without its file.

use super::journal::JournalError;
use super::runner::Stopped;
use crate::results::ResultError;

/// Why a sweep ended without its file.
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
    /// What is asked for cannot be, which shows before anything is computed.
    #[error("{0}")]
    Refused(String),
    #[error("{} no longer answers; what was computed is in the journals, and --resume goes on from there", ranks(.silent))]
    Lost { silent: Vec<usize> },
}

fn ranks(silent: &[usize]) -> String {
    let numbers: Vec<String> = silent.iter().map(usize::to_string).collect();
    match &numbers[..] {
        [one] => format!("rank {one}"),
        _ => format!("each of the ranks {}", numbers.join(", ")),
    }
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

/// Why the points were not all run.
pub(super) enum SweepEnd {
    Interrupted,
    Error(SweepError),
}

impl From<JournalError> for SweepEnd {
    fn from(error: JournalError) -> Self {
        SweepEnd::Error(error.into())
    }
}
