//! The equations: pure functions of parameters and state, without solver and I/O.
//!
//! A system is two chains that touch at one contact. A chain is a train of inertias and shafts, numbered from the
//! contact outwards; inertia 0 is the surface. Its far end is free, fixed to the ground, or driven at a known speed.
//! The paper's brake is a free rotor with two inertias and a fixed stator with one. A mass on a belt is a stator with
//! one inertia, and a rotor without inertia whose surface is the driven end.
//!
//! | module | contents |
//! |---|---|
//! | `system` | the definition of the problem, in doubles or exact numbers |
//! | `equations` | the equations in twist coordinates, generic in the number type |
//! | `chain_coordinates` | coordinates in which the Jacobian of a long chain is a band matrix |
//! | `contact` | the effective radius |
//! | `breakaway` | breakaway from stick |
//! | `margin` | loss of stability of steady sliding |
//! | `stability` | forecast of this loss for sliding that slows down by itself |
//! | `slow_manifold`, `slow_motion` | slip, and stick and separation, without the fast oscillations |
//! | `chains`, `closed_form` | stick and separation in closed form |
//! | `axial`, `oscillator` | the axial motion in closed form |
//! | `parameters` | two equal disks in a few parameters, and their conversion to a system |
//! | `absolute_angles` | two disks in absolute angles, as in the paper |
//!
//! All numbered equations are those of "Vibrational Interaction of Two Rotors with Friction Coupling", Advances in
//! Acoustics and Vibration, 2016, article 9275147 ("the paper").

pub mod absolute_angles;
pub mod axial;
pub mod breakaway;
pub mod chain_coordinates;
mod chains;
pub mod closed_form;
pub mod contact;
pub mod equations;
pub mod margin;
pub mod oscillator;
pub mod parameters;
pub mod slow_manifold;
pub mod slow_motion;
pub mod stability;
pub mod system;

use std::sync::OnceLock;

pub use parameters::{Axial, BreakawayTest, Contact, DiskInitial, DiskKick, KickTime, Mode, Parameters, Torsion};
pub use system::{ExactLaw, nearest_double};

/// A value for each linear mode (stick and separation), made on first use.
#[derive(Debug)]
pub struct OfLinearModes<T> {
    stick: OnceLock<Option<T>>,
    separated: OnceLock<Option<T>>,
}

impl<T> OfLinearModes<T> {
    /// The value for `mode`, made by `make` if necessary; `None` for other modes.
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
