//! Which stretches of the candidate stand beside which stretches of the reference: never across an event.

use crate::record::sequence::{Alignment, SequenceEvent};
use serde::Serialize;

/// What part of a run a sample is in, which says how it is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Before the first event of the sequence: at the same time.
    Sliding,
    /// After a matched event: at the same time since that event.
    StickSlip,
    /// After the last event, if it is matched: at the same time again.
    After,
}

impl Phase {
    /// Every phase, in order of time.
    pub const ALL: [Phase; 3] = [Phase::Sliding, Phase::StickSlip, Phase::After];

    /// In words, for reports.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Sliding => "before the first event",
            Phase::StickSlip => "between events, timed from the last matched one",
            Phase::After => "after the last event",
        }
    }
}

/// A stretch of the candidate that is compared, without its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Which part of the run.
    pub phase: Phase,
    /// In the candidate's time, s.
    pub from: f64,
    /// In the candidate's time, s.
    pub to: f64,
    /// The candidate's time less the reference's, s.
    pub shift: f64,
}

/// The stretches in which both runs are in the same segment, in order of time. `from_start` says that both words begin
/// with the first event of the run, `to_end` that the reference's ends with its last.
pub fn windows(
    reference: &[SequenceEvent],
    candidate: &[SequenceEvent],
    alignment: &Alignment,
    from_start: bool,
    to_end: bool,
) -> Vec<Window> {
    let start = |word: &[SequenceEvent], k: usize| word.get(k).map_or(f64::INFINITY, |e| e.time);
    let mut windows = Vec::with_capacity(reference.len() + 1);
    if from_start {
        windows.push(Window {
            phase: Phase::Sliding,
            from: f64::NEG_INFINITY,
            to: start(reference, 0).min(start(candidate, 0)),
            shift: 0.0,
        });
    }
    for (r, c) in alignment.matched() {
        let (time, shift) = (candidate[c].time, candidate[c].time - reference[r].time);
        let last = to_end && r + 1 == reference.len() && c + 1 == candidate.len();
        windows.push(if last {
            Window {
                phase: Phase::After,
                from: time.max(reference[r].time),
                to: f64::INFINITY,
                shift: 0.0,
            }
        } else {
            Window {
                phase: Phase::StickSlip,
                from: time,
                to: start(candidate, c + 1).min(start(reference, r + 1) + shift),
                shift,
            }
        });
    }
    windows
}

/// Drops shifts smaller than `resolution` (s): times of events that were found in samples are no better than that, and a
/// shift by their error would be taken for an error of the states.
pub(crate) fn without_small_shifts(windows: &mut [Window], resolution: f64) {
    for w in windows.iter_mut().filter(|w| w.shift.abs() < resolution) {
        w.from = w.from.max(w.from - w.shift);
        w.to = w.to.min(w.to - w.shift);
        w.shift = 0.0;
    }
}
