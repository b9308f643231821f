//! A clock that starts elsewhere: the difference of two clocks, by the events of both runs.

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

/// Events of the candidate that are looked at.
const MOST: usize = 300;
/// Events of the reference, from its first on, to which the first ones of the candidate may belong.
const STARTS: usize = 200;
/// The first events of the candidate, one of which has to belong to one of the reference.
const FIRST: usize = 3;
/// Fewest events that agree, and the part of all that they have to be.
const FEWEST: usize = 4;
const PART: f64 = 0.8;

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
}
