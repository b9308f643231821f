//! The time offset between a candidate and its reference, found from the events of both.
//!
//! Two signs are in use, each by its name. An *offset to add* (`time_offset`, `--time-offset`, [`FoundOffset::seconds`]) makes the
//! candidate's times those of the reference. An *error* is candidate minus reference, as every error of a comparison
//! ([`OtherClock::offset`]); the offset to add is its negative, [`OtherClock::to_add`].

use crate::record::sequence::SequenceEvent;
use serde::Serialize;

/// What has to be added to the times of a candidate so that its events agree with those of the reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FoundOffset {
    /// s.
    pub seconds: f64,
    /// Events that then agree within an eighth of the natural period.
    pub agree: usize,
    /// Events that were looked at.
    pub of: usize,
    /// Root mean square of what is left, s.
    pub rms: f64,
}

impl FoundOffset {
    /// Its events agree when a time is added to them.
    pub(super) fn words(&self) -> String {
        let FoundOffset {
            seconds,
            agree,
            of,
            rms,
        } = *self;
        format!(
            "its clock starts elsewhere: with {seconds:.9} s added to its times, {agree} of its {of} events agree, rms {rms:.1e} s; \
             repeat with --time-offset {seconds:.9}, or auto"
        )
    }
}

/// Events of the candidate that are looked at.
const MOST: usize = 300;
/// Events of the reference, from its first on, to which the first ones of the candidate may belong.
const STARTS: usize = 200;
/// The first events of the candidate, one of which has to belong to one of the reference.
const FIRST: usize = 3;
/// The part of all that the events that agree have to be.
const PART: f64 = 0.8;
/// Fewest events that tell of a clock.
const FEWEST: usize = 4;
/// Errors that are the same differ by this part of them.
const SAME: f64 = 1e-3;
/// And by this part of the natural period, where they are longer than that.
const CLOSE: f64 = 0.02;
/// Errors of events up to this, s, need no explanation.
const AGREED: f64 = 1e-8;

/// The offset with which most events of the candidate have one of the reference of the same kind close by, `within` (s); of several those
/// that leave the smallest differences. `None` if it is not clear.
pub(crate) fn find(reference: &[SequenceEvent], candidate: &[SequenceEvent], within: f64) -> Option<FoundOffset> {
    let candidate = &candidate[..candidate.len().min(MOST)];
    if candidate.len() < FEWEST {
        return None;
    }
    let mut best: Option<FoundOffset> = None;
    for r in reference.iter().take(STARTS) {
        for c in candidate.iter().take(FIRST).filter(|c| c.kind == r.kind) {
            let Some(mut found) = judged(reference, candidate, r.time - c.time, within) else {
                continue;
            };
            // Once more, from the mean of the differences.
            if let Some(refined) = judged(reference, candidate, found.seconds, within)
                && refined.agree >= found.agree
            {
                found = refined;
            }
            let better = best.is_none_or(|best| (found.agree, best.rms) > (best.agree, found.rms));
            if better {
                best = Some(found);
            }
        }
    }
    best.filter(|best| best.agree >= FEWEST && best.agree as f64 >= PART * best.of as f64)
}

/// How well an offset (s) fits, with the mean of the differences added to it.
fn judged(reference: &[SequenceEvent], candidate: &[SequenceEvent], seconds: f64, within: f64) -> Option<FoundOffset> {
    let mut differences = Vec::new();
    for event in candidate {
        let time = event.time + seconds;
        let from = reference.partition_point(|r| r.time < time - within);
        let close = reference[from..].iter().take_while(|r| r.time <= time + within);
        let close = close.filter(|r| r.kind == event.kind).map(|r| r.time - time);
        differences.extend(close.min_by(|a, b| a.abs().total_cmp(&b.abs())));
    }
    let count = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / count;
    let squares: f64 = differences.iter().map(|d| (d - mean) * (d - mean)).sum();
    (!differences.is_empty()).then(|| FoundOffset {
        seconds: seconds + mean,
        agree: differences.len(),
        of: candidate.len(),
        rms: (squares / count).sqrt(),
    })
}

/// The times of a candidate are those of the reference and an offset.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherClock {
    /// The error of its times, candidate minus reference, s: the negative of what is to be added to them.
    pub offset: f64,
    /// From which the candidate counts: "the kick", "the first event", ...; `None` if from nothing that the reference has.
    pub counts_from: Option<&'static str>,
    /// Largest error of an event once the offset is taken off, s.
    pub left: f64,
}

impl OtherClock {
    /// What has to be added to the candidate's times, s.
    pub fn to_add(&self) -> f64 {
        -self.offset
    }

    /// "all its events are 6.966 s earlier: its times count from the kick; apart from that they agree within 2e-12 s".
    pub fn words(&self) -> String {
        let from = match self.counts_from {
            Some(from) => format!("its times count from {from}"),
            None => "its times count from another start, or it begins in another state".to_owned(),
        };
        let (by, side) = (self.offset.abs(), if self.offset > 0.0 { "later" } else { "earlier" });
        let rest = match self.left {
            0.0 => "their times are the same".to_owned(),
            left => format!("they agree within {left:.1e} s"),
        };
        format!("all its events are {by:.9} s {side}: {from}; apart from that {rest}")
    }
}

/// The error (s, candidate minus reference) that the events have in common, and by how much the others differ from it at most: if
/// there are enough of them, they need an explanation, and are all the same.
fn common_error(mut errors: Vec<f64>) -> Option<(f64, f64)> {
    if errors.len() < FEWEST {
        return None;
    }
    let middle = errors.len() / 2;
    let error = *errors.select_nth_unstable_by(middle, f64::total_cmp).1;
    let left = errors.iter().map(|one| (one - error).abs()).fold(0.0, f64::max);
    (error.abs() > AGREED && left <= SAME * error.abs()).then_some((error, left))
}

/// The other clock, if the events differ by nothing else. `anchors` are times of the reference (s) that one may count from;
/// `period` (s) is the natural one.
pub(super) fn other_clock(
    reference: &[SequenceEvent],
    candidate: &[SequenceEvent],
    anchors: &[(&'static str, f64)],
    period: f64,
) -> Option<OtherClock> {
    let pairs = || reference.iter().zip(candidate);
    if candidate.len() > reference.len() || pairs().any(|(r, c)| r.kind != c.kind) {
        return None;
    }
    let (offset, left) = common_error(pairs().map(|(r, c)| c.time - r.time).collect())?;
    if left > CLOSE * period {
        return None;
    }
    let near = |at: f64| (offset + at).abs() <= SAME * period + left;
    Some(OtherClock {
        offset,
        counts_from: anchors.iter().find(|(_, at)| near(*at)).map(|(name, _)| *name),
        left,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::EventKind::{Slip, Stick};

    #[test]
    fn analytic_the_offset_of_a_shifted_word_is_found() {
        // Cycles that grow, so that a shift by one of them fits less well.
        let event = |k: u32| SequenceEvent {
            time: 7.0 + 1e-3 * f64::from(k) + 1e-6 * f64::from(k * k),
            kind: if k.is_multiple_of(2) { Stick } else { Slip },
        };
        let reference: Vec<SequenceEvent> = (0..40).map(event).collect();
        let shifted = |by: f64| {
            move |e: &SequenceEvent| SequenceEvent {
                time: e.time - by,
                kind: e.kind,
            }
        };
        let whole: Vec<SequenceEvent> = reference.iter().map(shifted(6.99)).collect();
        let found = find(&reference, &whole, 2e-4).unwrap();
        assert!((found.seconds - 6.99).abs() < 1e-12 && found.agree == 40, "{found:?}");
        let part: Vec<SequenceEvent> = reference[5..25].iter().map(shifted(-3.0)).collect();
        let found = find(&reference, &part, 2e-4).unwrap();
        assert!((found.seconds + 3.0).abs() < 1e-12 && found.agree == 20, "{found:?}");
        assert_eq!(find(&reference, &whole[..3], 2e-4), None);
    }

    #[test]
    fn analytic_an_offset_is_named_by_what_it_counts_from() {
        let word = |offset: f64, drift: f64| -> Vec<SequenceEvent> {
            let at = |k: u32| 7.0 + 1e-4 * f64::from(k) * (1.0 + drift) + offset;
            let kind = |k: u32| {
                if k.is_multiple_of(2) { Stick } else { Slip }
            };
            (0..9)
                .map(|k| SequenceEvent {
                    time: at(k),
                    kind: kind(k),
                })
                .collect()
        };
        let anchors = [("the kick", 6.966), ("the first event", 7.0)];
        let clock = |offset, drift| other_clock(&word(0.0, 0.0), &word(offset, drift), &anchors, 2.4e-4);
        assert_eq!(clock(-6.966, 0.0).unwrap().counts_from, Some("the kick"));
        assert_eq!(clock(-7.0, 0.0).unwrap().counts_from, Some("the first event"));
        assert_eq!(clock(0.3, 0.0).unwrap().counts_from, None);
        // The other sign of the same.
        let word_late = clock(0.3, 0.0).unwrap();
        let found = find(&word(0.0, 0.0), &word(0.3, 0.0), 3e-5).unwrap();
        assert!((found.seconds - word_late.to_add()).abs() < 1e-9, "{found:?}");
        // Nothing to say of a drift, or of no offset.
        assert!(clock(0.3, 0.1).is_none() && clock(0.0, 0.0).is_none() && clock(1e-5, 1e-3).is_none());
    }
}
