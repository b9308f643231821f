//! Errors of event times: of each event, the first that is wrong, and their growth over the cycles of a run.

use serde::Serialize;
use stickslip_system::record::sequence::{Alignment, Difference, Fault, SequenceEvent};

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
        let events = self.events.iter();
        events.filter(|event| event.error.abs() <= event.bound).count()
    }
}

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

/// Fewest events with a typical error or a growth.
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
        let wrong = |event: &&EventError| event.error.abs() > tolerance.max(event.bound);
        let off = errors.events.iter().find(wrong);
        let off = off.filter(|event| parted.is_none_or(|parted| event.time < parted.time));
        let (position, kind, time) = match (off, parted) {
            (Some(event), _) => (event.position, event.kind, event.time),
            (None, Some(difference)) => (difference.position, difference.kind, difference.time),
            (None, None) => return None,
        };
        Some(WrongEvent {
            position,
            kind,
            time,
            error: off.map(|event| event.error),
            fault: parted.filter(|_| off.is_none()).map(|difference| difference.fault),
            tolerance,
        })
    }

    /// For example "event 12, a slip at 30.100000 s, is off by 8.6e-3 s".
    pub fn words(&self) -> String {
        let (position, kind, time) = (self.position, self.kind, self.time);
        if let Some(error) = self.error {
            return format!("event {position}, a {kind} at {time:.6} s, is off by {error:.1e} s");
        }
        let what = match self.fault {
            Some(Fault::Missing) | None => "is missing in the candidate",
            Some(Fault::Spurious) => "is the candidate's alone",
            Some(Fault::Doubled) => "is there twice",
            Some(Fault::Swapped) => "has changed places with its neighbour",
            Some(Fault::Renamed) => "is another event in the candidate",
        };
        format!("the {kind} at {time:.6} s {what}")
    }
}

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

/// Smallest explained variance of a drift. A lasting step in the middle of a run has 3/4.
const LINEAR: f64 = 0.8;

const SIGNIFICANT: f64 = 3.0;

impl CycleErrors {
    /// Cycle errors of the kind with the most matched events; `None` with too few.
    pub fn of(errors: &EventErrors) -> Option<CycleErrors> {
        let all = errors.events.iter();
        let of_kind = |kind| all.clone().filter(|event| event.kind == kind).collect();
        let kinds: [Vec<&EventError>; 3] = ["reversal", "stick", "slip"].map(of_kind);
        let events = kinds.into_iter().max_by_key(Vec::len)?;
        if events.len() < FEWEST {
            return None;
        }
        let (first, last) = (events[0], events[events.len() - 1]);
        let cycle = (last.time - first.time) / (events.len() - 1) as f64;
        if cycle <= 0.0 {
            return None;
        }
        let n = events.len() as f64;
        let point = |event: &&EventError| ((event.time - first.time) / cycle, event.error);
        let points: Vec<(f64, f64)> = events.iter().map(point).collect();
        let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|&(x, y)| of(x, y)).sum::<f64>();
        let (mean, error) = (sum(&|x, _| x) / n, sum(&|_, y| y) / n);
        let square = sum(&|x, _| (x - mean).powi(2));
        let per_cycle = sum(&|x, y| (x - mean) * (y - error)) / square;
        let left = sum(&|x, y| (y - error - per_cycle * (x - mean)).powi(2));
        let all = sum(&|_, y| (y - error).powi(2));
        let explained = if all > 0.0 { 1.0 - left / all } else { 0.0 };
        let uncertainty = (left / (n - 2.0) / square).sqrt();
        let mut by_size = events.clone();
        by_size.sort_by(|a, b| b.error.abs().total_cmp(&a.error.abs()));
        Some(CycleErrors {
            of: first.kind,
            cycles: events.len(),
            first: first.error,
            last: last.error,
            per_cycle,
            relative: per_cycle / cycle,
            scatter: (left / n).sqrt(),
            uncertainty,
            explained,
            drifts: explained >= LINEAR && per_cycle.abs() > SIGNIFICANT * uncertainty,
            largest: by_size[0].error.abs(),
            largest_position: by_size[0].position,
            largest_at: by_size[0].time,
            others: by_size[1].error.abs(),
        })
    }
}
