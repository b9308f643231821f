//! The sequence of events of a run, as a minimal recorder.

use stickslip_system::record::{Event, EventKind, Recorder, RecorderError, Segment};

/// Events agree within this fraction of the time since the previous one. Larger distances grew between the runs.
const SAME: f64 = 1e-3;

/// Events within this distance (s) always agree: a short stick follows its slip by less than a method's error.
const AT_ONCE: f64 = 1e-9;

/// Sequence of events of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sequence {
    kinds: Vec<EventKind>,
    times: Vec<f64>,
    /// Sliding time during which the fast mode was resolved, s, as far as segments report it.
    pub(super) resolved: f64,
    pub(super) slid: f64,
}

/// Changes of stability that differ between two runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherStability {
    /// Number of changes of stability in the witness.
    pub found: usize,
    /// Number of changes in the result.
    pub expected: usize,
    /// Time of the first change that differs, s.
    pub from: f64,
}

impl Sequence {
    fn all(&self) -> impl DoubleEndedIterator<Item = (EventKind, f64)> + '_ {
        self.kinds.iter().copied().zip(self.times.iter().copied())
    }

    pub(super) fn events(&self) -> impl Iterator<Item = (EventKind, f64)> + '_ {
        self.all().filter(|event| event.0.in_event_sequence())
    }

    pub(super) fn last(&self) -> Option<(EventKind, f64)> {
        self.all().rev().find(|event| event.0.in_event_sequence())
    }

    pub(super) fn agreeing(&self, result: &Sequence) -> usize {
        alike(self.events(), result.events())
    }

    fn changes_of_stability(&self) -> Vec<(EventKind, f64)> {
        let changes = [EventKind::Destabilised, EventKind::Restabilised];
        self.all().filter(|event| changes.contains(&event.0)).collect()
    }

    pub(super) fn other_stability(&self, result: &Sequence) -> Option<OtherStability> {
        let [own, theirs] = [self, result].map(Sequence::changes_of_stability);
        let agreeing = alike(own.iter().copied(), theirs.iter().copied());
        let differing = own.get(agreeing).into_iter().chain(theirs.get(agreeing));
        let from = differing.map(|event| event.1).reduce(f64::min)?;
        Some(OtherStability {
            found: own.len(),
            expected: theirs.len(),
            from,
        })
    }

    /// Times of the events that agree with those of `result`, s; NaN if missing. Events outside the sequence are
    /// matched by their index within their kind, up to the first event that differs.
    pub(super) fn times_of(&self, result: &Sequence, agreeing: usize) -> Vec<f64> {
        let differs = |sequence: &Sequence| sequence.events().nth(agreeing).map_or(f64::INFINITY, |event| event.1);
        let known_until = differs(self).min(differs(result));
        let mut word = self.events().take(agreeing);
        let mut next = [0; EventKind::ALL.len()];
        let mut other = |kind: EventKind| {
            let from = next[kind as usize];
            let found = self.kinds[from..].iter().position(|own| *own == kind);
            next[kind as usize] = found.map_or(self.kinds.len(), |found| from + found + 1);
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

    /// Distance of event `index` to that of `result`, s, and its fraction of the time since the previous event.
    pub(super) fn apart(&self, result: &Sequence, index: usize) -> Option<(f64, f64)> {
        let mut others = result.events().skip(index.saturating_sub(1)).map(|event| event.1);
        let before = if index == 0 { 0.0 } else { others.next()? };
        let (own, other) = (self.events().nth(index)?, result.events().nth(index)?);
        let apart = (own.1 - other.1).abs();
        (own.0 == other.0 && other.1 > before).then(|| (apart, apart / (other.1 - before)))
    }
}

/// Number of leading events that agree in kind and, by [`SAME`], in time.
fn alike(own: impl Iterator<Item = (EventKind, f64)>, result: impl Iterator<Item = (EventKind, f64)>) -> usize {
    let mut before = 0.0;
    let agrees = |(own, other): &((EventKind, f64), (EventKind, f64))| {
        let apart = (own.1 - other.1).abs();
        let near = apart <= AT_ONCE.max(SAME * (other.1 - before));
        before = other.1;
        own.0 == other.0 && near
    };
    own.zip(result).take_while(agrees).count()
}

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

    fn stores_events(&self) -> bool {
        true
    }

    fn stores_motion(&self) -> bool {
        false
    }
}
