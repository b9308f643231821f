//! The Taylor series of a slip: all coefficients of the state in time, from its start.
//!
//! Equations (2), (3) and (8) hold coefficient by coefficient: sums stay sums, a product is a convolution, and
//! e = exp(-alpha s omega_r) follows from e' = -alpha s omega_r' e. The recurrence is written for any [`Number`], so that
//! more digits take another number type and nothing else.

use super::torsion::{DIMENSION, TorsionModel, index::*};
use crate::series::{Number, taylor};

/// The constants of a slip in one precision, derived from a [`TorsionModel`].
#[derive(Debug, Clone)]
pub struct SlipConstants<T> {
    rotor_inertia: T,
    surface_inertia: T,
    stiffness: T,
    damping: T,
    radius: T,
    high_speed: T,
    /// mu_s - mu_d.
    weakening: T,
    decay: T,
}

impl<T: Number> SlipConstants<T> {
    pub fn new(model: &TorsionModel) -> Self {
        let (low, high) = (T::of(model.friction.low_speed), T::of(model.friction.high_speed));
        SlipConstants {
            rotor_inertia: T::of(model.torsion.rotor_inertia),
            surface_inertia: T::of(model.torsion.surface_inertia),
            stiffness: T::of(model.torsion.stiffness),
            damping: T::of(model.torsion.damping),
            radius: T::of(model.contact.radius),
            weakening: low - high.clone(),
            high_speed: high,
            decay: T::of(model.friction.decay),
        }
    }
}

/// Coefficients 0 to N - 1 of everything in a slip, by powers of time over [`Self::unit`].
#[derive(Debug, Clone)]
pub struct SlipSeries<T, const N: usize> {
    /// s.
    pub unit: T,
    /// By the [`index`](super::torsion::index) of the component.
    pub state: [[T; N]; DIMENSION],
    /// omega_r.
    pub relative_velocity: [T; N],
    /// c_t - 2 r F_n alpha (mu_s - mu_d) exp(-alpha |omega_r|).
    pub stability_margin: [T; N],
    /// The interface torque s mu r F_n.
    friction_torque: [T; N],
    /// k times coefficient k of -alpha s omega_r.
    exponent_rate: [T; N],
    exponential: [T; N],
}

impl<T: Number, const N: usize> SlipSeries<T, N> {
    /// Room for series by powers of time over `unit` (s), which should be near 1 / omega_n.
    pub fn new(unit: T) -> Self {
        let zeros = || std::array::from_fn(|_| T::of(0.0));
        SlipSeries {
            unit,
            state: std::array::from_fn(|_| zeros()),
            relative_velocity: zeros(),
            stability_margin: zeros(),
            friction_torque: zeros(),
            exponent_rate: zeros(),
            exponential: zeros(),
        }
    }

    /// Fills all coefficients for the slip of sense `sense` (+1 or -1) that starts with the state `y`. `force` holds the
    /// coefficients of F_n (N), of which those beyond `degree` are zero.
    pub fn expand(
        &mut self,
        constants: &SlipConstants<T>,
        sense: f64,
        y: &[T; DIMENSION],
        force: &[T; N],
        degree: usize,
    ) {
        let SlipConstants {
            rotor_inertia,
            surface_inertia,
            stiffness,
            damping,
            radius,
            high_speed,
            weakening,
            decay,
        } = constants;
        let sense = T::of(sense);
        let two = T::of(2.0);
        for (series, start) in self.state.iter_mut().zip(y) {
            series[0] = start.clone();
        }
        self.relative_velocity[0] = y[ROTOR_SPEED].clone() - y[ROTOR_TWIST_RATE].clone() - y[STATOR_TWIST_RATE].clone();
        let exponent = -(decay.clone() * sense.clone());
        let signed_radius = sense * radius.clone();
        let steepness = two.clone() * radius.clone() * decay.clone() * weakening.clone();
        for n in 0..N {
            if n == 0 {
                self.exponential[0] = (exponent.clone() * self.relative_velocity[0].clone()).exp();
            } else {
                self.exponent_rate[n] = exponent.clone() * T::of(n as f64) * self.relative_velocity[n].clone();
                self.exponential[n] = taylor::exponential(&self.exponent_rate, &self.exponential, n);
            }
            let terms = degree.min(n);
            let weakened = T::convolution(&force[..=terms], &self.exponential[n - terms..=n]);
            self.stability_margin[n] = -(steepness.clone() * weakened.clone());
            let mu_force = high_speed.clone() * force[n].clone() + weakening.clone() * weakened;
            let torque = signed_radius.clone() * mu_force;
            self.friction_torque[n] = torque.clone();
            if n + 1 == N {
                break;
            }
            let [u, u_dot, v, v_dot] = [ROTOR_TWIST, ROTOR_TWIST_RATE, STATOR_TWIST, STATOR_TWIST_RATE]
                .map(|component| self.state[component][n].clone());
            let rotor_torque = damping.clone() * u_dot.clone() + stiffness.clone() * u;
            let stator_torque = damping.clone() * v_dot.clone() + stiffness.clone() * v;
            let step = self.unit.clone() / T::of((n + 1) as f64);
            let rotor = rotor_torque.clone() / rotor_inertia.clone();
            let per_surface = step.clone() / surface_inertia.clone();
            self.state[ROTOR_TWIST][n + 1] = step.clone() * u_dot;
            self.state[ROTOR_TWIST_RATE][n + 1] =
                -(step.clone() * rotor.clone()) - per_surface.clone() * (rotor_torque.clone() - torque.clone());
            self.state[STATOR_TWIST][n + 1] = step.clone() * v_dot;
            self.state[STATOR_TWIST_RATE][n + 1] = per_surface.clone() * (torque.clone() - stator_torque.clone());
            self.state[ROTOR_SPEED][n + 1] = -(step.clone() * rotor);
            // J omega_r' = T_r + T_s - 2 T: without the difference of speeds, which would cancel.
            self.relative_velocity[n + 1] = per_surface * (rotor_torque + stator_torque - two.clone() * torque);
            self.state[SLIP][n + 1] = step * self.relative_velocity[n].clone();
        }
        self.stability_margin[0] = damping.clone() + self.stability_margin[0].clone();
        for n in 0..N - 1 {
            let step = self.unit.clone() / T::of((n + 1) as f64);
            let friction = taylor::product(&self.friction_torque, &self.relative_velocity, n);
            self.state[FRICTION_LOSS][n + 1] = step.clone() * friction;
            let (u_dot, v_dot) = (&self.state[ROTOR_TWIST_RATE], &self.state[STATOR_TWIST_RATE]);
            let squares = taylor::product(u_dot, u_dot, n) + taylor::product(v_dot, v_dot, n);
            self.state[DAMPING_LOSS][n + 1] = step * damping.clone() * squares;
        }
    }

    /// The state at the time `x` times the unit after the start.
    pub fn at(&self, x: &T) -> [T; DIMENSION] {
        std::array::from_fn(|component| taylor::value(&self.state[component], x))
    }
}
