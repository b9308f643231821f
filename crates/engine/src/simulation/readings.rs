//! Recorded channels, for any coordinates of the state.

use crate::hybrid::SystemLocation;
use stickslip_system::model::Mode;
use stickslip_system::model::absolute_angles::{
    AbsoluteModel, AbsoluteState, DAMPING_LOSS, DIMENSION, FRICTION_LOSS, PHI1, PHI1_DOT, PHI2, PHI2_DOT, THETA,
    THETA_DOT, WORK, Z, Z_DOT,
};
use stickslip_system::record::{Channels, State};

pub(super) trait Readings {
    /// State at `t` (s), with its forces, torques and energies. The work of kicks and the residual are missing,
    /// because they depend on earlier events.
    fn read(&self, t: f64, place: &SystemLocation, y: &[f64]) -> (State, Channels);

    fn kinetic_energy(&self, t: f64, place: &SystemLocation, y: &[f64]) -> f64;

    /// T_f / r, N.
    fn internal_force(&self, t: f64, place: &SystemLocation, y: &[f64]) -> f64;

    /// Appends the values beyond [`State`], of the same number at every time.
    fn further(&self, _t: f64, _place: &SystemLocation, _y: &[f64], _out: &mut Vec<f64>) {}
}

pub(super) struct AbsoluteReadings<'a> {
    pub(super) model: &'a AbsoluteModel,
    pub(super) further: bool,
}

fn absolute(y: &[f64]) -> AbsoluteState {
    let mut state = [0.0; DIMENSION];
    state.copy_from_slice(y);
    state
}

impl Readings for AbsoluteReadings<'_> {
    fn read(&self, t: f64, place: &SystemLocation, y: &[f64]) -> (State, Channels) {
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
        let mode = place.mode;
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
        (state, channels.with_products(&state))
    }

    fn kinetic_energy(&self, _t: f64, _place: &SystemLocation, y: &[f64]) -> f64 {
        self.model.kinetic_energy(&absolute(y))
    }

    fn internal_force(&self, _t: f64, _place: &SystemLocation, y: &[f64]) -> f64 {
        self.model.internal_force(&absolute(y))
    }

    fn further(&self, _t: f64, _place: &SystemLocation, y: &[f64], out: &mut Vec<f64>) {
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
