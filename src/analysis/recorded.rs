//! A run of a case into a recorder, and what it comes to.

use super::Summary;
use super::attractor::Recurrence;
use super::trains::{self, TrainWitness};
use super::warning::{self, Warning};
use super::witness::{Remembering, Sequence, Testimony, Witness, witness};
use crate::case::CaseRef;
use crate::record::{EventKind, Recorder};
use crate::results::{Status, StickSlipTable, WitnessAttributes};
use crate::run::Run;
use crate::simulation::{Progress, RunFailure, RunReport};
use serde::Serialize;
use std::ops::ControlFlow;

/// A run that is over.
pub(crate) struct Recorded<'a> {
    case: CaseRef<'a>,
    /// Of what was computed.
    pub report: RunReport,
    /// The same in numbers.
    pub summary: Summary,
    /// How it ended.
    pub status: Status,
    /// Why it failed.
    pub failure: Option<Box<RunFailure>>,
    events: Events,
}

/// The events of a run, as its witness is held against them.
enum Events {
    Brake(Sequence),
    Trains(Vec<(f64, EventKind)>),
}

/// What another method makes of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum KeptWitness {
    /// Of a brake.
    Brake(Witness),
    /// Of two trains.
    Trains(TrainWitness),
}

impl KeptWitness {
    /// What it says.
    pub fn testimony(&self) -> Testimony {
        match self {
            KeptWitness::Brake(witness) => witness.testimony,
            KeptWitness::Trains(witness) => witness.testimony,
        }
    }

    /// The same in words.
    pub fn statement(&self) -> &str {
        match self {
            KeptWitness::Brake(witness) => &witness.statement,
            KeptWitness::Trains(witness) => &witness.statement,
        }
    }

    /// The attributes of /witness in a result file.
    pub(crate) fn attributes(&self) -> WitnessAttributes {
        match self {
            KeptWitness::Brake(witness) => witness.attributes(),
            KeptWitness::Trains(witness) => witness.attributes(),
        }
    }
}

/// Runs a case into a recorder. The report keeps the events, too, if it is to.
pub(crate) fn recorded<'a>(
    case: CaseRef<'a>,
    recorder: &mut dyn Recorder,
    keeps_events: bool,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Recorded<'a> {
    let run = |recorder: &mut dyn Recorder| {
        let ended = Run::new(case).record(recorder).control(control).start();
        match ended {
            Ok(report) => (report, None),
            Err(mut failure) => {
                let report = std::mem::take(&mut failure.report);
                // Its message is in the words of the case file.
                failure.report.one_sided_test = report.one_sided_test;
                (report, Some(failure))
            }
        }
    };
    let (report, failure, summary, events) = match case {
        CaseRef::Brake(brake) => {
            let mut recorder = Remembering::new(recorder, keeps_events);
            let (report, failure) = run(&mut recorder);
            let summary = Summary::of_run(&brake.parameters, &report);
            (report, failure, summary, Events::Brake(recorder.into_sequence()))
        }
        CaseRef::Trains(trains) => {
            let mut recurrence = Recurrence::new(&trains.parameters, recorder);
            if keeps_events {
                recurrence.keep_events();
            }
            let (report, failure) = run(&mut recurrence);
            let summary = Summary::of_motion(trains, &report, &recurrence);
            (report, failure, summary, Events::Trains(recurrence.into_events()))
        }
    };
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
    pub fn witness(&self, stop: &dyn Fn() -> bool) -> Option<KeptWitness> {
        if self.status != Status::Complete {
            return None;
        }
        match (self.case, &self.events) {
            (CaseRef::Brake(case), Events::Brake(sequence)) => {
                witness(case, sequence, self.summary.noise_determined, stop).map(KeptWitness::Brake)
            }
            (CaseRef::Trains(case), Events::Trains(events)) => {
                trains::witness(case, events, &self.report.work, stop).map(KeptWitness::Trains)
            }
            _ => None,
        }
    }

    /// What a reader of the numbers has to know.
    pub fn warnings(&self, witness: Option<&KeptWitness>) -> Vec<Warning> {
        let mut warnings = warning::warnings(self.case, &self.summary);
        if let Some(KeptWitness::Trains(witness)) = witness
            && witness.testimony == Testimony::SequenceDiffers
        {
            warnings.push(Warning::OtherSequence {
                statement: witness.statement.clone(),
            });
        }
        warnings
    }

    /// What a file says of the run beside its rows.
    pub fn table(&self) -> StickSlipTable {
        self.summary.table(self.case.form())
    }
}
