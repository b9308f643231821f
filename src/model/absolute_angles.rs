//! The brake in absolute angles, with the contact's state of equation (9): the model that the paper's own procedure steps.
//!
//! This is how the equations are printed, and what an ordinary program makes of them: the torques are differences of
//! angles that reach hundreds of radians, and the friction changes its sign inside the right-hand side. The reference
//! runs are not computed with it; [`super::torsion`] says why.

use super::state::{Components, TorsionState};
use super::torsion::TorsionModel;
use super::{Axial, Mode, Parameters};
use crate::friction::Law;
use crate::signal::Pieces;

/// Number of components of the state.
pub const DIMENSION: usize = 11;

/// Number of leading components that are unknowns; the others are quadratures, on which nothing depends.
pub(crate) const UNKNOWNS: usize = 8;

/// theta, rad.
pub(crate) const THETA: usize = 0;
/// theta', rad/s.
pub const THETA_DOT: usize = 1;
/// phi_1, rad.
pub(crate) const PHI1: usize = 2;
/// phi_1', rad/s.
pub(crate) const PHI1_DOT: usize = 3;
/// phi_2, rad.
pub(crate) const PHI2: usize = 4;
/// phi_2', rad/s.
pub(crate) const PHI2_DOT: usize = 5;
/// z, m.
pub const Z: usize = 6;
/// z', m/s.
pub const Z_DOT: usize = 7;
/// Energy dissipated by friction, J.
pub(crate) const FRICTION_LOSS: usize = 8;
/// Energy dissipated by c_t of both disks and by c_a, J.
pub(crate) const DAMPING_LOSS: usize = 9;
/// Work of F, J.
pub(crate) const WORK: usize = 10;

/// The state: the constants of this module name its components.
pub(crate) type AbsoluteState = [f64; DIMENSION];

/// The equations, shared by all steps.
#[derive(Debug)]
pub(crate) struct AbsoluteModel {
    /// Parameters of the torsional system and its friction.
    pub torsion: TorsionModel,
    axial: Axial,
    /// F(t), N.
    pub force: Pieces,
}

impl AbsoluteModel {
    /// For these parameters.
    pub fn new(parameters: &Parameters) -> Self {
        AbsoluteModel {
            torsion: TorsionModel::new(parameters),
            axial: parameters.axial,
            force: parameters.actuation.pieces(),
        }
    }

    /// The state at t = 0: at rest but for the rotor and its surface, which turn at `speed` (rad/s).
    pub fn start(speed: f64) -> AbsoluteState {
        let mut state = [0.0; DIMENSION];
        state[THETA_DOT] = speed;
        state[PHI2_DOT] = speed;
        state
    }

    /// -c_a z' - k_e z, N: the contact force (5) where positive.
    pub fn pressing_force(&self, y: &AbsoluteState) -> f64 {
        -self.axial.damping * y[Z_DOT] - self.axial.stiffness * y[Z]
    }

    /// omega_r = phi_2' - phi_1', rad/s.
    pub fn relative_velocity(&self, y: &AbsoluteState) -> f64 {
        y[PHI2_DOT] - y[PHI1_DOT]
    }

    /// The twist state (see [`super::torsion`]) of an absolute one: its differences are taken here, with what is left of
    /// their digits.
    pub fn twists(&self, y: &AbsoluteState) -> TorsionState {
        Components {
            rotor_twist: y[THETA] - y[PHI2],
            rotor_twist_rate: y[THETA_DOT] - y[PHI2_DOT],
            stator_twist: y[PHI1],
            stator_twist_rate: y[PHI1_DOT],
            rotor_speed: y[THETA_DOT],
            slip: y[PHI2] - y[PHI1],
            ..Components::default()
        }
        .state()
    }

    /// The state of the contact by (5) and (9): stick where |omega_r| < `epsilon` (rad/s) and the tested torque is within
    /// mu_0 r F_n. `separated` says that the disks were apart: they touch only with a positive force.
    pub fn contact(&self, y: &AbsoluteState, separated: bool, epsilon: f64) -> Mode {
        let force = self.pressing_force(y);
        if force < 0.0 || (separated && force == 0.0) {
            return Mode::Separated;
        }
        let w = self.relative_velocity(y);
        let torque = self.torsion.tested_torque(&self.twists(y));
        if w.abs() >= epsilon {
            Mode::sliding(w)
        } else if torque.abs() <= self.torsion.breakaway_torque(force) {
            Mode::Stick
        } else {
            Mode::sliding(torque)
        }
    }

    /// dy/dt with the contact in this mode for a step: (1), (2), (5) and (3), (4) or neither. The sense of friction is that of
    /// omega_r at each evaluation; that of the mode is taken where omega_r is exactly zero.
    pub fn rhs(&self, mode: Mode, t: f64, y: &AbsoluteState, dydt: &mut AbsoluteState) {
        let (torsion, twists) = (&self.torsion.torsion, self.twists(y));
        let w = self.relative_velocity(y);
        let interface = if mode.sense() == 0 {
            0.0
        } else {
            let normal_force = self.pressing_force(y).max(0.0);
            let sense = if w == 0.0 { f64::from(mode.sense()) } else { w.signum() };
            let mu = self.torsion.friction.law.coefficient(w.abs());
            sense * mu * self.torsion.contact.radius * normal_force
        };
        let torques = (torsion.rotor_torque(&twists), torsion.stator_torque(&twists));
        let (phi2_ddot, phi1_ddot) = torsion.surface_accelerations(mode == Mode::Stick, torques, interface);
        let Axial {
            mass,
            stiffness,
            damping,
            ..
        } = self.axial;
        let force = self.force.value(t);
        dydt[THETA] = y[THETA_DOT];
        dydt[THETA_DOT] = -torques.0 / torsion.rotor_inertia;
        dydt[PHI1] = y[PHI1_DOT];
        dydt[PHI1_DOT] = phi1_ddot;
        dydt[PHI2] = y[PHI2_DOT];
        dydt[PHI2_DOT] = phi2_ddot;
        dydt[Z] = y[Z_DOT];
        dydt[Z_DOT] = (-force - damping * y[Z_DOT] - stiffness * y[Z]) / mass;
        dydt[FRICTION_LOSS] = interface * w;
        dydt[DAMPING_LOSS] = torsion.damping_power(&twists) + damping * y[Z_DOT] * y[Z_DOT];
        dydt[WORK] = -force * y[Z_DOT];
    }

    /// Both surfaces at their mean speed, as (4) has them.
    pub fn joined(&self, y: &AbsoluteState) -> AbsoluteState {
        let mean = 0.5 * (y[PHI1_DOT] + y[PHI2_DOT]);
        let mut joined = *y;
        joined[PHI1_DOT] = mean;
        joined[PHI2_DOT] = mean;
        joined
    }

    /// After a kick that adds `delta` (rad/s) to omega_r, half to each surface; absorbed in stick.
    pub fn kicked(&self, mode: Mode, y: &AbsoluteState, delta: f64) -> AbsoluteState {
        let mut kicked = *y;
        if mode != Mode::Stick {
            kicked[PHI1_DOT] -= 0.5 * delta;
            kicked[PHI2_DOT] += 0.5 * delta;
        }
        kicked
    }

    /// Kinetic energy of the disks and of the axial motion, J.
    pub fn kinetic_energy(&self, y: &AbsoluteState) -> f64 {
        let torsion = &self.torsion.torsion;
        let surfaces = torsion.surface_inertia * (y[PHI1_DOT] * y[PHI1_DOT] + y[PHI2_DOT] * y[PHI2_DOT]);
        0.5 * (torsion.rotor_inertia * y[THETA_DOT] * y[THETA_DOT] + surfaces + self.axial.mass * y[Z_DOT] * y[Z_DOT])
    }

    /// Elastic energy of both twists and of the axial motion, J.
    pub fn elastic_energy(&self, y: &AbsoluteState) -> f64 {
        self.torsion.torsion.elastic_energy(&self.twists(y)) + 0.5 * self.axial.stiffness * y[Z] * y[Z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource};
    use crate::model::state::index::{ROTOR_SPEED, ROTOR_TWIST_RATE, STATOR_TWIST_RATE};

    /// Far from any switch both sets of equations are one: the accelerations of the twist coordinates are the differences
    /// of those of the angles, here at small angles, where no digits are lost.
    #[test]
    fn property_same_accelerations_as_in_twist_coordinates() {
        let source = CaseSource::built_in("paper").unwrap();
        let parameters = Case::parse(&source, &[]).unwrap().parameters;
        let model = AbsoluteModel::new(&parameters);
        let mut y = [0.0; DIMENSION];
        for (component, value) in [
            (THETA, 3e-5),
            (THETA_DOT, 7.0),
            (PHI1, 4e-6),
            (PHI1_DOT, 0.1),
            (PHI2, 2e-5),
            (PHI2_DOT, 6.5),
            (Z, -4e-5),
            (Z_DOT, 1e-4),
        ] {
            y[component] = value;
        }
        let twists = model.twists(&y);
        let mut rates = [0.0; DIMENSION];
        for (mode, backward) in [
            (Mode::SlipForward, false),
            (Mode::SlipForward, true),
            (Mode::Stick, false),
            (Mode::Separated, false),
        ] {
            let (mut y, mut twists) = (y, twists);
            if backward {
                y[PHI1_DOT] = 7.0;
                twists = model.twists(&y);
            }
            model.rhs(mode, 2.0, &y, &mut rates);
            let mode = if backward { Mode::SlipBackward } else { mode };
            let expected = model.torsion.rates_at(mode, || model.pressing_force(&y), &twists);
            let found = model.twists(&rates);
            for k in [ROTOR_TWIST_RATE, STATOR_TWIST_RATE, ROTOR_SPEED] {
                assert!(
                    (found[k] - expected[k]).abs() < 1e-12 * expected[k].abs().max(1.0),
                    "{mode:?}: component {k}: {} and {}",
                    found[k],
                    expected[k]
                );
            }
        }
    }

    #[test]
    fn analytic_the_state_of_the_contact_is_that_of_equation_9() {
        let source = CaseSource::built_in("paper").unwrap();
        let parameters = Case::parse(&source, &[]).unwrap().parameters;
        let model = AbsoluteModel::new(&parameters);
        let mut y = [0.0; DIMENSION];
        y[Z] = -4e-5;
        let limit = model.torsion.breakaway_torque(model.pressing_force(&y));
        let twist = |share: f64| share * limit / parameters.torsion.stiffness;
        let at = |w: f64, share: f64| {
            let mut y = y;
            y[PHI2_DOT] = w;
            // T_f is the mean of both torques.
            y[THETA] = twist(share);
            y[PHI1] = twist(share);
            model.contact(&y, false, 1e-5)
        };
        assert_eq!(at(0.9e-5, 0.0), Mode::Stick);
        assert_eq!(at(1.1e-5, 0.0), Mode::SlipForward);
        assert_eq!(at(-1.1e-5, 0.0), Mode::SlipBackward);
        assert_eq!(at(0.0, 0.999), Mode::Stick);
        assert_eq!(at(0.0, 1.001), Mode::SlipForward);
        assert_eq!(at(0.0, -1.001), Mode::SlipBackward);
        y[Z] = 1e-9;
        assert_eq!(model.contact(&y, false, 1e-5), Mode::Separated);
        y[Z] = 0.0;
        assert_eq!(model.contact(&y, true, 1e-5), Mode::Separated);
        assert_eq!(model.contact(&y, false, 1e-5), Mode::Stick);
    }
}
