//! A candidate whose times count from elsewhere.

use crate::record::sequence::SequenceEvent;
use serde::Serialize;

/// Fewest events that are all early or late by the same.
const FEWEST: usize = 4;
/// The errors may differ by this part of the offset, and of the natural period where the offset is longer than that.
const SAME: f64 = 1e-3;
const CLOSE: f64 = 0.02;
/// Offsets up to this, s, need no explanation.
const AGREED: f64 = 1e-8;

/// The times of a candidate are those of the reference and an offset.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherClock {
    /// Candidate minus reference, s.
    pub offset: f64,
    /// From which the candidate counts: "the kick", "the first event", ...; `None` if from nothing that the reference has.
    pub counts_from: Option<&'static str>,
    /// Largest error of an event once the offset is taken off, s.
    pub left: f64,
}

impl OtherClock {
    /// "all its events are 6.966 s earlier: its times count from the kick; else they are within 2e-12 s".
    pub fn words(&self) -> String {
        let way = if self.offset > 0.0 { "later" } else { "earlier" };
        let from = match self.counts_from {
            Some(from) => format!("its times count from {from}"),
            None => "its times count from another start, or it begins in another state".to_owned(),
        };
        format!(
            "all its events are {:.9} s {way}: {from}; but for that they agree within {:.1e} s",
            self.offset.abs(),
            self.left
        )
    }
}

/// The offset, if the events differ by nothing else. `anchors` are times of the reference (s) that one may count from; `period` (s)
/// is the natural one.
pub(in super::super) fn other_clock(
    reference: &[SequenceEvent],
    candidate: &[SequenceEvent],
    anchors: &[(&'static str, f64)],
    period: f64,
) -> Option<OtherClock> {
    let pairs = || reference.iter().zip(candidate);
    if candidate.len() < FEWEST || candidate.len() > reference.len() || pairs().any(|(r, c)| r.kind != c.kind) {
        return None;
    }
    let mut errors: Vec<f64> = pairs().map(|(r, c)| c.time - r.time).collect();
    let middle = errors.len() / 2;
    let offset = *errors.select_nth_unstable_by(middle, f64::total_cmp).1;
    let left = errors.iter().map(|error| (error - offset).abs()).fold(0.0, f64::max);
    if offset.abs() <= AGREED || left > (SAME * offset.abs()).min(CLOSE * period) {
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
    use crate::record::EventKind;

    #[test]
    fn analytic_an_offset_is_named_by_what_it_counts_from() {
        let word = |offset: f64, drift: f64| -> Vec<SequenceEvent> {
            let at = |k: u32| 7.0 + 1e-4 * f64::from(k) * (1.0 + drift) + offset;
            let kind = |k: u32| {
                if k.is_multiple_of(2) {
                    EventKind::Stick
                } else {
                    EventKind::Slip
                }
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
        // Nothing to say of a drift, or of no offset.
        assert!(clock(0.3, 0.1).is_none() && clock(0.0, 0.0).is_none() && clock(1e-5, 1e-3).is_none());
    }
}
