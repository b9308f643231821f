//! Two trains that touch at one contact: the family that the brake belongs to.
//!
//! A train is an open chain of inertias and shafts, seen from the contact outwards: inertia 0 is the surface. Its far end is
//! free, fixed to the ground, or driven at a known speed. The paper's brake is a rotor of two inertias with a free end, and a
//! stator of one inertia with a fixed one; a mass on a belt is a stator of one inertia and a rotor of none, whose surface is
//! itself the driven end.
//!
//! | module | what it is |
//! |---|---|
//! | `parameters` | what defines the problem |
//! | `margin` | when steady sliding loses its stability |
//! | `system` | the equations in twist coordinates |
//! | `slow_manifold` | sliding without the fast oscillations |
//! | `slow_motion` | stick and separation without them |
//! | `chains`, `closed_form` | stick and separation in closed form |
//! | `stability` | the loss of stability of sliding that slows down by itself, foreseen |

mod chains;
pub mod closed_form;
pub mod margin;
pub mod parameters;
#[cfg(test)]
mod samples;
pub mod slow_manifold;
pub(crate) mod slow_motion;
pub(crate) mod stability;
pub mod system;

pub use parameters::{
    Bristles, ContactLaw, End, ExactTrains, Initial, Kick, KickSide, Pressing, Regularisation, Smoothing, Torque,
    Train, Trains,
};
