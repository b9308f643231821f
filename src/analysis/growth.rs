//! How much the unstable sliding before the first stick amplifies a perturbation.

use crate::model::Parameters;
use crate::model::axial::AxialMotion;
use crate::model::torsion::{DIMENSION, TorsionModel, index::*};
use crate::simulation::{Event, EventKind};
use nalgebra::{Complex, DMatrix};

/// Components of the slip state that carry its dynamics: the twists, their rates and the rotor speed.
const DYNAMIC: usize = 5;

/// Steps of the smooth path from its start to the stop.
const STEPS: f64 = 500.0;

/// A perturbation's growth along the kick-free smooth sliding, in e-folds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// When steady sliding loses stability (zero of the margin on the run's own relative velocity), s.
    pub instability: f64,
    /// Where the smooth sliding itself comes to its stick, or the run ends, s.
    pub smooth_end: f64,
    /// G: integral of max(0, Re lambda) from the instability to `smooth_end`: what a perturbation could gain if nothing
    /// stopped it.
    pub exponent: f64,
    /// The same up to the run's first stick.
    pub to_first_stick: f64,
    /// Integral of Re lambda from the first kick to the run's first stick: what the kick gained.
    pub from_kick: Option<f64>,
    /// What noise has gained before the first kick.
    pub before_kick: Option<f64>,
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
        let unstable = events
            .iter()
            .find(|e| e.kind == EventKind::Destabilised && e.time <= first_stick)?;
        let kick = events
            .iter()
            .find(|e| e.kind == EventKind::Kick && e.time < first_stick);
        let start = kick.filter(|k| k.time < unstable.time).unwrap_or(unstable);
        let rates = growth_rates(parameters, start.time, start.before.relative_velocity, end);
        let positive = |rate: f64| rate.max(0.0);
        Some(Growth {
            instability: unstable.time,
            smooth_end: rates.last().map_or(start.time, |r| r.0),
            exponent: integrate(&rates, unstable.time, end, positive),
            to_first_stick: integrate(&rates, unstable.time, first_stick, positive),
            from_kick: kick.map(|k| integrate(&rates, k.time, first_stick, |rate| rate)),
            before_kick: kick.map(|k| integrate(&rates, unstable.time, k.time, positive)),
        })
    }
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

/// (t, Re lambda) along the smooth sliding from relative velocity `w` at `start` until it stops, `end` at the latest.
///
/// Smooth sliding is the motion without the fast oscillation: rotor and rotor surface as one inertia, and twists that
/// follow the friction torque, u' = v' = f'/k_t. What that leaves out is of the order (omega_n times the slow time
/// scale)^-2, 1e-5 in the paper's case; no solver of the full equations stays on this motion where it is unstable.
fn growth_rates(parameters: &Parameters, start: f64, w: f64, end: f64) -> Vec<(f64, f64)> {
    let torsion = TorsionModel::new(parameters);
    let axial = AxialMotion::new(&parameters.axial, &parameters.actuation);
    let sense = w.signum();
    let inertia = parameters.torsion.rotor_inertia + parameters.torsion.surface_inertia;
    // -d|omega_r|/dt
    let slowing = |t: f64, x: f64| {
        let (mu, slope) = parameters.friction.coefficient_and_slope(x);
        let r_fn = parameters.contact.radius * axial.pressing_force(t).max(0.0);
        mu * r_fn / inertia / (1.0 + 2.0 * slope * r_fn / parameters.torsion.stiffness)
    };
    let rate = |t: f64, x: f64| fast_growth_rate(&torsion, &axial, sense, t, x);
    let (mut t, mut x) = (start, w.abs());
    let mut rates = vec![(t, rate(t, x))];
    let fall = x / STEPS;
    let longest = (end - start) / STEPS;
    while t < end && x > 0.0 {
        let step = (fall / slowing(t, x)).min(longest).min(end - t);
        let k1 = slowing(t, x);
        let k2 = slowing(t + step / 2.0, x - step / 2.0 * k1);
        let k3 = slowing(t + step / 2.0, x - step / 2.0 * k2);
        let k4 = slowing(t + step, x - step * k3);
        let mean = (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0;
        // the last step ends at the stop
        let part = (x / (step * mean)).min(1.0);
        x -= part * step * mean;
        t += part * step;
        if part < 1.0 || t + step <= t {
            rates.push((t, rate(t, x.max(0.0))));
            break;
        }
        rates.push((t, rate(t, x)));
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
