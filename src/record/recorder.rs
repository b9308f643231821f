//! The recorder of a run, which takes its rows.

use super::digest::Cycle;
use super::rows::{Event, Piece, Sample, Segment};
use crate::model::Mode;

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
    /// When (s) the state is wanted next, besides the samples; infinite where it is not. Asked before every step: it moves on with
    /// [`Self::strobe`].
    fn next_strobe(&self) -> f64 {
        f64::INFINITY
    }
    /// The state at that time has been handed over by [`Self::further`]: this is the time (s), the mode, and omega_r (rad/s).
    fn strobe(&mut self, _time: f64, _mode: Mode, _relative_velocity: f64) -> Result<(), RecorderError> {
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
    /// What samples and events have beyond [`State`](super::State) and [`Channels`](super::Channels).
    pub further: FurtherColumns,
}

/// Numbers of samples and events beyond those that every case has.
#[derive(Debug, Default)]
pub struct FurtherColumns {
    /// Row after row, as many for each sample.
    rows: Vec<f64>,
    /// Event after event: as many before it, then as many after it.
    at_events: Vec<f64>,
    /// Those of the next sample or event.
    next: Vec<f64>,
}

/// The numbers of row `index` in a list of `count` rows of equal length.
fn part(list: &[f64], index: usize, count: usize) -> &[f64] {
    let length = list.len() / count;
    &list[length * index..length * (index + 1)]
}

impl MemoryRecorder {
    /// Takes a sample with its further numbers.
    pub fn push(&mut self, sample: &Sample, further: &[f64]) {
        self.samples.push(*sample);
        self.further.rows.extend_from_slice(further);
    }

    /// Takes an event with its further numbers, those before it first.
    pub fn push_event(&mut self, event: &Event, further: &[f64]) {
        self.events.push(*event);
        self.further.at_events.extend_from_slice(further);
    }

    /// The further numbers of the sample of this index.
    pub fn further(&self, index: usize) -> &[f64] {
        part(&self.further.rows, index, self.samples.len())
    }

    /// The further numbers before and after the event of this index.
    pub fn further_at_event(&self, index: usize) -> (&[f64], &[f64]) {
        let both = part(&self.further.at_events, index, self.events.len());
        both.split_at(both.len() / 2)
    }

    /// Every number of the row of this index: state, channels and the further ones, in the order of a file.
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
