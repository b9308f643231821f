//! The front door: one run of a case.

use crate::case::CaseRef;
use crate::model::Parameters;
use crate::model::trains::Trains;
use crate::record::{NoRecorder, Recorder};
use crate::simulation::{Method, OutputOptions, Progress, RunFailure, RunReport, SolverOptions, procedure, trains};
use std::ops::ControlFlow;

/// A run that is being prepared; [`Run::start`] computes it.
///
/// ```
/// use stickslip::Run;
/// use stickslip::case::{Case, CaseSource};
/// use stickslip::record::MemoryRecorder;
///
/// let case = Case::parse(&CaseSource::built_in("paper-si")?, &[])?;
/// let mut recorder = MemoryRecorder::default();
/// let report = Run::new(&case).record(&mut recorder).start()?;
/// assert_eq!(report.end, case.output.end_time);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "nothing is computed before `start`"]
pub struct Run<'a> {
    problem: Problem<'a>,
    solver: &'a SolverOptions,
    output: &'a OutputOptions,
    recorder: Option<&'a mut dyn Recorder>,
    control: Option<Box<dyn FnMut(Progress) -> ControlFlow<()> + 'a>>,
}

/// What is run.
enum Problem<'a> {
    Brake(&'a Parameters),
    /// With the speed (rad/s) below which a contact without stick counts as stuck.
    Trains(&'a Trains, f64),
}

impl<'a> Run<'a> {
    /// The run that a case of either form describes.
    pub fn new(case: impl Into<CaseRef<'a>>) -> Self {
        match case.into() {
            CaseRef::Brake(case) => Run::of(&case.parameters, &case.solver, &case.output),
            CaseRef::Trains(case) => Run::of_trains(
                &case.parameters,
                case.threshold.unwrap_or(0.0),
                &case.solver,
                &case.output,
            ),
        }
    }

    /// The run of a brake that comes from no case. The parameters are taken as they are: only [`Case::parse`](crate::case::Case::parse) validates.
    pub fn of(parameters: &'a Parameters, solver: &'a SolverOptions, output: &'a OutputOptions) -> Self {
        Run::prepared(Problem::Brake(parameters), solver, output)
    }

    /// The run of two trains that come from no case. The numbers are taken as they are. `threshold` (rad/s) is the speed below
    /// which a contact without stick counts as stuck; others do not use it.
    pub fn of_trains(trains: &'a Trains, threshold: f64, solver: &'a SolverOptions, output: &'a OutputOptions) -> Self {
        Run::prepared(Problem::Trains(trains, threshold), solver, output)
    }

    fn prepared(problem: Problem<'a>, solver: &'a SolverOptions, output: &'a OutputOptions) -> Self {
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

    /// What is asked now and then while the run goes on; `Break` ends it in good order.
    pub fn control(mut self, control: impl FnMut(Progress) -> ControlFlow<()> + 'a) -> Self {
        self.control = Some(Box::new(control));
        self
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
        let lowered;
        let problem = match self.problem {
            Problem::Brake(parameters) => {
                lowered = Trains::from(parameters);
                trains::Problem {
                    trains: &lowered,
                    threshold: 0.0,
                    further: false,
                }
            }
            Problem::Trains(trains, threshold) => trains::Problem {
                trains,
                threshold,
                further: true,
            },
        };
        match self.solver.method {
            Method::Paper => procedure::run(problem, self.solver, self.output, recorder, control),
            _ => trains::simulate(problem, self.solver, self.output, recorder, control),
        }
    }
}
