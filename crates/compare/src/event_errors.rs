//! Errors of event times.

use serde::Serialize;
use stickslip_system::record::sequence::{Alignment, SequenceEvent};

/// Errors of event times of the matched pairs, candidate minus reference, s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventErrors {
    /// Number of pairs.
    pub matched: usize,
    /// Largest absolute error, s; `None` without a matched event.
    pub max: Option<f64>,
    /// Time of that event in the reference, s.
    pub max_at: Option<f64>,
    /// Root mean square, s.
    pub rms: Option<f64>,
    /// The pairs in order of time.
    pub events: Vec<EventError>,
}

/// A matched event.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventError {
    /// 0-based position in the reference's word.
    pub position: usize,
    /// Kind of both events.
    pub kind: &'static str,
    /// Time in the reference, s.
    pub time: f64,
    /// Candidate minus reference, s.
    pub error: f64,
    /// Uncertainty of the candidate's time, s, from its samples or from the digits of a stated time.
    pub bound: f64,
}

impl EventErrors {
    /// Errors of two aligned words; `bounds` (s) are the uncertainties of the candidate's times.
    pub fn of(
        reference: &[SequenceEvent],
        candidate: &[SequenceEvent],
        bounds: &[f64],
        alignment: &Alignment,
    ) -> EventErrors {
        let error = |(r, c): (usize, usize)| EventError {
            position: r,
            kind: reference[r].kind.name(),
            time: reference[r].time,
            error: candidate[c].time - reference[r].time,
            bound: bounds[c],
        };
        let events: Vec<EventError> = alignment.matched().map(error).collect();
        let worst = events.iter().max_by(|a, b| a.error.abs().total_cmp(&b.error.abs()));
        let squares: f64 = events.iter().map(|e| e.error * e.error).sum();
        EventErrors {
            matched: events.len(),
            max: worst.map(|e| e.error.abs()),
            max_at: worst.map(|e| e.time),
            rms: worst.is_some().then(|| (squares / events.len() as f64).sqrt()),
            events,
        }
    }

    /// The largest bound, s.
    pub fn largest_bound(&self) -> f64 {
        self.events.iter().map(|event| event.bound).fold(0.0, f64::max)
    }

    /// Number of matched events whose error is within their bounds.
    pub fn within(&self) -> usize {
        self.events
            .iter()
            .filter(|event| event.error.abs() <= event.bound)
            .count()
    }
}
