//! The linear part of the torsional system, in one place: rates, Jacobian and energies from inertias, stiffness and damping.
//!
//! With q = (theta, phi_2, phi_1) it is M q'' + C q' + K q = -b T, where omega_r = b . q' and T is the torque through the
//! interface ([`Matrices`]). The state has twists instead of angles, so that the rates and their Jacobian are written for them, in the
//! order of operations that the results rest on.
//! `tests/analytic_linear_part.rs` holds each against M, C, K and b.

use super::Torsion;
use super::state::index::*;
use nalgebra::{DMatrixViewMut, Matrix3, Vector3};

/// M q'' + C q' + K q = -b T, q = (theta, phi_2, phi_1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matrices {
    /// M, kg m^2.
    pub inertia: Matrix3<f64>,
    /// C, N m s/rad.
    pub damping: Matrix3<f64>,
    /// K, N m/rad.
    pub stiffness: Matrix3<f64>,
    /// b, the incidence of the contact.
    pub contact: Vector3<f64>,
}

/// d(omega_r)/dy: (component, derivative).
pub(super) const RELATIVE_VELOCITY: [(usize, f64); 3] =
    [(ROTOR_SPEED, 1.0), (ROTOR_TWIST_RATE, -1.0), (STATOR_TWIST_RATE, -1.0)];

impl Torsion {
    /// The equations in angles.
    pub fn matrices(&self) -> Matrices {
        // The shafts: theta - phi_2 and phi_1.
        let (rotor, stator) = (Vector3::new(1.0, -1.0, 0.0), Vector3::new(0.0, 0.0, 1.0));
        let shafts = rotor * rotor.transpose() + stator * stator.transpose();
        let inertias = Vector3::new(self.rotor_inertia, self.surface_inertia, self.surface_inertia);
        Matrices {
            inertia: Matrix3::from_diagonal(&inertias),
            damping: shafts * self.damping,
            stiffness: shafts * self.stiffness,
            contact: Vector3::new(0.0, 1.0, -1.0),
        }
    }

    /// T_r = c_t u' + k_t u, equation (2), N m.
    #[inline]
    pub fn rotor_torque(&self, y: &[f64]) -> f64 {
        self.damping * y[ROTOR_TWIST_RATE] + self.stiffness * y[ROTOR_TWIST]
    }

    /// T_s = c_t v' + k_t v, N m.
    #[inline]
    pub fn stator_torque(&self, y: &[f64]) -> f64 {
        self.damping * y[STATOR_TWIST_RATE] + self.stiffness * y[STATOR_TWIST]
    }

    /// I + J, the inertia of rotor and rotor surface as one, kg m^2.
    #[inline]
    pub fn rigid_inertia(&self) -> f64 {
        self.rotor_inertia + self.surface_inertia
    }

    /// J/(I + J): the share of the rotor twist's rate that the rotor's speed follows where their momentum is kept.
    #[inline]
    pub(crate) fn surface_share(&self) -> f64 {
        self.surface_inertia / self.rigid_inertia()
    }

    /// Natural angular frequency of the relative mode, sqrt(k_t/J), rad/s.
    pub fn natural_angular_frequency(&self) -> f64 {
        (self.stiffness / self.surface_inertia).sqrt()
    }

    /// The rates, with no loss by friction, of both surfaces on their own with the torque `t_i` (N m) between them: slip
    /// and separation.
    #[inline]
    pub fn free_rates(&self, t_i: f64, y: &[f64], dydt: &mut [f64]) {
        self.rates_with(false, t_i, y, dydt);
        dydt[SLIP] = relative_velocity(y);
    }

    /// The same of both surfaces as one: stick.
    #[inline]
    pub fn joined_rates(&self, y: &[f64], dydt: &mut [f64]) {
        self.rates_with(true, 0.0, y, dydt);
        dydt[SLIP] = 0.0;
    }

    /// (phi_2'', phi_1'') of surfaces under T_r and T_s (N m), as one or with the torque `t_i` between them, rad/s^2.
    #[inline]
    pub(crate) fn surface_accelerations(&self, joined: bool, (t_r, t_s): (f64, f64), t_i: f64) -> (f64, f64) {
        let j = self.surface_inertia;
        if joined {
            let phi_ddot = (t_r - t_s) / (2.0 * j);
            (phi_ddot, phi_ddot)
        } else {
            ((t_r - t_i) / j, (t_i - t_s) / j)
        }
    }

    #[inline]
    fn rates_with(&self, joined: bool, t_i: f64, y: &[f64], dydt: &mut [f64]) {
        let (t_r, t_s) = (self.rotor_torque(y), self.stator_torque(y));
        let (phi2_ddot, phi1_ddot) = self.surface_accelerations(joined, (t_r, t_s), t_i);
        dydt[ROTOR_TWIST] = y[ROTOR_TWIST_RATE];
        dydt[ROTOR_TWIST_RATE] = -t_r / self.rotor_inertia - phi2_ddot;
        dydt[STATOR_TWIST] = y[STATOR_TWIST_RATE];
        dydt[STATOR_TWIST_RATE] = phi1_ddot;
        dydt[ROTOR_SPEED] = -t_r / self.rotor_inertia;
        dydt[FRICTION_LOSS] = 0.0;
        dydt[DAMPING_LOSS] = self.damping_power(y);
    }

    /// c_t (u'^2 + v'^2), W.
    #[inline]
    pub fn damping_power(&self, y: &[f64]) -> f64 {
        self.damping * (y[ROTOR_TWIST_RATE] * y[ROTOR_TWIST_RATE] + y[STATOR_TWIST_RATE] * y[STATOR_TWIST_RATE])
    }

    /// The rate of [`Self::damping_power`] for the state's rates `dydt`, W/s.
    pub fn damping_power_rate(&self, y: &[f64], dydt: &[f64]) -> f64 {
        let bend = y[ROTOR_TWIST_RATE] * dydt[ROTOR_TWIST_RATE] + y[STATOR_TWIST_RATE] * dydt[STATOR_TWIST_RATE];
        2.0 * self.damping * bend
    }

    /// The Jacobian of [`Self::joined_rates`] if `joined`, else of [`Self::free_rates`] with a torque whose derivative by
    /// omega_r is `torque_slope` (N m s/rad), into a zeroed matrix.
    pub fn jacobian(&self, joined: bool, torque_slope: f64, y: &[f64], jac: &mut DMatrixViewMut<'_, f64>) {
        let (i, j) = (self.rotor_inertia, self.surface_inertia);
        let half = 1.0 / (2.0 * j);
        let per_surface = |x: f64| if joined { x * half } else { x / j };
        jac[(ROTOR_TWIST, ROTOR_TWIST_RATE)] = 1.0;
        jac[(STATOR_TWIST, STATOR_TWIST_RATE)] = 1.0;
        for (x, rotor, stator) in [
            (self.stiffness, ROTOR_TWIST, STATOR_TWIST),
            (self.damping, ROTOR_TWIST_RATE, STATOR_TWIST_RATE),
        ] {
            jac[(ROTOR_SPEED, rotor)] = -x / i;
            jac[(ROTOR_TWIST_RATE, rotor)] = -x / i - per_surface(x);
            jac[(STATOR_TWIST_RATE, stator)] = -per_surface(x);
            if joined {
                jac[(ROTOR_TWIST_RATE, stator)] = per_surface(x);
                jac[(STATOR_TWIST_RATE, rotor)] = per_surface(x);
            }
        }
        if !joined {
            for (column, sign) in RELATIVE_VELOCITY {
                jac[(ROTOR_TWIST_RATE, column)] += sign * torque_slope / j;
                jac[(STATOR_TWIST_RATE, column)] += sign * torque_slope / j;
                jac[(SLIP, column)] = sign;
            }
        }
        for rate in [ROTOR_TWIST_RATE, STATOR_TWIST_RATE] {
            jac[(DAMPING_LOSS, rate)] = 2.0 * self.damping * y[rate];
        }
    }

    /// Kinetic energy of rotor and surfaces, J.
    pub fn kinetic_energy(&self, y: &[f64]) -> f64 {
        let [theta_dot, phi2_dot, phi1_dot] = speeds(y);
        let surfaces = self.surface_inertia * (phi1_dot * phi1_dot + phi2_dot * phi2_dot);
        0.5 * (self.rotor_inertia * theta_dot * theta_dot + surfaces)
    }

    /// Elastic energy of both twists, J.
    pub fn elastic_energy(&self, y: &[f64]) -> f64 {
        0.5 * self.stiffness * (y[ROTOR_TWIST] * y[ROTOR_TWIST] + y[STATOR_TWIST] * y[STATOR_TWIST])
    }

    /// I theta' + J phi_2', N m s. In slip its rate is exactly minus the interface torque.
    pub fn slow_momentum(&self, y: &[f64]) -> f64 {
        self.rotor_inertia * y[ROTOR_SPEED] + self.surface_inertia * (y[ROTOR_SPEED] - y[ROTOR_TWIST_RATE])
    }

    /// The rotor's speed (rad/s) by this [`Self::slow_momentum`] and u' (rad/s).
    #[inline]
    pub fn speed_of_momentum(&self, momentum: f64, rotor_twist_rate: f64) -> f64 {
        (momentum + self.surface_inertia * rotor_twist_rate) / self.rigid_inertia()
    }
}

/// q' = (theta', phi_2', phi_1') of a state, rad/s.
pub fn speeds<T: Copy + std::ops::Sub<Output = T>>(y: &[T]) -> [T; 3] {
    [
        y[ROTOR_SPEED],
        y[ROTOR_SPEED] - y[ROTOR_TWIST_RATE],
        y[STATOR_TWIST_RATE],
    ]
}

/// The same of a stick, of the twist rates alone: theta' = u' + v'.
pub(crate) fn joined_speeds<T: Copy + std::ops::Add<Output = T>>(y: &[T]) -> [T; 3] {
    let surfaces = y[STATOR_TWIST_RATE];
    [y[ROTOR_TWIST_RATE] + surfaces, surfaces, surfaces]
}

/// omega_r = theta' - u' - v' = phi_2' - phi_1', rad/s.
#[inline]
pub fn relative_velocity(y: &[f64]) -> f64 {
    y[ROTOR_SPEED] - y[ROTOR_TWIST_RATE] - y[STATOR_TWIST_RATE]
}
