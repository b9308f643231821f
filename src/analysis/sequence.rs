//! The sequence of events of a run, as a recorder that keeps nothing else.

use crate::record::{Event, EventKind, Recorder, RecorderError, Segment};

/// Events of two methods agree if they are no farther apart than this share of the time since the event before: beyond,
/// something has grown between the two runs.
const SAME: f64 = 1e-3;

/// Events that are no farther apart than this (s) agree in any case: short sticks follow their slip by less than a method's error.
const AT_ONCE: f64 = 1e-9;

/// The sequence of events of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sequence {
    /// Of all events, in order of time: those of the sequence and the others.
    kinds: Vec<EventKind>,
    times: Vec<f64>,
    /// For how long sliding had to resolve the fast mode, s, as far as segments told of it.
    pub(super) resolved: f64,
    /// How long it slid, s.
    pub(super) slid: f64,
}

impl Sequence {
    /// Every event, with its time (s).
    fn all(&self) -> impl DoubleEndedIterator<Item = (EventKind, f64)> + '_ {
        self.kinds.iter().copied().zip(self.times.iter().copied())
    }

    /// The events of the sequence.
    pub(super) fn events(&self) -> impl Iterator<Item = (EventKind, f64)> + '_ {
        self.all().filter(|event| event.0.in_event_sequence())
    }

    /// The last event of the sequence.
    pub(super) fn last(&self) -> Option<(EventKind, f64)> {
        self.all().rev().find(|event| event.0.in_event_sequence())
    }

    /// How many events agree with those of `result`, from the first on: in kind and, by [`SAME`], in time.
    pub(super) fn agreeing(&self, result: &Sequence) -> usize {
        let mut before = 0.0;
        let agrees = |(own, other): &((EventKind, f64), (EventKind, f64))| {
            let apart = (own.1 - other.1).abs();
            let near = apart <= AT_ONCE.max(SAME * (other.1 - before));
            before = other.1;
            own.0 == other.0 && near
        };
        self.events().zip(result.events()).take_while(agrees).count()
    }

    /// When the events come that agree with those of `result`, of which the first `agreeing` of the sequence do, in its order, s: NaN
    /// where there is none. Events outside the sequence
    /// are matched by their count among their kind, up to the first event of the sequence that is another.
    pub(super) fn times_of(&self, result: &Sequence, agreeing: usize) -> Vec<f64> {
        let next = |sequence: &Sequence| sequence.events().nth(agreeing).map_or(f64::INFINITY, |event| event.1);
        let known_until = next(self).min(next(result));
        let mut word = self.events().take(agreeing);
        let mut others: Vec<(EventKind, usize)> = Vec::new();
        let mut other = |kind: EventKind| {
            let index = others.iter().position(|other| other.0 == kind).unwrap_or_else(|| {
                others.push((kind, 0));
                others.len() - 1
            });
            let from = others[index].1;
            let found = self.kinds[from..].iter().position(|own| *own == kind);
            others[index].1 = found.map_or(self.kinds.len(), |found| from + found + 1);
            found
                .map(|found| self.times[from + found])
                .filter(|own| *own < known_until)
        };
        let time = |(kind, time): (EventKind, f64)| match kind.in_event_sequence() {
            true => word.next().map(|event| event.1),
            false if time < known_until => other(kind),
            false => None,
        };
        result.all().map(time).map(|time| time.unwrap_or(f64::NAN)).collect()
    }

    /// How far event `index` is from that of `result`, in s and as a share of the time since the event before, if both are of one
    /// kind and that time is not zero.
    pub(super) fn apart(&self, result: &Sequence, index: usize) -> Option<(f64, f64)> {
        let mut others = result.events().skip(index.saturating_sub(1)).map(|event| event.1);
        let before = if index == 0 { 0.0 } else { others.next()? };
        let (own, other) = (self.events().nth(index)?, result.events().nth(index)?);
        let apart = (own.1 - other.1).abs();
        (own.0 == other.0 && other.1 > before).then(|| (apart, apart / (other.1 - before)))
    }
}

/// What is kept of a run of which nothing but its sequence matters.
impl Recorder for Sequence {
    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.kinds.push(event.kind);
        self.times.push(event.time);
        Ok(())
    }

    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        if segment.mode.sense() != 0 {
            let time = segment.end - segment.start;
            self.slid += time;
            if segment.resolved == Some(true) {
                self.resolved += time;
            }
        }
        Ok(())
    }

    /// All that is asked of them.
    fn stores_events(&self) -> bool {
        true
    }

    fn stores_motion(&self) -> bool {
        false
    }
}
