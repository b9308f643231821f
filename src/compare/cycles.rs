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
    /// Standard error of `per_cycle`, s.
    pub uncertainty: f64,
    /// Part of the variance of the errors that the line explains; 0 of errors that are all the same.
    pub explained: f64,
    /// The errors drift: the line explains them, and its slope exceeds its own uncertainty.
    pub drifts: bool,
    /// Largest absolute error, s.
    pub largest: f64,
    /// Position of that event in the reference's word, from 0.
    pub largest_position: usize,
    /// Its time in the reference, s.
    pub largest_at: f64,
    /// Largest absolute error of the other events, s.
    pub others: f64,
}

/// Fewer cycles have no course.
const FEWEST: usize = 4;

/// Part of the variance that a line has to explain to be called a drift. A lasting step in the middle of a run has 3/4.
const LINEAR: f64 = 0.8;

/// Standard errors by which the slope of a drift exceeds zero.
const SIGNIFICANT: f64 = 3.0;

impl CycleErrors {
    /// Of the kind of which most are matched; `None` of a few.
    pub(super) fn of(errors: &EventErrors) -> Option<CycleErrors> {
        let of_kind = |kind: &'static str| {
            let events = errors.events.iter().filter(|event| event.kind == kind);
            let events = events.map(|event| (event.time, event.error, event.position));
            (kind, events.collect::<Vec<_>>())
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
        let left: f64 = left.map(|x| x * x).sum();
        let all: f64 = events.iter().map(|e| (e.1 - error).powi(2)).sum();
        let explained = if all > 0.0 { 1.0 - left / all } else { 0.0 };
        let uncertainty = (left / (n - 2.0) / square).sqrt();
        let mut by_size = events.clone();
        by_size.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        Some(CycleErrors {
            of,
            cycles: events.len(),
            first: first.1,
            last: last.1,
            per_cycle,
            relative: per_cycle / cycle,
            scatter: (left / n).sqrt(),
            uncertainty,
            explained,
            drifts: explained >= LINEAR && per_cycle.abs() > SIGNIFICANT * uncertainty,
            largest: by_size[0].1.abs(),
            largest_position: by_size[0].2,
            largest_at: by_size[0].0,
            others: by_size[1].1.abs(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::event_errors::EventError;
    use super::*;

    /// Slips every 2 s with these errors, s.
    fn cycles(error: impl Fn(usize) -> f64) -> CycleErrors {
        let events = (0..10).map(|k| EventError {
            position: k,
            kind: "slip",
            time: 5.0 + 2.0 * k as f64,
            error: error(k),
            bound: 0.0,
        });
        let errors = EventErrors {
            matched: 10,
            max: None,
            max_at: None,
            rms: None,
            events: events.collect(),
        };
        CycleErrors::of(&errors).unwrap()
    }

    #[test]
    fn analytic_a_drift_is_the_slope_of_the_errors() {
        let cycles = cycles(|k| 1e-3 + 1e-4 * k as f64);
        assert_eq!((cycles.of, cycles.cycles, cycles.drifts), ("slip", 10, true));
        assert!((cycles.per_cycle - 1e-4).abs() < 1e-15 && (cycles.relative - 5e-5).abs() < 1e-15);
        assert!(cycles.scatter < 1e-15);
    }

    #[test]
    fn analytic_a_late_event_a_step_and_a_scatter_are_no_drift() {
        for late in 0..10 {
            let cycles = cycles(|k| if k == late { 8.58e-3 } else { 1e-9 });
            assert!(!cycles.drifts, "{late}: {cycles:?}");
            assert_eq!(
                (cycles.largest, cycles.largest_position, cycles.others),
                (8.58e-3, late, 1e-9)
            );
            assert_eq!(cycles.largest_at, 5.0 + 2.0 * late as f64);
        }
        for from in 1..10 {
            assert!(!cycles(|k| if k < from { 0.0 } else { 8.58e-3 }).drifts, "{from}");
        }
        assert!(!cycles(|k| 1e-6 * (7.0 * k as f64).sin()).drifts);
        // Errors that are all the same have no course.
        let same = cycles(|_| 1e-3);
        assert!(!same.drifts && same.explained == 0.0);
    }

    /// A drift under a scatter of its own size is one where there are enough cycles to tell.
    #[test]
    fn analytic_a_drift_stands_out_of_its_scatter() {
        let cycles = cycles(|k| 1e-4 * (k as f64 + (7.0 * k as f64).sin()));
        assert!(
            cycles.drifts && (cycles.per_cycle - 1e-4).abs() < 3.0 * cycles.uncertainty,
            "{cycles:?}"
        );
    }
}
