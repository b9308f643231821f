//! Errors of a comparison, with the remedy; limits of its wall time and runs.

use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
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

/// Wall time of a comparison without [`super::Mapping::max_wall_time`], s: well above what the search for a cause takes.
pub(super) const DEFAULT_WALL_TIME: f64 = 600.0;

/// Most runs of the reference's case, or of solvers with steps, in a search for causes. A search takes some hundred to
/// some thousand.
pub(super) const MOST_RUNS: usize = 20_000;

#[derive(Debug, Clone, Copy)]
pub(super) struct Limit {
    /// `None` if it exceeds the clock's range.
    end: Option<Instant>,
    pub allowed: f64,
}

impl Limit {
    /// A limit of this wall time (s) from now on.
    pub fn from_now(allowed: f64) -> Limit {
        let duration = Duration::try_from_secs_f64(allowed).ok();
        Limit {
            end: duration.and_then(|duration| Instant::now().checked_add(duration)),
            allowed,
        }
    }

    pub fn is_over(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }

    /// Whether a search may make no further run after this many.
    pub fn is_over_after(&self, runs: usize) -> bool {
        runs >= MOST_RUNS || self.is_over()
    }
}

/// A search for causes that was ended by its limit of wall time or of runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OutOfTime {
    /// Wall time that the comparison was allowed, s.
    pub allowed: f64,
    /// Number of changes of the reference's run that were tried until then.
    pub tried: usize,
    /// Number of runs until then; a search makes at most 20,000.
    pub runs: usize,
}

impl OutOfTime {
    pub(super) fn words(&self) -> String {
        let OutOfTime { allowed, tried, runs } = *self;
        if runs >= MOST_RUNS {
            return format!(
                "; the search for causes ended after {MOST_RUNS} runs, with {tried} changes of the reference's run tried"
            );
        }
        format!(
            "; the search for causes ended after {allowed} s of wall time, with {tried} changes of the reference's run tried; \
             allow more (--max-wall-time)"
        )
    }
}
