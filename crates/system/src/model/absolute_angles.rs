//! Two equal disks in absolute angles, with the contact state of equation (9): the model of the paper's procedure.
//!
//! The equations are those of the paper. Torques are differences of angles that reach hundreds of radians, and
//! friction changes its sign inside the right-hand side. Reference runs use [`super::equations`], which explains why.

use super::system::System;
use super::{Axial, BreakawayTest, Contact, Mode, Parameters, Torsion};
use crate::friction::{Backward, FrictionLaw, Law};
use crate::signal::Pieces;

/// Number of components of the state.
pub const DIMENSION: usize = 11;

/// Number of leading components that are unknowns; the others are quadratures.
pub const UNKNOWNS: usize = 8;

/// theta, rad.
pub const THETA: usize = 0;
/// theta', rad/s.
pub const THETA_DOT: usize = 1;
/// phi_1, rad.
pub const PHI1: usize = 2;
/// phi_1', rad/s.
pub const PHI1_DOT: usize = 3;
/// phi_2, rad.
pub const PHI2: usize = 4;
/// phi_2', rad/s.
pub const PHI2_DOT: usize = 5;
/// z, m.
pub const Z: usize = 6;
/// z', m/s.
pub const Z_DOT: usize = 7;
/// Energy dissipated by friction, J.
pub const FRICTION_LOSS: usize = 8;
/// Energy dissipated by c_t of both disks and by c_a, J.
pub const DAMPING_LOSS: usize = 9;
/// Work of F, J.
pub const WORK: usize = 10;

/// The state. The constants of this module are the indices of its components.
pub type AbsoluteState = [f64; DIMENSION];

/// The paper's two disks: a free rotor whose surface is on a shaft, and a surface on an equal shaft to the ground.
#[derive(Debug)]
pub struct AbsoluteModel {
    torsion: Torsion,
    contact: Contact,
    breakaway: f64,
    /// mu(x), see `law_of`.
    pub law: FrictionLaw,
    backward: Option<Backward>,
    axial: Axial,
    /// F(t), N.
    pub force: Pieces,
    /// Initial speed of the rotor and its surface, rad/s.
    speed: f64,
}

impl AbsoluteModel {
    /// Takes the parameters of a system of two equal disks without initial twist. Only the axial motion and kicks on
    /// both surfaces may act on it; `None` for other systems.
    pub fn new(system: &System) -> Option<Self> {
        let disks = Parameters::of(system)?;
        Some(AbsoluteModel {
            torsion: disks.torsion,
            contact: disks.contact,
            breakaway: disks.friction.breakaway,
            backward: disks.friction.law.backward(),
            law: disks.friction.law,
            axial: disks.axial,
            force: disks.actuation.pieces(),
            speed: disks.initial.speed,
        })
    }

    /// T_n = 2 pi sqrt(J/k_t), s.
    pub fn natural_period(&self) -> f64 {
        std::f64::consts::TAU / (self.torsion.stiffness / self.torsion.surface_inertia).sqrt()
    }

    /// The state at t = 0: only the rotor and its surface move.
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

    /// (T_r, T_s), equation (2), N m. They are differences of absolute angles, which lose digits.
    fn torques(&self, y: &AbsoluteState) -> (f64, f64) {
        let (rate, twist) = (y[THETA_DOT] - y[PHI2_DOT], y[THETA] - y[PHI2]);
        (
            self.torsion.damping * rate + self.torsion.stiffness * twist,
            self.torsion.damping * y[PHI1_DOT] + self.torsion.stiffness * y[PHI1],
        )
    }

    /// T_f = (T_r + T_s)/2, N m.
    pub fn transmitted_torque(&self, y: &AbsoluteState) -> f64 {
        let (rotor, stator) = self.torques(y);
        (rotor + stator) / 2.0
    }

    /// T_f / r, N.
    pub fn internal_force(&self, y: &AbsoluteState) -> f64 {
        self.transmitted_torque(y) / self.contact.radius
    }

    fn law_of(&self, sense: f64) -> &FrictionLaw {
        match &self.backward {
            Some(backward) if sense < 0.0 => &backward.law,
            _ => &self.law,
        }
    }

    /// The torque of the interface in a mode under F_n (N), N m.
    pub fn friction_torque(&self, mode: Mode, y: &AbsoluteState, normal_force: f64) -> f64 {
        match mode {
            Mode::Separated | Mode::Engaged => 0.0,
            Mode::Stick => self.transmitted_torque(y),
            Mode::SlipForward | Mode::SlipBackward => {
                let (sense, twist_rate) = (f64::from(mode.sense()), y[THETA_DOT] - y[PHI2_DOT]);
                let x = sense * (y[THETA_DOT] - twist_rate - y[PHI1_DOT]);
                let mu = self.law_of(sense).coefficient(x);
                sense * mu * self.contact.radius * normal_force
            }
        }
    }

    /// c_t + 2 r F_n mu'(|omega_r|), N m s/rad, in slip with sense `s`.
    pub fn stability_margin(&self, sense: f64, relative_velocity: f64, normal_force: f64) -> f64 {
        let (_, slope) = self.law_of(sense).coefficient_and_slope(sense * relative_velocity);
        self.torsion.damping + 2.0 * self.contact.radius * normal_force * slope
    }

    /// Whether the margin is not negative. Without damping it has the sign of the friction law's slope.
    pub fn is_stable(&self, sense: f64, relative_velocity: f64, normal_force: f64) -> bool {
        if self.torsion.damping != 0.0 {
            return self.stability_margin(sense, relative_velocity, normal_force) >= 0.0;
        }
        !self.law.only_falls() && self.stability_margin(sense, relative_velocity, 1.0) >= 0.0
    }

    /// mu_0 r F_n, N m, into sliding in the sense of the sign of `sense`.
    pub fn breakaway_torque(&self, sense: f64, normal_force: f64) -> f64 {
        let breakaway = match &self.backward {
            Some(backward) if sense < 0.0 => backward.breakaway,
            _ => self.breakaway,
        };
        breakaway * self.contact.radius * normal_force
    }

    /// Contact state by (5) and (9): stick if |omega_r| < `epsilon` (rad/s) and the tested torque is within mu_0 r
    /// F_n. If the disks were `separated`, they touch only under a positive force.
    pub fn contact(&self, y: &AbsoluteState, separated: bool, epsilon: f64) -> Mode {
        let force = self.pressing_force(y);
        if force < 0.0 || (separated && force == 0.0) {
            return Mode::Separated;
        }
        let w = self.relative_velocity(y);
        let torque = match self.contact.breakaway_test {
            BreakawayTest::Transmitted => self.transmitted_torque(y),
            BreakawayTest::Stator => self.torques(y).1,
            BreakawayTest::Rotor => self.torques(y).0,
        };
        if w.abs() >= epsilon {
            Mode::sliding(w)
        } else if torque.abs() <= self.breakaway_torque(torque, force) {
            Mode::Stick
        } else {
            Mode::sliding(torque)
        }
    }

    /// dy/dt in a fixed contact mode: (1), (2), (5), and (3), (4) or neither, depending on the mode. Friction has the
    /// sign of omega_r at each evaluation, or the sense of the mode if omega_r is exactly zero.
    pub fn rhs(&self, mode: Mode, t: f64, y: &AbsoluteState, dydt: &mut AbsoluteState) {
        let w = self.relative_velocity(y);
        let interface = if mode.sense() == 0 {
            0.0
        } else {
            let normal_force = self.pressing_force(y).max(0.0);
            let sense = if w == 0.0 { f64::from(mode.sense()) } else { w.signum() };
            let mu = self.law_of(sense).coefficient(w.abs());
            sense * mu * self.contact.radius * normal_force
        };
        let ((t_r, t_s), j) = (self.torques(y), self.torsion.surface_inertia);
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
        dydt[THETA_DOT] = -t_r / self.torsion.rotor_inertia;
        dydt[PHI1] = y[PHI1_DOT];
        dydt[PHI1_DOT] = phi1_ddot;
        dydt[PHI2] = y[PHI2_DOT];
        dydt[PHI2_DOT] = phi2_ddot;
        dydt[Z] = y[Z_DOT];
        dydt[Z_DOT] = (-force - damping * y[Z_DOT] - stiffness * y[Z]) / mass;
        dydt[FRICTION_LOSS] = interface * w;
        dydt[DAMPING_LOSS] = self.torsion.damping * (twist_rate * twist_rate + y[PHI1_DOT] * y[PHI1_DOT])
            + damping * y[Z_DOT] * y[Z_DOT];
        dydt[WORK] = -force * y[Z_DOT];
    }

    /// The state with both surfaces at their mean speed, as in (4).
    pub fn joined(&self, y: &AbsoluteState) -> AbsoluteState {
        let mean = 0.5 * (y[PHI1_DOT] + y[PHI2_DOT]);
        let mut joined = *y;
        joined[PHI1_DOT] = mean;
        joined[PHI2_DOT] = mean;
        joined
    }

    /// The state after a kick that adds `delta` (rad/s) to omega_r, half on each surface. Stick absorbs the kick.
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
        let surfaces = self.torsion.surface_inertia * (y[PHI1_DOT] * y[PHI1_DOT] + y[PHI2_DOT] * y[PHI2_DOT]);
        0.5 * (self.torsion.rotor_inertia * y[THETA_DOT] * y[THETA_DOT]
            + surfaces
            + self.axial.mass * y[Z_DOT] * y[Z_DOT])
    }

    /// Elastic energy of both twists and of the axial motion, J.
    pub fn elastic_energy(&self, y: &AbsoluteState) -> f64 {
        let twist = y[THETA] - y[PHI2];
        0.5 * self.torsion.stiffness * (twist * twist + y[PHI1] * y[PHI1]) + 0.5 * self.axial.stiffness * y[Z] * y[Z]
    }
}
