//! Two alike disks in absolute angles, with the contact's state of equation (9): the model that the paper's own procedure steps.
//!
//! This is how the equations are printed, and what an ordinary program makes of them: the torques are differences of
//! angles that reach hundreds of radians, and the friction changes its sign inside the right-hand side. The reference
//! runs are not computed with it; [`super::equations`] says why.

use super::system::{ContactLaw, End, KickSide, Pressing, System, Train};
use super::{Axial, BreakawayTest, Mode};
use crate::friction::{FrictionLaw, Law};
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

/// The paper's two disks: a free rotor on a shaft that ends in its surface, and a surface on an equal shaft that ends in the ground.
#[derive(Debug)]
pub(crate) struct AbsoluteModel {
    /// I, kg m^2.
    rotor_inertia: f64,
    /// J, kg m^2, of each surface.
    surface_inertia: f64,
    /// k_t, N m/rad, of each shaft.
    stiffness: f64,
    /// c_t, N m s/rad, of each shaft.
    damping: f64,
    /// r, m.
    radius: f64,
    breakaway: f64,
    breakaway_test: BreakawayTest,
    /// mu(x).
    pub law: FrictionLaw,
    axial: Axial,
    /// F(t), N.
    pub force: Pieces,
    /// Of the rotor and its surface at t = 0, rad/s.
    speed: f64,
}

impl AbsoluteModel {
    /// Of a system, if it is two disks with nothing but the axial motion and kicks to both surfaces acting on them, which begin without
    /// twist.
    pub fn new(system: &System) -> Option<Self> {
        let (rotor, stator, initial) = (&system.rotor, &system.stator, &system.initial);
        let Pressing::Axial { axial, actuation } = &system.pressing else {
            return None;
        };
        let ([surface_inertia, rotor_inertia], [of_stator]) = (&rotor.inertia[..], &stator.inertia[..]) else {
            return None;
        };
        let ([stiffness], [damping]) = (&rotor.stiffness[..], &rotor.damping[..]) else {
            return None;
        };
        let undriven = |train: &Train| train.torque.is_none() && train.viscous.iter().all(|&viscous| viscous == 0.0);
        let rest = |values: &[f64]| values.iter().all(|&value| value == 0.0);
        let &speed = initial.rotor_speed.first()?;
        let is_two_disks = matches!((&rotor.end, &stator.end), (End::Free, End::Fixed))
            && of_stator == surface_inertia
            && (&rotor.stiffness, &rotor.damping) == (&stator.stiffness, &stator.damping)
            && undriven(rotor)
            && undriven(stator)
            && system.contact == ContactLaw::StickSlip
            && system.kicks.iter().all(|kick| kick.on == KickSide::Both)
            && initial.rotor_speed.iter().all(|&other| other == speed)
            && [&initial.rotor_twist, &initial.stator_twist, &initial.stator_speed].map(|values| rest(values))
                == [true; 3];
        is_two_disks.then(|| AbsoluteModel {
            rotor_inertia: *rotor_inertia,
            surface_inertia: *surface_inertia,
            stiffness: *stiffness,
            damping: *damping,
            radius: system.radius,
            breakaway: system.breakaway,
            breakaway_test: system.breakaway_test,
            law: system.law.clone(),
            axial: *axial,
            force: actuation.pieces(),
            speed,
        })
    }

    /// T_n = 2 pi sqrt(J/k_t), s.
    pub fn natural_period(&self) -> f64 {
        std::f64::consts::TAU / (self.stiffness / self.surface_inertia).sqrt()
    }

    /// The state at t = 0: at rest but for the rotor and its surface.
    pub fn start(&self) -> AbsoluteState {
        let mut state = [0.0; DIMENSION];
        state[THETA_DOT] = self.speed;
        state[PHI2_DOT] = self.speed;
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

    /// (T_r, T_s), equation (2), N m: differences of angles are taken here, with what is left of their digits.
    fn torques(&self, y: &AbsoluteState) -> (f64, f64) {
        let (rate, twist) = (y[THETA_DOT] - y[PHI2_DOT], y[THETA] - y[PHI2]);
        (
            self.damping * rate + self.stiffness * twist,
            self.damping * y[PHI1_DOT] + self.stiffness * y[PHI1],
        )
    }

    /// T_f = (T_r + T_s)/2, N m.
    pub fn transmitted_torque(&self, y: &AbsoluteState) -> f64 {
        let (rotor, stator) = self.torques(y);
        (rotor + stator) / 2.0
    }

    /// T_f / r, N.
    pub fn internal_force(&self, y: &AbsoluteState) -> f64 {
        self.transmitted_torque(y) / self.radius
    }

    /// The torque of the interface in a mode under F_n (N), N m.
    pub fn friction_torque(&self, mode: Mode, y: &AbsoluteState, normal_force: f64) -> f64 {
        match mode {
            Mode::Separated | Mode::Engaged => 0.0,
            Mode::Stick => self.transmitted_torque(y),
            Mode::SlipForward | Mode::SlipBackward => {
                let (sense, twist_rate) = (f64::from(mode.sense()), y[THETA_DOT] - y[PHI2_DOT]);
                let mu = self.law.coefficient(sense * (y[THETA_DOT] - twist_rate - y[PHI1_DOT]));
                sense * mu * self.radius * normal_force
            }
        }
    }

    /// c_t + 2 r F_n mu'(|omega_r|), N m s/rad, in slip with sense `s`.
    pub fn stability_margin(&self, sense: f64, relative_velocity: f64, normal_force: f64) -> f64 {
        let (_, slope) = self.law.coefficient_and_slope(sense * relative_velocity);
        self.damping + 2.0 * self.radius * normal_force * slope
    }

    /// mu_0 r F_n, N m.
    fn breakaway_torque(&self, normal_force: f64) -> f64 {
        self.breakaway * self.radius * normal_force
    }

    /// The state of the contact by (5) and (9): stick where |omega_r| < `epsilon` (rad/s) and the tested torque is within
    /// mu_0 r F_n. `separated` says that the disks were apart: they touch only with a positive force.
    pub fn contact(&self, y: &AbsoluteState, separated: bool, epsilon: f64) -> Mode {
        let force = self.pressing_force(y);
        if force < 0.0 || (separated && force == 0.0) {
            return Mode::Separated;
        }
        let w = self.relative_velocity(y);
        let torque = match self.breakaway_test {
            BreakawayTest::Transmitted => self.transmitted_torque(y),
            BreakawayTest::Stator => self.torques(y).1,
            BreakawayTest::Rotor => self.torques(y).0,
        };
        if w.abs() >= epsilon {
            Mode::sliding(w)
        } else if torque.abs() <= self.breakaway_torque(force) {
            Mode::Stick
        } else {
            Mode::sliding(torque)
        }
    }

    /// dy/dt with the contact in this mode for a step: (1), (2), (5) and (3), (4) or neither. The sense of friction is that of
    /// omega_r at each evaluation; that of the mode is taken where omega_r is exactly zero.
    pub fn rhs(&self, mode: Mode, t: f64, y: &AbsoluteState, dydt: &mut AbsoluteState) {
        let w = self.relative_velocity(y);
        let interface = if mode.sense() == 0 {
            0.0
        } else {
            let normal_force = self.pressing_force(y).max(0.0);
            let sense = if w == 0.0 { f64::from(mode.sense()) } else { w.signum() };
            let mu = self.law.coefficient(w.abs());
            sense * mu * self.radius * normal_force
        };
        let ((t_r, t_s), j) = (self.torques(y), self.surface_inertia);
        let (phi2_ddot, phi1_ddot) = if mode == Mode::Stick {
            let both = (t_r - t_s) / (2.0 * j);
            (both, both)
        } else {
            ((t_r - interface) / j, (interface - t_s) / j)
        };
        let Axial {
            mass,
            stiffness,
            damping,
            ..
        } = self.axial;
        let (force, twist_rate) = (self.force.value(t), y[THETA_DOT] - y[PHI2_DOT]);
        dydt[THETA] = y[THETA_DOT];
        dydt[THETA_DOT] = -t_r / self.rotor_inertia;
        dydt[PHI1] = y[PHI1_DOT];
        dydt[PHI1_DOT] = phi1_ddot;
        dydt[PHI2] = y[PHI2_DOT];
        dydt[PHI2_DOT] = phi2_ddot;
        dydt[Z] = y[Z_DOT];
        dydt[Z_DOT] = (-force - damping * y[Z_DOT] - stiffness * y[Z]) / mass;
        dydt[FRICTION_LOSS] = interface * w;
        dydt[DAMPING_LOSS] =
            self.damping * (twist_rate * twist_rate + y[PHI1_DOT] * y[PHI1_DOT]) + damping * y[Z_DOT] * y[Z_DOT];
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
        let surfaces = self.surface_inertia * (y[PHI1_DOT] * y[PHI1_DOT] + y[PHI2_DOT] * y[PHI2_DOT]);
        0.5 * (self.rotor_inertia * y[THETA_DOT] * y[THETA_DOT] + surfaces + self.axial.mass * y[Z_DOT] * y[Z_DOT])
    }

    /// Elastic energy of both twists and of the axial motion, J.
    pub fn elastic_energy(&self, y: &AbsoluteState) -> f64 {
        let twist = y[THETA] - y[PHI2];
        0.5 * self.stiffness * (twist * twist + y[PHI1] * y[PHI1]) + 0.5 * self.axial.stiffness * y[Z] * y[Z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource};
    use crate::model::equations::{Outside, SystemEquations};

    /// Far from any switch both sets of equations are one: the accelerations of the twist coordinates are the differences
    /// of those of the angles, here at small angles, where no digits are lost.
    #[test]
    fn property_same_accelerations_as_in_twist_coordinates() {
        let source = CaseSource::built_in("paper").unwrap();
        let system = Case::read(&source, &[]).unwrap().system;
        let model = AbsoluteModel::new(&system).unwrap();
        let system = SystemEquations::new(&system);
        let speed = system.rotor.speed.unwrap();
        let (rotor, stator) = (system.rotor.twists, system.stator.twists);
        let twists = |y: &AbsoluteState| {
            let mut twists = vec![0.0; system.dimension];
            twists[rotor] = y[THETA] - y[PHI2];
            twists[rotor + 1] = y[THETA_DOT] - y[PHI2_DOT];
            twists[stator] = y[PHI1];
            twists[stator + 1] = y[PHI1_DOT];
            twists[speed] = y[THETA_DOT];
            twists
        };
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
        let mut rates = [0.0; DIMENSION];
        for (mode, backward) in [
            (Mode::SlipForward, false),
            (Mode::SlipForward, true),
            (Mode::Stick, false),
            (Mode::Separated, false),
        ] {
            let mut y = y;
            if backward {
                y[PHI1_DOT] = 7.0;
            }
            model.rhs(mode, 2.0, &y, &mut rates);
            let mode = if backward { Mode::SlipBackward } else { mode };
            let outside = Outside {
                normal_force: model.pressing_force(&y),
                ..Outside::default()
            };
            let (mut expected, found) = (vec![0.0; system.dimension], twists(&rates));
            system.rates(mode, f64::from(mode.sense()), 0, &outside, &twists(&y), &mut expected);
            for k in [rotor + 1, stator + 1, speed] {
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
        let system = Case::read(&source, &[]).unwrap().system;
        let model = AbsoluteModel::new(&system).unwrap();
        let mut y = [0.0; DIMENSION];
        y[Z] = -4e-5;
        let limit = model.breakaway_torque(model.pressing_force(&y));
        let twist = |share: f64| share * limit / model.stiffness;
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
