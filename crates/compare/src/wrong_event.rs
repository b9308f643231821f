//! The first wrong event of a candidate.

use super::event_errors::EventErrors;
use serde::Serialize;
use stickslip_system::record::sequence::{Difference, Fault};

/// The first wrong event: where the sequences part, or an earlier matched event whose time is off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WrongEvent {
    /// 0-based position in the reference's word.
    pub position: usize,
    /// Kind in the reference; for a spurious event in the candidate.
    pub kind: &'static str,
    /// Time in the reference; for a spurious event in the candidate; s.
    pub time: f64,
    /// Error of a matched event, candidate minus reference, s.
    pub error: Option<f64>,
    /// Fault of an unmatched event.
    pub fault: Option<Fault>,
    /// Error beyond which a matched event counts as wrong, s.
    pub tolerance: f64,
}

/// Part of the period by which an event is always wrong: it is visible in a figure of some periods.
const WRONG: f64 = 1e-2;

const RIGHT: f64 = 1e-4;

/// In between, an event is wrong if its error is this multiple of the first quartile. For errors proportional to time,
/// the largest is four times the quartile; of normal errors, one in 10^9 is twenty times the quartile.
const TYPICAL: f64 = 20.0;

const FEWEST: usize = 4;

/// Error beyond which an event is wrong, s; `period` (s) is the time scale, `resolved` (s) the resolution.
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
    /// The first wrong event of an alignment; `period` (s) is the time scale, `resolved` (s) the resolution of times.
    pub fn first(errors: &EventErrors, differences: &[Difference], period: f64, resolved: f64) -> Option<WrongEvent> {
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

    /// For example "event 12, a slip at 30.100000 s, is off by 8.6e-3 s".
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
