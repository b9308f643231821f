//! The brake run by the automaton: which solver where, and what is recorded.

pub mod options;
pub mod record;

pub use options::{Method, OutputOptions, OutputWindow, SolverOptions};
pub use record::{Channels, Event, EventKind, Recorder, RecorderError, Sample, Segment, State};
