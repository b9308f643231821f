//! The physics: pure functions of parameters and state, no solver, no I/O.
//!
//! Source of every numbered equation: "Vibrational Interaction of Two Rotors with Friction Coupling",
//! Advances in Acoustics and Vibration, 2016, article 9275147 ("the paper").

pub mod absolute_angles;
pub mod axial;
pub mod bounds;
pub mod breakaway;
pub mod contact;
pub mod exact;
pub mod linear_flow;
pub mod lowering;
pub mod oscillator;
pub mod parameters;
pub mod trains;

pub use exact::{ExactLaw, nearest_double};
pub use parameters::{Axial, BreakawayTest, Contact, Initial, Kick, KickTime, Mode, Parameters, Torsion};
