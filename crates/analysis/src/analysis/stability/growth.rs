//! Amplification of a perturbation by unstable sliding before the first stick, and the onset over the tolerance.

use super::sliding_path::Slowing;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};
use stickslip_engine::Error;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{Method, OutputOptions, RunReport, SolverOptions, natural_period};
use stickslip_engine::workers::over_processors;
use stickslip_system::friction::Law;
use stickslip_system::model::stability::{FastModes, Forecast};
use stickslip_system::model::system::{Kick, KickSide, System};
use stickslip_system::model::{KickTime, Mode};
use stickslip_system::record::{Event, EventDigest, EventKind, Recorder, RecorderError, Sample};
use stickslip_system::watch::Watch;

/// Growth of a perturbation along smooth sliding without a kick, in e-folds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// Loss of stability of steady sliding: zero of the margin at the run's relative velocity, s.
    pub instability: f64,
    /// End of smooth sliding in a stick, s; without a stick, the end of the run.
    pub smooth_end: f64,
    /// G: integral of max(0, Re lambda) from the instability to `smooth_end`, the largest possible gain.
    pub exponent: f64,
    /// Integral of max(0, Re lambda) from the instability to the run's first stick.
    pub to_first_stick: f64,
    /// Integral of Re lambda from the kick to the run's first stick: a gain, or a loss in stable sliding. The kick
    /// with the largest effect at the first stick counts; `None` without an effective kick.
    pub from_kick: Option<f64>,
    /// ln(effect of that kick / effect of rounding) at the first stick. The kick's effect includes its size, its decay
    /// in stable sliding and its growth; rounding is that of the relative velocity at the instability, with its
    /// growth. Negative: the kick has decayed below rounding.
    pub above_noise: Option<f64>,
}

/// Growth to the first stick, in e-folds, from which rounding determines the run. ln(2^53) = 36.7 e-folds raise a
/// double's rounding to the sliding speed. A perturbation that needs 25 starts 1e5 times above rounding, so five
/// digits are left.
const NOISE_E_FOLDS: f64 = 25.0;

impl Growth {
    pub(in crate::analysis) fn amplifies_rounding(&self) -> bool {
        self.to_first_stick > NOISE_E_FOLDS
    }

    /// Growth in a run, from its events; `None` if sliding does not slow down by itself, or is stable to the first stick.
    ///
    /// lambda is the least damped fast mode of the slip: the eigenvalue of its Jacobian with the largest real part,
    /// without the slow root of the free train.
    pub fn of_run(trains: &System, events: &[Event], end: f64) -> Option<Growth> {
        Growth::of_digest(trains, &EventDigest::of_events(natural_period(trains), events), end)
    }

    pub(crate) fn of_digest(trains: &System, digest: &EventDigest, end: f64) -> Option<Growth> {
        let first_stick = digest.cycles.onset_time.unwrap_or(end);
        let unstable = digest.instability.as_ref()?;
        let kicks = || digest.kicks.iter().filter(|kick| kick.time < first_stick);
        // A kick before a later reversal has been damped.
        let last_turn = digest.last_turn;
        let earliest = kicks()
            .map(|kick| kick.time)
            .filter(|t| *t > last_turn)
            .fold(unstable.time, f64::min);
        let sliding = Slowing::new(trains)?;
        let path = sliding.path(unstable.before.relative_velocity.signum());
        // Sliding is smooth on both sides of the instability.
        let start = path.point(unstable.time, &unstable.before);
        let speed = unstable.before.relative_velocity.abs();
        let mut rates = Vec::new();
        path.steps(&mut rates, start, speed, earliest);
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

/// [`Growth::exponent`] without a run: for smooth sliding from t = 0 that loses stability under constant force, at the
/// speed of zero margin. 0 if sliding stays stable until `end` (s); `None` if the force still changes at the loss.
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
    // The forecast neglects terms of relative size J/I.
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

/// Fraction of the time to the loss of stability by which the loss may come earlier than predicted.
const EARLIER: f64 = 0.02;

/// Trapezoidal integral of f(rate) between two times, within the range of the rates.
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
        // `sum` of nothing is -0, which would print its sign.
        .fold(0.0, |sum, part| sum + part)
}

/// The first method follows sliding without a kick to its exact stop.
pub const METHODS: [Method; 5] = [
    Method::Series,
    Method::Arkode,
    Method::Erk,
    Method::CvodeAdams,
    Method::CvodeBdf,
];

pub(crate) const TOLERANCES: [f64; 8] = [1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13];

/// Kick for a case without one, rad/s: far above rounding and far below the speeds of stick-slip.
pub(crate) const KICK: f64 = 1e-4;

/// First stick of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Onset {
    /// Name of the method.
    pub method: &'static str,
    /// Relative tolerance.
    pub rtol: f64,
    /// Whether the run was kicked.
    pub kicked: bool,
    /// Time, s; `None` without a stick before the end or a failure.
    pub first_stick: Option<f64>,
}

/// First stick of sliding that slows down by itself, for every method and tolerance, up to `end_time` (s). Runs are
/// made without a kick, and with the system's kicks; without such kicks, one of `KICK` at the instability. They use
/// all processors and end at the first stick. `stop` is polled; the result is `None` if it returns `true`.
pub fn onsets(trains: &System, solver: &SolverOptions, end_time: f64, stop: &dyn Watch) -> Option<Vec<Onset>> {
    let (mut without, mut with) = (trains.clone(), trains.clone());
    without.kicks.clear();
    if with.kicks.is_empty() {
        with.kicks.push(Kick {
            time: KickTime::Instability,
            relative_velocity: KICK,
            on: KickSide::Both,
        });
    }
    let mut jobs = Vec::with_capacity(2 * METHODS.len() * TOLERANCES.len());
    for (kicked, trains) in [(false, &without), (true, &with)] {
        for method in METHODS {
            jobs.extend(TOLERANCES.map(|rtol| (kicked, trains, method, rtol)));
        }
    }
    let found = over_processors(jobs.len(), stop, |index| {
        let (kicked, trains, method, rtol) = jobs[index];
        let solver = SolverOptions {
            method,
            rtol,
            fixed_step: None,
            ..solver.clone()
        };
        // A failure after the first stick does not matter. Before it, there is no stick. A contact that sticks from the
        // beginning has its onset when it sticks again.
        let (report, _) = run_to_first_stick(trains, &solver, end_time, false, stop);
        Onset {
            method: method.name(),
            rtol,
            kicked,
            first_stick: report.digest.cycles.onset_time,
        }
    });
    (!stop.stopped()).then_some(found)
}

/// Run of a system to its first stick, or until it is stopped, and the reason of a failure. A contact that sticks from
/// the beginning ends the run there if `at_once`, otherwise when it sticks again.
pub(super) fn run_to_first_stick(
    trains: &System,
    solver: &SolverOptions,
    end_time: f64,
    at_once: bool,
    stop: &dyn Watch,
) -> (RunReport, Option<Error>) {
    let output = OutputOptions::at_the_ends(end_time);
    let stuck = AtomicBool::new(false);
    let mut recorder = FirstStick { stuck: &stuck, at_once };
    let run = Run::of_system(trains, 0.0, solver, &output)
        .record(&mut recorder)
        .watch(&|| stop.stopped() || stuck.load(Ordering::Relaxed))
        .start();
    match run {
        Ok(report) => (report, None),
        Err(failure) => (failure.report, Some(failure.error)),
    }
}

#[derive(Debug)]
struct FirstStick<'a> {
    stuck: &'a AtomicBool,
    at_once: bool,
}

impl Recorder for FirstStick<'_> {
    fn stores_motion(&self) -> bool {
        false
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.stuck
            .fetch_or(self.at_once && sample.mode == Mode::Stick, Ordering::Relaxed);
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        // A contact without a stick mode has events of this kind, too.
        let sticks = match self.at_once {
            true => event.mode_after == Mode::Stick,
            false => event.kind == EventKind::Stick,
        };
        self.stuck.fetch_or(sticks, Ordering::Relaxed);
        Ok(())
    }
}
