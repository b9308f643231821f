//! Part of a candidate's difference that a motion explains.

use super::evidence::Evidence;
use super::motion::Played;
use super::parameters::{self, Agreement};
use stickslip_system::record::sequence::SequenceEvent;

/// Smallest explained part of the squared difference for a cause, and of squared event times if samples show more than
/// events.
pub(crate) const EXPLAINED: f64 = 0.99;
const OF_EVENTS: f64 = 0.9;
/// A motion that leaves less than this part of the squares of the samples has the events found in them.
pub(crate) const ALL: f64 = 1e-4;
/// A motion that explains this part is the candidate's, whatever events were found.
pub(crate) const EXACT: f64 = 1.0 - 1e-6;
/// Smallest explained share for values fitted to samples, because some value brings any two motions closer.
pub(crate) const OF_FITTED: f64 = 0.999;
/// Mean squares (in parts of the sizes) and squares of event times (s^2) below this are rounding.
const FLOOR: f64 = 1e-18;
/// Two motions explain equally if their remaining squares differ by less than this factor.
const AS_MUCH: f64 = 2.0;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Judged {
    /// Part of the squared difference of candidate and reference that the motion removes.
    pub explained: f64,
    pub left: f64,
    /// Agreement of the candidate's events with the reference's, and with the motion's.
    pub before: Agreement,
    pub after: Agreement,
    events: bool,
    /// The candidate contradicts the motion before its first difference.
    contradicted: bool,
    /// A constant of each channel explains as much.
    constant: bool,
}

impl Judged {
    pub fn is_cause(&self) -> bool {
        self.explained >= EXPLAINED && self.events && !self.contradicted && !self.constant
    }

    /// The reason against a motion that explains nearly all, in words; `least` is the share that it has to explain.
    pub fn why_not(&self, least: f64) -> &'static str {
        match () {
            () if self.explained < least => ", which is not enough for it",
            () if self.contradicted => ", but departs from the candidate before the reference does",
            () if self.constant => ", as a constant in each channel does",
            () if !self.events => ", but has its events at other times",
            () => ", as do others",
        }
    }

    /// Whether no more events lack a partner than with the reference.
    pub fn has_events(&self) -> bool {
        self.after.unmatched <= self.before.unmatched
    }

    /// Judges by samples alone, if so: the events are then not those of the motion.
    pub fn by_samples_if(self, is_so: bool) -> Judged {
        let events = self.events || is_so;
        Judged { events, ..self }
    }

    /// Judges a motion that differs by constants alone.
    pub fn by_constants(self) -> Judged {
        Judged {
            constant: false,
            ..self
        }
    }

    pub fn far() -> Judged {
        Judged {
            left: f64::INFINITY,
            contradicted: true,
            ..Judged::default()
        }
    }

    pub fn as_much_as(&self, best: &Judged) -> bool {
        self.left <= AS_MUCH * best.left + FLOOR
    }
}

/// Motions are close while no channel differs by more than this part of its size, and no event by more than this part
/// of the natural period. A window has this many samples, or events, more: they show the error of an event.
pub(crate) const CLOSE: f64 = 0.05;
const FEWEST: usize = 8;

/// A motion that is farther than this many times what needs no explanation is another.
pub(crate) const FARTHER: f64 = 10.0;

const PROJECTIONS: usize = 6;

impl Evidence<'_> {
    fn inside(&self, event: &SequenceEvent) -> bool {
        event.time >= self.covered.0 && event.time <= self.covered.1
    }

    /// Times of the candidate's events paired with those of a motion while the kinds agree, s.
    fn pairs<'a>(&'a self, played: &'a Played) -> impl Iterator<Item = (f64, f64)> + 'a {
        let theirs = self.word.iter().filter(|event| self.inside(event));
        let ours = played.events.iter().filter(|event| self.inside(event));
        let pairs = theirs.zip(ours).take_while(|(theirs, ours)| theirs.kind == ours.kind);
        pairs.map(|(theirs, ours)| (theirs.time, ours.time))
    }

    /// Number of samples, or of events without samples, that are compared during a fit.
    pub(crate) fn window(&self, played: &Played) -> usize {
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

    /// Whether a window has all samples, or all events without samples.
    pub(crate) fn is_whole(&self, played: &Played, window: usize) -> bool {
        let all = match self.observation {
            Some(observation) => observation.time.partition_point(|time| *time <= self.covered.1),
            None => self.pairs(played).count(),
        };
        window >= all
    }

    /// Differences of a motion from the candidate in a window, channel by channel in parts of the sizes, or event by
    /// event in natural periods; NaN if the motion has no value.
    pub(crate) fn residual(&self, played: &Played, window: usize) -> Vec<f64> {
        match self.observation {
            Some(observation) => observation.residual(&played.values, window),
            None => {
                let known = self.pairs(played).map(|(theirs, ours)| (ours - theirs) / self.period);
                known.chain(std::iter::repeat(f64::NAN)).take(window).collect()
            }
        }
    }

    pub(crate) fn reference(&self) -> Played {
        Played {
            values: self.observation.map_or_else(Vec::new, |seen| seen.reference.clone()),
            events: self.reference.to_vec(),
            steps: 0,
        }
    }

    /// Value, searched from `begin`, at which the candidate's difference from the reference, projected onto the
    /// motion's, equals the motion's. The motion is the reference at zero, and differs from it by the power `order` of
    /// the value.
    pub(crate) fn projected(&self, begin: f64, order: i32, play: &dyn Fn(f64, f64) -> Option<Played>) -> Option<f64> {
        let reference = self.reference();
        let window = self.window(&reference);
        let off = self.residual(&reference, window);
        let mut value = begin;
        for _ in 0..PROJECTIONS {
            let left = self.residual(&play(value, self.time_of(window))?, window);
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
            // The power law fails if the difference points the other way.
            let change = factor.max(0.0).powf(1.0 / f64::from(order)).clamp(0.1, 1e2);
            value *= change;
            if (change - 1.0).abs() < 1e-3 {
                break;
            }
        }
        Some(value)
    }

    /// Whether the candidate has an event at a time, s.
    pub(crate) fn has_event(&self, time: f64) -> bool {
        let near = self.bound.max(self.least * self.period);
        self.word.iter().any(|event| (event.time - time).abs() <= near)
    }

    /// Whether two motions differ by rounding only.
    pub(crate) fn is_same(&self, one: &Played, other: &Played) -> bool {
        let events = one.events.iter().zip(&other.events);
        let near = |(a, b): (&SequenceEvent, &SequenceEvent)| {
            a.kind == b.kind && (a.time - b.time).abs() <= 1e-9 * self.period
        };
        one.events.len() == other.events.len()
            && events.into_iter().all(near)
            && self
                .observation
                .is_none_or(|seen| seen.between(&one.values, &other.values) <= FLOOR)
    }

    /// Whether a motion's events differ from those of a table before the reference's do.
    fn contradicted(&self, word: &[SequenceEvent], events: &[SequenceEvent]) -> bool {
        let least = self.bound.max(self.least * self.period);
        let off = |(a, b): (&SequenceEvent, &SequenceEvent)| match a.kind == b.kind {
            true => (a.time - b.time).abs(),
            false => f64::INFINITY,
        };
        let inside = |event: &&SequenceEvent| self.inside(event);
        let reference = self.reference.iter().filter(inside);
        let same = word.iter().zip(reference).take_while(|pair| off(*pair) <= least);
        let same = same.count();
        let pairs = word.iter().zip(events.iter().filter(inside)).take(same);
        pairs.filter(|pair| off(*pair) <= FARTHER * least).count() < same
    }

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
        // The end of an event table is unknown: an event less than its longest pause later may have been cut off.
        let last = word.last().map_or(f64::NEG_INFINITY, |event| event.time);
        let pauses = word.windows(2).map(|two| two[1].time - two[0].time);
        let pause = pauses.fold(0.0, f64::max);
        let after = last + (0.25 * self.period).min(0.5 * pause);
        let is_open = |event: &SequenceEvent| event.time > after && event.time <= last + pause;
        let agreement = |events: &[SequenceEvent]| {
            let mut events = covered(events);
            if self.observation.is_none() {
                events.retain(|event| !is_open(event));
            }
            parameters::agreement(&events, &word, self.period)
        };
        let before = match until >= self.covered.1 {
            true => *self.before.get_or_init(|| agreement(self.reference)),
            false => agreement(self.reference),
        };
        let mut after = agreement(&played.events);
        // Found in the motion's samples, as the candidate's were: its relative velocity may follow from another drive, and
        // samples hide short motions.
        let found = self.detected.zip(self.observation).and_then(|(detection, seen)| {
            let found = |motion| seen.found(motion, detection, self.physics.sticks());
            let theirs = self.found.get_or_init(|| found(&seen.values));
            Some((theirs.as_ref()?, found(&played.values)?))
        });
        if let Some((theirs, ours)) = found {
            let like = parameters::agreement(&covered(&ours), &covered(theirs), self.period);
            after = if like.cost < after.cost { like } else { after };
        }
        let part = |left: f64, before: f64| match before > 0.0 {
            true => 1.0 - left / before,
            false => f64::NEG_INFINITY,
        };
        let unmatched = (0.25 * self.period) * (0.25 * self.period);
        let square = |a: &Agreement| a.rms * a.rms * a.matched as f64 + a.unmatched as f64 * unmatched;
        let by_events = Judged {
            explained: part(square(&after), square(&before)),
            left: square(&after),
            before,
            after,
            events: true,
            contradicted: false,
            constant: false,
        };
        let within = after.unmatched == 0 && after.max <= self.bound;
        Some(match self.observation.zip(left) {
            Some((observation, left)) => {
                let explained = part(left, observation.left(&observation.reference, until));
                let whole = observation.left(&observation.reference, f64::INFINITY);
                let constants = observation.constants;
                Judged {
                    explained,
                    left,
                    events: within
                        || by_events.explained >= OF_EVENTS
                        || self.detected.is_some() && explained >= 1.0 - ALL && after.cost <= 0.5 * before.cost,
                    contradicted: observation.contradicts(&played.values, self.least, until),
                    constant: part(constants, whole) >= EXPLAINED && constants <= AS_MUCH * left + FLOOR,
                    ..by_events
                }
            }
            None => Judged {
                contradicted: self.contradicted(&word, &played.events),
                ..by_events
            },
        })
    }
}
