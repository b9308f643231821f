//! The limit of wall time of a command that makes many runs.

use std::time::{Duration, Instant};

/// What a part that was stopped says of itself.
pub(super) const INTERRUPTED: &str = "interrupted";

/// The end of the wall time that a command may take in all; by default there is none.
#[derive(Debug, Clone, Copy, Default)]
pub struct Deadline {
    /// None where it is too far away to be said.
    end: Option<Instant>,
    /// s, for messages.
    allowed: f64,
}

impl Deadline {
    /// So many seconds after `begin`, as [`SolverOptions::max_wall_time`](crate::simulation::SolverOptions) has them.
    pub fn after(begin: Instant, seconds: Option<f64>) -> Deadline {
        let duration = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Deadline {
            end: duration.and_then(|duration| begin.checked_add(duration)),
            allowed: seconds.unwrap_or_default(),
        }
    }

    /// Whether nothing more may be begun.
    pub fn is_over(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }

    /// The wall time (s) that a run may take which begins now and has a limit of its own.
    pub fn limit(&self, own: Option<f64>) -> Option<f64> {
        let left = self
            .end
            .map(|end| end.saturating_duration_since(Instant::now()).as_secs_f64());
        own.into_iter().chain(left).reduce(f64::min)
    }

    /// Why a part is missing that ended for this reason: what was stopped without a wish of the user was stopped by the deadline.
    pub(super) fn explain(&self, why: String, stopped: bool) -> String {
        if why != INTERRUPTED || stopped {
            return why;
        }
        format!(
            "the wall time of {} s was over before their runs were done; allow more (--max-wall-time)",
            self.allowed
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn property_a_limit_is_never_more_than_what_is_left() {
        let now = Instant::now();
        let none = Deadline::after(now, None);
        assert!(!none.is_over() && !Deadline::default().is_over());
        assert_eq!((none.limit(None), none.limit(Some(3.0))), (None, Some(3.0)));
        let nothing = Deadline::after(now, Some(0.0));
        assert!(nothing.is_over());
        assert_eq!((nothing.limit(None), nothing.limit(Some(3.0))), (Some(0.0), Some(0.0)));
        let hour = Deadline::after(now, Some(3600.0));
        assert!(!hour.is_over());
        assert_eq!(hour.limit(Some(3.0)), Some(3.0));
        assert!(hour.limit(None).is_some_and(|left| left > 0.0 && left <= 3600.0));
        // Beyond every clock.
        assert!(!Deadline::after(now, Some(1e300)).is_over());
    }

    #[test]
    fn property_who_stopped_a_part_is_told_apart() {
        let deadline = Deadline::after(Instant::now(), Some(3.0));
        assert_eq!(deadline.explain(INTERRUPTED.to_owned(), true), INTERRUPTED);
        assert_eq!(deadline.explain("no series".to_owned(), false), "no series");
        let said = deadline.explain(INTERRUPTED.to_owned(), false);
        assert!(said.contains("3 s") && said.contains("--max-wall-time"), "{said}");
    }
}
