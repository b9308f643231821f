//! The first event of a candidate that is wrong.

use super::event_errors::EventErrors;
use crate::record::sequence::{Difference, Fault};
use serde::Serialize;

/// The first event that is wrong: where the sequences part, or before that the first matched event whose time is off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WrongEvent {
    /// 0-based position in the reference's word.
    pub position: usize,
    /// In the reference; of a spurious event in the candidate.
    pub kind: &'static str,
    /// In the reference; of a spurious event in the candidate; s.
    pub time: f64,
    /// Of a matched event: candidate minus reference, s.
    pub error: Option<f64>,
    /// Of an event without a match: what is wrong.
    pub fault: Option<Fault>,
    /// Error beyond which a matched event counts as wrong, s.
    pub tolerance: f64,
}

/// Part of the period by which an event is wrong whatever the others do: so much is seen in a figure of some periods.
const WRONG: f64 = 1e-2;

/// Part of the period below which no event is wrong.
const RIGHT: f64 = 1e-4;

/// In between, an event is wrong whose error is this multiple of what a quarter of the events are within. Of errors that grow in
/// proportion to time, the largest is four times that; of normal ones, one in 10^9 is twenty times that.
const TYPICAL: f64 = 20.0;

/// Fewer events have no typical error.
const FEWEST: usize = 4;

/// Error beyond which an event is wrong, s. Times are measured by `period` (s), and known to `resolved` (s).
fn tolerance(errors: &EventErrors, period: f64, resolved: f64) -> f64 {
    let mut sizes: Vec<f64> = errors.events.iter().map(|event| event.error.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let typical = sizes.get(sizes.len() / 4).filter(|_| sizes.len() >= FEWEST);
    let wrong = typical.map_or(WRONG * period, |typical| {
        (TYPICAL * typical).clamp(RIGHT * period, WRONG * period)
    });
    wrong.max(resolved)
}

impl WrongEvent {
    /// Of aligned events, whose times are measured by `period` (s) and known to `resolved` (s).
    pub(super) fn first(
        errors: &EventErrors,
        differences: &[Difference],
        period: f64,
        resolved: f64,
    ) -> Option<WrongEvent> {
        let tolerance = tolerance(errors, period, resolved);
        let parted = differences.iter().find(|difference| !difference.shorter_than_interval);
        let off = errors.events.iter();
        let mut off = off.filter(|event| event.error.abs() > tolerance.max(event.bound));
        let off = off.next();
        if let Some(event) = off.filter(|event| parted.is_none_or(|parted| event.time < parted.time)) {
            return Some(WrongEvent {
                position: event.position,
                kind: event.kind,
                time: event.time,
                error: Some(event.error),
                fault: None,
                tolerance,
            });
        }
        parted.map(|difference| WrongEvent {
            position: difference.position,
            kind: difference.kind,
            time: difference.time,
            error: None,
            fault: Some(difference.fault),
            tolerance,
        })
    }

    /// Which it is and what is wrong: "event 12, a slip at 30.100000 s, is off by 8.6e-3 s".
    pub fn words(&self) -> String {
        let WrongEvent {
            position, kind, time, ..
        } = self;
        match (self.error, self.fault) {
            (Some(error), _) => format!("event {position}, a {kind} at {time:.6} s, is off by {error:.1e} s"),
            (None, fault) => {
                let what = match fault {
                    Some(Fault::Missing) | None => "is missing in the candidate",
                    Some(Fault::Spurious) => "is the candidate's alone",
                    Some(Fault::Doubled) => "is there twice",
                    Some(Fault::Swapped) => "has changed places with its neighbour",
                    Some(Fault::Renamed) => "is another event in the candidate",
                };
                format!("the {kind} at {time:.6} s {what}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::event_errors::EventError;
    use super::*;

    fn first(error: impl Fn(usize) -> f64, resolved: f64) -> Option<WrongEvent> {
        let events = (0..20).map(|k| EventError {
            position: k,
            kind: "slip",
            time: k as f64,
            error: error(k),
            bound: 0.0,
        });
        let errors = EventErrors {
            matched: 20,
            max: None,
            max_at: None,
            rms: None,
            events: events.collect(),
        };
        WrongEvent::first(&errors, &[], 1.0, resolved)
    }

    #[test]
    fn analytic_the_first_event_that_stands_out_is_wrong_and_not_the_largest() {
        // Two late events, the second the larger; both are less than a hundredth of the period late.
        let late = |k: usize| match k {
            7 => 2e-3,
            12 => 9e-3,
            _ => 1e-9,
        };
        let wrong = first(late, 0.0).unwrap();
        assert_eq!((wrong.position, wrong.error, wrong.tolerance), (7, Some(2e-3), 1e-4));
        assert_eq!(wrong.words(), "event 7, a slip at 7.000000 s, is off by 2.0e-3 s");
        // What the samples do not resolve is not wrong.
        assert_eq!(first(late, 3e-3).unwrap().position, 12);
        assert_eq!(first(late, 1e-2), None);
    }

    #[test]
    fn analytic_an_event_that_shifts_all_later_ones_is_the_first_wrong_one() {
        let wrong = first(|k| if k < 7 { 0.0 } else { 2e-3 }, 0.0).unwrap();
        assert_eq!(wrong.position, 7);
    }

    #[test]
    fn analytic_errors_that_are_alike_have_no_wrong_event_up_to_a_hundredth_of_the_period() {
        assert_eq!(first(|k| 9e-3 * (k as f64).sin(), 0.0), None);
        let drift = |k: usize| 1e-3 * k as f64;
        assert_eq!(first(drift, 0.0).unwrap().position, 11);
        // Nor have errors below 1e-4 of it, however one stands out.
        assert_eq!(first(|k| if k == 3 { 9e-5 } else { 0.0 }, 0.0), None);
    }
}
