//! The Taylor series of a slip: all coefficients of the state in time, from its start.
//!
//! Equations (2) and (3) hold coefficient by coefficient: sums stay sums, a product is a convolution, and the friction law
//! gives its own coefficients from those of omega_r ([`LawSeries`]). The recurrence is written for any [`Number`], so that
//! more digits take another number type and nothing else.

use super::state::{DIMENSION, index::*};
use super::torsion::TorsionModel;
use crate::friction::{FrictionSeries, Law, LawSeries};
use crate::numerics::Number;
use crate::numerics::taylor::{self, zeros};

/// The constants of a slip in one precision, each taken for exact.
#[derive(Debug, Clone)]
struct SlipConstants<T> {
    per_rotor: T,
    per_surface: T,
    stiffness: T,
    damping: T,
    radius: T,
}

impl<T: Number> SlipConstants<T> {
    fn new(model: &TorsionModel) -> Self {
        SlipConstants {
            per_rotor: T::of(1.0) / T::of(model.torsion.rotor_inertia),
            per_surface: T::of(1.0) / T::of(model.torsion.surface_inertia),
            stiffness: T::of(model.torsion.stiffness),
            damping: T::of(model.torsion.damping),
            radius: T::of(model.contact.radius),
        }
    }
}

/// Coefficients 0 to N - 1 of everything in a slip, by powers of time over [`Self::unit`].
#[derive(Debug, Clone)]
pub struct SlipSeries<T: Number, const N: usize> {
    /// s.
    pub unit: T,
    /// By the [`index`](super::state::index) of the component.
    pub state: [[T; N]; DIMENSION],
    /// omega_r.
    pub relative_velocity: [T; N],
    /// c_t + 2 r F_n mu'(|omega_r|), N m s/rad.
    pub stability_margin: [T; N],
    /// The interface torque s mu r F_n.
    friction_torque: [T; N],
    friction: FrictionSeries<T, N>,
    /// 1 / n; the first is not used.
    reciprocals: [T; N],
    constants: SlipConstants<T>,
}

impl<T: Number, const N: usize> SlipSeries<T, N> {
    /// Room for the series of the slips of `model`, whose parameters are taken for exact, by powers of time over `unit` (s),
    /// which should be near 1 / omega_n.
    pub fn new(model: &TorsionModel, unit: T) -> Self {
        SlipSeries {
            unit,
            state: std::array::from_fn(|_| zeros()),
            relative_velocity: zeros(),
            stability_margin: zeros(),
            friction_torque: zeros(),
            friction: model.friction.law.series(),
            reciprocals: std::array::from_fn(|n| T::of(1.0) / T::of(n.max(1) as f64)),
            constants: SlipConstants::new(model),
        }
    }

    /// Fills all coefficients for the slip of sense `sense` (+1 or -1) that starts with the state `y`. `force` holds the
    /// coefficients of F_n (N), of which those beyond `degree` are zero.
    pub fn expand(&mut self, sense: f64, y: &[T; DIMENSION], force: &[T; N], degree: usize) {
        let SlipConstants {
            per_rotor,
            per_surface,
            stiffness,
            damping,
            radius,
        } = &self.constants;
        let sense = T::of(sense);
        let two = T::of(2.0);
        for (series, start) in self.state.iter_mut().zip(y) {
            series[0] = start.clone();
        }
        self.relative_velocity[0] = y[ROTOR_SPEED].clone() - y[ROTOR_TWIST_RATE].clone() - y[STATOR_TWIST_RATE].clone();
        // By powers of the unit's time; omega_r' is the accelerating torque over J, and the law follows it.
        let (rotor_step, surface_step) = (
            self.unit.clone() * per_rotor.clone(),
            self.unit.clone() * per_surface.clone(),
        );
        let factors = self
            .friction
            .factors(&(sense.clone() * radius.clone()), &(two.clone() * radius.clone()));
        let speed = sense.clone() * self.relative_velocity[0].clone();
        self.friction.start(&speed, &(sense * surface_step.clone()));
        for n in 0..N {
            let pressed = self.friction.pressed(force, n, degree);
            self.stability_margin[n] = factors.slope.clone() * pressed.slope;
            let torque = factors.constant.clone() * force[n].clone() + factors.shape.clone() * pressed.shape;
            self.friction_torque[n] = torque.clone();
            if n + 1 == N {
                break;
            }
            let [u, u_dot, v, v_dot] = [ROTOR_TWIST, ROTOR_TWIST_RATE, STATOR_TWIST, STATOR_TWIST_RATE]
                .map(|component| self.state[component][n].clone());
            let rotor_torque = damping.clone() * u_dot.clone() + stiffness.clone() * u;
            let stator_torque = damping.clone() * v_dot.clone() + stiffness.clone() * v;
            let share = self.reciprocals[n + 1].clone();
            let step = self.unit.clone() * share.clone();
            let surface = surface_step.clone() * share.clone();
            let rotor = rotor_step.clone() * share.clone() * rotor_torque.clone();
            self.state[ROTOR_TWIST][n + 1] = step.clone() * u_dot;
            self.state[ROTOR_TWIST_RATE][n + 1] =
                -rotor.clone() - surface.clone() * (rotor_torque.clone() - torque.clone());
            self.state[STATOR_TWIST][n + 1] = step.clone() * v_dot;
            self.state[STATOR_TWIST_RATE][n + 1] = surface.clone() * (torque.clone() - stator_torque.clone());
            self.state[ROTOR_SPEED][n + 1] = -rotor;
            // J omega_r' = T_r + T_s - 2 T: without the difference of speeds, which would cancel.
            let accelerating = (rotor_torque + stator_torque) - two.clone() * torque;
            self.relative_velocity[n + 1] = surface * accelerating.clone();
            self.friction.extend(n + 1, &accelerating, &share);
            self.state[SLIP][n + 1] = step * self.relative_velocity[n].clone();
        }
        self.stability_margin[0] = damping.clone() + self.stability_margin[0].clone();
        let friction = taylor::product(&self.friction_torque, &self.relative_velocity);
        let [u_dot, v_dot] = [ROTOR_TWIST_RATE, STATOR_TWIST_RATE].map(|component| {
            let rate = &self.state[component];
            taylor::product(rate, rate)
        });
        for n in 0..N - 1 {
            let step = self.unit.clone() * self.reciprocals[n + 1].clone();
            self.state[FRICTION_LOSS][n + 1] = step.clone() * friction[n].clone();
            self.state[DAMPING_LOSS][n + 1] = step * damping.clone() * (u_dot[n].clone() + v_dot[n].clone());
        }
    }

    /// The state at the time `x` times the unit after the start.
    pub fn at(&self, x: &T) -> [T; DIMENSION] {
        std::array::from_fn(|component| taylor::value(&self.state[component], x))
    }
}
