//! The torsional equations in twist coordinates.
//!
//! The rotor turns through some 350 rad while its twist is a few microradians: absolute angles would leave eight digits
//! of torque. The state holds the twists themselves and the rotor speed. The relative velocity is their difference,
//! omega_r = theta' - u' - v', and no component: as a component it would be rounded at each step to 16 digits of the
//! sliding speed, and that rounding would feed the fast mode. The rounding of the rotor speed only feeds the slow one.

use super::{BreakawayTest, Contact, Mode, Parameters, Torsion};
use crate::friction::{Friction, Law};
use nalgebra::DMatrixViewMut;

/// Number of components of the torsional state.
pub const DIMENSION: usize = 8;

/// Number of its components that the equations depend on, which are the first: the twists, their rates and the rotor speed.
/// Those after them are quadratures.
pub const DYNAMIC: usize = 5;

/// Positions in the torsional state vector.
pub mod index {
    /// u = theta - phi_2, rotor twist, rad.
    pub const ROTOR_TWIST: usize = 0;
    /// u', rad/s.
    pub const ROTOR_TWIST_RATE: usize = 1;
    /// v = phi_1, stator twist, rad.
    pub const STATOR_TWIST: usize = 2;
    /// v' = phi_1', rad/s.
    pub const STATOR_TWIST_RATE: usize = 3;
    /// theta', rad/s.
    pub const ROTOR_SPEED: usize = 4;
    /// phi_2 - phi_1, rad. A quadrature: nothing depends on it.
    pub const SLIP: usize = 5;
    /// Energy dissipated by friction, J. A quadrature.
    pub const FRICTION_LOSS: usize = 6;
    /// Energy dissipated by c_t of both disks, J. A quadrature.
    pub const DAMPING_LOSS: usize = 7;
}
use index::*;

/// The torsional state: [`index`] names its components.
pub type TorsionState = [f64; DIMENSION];

/// The torsional system with its friction, without time.
#[derive(Debug, Clone, PartialEq)]
pub struct TorsionModel {
    /// Inertias, stiffness and damping.
    pub torsion: Torsion,
    /// Radius, and the breakaway test.
    pub contact: Contact,
    /// At rest and in slip.
    pub friction: Friction,
}

impl TorsionModel {
    /// Of a brake.
    pub fn new(parameters: &Parameters) -> Self {
        TorsionModel {
            torsion: parameters.torsion,
            contact: parameters.contact,
            friction: parameters.friction.clone(),
        }
    }

    /// T_r = c_t u' + k_t u, equation (2), N m.
    #[inline]
    pub fn rotor_torque(&self, y: &[f64]) -> f64 {
        self.torsion.damping * y[ROTOR_TWIST_RATE] + self.torsion.stiffness * y[ROTOR_TWIST]
    }

    /// T_s = c_t v' + k_t v, N m.
    #[inline]
    pub fn stator_torque(&self, y: &[f64]) -> f64 {
        self.torsion.damping * y[STATOR_TWIST_RATE] + self.torsion.stiffness * y[STATOR_TWIST]
    }

    /// T_f = (T_r + T_s)/2, N m: in stick the exact torque of the constraint.
    pub fn transmitted_torque(&self, y: &[f64]) -> f64 {
        (self.rotor_torque(y) + self.stator_torque(y)) / 2.0
    }

    /// The torque that the breakaway test holds against mu_0 r F_n, N m.
    pub fn tested_torque(&self, y: &[f64]) -> f64 {
        match self.contact.breakaway_test {
            BreakawayTest::Transmitted => self.transmitted_torque(y),
            BreakawayTest::Stator => self.stator_torque(y),
            BreakawayTest::Rotor => self.rotor_torque(y),
        }
    }

    /// mu_0 r F_n, N m.
    pub fn breakaway_torque(&self, normal_force: f64) -> f64 {
        self.friction.breakaway * self.contact.radius * normal_force
    }

    /// s mu(s omega_r) r F_n: the interface torque of slip with sense `s`, N m.
    #[inline]
    pub fn sliding_torque(&self, sense: f64, y: &[f64], normal_force: f64) -> f64 {
        let mu = self.friction.law.coefficient(sense * self.relative_velocity(y));
        sense * mu * self.contact.radius * normal_force
    }

    /// The rate of [`Self::sliding_torque`], N m/s, for the state's rates `dydt` and `pressing`, F_n (N) with its rate (N/s).
    pub fn sliding_torque_rate(&self, sense: f64, y: &[f64], dydt: &[f64], pressing: (f64, f64)) -> f64 {
        let (mu, slope) = self
            .friction
            .law
            .coefficient_and_slope(sense * self.relative_velocity(y));
        let acceleration = self.relative_velocity(dydt);
        self.contact.radius * (slope * acceleration * pressing.0 + sense * mu * pressing.1)
    }

    /// dy/dt in a mode; `normal_force` gives F_n (N), and is asked only where there is friction.
    #[inline]
    pub fn rates(&self, mode: Mode, normal_force: impl FnOnce() -> f64, y: &[f64], dydt: &mut [f64]) {
        match mode {
            Mode::SlipForward => self.slip_rhs(1.0, normal_force(), y, dydt),
            Mode::SlipBackward => self.slip_rhs(-1.0, normal_force(), y, dydt),
            Mode::Stick => self.stick_rhs(y, dydt),
            Mode::Separated => self.separated_rhs(y, dydt),
        }
    }

    /// The Jacobian of [`Self::rates`], DIMENSION x DIMENSION, into a zeroed matrix.
    pub fn jacobian(
        &self,
        mode: Mode,
        normal_force: impl FnOnce() -> f64,
        y: &[f64],
        jac: &mut DMatrixViewMut<'_, f64>,
    ) {
        match mode {
            Mode::SlipForward => self.slip_jacobian(1.0, normal_force(), y, jac),
            Mode::SlipBackward => self.slip_jacobian(-1.0, normal_force(), y, jac),
            Mode::Stick => self.stick_jacobian(y, jac),
            Mode::Separated => self.separated_jacobian(y, jac),
        }
    }

    /// Slip with sense `s` (+1 or -1), equations (2) and (3). `normal_force` F_n in N.
    #[inline]
    pub fn slip_rhs(&self, sense: f64, normal_force: f64, y: &[f64], dydt: &mut [f64]) {
        let friction = self.sliding_torque(sense, y, normal_force);
        self.free_rhs(friction, y, dydt);
        dydt[FRICTION_LOSS] = friction * dydt[SLIP];
    }

    /// No contact: the surfaces are free.
    pub fn separated_rhs(&self, y: &[f64], dydt: &mut [f64]) {
        self.free_rhs(0.0, y, dydt);
        dydt[FRICTION_LOSS] = 0.0;
    }

    /// Both surfaces on their own, with the interface torque `t_i` between them.
    #[inline]
    fn free_rhs(&self, t_i: f64, y: &[f64], dydt: &mut [f64]) {
        let Torsion {
            rotor_inertia: i,
            surface_inertia: j,
            damping: c_t,
            ..
        } = self.torsion;
        let (t_r, t_s) = (self.rotor_torque(y), self.stator_torque(y));
        let phi2_ddot = (t_r - t_i) / j;
        let phi1_ddot = (t_i - t_s) / j;
        dydt[ROTOR_TWIST] = y[ROTOR_TWIST_RATE];
        dydt[ROTOR_TWIST_RATE] = -t_r / i - phi2_ddot;
        dydt[STATOR_TWIST] = y[STATOR_TWIST_RATE];
        dydt[STATOR_TWIST_RATE] = phi1_ddot;
        dydt[ROTOR_SPEED] = -t_r / i;
        dydt[SLIP] = self.relative_velocity(y);
        dydt[DAMPING_LOSS] =
            c_t * (y[ROTOR_TWIST_RATE] * y[ROTOR_TWIST_RATE] + y[STATOR_TWIST_RATE] * y[STATOR_TWIST_RATE]);
    }

    /// Stick, equation (4): the surfaces move as one.
    pub fn stick_rhs(&self, y: &[f64], dydt: &mut [f64]) {
        let Torsion {
            rotor_inertia: i,
            surface_inertia: j,
            damping: c_t,
            ..
        } = self.torsion;
        let (t_r, t_s) = (self.rotor_torque(y), self.stator_torque(y));
        let phi_ddot = (t_r - t_s) / (2.0 * j);
        dydt[ROTOR_TWIST] = y[ROTOR_TWIST_RATE];
        dydt[ROTOR_TWIST_RATE] = -t_r / i - phi_ddot;
        dydt[STATOR_TWIST] = y[STATOR_TWIST_RATE];
        dydt[STATOR_TWIST_RATE] = phi_ddot;
        dydt[ROTOR_SPEED] = -t_r / i;
        dydt[SLIP] = 0.0;
        dydt[FRICTION_LOSS] = 0.0;
        dydt[DAMPING_LOSS] =
            c_t * (y[ROTOR_TWIST_RATE] * y[ROTOR_TWIST_RATE] + y[STATOR_TWIST_RATE] * y[STATOR_TWIST_RATE]);
    }

    /// Jacobian of [`Self::slip_rhs`], DIMENSION x DIMENSION, into a zeroed matrix.
    pub fn slip_jacobian(&self, sense: f64, normal_force: f64, y: &[f64], jac: &mut DMatrixViewMut<'_, f64>) {
        let w = self.relative_velocity(y);
        let (mu, slope) = self.friction.law.coefficient_and_slope(sense * w);
        let r_fn = self.contact.radius * normal_force;
        // d(s mu(s w))/dw = mu'(s w)
        self.free_jacobian(slope * r_fn, y, jac);
        let loss_slope = sense * mu * r_fn + slope * r_fn * w;
        for (column, sign) in RELATIVE_VELOCITY {
            jac[(FRICTION_LOSS, column)] = sign * loss_slope;
        }
    }

    /// Jacobian of [`Self::separated_rhs`], into a zeroed matrix.
    pub fn separated_jacobian(&self, y: &[f64], jac: &mut DMatrixViewMut<'_, f64>) {
        self.free_jacobian(0.0, y, jac);
    }

    fn free_jacobian(&self, torque_slope: f64, y: &[f64], jac: &mut DMatrixViewMut<'_, f64>) {
        let Torsion {
            rotor_inertia: i,
            surface_inertia: j,
            stiffness: k_t,
            damping: c_t,
        } = self.torsion;
        jac[(ROTOR_TWIST, ROTOR_TWIST_RATE)] = 1.0;
        jac[(ROTOR_TWIST_RATE, ROTOR_TWIST)] = -k_t / i - k_t / j;
        jac[(ROTOR_TWIST_RATE, ROTOR_TWIST_RATE)] = -c_t / i - c_t / j;
        jac[(STATOR_TWIST, STATOR_TWIST_RATE)] = 1.0;
        jac[(STATOR_TWIST_RATE, STATOR_TWIST)] = -k_t / j;
        jac[(STATOR_TWIST_RATE, STATOR_TWIST_RATE)] = -c_t / j;
        jac[(ROTOR_SPEED, ROTOR_TWIST)] = -k_t / i;
        jac[(ROTOR_SPEED, ROTOR_TWIST_RATE)] = -c_t / i;
        for (column, sign) in RELATIVE_VELOCITY {
            jac[(ROTOR_TWIST_RATE, column)] += sign * torque_slope / j;
            jac[(STATOR_TWIST_RATE, column)] += sign * torque_slope / j;
            jac[(SLIP, column)] = sign;
        }
        self.damping_loss_jacobian(y, jac);
    }

    /// Jacobian of [`Self::stick_rhs`], into a zeroed matrix.
    pub fn stick_jacobian(&self, y: &[f64], jac: &mut DMatrixViewMut<'_, f64>) {
        let Torsion {
            rotor_inertia: i,
            surface_inertia: j,
            stiffness: k_t,
            damping: c_t,
        } = self.torsion;
        let half = 1.0 / (2.0 * j);
        jac[(ROTOR_TWIST, ROTOR_TWIST_RATE)] = 1.0;
        jac[(ROTOR_TWIST_RATE, ROTOR_TWIST)] = -k_t / i - k_t * half;
        jac[(ROTOR_TWIST_RATE, ROTOR_TWIST_RATE)] = -c_t / i - c_t * half;
        jac[(ROTOR_TWIST_RATE, STATOR_TWIST)] = k_t * half;
        jac[(ROTOR_TWIST_RATE, STATOR_TWIST_RATE)] = c_t * half;
        jac[(STATOR_TWIST, STATOR_TWIST_RATE)] = 1.0;
        jac[(STATOR_TWIST_RATE, ROTOR_TWIST)] = k_t * half;
        jac[(STATOR_TWIST_RATE, ROTOR_TWIST_RATE)] = c_t * half;
        jac[(STATOR_TWIST_RATE, STATOR_TWIST)] = -k_t * half;
        jac[(STATOR_TWIST_RATE, STATOR_TWIST_RATE)] = -c_t * half;
        jac[(ROTOR_SPEED, ROTOR_TWIST)] = -k_t / i;
        jac[(ROTOR_SPEED, ROTOR_TWIST_RATE)] = -c_t / i;
        self.damping_loss_jacobian(y, jac);
    }

    fn damping_loss_jacobian(&self, y: &[f64], jac: &mut DMatrixViewMut<'_, f64>) {
        jac[(DAMPING_LOSS, ROTOR_TWIST_RATE)] = 2.0 * self.torsion.damping * y[ROTOR_TWIST_RATE];
        jac[(DAMPING_LOSS, STATOR_TWIST_RATE)] = 2.0 * self.torsion.damping * y[STATOR_TWIST_RATE];
    }

    /// The state with both surfaces at their mean speed: exact momentum balance of two equal inertias.
    pub fn joined(&self, y: &[f64]) -> TorsionState {
        let mut joined = copy(y);
        let half = self.relative_velocity(y) / 2.0;
        joined[ROTOR_TWIST_RATE] += half;
        joined[STATOR_TWIST_RATE] += half;
        joined
    }

    /// The state after a kick that adds `delta` to the relative velocity: phi2_dot + delta/2, phi1_dot - delta/2.
    pub fn kicked(&self, y: &[f64], delta: f64) -> TorsionState {
        let mut kicked = copy(y);
        kicked[ROTOR_TWIST_RATE] -= delta / 2.0;
        kicked[STATOR_TWIST_RATE] -= delta / 2.0;
        kicked
    }

    /// omega_r = theta' - u' - v' = phi_2' - phi_1', rad/s.
    #[inline]
    pub fn relative_velocity(&self, y: &[f64]) -> f64 {
        y[ROTOR_SPEED] - y[ROTOR_TWIST_RATE] - y[STATOR_TWIST_RATE]
    }

    /// Kinetic energy of rotor and surfaces, J.
    pub fn kinetic_energy(&self, y: &[f64]) -> f64 {
        let Torsion {
            rotor_inertia,
            surface_inertia,
            ..
        } = self.torsion;
        let phi1_dot = y[STATOR_TWIST_RATE];
        let phi2_dot = y[ROTOR_SPEED] - y[ROTOR_TWIST_RATE];
        let theta_dot = y[ROTOR_SPEED];
        0.5 * (rotor_inertia * theta_dot * theta_dot + surface_inertia * (phi1_dot * phi1_dot + phi2_dot * phi2_dot))
    }

    /// Elastic energy of both twists, J.
    pub fn elastic_energy(&self, y: &[f64]) -> f64 {
        0.5 * self.torsion.stiffness * (y[ROTOR_TWIST] * y[ROTOR_TWIST] + y[STATOR_TWIST] * y[STATOR_TWIST])
    }

    /// c_t + 2 r F_n mu'(|omega_r|), N m s/rad: the damping left to the relative mode in steady sliding with sense `s`.
    /// Its zero is what the project calls instability.
    pub fn stability_margin(&self, sense: f64, relative_velocity: f64, normal_force: f64) -> f64 {
        let (_, slope) = self.friction.law.coefficient_and_slope(sense * relative_velocity);
        self.torsion.damping + self.slope_weight(normal_force) * slope
    }

    /// 2 r F_n, N m: what mu' is multiplied by in the stability margin.
    #[inline]
    pub fn slope_weight(&self, normal_force: f64) -> f64 {
        2.0 * self.contact.radius * normal_force
    }

    /// The highest |omega_r| (rad/s) at which the stability margin is zero, if it is anywhere.
    pub fn critical_speed(&self, normal_force: f64) -> Option<f64> {
        self.critical_speeds(normal_force).first().copied()
    }

    /// Every |omega_r| (rad/s) at which the stability margin changes its sign, the highest first.
    pub fn critical_speeds(&self, normal_force: f64) -> Vec<f64> {
        let weight = self.slope_weight(normal_force);
        self.friction.law.damping_zeros(self.torsion.damping, weight)
    }

    /// Natural angular frequency of the relative mode, sqrt(k_t/J), rad/s.
    pub fn natural_angular_frequency(&self) -> f64 {
        (self.torsion.stiffness / self.torsion.surface_inertia).sqrt()
    }

    /// What a component of the state is multiplied by to compare with a rate: omega_n for a twist, 1/s, else 1.
    pub fn rate_weight(&self, component: usize) -> f64 {
        if component == ROTOR_TWIST || component == STATOR_TWIST {
            self.natural_angular_frequency()
        } else {
            1.0
        }
    }

    /// T_n = 2 pi sqrt(J/k_t), s.
    pub fn natural_period(&self) -> f64 {
        std::f64::consts::TAU / self.natural_angular_frequency()
    }
}

/// d(omega_r)/dy: (column, derivative).
const RELATIVE_VELOCITY: [(usize, f64); 3] = [(ROTOR_SPEED, 1.0), (ROTOR_TWIST_RATE, -1.0), (STATOR_TWIST_RATE, -1.0)];

fn copy(y: &[f64]) -> TorsionState {
    let mut state = [0.0; DIMENSION];
    state.copy_from_slice(&y[..DIMENSION]);
    state
}
