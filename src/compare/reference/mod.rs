//! The reference as a function of time: between its samples, and never across an event.
//!
//! From a sample on, the Taylor series of the equations leads to the next one, and what it misses it by tells whether the motion
//! of the file is that of its case. Where the samples are so far apart that an instability makes rounding of it, the case, which
//! the file holds, is run again with samples that are dense enough.

mod nodes;
mod physics;
mod rerun;
mod walk;

pub(crate) use nodes::{BeforeAndAfter, states_at_events};
pub use physics::{Physics, TimeScale};
pub(crate) use rerun::Rerun;
pub(crate) use walk::{Curve, Walk};
