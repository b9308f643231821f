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

use super::Torsion;
use super::torsion::{DIMENSION, TorsionModel, TorsionState, index::*};

/// Taylor coefficients that are kept.
const ORDER: usize = 14;

/// Most rounds of the iteration; five reach rounding at tau = 12 ms.
const ROUNDS: usize = 8;

type Series = [f64; ORDER];

/// Coefficients of the derivative; what would come from beyond the order is left out.
fn derivative(series: &Series) -> Series {
    std::array::from_fn(|n| {
        if n + 1 < ORDER {
            (n + 1) as f64 * series[n + 1]
        } else {
            0.0
        }
    })
}

/// The state on the slow manifold of slip with sense `s` that has the momentum I theta' + J phi_2' of `y`.
///
/// `pressing` is F_n (N) and its rate (N/s), constant as far as the motion looks ahead. The quadratures stay as they
/// are.
pub fn on_slow_manifold(model: &TorsionModel, sense: f64, pressing: (f64, f64), y: &TorsionState) -> TorsionState {
    let slow = of_momentum(model, sense, pressing, slow_momentum(model, y));
    let mut state = *y;
    for component in [
        ROTOR_TWIST,
        ROTOR_TWIST_RATE,
        STATOR_TWIST,
        STATOR_TWIST_RATE,
        ROTOR_SPEED,
    ] {
        state[component] = slow[component];
    }
    state
}

/// I theta' + J phi_2', N m s. In slip its rate is exactly -f: the one slow variable.
pub fn slow_momentum(model: &TorsionModel, y: &[f64]) -> f64 {
    let Torsion {
        rotor_inertia: i,
        surface_inertia: j,
        ..
    } = model.torsion;
    i * y[ROTOR_SPEED] + j * (y[ROTOR_SPEED] - y[ROTOR_TWIST_RATE])
}

/// The state on the slow manifold that has this [`slow_momentum`], with quadratures of zero.
pub fn of_momentum(model: &TorsionModel, sense: f64, pressing: (f64, f64), momentum: f64) -> TorsionState {
    let Torsion {
        rotor_inertia: i,
        surface_inertia: j,
        stiffness: k_t,
        damping: c_t,
    } = model.torsion;
    let friction = &model.friction;
    let (weakening, alpha) = (friction.low_speed - friction.high_speed, friction.decay);
    let (mut u, mut v): (Series, Series) = ([0.0; ORDER], [0.0; ORDER]);
    let mut speed: Series = [0.0; ORDER];
    for _ in 0..ROUNDS {
        let (u_dot, v_dot) = (derivative(&u), derivative(&v));
        let (u_ddot, v_ddot) = (derivative(&u_dot), derivative(&v_dot));
        speed[0] = (momentum + j * u_dot[0]) / (i + j);
        let (mut x, mut exponential, mut torque): (Series, Series, Series) = ([0.0; ORDER], [0.0; ORDER], [0.0; ORDER]);
        for n in 0..ORDER {
            x[n] = sense * (speed[n] - u_dot[n] - v_dot[n]);
            exponential[n] = if n == 0 {
                (-alpha * x[0]).exp()
            } else {
                (1..=n)
                    .map(|k| -alpha * k as f64 * x[k] * exponential[n - k])
                    .sum::<f64>()
                    / n as f64
            };
            let mu = |n: usize| weakening * exponential[n] + if n == 0 { friction.high_speed } else { 0.0 };
            let product = mu(n) * pressing.0 + if n > 0 { mu(n - 1) * pressing.1 } else { 0.0 };
            torque[n] = sense * model.contact.radius * product;
            if n + 1 < ORDER {
                speed[n + 1] = (j * u_ddot[n] - torque[n]) / ((i + j) * (n + 1) as f64);
            }
        }
        let acceleration = derivative(&speed);
        let before = (u[1], v[1]);
        for n in 0..ORDER {
            u[n] = (-i * acceleration[n] - c_t * u_dot[n]) / k_t;
            v[n] = (torque[n] - c_t * v_dot[n] - j * v_ddot[n]) / k_t;
        }
        // The rates settle last.
        let settled = |old: f64, new: f64| (new - old).abs() <= f64::EPSILON * new.abs();
        if settled(before.0, u[1]) && settled(before.1, v[1]) {
            break;
        }
    }
    let mut state = [0.0; DIMENSION];
    state[ROTOR_TWIST] = u[0];
    state[ROTOR_TWIST_RATE] = u[1];
    state[STATOR_TWIST] = v[0];
    state[STATOR_TWIST_RATE] = v[1];
    state[ROTOR_SPEED] = speed[0];
    state
}
