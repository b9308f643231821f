//! Limit on the wall time of a command with many runs.

use std::time::{Duration, Instant};

pub(super) const INTERRUPTED: &str = "interrupted";

/// Deadline of a command; none by default.
#[derive(Debug, Clone, Copy, Default)]
pub struct Deadline {
    /// `None` without a limit, or if the limit exceeds the clock's range.
    end: Option<Instant>,
    allowed: f64,
}

impl Deadline {
    /// Deadline `seconds` after `begin`.
    pub fn after(begin: Instant, seconds: Option<f64>) -> Deadline {
        let duration = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Deadline {
            end: duration.and_then(|duration| begin.checked_add(duration)),
            allowed: seconds.unwrap_or_default(),
        }
    }

    /// Whether the deadline has passed.
    pub fn is_over(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }

    /// Wall time (s) left for a run that begins now and may have a limit of its own.
    pub fn limit(&self, own: Option<f64>) -> Option<f64> {
        let left = self
            .end
            .map(|end| end.saturating_duration_since(Instant::now()).as_secs_f64());
        own.into_iter().chain(left).reduce(f64::min)
    }

    /// Reason why a part is missing. An interruption that the user did not request is due to the deadline.
    pub fn explain(&self, why: String, stopped: bool) -> String {
        if why != INTERRUPTED || stopped {
            return why;
        }
        format!(
            "the wall time of {} s was over before their runs were done; allow more (--max-wall-time)",
            self.allowed
        )
    }
}
