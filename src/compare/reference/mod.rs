//! The reference as a function of time: between its samples, and never across an event.
//!
//! The model's equations give the first two derivatives of a state, so between two samples of one mode a polynomial of
//! degree 5 is known: with n samples in a natural period it errs by about (2 pi/n)^6/46080 of an oscillation, 2e-12 with
//! the 96 of the built-in cases. How well it satisfies the equations in the middle tells where the samples of the file are
//! too sparse for it; there the case, which the file holds, is run again with samples that are dense enough. Of two trains the Taylor series of
//! the equations leads from one sample to the next.

mod gap;
mod nodes;
mod physics;
mod rerun;
mod subject;
mod train_physics;
mod train_walk;
mod walk;

pub(crate) use gap::Gap;
pub(super) use gap::horner;
pub use gap::{Curve, Node};
pub use physics::Physics;
pub use rerun::Rerun;
pub use subject::Subject;
pub(crate) use subject::{AnyWalk, MOTION};
pub(crate) use train_physics::is_brake;
pub use train_physics::{TimeScale, TrainPhysics};
pub(crate) use train_walk::{TrainWalk, states_at_events};
pub(crate) use walk::Walk;
