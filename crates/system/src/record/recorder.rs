//! Interface between a run and the recorder of its rows.

use super::digest::Cycle;
use super::rows::{DensePiece, Event, Sample, Segment};
use crate::model::Mode;

/// Failure of a recorder, such as a full disk; the run stops with it.
pub type RecorderError = Box<dyn std::error::Error + Send + Sync>;

/// Receiver of a run's rows, in order of time.
pub trait Recorder {
    /// Values of the next row beyond [`State`](super::State): once for a sample, twice for an event, before and after
    /// it.
    fn further(&mut self, _values: &[f64]) -> Result<(), RecorderError> {
        Ok(())
    }
    /// Takes a row of the trajectory.
    fn sample(&mut self, _sample: &Sample) -> Result<(), RecorderError> {
        Ok(())
    }
    /// Takes an event.
    fn event(&mut self, _event: &Event) -> Result<(), RecorderError> {
        Ok(())
    }
    /// Takes a segment when it has ended.
    fn segment(&mut self, _segment: &Segment) -> Result<(), RecorderError> {
        Ok(())
    }
    /// Takes a piece of the motion, in a run with dense output.
    fn piece(&mut self, _piece: &DensePiece<'_>) -> Result<(), RecorderError> {
        Ok(())
    }
    /// Takes a cycle of stick-slip, after the event that completes it.
    fn cycle(&mut self, _cycle: &Cycle) -> Result<(), RecorderError> {
        Ok(())
    }
    /// Next time (s) of a requested state besides the samples; infinite for none. Called before every step;
    /// [`Self::strobe`] advances it.
    fn next_strobe(&self) -> f64 {
        f64::INFINITY
    }
    /// Takes time (s), mode and omega_r (rad/s) of a requested state, whose values [`Self::further`] has received.
    fn strobe(&mut self, _time: f64, _mode: Mode, _relative_velocity: f64) -> Result<(), RecorderError> {
        Ok(())
    }
    /// Whether events can be read from the recorder's storage. The report of the run then leaves them out, which bounds
    /// its memory.
    fn stores_events(&self) -> bool {
        false
    }
    /// Whether samples and pieces are stored; otherwise there are no samples around events.
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

/// A recorder in memory, for tests and short runs.
#[derive(Debug, Default)]
pub struct MemoryRecorder {
    /// All samples, in order of time.
    pub samples: Vec<Sample>,
    /// All events, in order of time.
    pub events: Vec<Event>,
    /// All segments, in order of time.
    pub segments: Vec<Segment>,
    /// Values of samples and events beyond [`State`](super::State) and [`Channels`](super::Channels).
    pub further: FurtherColumns,
}

/// Values of samples and events beyond the common columns.
#[derive(Debug, Default)]
pub struct FurtherColumns {
    /// Row after row, with equal lengths.
    rows: Vec<f64>,
    /// Event after event: values before it, then values after it.
    at_events: Vec<f64>,
    next: Vec<f64>,
}

fn part(list: &[f64], index: usize, count: usize) -> &[f64] {
    let length = list.len() / count;
    &list[length * index..length * (index + 1)]
}

impl MemoryRecorder {
    /// Adds a sample with its further values.
    pub fn push(&mut self, sample: &Sample, further: &[f64]) {
        self.samples.push(*sample);
        self.further.rows.extend_from_slice(further);
    }

    /// Adds an event with its further values, those before it first.
    pub fn push_event(&mut self, event: &Event, further: &[f64]) {
        self.events.push(*event);
        self.further.at_events.extend_from_slice(further);
    }

    /// The further values of a sample.
    pub fn further(&self, index: usize) -> &[f64] {
        part(&self.further.rows, index, self.samples.len())
    }

    /// The further values before and after an event.
    pub fn further_at_event(&self, index: usize) -> (&[f64], &[f64]) {
        let both = part(&self.further.at_events, index, self.events.len());
        both.split_at(both.len() / 2)
    }

    /// All values of a row: state, channels and further values, in the order of a file.
    pub fn values(&self, index: usize) -> Vec<f64> {
        let sample = &self.samples[index];
        let known = sample.state.values().into_iter().chain(sample.channels.values());
        known.chain(self.further(index).iter().copied()).collect()
    }
}

impl Recorder for MemoryRecorder {
    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        values.clone_into(&mut self.further.next);
        Ok(())
    }
    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.samples.push(*sample);
        self.further.rows.extend_from_slice(&self.further.next);
        Ok(())
    }
    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.events.push(*event);
        self.further.at_events.extend_from_slice(&self.further.next);
        Ok(())
    }
    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        self.segments.push(segment.clone());
        Ok(())
    }
}
