//! How much the unstable sliding before the first stick amplifies a perturbation.

use super::smooth_sliding::Slowing;
use crate::friction::Law;
use crate::model::stability::{FastModes, Forecast};
use crate::model::system::System;
use crate::record::{Event, EventDigest};
use crate::simulation::natural_period;

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

/// Growth to the first stick, in e-folds, from which a run belongs to its rounding. ln(2^53) = 36.7 lift the rounding of
/// a double to the size of the sliding speed; a perturbation that takes 25 begins 1e5 times above that rounding, which
/// leaves what it starts some five digits.
const NOISE_E_FOLDS: f64 = 25.0;

impl Growth {
    /// Whether rounding grows so far up to the first stick that it decides when that comes.
    pub(in crate::analysis) fn amplifies_rounding(&self) -> bool {
        self.to_first_stick > NOISE_E_FOLDS
    }

    /// Of a run, from its events; `None` if sliding does not slow down by itself, or never lost stability before the first stick.
    ///
    /// lambda is the least damped fast mode of the slip: of the eigenvalues of its Jacobian that with the largest real part, the slow
    /// root of the free train excepted.
    pub fn of_run(trains: &System, events: &[Event], end: f64) -> Option<Growth> {
        Growth::of_digest(trains, &EventDigest::of_events(natural_period(trains), events), end)
    }

    /// The same from what a run keeps of its events.
    pub(crate) fn of_digest(trains: &System, digest: &EventDigest, end: f64) -> Option<Growth> {
        let first_stick = digest.cycles.onset_time.unwrap_or(end);
        let unstable = digest.instability.as_ref()?;
        let kicks = || digest.kicks.iter().filter(|kick| kick.time < first_stick);
        // What a kick leaves behind where the sense turns after it is long damped.
        let last_turn = digest.last_turn;
        let earliest = kicks()
            .map(|kick| kick.time)
            .filter(|t| *t > last_turn)
            .fold(unstable.time, f64::min);
        let sliding = Slowing::new(trains)?;
        let path = sliding.path(unstable.before.relative_velocity.signum());
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
pub fn foreseen_exponent(trains: &System, end: f64) -> Option<f64> {
    let sliding = Slowing::new(trains)?;
    let Slowing { system, excitation, .. } = &sliding;
    let resistance = system.twice_resistance.unwrap_or(0.0);
    let first = |speeds: &[f64]| speeds.first().copied().unwrap_or(0.0);
    let speed = first(&trains.initial.rotor_speed) - first(&trains.initial.stator_speed);
    let mut modes = FastModes::new(system, resistance);
    let (force, corner) = (|t| excitation.smooth_force(t), |t| excitation.next_corner(t));
    let forecast = Forecast::of_slip(system, &mut modes, force, corner, (0.0, speed), end)?;
    let Some(lost) = forecast.instability else {
        return Some(0.0);
    };
    let rest = excitation.silent_from(excitation.corners().last().copied().unwrap_or(0.0));
    // What the forecast leaves out shifts it by J/I.
    if lost * (1.0 - EARLIER) < rest {
        return None;
    }
    let critical = system
        .law
        .damping_zeros(resistance, system.slope_weight(sliding.force(lost)));
    let Some(&critical) = critical.first() else {
        return Some(0.0);
    };
    let path = sliding.path(speed.signum());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource, Override};
    use crate::record::MemoryRecorder;
    use crate::run::Run;

    /// A kick turns the slip against its rotor, and there it loses its stability. Smooth sliding with that sense does not
    /// exist, and its path has no length; followed all the same, it was one of NaN.
    #[test]
    fn regression_growth_where_a_kick_turns_the_slip() {
        let changes = [
            "axial.mass=5.540203543435869",
            "axial.stiffness=441101935.4355345",
            "axial.damping=49242.97470294818",
            "torsion.surface_inertia=0.7436364960809474",
            "torsion.rotor_inertia=81.78984040117506",
            "torsion.stiffness=986609.1472740709",
            "torsion.damping=69.54924980074699",
            "friction.breakaway=0.8181204716362555",
            "friction.low_speed=0.8181204716362555",
            "friction.high_speed=0.7296425720203465",
            "friction.decay=134.9667145864564",
            "initial.speed=90.82619909031959",
            "actuation={profile=\"ramp\",force=156.84880099552018,rise_time=12.059132431217796}",
            "perturbation=[{kind=\"kick\",time=19.904894134713516,relative_velocity=64.36110248123921},\
             {kind=\"kick\",time=17.188076480014825,relative_velocity=-114.30165801443698},\
             {kind=\"kick\",time=2.1635393315026006,relative_velocity=-5.333492895183853}]",
            "output.window=[]",
            "output.around=none",
            "output.interval=10",
            "output.end_time=21.81964290642463",
            "solver.method=series",
        ];
        let overrides = changes.map(|change| Override::parse(change).unwrap());
        let case = Case::read(&CaseSource::built_in("paper-si").unwrap(), &overrides).unwrap();
        let mut recorder = MemoryRecorder::default();
        Run::new(&case).record(&mut recorder).start().unwrap();
        let trains = case.system.clone();
        let growth = Growth::of_run(&trains, &recorder.events, case.output.end_time);
        let growth = growth.expect("stability is lost");
        assert_eq!((growth.exponent, growth.smooth_end), (0.0, growth.instability));
    }
}
