//! How much of what a candidate shows a motion explains.

use super::super::parameters::{Agreement, agreement};
use super::observation::Observation;
use super::play::Played;
use crate::record::sequence::SequenceEvent;
use std::sync::OnceLock;

/// What a cause explains of the squared difference, at least, and of that of the event times where samples show more than events.
pub(in super::super) const EXPLAINED: f64 = 0.99;
const OF_EVENTS: f64 = 0.9;
/// What leaves less than this part of the square of the samples has the events that are found in them.
pub(super) const ALL: f64 = 1e-4;
/// And what leaves less than this is the motion itself, whatever events were found in it.
pub(super) const EXACT: f64 = 1.0 - 1e-6;
/// Mean squares (in parts of the sizes) and squares of event times (s^2) below these are rounding.
const FLOOR: f64 = 1e-18;
/// As much as another explains what leaves up to this multiple of the square.
const AS_MUCH: f64 = 2.0;

/// What hypotheses are held against.
#[derive(Debug)]
pub(in super::super) struct Evidence<'a> {
    /// `None` of a table of events.
    pub observation: Option<&'a Observation>,
    /// The candidate's events, and those of the reference.
    pub word: &'a [SequenceEvent],
    pub reference: &'a [SequenceEvent],
    /// The time that the candidate covers, s.
    pub covered: (f64, f64),
    /// The natural period, s.
    pub period: f64,
    /// To which the candidate's event times are known, s.
    pub bound: f64,
    /// Its events were found in its samples, which then say more.
    pub detected: bool,
    /// It ends before the first event, behind which a motion is amplified rounding.
    pub is_smooth: bool,
    /// How far the events of the reference agree with its own, once it was asked.
    pub before: OnceLock<Agreement>,
}

/// The judgement of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Judged {
    /// Part of the squared difference of candidate and reference that the motion takes away.
    pub explained: f64,
    /// The mean square that it leaves.
    pub left: f64,
    /// How far the events of the reference, and those of the motion, agree with the candidate's.
    pub before: Agreement,
    pub after: Agreement,
    /// The events are back.
    events: bool,
}

impl Judged {
    /// Whether it reproduces the candidate.
    pub fn is_cause(&self) -> bool {
        self.explained >= EXPLAINED && self.events
    }

    /// Whether more of its events have a partner than of the reference's. Where the relative velocity of a candidate follows from another
    /// drive, its events are not found.
    pub fn has_events(&self) -> bool {
        self.after.unmatched <= self.before.unmatched
    }

    /// By samples alone: a contact without stick has no events that a candidate's would be held against.
    pub fn by_samples(self) -> Judged {
        Judged { events: true, ..self }
    }

    /// Of a motion that is far from the candidate.
    pub fn far() -> Judged {
        Judged {
            explained: 0.0,
            left: f64::INFINITY,
            before: Agreement::default(),
            after: Agreement::default(),
            events: false,
        }
    }

    /// Whether it explains as much as a better one.
    pub fn as_much_as(&self, best: &Judged) -> bool {
        self.left <= AS_MUCH * best.left + FLOOR
    }
}

/// Motions are close while no channel differs by more than this part of its size, and no event by more than this part of the natural
/// period. A window has so many samples, or events, more: some of what is behind an event that comes at another time show by how much.
pub(super) const CLOSE: f64 = 0.05;
const FEWEST: usize = 8;

/// How often a value is projected.
const PROJECTIONS: usize = 6;

impl Evidence<'_> {
    fn inside(&self, event: &SequenceEvent) -> bool {
        event.time >= self.covered.0 && event.time <= self.covered.1
    }

    /// The candidate's events, each with that of a motion, while they are of one kind; s.
    fn pairs<'a>(&'a self, played: &'a Played) -> impl Iterator<Item = (f64, f64)> + 'a {
        let theirs = self.word.iter().filter(|event| self.inside(event));
        let ours = played.events.iter().filter(|event| self.inside(event));
        let pairs = theirs.zip(ours).take_while(|(theirs, ours)| theirs.kind == ours.kind);
        pairs.map(|(theirs, ours)| (theirs.time, ours.time))
    }

    /// How many of the samples, or of the events where there are no samples, are compared with a motion that is to be brought closer.
    pub(super) fn window(&self, played: &Played) -> usize {
        match self.observation {
            Some(observation) => {
                let covered = observation.time.partition_point(|time| *time <= self.covered.1);
                let window = (observation.close(&played.values, CLOSE) + FEWEST).min(covered);
                observation.known_up_to(&played.values, window)
            }
            None => {
                let near = |(theirs, ours): &(f64, f64)| (theirs - ours).abs() <= CLOSE * self.period;
                let close = self.pairs(played).take_while(near).count();
                (close + FEWEST).min(self.pairs(played).count())
            }
        }
    }

    /// What a motion differs by from the candidate in a window, channel by channel in parts of the sizes, or event by event in parts of
    /// the natural period. Not a number where it has none.
    pub(super) fn residual(&self, played: &Played, window: usize) -> Vec<f64> {
        match self.observation {
            Some(observation) => observation.residual(&played.values, window),
            None => {
                let known = self.pairs(played).map(|(theirs, ours)| (ours - theirs) / self.period);
                known.chain(std::iter::repeat(f64::NAN)).take(window).collect()
            }
        }
    }

    /// The reference as a motion.
    pub(super) fn reference(&self) -> Played {
        Played {
            values: self.observation.map_or_else(Vec::new, |seen| seen.reference.clone()),
            events: self.reference.to_vec(),
            steps: 0,
        }
    }

    /// A value, from one on, with which a motion is as far from the reference as the candidate is, in the direction of that: the motion
    /// is the reference where the value is zero, and differs from it by a power of the value.
    pub(super) fn projected(&self, begin: f64, order: i32, play: &dyn Fn(f64) -> Option<Played>) -> Option<f64> {
        let reference = self.reference();
        let window = self.window(&reference);
        let off = self.residual(&reference, window);
        let mut value = begin;
        for _ in 0..PROJECTIONS {
            let left = self.residual(&play(value)?, window);
            let (mut own, mut both) = (0.0, 0.0);
            for (off, left) in off.iter().zip(&left) {
                let moved = off - left;
                if moved.is_finite() {
                    own += moved * moved;
                    both += off * moved;
                }
            }
            let factor = both / own;
            if !factor.is_finite() {
                return None;
            }
            // Too far for a power, if it points the other way.
            let change = factor.max(0.0).powf(1.0 / f64::from(order)).clamp(0.1, 1e2);
            value *= change;
            if (change - 1.0).abs() < 1e-3 {
                break;
            }
        }
        Some(value)
    }

    /// Judges a motion by what is shown up to a time (s).
    pub fn judged(&self, played: &Played, until: f64) -> Option<Judged> {
        let until = until.min(self.covered.1);
        let left = self.observation.map(|seen| seen.left(&played.values, until));
        if left.is_some_and(f64::is_nan) {
            return None;
        }
        let covered = |events: &[SequenceEvent]| -> Vec<SequenceEvent> {
            let inside = |e: &&SequenceEvent| e.time >= self.covered.0 && e.time <= until;
            events.iter().filter(inside).copied().collect()
        };
        let word = covered(self.word);
        // Where a table of events ends nobody knows: of the next one less than its longest pause later it may have been cut off.
        let last = word.last().map_or(f64::NEG_INFINITY, |event| event.time);
        let pauses = word.windows(2).map(|two| two[1].time - two[0].time);
        let pause = pauses.fold(0.0, f64::max);
        // The partner of the last one may come a little later.
        let after = last + (0.25 * self.period).min(0.5 * pause);
        let is_open = |event: &SequenceEvent| event.time > after && event.time <= last + pause;
        let agreement = |events: &[SequenceEvent]| {
            let mut events = covered(events);
            if self.observation.is_none() {
                events.retain(|event| !is_open(event));
            }
            agreement(&events, &word, self.period)
        };
        let before = match until >= self.covered.1 {
            true => *self.before.get_or_init(|| agreement(self.reference)),
            false => agreement(self.reference),
        };
        let after = agreement(&played.events);
        let unmatched = (0.25 * self.period) * (0.25 * self.period);
        let square = |a: &Agreement| a.rms * a.rms * a.matched as f64 + a.unmatched as f64 * unmatched;
        let (events_before, events_left) = (square(&before), square(&after));
        let within = after.unmatched == 0 && after.max <= self.bound;
        let part = |left: f64, before: f64| {
            if before > 0.0 {
                1.0 - left / before
            } else {
                f64::NEG_INFINITY
            }
        };
        let of_events = part(events_left, events_before);
        Some(match self.observation.zip(left) {
            Some((observation, left)) => {
                let explained = part(left, observation.left(&observation.reference, until));
                Judged {
                    explained,
                    left,
                    before,
                    after,
                    events: within
                        || of_events >= OF_EVENTS
                        || self.detected
                            && (explained >= EXACT || explained >= 1.0 - ALL && after.cost <= 0.5 * before.cost),
                }
            }
            None => Judged {
                explained: of_events,
                left: events_left,
                before,
                after,
                events: true,
            },
        })
    }
}
