//! A run of a case into a recorder, with its summary, its warnings and its witness.

use super::Summary;
use super::attractor::Recurrence;
use super::exponent::exponent;
use super::repetition::repetition;
use super::warning::{Warning, warnings};
use super::witness::{Witness, witness};
use crate::case::Case;
use crate::record::Recorder;
use crate::results::{Status, StickSlipTable};
use crate::run::Run;
use crate::simulation::ensemble::Seat;
use crate::simulation::{Progress, RunFailure, RunReport, Section, SolverOptions};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// A run that is over, and what it comes to.
#[derive(Debug)]
pub struct Recorded {
    /// The settings by which it ran.
    pub solver: SolverOptions,
    /// How it ended.
    pub status: Status,
    /// Of what was computed.
    pub report: RunReport,
    /// The same in numbers.
    pub summary: Summary,
    /// What a reader of the numbers has to know.
    pub warnings: Vec<Warning>,
    /// What another method makes of the case, if that was asked for; none beside a run that is not complete.
    pub witness: Option<Witness>,
    /// Why the run failed; its report is [`Self::report`].
    pub failure: Option<Box<RunFailure>>,
    /// Attributes of /stick_slip in a file.
    pub table: StickSlipTable,
    /// Of the run, without its witness, s.
    pub wall_time: f64,
    /// The state at the end of a complete run, and the time between its sections, s.
    end: Option<(Section, Option<f64>)>,
}

impl Recorded {
    /// Computes the largest Lyapunov exponent, which takes up to a second, if the motion of the case has no period.
    pub(super) fn find_exponent(&mut self, case: &Case) {
        let Some((end, section)) = self.end.take().filter(|_| self.summary.goes_on()) else {
            return;
        };
        self.summary.exponent = exponent(&case.system, case.threshold, &end, section);
        self.table = self.summary.table(case);
    }

    /// Says in the witness that the run is a repetition, and why.
    pub(crate) fn repeated(&mut self, why: String) {
        if let Some(witness) = &mut self.witness {
            witness.repeated = Some(why);
        }
    }
}

/// Runs a case into a recorder, on a seat if it runs in an ensemble. With `keeps_events` the report has the events, too. A witness runs
/// beside a complete run if `witness_until` is there; it is given up where that says so.
pub(crate) fn recorded(
    case: &Case,
    recorder: &mut dyn Recorder,
    keeps_events: bool,
    witness_until: Option<&dyn Fn() -> bool>,
    seat: Option<&Arc<Seat>>,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Recorded {
    let clock = Instant::now();
    let mut recurrence = Recurrence::new(&case.system, recorder, keeps_events, Some(case.output.end_time));
    let run = Run::new(case).record(&mut recurrence).control(control).seated(seat);
    let (report, failure) = match run.start() {
        Ok(report) => (report, None),
        Err(mut failure) => {
            let report = std::mem::take(&mut failure.report);
            // Its message is in the words of the case file.
            failure.report.one_sided_test = report.one_sided_test;
            (report, Some(failure))
        }
    };
    let wall_time = clock.elapsed().as_secs_f64();
    let summary = Summary::of_motion(case, &report, &recurrence);
    let status = match &failure {
        Some(error) => Status::Failed(error.to_string()),
        None if report.interrupted => Status::Interrupted,
        None => Status::Complete,
    };
    let noise = summary.noise_determined;
    let witness = witness_until
        .filter(|_| status == Status::Complete)
        .and_then(|stop| witness(case, &recurrence.sequence, noise, stop));
    let mut warnings = warnings(case, &summary);
    warnings.extend(witness.as_ref().and_then(Witness::warning));
    let end = recurrence.last_state().filter(|_| status == Status::Complete);
    Recorded {
        end: end.map(|end| (end.clone(), recurrence.mean_interval())),
        solver: case.solver.clone(),
        table: summary.table(case),
        status,
        report,
        summary,
        warnings,
        witness,
        failure,
        wall_time,
    }
}

/// The case of a run with finer settings, and why, if the run and its witness do not agree and these make them
/// ([`repetition`]).
pub(crate) fn case_of_repetition(case: &Case, run: &Recorded, stop: &dyn Fn() -> bool) -> Option<(Case, String)> {
    let (solver, why) = repetition(case, run.witness.as_ref()?, stop)?;
    let mut case = case.clone();
    case.solver = solver;
    Some((case, why))
}
