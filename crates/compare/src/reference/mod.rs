//! The reference as a function of time: between its samples, and never across an event.
//!
//! The Taylor series of the equations leads from one sample to the next. Its miss there shows whether the file's motion
//! is that of its case. If the samples are so far apart that an instability amplifies rounding, the case in the file is
//! run again with denser samples.

mod nodes;
mod physics;
mod rerun;
mod walk;

pub use nodes::{BeforeAndAfter, states_at_events};
pub use physics::{Physics, TimeScale};
pub(crate) use rerun::Rerun;
pub(crate) use walk::{GapPolynomial, Walk};
