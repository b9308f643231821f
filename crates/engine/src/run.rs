//! Entry point: one run of a system.

use crate::simulation::{self, Method, OutputOptions, RunFailure, RunReport, SolverOptions, procedure};
use stickslip_system::model::system::System;
use stickslip_system::record::{NoRecorder, Recorder};
use stickslip_system::watch::Watch;

/// A source of a system and its options, such as a case.
pub trait Runnable {
    /// The system.
    fn system(&self) -> &System;
    /// Relative velocity (rad/s) below which a contact without stick counts as stuck.
    fn threshold(&self) -> f64;
    /// Whether the inner bodies have columns of their own, besides the two surfaces and their masses.
    fn numbers_parts(&self) -> bool;
    /// Method and tolerances.
    fn solver(&self) -> &SolverOptions;
    /// Samples and end time.
    fn output(&self) -> &OutputOptions;
}

/// A run that is being prepared; [`Run::start`] computes it.
#[must_use = "nothing is computed before `start`"]
pub struct Run<'a> {
    problem: simulation::Simulation<'a>,
    solver: &'a SolverOptions,
    output: &'a OutputOptions,
    recorder: Option<&'a mut dyn Recorder>,
    watch: &'a dyn Watch,
}

impl<'a> Run<'a> {
    /// The run described by a case.
    pub fn new(case: &'a impl Runnable) -> Self {
        let problem = simulation::Simulation {
            system: case.system(),
            threshold: case.threshold(),
            further: case.numbers_parts(),
        };
        Run::prepared(problem, case.solver(), case.output())
    }

    /// The run of a system without a case. Values are used as given: only reading a case validates. `threshold` (rad/s)
    /// is the speed below which a contact without stick counts as stuck.
    pub fn of_system(system: &'a System, threshold: f64, solver: &'a SolverOptions, output: &'a OutputOptions) -> Self {
        let problem = simulation::Simulation {
            system,
            threshold,
            further: true,
        };
        Run::prepared(problem, solver, output)
    }

    fn prepared(problem: simulation::Simulation<'a>, solver: &'a SolverOptions, output: &'a OutputOptions) -> Self {
        Run {
            problem,
            solver,
            output,
            recorder: None,
            watch: &(),
        }
    }

    /// Replaces the case's solver.
    pub fn solver(mut self, solver: &'a SolverOptions) -> Self {
        self.solver = solver;
        self
    }

    /// Replaces the case's output options, including the end time.
    pub fn output(mut self, output: &'a OutputOptions) -> Self {
        self.output = output;
        self
    }

    /// Sets the recorder, which receives samples, events and segments in order of time. Without one only the events
    /// are kept, in the report.
    pub fn record(mut self, recorder: &'a mut dyn Recorder) -> Self {
        self.recorder = Some(recorder);
        self
    }

    /// Sets the observer, which learns the time of the run (s) now and then, and may end the run in good order.
    pub fn watch(mut self, watch: &'a dyn Watch) -> Self {
        self.watch = watch;
        self
    }

    /// Computes the run from t = 0 to the end time of its output.
    ///
    /// # Errors
    /// Solver failure, chattering, an exhausted budget of events or steps, or an error of the recorder, each with time
    /// and mode, and the report of the run so far.
    pub fn start(self) -> Result<RunReport, Box<RunFailure>> {
        let mut nobody = NoRecorder;
        let recorder = self.recorder.unwrap_or(&mut nobody);
        let problem = self.problem;
        match self.solver.method {
            Method::Paper => procedure::run(problem, self.solver, self.output, recorder, self.watch),
            _ => simulation::simulate(problem, self.solver, self.output, recorder, self.watch),
        }
    }
}
