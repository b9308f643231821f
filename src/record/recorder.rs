//! Who takes the rows of a run.

use super::digest::Cycle;
use super::rows::{Event, Piece, Sample, Segment};

/// A recorder failed (a full disk, for example); the run stops and says so.
pub type RecorderError = Box<dyn std::error::Error + Send + Sync>;

/// Takes the run as it is computed. Rows arrive in order of time.
pub trait Recorder {
    /// What the state of the row that comes next has beyond [`State`](super::State): of a sample once, of an event twice, before
    /// and after it.
    fn further(&mut self, _values: &[f64]) -> Result<(), RecorderError> {
        Ok(())
    }
    /// A row of the trajectory.
    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError>;
    /// An event.
    fn event(&mut self, event: &Event) -> Result<(), RecorderError>;
    /// A segment, when it has ended.
    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError>;
    /// A piece of the motion, of a run with dense output.
    fn piece(&mut self, _piece: &Piece<'_>) -> Result<(), RecorderError> {
        Ok(())
    }
    /// A cycle of stick-slip, after the event that completes it.
    fn cycle(&mut self, _cycle: &Cycle) -> Result<(), RecorderError> {
        Ok(())
    }
    /// Whether the events can be read where the recorder puts them; the report of the run then leaves them out, so that
    /// its memory is bounded.
    fn stores_events(&self) -> bool {
        false
    }
    /// Whether samples and pieces are kept; where they are not, none are made around events.
    fn stores_motion(&self) -> bool {
        true
    }
}

/// A recorder that keeps nothing.
#[derive(Debug, Default)]
pub struct NoRecorder;

impl Recorder for NoRecorder {
    fn stores_motion(&self) -> bool {
        false
    }
    fn sample(&mut self, _: &Sample) -> Result<(), RecorderError> {
        Ok(())
    }
    fn event(&mut self, _: &Event) -> Result<(), RecorderError> {
        Ok(())
    }
    fn segment(&mut self, _: &Segment) -> Result<(), RecorderError> {
        Ok(())
    }
}

/// A recorder that keeps everything in memory: for tests and short runs.
#[derive(Debug, Default)]
pub struct MemoryRecorder {
    /// All samples, in order of time.
    pub samples: Vec<Sample>,
    /// All events, in order of time.
    pub events: Vec<Event>,
    /// All segments, in order of time.
    pub segments: Vec<Segment>,
}

impl Recorder for MemoryRecorder {
    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.samples.push(*sample);
        Ok(())
    }
    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.events.push(*event);
        Ok(())
    }
    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        self.segments.push(segment.clone());
        Ok(())
    }
}
