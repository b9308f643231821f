//! The time offset between a candidate and its reference, found from the events of both.
//!
//! Two signs are in use. An *offset to add* (`time_offset`, `--time-offset`, [`FoundOffset::seconds`]) turns the
//! candidate's times into the reference's. An *error* is candidate minus reference, as every error of a comparison
//! ([`OtherClock::offset`]); the offset to add is its negative, [`OtherClock::to_add`].

use super::evidence::Evidence;
use super::fit::fitted;
use super::judge::{EXPLAINED, Judged};
use super::motion::Played;
use super::parameters::agreement;
use super::search::{Search, Tried};
use super::{Cause, Causes, Proposal, filing, proposals};
use crate::diagnosis::CauseKind;
use serde::Serialize;
use stickslip_system::record::EventKind;
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
    pub(crate) fn words(&self) -> String {
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

/// Whether the candidate has the reference's events at times that differ by a constant, or by a factor.
pub(super) fn is_moved(reference: &[SequenceEvent], candidate: &[SequenceEvent], period: f64) -> bool {
    let pairs = || reference.iter().zip(candidate);
    let is_same = candidate.len() <= reference.len() && pairs().all(|(r, c)| r.kind == c.kind);
    let spread = |of: &dyn Fn(f64, f64) -> f64| {
        let (low, high) = pairs().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (r, c)| {
            let value = of(r.time, c.time);
            (low.min(value), high.max(value))
        });
        high - low
    };
    let last = reference.last().map_or(0.0, |event| event.time);
    let left = spread(&|r, c| c - r).min(last * spread(&|r, c| c / r));
    is_same && candidate.len() >= FEWEST && left <= CLOSE * period
}

/// Events of the candidate and of the reference that are tried as starts of another clock.
const LOOKED_AT: (usize, usize) = (4, 12);
const LEAST: f64 = 1e-6;
/// Part of the disagreement of the events that an offset may leave for its fit to the samples.
const BETTER: f64 = 0.5;
/// Smallest share that another clock must explain: with the right offset nothing is left.
const OF_CLOCK: f64 = 1.0 - 1e-6;

/// Times that differ by a constant: the reference's motion at other times.
#[derive(Debug)]
pub(crate) struct Clocked {
    /// The clock that the events show, or else the samples; `None` if only an offset is known.
    clock: Option<OtherClock>,
    /// Offset found from the events.
    offset: Option<FoundOffset>,
    played: Played,
}

/// The reference at times that are `add` (s) later.
fn shifted(search: &Search<'_>, add: f64) -> Option<Played> {
    let evidence = search.evidence;
    let mut values = Vec::new();
    if let Some(observation) = evidence.observation {
        values = observation.reference_at(search.reference, add).ok()?;
        observation.complete(&mut values, evidence.physics, &evidence.physics.course, add);
    }
    let events = moved(&search.reference.word, |time| time - add);
    Some(Played {
        values,
        ..Played::of_events(events)
    })
}

fn moved(word: &[SequenceEvent], time: impl Fn(f64) -> f64) -> Vec<SequenceEvent> {
    let moved = word.iter().map(|event| SequenceEvent {
        time: time(event.time),
        ..*event
    });
    moved.collect()
}

/// An offset to add (s) that the samples show, from those of single events.
fn offset_of_samples(search: &Search<'_>) -> Option<f64> {
    let (evidence, reference) = (search.evidence, search.reference);
    let period = evidence.period;
    let mut begin: Vec<f64> = Vec::new();
    for theirs in evidence.word.iter().take(LOOKED_AT.0) {
        let same = reference.word.iter().filter(|ours| ours.kind == theirs.kind);
        begin.extend(same.take(LOOKED_AT.1).map(|ours| ours.time - theirs.time));
    }
    begin.retain(|add| add.abs() > LEAST * period);
    begin.sort_by(f64::total_cmp);
    begin.dedup();
    let cost = |add: f64| agreement(&moved(&reference.word, |time| time - add), evidence.word, period).cost;
    let begin = begin.into_iter().map(|add| (cost(add), add));
    let (least, begin) = begin.min_by(|a, b| a.0.total_cmp(&b.0))?;
    // With another clock all events agree; an offset below the error of their times shows in the samples alone.
    let agree = least <= BETTER * cost(0.0) || begin.abs() <= evidence.bound;
    agree.then(|| fitted(evidence, begin, 0.1 * period, &|add, _| shifted(search, add)))?
}

impl Cause for Clocked {
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let reference = search.reference;
        let first = reference.word.first().map(|event| match event.kind {
            EventKind::Stick => ("the first stick", event.time),
            _ => ("the first event", event.time),
        });
        let corner = if search.evidence.physics.coasts() {
            "a corner of F(t)"
        } else {
            "a corner of a signal"
        };
        let corners = reference.events.iter();
        let corners = corners.filter(|event| event.kind == EventKind::Corner && event.time > 0.0);
        let kick = search.evidence.kicked.map(|time| ("the kick", time));
        let mut anchors: Vec<(&'static str, f64)> = kick.into_iter().chain(first).collect();
        anchors.extend(corners.map(|event| (corner, event.time)));
        let clock = other_clock(&reference.word, search.evidence.word, &anchors, search.evidence.period);
        let add = match (&clock, search.shown.offset) {
            (Some(clock), _) => Some(clock.to_add()),
            (None, Some(offset)) => Some(offset.seconds),
            (None, None) => offset_of_samples(search),
        };
        let clocked = add.and_then(|add| {
            let played = shifted(search, add)?;
            let clock = match (clock, search.shown.offset) {
                (None, None) => Some(OtherClock {
                    offset: -add,
                    counts_from: None,
                    left: search.evidence.judged(&played, f64::INFINITY)?.after.max,
                }),
                (clock, _) => clock,
            };
            let offset = search.shown.offset;
            Some(Clocked { clock, offset, played })
        });
        proposals(clocked)
    }

    fn run(&self, _: &Evidence<'_>, _: usize) -> Option<Played> {
        Some(self.played.clone())
    }

    /// A clock whose zero is an event of the reference may be that of a solver with errors of its own.
    fn least(&self, _: &Evidence<'_>) -> f64 {
        if self.has_origin() { EXPLAINED } else { OF_CLOCK }
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        0
    }

    fn is_of_file(&self) -> bool {
        true
    }

    /// A brake stops once, so its motion begins at no other time.
    fn is_certain(&self, evidence: &Evidence<'_>, _: &Judged) -> bool {
        evidence.physics.coasts() && self.has_origin()
    }

    /// A known origin of the times says most, then agreement of the events, then the offset. The proposal includes an
    /// offset that was given.
    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let given = search.shown.candidate.clock.offset;
        let words = match (&self.clock, self.offset) {
            (Some(OtherClock { counts_from: None, .. }) | None, Some(offset)) => FoundOffset {
                seconds: offset.seconds + given,
                ..offset
            }
            .words(),
            (Some(clock), _) => {
                let add = clock.to_add() + given;
                format!("{}; repeat with --time-offset {add:.9}", clock.words())
            }
            (None, None) => String::new(),
        };
        (CauseKind::TimeOffset, words)
    }

    fn report(&self, search: &Search<'_>, all: &[Tried], causes: &mut Causes) -> (CauseKind, String) {
        causes.clock = self.clock.clone();
        let (kind, words) = self.words(search);
        (kind, words + &filing::beside(search, "another clock", all, causes))
    }
}

impl Clocked {
    fn has_origin(&self) -> bool {
        self.clock.as_ref().is_some_and(|clock| clock.counts_from.is_some())
    }
}

/// Smallest part that another rate must explain: with the right one nothing is left.
const OF_RATE: f64 = 1.0 - 1e-6;
/// Fewest events that show a rate: a mass that slides to rest under another friction has another rate, too.
const FEWEST_EVENTS: usize = 5;
/// Unit of the fit.
const UNIT: f64 = 1e-3;
/// Smallest change of a rate. A method of order 2 with 300 steps in a natural period changes the frequency by as much.
const LEAST_CHANGE: f64 = 5e-5;
/// Largest factor of a rate. Units of time are causes of their own.
const MOST_RATE: f64 = 2.0;

/// Times pass at `rate` times the reference's from `origin` (s) on.
#[derive(Debug)]
pub(crate) struct ClockRate {
    rate: f64,
    origin: f64,
}

impl Cause for ClockRate {
    /// Rates that the events show, fitted.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        if evidence.word.len() < FEWEST_EVENTS {
            return Vec::new();
        }
        let is_near = |rate: &f64| (1.0 / MOST_RATE..MOST_RATE).contains(rate);
        let first = evidence.observation.and_then(|seen| seen.time.first().copied());
        let mut origins = vec![0.0];
        origins.extend(first.filter(|first| *first != 0.0));
        let of_origin = |origin: f64| {
            let pairs = evidence.word.iter().zip(evidence.reference);
            let pairs = pairs.filter(|(theirs, ours)| theirs.kind == ours.kind && ours.time != origin);
            let mut ratios: Vec<f64> = pairs.map(|(a, b)| (a.time - origin) / (b.time - origin)).collect();
            ratios.sort_by(f64::total_cmp);
            let shown = ratios.get(ratios.len() / 2).copied();
            let begin = shown.into_iter().chain([1.0]).filter(is_near);
            let play = |rate: f64, _: f64| ClockRate { rate, origin }.run(evidence, 0);
            let rates = begin.filter_map(|begin| fitted(evidence, begin, UNIT, &play));
            let large = rates.filter(|rate| (rate - 1.0).abs() >= LEAST_CHANGE && is_near(rate));
            large.map(|rate| ClockRate { rate, origin }).collect::<Vec<_>>()
        };
        proposals(origins.into_iter().flat_map(of_origin))
    }

    fn run(&self, evidence: &Evidence<'_>, _: usize) -> Option<Played> {
        let to_candidate = |time: f64| self.origin + (time - self.origin) * self.rate;
        let mut played = Played::of_events(moved(evidence.reference, to_candidate));
        if let Some(seen) = evidence.observation {
            let to_reference = |time: &f64| self.origin + (time - self.origin) / self.rate;
            let times: Vec<f64> = seen.time.iter().map(to_reference).collect();
            played.values = evidence.unchanged_case_at(&times)?;
            seen.derive(&mut played.values, evidence.physics);
        }
        Some(played)
    }

    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        let judged = evidence.judged(played, f64::INFINITY)?;
        Some(judged.by_samples_if(evidence.detected.is_some()))
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        OF_RATE
    }

    fn words(&self, _: &Search<'_>) -> (CauseKind, String) {
        let from = match self.origin {
            0.0 => String::new(),
            origin => format!(" from {origin:.6} s on"),
        };
        let words = format!("its clock runs at {:.6} times the reference's{from}", self.rate);
        (CauseKind::ClockRate, words)
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        1
    }

    fn is_of_file(&self) -> bool {
        true
    }
}
