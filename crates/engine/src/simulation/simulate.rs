//! A run of a system: solver, output and recording for the automaton.

use super::automaton;
use super::observer::Recording;
use super::options::{Method, OutputOptions, SolverOptions};
use super::plan::SystemPlan;
use super::report::{RunFailure, RunReport};
use super::rules::SystemRules;
use super::state_readings::{self, Further, StateReadings};
use crate::Error;
use crate::hybrid::Start;
use crate::hybrid::dynamics::{SystemDynamics, SystemLocation};
use std::f64::consts::TAU;
use std::sync::Arc;
use stickslip_system::model::equations::{Engagement, Side, SystemEquations};
use stickslip_system::model::system::{ContactLaw, System};
use stickslip_system::model::{BreakawayTest, Mode};
use stickslip_system::record::{Event, EventDigest, NoRecorder, Recorder};
use stickslip_system::watch::Watch;

/// State quantities of a system beyond [`State`](stickslip_system::record::State), in a recorder's order.
pub fn further(system: &System) -> Vec<Further> {
    state_readings::further_names(&SystemEquations::new(system))
}

/// Shorter period of a surface on its shaft, otherwise the period of the fastest motion, s; `None` if nothing moves by
/// itself.
pub fn natural_period(system: &System) -> Option<f64> {
    SystemDynamics::new(system, 0.0).natural_period()
}

/// Tolerances and step bound of a solver in slip.
#[derive(Debug, Clone, Copy)]
pub struct SolverSettings {
    /// Relative tolerance.
    pub relative: f64,
    /// Absolute tolerance of the twist of the rotor's first shaft, rad; 0 without shafts.
    pub twist: f64,
    /// Absolute tolerance of its rate, rad/s; 0 without shafts.
    pub rate: f64,
    /// Absolute tolerance of the free chain's speed, rad/s; 0 for tied chains.
    pub speed: f64,
    /// Longest step, s.
    pub max_step: Option<f64>,
}

/// Settings of a run's solvers in slip at the initial speed, after the last corner of its signals. The first are for
/// steps over the fast modes (if the method takes such steps), the second for steps that resolve them.
pub fn solver_settings(system: &System, solver: &SolverOptions) -> [SolverSettings; 2] {
    let dynamics = Arc::new(SystemDynamics::new(system, 0.0));
    let start = start(system, &dynamics);
    let plan = SystemPlan::new(system, &dynamics, &start, solver);
    let (system, corners) = (&dynamics.system, dynamics.excitation.corners());
    let strides = plan.regimes(0.0).is_some();
    [false, true].map(|resolved| {
        let location = SystemLocation {
            resolved: resolved || !strides,
            ..SystemLocation::new(Mode::SlipForward, corners.len())
        };
        let chosen = plan.solver(&location, corners.last().copied().unwrap_or(0.0), &start);
        let absolute = |place: Option<usize>| place.map_or(0.0, |place| chosen.tolerances.absolute[place]);
        let twist = (system.rotor.shafts() > 0).then_some(system.rotor.twists);
        SolverSettings {
            relative: chosen.tolerances.relative,
            twist: absolute(twist),
            rate: absolute(twist.map(|twist| twist + 1)),
            speed: absolute(system.rotor.speed.or(system.stator.speed)),
            max_step: chosen.max_step,
        }
    })
}

pub(super) fn start(system: &System, dynamics: &SystemDynamics) -> Vec<f64> {
    let (initial, contact) = (&system.initial, &system.contact);
    let system = &dynamics.system;
    let mut y = vec![0.0; system.dimension];
    let outside = dynamics.excitation.at(dynamics.excitation.stretch(0.0), 0.0);
    let sides = [
        (
            &system.rotor,
            &outside.rotor,
            &initial.rotor_twist,
            &initial.rotor_speed,
        ),
        (
            &system.stator,
            &outside.stator,
            &initial.stator_twist,
            &initial.stator_speed,
        ),
    ];
    for (side, driving, twists, speeds) in sides {
        for i in 0..side.shafts() {
            let outer = speeds.get(i + 1).copied().unwrap_or(driving.speed);
            y[side.twists + 2 * i] = twists[i];
            y[side.twists + 2 * i + 1] = side.sign * (outer - speeds[i]);
        }
        if let (Some(index), Some(&speed)) = (side.speed, speeds.last()) {
            y[index] = speed;
        }
    }
    if let (Engagement::Bristles(.., at), ContactLaw::Bristles(bristles)) = (system.engagement, contact) {
        y[at] = bristles.deflection;
    }
    if system.rotor.speed.is_none() && system.stator.speed.is_none() {
        let twists = |side: &Side| -> f64 { (0..side.shafts()).map(|i| side.sign * side.twist(i, &y)).sum() };
        y[system.slip] = twists(&system.stator) - twists(&system.rotor);
    }
    y
}

/// A system to run, with what is recorded of it.
#[derive(Debug, Clone, Copy)]
pub struct Simulation<'a> {
    /// The system.
    pub system: &'a System,
    /// Speed below which a contact without stick counts as stuck, rad/s.
    pub threshold: f64,
    /// Whether rows have the quantities beyond [`State`](stickslip_system::record::State) ([`further`]).
    pub further: bool,
}

/// Equations, rules and start of a run: at t = 0, or as in [`simulate_from`]. The threshold is in rad/s.
pub(super) fn prepared(
    (system, threshold): (&System, f64),
    from: Option<(f64, &[f64])>,
    solver: &SolverOptions,
    end: f64,
) -> (Arc<SystemDynamics>, SystemRules, Start) {
    let dynamics = Arc::new(SystemDynamics::new(system, threshold));
    let (time, mut state) = match from {
        Some((time, state)) => (time, state.to_vec()),
        None => (0.0, start(system, &dynamics)),
    };
    let plan = SystemPlan::new(system, &dynamics, &state, solver);
    let mut rules = SystemRules::new(dynamics.clone(), system, plan, time, end);
    let location = match from {
        Some(_) => rules.location_at(time, &mut state),
        None => rules.initial_location(&mut state),
    };
    (dynamics, rules, Start { time, location, state })
}

const MOST_STEPS_FORESEEN: usize = 1_000_000;

/// Predicted events of a run up to `end` (s), by the fastest method. If the run's own method has an event at another
/// time, for example after amplified rounding, dense samples begin at the event.
fn foreseen(problem: Simulation<'_>, from: Option<(f64, &[f64])>, solver: &SolverOptions, end: f64) -> Vec<Event> {
    let quick = SolverOptions {
        method: Method::Series,
        fixed_step: None,
        max_step: None,
        max_steps: Some(MOST_STEPS_FORESEEN),
        // A run must be reproducible on another machine.
        max_wall_time: None,
        ..solver.clone()
    };
    let output = OutputOptions::at_the_ends(end);
    match simulate_from(problem, from, &quick, &output, &mut NoRecorder, &()) {
        Ok(report) => report.events,
        Err(failure) => failure.report.events,
    }
}

/// Integrates a system from t = 0 to the end time of `output`. The recorder gets the rows in order of time. `watch`
/// learns its progress, and may end it in good order.
///
/// # Errors
/// Solver failures, chattering, an exhausted event budget, or an error of the recorder, each with time and mode.
pub fn simulate(
    problem: Simulation<'_>,
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    watch: &dyn Watch,
) -> Result<RunReport, Box<RunFailure>> {
    simulate_from(problem, None, solver, output, recorder, watch)
}

/// Like [`simulate`], from `from`: a time (s) and a state with a closed contact; `None` starts at t = 0. The state
/// includes the effect of all earlier kicks, and of the kicks that wait for a loss of stability.
///
/// # Errors
/// As for [`simulate`].
pub fn simulate_from(
    problem: Simulation<'_>,
    from: Option<(f64, &[f64])>,
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    watch: &dyn Watch,
) -> Result<RunReport, Box<RunFailure>> {
    if output.end_time.is_nan() || output.end_time < 0.0 {
        let error = Error::refused("a run cannot end before t = 0; give a later end time");
        return RunReport::default().ended(Err(error));
    }
    if solver.method == Method::Rk4 && solver.fixed_step.is_none() {
        let error = Error::refused("method \"rk4\" has no step control; give the length of its steps, solver.step");
        return RunReport::default().ended(Err(error));
    }
    let system = problem.system;
    let (dynamics, mut rules, start) = prepared((system, problem.threshold), from, solver, output.end_time);
    let time = start.time;
    let readings = StateReadings {
        dynamics: &dynamics,
        further: problem.further,
    };
    let has_margin = dynamics.system.twice_resistance.is_some();
    let digest = EventDigest::new(dynamics.natural_period().filter(|_| has_margin));
    let stores_motion = recorder.stores_motion();
    let mut recording = Recording::new(readings, digest, (solver, output), recorder, watch, &start);
    let foreseen = if stores_motion && output.follow.around.is_some() {
        foreseen(problem, from, solver, output.end_time)
    } else {
        Vec::new()
    };
    let shortest = TAU * dynamics.unit(0);
    let periods = (dynamics.natural_period().unwrap_or(shortest), shortest);
    recording.follow(output, dynamics.system.dimension, periods, solver.rtol, &foreseen);
    recording.begin_at(time);
    let window = rules.chatter_window();
    let (result, mut report) = automaton(&dynamics, (&mut rules, window), start, solver, output, recording);
    report.stopped_smoothly = rules.stopped_smoothly;
    report.one_sided_test = system.breakaway_test != BreakawayTest::Transmitted;
    report.count_kicks(system.kicks.len(), rules.waiting_kicks.len());
    report.ended(result)
}
