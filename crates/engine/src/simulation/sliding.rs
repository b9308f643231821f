//! Initial states of a motion, and sliding at a state without events.

use super::carried::deviation_weights;
use super::portrait::{position, state_of};
use crate::hybrid::dynamics::{SystemDynamics, SystemLocation};
use nalgebra::{DMatrix, DVector};
use stickslip_system::model::Mode;
use stickslip_system::model::equations::SystemEquations;
use stickslip_system::model::system::System;

/// Mechanical state of a system from a recorder's further values.
pub fn moving_state(system: &System, further: &[f64]) -> DVector<f64> {
    let dynamics = SystemDynamics::new(system, 0.0);
    let y = state_of(&dynamics, further);
    DVector::from_column_slice(&y[..dynamics.system.mechanical()])
}

/// Initial mechanical state of a system.
pub fn stated_start(system: &System) -> DVector<f64> {
    let dynamics = SystemDynamics::new(system, 0.0);
    let y = super::simulate::start(system, &dynamics);
    DVector::from_column_slice(&y[..dynamics.system.mechanical()])
}

/// Mechanical state with these twists of the shafts (rad), rotor first, for trains that move rigidly at these speeds
/// (rad/s).
pub fn state_of_parts(system: &System, (rotor, stator): (&[f64], &[f64]), speeds: (f64, f64)) -> DVector<f64> {
    let equations = SystemEquations::new(system);
    let mut y = vec![0.0; equations.mechanical()];
    for (side, twists, speed) in [
        (&equations.rotor, rotor, speeds.0),
        (&equations.stator, stator, speeds.1),
    ] {
        for (i, twist) in twists.iter().enumerate() {
            y[side.twists + 2 * i] = *twist;
        }
        if let Some(index) = side.speed {
            y[index] = speed;
        }
    }
    DVector::from_vec(y)
}

/// Factors that turn each component of the state into a speed.
pub fn weights(system: &System) -> Vec<f64> {
    deviation_weights(&SystemEquations::new(system))
}

/// Rates of sliding in one sense at a state, without events.
pub struct SlidingSense {
    /// d(state)/dt, 1/s.
    pub rates: DVector<f64>,
    /// Derivatives of the rates by the state, 1/s.
    pub jacobian: DMatrix<f64>,
    /// omega_r, rad/s.
    pub relative_velocity: f64,
    /// Position of a portrait, rad; NaN if the position would be the slip displacement.
    pub position: f64,
}

/// Rates of sliding in one sense at a state of an autonomous system. `threshold` is in rad/s.
pub fn sliding((system, threshold): (&System, f64), sense: i8, state: &DVector<f64>) -> SlidingSense {
    let dynamics = SystemDynamics::new(system, threshold);
    let n = state.len();
    let mut y = vec![0.0; dynamics.system.dimension];
    y[..n].copy_from_slice(state.as_slice());
    let mode = match (dynamics.is_engaged(), sense < 0) {
        (true, _) => Mode::Engaged,
        (false, false) => Mode::SlipForward,
        (false, true) => Mode::SlipBackward,
    };
    let mut location = SystemLocation::new(mode, 0);
    location.sense = sense;
    let outside = dynamics.outside(&location, 0.0);
    let relative_velocity = dynamics.system.relative_velocity(&outside, &y);
    location.piece = dynamics.system.piece_of(relative_velocity);
    let mut rates = vec![0.0; y.len()];
    dynamics.rhs(&location, 0.0, &y, &mut rates);
    let mut jacobian = DMatrix::zeros(y.len(), y.len());
    dynamics.jacobian(&location, 0.0, &y, jacobian.as_view_mut());
    SlidingSense {
        rates: DVector::from_column_slice(&rates[..n]),
        jacobian: jacobian.view((0, 0), (n, n)).into_owned(),
        relative_velocity,
        position: position(&dynamics, &y).map_or(f64::NAN, |position| position.0),
    }
}
