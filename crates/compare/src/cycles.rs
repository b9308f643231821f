//! Growth of event time errors over a run of many cycles.

use super::event_errors::EventErrors;
use serde::Serialize;

/// The errors of matched events of one kind, cycle by cycle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CycleErrors {
    /// Kind of the events: "reversal", "stick" or "slip", the kind with the most matched events.
    pub of: &'static str,
    /// Number of cycles.
    pub cycles: usize,
    /// Error of the first event, s.
    pub first: f64,
    /// Error of the last event, s.
    pub last: f64,
    /// Error growth per cycle, by least squares, s.
    pub per_cycle: f64,
    /// Error growth per cycle, relative to the reference's mean cycle.
    pub relative: f64,
    /// Root mean square of the residual of the line, s.
    pub scatter: f64,
    /// Standard error of `per_cycle`, s.
    pub uncertainty: f64,
    /// Part of the variance of the errors that the line explains; 0 if all errors are equal.
    pub explained: f64,
    /// The errors drift: the line explains them, and its slope is significant.
    pub drifts: bool,
    /// Largest absolute error, s.
    pub largest: f64,
    /// Position of that event in the reference's word, from 0.
    pub largest_position: usize,
    /// Time of that event in the reference, s.
    pub largest_at: f64,
    /// Largest absolute error of the other events, s.
    pub others: f64,
}

const FEWEST: usize = 4;

/// Smallest explained variance of a drift. A lasting step in the middle of a run has 3/4.
const LINEAR: f64 = 0.8;

const SIGNIFICANT: f64 = 3.0;

impl CycleErrors {
    /// Cycle errors of the kind with the most matched events; `None` with too few.
    pub fn of(errors: &EventErrors) -> Option<CycleErrors> {
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
