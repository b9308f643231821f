//! A run of a case into a recorder, and what it comes to.

use super::Summary;
use super::attractor::Recurrence;
use super::warning::{self, Warning};
use super::witness::{Remembering, Sequence, Witness, witness};
use crate::case::Case;
use crate::record::Recorder;
use crate::results::{Status, StickSlipTable};
use crate::run::Run;
use crate::simulation::{Progress, RunFailure, RunReport};
use std::ops::ControlFlow;

/// A run that is over.
pub(crate) struct Recorded<'a> {
    case: &'a Case,
    /// Of what was computed.
    pub report: RunReport,
    /// The same in numbers.
    pub summary: Summary,
    /// How it ended.
    pub status: Status,
    /// Why it failed.
    pub failure: Option<Box<RunFailure>>,
    events: Sequence,
}

/// Runs a case into a recorder. The report keeps the events, too, if it is to.
pub(crate) fn recorded<'a>(
    case: &'a Case,
    recorder: &mut dyn Recorder,
    keeps_events: bool,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Recorded<'a> {
    let mut recorder = Remembering::new(recorder, keeps_events);
    let mut recurrence = Recurrence::new(&case.system, &mut recorder);
    let (report, failure) = match Run::new(case).record(&mut recurrence).control(control).start() {
        Ok(report) => (report, None),
        Err(mut failure) => {
            let report = std::mem::take(&mut failure.report);
            // Its message is in the words of the case file.
            failure.report.one_sided_test = report.one_sided_test;
            (report, Some(failure))
        }
    };
    let summary = Summary::of_motion(case, &report, &recurrence);
    let events = recorder.into_sequence();
    let status = match &failure {
        Some(error) => Status::Failed(error.to_string()),
        None if report.interrupted => Status::Interrupted,
        None => Status::Complete,
    };
    Recorded {
        case,
        report,
        summary,
        status,
        failure,
        events,
    }
}

impl Recorded<'_> {
    /// What another method makes of the case: beside a complete run only, and never a reason for it to fail. `None` where `stop`
    /// says so.
    pub fn witness(&self, stop: &dyn Fn() -> bool) -> Option<Witness> {
        let complete = self.status == Status::Complete;
        let noise = self.summary.noise_determined;
        complete
            .then(|| witness(self.case, &self.events, noise, stop))
            .flatten()
    }

    /// What a reader of the numbers has to know.
    pub fn warnings(&self, witness: Option<&Witness>) -> Vec<Warning> {
        let mut warnings = warning::warnings(self.case, &self.summary);
        warnings.extend(witness.and_then(Witness::warning));
        warnings
    }

    /// What a file says of the run beside its rows.
    pub fn table(&self) -> StickSlipTable {
        self.summary.table(self.case)
    }
}
