//! Who takes the rows of a run.

use super::digest::Cycle;
use super::rows::{Event, Piece, Sample, Segment};

/// A recorder failed (a full disk, for example); the run stops and says so.
pub type RecorderError = Box<dyn std::error::Error + Send + Sync>;

/// Takes the run as it is computed. Rows arrive in order of time. What a recorder does not take is not kept.
pub trait Recorder {
    /// What the state of the row that comes next has beyond [`State`](super::State): of a sample once, of an event twice, before
    /// and after it.
    fn further(&mut self, _values: &[f64]) -> Result<(), RecorderError> {
        Ok(())
    }
    /// A row of the trajectory.
    fn sample(&mut self, _sample: &Sample) -> Result<(), RecorderError> {
        Ok(())
    }
    /// An event.
    fn event(&mut self, _event: &Event) -> Result<(), RecorderError> {
        Ok(())
    }
    /// A segment, when it has ended.
    fn segment(&mut self, _segment: &Segment) -> Result<(), RecorderError> {
        Ok(())
    }
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
    /// What the samples have beyond [`State`](super::State) and [`Channels`](super::Channels).
    pub further: FurtherColumns,
}

/// Numbers of samples beyond those that every case has.
#[derive(Debug, Default)]
pub struct FurtherColumns {
    /// Row after row, as many for each sample.
    rows: Vec<f64>,
    /// Those of the next sample.
    next: Vec<f64>,
}

impl MemoryRecorder {
    /// Of events alone.
    pub fn of_events(events: Vec<Event>) -> MemoryRecorder {
        MemoryRecorder {
            events,
            ..MemoryRecorder::default()
        }
    }

    /// Takes a sample with its further numbers.
    pub fn push(&mut self, sample: &Sample, further: &[f64]) {
        self.samples.push(*sample);
        self.further.rows.extend_from_slice(further);
    }

    /// Every number of the row of this index: state, channels and the further ones, in the order of a file.
    pub fn values(&self, index: usize) -> Vec<f64> {
        let sample = &self.samples[index];
        let further = &self.further.rows;
        let count = further.len() / self.samples.len();
        let known = sample.state.values().into_iter().chain(sample.channels.values());
        known
            .chain(further[count * index..count * (index + 1)].iter().copied())
            .collect()
    }
}

impl Recorder for MemoryRecorder {
    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        self.further.next.clear();
        self.further.next.extend_from_slice(values);
        Ok(())
    }
    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.samples.push(*sample);
        self.further.rows.extend_from_slice(&self.further.next);
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
