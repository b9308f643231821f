//! The physics of the two-disk brake: pure functions of parameters and state, no solver, no I/O.
//!
//! Source of every numbered equation: "Vibrational Interaction of Two Rotors with Friction
//! Coupling", Advances in Acoustics and Vibration, 2016, article 9275147 ("the paper").

pub mod parameters;

pub use parameters::{
    Actuation, Axial, BreakawayTest, Contact, Friction, Initial, Kick, KickTime, Mode, Parameters, Torsion,
};
