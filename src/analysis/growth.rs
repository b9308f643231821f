//! How much the unstable sliding before the first stick amplifies a perturbation.

use crate::model::Parameters;
use crate::model::axial::AxialMotion;
use crate::model::slow_manifold::{of_momentum, slow_momentum};
use crate::model::torsion::{DIMENSION, TorsionModel, index::*};
use crate::simulation::{Event, EventKind};
use nalgebra::{Complex, DMatrix};

/// Components of the slip state that carry its dynamics: the twists, their rates and the rotor speed.
const DYNAMIC: usize = 5;

/// Share of the momentum that one step of the smooth path takes before the instability.
const COARSE: f64 = 0.02;

/// The smooth path is followed for this many times what its first friction torque would take to stop it.
const FARTHEST: f64 = 10.0;

/// Steps of the smooth path from the instability to the stop.
const STEPS: f64 = 300.0;

/// A perturbation's growth along the kick-free smooth sliding, in e-folds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// When steady sliding loses stability (zero of the margin on the run's own relative velocity), s.
    pub instability: f64,
    /// Where the smooth sliding itself comes to its stick, s; the run's end if it never does.
    pub smooth_end: f64,
    /// G: integral of max(0, Re lambda) from the instability to `smooth_end`: what a perturbation could gain if nothing
    /// stopped it.
    pub exponent: f64,
    /// The same up to the run's first stick.
    pub to_first_stick: f64,
    /// Integral of Re lambda from the first kick to the run's first stick: what the kick gained.
    pub from_kick: Option<f64>,
    /// By how many e-folds the kicks stand above rounding at the first stick: each with its size, its decay where
    /// sliding was stable, and its growth, against the rounding of the relative velocity at the instability and its
    /// growth. Negative infinity without a kick.
    pub above_noise: f64,
}

impl Growth {
    /// Of a run, from its events; `None` if sliding never lost stability before the first stick.
    ///
    /// lambda is the fast pair of the slip state's Jacobian: of its five eigenvalues that with the largest real part,
    /// the slow root of the rotor excepted.
    pub fn of_run(parameters: &Parameters, events: &[Event], end: f64) -> Option<Growth> {
        let first_stick = events
            .iter()
            .find(|e| e.kind == EventKind::Stick)
            .map_or(end, |e| e.time);
        let unstable = lasting_instability(parameters, events, first_stick)?;
        let kicks: Vec<&Event> = events
            .iter()
            .filter(|e| e.kind == EventKind::Kick && e.time < first_stick)
            .collect();
        // The path starts at the first kick, if from there to the loss of stability nothing turns the sense of sliding.
        let last_turn = events
            .iter()
            .take_while(|e| e.time < unstable.time)
            .filter(|e| e.before.relative_velocity * unstable.before.relative_velocity <= 0.0)
            .map(|e| e.time)
            .fold(f64::NEG_INFINITY, f64::max);
        let start = kicks
            .iter()
            .find(|k| k.time > last_turn && k.time < unstable.time)
            .unwrap_or(&unstable);
        let rates = growth_rates(parameters, start, unstable, end);
        let positive = |rate: f64| rate.max(0.0);
        let to_first_stick = integrate(&rates, unstable.time, first_stick, positive);
        // A kick from before the last turn is part of what the turn left behind, long damped.
        let gained = |kick: &Event| {
            if kick.time > last_turn {
                integrate(&rates, kick.time, first_stick, |rate| rate)
            } else {
                f64::NEG_INFINITY
            }
        };
        let noise = (f64::EPSILON * unstable.before.relative_velocity.abs()).ln() + to_first_stick;
        let above_noise = |kick: &Event| {
            let size = (kick.after.relative_velocity - kick.before.relative_velocity).abs();
            size.ln() + gained(kick) - noise
        };
        Some(Growth {
            instability: unstable.time,
            smooth_end: rates.last().map_or(start.time, |r| r.0),
            exponent: integrate(&rates, unstable.time, f64::INFINITY, positive),
            to_first_stick,
            from_kick: kicks.first().map(|k| gained(k)).filter(|g| g.is_finite()),
            above_noise: kicks.iter().map(|k| above_noise(k)).fold(f64::NEG_INFINITY, f64::max),
        })
    }
}

/// The loss of stability after which sliding stays unstable: the first, unless stability returns for longer than the
/// oscillation itself takes it across the margin, as after a large kick.
fn lasting_instability<'a>(parameters: &Parameters, events: &'a [Event], first_stick: f64) -> Option<&'a Event> {
    let lasting = 20.0 * TorsionModel::new(parameters).natural_period();
    let mut unstable: Option<&Event> = None;
    let mut stable_since = f64::NEG_INFINITY;
    for event in events.iter().take_while(|e| e.time <= first_stick) {
        match event.kind {
            EventKind::Destabilised if unstable.is_none() || event.time - stable_since > lasting => {
                unstable = Some(event);
            }
            EventKind::Restabilised => stable_since = event.time,
            _ => {}
        }
    }
    unstable
}

/// Trapezoidal integral of f(rate) between two times, as far as the rates reach.
fn integrate(rates: &[(f64, f64)], from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    rates
        .windows(2)
        .map(|pair| {
            let ((a, rate_a), (b, rate_b)) = (pair[0], pair[1]);
            let (start, end) = (a.max(from), b.min(to));
            if start >= end {
                return 0.0;
            }
            let rate = |t: f64| rate_a + (rate_b - rate_a) * (t - a) / (b - a);
            0.5 * (f(rate(start)) + f(rate(end))) * (end - start)
        })
        .sum()
}

/// (t, Re lambda) along the smooth sliding from the state before `start` until it stops, be that beyond the run's `end`.
///
/// Smooth sliding is the motion on the slow manifold, on which the momentum of rotor and rotor surface is the one
/// variable and falls by the friction torque. No solver of the full equations stays on it where it is unstable.
fn growth_rates(parameters: &Parameters, start: &Event, unstable: &Event, end: f64) -> Vec<(f64, f64)> {
    let (from, start) = (&start.before, start.time);
    let instability = unstable.time;
    let torsion = TorsionModel::new(parameters);
    let axial = AxialMotion::new(&parameters.axial, &parameters.actuation);
    let sense = unstable.before.relative_velocity.signum();
    let mut y = [0.0; DIMENSION];
    y[ROTOR_TWIST_RATE] = from.rotor_twist_rate;
    y[ROTOR_SPEED] = from.theta_dot;
    let pressing = |t: f64| {
        let axial = axial.at(t);
        (axial.pressing_force.max(0.0), axial.pressing_rate)
    };
    let state = |t: f64, momentum: f64| of_momentum(&torsion, sense, pressing(t), momentum);
    let torque = |t: f64, momentum: f64| torsion.sliding_torque(sense, &state(t, momentum), pressing(t).0);
    let speed = |t: f64, momentum: f64| sense * torsion.relative_velocity(&state(t, momentum));
    let rate = |t: f64, x: f64| (t, fast_growth_rate(&torsion, &axial, sense, t, x.max(0.0)));
    let (mut t, mut momentum) = (start, slow_momentum(&torsion, &y));
    let mut x = speed(t, momentum);
    let mut rates = vec![rate(t, x)];
    let least = 1e-3 * momentum.abs();
    let mut finest = None;
    // Far enough for the stop, if friction goes on as it begins; else the end of the run.
    let first = torque(start, momentum).abs();
    let end = if first > 0.0 {
        end.max(start + FARTHEST * momentum.abs() / first)
    } else {
        end
    };
    let longest = (end - start) / STEPS;
    while t < end && x > 0.0 {
        let k1 = torque(t, momentum);
        // Coarse where sliding is stable, and evenly down to the stop from the instability on.
        let fall = if t < instability {
            COARSE * momentum.abs().max(least)
        } else {
            *finest.get_or_insert(momentum.abs() / STEPS)
        };
        let step = (fall / k1.abs()).min(longest).min(end - t);
        if t + step <= t {
            break;
        }
        let k2 = torque(t + step / 2.0, momentum - step / 2.0 * k1);
        let k3 = torque(t + step / 2.0, momentum - step / 2.0 * k2);
        let k4 = torque(t + step, momentum - step * k3);
        momentum -= step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0;
        let next = speed(t + step, momentum);
        // The last step ends at the stop.
        let part = if next < 0.0 { x / (x - next) } else { 1.0 };
        t += part * step;
        x = next.max(0.0);
        rates.push(rate(t, x));
    }
    rates
}

/// The largest real part among the fast eigenvalues of the slip state's Jacobian at `t` and |omega_r| = `x`, 1/s.
pub fn fast_growth_rate(torsion: &TorsionModel, axial: &AxialMotion, sense: f64, t: f64, x: f64) -> f64 {
    fast_eigenvalues(torsion, axial, sense, t, x)
        .iter()
        .map(|l| l.re)
        .fold(f64::NEG_INFINITY, f64::max)
}

/// The eigenvalues of the slip state's Jacobian but the slow root of the rotor, 1/s. Of the state the Jacobian depends
/// on the relative velocity alone.
pub fn fast_eigenvalues(torsion: &TorsionModel, axial: &AxialMotion, sense: f64, t: f64, x: f64) -> Vec<Complex<f64>> {
    let mut y = [0.0; DIMENSION];
    y[ROTOR_SPEED] = sense * x;
    let mut full = DMatrix::zeros(DIMENSION, DIMENSION);
    torsion.slip_jacobian(sense, axial.pressing_force(t).max(0.0), &y, &mut full.as_view_mut());
    // Twists scaled to the size of their rates: the eigenvalues stay, their rounding shrinks.
    let omega = torsion.natural_angular_frequency();
    let scale = |k: usize| {
        if k == ROTOR_TWIST || k == STATOR_TWIST {
            omega
        } else {
            1.0
        }
    };
    let jacobian = DMatrix::from_fn(DYNAMIC, DYNAMIC, |i, j| full[(i, j)] * scale(i) / scale(j));
    let mut eigenvalues: Vec<_> = jacobian.complex_eigenvalues().iter().copied().collect();
    eigenvalues.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    eigenvalues.truncate(DYNAMIC - 1);
    eigenvalues
}
