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
    pub(super) events: Vec<(EventKind, f64)>,
    /// For how long sliding had to resolve the fast mode, s, as far as segments told of it.
    pub(super) resolved: f64,
    /// How long it slid, s.
    pub(super) slid: f64,
}

impl Sequence {
    /// The last event: its kind and its time (s).
    pub(super) fn last(&self) -> Option<&(EventKind, f64)> {
        self.events.last()
    }

    /// How many events agree with those of `result`, from the first on: in kind and, by [`SAME`], in time.
    pub(super) fn agreeing(&self, result: &Sequence) -> usize {
        let mut before = 0.0;
        let agrees = |(own, other): &(&(EventKind, f64), &(EventKind, f64))| {
            let apart = (own.1 - other.1).abs();
            let near = apart <= AT_ONCE.max(SAME * (other.1 - before));
            before = other.1;
            own.0 == other.0 && near
        };
        self.events.iter().zip(&result.events).take_while(agrees).count()
    }

    /// How far event `index` is from that of `result`, in s and as a share of the time since the event before, if both are of one
    /// kind and that time is not zero.
    pub(super) fn apart(&self, result: &Sequence, index: usize) -> Option<(f64, f64)> {
        let (own, other) = (self.events.get(index)?, result.events.get(index)?);
        let before = index.checked_sub(1).map_or(0.0, |before| result.events[before].1);
        let apart = (own.1 - other.1).abs();
        (own.0 == other.0 && other.1 > before).then(|| (apart, apart / (other.1 - before)))
    }
}

/// What is kept of a run of which nothing but its sequence matters.
impl Recorder for Sequence {
    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        if event.kind.in_event_sequence() {
            self.events.push((event.kind, event.time));
        }
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

    fn stores_motion(&self) -> bool {
        false
    }
}
