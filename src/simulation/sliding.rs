//! States that a motion starts from, and sliding at a state without events.

use super::dynamics::{SystemDynamics, SystemLocation};
use super::portrait::{position, state_of};
use super::variation::deviation_weights;
use crate::hybrid::Dynamics as _;
use crate::model::Mode;
use crate::model::equations::SystemEquations;
use crate::model::system::System;
use nalgebra::{DMatrix, DVector};

/// What the motion depends on in a state of which a recorder got these further values.
pub(crate) fn moving_state(system: &System, further: &[f64]) -> DVector<f64> {
    let dynamics = SystemDynamics::new(system, 0.0);
    let y = state_of(&dynamics, further);
    DVector::from_column_slice(&y[..dynamics.system.mechanical()])
}

/// The state at t = 0 that a system states.
pub(crate) fn stated_start(system: &System) -> DVector<f64> {
    let dynamics = SystemDynamics::new(system, 0.0);
    let y = super::simulate::start(system, &dynamics);
    DVector::from_column_slice(&y[..dynamics.system.mechanical()])
}

/// What the motion depends on where the shafts have these twists, rotor first, and nothing but two rigid trains turns, at these speeds.
pub(crate) fn state_of_parts(system: &System, (rotor, stator): (&[f64], &[f64]), speeds: (f64, f64)) -> DVector<f64> {
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

/// What each component of the state is multiplied by to be a speed.
pub(crate) fn weights(system: &System) -> Vec<f64> {
    deviation_weights(&SystemEquations::new(system))
}

/// Sliding in one sense at a state, without events.
pub(crate) struct Sliding {
    /// d(state)/dt, 1/s.
    pub rates: DVector<f64>,
    /// Its derivatives by the state.
    pub jacobian: DMatrix<f64>,
    /// omega_r, rad/s.
    pub relative_velocity: f64,
    /// As a portrait has it; NaN of a slip displacement.
    pub position: f64,
}

/// Sliding with a sense at a state of a system that nothing drives by the clock.
pub(crate) fn sliding((system, threshold): (&System, f64), sense: i8, state: &DVector<f64>) -> Sliding {
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
    Sliding {
        rates: DVector::from_column_slice(&rates[..n]),
        jacobian: jacobian.view((0, 0), (n, n)).into_owned(),
        relative_velocity,
        position: position(&dynamics, &y).map_or(f64::NAN, |position| position.0),
    }
}
