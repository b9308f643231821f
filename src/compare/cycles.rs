//! How the errors of event times grow over a run of many cycles.

use super::event_errors::EventErrors;
use serde::Serialize;

/// The errors of matched events of one kind, cycle by cycle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CycleErrors {
    /// "slip", or "stick" or "reversal" where there are more of them: the kind of the events.
    pub of: &'static str,
    /// How many there are.
    pub cycles: usize,
    /// Error of the first, s.
    pub first: f64,
    /// Error of the last, s.
    pub last: f64,
    /// What each cycle adds, by least squares, s.
    pub per_cycle: f64,
    /// The same in parts of the mean time between two of them in the reference.
    pub relative: f64,
    /// Root mean square of what is left of the errors, s.
    pub scatter: f64,
}

/// Fewer cycles have no course.
const FEWEST: usize = 4;

impl CycleErrors {
    /// Of the kind of which most are matched; `None` of a few.
    pub(super) fn of(errors: &EventErrors) -> Option<CycleErrors> {
        let of_kind = |kind: &'static str| {
            let events = errors.events.iter().filter(|event| event.kind == kind);
            (kind, events.map(|event| (event.time, event.error)).collect::<Vec<_>>())
        };
        let kinds = ["reversal", "stick", "slip"].map(of_kind);
        let (of, events) = kinds.into_iter().max_by_key(|(_, events)| events.len())?;
        if events.len() < FEWEST {
            return None;
        }
        let (first, last) = (events[0], events[events.len() - 1]);
        let cycle = (last.0 - first.0) / (events.len() - 1) as f64;
        if cycle <= 0.0 {
            return None;
        }
        // Cycles are counted by the reference's time, which a missing event does not shift.
        let number = |time: f64| (time - first.0) / cycle;
        let n = events.len() as f64;
        let (mean, error) = (
            events.iter().map(|e| number(e.0)).sum::<f64>() / n,
            events.iter().map(|e| e.1).sum::<f64>() / n,
        );
        let square: f64 = events.iter().map(|e| (number(e.0) - mean).powi(2)).sum();
        let product: f64 = events.iter().map(|e| (number(e.0) - mean) * (e.1 - error)).sum();
        let per_cycle = product / square;
        let left = events.iter().map(|e| e.1 - error - per_cycle * (number(e.0) - mean));
        Some(CycleErrors {
            of,
            cycles: events.len(),
            first: first.1,
            last: last.1,
            per_cycle,
            relative: per_cycle / cycle,
            scatter: (left.map(|x| x * x).sum::<f64>() / n).sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::event_errors::EventError;
    use super::*;

    #[test]
    fn analytic_a_drift_is_the_slope_of_the_errors() {
        let events = (0..10).map(|k| EventError {
            position: k,
            kind: "slip",
            time: 5.0 + 2.0 * k as f64,
            error: 1e-3 + 1e-4 * k as f64,
            bound: 0.0,
        });
        let errors = EventErrors {
            matched: 10,
            max: None,
            max_at: None,
            rms: None,
            events: events.collect(),
        };
        let cycles = CycleErrors::of(&errors).unwrap();
        assert_eq!((cycles.of, cycles.cycles), ("slip", 10));
        assert!((cycles.per_cycle - 1e-4).abs() < 1e-15 && (cycles.relative - 5e-5).abs() < 1e-15);
        assert!(cycles.scatter < 1e-15);
    }
}
