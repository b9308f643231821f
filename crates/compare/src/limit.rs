//! Limits of a comparison: of wall time, and of runs in the search for causes.

use serde::Serialize;
use std::time::{Duration, Instant};

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
