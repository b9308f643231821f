//! How much the unstable sliding before the first stick amplifies a perturbation.

use super::eigenvalues::{eigenvalues, leading_block};
use super::smooth_sliding::SmoothSliding;
use crate::model::axial::AxialMotion;
use crate::model::stability::Forecast;
use crate::model::torsion::index::*;
use crate::model::torsion::{DIMENSION, DYNAMIC, TorsionModel};
use crate::model::{Parameters, Torsion};
use crate::record::{Event, EventDigest};
use nalgebra::{Complex, DMatrix};

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
    /// Integral of Re lambda from the kick to the run's first stick: what the kick gained, or lost where sliding was
    /// stable. Of several kicks, that which is largest at the first stick; `None` without a kick that changes anything.
    pub from_kick: Option<f64>,
    /// By how many e-folds that kick stands above rounding at the first stick: its size, its decay where sliding was
    /// stable, and its growth, against the rounding of the relative velocity at the instability and its growth.
    /// Negative: it has died out.
    pub above_noise: Option<f64>,
}

impl Growth {
    /// Of a run, from its events; `None` if sliding never lost stability before the first stick.
    ///
    /// lambda is the fast pair of the slip state's Jacobian: of its five eigenvalues that with the largest real part,
    /// the slow root of the rotor excepted.
    pub fn of_run(parameters: &Parameters, events: &[Event], end: f64) -> Option<Growth> {
        Growth::of_digest(parameters, &EventDigest::of_events(parameters, events), end)
    }

    /// The same from what a run keeps of its events.
    pub fn of_digest(parameters: &Parameters, digest: &EventDigest, end: f64) -> Option<Growth> {
        let first_stick = digest.cycles.onset_time.unwrap_or(end);
        let unstable = digest.instability.as_ref()?;
        let kicks = || digest.kicks.iter().filter(|kick| kick.time < first_stick);
        // What a kick leaves behind where the sense turns after it is long damped.
        let last_turn = digest.last_turn;
        let earliest = kicks()
            .map(|kick| kick.time)
            .filter(|t| *t > last_turn)
            .fold(unstable.time, f64::min);
        let torsion = TorsionModel::new(parameters);
        let axial = AxialMotion::new(&parameters.axial, &parameters.actuation);
        let path = SmoothSliding {
            torsion: &torsion,
            axial: &axial,
            sense: unstable.before.relative_velocity.signum(),
        };
        // From the instability, where sliding is known to be smooth, both ways.
        let start = path.point(unstable.time, &unstable.before);
        let speed = unstable.before.relative_velocity.abs();
        let mut rates = path.rates_before(start, speed, earliest);
        rates.reverse();
        rates.append(&mut path.rates_to_stop(start, speed, end));
        let positive = |rate: f64| rate.max(0.0);
        let to_first_stick = integrate(&rates, unstable.time, first_stick, positive);
        let gained = |kick: &Event| {
            if kick.time > last_turn {
                integrate(&rates, kick.time, first_stick, |rate| rate)
            } else {
                f64::NEG_INFINITY
            }
        };
        let noise = (f64::EPSILON * unstable.before.relative_velocity.abs()).ln() + to_first_stick;
        // The kick that counts is the one that is largest at the first stick.
        let strongest = kicks()
            .map(|kick| {
                let size = (kick.after.relative_velocity - kick.before.relative_velocity).abs();
                let gained = gained(kick);
                (gained, size.ln() + gained - noise)
            })
            .filter(|(_, above)| above.is_finite())
            .max_by(|a, b| a.1.total_cmp(&b.1));
        Some(Growth {
            instability: unstable.time,
            smooth_end: rates.last().map_or(unstable.time, |r| r.0),
            exponent: integrate(&rates, unstable.time, f64::INFINITY, positive),
            to_first_stick,
            from_kick: strongest.map(|s| s.0),
            above_noise: strongest.map(|s| s.1),
        })
    }
}

/// [`Growth::exponent`] without a run, for sliding that begins at t = 0 and loses its stability when the force has come to
/// rest: of smooth sliding from the speed at which the margin is zero. It is 0 where stability is not lost by `end` (s),
/// and `None` where the force still changes when it is.
pub fn foreseen_exponent(parameters: &Parameters, end: f64) -> Option<f64> {
    let torsion = TorsionModel::new(parameters);
    let axial = AxialMotion::new(&parameters.axial, &parameters.actuation);
    let speed = parameters.initial.speed;
    let Some(lost) = Forecast::new(&torsion, &axial, 0.0, speed, end).instability else {
        return Some(0.0);
    };
    let rest = axial.silent_from(axial.corners().last().unwrap_or(0.0));
    // What the forecast leaves out shifts it by J/I.
    if lost * (1.0 - EARLIER) < rest {
        return None;
    }
    let Some(critical) = torsion.critical_speed(axial.pressing_force(lost)) else {
        return Some(0.0);
    };
    let path = SmoothSliding {
        torsion: &torsion,
        axial: &axial,
        sense: speed.signum(),
    };
    let start = path.point_of_speed(lost, critical);
    let rates = path.rates_to_stop(start, critical, lost);
    Some(integrate(&rates, lost, f64::INFINITY, |rate| rate.max(0.0)))
}

/// Share of the time until stability is lost by which that may come earlier than foreseen.
const EARLIER: f64 = 0.02;

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
        // `sum` of nothing is -0, which is printed with its sign.
        .fold(0.0, |sum, part| sum + part)
}

/// The largest real part among the fast eigenvalues of the slip state's Jacobian at `t` and |omega_r| = `x`, 1/s.
///
/// From the characteristic polynomial where its root is known well enough to start from, else from all eigenvalues.
pub fn fast_growth_rate(torsion: &TorsionModel, axial: &AxialMotion, sense: f64, t: f64, x: f64) -> f64 {
    let force = axial.pressing_force(t).max(0.0);
    relative_root(torsion, torsion.stability_margin(1.0, x, force)).unwrap_or_else(|| {
        let eigenvalues = fast_eigenvalues(torsion, axial, sense, t, x);
        eigenvalues.iter().map(|l| l.re).fold(f64::NEG_INFINITY, f64::max)
    })
}

/// Share of c_t that friction must have taken from the margin for the relative mode to be less damped than the other
/// one, whatever the rotor does to both: its share is J/I.
const APART: f64 = 0.1;

/// Rounds of Newton's method: six are usual.
const MOST_ROUNDS: usize = 20;

/// The real part of the fast root that belongs to the relative mode, 1/s, for a stability margin of steady sliding
/// (N m s/rad); `None` where another may be larger, or Newton's method does not settle.
///
/// With h = (c_t - margin)/2, the slope of the friction torque, a root satisfies
/// J lambda D_u D_v = h ((lambda^2 + (k_t + c_t lambda)/I) D_v + lambda^2 D_u), where
/// D_v = lambda^2 + (k_t + c_t lambda)/J and D_u = D_v + (k_t + c_t lambda)/I. With the rotor at rest the roots are those
/// of J lambda^2 + margin lambda + k_t.
fn relative_root(torsion: &TorsionModel, margin: f64) -> Option<f64> {
    let Torsion {
        rotor_inertia: i,
        surface_inertia: j,
        stiffness,
        damping,
    } = torsion.torsion;
    let slope = 0.5 * (damping - margin);
    // Where the other mode is overdamped its slower root is the larger one while the relative mode is stable.
    let overdamped = damping * damping > 2.0 * stiffness * j;
    if slope <= APART * damping || i <= j || (margin > 0.0 && overdamped) {
        return None;
    }
    let (mean, omega) = (-0.5 * margin / j, torsion.natural_angular_frequency());
    let split = mean * mean - omega * omega;
    let mut root = match split {
        s if s < 0.0 => Complex::new(mean, (-s).sqrt()),
        // Two real roots: without growth the slower one decides, and the other mode's may be slower still.
        s if mean > 0.0 => Complex::new(mean + s.sqrt(), 0.0),
        _ => return None,
    };
    for _ in 0..MOST_ROUNDS {
        let square = root * root;
        let spring = root * damping + stiffness;
        let (d_v, d_u) = (square + spring / j, square + spring * (1.0 / i + 1.0 / j));
        let (d_v_rate, d_u_rate) = (root * 2.0 + damping / j, root * 2.0 + damping * (1.0 / i + 1.0 / j));
        let (driven, driven_rate) = (square + spring / i, root * 2.0 + damping / i);
        let value = root * d_u * d_v * j - (driven * d_v + square * d_u) * slope;
        let rate = (d_u * d_v + root * (d_u_rate * d_v + d_u * d_v_rate)) * j
            - (driven_rate * d_v + driven * d_v_rate + root * 2.0 * d_u + square * d_u_rate) * slope;
        let change = value / rate;
        root -= change;
        if change.norm() <= 1e-13 * root.norm() {
            return Some(root.re);
        }
    }
    None
}

/// The eigenvalues of the slip state's Jacobian but the slow root of the rotor, 1/s. Of the state the Jacobian depends
/// on the relative velocity alone.
pub fn fast_eigenvalues(torsion: &TorsionModel, axial: &AxialMotion, sense: f64, t: f64, x: f64) -> Vec<Complex<f64>> {
    let mut y = [0.0; DIMENSION];
    y[ROTOR_SPEED] = sense * x;
    let mut full = DMatrix::zeros(DIMENSION, DIMENSION);
    torsion.slip_jacobian(sense, axial.pressing_force(t).max(0.0), &y, &mut full.as_view_mut());
    let mut eigenvalues = eigenvalues(&leading_block(&full, DYNAMIC, torsion));
    eigenvalues.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    eigenvalues.truncate(DYNAMIC - 1);
    eigenvalues
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource, Override};

    /// The polynomial's root against the eigenvalues of the matrix, over the plane of the critical curve and all speeds at
    /// which friction takes something from the margin. Both round at 1e-14 of omega_n; near a double root by its square
    /// root.
    #[test]
    fn analytic_the_growth_rate_is_that_of_all_eigenvalues() {
        let source = CaseSource::built_in("paper").unwrap();
        let mut by_polynomial = 0;
        for decay in [0.1, 1.0, 5.0, 40.0, 200.0, 600.0] {
            for damping in [0.0, 2.0, 20.0, 300.0, 3000.0] {
                let set = |key: &str, value: f64| Override::parse(&format!("{key}={value}")).unwrap();
                let case = Case::parse(
                    &source,
                    &[set("friction.decay", decay), set("torsion.damping", damping)],
                )
                .unwrap();
                let torsion = TorsionModel::new(&case.parameters);
                let axial = AxialMotion::new(&case.parameters.axial, &case.parameters.actuation);
                let omega = torsion.natural_angular_frequency();
                for step in 0..60 {
                    let x = 0.1 * f64::from(step) / decay;
                    let margin = torsion.stability_margin(1.0, x, axial.pressing_force(5.0));
                    let all = fast_eigenvalues(&torsion, &axial, 1.0, 5.0, x);
                    let expected = all.iter().map(|l| l.re).fold(f64::NEG_INFINITY, f64::max);
                    let found = fast_growth_rate(&torsion, &axial, 1.0, 5.0, x);
                    by_polynomial += u32::from(relative_root(&torsion, margin).is_some());
                    let scale = omega.max(margin.abs() / torsion.torsion.surface_inertia);
                    assert!(
                        (found - expected).abs() < 1e-7 * scale,
                        "{decay} {damping} {x}: {found} {expected}"
                    );
                }
            }
        }
        assert!(by_polynomial > 1000, "{by_polynomial}");
    }
}
