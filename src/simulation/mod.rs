//! The brake run by the automaton: which solver where, and what is recorded.

pub mod brake;
pub mod fixed_step;
pub mod nearby;
pub mod options;
pub mod plan;
pub mod procedure;
pub mod rules;
pub mod sampling;
pub mod semi_analytic;
pub mod trains;

mod follower;
mod observer;
mod readings;
mod report;
mod runge_kutta;

pub(crate) use options::FORESEEN_STEPS;

pub use options::{Around, Following, Method, OutputOptions, OutputWindow, SolverOptions};
pub use report::{Grazing, Progress, RunFailure, RunReport, SolverWork};

use crate::hybrid::{self, ChosenSolver, Dynamics, Limits, Rules, RunError, Start};
use crate::model::slow_stick::SlowStick;
use crate::model::state::Components;
use crate::model::torsion::spinning;
use crate::model::{BreakawayTest, Mode, Parameters};
use crate::record::{Event, EventDigest, EventKind, NoRecorder, Recorder};
use brake::{Brake, Location, Watch};
use observer::Recording;
use plan::Plan;
use readings::{Readings, TwistReadings};
use rules::BrakeRules;
use std::f64::consts::TAU;
use std::ops::ControlFlow;
use std::sync::Arc;

/// This many transitions within a twentieth of the natural period are chattering.
const CHATTER_COUNT: usize = 32;

/// The solver with its tolerances and longest step, as a run of this case uses it: (in smooth sliding, where the fast mode
/// is resolved).
pub fn chosen_solvers(parameters: &Parameters, solver: &SolverOptions) -> (ChosenSolver, ChosenSolver) {
    let axial = parameters.axial_motion();
    let plan = Plan::new(parameters, axial.force.largest(), solver);
    let sliding = |resolved| Location {
        mode: Mode::SlipForward,
        resolved,
        watch: Watch::Stable,
        piece: 0,
    };
    (plan.solver(&sliding(false)), plan.solver(&sliding(true)))
}

/// Integrates one case from t = 0 to the end time of `output`.
///
/// Rows go to `recorder` in order of time. `control` is asked now and then; `Break` ends the run in good order.
///
/// # Errors
/// Solver failures, chattering, an exhausted event budget, or an error of the recorder, each with time and mode.
pub(crate) fn simulate(
    parameters: &Parameters,
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<RunReport, Box<RunFailure>> {
    if solver.method == Method::Paper {
        return procedure::run(parameters, solver, output, recorder, control);
    }
    simulate_from(parameters, solver, output, None, recorder, control)
}

/// Does the same from a time (s) and a motion on, in a closed contact, which `start` is; from t = 0 without one. Kicks up to that time
/// are not given, as the motion has them, nor are those that wait for a loss of stability.
///
/// # Errors
/// Those of [`simulate`].
pub(crate) fn simulate_from(
    parameters: &Parameters,
    solver: &SolverOptions,
    output: &OutputOptions,
    start: Option<(f64, Components)>,
    recorder: &mut dyn Recorder,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<RunReport, Box<RunFailure>> {
    let mut brake = Brake::new(parameters);
    let plan = Plan::new(parameters, brake.axial.force.largest(), solver);
    if plan.follows_slow_stick() {
        brake.slow_stick = Some(SlowStick::new(&brake.torsion));
    }
    let brake = Arc::new(brake);
    let mut rules = BrakeRules::new(brake.clone(), parameters, plan, output.end_time);
    let (time, state, location) = match start {
        None => {
            let state = spinning(parameters.initial.speed).to_vec();
            (0.0, state.clone(), rules.initial_location(&state))
        }
        Some((time, motion)) => {
            let state = motion.state().to_vec();
            (time, state.clone(), rules.location_at(time, &state))
        }
    };
    let readings = TwistReadings {
        brake: &brake,
        axial: parameters.axial,
    };
    let digest = EventDigest::new(parameters);
    let initial_energy = readings.kinetic_energy(time, &location, &state);
    let stores_motion = recorder.stores_motion();
    let mut recording = Recording::new(readings, digest, output, recorder, control, initial_energy);
    recording.limit_wall_time(solver.max_wall_time);
    let foreseen = foreseen(output, solver, stores_motion, |solver, output| {
        let mut go_on = |_| ControlFlow::Continue(());
        simulate_from(parameters, solver, output, start, &mut NoRecorder, &mut go_on)
    });
    let axial = TAU * (parameters.axial.mass / parameters.axial.stiffness).sqrt();
    let period = brake.torsion.natural_period();
    recording.follow(
        output,
        brake.dimension(),
        (period, period.min(axial)),
        solver.rtol,
        &foreseen,
    );
    recording.begin_at(time);
    let start = Start { time, location, state };
    let (result, mut report) = automaton(&brake, &mut rules, start, solver, output, recording);
    report.count_kicks(parameters.perturbations.len(), rules.kicks_never_given());
    report.stopped_smoothly = rules.stopped_smoothly();
    report.one_sided_test = parameters.contact.breakaway_test != BreakawayTest::Transmitted;
    report.ended(result)
}

/// Steps after which no more events are foreseen.
const MOST_STEPS_FORESEEN: usize = 1_000_000;

/// The events of a run that has samples around them, by `run` with the quickest method: where they come at another time by the
/// run's own, as where the onset is amplified rounding, samples begin with the event.
fn foreseen(
    output: &OutputOptions,
    solver: &SolverOptions,
    stores_motion: bool,
    run: impl FnOnce(&SolverOptions, &OutputOptions) -> Result<RunReport, Box<RunFailure>>,
) -> Vec<Event> {
    if !stores_motion || output.follow.around.is_none() {
        return Vec::new();
    }
    let quick = SolverOptions {
        method: Method::Series,
        fixed_step: None,
        max_step: None,
        max_steps: Some(MOST_STEPS_FORESEEN),
        // A run has to be the same again on another machine.
        max_wall_time: None,
        ..solver.clone()
    };
    match run(&quick, &OutputOptions::at_the_ends(output.end_time)) {
        Ok(report) => report.events,
        Err(failure) => failure.report.events,
    }
}

/// Runs the automaton within the budgets of `solver`, and closes the record.
fn automaton<D, R, V>(
    dynamics: &Arc<D>,
    rules: &mut R,
    start: Start<D::Location>,
    solver: &SolverOptions,
    output: &OutputOptions,
    mut recording: Recording<'_, V>,
) -> (Result<(), RunError>, RunReport)
where
    D: Dynamics<Location = V::Place>,
    R: Rules<D, Kind = EventKind>,
    V: Readings,
{
    // Who says how long the steps are, or how many, knows how many that makes.
    let foresee = solver.max_steps.is_none() && solver.max_step.is_none() && solver.fixed_step.is_none();
    let limits = Limits {
        max_events: solver.max_events,
        chatter_count: CHATTER_COUNT,
        max_steps: solver.max_steps.map(|steps| steps as u64),
        foreseen_steps: foresee.then_some(FORESEEN_STEPS),
    };
    let result = hybrid::run(dynamics, rules, start, output.end_time, limits, &mut recording);
    let result = match result {
        Ok(finish) if finish.interrupted => recording.in_time(finish.time, &finish.location).map(|()| finish),
        other => other,
    };
    // What waits is handed on however the run has ended.
    let flushed = recording.flush();
    let mut report = recording.into_report();
    let result = result.and_then(|finish| match flushed {
        Ok(()) => Ok(finish),
        Err(error) => Err(RunError::observed(error, || dynamics.describe(&finish.location))),
    });
    let result = result.map(|finish| {
        report.end = finish.time;
        report.interrupted = finish.interrupted;
    });
    (result, report)
}
