//! The channels that are recorded, whatever the coordinates of the state.

use crate::model::Mode;
use crate::model::absolute_angles::{
    AbsoluteModel, AbsoluteState, DAMPING_LOSS, DIMENSION, FRICTION_LOSS, PHI1, PHI1_DOT, PHI2, PHI2_DOT, THETA,
    THETA_DOT, WORK, Z, Z_DOT,
};
use crate::record::{Channels, State};

/// Where a run is, as far as what is recorded depends on it.
pub(super) trait Place: Copy {
    /// What the contact does.
    fn mode(&self) -> Mode;

    /// Whether steps resolve the fast mode.
    fn resolved(&self) -> bool;

    /// The same with another mode of slip.
    fn in_mode(self, mode: Mode) -> Self;
}

/// Of the paper's procedure, whose steps always resolve the fast mode.
impl Place for Mode {
    fn mode(&self) -> Mode {
        *self
    }

    fn resolved(&self) -> bool {
        true
    }

    fn in_mode(self, mode: Mode) -> Mode {
        mode
    }
}

/// The mechanical meaning of a run's state vector.
pub(super) trait Readings {
    /// Where the run is.
    type Place: Place;

    /// All of the state at `t`; and forces, torques and energies, of which the work of kicks and the residual, which need the
    /// history, are left 0.
    fn read(&self, t: f64, place: &Self::Place, y: &[f64]) -> (State, Channels);

    /// What a kick changes, J.
    fn kinetic_energy(&self, t: f64, place: &Self::Place, y: &[f64]) -> f64;

    /// T_f / r, N.
    fn internal_force(&self, t: f64, place: &Self::Place, y: &[f64]) -> f64;

    /// Appends what the state has beyond [`State`]; as much at every time.
    fn further(&self, _t: f64, _place: &Self::Place, _y: &[f64], _out: &mut Vec<f64>) {}
}

/// Of the absolute angles.
pub(super) struct AbsoluteReadings<'a> {
    pub(super) model: &'a AbsoluteModel,
    /// Whether the quantities that a file of a general system has more are recorded.
    pub(super) further: bool,
}

fn absolute(y: &[f64]) -> AbsoluteState {
    let mut state = [0.0; DIMENSION];
    state.copy_from_slice(y);
    state
}

impl Readings for AbsoluteReadings<'_> {
    type Place = Mode;

    fn read(&self, t: f64, place: &Mode, y: &[f64]) -> (State, Channels) {
        let state = State {
            z: y[Z],
            z_dot: y[Z_DOT],
            theta: y[THETA],
            theta_dot: y[THETA_DOT],
            phi1: y[PHI1],
            phi1_dot: y[PHI1_DOT],
            phi2: y[PHI2],
            phi2_dot: y[PHI2_DOT],
            rotor_twist: y[THETA] - y[PHI2],
            rotor_twist_rate: y[THETA_DOT] - y[PHI2_DOT],
            relative_velocity: y[PHI2_DOT] - y[PHI1_DOT],
            slip_displacement: y[PHI2] - y[PHI1],
        };
        let mode = *place;
        let y = absolute(y);
        let normal_force = if mode == Mode::Separated {
            0.0
        } else {
            self.model.pressing_force(&y).max(0.0)
        };
        let channels = Channels {
            applied_force: self.model.force.value(t),
            normal_force,
            friction_torque: self.model.friction_torque(mode, &y, normal_force),
            transmitted_torque: self.model.transmitted_torque(&y),
            energy_kinetic: self.model.kinetic_energy(&y),
            energy_elastic: self.model.elastic_energy(&y),
            work_applied: y[WORK],
            dissipated_friction: y[FRICTION_LOSS],
            dissipated_damping: y[DAMPING_LOSS],
            ..Channels::default()
        };
        (state, channels)
    }

    fn kinetic_energy(&self, _t: f64, _place: &Mode, y: &[f64]) -> f64 {
        self.model.kinetic_energy(&absolute(y))
    }

    fn internal_force(&self, _t: f64, _place: &Mode, y: &[f64]) -> f64 {
        self.model.internal_force(&absolute(y))
    }

    fn further(&self, _t: f64, _place: &Mode, y: &[f64], out: &mut Vec<f64>) {
        if self.further {
            out.extend([
                y[THETA] - y[PHI2],
                y[THETA_DOT] - y[PHI2_DOT],
                y[PHI2_DOT],
                y[THETA_DOT],
            ]);
            out.extend([y[PHI1], y[PHI1_DOT], y[PHI1_DOT]]);
        }
    }
}
