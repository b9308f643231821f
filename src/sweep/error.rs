//! Why a sweep ends without its file.

use super::journal::JournalError;
use super::runner::Stopped;
use super::shard::{Shard, ShardError};
use crate::results::ResultError;
use std::path::PathBuf;

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
    #[error(
        "{path}: is the file of another study, or of this one before it was changed, so there is nothing to resume; choose another name with -o, or start anew without --resume"
    )]
    OtherStudy { path: PathBuf },
    #[error(
        "{path}: holds another shard ({found}, not {expected}), so there is nothing to resume; choose another name with -o, or start anew without --resume"
    )]
    OtherShard {
        path: PathBuf,
        found: String,
        expected: Shard,
    },
    #[error("{path}: is no folder, and that of the runs is to have this name; choose another name with -o")]
    NoFolder { path: PathBuf },
    #[error(transparent)]
    Shard(#[from] ShardError),
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
