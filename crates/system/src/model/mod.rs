//! The equations: pure functions of parameters and state, no solver, no I/O.
//!
//! A system is two chains that touch at one contact. A chain is a train of inertias and shafts, numbered from the
//! contact outwards: inertia 0 is the surface. Its far end is free, fixed to the ground, or driven at a known speed.
//! The paper's brake is a free rotor of two inertias and a fixed stator of one. A mass on a belt is a stator of one
//! inertia and a rotor without inertia, whose surface is the driven end.
//!
//! | module | what it is |
//! |---|---|
//! | `system` | what defines the problem |
//! | `equations` | the equations in twist coordinates, generic over the number |
//! | `chain_coordinates` | the coordinates in which the Jacobian of a long chain is a band |
//! | `contact` | the effective radius |
//! | `breakaway`, `bounds` | when a stick breaks away |
//! | `margin` | when steady sliding loses its stability |
//! | `stability` | the same, forecast for sliding that slows down by itself |
//! | `slow_manifold`, `slow_motion` | sliding, and stick and separation, without the fast oscillations |
//! | `chains`, `closed_form`, `linear_flow` | stick and separation in closed form |
//! | `axial`, `oscillator` | the axial motion in closed form |
//! | `parameters`, `lowering` | two alike disks in a few numbers, and as a system |
//! | `absolute_angles` | two disks in absolute angles, as the paper has them |
//! | `exact` | friction laws in exact rationals |
//!
//! Source of every numbered equation: "Vibrational Interaction of Two Rotors with Friction Coupling",
//! Advances in Acoustics and Vibration, 2016, article 9275147 ("the paper").

pub mod absolute_angles;
pub mod axial;
pub mod bounds;
pub mod breakaway;
pub mod chain_coordinates;
mod chains;
pub mod closed_form;
pub mod contact;
pub mod equations;
pub mod exact;
mod linear_flow;
pub mod lowering;
pub mod margin;
pub mod oscillator;
pub mod parameters;
pub mod slow_manifold;
pub mod slow_motion;
pub mod stability;
pub mod system;

use std::sync::OnceLock;

pub use exact::{ExactLaw, nearest_double};
pub use parameters::{Axial, BreakawayTest, Contact, DiskInitial, DiskKick, KickTime, Mode, Parameters, Torsion};

/// A value for each linear mode, stick and separation, made on first use.
#[derive(Debug)]
pub struct OfLinearModes<T> {
    stick: OnceLock<Option<T>>,
    separated: OnceLock<Option<T>>,
}

impl<T> OfLinearModes<T> {
    /// The value of a mode, made by `make`; `None` for other modes.
    fn get(&self, mode: Mode, make: impl FnOnce() -> Option<T>) -> Option<&T> {
        let found = match mode {
            Mode::Stick => &self.stick,
            Mode::Separated => &self.separated,
            Mode::SlipForward | Mode::SlipBackward | Mode::Engaged => return None,
        };
        found.get_or_init(make).as_ref()
    }
}

impl<T> Default for OfLinearModes<T> {
    fn default() -> Self {
        OfLinearModes {
            stick: OnceLock::new(),
            separated: OnceLock::new(),
        }
    }
}
