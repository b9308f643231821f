//! Sliding without the fast oscillation, at one instant, to rounding.
//!
//! The fast torsional mode of a brake that has slid undisturbed for long enough is gone: the exact state lies on the slow
//! manifold, where the twists follow the friction torque with all their derivatives. Where that manifold is unstable an
//! integrator leaves it, by its rounding and the growth since. The manifold itself can be computed without integrating:
//! Taylor coefficients in time of u, v and theta' satisfy
//!
//! ```text
//! k_t u = -I theta'' - c_t u'            (equation (2))
//! k_t v = f - c_t v' - J v''             (equation (3), stator surface)
//! (I + J) theta'' = J u'' - f            (rotor and rotor surface together)
//! ```
//!
//! with the interface torque f = s mu(s omega_r) r F_n, and the right-hand sides' derivatives of u and v are small:
//! iterating gains a factor (c_t / k_t)/tau or (J / k_t)/tau^2 each time, 1e-4 for the slow time scale tau of 12 ms.
//!
//! The iteration is a formal expansion, and asymptotic: each round takes two more derivatives. Where friction changes fast,
//! with a [steepness rate](Law::steepness_rate) of some 40 s/rad and more near the stop, it gains a factor of two or less,
//! and in the end it loses. There it is carried on to where its changes are least, with as many coefficients as that takes,
//! and these changes tell the error that is left ([`SlowState::error`]).

use super::Torsion;
use super::state::{DIMENSION, DYNAMIC, TorsionState, index::*};
use super::torsion::TorsionModel;
use super::trains::slow_manifold::{
    ERROR_OF_CHANGE, LONG_ORDER, LONG_ROUNDS, ORDER, PATH_ORDER, PATH_ROUNDS, ROUNDS, SETTLED, STEP_ROUNDS, derivative,
};
use crate::friction::{FrictionSeries, Law, LawSeries};
use crate::numerics::taylor;

/// A state on the slow manifold, as well as it can be had.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlowState {
    /// The state.
    pub state: TorsionState,
    /// How far each component may be from exact sliding without the fast oscillation; of the quadratures zero.
    pub error: TorsionState,
    /// Whether the iteration has come to rounding, so that the error is that.
    pub settled: bool,
}

/// The state on the slow manifold of slip with sense `s` that has the momentum I theta' + J phi_2' of `y`.
///
/// `pressing` is F_n (N) and its rate (N/s), constant as far as the motion looks ahead. The quadratures stay as they
/// are.
pub fn on_slow_manifold(model: &TorsionModel, sense: f64, pressing: (f64, f64), y: &TorsionState) -> SlowState {
    let momentum = model.torsion.slow_momentum(y);
    let with = |slow: &TorsionState| {
        let mut state = *y;
        state[..DYNAMIC].copy_from_slice(&slow[..DYNAMIC]);
        state
    };
    let frequency = model.natural_angular_frequency();
    let rounding = |slow: &TorsionState| -> TorsionState {
        let speed = slow[ROTOR_SPEED].abs();
        std::array::from_fn(|component| match component {
            ROTOR_TWIST | STATOR_TWIST => SETTLED * slow[component].abs().max(speed * f64::EPSILON / frequency),
            ROTOR_TWIST_RATE | STATOR_TWIST_RATE => SETTLED * slow[component].abs().max(speed * f64::EPSILON),
            ROTOR_SPEED => SETTLED * speed,
            _ => 0.0,
        })
    };
    let mut short = SlowSeries::<ORDER>::zero(model);
    let mut before = short.start();
    for _ in 0..ROUNDS {
        before = short.start();
        if short.round(model, sense, pressing, momentum) {
            break;
        }
    }
    let slow = short.start();
    let least = rounding(&slow);
    // The speed lags by a round, and follows the rotor's twist rate.
    let settled = (ROTOR_TWIST..=STATOR_TWIST_RATE).all(|k| (slow[k] - before[k]).abs() <= least[k]);
    if settled {
        return SlowState {
            state: with(&slow),
            error: least,
            settled,
        };
    }
    let (slow, change) = least_change(model, sense, pressing, momentum);
    let least = rounding(&slow);
    let mut error: TorsionState = std::array::from_fn(|k| (ERROR_OF_CHANGE * change[k]).max(least[k]));
    // The momentum is given, so that the speed follows the twist rate.
    error[ROTOR_SPEED] = least[ROTOR_SPEED] + model.torsion.surface_share() * error[ROTOR_TWIST_RATE];
    SlowState {
        state: with(&slow),
        error,
        settled,
    }
}

/// The state after the round where the iteration changes it least, and for each component the larger of the changes by that
/// round and by the one before it: one alone may be small by chance.
fn least_change(model: &TorsionModel, sense: f64, pressing: (f64, f64), momentum: f64) -> (TorsionState, TorsionState) {
    let mut series = SlowSeries::<LONG_ORDER>::zero(model);
    let (mut before, mut last) = ([0.0; DIMENSION], [f64::INFINITY; DIMENSION]);
    let mut best = (before, last, f64::INFINITY);
    for _ in 0..LONG_ROUNDS {
        series.round(model, sense, pressing, momentum);
        let mut state = series.start();
        state[ROTOR_SPEED] = model.torsion.speed_of_momentum(momentum, state[ROTOR_TWIST_RATE]);
        let change: TorsionState = std::array::from_fn(|k| (state[k] - before[k]).abs());
        let both: TorsionState = std::array::from_fn(|k| change[k].max(last[k]));
        let size = model.oscillation(&both);
        if size < best.2 {
            best = (state, both, size);
        }
        (before, last) = (state, change);
        if !change.iter().all(|x| x.is_finite()) {
            break;
        }
    }
    (best.0, best.1)
}

/// The state on the slow manifold that has this [momentum](Torsion::slow_momentum), with quadratures of zero: for a
/// path along it, which asks for thousands, to 1e-8 of the twists where the friction changes over 12 ms.
pub(crate) fn of_momentum(model: &TorsionModel, sense: f64, pressing: (f64, f64), momentum: f64) -> TorsionState {
    SlowSeries::<PATH_ORDER>::of_rounds(model, sense, pressing, momentum, PATH_ROUNDS).start()
}

/// The motion along the slow manifold: N Taylor coefficients by powers of time in s, of which the last two are not to be
/// trusted.
#[derive(Debug, Clone)]
pub(crate) struct SlowSeries<const N: usize> {
    rotor_twist: [f64; N],
    stator_twist: [f64; N],
    rotor_speed: [f64; N],
    /// s omega_r.
    speed: [f64; N],
    friction: FrictionSeries<f64, N>,
    torque: [f64; N],
}

impl<const N: usize> SlowSeries<N> {
    /// Of the slip with sense `sense` that has this [momentum](Torsion::slow_momentum); `pressing` is F_n (N) and its rate (N/s).
    pub fn new(model: &TorsionModel, sense: f64, pressing: (f64, f64), momentum: f64) -> Self {
        Self::of_rounds(model, sense, pressing, momentum, STEP_ROUNDS)
    }

    fn of_rounds(model: &TorsionModel, sense: f64, pressing: (f64, f64), momentum: f64, rounds: usize) -> Self {
        let mut series = Self::zero(model);
        for _ in 0..rounds {
            if series.round(model, sense, pressing, momentum) {
                break;
            }
        }
        series
    }

    fn zero(model: &TorsionModel) -> Self {
        let zeros = [0.0; N];
        SlowSeries {
            rotor_twist: zeros,
            stator_twist: zeros,
            rotor_speed: zeros,
            speed: zeros,
            friction: model.friction.law.series(),
            torque: zeros,
        }
    }

    /// A round of the iteration; whether the rates have settled, which they do last.
    #[inline]
    fn round(&mut self, model: &TorsionModel, sense: f64, pressing: (f64, f64), momentum: f64) -> bool {
        let Torsion {
            rotor_inertia: i,
            surface_inertia: j,
            stiffness: k_t,
            damping: c_t,
        } = model.torsion;
        let SlowSeries {
            rotor_twist: u,
            stator_twist: v,
            rotor_speed: speed,
            speed: x,
            friction,
            torque,
        } = self;
        let (u_dot, v_dot) = (derivative(u), derivative(v));
        let (u_ddot, v_ddot) = (derivative(&u_dot), derivative(&v_dot));
        let factors = friction.factors(1.0, 0.0);
        speed[0] = model.torsion.speed_of_momentum(momentum, u_dot[0]);
        for n in 0..N {
            x[n] = sense * (speed[n] - u_dot[n] - v_dot[n]);
            if n == 0 {
                friction.start(x[0], 1.0);
            } else {
                friction.extend_from(n, x);
            }
            let mu = |n: usize| factors.shape * friction.shape(n) + if n == 0 { factors.constant } else { 0.0 };
            let product = mu(n) * pressing.0 + if n > 0 { mu(n - 1) * pressing.1 } else { 0.0 };
            torque[n] = sense * model.contact.radius * product;
            if n + 1 < N {
                speed[n + 1] = (j * u_ddot[n] - torque[n]) / ((i + j) * (n + 1) as f64);
            }
        }
        let acceleration = derivative(speed);
        let before = (u[1], v[1]);
        for n in 0..N {
            u[n] = (-i * acceleration[n] - c_t * u_dot[n]) / k_t;
            v[n] = (torque[n] - c_t * v_dot[n] - j * v_ddot[n]) / k_t;
        }
        let settled = |old: f64, new: f64| (new - old).abs() <= f64::EPSILON * new.abs();
        settled(before.0, u[1]) && settled(before.1, v[1])
    }

    /// The state where it starts, with quadratures of zero.
    pub fn start(&self) -> TorsionState {
        let mut state = [0.0; DIMENSION];
        state[ROTOR_TWIST] = self.rotor_twist[0];
        state[ROTOR_TWIST_RATE] = self.rotor_twist[1];
        state[STATOR_TWIST] = self.stator_twist[0];
        state[STATOR_TWIST_RATE] = self.stator_twist[1];
        state[ROTOR_SPEED] = self.rotor_speed[0];
        state
    }

    /// The state at `tau` (s) from where it starts, with quadratures of zero.
    pub fn at(&self, tau: f64) -> TorsionState {
        let mut state = [0.0; DIMENSION];
        (state[ROTOR_TWIST], state[ROTOR_TWIST_RATE]) = taylor::value_and_rate(&self.rotor_twist, tau);
        (state[STATOR_TWIST], state[STATOR_TWIST_RATE]) = taylor::value_and_rate(&self.stator_twist, tau);
        state[ROTOR_SPEED] = taylor::value_and_rate(&self.rotor_speed, tau).0;
        state
    }

    /// |omega_r| at `tau` (s) from where it starts, rad/s, and its rate; negative beyond the stop.
    pub fn speed_at(&self, tau: f64) -> (f64, f64) {
        taylor::value_and_rate(&self.speed, tau)
    }

    /// How long the series of |omega_r| holds to this error (rad/s), by the last of its trusted terms, s.
    pub fn reach(&self, error: f64) -> f64 {
        let by_term = |n: usize| (error / self.speed[n].abs()).powf(1.0 / n as f64);
        by_term(N - 4).min(by_term(N - 3))
    }
}
