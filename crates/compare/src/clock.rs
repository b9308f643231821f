//! The time offset between a candidate and its reference, found from the events of both.
//!
//! Two signs are in use. An *offset to add* (`time_offset`, `--time-offset`, [`FoundOffset::seconds`]) turns the
//! candidate's times into the reference's. An *error* is candidate minus reference, as every error of a comparison
//! ([`OtherClock::offset`]); the offset to add is its negative, [`OtherClock::to_add`].

use serde::Serialize;
use stickslip_system::record::sequence::SequenceEvent;

/// An offset to add with which the candidate's events agree with the reference's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FoundOffset {
    /// Offset to add, s.
    pub seconds: f64,
    /// Events that then agree within an eighth of the natural period.
    pub agree: usize,
    /// Events examined.
    pub of: usize,
    /// Root mean square of the remaining errors, s.
    pub rms: f64,
}

impl FoundOffset {
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

const MOST: usize = 300;
/// First events of the reference that may match the first ones of the candidate.
const STARTS: usize = 200;
/// First events of the candidate, one of which must match an event of the reference.
const FIRST: usize = 3;
/// Smallest part of the examined events that must agree.
const PART: f64 = 0.8;
const FEWEST: usize = 4;
/// Largest relative spread of a common error,
const SAME: f64 = 1e-3;
/// and largest spread in natural periods.
const CLOSE: f64 = 0.02;
/// Errors of events up to this, s, need no explanation.
const AGREED: f64 = 1e-8;

/// The offset with which most events of the candidate have an event of the same kind of the reference nearby, `within`
/// (s). If several offsets match as many events, the smallest rms decides. `None` if too few events match.
pub fn find(reference: &[SequenceEvent], candidate: &[SequenceEvent], within: f64) -> Option<FoundOffset> {
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
            // Repeat from the mean of the differences.
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

/// Matches the events at an offset (s), and adds the mean of their differences to it.
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

/// A candidate whose times differ from the reference's by a constant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherClock {
    /// The error of its times, candidate minus reference, s: the negative of the offset to add.
    pub offset: f64,
    /// Origin of the candidate's times: "the kick", "the first event", ...; `None` if unknown.
    pub counts_from: Option<&'static str>,
    /// Largest error of an event after the offset is removed, s.
    pub left: f64,
}

impl OtherClock {
    /// The offset to add to the candidate's times, s.
    pub fn to_add(&self) -> f64 {
        -self.offset
    }

    /// For example "all its events are 6.966 s earlier: its times count from the kick; apart from that they agree
    /// within 2e-12 s".
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

/// The common error of the events (s, candidate minus reference) and the largest deviation from it, if there are enough
/// events, the error needs an explanation, and the deviation is small.
fn common_error(mut errors: Vec<f64>) -> Option<(f64, f64)> {
    if errors.len() < FEWEST {
        return None;
    }
    let middle = errors.len() / 2;
    let error = *errors.select_nth_unstable_by(middle, f64::total_cmp).1;
    let left = errors.iter().map(|one| (one - error).abs()).fold(0.0, f64::max);
    (error.abs() > AGREED && left <= SAME * error.abs()).then_some((error, left))
}

/// The other clock, if it is the only difference of the events. `anchors` are possible origins in the reference's times
/// (s); `period` (s) is the natural period.
pub fn other_clock(
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
