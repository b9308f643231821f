//! A run: from a system, its solver and its output to the automaton, and what is recorded on the way.

use super::automaton;
use super::dynamics::{SystemDynamics, SystemLocation};
use super::ensemble::Seat;
use super::observer::Recording;
use super::options::{Method, OutputOptions, SolverOptions};
use super::plan::SystemPlan;
use super::report::{Progress, RunFailure, RunReport};
use super::rules::SystemRules;
use super::state_readings::{self, Further, StateReadings};
use crate::hybrid::Start;
use crate::model::equations::{Engagement, Side, SystemEquations};
use crate::model::system::{ContactLaw, System};
use crate::model::{BreakawayTest, Mode};
use crate::record::{Event, EventDigest, NoRecorder, Recorder};
use std::f64::consts::TAU;
use std::ops::ControlFlow;
use std::sync::Arc;

/// What the state of a case has beyond [`State`](crate::record::State), in the order in which a recorder gets it.
pub(crate) fn further(system: &System) -> Vec<Further> {
    state_readings::further_names(&SystemEquations::new(system))
}

/// The shorter period of a surface on its shaft, or else of the fastest thing that moves, s; `None` where nothing moves by itself.
pub fn natural_period(system: &System) -> Option<f64> {
    SystemDynamics::new(system, 0.0).natural_period()
}

/// What a solver is given in slip.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SolverSettings {
    /// Relative tolerance.
    pub relative: f64,
    /// Absolute tolerance of the twist of the rotor's first shaft (rad), and of its rate (rad/s); 0 of a rotor without shafts.
    pub twist: f64,
    /// See `twist`.
    pub rate: f64,
    /// Absolute tolerance of the free chain's speed, rad/s; 0 of tied chains.
    pub speed: f64,
    /// Longest step, s.
    pub max_step: Option<f64>,
}

/// What the solvers of a case are given in slip with the speed of its start, after the last corner of its signals: where steps stride
/// over the fast modes, if the method does anywhere, and where they resolve them.
pub(crate) fn solver_settings(system: &System, solver: &SolverOptions) -> [SolverSettings; 2] {
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

/// The state at t = 0.
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

/// What is run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Problem<'a> {
    /// The system.
    pub system: &'a System,
    /// What counts as a stick of a contact without one, rad/s.
    pub threshold: f64,
    /// Rows have what the state has beyond [`State`](crate::record::State), too ([`further`]).
    pub further: bool,
    /// Of a run in an ensemble.
    pub seat: Option<&'a Arc<Seat>>,
}

/// The equations of a system with the threshold of its contact (rad/s), what happens to it, and where it starts: at t = 0, or as
/// [`simulate_from`] has it.
pub(super) fn prepared(
    (system, threshold): (&System, f64),
    from: Option<(f64, &[f64])>,
    solver: &SolverOptions,
    end: f64,
) -> (Arc<SystemDynamics>, SystemRules, Start<SystemLocation>) {
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

/// Steps after which no more events are foreseen.
const MOST_STEPS_FORESEEN: usize = 1_000_000;

/// The events of a run up to `end` (s), by the quickest method: where they come at another time by the run's own, as where the onset
/// is amplified rounding, samples begin with the event.
fn foreseen(problem: Problem<'_>, from: Option<(f64, &[f64])>, solver: &SolverOptions, end: f64) -> Vec<Event> {
    let quick = SolverOptions {
        method: Method::Series,
        fixed_step: None,
        max_step: None,
        max_steps: Some(MOST_STEPS_FORESEEN),
        // A run has to be the same again on another machine.
        max_wall_time: None,
        ..solver.clone()
    };
    let (output, mut go_on) = (OutputOptions::at_the_ends(end), |_| ControlFlow::Continue(()));
    let problem = Problem { seat: None, ..problem };
    match simulate_from(problem, from, &quick, &output, &mut NoRecorder, &mut go_on) {
        Ok(report) => report.events,
        Err(failure) => failure.report.events,
    }
}

/// Integrates a system from t = 0 to the end time of `output`.
///
/// Rows go to `recorder` in order of time. `control` is asked now and then; `Break` ends the run in good order.
///
/// # Errors
/// Solver failures, chattering, an exhausted event budget, or an error of the recorder, each with time and mode.
pub(crate) fn simulate(
    problem: Problem<'_>,
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<RunReport, Box<RunFailure>> {
    simulate_from(problem, None, solver, output, recorder, control)
}

/// Like [`simulate`], from `from`: a time (s) and a state with a closed contact. `None` starts at t = 0. Kicks up to that time are
/// not given, nor are those that wait for a loss of stability: the state has them.
///
/// # Errors
/// Those of [`simulate`].
pub(crate) fn simulate_from(
    problem: Problem<'_>,
    from: Option<(f64, &[f64])>,
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<RunReport, Box<RunFailure>> {
    let system = problem.system;
    let (dynamics, mut rules, start) = prepared((system, problem.threshold), from, solver, output.end_time);
    let time = start.time;
    rules.seat = problem.seat.cloned();
    let readings = StateReadings {
        dynamics: &dynamics,
        further: problem.further,
    };
    let watched = dynamics.system.twice_resistance.is_some();
    let digest = EventDigest::new(dynamics.natural_period().filter(|_| watched));
    let stores_motion = recorder.stores_motion();
    let mut recording = Recording::new(readings, digest, (solver, output), recorder, control, &start);
    let foreseen = if stores_motion && output.follow.around.is_some() {
        foreseen(problem, from, solver, output.end_time)
    } else {
        Vec::new()
    };
    let shortest = TAU * dynamics.unit(0);
    let periods = (dynamics.natural_period().unwrap_or(shortest), shortest);
    recording.follow(output, dynamics.system.dimension, periods, solver.rtol, &foreseen);
    recording.begin_at(time);
    let (result, mut report) = automaton(&dynamics, &mut rules, start, solver, output, recording);
    report.stopped_smoothly = rules.stopped_smoothly;
    report.one_sided_test = system.breakaway_test != BreakawayTest::Transmitted;
    report.count_kicks(system.kicks.len(), rules.waiting_kicks.len());
    report.ended(result)
}
