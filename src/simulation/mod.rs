//! The brake run by the automaton: which solver where, and what is recorded.

pub mod brake;
pub mod digest;
pub mod fixed_step;
pub mod nearby;
pub mod options;
pub mod plan;
pub mod procedure;
pub mod record;
pub mod rules;
pub mod sampling;
pub mod series;

mod observer;
mod readings;
mod runge_kutta;

pub use digest::{Cycle, CycleStatistics, EventDigest};
pub use options::{FORESEEN_STEPS, Method, OutputOptions, OutputWindow, SolverOptions};
pub use record::{Channels, Event, EventKind, Recorder, RecorderError, Sample, Segment, State};

use crate::hybrid::{self, ChosenSolver, EngineError, Limits, RunError, Start};
use crate::model::axial::AxialMotion;
use crate::model::slow_stick::SlowStick;
use crate::model::torsion::{DIMENSION, index::ROTOR_SPEED};
use crate::model::{Mode, Parameters};
use brake::{Brake, Location, Watch};
use observer::Recording;
use plan::Plan;
use readings::TwistReadings;
use rules::BrakeRules;
use std::ops::ControlFlow;
use std::sync::Arc;

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// s.
    pub time: f64,
    pub mode: Mode,
    /// Events of the mode word so far.
    pub events: usize,
}

/// What is left of a run in memory: everything else went to the recorder.
#[derive(Debug, Clone, Default)]
pub struct RunReport {
    /// Where it ended, s.
    pub end: f64,
    /// Ended early by the control.
    pub interrupted: bool,
    /// All events; none if the recorder stores them ([`Recorder::stores_events`]).
    pub events: Vec<Event>,
    /// What is kept of the events in any case.
    pub digest: EventDigest,
    /// Solver work, one row for each solver used.
    pub work: Vec<SolverWork>,
    /// Largest |residual| of the energy balance at samples and events, J.
    pub energy_residual: f64,
    /// Total energy at the start, J.
    pub initial_energy: f64,
    /// Kicks of the case that the run did not come to.
    pub kicks_never_given: usize,
    /// Of these, kicks set at an instability that did not come.
    pub kicks_without_instability: usize,
    /// The first stop came at the end of sliding that was followed on its slow manifold: no rounding had grown.
    pub stopped_smoothly: bool,
}

impl RunReport {
    /// Counts the kicks that the run did not come to; `waiting` are those that wait for an instability.
    fn count_kicks(&mut self, parameters: &Parameters, waiting: usize) {
        self.kicks_never_given = parameters.perturbations.len().saturating_sub(self.digest.kicks_given);
        self.kicks_without_instability = waiting;
    }
}

/// What one solver did in a run.
#[derive(Debug, Clone, PartialEq)]
pub struct SolverWork {
    pub solver: &'static str,
    pub segments: u64,
    /// Simulated time, s.
    pub time: f64,
    pub steps: u64,
    pub rhs_evaluations: u64,
    pub jacobian_evaluations: u64,
}

/// A run that failed, with what it had computed. Its message ends with what to do, in the words of the case file.
#[derive(Debug, thiserror::Error)]
#[error("{error}{}", remedy(error))]
pub struct RunFailure {
    #[source]
    pub error: RunError,
    pub report: RunReport,
}

fn remedy(error: &RunError) -> &'static str {
    match error {
        RunError::Engine {
            source: EngineError::Sundials(_),
            ..
        }
        | RunError::NotFinite { .. } => "; another solver.method, solver.rtol or solver.max_step may get over it",
        RunError::Engine { .. } => ". Try another solver.method",
        RunError::Chattering { .. } => {
            ". Each transition is undone at once; with a one-sided breakaway test that is a property of the test, and \
             contact.breakaway_test = \"transmitted\" is free of it"
        }
        RunError::TooManyEvents { .. } => ". Raise solver.max_events if so many are expected",
        RunError::Overflow { .. } => {
            ". The case is beyond what double precision can hold: check its numbers and their units"
        }
        RunError::TooManySteps { .. } => {
            ". Raise solver.max_steps if so many are expected, or try another solver.method"
        }
        RunError::OutOfTime { .. } => ". Raise --max-wall-time (solver.max_wall_time), or try another solver.method",
        RunError::Standstill { .. } => ". Check the numbers of the case and their units, or try another solver.method",
        RunError::NoProgress { .. } => {
            ". Check the numbers of the case and their units, or try another solver.method or a larger solver.rtol; if so \
             many steps are meant, say how many with solver.max_steps"
        }
        RunError::Observer(_) => "",
    }
}

/// This many transitions within a twentieth of the natural period are chattering.
const CHATTER_COUNT: usize = 32;

/// The solver with its tolerances and longest step, as a run of this case uses it: (in smooth sliding, where the fast mode
/// is resolved).
pub fn chosen_solvers(parameters: &Parameters, solver: &SolverOptions) -> (ChosenSolver, ChosenSolver) {
    let axial = AxialMotion::new(&parameters.axial, &parameters.actuation);
    let plan = Plan::new(parameters, axial.largest_force(), solver);
    let sliding = |resolved| Location {
        mode: Mode::SlipForward,
        resolved,
        watch: Watch::Stable,
    };
    (plan.solver(&sliding(false)), plan.solver(&sliding(true)))
}

/// Integrates one case from t = 0 to the end time of `output`.
///
/// Rows go to `recorder` in order of time. `control` is asked now and then; `Break` ends the run in good order.
///
/// # Errors
/// Solver failures, chattering, an exhausted event budget, or an error of the recorder, each with time and mode.
pub fn simulate(
    parameters: &Parameters,
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<RunReport, Box<RunFailure>> {
    if solver.method == Method::Paper {
        return procedure::run(parameters, solver, output, recorder, control);
    }
    let mut brake = Brake::new(parameters);
    let plan = Plan::new(parameters, brake.axial.largest_force(), solver);
    if plan.follows_slow_stick() {
        brake.slow_stick = Some(SlowStick::new(&brake.torsion));
    }
    let brake = Arc::new(brake);
    let mut rules = BrakeRules::new(brake.clone(), parameters, plan, output.end_time);
    let mut state = vec![0.0; DIMENSION];
    state[ROTOR_SPEED] = parameters.initial.speed;
    let location = rules.initial_location(&state);
    let readings = TwistReadings {
        brake: &brake,
        axial: parameters.axial,
    };
    let mut recording = Recording::new(readings, parameters, output, recorder, control, &state);
    recording.limit_wall_time(solver.max_wall_time);
    let start = Start {
        time: 0.0,
        location,
        state,
    };
    // Who says how long the steps are, or how many, knows how many that makes.
    let foresee = solver.max_steps.is_none() && solver.max_step.is_none() && solver.fixed_step.is_none();
    let limits = Limits {
        max_events: solver.max_events,
        chatter_count: CHATTER_COUNT,
        max_steps: solver.max_steps.map(|steps| steps as u64),
        foreseen_steps: foresee.then_some(FORESEEN_STEPS),
    };
    let result = hybrid::run(&brake, &mut rules, start, output.end_time, limits, &mut recording);
    let result = match result {
        Ok(finish) if finish.interrupted => recording.in_time(finish.time, &finish.location).map(|()| finish),
        other => other,
    };
    let mut report = recording.into_report();
    report.count_kicks(parameters, rules.kicks_never_given());
    report.stopped_smoothly = rules.stopped_smoothly();
    match result {
        Ok(finish) => {
            report.end = finish.time;
            report.interrupted = finish.interrupted;
            Ok(report)
        }
        Err(error) => Err(Box::new(RunFailure { error, report })),
    }
}

/// A recorder that keeps nothing.
#[derive(Debug, Default)]
pub struct NoRecorder;

impl Recorder for NoRecorder {
    fn sample(&mut self, _: &Sample) -> Result<(), RecorderError> {
        Ok(())
    }
    fn event(&mut self, _: &Event) -> Result<(), RecorderError> {
        Ok(())
    }
    fn segment(&mut self, _: &Segment) -> Result<(), RecorderError> {
        Ok(())
    }
}

/// A recorder that keeps everything in memory: for tests and short runs.
#[derive(Debug, Default)]
pub struct MemoryRecorder {
    pub samples: Vec<Sample>,
    pub events: Vec<Event>,
    pub segments: Vec<Segment>,
}

impl Recorder for MemoryRecorder {
    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.samples.push(*sample);
        Ok(())
    }
    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.events.push(*event);
        Ok(())
    }
    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        self.segments.push(segment.clone());
        Ok(())
    }
}
