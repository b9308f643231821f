//! The front door: one run of a case.

use crate::case::Case;
use crate::model::system::System;
use crate::record::{NoRecorder, Recorder};
use crate::simulation::ensemble::Seat;
use crate::simulation::{self, Method, OutputOptions, Progress, RunFailure, RunReport, SolverOptions, procedure};
use crate::workers::go_on_unless;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A run that is being prepared; [`Run::start`] computes it.
///
/// ```
/// use stickslip::Run;
/// use stickslip::case::{Case, CaseSource};
/// use stickslip::record::MemoryRecorder;
///
/// let case = Case::read(&CaseSource::built_in("paper-si")?, &[])?;
/// let mut recorder = MemoryRecorder::default();
/// let report = Run::new(&case).record(&mut recorder).start()?;
/// assert_eq!(report.end, case.output.end_time);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "nothing is computed before `start`"]
pub struct Run<'a> {
    problem: simulation::Problem<'a>,
    solver: &'a SolverOptions,
    output: &'a OutputOptions,
    recorder: Option<&'a mut dyn Recorder>,
    control: Option<Box<dyn FnMut(Progress) -> ControlFlow<()> + 'a>>,
}

impl<'a> Run<'a> {
    /// The run that a case describes.
    pub fn new(case: &'a Case) -> Self {
        let problem = simulation::Problem {
            system: &case.system,
            threshold: case.threshold,
            further: case.words.numbers_parts(),
            seat: None,
        };
        Run::prepared(problem, &case.solver, &case.output)
    }

    /// The run of a system that comes from no case. The numbers are taken as they are: only [`Case::read`] validates. `threshold`
    /// (rad/s) is the speed below which a contact without stick counts as stuck; others do not use it.
    pub fn of_system(system: &'a System, threshold: f64, solver: &'a SolverOptions, output: &'a OutputOptions) -> Self {
        let problem = simulation::Problem {
            system,
            threshold,
            further: true,
            seat: None,
        };
        Run::prepared(problem, solver, output)
    }

    fn prepared(problem: simulation::Problem<'a>, solver: &'a SolverOptions, output: &'a OutputOptions) -> Self {
        Run {
            problem,
            solver,
            output,
            recorder: None,
            control: None,
        }
    }

    /// Another solver than the case's.
    pub fn solver(mut self, solver: &'a SolverOptions) -> Self {
        self.solver = solver;
        self
    }

    /// Another output, and with it another end time, than the case's.
    pub fn output(mut self, output: &'a OutputOptions) -> Self {
        self.output = output;
        self
    }

    /// Who takes samples, events and segments, in order of time; without one, the run keeps its events in the report, and
    /// nothing else.
    pub fn record(mut self, recorder: &'a mut dyn Recorder) -> Self {
        self.recorder = Some(recorder);
        self
    }

    /// The seat of the run in an [ensemble](simulation::ensemble), whose control waits there.
    pub(crate) fn seated(mut self, seat: Option<&'a Arc<Seat>>) -> Self {
        self.problem.seat = seat;
        self
    }

    /// What is asked now and then while the run goes on; `Break` ends it in good order.
    pub fn control(mut self, control: impl FnMut(Progress) -> ControlFlow<()> + 'a) -> Self {
        self.control = Some(Box::new(control));
        self
    }

    /// Asked now and then while the run goes on; `true` ends it in good order.
    pub fn stop(self, stop: impl Fn() -> bool + 'a) -> Self {
        self.control(move |_| go_on_unless(stop()))
    }

    /// Computes the run from t = 0 to the end time of its output.
    ///
    /// # Errors
    /// Solver failures, chattering, an exhausted budget of events or steps, or an error of the recorder, each with time and
    /// mode, and the report of what was computed.
    pub fn start(self) -> Result<RunReport, Box<RunFailure>> {
        let mut go_on = |_| ControlFlow::Continue(());
        let mut control = self.control;
        let control: &mut dyn FnMut(Progress) -> ControlFlow<()> = match &mut control {
            Some(control) => control,
            None => &mut go_on,
        };
        let mut nobody = NoRecorder;
        let recorder = self.recorder.unwrap_or(&mut nobody);
        let problem = self.problem;
        match self.solver.method {
            Method::Paper => procedure::run(problem, self.solver, self.output, recorder, control),
            _ => simulation::simulate(problem, self.solver, self.output, recorder, control),
        }
    }
}
