//! Limit of the wall time of a comparison.

use serde::Serialize;
use std::time::{Duration, Instant};

/// Wall time of a comparison without [`super::Mapping::max_wall_time`], s: well above what the search for a cause takes.
pub(super) const DEFAULT_WALL_TIME: f64 = 600.0;

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
}

/// A search for causes that was ended by the limit of its wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OutOfTime {
    /// Wall time that the comparison was allowed, s.
    pub allowed: f64,
    /// Number of changes of the reference's run that were tried until then.
    pub tried: usize,
}
