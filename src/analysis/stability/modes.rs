//! What `stickslip modes` says of a case: its linear modes and, of sliding that slows down by itself, how its damping falls with the
//! speed, when it loses stability, and what then decides the onset of stick-slip.

use super::Growth;
use super::SystemModes;
use super::growth_rate::fast_growth_rate;
use super::smooth_sliding::Slowing;
use super::states::{at_start, critical_speeds};
use crate::friction::{FrictionLaw, Law};
use crate::hybrid::RunError;
use crate::model::Mode;
use crate::model::equations::SystemEquations;
use crate::model::system::{Pressing, System};
use crate::record::State;
use crate::run::Run;
use crate::simulation::natural_period;
use crate::simulation::{OutputOptions, RunReport, SolverOptions};
use crate::workers::go_on_unless;
use serde::Serialize;
use std::f64::consts::TAU;

/// Points of the curve of effective damping.
const CURVE: usize = 201;

/// Share of the time in which the margin changes by its own size that one step of the search takes.
const SEARCH_STEP: f64 = 0.02;

/// Steps of the search each way: as long as the margin takes to change by its own size.
const SEARCH_STEPS: usize = 50;

/// Halvings of the bracket: from a fiftieth of a time scale to the rounding of the time.
const HALVINGS: usize = 60;

/// The zero of the largest real part of the fast eigenvalues of the slip state, along smooth (kick-free) sliding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Crossing {
    /// s.
    pub time: f64,
    /// |omega_r| there, rad/s.
    pub relative_velocity: f64,
}

/// Damping of the relative mode in steady sliding at one speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EffectiveDamping {
    /// |omega_r|, rad/s.
    pub relative_velocity: f64,
    /// The stability margin 2 (R + r F_n mu'(|omega_r|)), N m s/rad; c_t + 2 r F_n mu' of two alike disks.
    pub damping: f64,
    /// The same over that of the aperiodic limit, 2 sqrt(k_t J) of two alike disks.
    pub damping_ratio: f64,
    /// Largest real part of the fast eigenvalues of the slip, 1/s.
    pub growth_rate: f64,
}

/// Whether steady sliding loses its stability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stability {
    /// It does, within the run.
    Lost,
    /// Friction does not fall with speed: no speed and no force makes it unstable.
    FrictionDoesNotFall,
    /// c_t outweighs the falling friction at every speed under the largest force.
    DampingSuffices,
    /// It could, but the run sticks or ends before.
    NotReached,
}

/// What decides when and how stick-slip sets in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnsetDecision {
    /// The perturbation of the case, well above rounding.
    Perturbation,
    /// Rounding and solver error, amplified.
    Rounding,
    /// Neither grows to matter: the smooth sliding itself comes to its stick.
    SmoothSliding,
    /// The points of a friction table: each that sliding passes excites the fast mode, as a perturbation of the case does,
    /// and a run without that tells which of them it is.
    FrictionPoints,
}

/// The loss of stability along the case's own sliding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Instability {
    /// Zero of the margin, s.
    pub time: f64,
    /// |omega_r| there, rad/s.
    pub relative_velocity: f64,
    /// F_n there, N.
    pub normal_force: f64,
    /// Largest real part of the fast eigenvalues there, 1/s: not zero, as the rotor moves too.
    pub growth_rate: f64,
    /// Where that real part itself crosses zero, if that is near.
    pub eigenvalue_crossing: Option<Crossing>,
    /// Where smooth sliding itself comes to its stop, s; the end of the run if it never does.
    pub smooth_end: f64,
    /// First stick of the run, s.
    pub onset_time: Option<f64>,
    /// G, e-folds.
    pub growth_exponent: f64,
    /// Its part up to the first stick.
    pub growth_to_onset: f64,
    /// From the kick to the first stick.
    pub e_folds_gained: Option<f64>,
    /// By how many e-folds the kick stands above rounding at the first stick; negative if it has died out.
    pub kick_above_noise: Option<f64>,
    /// By which of the criteria.
    pub onset_decided_by: OnsetDecision,
}

/// Everything that `stickslip modes` says of a case. SI units and radians; in translation metres, newtons and kilograms stand for
/// radians, newton metres and kilogram square metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Modes {
    /// `None` where sliding does not slow down by itself.
    #[serde(flatten)]
    pub slowing: Option<SlowingModes>,
    /// Linear modes, steady sliding, and where its stability changes.
    #[serde(flatten)]
    pub general: SystemModes,
}

/// Sliding that slows down by itself: its damping, and how it loses its stability.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SlowingModes {
    /// sqrt(k_e/m)/(2 pi), Hz; `None` of a normal force that is given directly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial_frequency: Option<f64>,
    /// c_a/(2 sqrt(k_e m)).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial_damping_ratio: Option<f64>,
    /// Of the natural period, Hz.
    pub torsional_frequency: f64,
    /// The shorter period of a surface on its shaft, T_n = 2 pi sqrt(J/k_t) of two alike disks, s.
    pub natural_period: f64,
    /// The largest actuating force, N: the F_n of the slip states and of the effective damping.
    pub normal_force: f64,
    /// |omega_r| at which the effective damping is zero under that force, rad/s; `None` if it never is.
    pub critical_speed: Option<f64>,
    /// Every such speed, the highest first, where there are several: below the second steady sliding is stable again, below
    /// the third unstable, and so on. Empty where there is one or none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub critical_speeds: Vec<f64>,
    /// From 0 to beyond the critical speed.
    pub effective_damping: Vec<EffectiveDamping>,
    /// Of steady sliding, through the stop.
    pub stability: Stability,
    /// `None` if sliding is stable to the stop.
    pub instability: Option<Instability>,
    /// Why the run that looked for the instability failed, if it did.
    pub run_failure: Option<String>,
}

impl Instability {
    /// How long smooth sliding is unstable before it stops, s.
    pub fn window(&self) -> f64 {
        self.smooth_end - self.time
    }
}

impl Modes {
    /// Of a system. Integrates sliding that slows down by itself up to its first stick, to find the loss of stability where the run
    /// itself has it.
    pub fn of_case(trains: &System, solver: &SolverOptions, end_time: f64) -> Modes {
        Modes {
            slowing: SlowingModes::of_case(trains, solver, end_time),
            general: SystemModes::of_case(trains),
        }
    }
}

impl SlowingModes {
    fn of_case(trains: &System, solver: &SolverOptions, end_time: f64) -> Option<SlowingModes> {
        let sliding = Slowing::new(trains)?;
        let natural_period = natural_period(trains)?;
        let (report, failure) = run_to_first_stick(trains, solver, end_time);
        let force = sliding.excitation.largest_force().max(0.0);
        let mut critical_speeds = critical_speeds(&sliding.system, force);
        let critical_speed = critical_speeds.first().copied();
        if critical_speeds.len() < 2 {
            critical_speeds.clear();
        }
        let axial = match &trains.pressing {
            Pressing::Axial { axial, .. } => Some(axial),
            Pressing::Force(_) => None,
        };
        let instability = instability(trains, &sliding, &report);
        Some(SlowingModes {
            axial_frequency: axial.map(|axial| (axial.stiffness / axial.mass).sqrt() / TAU),
            axial_damping_ratio: axial.map(|axial| axial.damping / (2.0 * (axial.stiffness * axial.mass).sqrt())),
            torsional_frequency: 1.0 / natural_period,
            natural_period,
            normal_force: force,
            critical_speed,
            critical_speeds,
            effective_damping: damping_curve(
                &sliding.system,
                TAU / natural_period,
                force,
                critical_speed,
                at_start(trains).abs(),
            ),
            stability: stability(&trains.law, critical_speed, instability.is_some()),
            instability,
            run_failure: failure.map(|error| error.to_string()),
        })
    }
}

/// From standstill to where friction has all but ceased to change; where it does not change, as far as the run goes.
fn damping_curve(
    system: &SystemEquations,
    angular_frequency: f64,
    force: f64,
    critical: Option<f64>,
    initial: f64,
) -> Vec<EffectiveDamping> {
    let scale = 0.5 * system.law.extent();
    let end = match critical {
        Some(critical) => critical + scale,
        None if scale.is_finite() => scale,
        None => initial.max(1.0),
    };
    // Of the swing of both surfaces against each other, whose inertia is J/2 of two alike ones.
    let [one, other] = [&system.rotor, &system.stator].map(|side| side.surface_inertia().recip());
    let aperiodic = 4.0 * angular_frequency / (one + other);
    let at = |x: f64| {
        let contact_damping = system.radius * force * system.law.coefficient_and_slope(x).1;
        let damping = system.twice_resistance.unwrap_or(0.0) + 2.0 * contact_damping;
        EffectiveDamping {
            relative_velocity: x,
            damping,
            damping_ratio: damping / aperiodic,
            growth_rate: fast_growth_rate(system, contact_damping),
        }
    };
    (0..CURVE).map(|k| at(end * k as f64 / (CURVE - 1) as f64)).collect()
}

/// The events of a run up to its first stick, and the error of a run that failed before.
fn run_to_first_stick(trains: &System, solver: &SolverOptions, end_time: f64) -> (RunReport, Option<RunError>) {
    let output = OutputOptions::at_the_ends(end_time);
    let result = Run::of_system(trains, 0.0, solver, &output)
        .control(|progress| go_on_unless(progress.mode == Mode::Stick))
        .start();
    match result {
        // Smooth sliding is looked at to where the case ends, not to where this run was stopped.
        Ok(mut report) => {
            report.end = end_time;
            (report, None)
        }
        Err(failure) => (failure.report, Some(failure.error)),
    }
}

fn instability(trains: &System, sliding: &Slowing, report: &RunReport) -> Option<Instability> {
    let growth = Growth::of_digest(trains, &report.digest, report.end)?;
    let lost = report.digest.instability.as_ref()?;
    let (time, state): (f64, State) = (lost.time, lost.before);
    let x = state.relative_velocity.abs();
    let start = at_start(trains).abs();
    let decided = if trains.law.knots().iter().any(|knot| *knot < start) {
        OnsetDecision::FrictionPoints
    } else if !report.stopped_smoothly && growth.amplifies_rounding() {
        OnsetDecision::Rounding
    } else if growth.above_noise.is_some_and(|above| above > THOUSANDFOLD) {
        OnsetDecision::Perturbation
    } else {
        OnsetDecision::SmoothSliding
    };
    Some(Instability {
        time,
        relative_velocity: x,
        normal_force: sliding.force(time),
        growth_rate: sliding.rate(time, x),
        eigenvalue_crossing: eigenvalue_crossing(sliding, time, &state),
        smooth_end: growth.smooth_end,
        onset_time: report.digest.cycles.onset_time,
        growth_exponent: growth.exponent,
        growth_to_onset: growth.to_first_stick,
        e_folds_gained: growth.from_kick,
        kick_above_noise: growth.above_noise,
        onset_decided_by: decided,
    })
}

/// ln 1000: what stands a thousand times above rounding leaves three digits of the onset to the perturbation.
const THOUSANDFOLD: f64 = 6.907_755_278_982_137;

fn stability(law: &FrictionLaw, critical: Option<f64>, lost: bool) -> Stability {
    if lost {
        Stability::Lost
    } else if !law.falls() {
        Stability::FrictionDoesNotFall
    } else if critical.is_none() {
        Stability::DampingSuffices
    } else {
        Stability::NotReached
    }
}

/// The crossing near the zero of the margin at `time` with the state `at`; `None` where there is none within the
/// time that the margin takes to change by its own size.
///
/// The margin is the damping left to the relative mode with the rotor at rest; the rotor moves along and shifts the
/// eigenvalues' own crossing, by 0.1 ms in the paper's case.
fn eigenvalue_crossing(sliding: &Slowing, time: f64, at: &State) -> Option<Crossing> {
    let path = sliding.path(at.relative_velocity.signum());
    let start = path.point(time, at);
    let slowing = path.torque(start).abs() / sliding.inertia();
    let rate = sliding.system.law.steepness_rate(at.relative_velocity.abs());
    let step = SEARCH_STEP / (rate * slowing);
    let unstable = path.growth(start) > 0.0;
    let step = if unstable { -step } else { step };
    let mut near = start;
    for _ in 0..SEARCH_STEPS {
        let far = path.advanced(near, step);
        if far.0 < 0.0 || path.speed(far) <= 0.0 || !far.1.is_finite() {
            return None;
        }
        if (path.growth(far) > 0.0) != unstable {
            let mut width = step;
            for _ in 0..HALVINGS {
                width *= 0.5;
                let middle = path.advanced(near, width);
                if (path.growth(middle) > 0.0) == unstable {
                    near = middle;
                }
            }
            return Some(Crossing {
                time: near.0,
                relative_velocity: path.speed(near),
            });
        }
        near = far;
    }
    None
}
