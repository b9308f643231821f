//! The torsional equations in twist coordinates.
//!
//! The rotor turns through some 350 rad while its twist is a few microradians: absolute angles would leave eight digits
//! of torque. The state holds the twists themselves and the rotor speed. The relative velocity is their difference,
//! omega_r = theta' - u' - v', and no component: as a component it would be rounded at each step to 16 digits of the
//! sliding speed, and that rounding would feed the fast mode. The rounding of the rotor speed only feeds the slow one.

use super::linear_part::{self, RELATIVE_VELOCITY};
use super::state::{Components, DIMENSION, DYNAMIC, MEASURES, Measure, TorsionState, index::*, state_of};
use super::{BreakawayTest, Contact, Mode, Parameters, Torsion};
use crate::friction::{Friction, Law};
use nalgebra::{DMatrixViewMut, SMatrix};

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

    /// The same with one piece of a friction law that has knots, gone on with smoothly beyond them.
    pub(crate) fn on_piece(&self, piece: usize) -> Self {
        let Friction { breakaway, law } = &self.friction;
        TorsionModel {
            torsion: self.torsion,
            contact: self.contact,
            friction: Friction {
                breakaway: *breakaway,
                law: law.continued(piece),
            },
        }
    }

    /// T_f = (T_r + T_s)/2, N m: in stick the exact torque of the constraint.
    pub fn transmitted_torque(&self, y: &[f64]) -> f64 {
        (self.torsion.rotor_torque(y) + self.torsion.stator_torque(y)) / 2.0
    }

    /// The torque that the breakaway test holds against mu_0 r F_n, N m.
    pub fn tested_torque(&self, y: &[f64]) -> f64 {
        match self.contact.breakaway_test {
            BreakawayTest::Transmitted => self.transmitted_torque(y),
            BreakawayTest::Stator => self.torsion.stator_torque(y),
            BreakawayTest::Rotor => self.torsion.rotor_torque(y),
        }
    }

    /// mu_0 r F_n, N m.
    pub fn breakaway_torque(&self, normal_force: f64) -> f64 {
        self.friction.breakaway * self.contact.radius * normal_force
    }

    /// s mu(s omega_r) r F_n: the interface torque of slip with sense `s`, N m.
    #[inline]
    pub(crate) fn sliding_torque(&self, sense: f64, y: &[f64], normal_force: f64) -> f64 {
        let mu = self.friction.law.coefficient(sense * self.relative_velocity(y));
        sense * mu * self.contact.radius * normal_force
    }

    /// dy/dt in a mode, equations (2) to (4); `normal_force` gives F_n (N), and is asked only where there is friction.
    #[inline]
    pub fn rates(&self, mode: Mode, normal_force: impl FnOnce() -> f64, y: &[f64], dydt: &mut [f64]) {
        match mode {
            Mode::SlipForward => self.slip_rates(1.0, normal_force(), y, dydt),
            Mode::SlipBackward => self.slip_rates(-1.0, normal_force(), y, dydt),
            Mode::Stick => self.torsion.joined_rates(y, dydt),
            // A brake sticks: it is never engaged.
            Mode::Separated | Mode::Engaged => self.torsion.free_rates(0.0, y, dydt),
        }
    }

    #[inline]
    fn slip_rates(&self, sense: f64, normal_force: f64, y: &[f64], dydt: &mut [f64]) {
        let friction = self.sliding_torque(sense, y, normal_force);
        self.torsion.free_rates(friction, y, dydt);
        dydt[FRICTION_LOSS] = friction * dydt[SLIP];
    }

    /// The same as a state of its own.
    pub fn rates_at(&self, mode: Mode, normal_force: impl FnOnce() -> f64, y: &[f64]) -> TorsionState {
        let mut rates = [0.0; DIMENSION];
        self.rates(mode, normal_force, y, &mut rates);
        rates
    }

    /// The Jacobian of [`Self::rates`], DIMENSION x DIMENSION, into a zeroed matrix.
    pub fn jacobian(
        &self,
        mode: Mode,
        normal_force: impl FnOnce() -> f64,
        y: &[f64],
        jac: &mut DMatrixViewMut<'_, f64>,
    ) {
        if mode.sense() == 0 {
            return self.torsion.jacobian(mode == Mode::Stick, 0.0, y, jac);
        }
        let (sense, w) = (f64::from(mode.sense()), self.relative_velocity(y));
        let (mu, slope) = self.friction.law.coefficient_and_slope(sense * w);
        let r_fn = self.contact.radius * normal_force();
        // d(s mu(s w))/dw = mu'(s w)
        self.torsion.jacobian(false, slope * r_fn, y, jac);
        let loss_slope = sense * mu * r_fn + slope * r_fn * w;
        for (column, sign) in RELATIVE_VELOCITY {
            jac[(FRICTION_LOSS, column)] = sign * loss_slope;
        }
    }

    /// The part of the Jacobian that the equations depend on.
    pub(crate) fn dynamic_jacobian(
        &self,
        mode: Mode,
        normal_force: impl FnOnce() -> f64,
        y: &[f64],
    ) -> SMatrix<f64, DYNAMIC, DYNAMIC> {
        let mut entries = [0.0; DIMENSION * DIMENSION];
        let mut full = DMatrixViewMut::from_slice(&mut entries, DIMENSION, DIMENSION);
        self.jacobian(mode, normal_force, y, &mut full);
        full.fixed_view::<DYNAMIC, DYNAMIC>(0, 0).into_owned()
    }

    /// The same of slip with sense `s` at |omega_r| = `x` (rad/s) under F_n (N): of the state it depends on nothing else.
    pub(crate) fn sliding_jacobian(&self, sense: f64, normal_force: f64, x: f64) -> SMatrix<f64, DYNAMIC, DYNAMIC> {
        self.dynamic_jacobian(Mode::sliding(sense), || normal_force, &spinning(sense * x))
    }

    /// Puts both surfaces at their mean speed: exact momentum balance of two equal inertias.
    pub fn join(&self, y: &mut [f64]) {
        let half = self.relative_velocity(y) / 2.0;
        y[ROTOR_TWIST_RATE] += half;
        y[STATOR_TWIST_RATE] += half;
    }

    /// Adds `delta` to the relative velocity, as a kick does: phi2_dot + delta/2, phi1_dot - delta/2.
    pub fn kick(&self, y: &mut [f64], delta: f64) {
        y[ROTOR_TWIST_RATE] -= delta / 2.0;
        y[STATOR_TWIST_RATE] -= delta / 2.0;
    }

    /// The state after [`Self::join`].
    pub fn joined(&self, y: &[f64]) -> TorsionState {
        let mut joined = state_of(y);
        self.join(&mut joined);
        joined
    }

    /// The state after [`Self::kick`].
    pub fn kicked(&self, y: &[f64], delta: f64) -> TorsionState {
        let mut kicked = state_of(y);
        self.kick(&mut kicked, delta);
        kicked
    }

    /// omega_r = theta' - u' - v' = phi_2' - phi_1', rad/s.
    #[inline]
    pub fn relative_velocity(&self, y: &[f64]) -> f64 {
        linear_part::relative_velocity(y)
    }

    /// The largest twist rate, or twist times omega_n, rad/s.
    pub fn oscillation(&self, y: &[f64]) -> f64 {
        let of = |k: usize| match MEASURES[k] {
            Measure::Twist | Measure::TwistRate => self.rate_weight(k) * y[k].abs(),
            _ => 0.0,
        };
        (0..DYNAMIC).map(of).fold(0.0, f64::max)
    }

    /// c_t + 2 r F_n mu'(|omega_r|), N m s/rad: the damping left to the relative mode in steady sliding with sense `s`.
    /// Its zero is what the project calls instability.
    pub fn stability_margin(&self, sense: f64, relative_velocity: f64, normal_force: f64) -> f64 {
        let (_, slope) = self.friction.law.coefficient_and_slope(sense * relative_velocity);
        self.torsion.damping + self.slope_weight(normal_force) * slope
    }

    /// 2 r F_n, N m: what mu' is multiplied by in the stability margin.
    #[inline]
    pub(crate) fn slope_weight(&self, normal_force: f64) -> f64 {
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
        self.torsion.natural_angular_frequency()
    }

    /// What a component of the state is multiplied by to compare with a rate: omega_n for a twist, 1/s, else 1.
    pub(crate) fn rate_weight(&self, component: usize) -> f64 {
        if MEASURES[component] == Measure::Twist {
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

/// The state without twists whose rotor, with its surface, turns at `speed` (rad/s); the stator rests.
pub(crate) fn spinning(speed: f64) -> TorsionState {
    Components {
        rotor_speed: speed,
        ..Components::default()
    }
    .state()
}
