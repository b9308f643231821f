//! Run of a case into a recorder, with summary, warnings and witness.

use super::Summary;
use super::attractor::Recurrence;
use super::exponent::exponent;
use super::repetition::repetition;
use super::warning::{Warning, warnings};
use super::witness::{Witness, witness};
use std::time::Instant;
use stickslip_case::Case;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{Progress, RunFailure, RunReport, Section, SolverOptions};
use stickslip_files::{Status, StickSlipTable};
use stickslip_system::record::Recorder;
use stickslip_system::watch::Watch;

/// A finished run with its results.
#[derive(Debug)]
pub struct Recorded {
    /// Solver settings of the run.
    pub solver: SolverOptions,
    /// Exit state of the run.
    pub status: Status,
    /// Report of the computed part.
    pub report: RunReport,
    /// Summary of the report.
    pub summary: Summary,
    /// Warnings about the result.
    pub warnings: Vec<Warning>,
    /// Check by another method, if requested; `None` for an incomplete run.
    pub witness: Option<Witness>,
    /// Reason of a failed run; the report is [`Self::report`].
    pub failure: Option<Box<RunFailure>>,
    /// Attributes of /stick_slip in a file.
    pub table: StickSlipTable,
    /// Wall time of the run without its witness, s.
    pub wall_time: f64,
    /// State at the end of a complete run, and the mean time between its sections (s).
    end: Option<(Section, Option<f64>)>,
}

impl Recorded {
    /// Takes up to a second.
    pub(super) fn find_exponent(&mut self, case: &Case) {
        let Some((end, section)) = self.end.take().filter(|_| self.summary.goes_on()) else {
            return;
        };
        self.summary.exponent = exponent(&case.system, case.threshold, &end, section);
        self.table = self.summary.table(case);
    }

    pub(crate) fn repeated(&mut self, why: String) {
        if let Some(witness) = &mut self.witness {
            witness.repeated = Some(why);
        }
    }
}

/// Runs a case into a recorder. A complete run gets a witness if one is `wanted`.
pub(crate) fn recorded(
    case: &Case,
    recorder: &mut dyn Recorder,
    keeps_events: bool,
    wanted: bool,
    watch: &dyn Watch,
) -> Recorded {
    let clock = Instant::now();
    let end_time = case.output.end_time;
    let control = |Progress { time, mode, events }: Progress| {
        let what = format_args!("t = {time:.6} s of {end_time} s, {}, {events} events", mode.name());
        watch.at(time, end_time, what)
    };
    let mut recurrence = Recurrence::new(&case.system, recorder, keeps_events, Some(end_time));
    let (report, failure) = match Run::new(case).record(&mut recurrence).control(control).start() {
        Ok(report) => (report, None),
        Err(mut failure) => {
            let report = std::mem::take(&mut failure.report);
            // The message uses the words of the case file.
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
    let witness = (wanted && status == Status::Complete)
        .then(|| witness(case, &recurrence.sequence, noise, &|| watch.stopped()))
        .flatten();
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

pub(crate) fn case_of_repetition(case: &Case, run: &Recorded, watch: &dyn Watch) -> Option<(Case, String)> {
    let (solver, why) = repetition(case, run.witness.as_ref()?, &|| watch.stopped())?;
    let mut case = case.clone();
    case.solver = solver;
    Some((case, why))
}
