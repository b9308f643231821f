//! How much the unstable sliding before the first stick amplifies a perturbation.

use super::smooth_sliding::SmoothSliding;
use crate::model::Parameters;
use crate::model::stability::Forecast;
use crate::model::torsion::TorsionModel;
use crate::record::{Event, EventDigest};

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
    pub(crate) fn of_digest(parameters: &Parameters, digest: &EventDigest, end: f64) -> Option<Growth> {
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
        let axial = parameters.axial_motion();
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
    let axial = parameters.axial_motion();
    let speed = parameters.initial.speed;
    let Some(lost) = Forecast::new(&torsion, &axial, 0.0, speed, end).instability else {
        return Some(0.0);
    };
    let rest = axial.silent_from(axial.force.corners().last().unwrap_or(0.0));
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
