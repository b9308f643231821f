//! The rows of a run (samples, events, segments, cycles) and their recorders. No solver, no file.

mod digest;
mod recorder;
mod rows;
pub mod sequence;

pub use digest::{Cycle, CycleStatistics, EventDigest};
pub use recorder::{FurtherColumns, MemoryRecorder, NoRecorder, Recorder, RecorderError};
pub use rows::{Channels, DensePiece, Event, EventKind, Sample, Segment, State};
