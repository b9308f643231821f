//! The rows of a run (samples, events, segments, cycles), their channels and recorders. No solver, no file.

pub mod channel;
mod digest;
mod recorder;
mod rows;
pub mod sequence;

pub use channel::{Channels, RecordedChannel, State};
pub use digest::{Cycle, CycleStatistics, EventDigest};
pub use recorder::{FurtherColumns, MemoryRecorder, NoRecorder, Recorder, RecorderError};
pub use rows::{Counters, DensePiece, Event, EventKind, Sample, Segment};
