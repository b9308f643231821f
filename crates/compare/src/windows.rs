//! Corresponding stretches of candidate and reference, never across an event.

use serde::Serialize;
use stickslip_system::record::sequence::{Alignment, SequenceEvent};

/// Part of a run, which determines how samples are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Before the first event of the sequence: at the same time.
    Sliding,
    /// After a matched event: at the same time since that event, or at the same time if that is closer.
    StickSlip,
    /// After the last event, if it is matched: at the same time again.
    After,
    /// In a segment that only one of the runs has: at the same time.
    Apart,
}

impl Phase {
    /// Every phase.
    pub const ALL: [Phase; 4] = [Phase::Sliding, Phase::StickSlip, Phase::After, Phase::Apart];

    /// Name for reports.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Sliding => "before the first event",
            Phase::StickSlip => "between events, timed from the last matched one",
            Phase::After => "after the last event",
            Phase::Apart => "in a segment of one run alone",
        }
    }
}

/// A compared stretch of the candidate, without its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Part of the run.
    pub phase: Phase,
    /// Start in the candidate's time, s.
    pub from: f64,
    /// End in the candidate's time, s.
    pub to: f64,
    /// The candidate's time minus the reference's, s.
    pub shift: f64,
}

/// The compared stretches, in order of time: those in which both runs are in the same segment, and those with unmatched
/// events. `from_start`: both words begin with the first event of the run; `to_end`: the reference's word ends with its
/// last event.
pub fn windows(
    reference: &[SequenceEvent],
    candidate: &[SequenceEvent],
    alignment: &Alignment,
    from_start: bool,
    to_end: bool,
) -> Vec<Window> {
    let start = |word: &[SequenceEvent], k: usize| word.get(k).map_or(f64::INFINITY, |e| e.time);
    let matched: Vec<(usize, usize)> = alignment.matched().collect();
    let mut windows = Vec::with_capacity(reference.len() + 1);
    // Up to the next matched event, which is not the next of both words.
    let apart = |windows: &mut Vec<Window>, from: f64, (r, c): (usize, usize), next: Option<&(usize, usize)>| {
        let is_next = match next {
            Some(next) => *next == (r, c),
            None => r == reference.len() && c == candidate.len(),
        };
        let to = next.map_or(f64::INFINITY, |next| candidate[next.1].time);
        if !is_next && to > from {
            windows.push(Window {
                phase: Phase::Apart,
                from,
                to,
                shift: 0.0,
            });
        }
    };
    if from_start {
        let to = start(reference, 0).min(start(candidate, 0));
        windows.push(Window {
            phase: Phase::Sliding,
            from: f64::NEG_INFINITY,
            to,
            shift: 0.0,
        });
        apart(&mut windows, to, (0, 0), matched.first());
    } else if matched.is_empty() {
        windows.push(Window {
            phase: Phase::Apart,
            from: f64::NEG_INFINITY,
            to: f64::INFINITY,
            shift: 0.0,
        });
    }
    for (k, &(r, c)) in matched.iter().enumerate() {
        let (time, shift) = (candidate[c].time, candidate[c].time - reference[r].time);
        let last = to_end && r + 1 == reference.len() && c + 1 == candidate.len();
        if last {
            windows.push(Window {
                phase: Phase::After,
                from: time.max(reference[r].time),
                to: f64::INFINITY,
                shift: 0.0,
            });
            break;
        }
        let to = start(candidate, c + 1).min(start(reference, r + 1) + shift);
        windows.push(Window {
            phase: Phase::StickSlip,
            from: time,
            to,
            shift,
        });
        apart(&mut windows, to, (r + 1, c + 1), matched.get(k + 1));
    }
    windows
}

/// Drops shifts smaller than `resolution` (s), the accuracy of events found in samples. Otherwise a shift by their
/// error would count as an error of the states.
pub(crate) fn without_small_shifts(windows: &mut [Window], resolution: f64) {
    for w in windows.iter_mut().filter(|w| w.shift.abs() < resolution) {
        w.from = w.from.max(w.from - w.shift);
        w.to = w.to.min(w.to - w.shift);
        w.shift = 0.0;
    }
}
