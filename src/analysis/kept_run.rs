//! A run of a case of either form that is kept in memory, and what it comes to.

use super::headline::is_paper_case;
use super::trains::{self, TrainSummary, TrainWitness};
use super::warning::warnings;
use super::witness::{Remembering, Witness, witness};
use super::{Headline, HeadlineRow, Summary};
use crate::case::AnyCase;
use crate::provenance;
use crate::results::{
    Header, KeptEnd, KeptRows, KeptView, MetaValue, Overwrite, ResultError, ResultWriter, Status, StickSlipTable,
    WitnessAttributes,
};
use crate::run::Run;
use crate::simulation::{Progress, RunFailure, RunReport};
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A run in memory that is being prepared; [`KeptRun::start`] computes it.
///
/// ```
/// use stickslip::analysis::KeptRun;
/// use stickslip::case::{AnyCase, CaseSource};
///
/// let case = AnyCase::read(&CaseSource::built_in("paper-si")?, &[])?;
/// let kept = KeptRun::new(&case).start();
/// println!("{} events", kept.rows.tables[1].rows());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "nothing is computed before `start`"]
pub struct KeptRun<'a> {
    case: &'a AnyCase,
    header: Header,
    witness: bool,
    events_alone: bool,
    control: Option<Box<dyn FnMut() -> ControlFlow<()> + 'a>>,
}

/// What a run comes to, in numbers.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum KeptSummary {
    /// Of a brake.
    Brake(Box<Summary>),
    /// Of two trains.
    Trains(Box<TrainSummary>),
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
    fn attributes(&self) -> WitnessAttributes {
        match self {
            KeptWitness::Brake(witness) => witness.attributes(),
            KeptWitness::Trains(witness) => witness.attributes(),
        }
    }
}

/// A run in memory: its rows, and what its result file says beside them.
#[derive(Debug)]
pub struct KeptReport {
    /// Every row.
    pub rows: KeptRows,
    /// How it ended, and what a file says of it beside its rows.
    pub end: KeptReportEnd,
    /// Why the run failed.
    pub failure: Option<Box<RunFailure>>,
}

/// How a run ended, and what a file says of it beside its rows.
#[derive(Debug)]
pub struct KeptReportEnd {
    /// How it ended.
    pub status: Status,
    /// In numbers.
    pub summary: KeptSummary,
    /// What a reader of the numbers has to know.
    pub warnings: Vec<String>,
    /// If it was asked for; none beside a run that is not complete.
    pub witness: Option<KeptWitness>,
    /// s.
    pub wall_time: f64,
    case: AnyCase,
    header: Header,
    table: StickSlipTable,
}

impl KeptReportEnd {
    /// The run as a reader sees it. The numbers of the paper stand beside those of its own case.
    pub fn headline(&self) -> Vec<HeadlineRow> {
        match (&self.summary, &self.case) {
            (KeptSummary::Brake(summary), case) => {
                let mut rows = Headline::from(&**summary).rows();
                if !matches!(case, AnyCase::Brake(case) if is_paper_case(&case.parameters)) {
                    rows.iter_mut().for_each(|row| row.paper = "");
                }
                rows
            }
            (KeptSummary::Trains(summary), AnyCase::Trains(case)) => trains::headline::rows(case.motion, summary),
            (KeptSummary::Trains(_), AnyCase::Brake(_)) => Vec::new(),
        }
    }

    /// The case as it was given.
    pub fn case_text(&self) -> &str {
        &self.header.case_text
    }

    /// The case in SI, which repeats the run.
    pub fn resolved(&self) -> &str {
        &self.header.resolved
    }

    /// The attributes of /stick_slip in a file.
    pub fn stick_slip(&self) -> &StickSlipTable {
        &self.table
    }

    /// Attributes of /meta in a file: program, platform, method, tolerances.
    pub fn meta(&self) -> &[(String, MetaValue)] {
        &self.header.meta
    }

    /// Of the case.
    pub fn title(&self) -> &str {
        &self.header.title
    }

    /// Writes the result file of the run, with its rows: the bytes are those of the file that
    /// [`SavedRun`](crate::SavedRun) writes, but for what tells when and by which command. Returns where it is: of a run that is
    /// not complete the partial file.
    ///
    /// # Errors
    /// Another file is there that may not be replaced, or a failure to write.
    pub fn write(&self, path: &Path, overwrite: Overwrite, rows: &KeptView<'_>) -> Result<PathBuf, ResultError> {
        let witness = self.witness.as_ref().map(KeptWitness::attributes);
        let end = KeptEnd {
            status: &self.status,
            stick_slip: &self.table,
            witness: witness.as_ref(),
            wall_time: self.wall_time,
        };
        ResultWriter::write_kept(path, overwrite, &self.header, rows, &end)
    }
}

impl<'a> KeptRun<'a> {
    /// The run that a case describes.
    pub fn new(case: &'a AnyCase) -> Self {
        let mut header = match case {
            AnyCase::Brake(case) => Header::new(case, String::new()),
            AnyCase::Trains(case) => Header::of_trains(case, String::new()),
        };
        header.case_text.clone_from(&header.resolved);
        KeptRun {
            case,
            header,
            witness: false,
            events_alone: false,
            control: None,
        }
    }

    /// The case as it was given, for the file; else it holds the resolved one twice.
    pub fn text(mut self, text: &str) -> Self {
        text.clone_into(&mut self.header.case_text);
        self
    }

    /// Keep no sample. What the case says of them still costs time; see [`AnyCase::without_trajectory`].
    pub fn events_alone(mut self, wanted: bool) -> Self {
        self.events_alone = wanted;
        self
    }

    /// Ask another method, after the run.
    pub fn witness(mut self, wanted: bool) -> Self {
        self.witness = wanted;
        self
    }

    /// What is asked now and then while the run, and its witness, go on; `Break` ends them in good order.
    pub fn control(mut self, control: impl FnMut() -> ControlFlow<()> + 'a) -> Self {
        self.control = Some(Box::new(control));
        self
    }

    /// Computes the run, to its end or as far as it comes.
    pub fn start(self) -> KeptReport {
        let KeptRun {
            case: any,
            header,
            witness: wants_witness,
            events_alone,
            control,
        } = self;
        let clock = Instant::now();
        let mut control = control;
        let mut stopped = false;
        let mut go_on = move || {
            if !stopped && let Some(control) = &mut control {
                stopped = control().is_break();
            }
            if stopped {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let mut rows = KeptRows::new(&provenance::extension_of(any));
        if events_alone {
            rows = rows.events_alone();
        }
        match any {
            AnyCase::Brake(case) => {
                let mut recorder = Remembering::new(&mut rows, false);
                let result = Run::new(case).record(&mut recorder).control(|_| go_on()).start();
                let sequence = recorder.into_sequence();
                let (report, failure) = parts(result);
                let summary = Summary::of_run(&case.parameters, &report);
                let status = status_of(&report, failure.as_deref());
                let asks = std::cell::RefCell::new(&mut go_on);
                let witness = (status == Status::Complete && wants_witness)
                    .then(|| {
                        let stop = || (asks.borrow_mut())().is_break();
                        witness(case, &sequence, summary.noise_determined, &stop)
                    })
                    .flatten();
                let warnings = warnings(case, &summary);
                let end = KeptReportEnd {
                    status,
                    case: any.clone(),
                    warnings: warnings.iter().map(ToString::to_string).collect(),
                    witness: witness.map(KeptWitness::Brake),
                    wall_time: clock.elapsed().as_secs_f64(),
                    header,
                    table: summary.table(),
                    summary: KeptSummary::Brake(Box::new(summary)),
                };
                KeptReport { rows, end, failure }
            }
            AnyCase::Trains(case) => {
                let mut told = |_: Progress| go_on();
                let (result, summary, events) = trains::recorded(case, &mut rows, false, &mut told);
                let (report, failure) = parts(result);
                let summary = summary(&report);
                let status = status_of(&report, failure.as_deref());
                let asks = std::cell::RefCell::new(&mut go_on);
                let witness = (status == Status::Complete && wants_witness)
                    .then(|| {
                        let stop = || (asks.borrow_mut())().is_break();
                        trains::witness(case, &events, &report.work, &stop)
                    })
                    .flatten();
                let end = KeptReportEnd {
                    status,
                    case: any.clone(),
                    warnings: trains::warnings(&case.solver, &summary, witness.as_ref()),
                    witness: witness.map(KeptWitness::Trains),
                    wall_time: clock.elapsed().as_secs_f64(),
                    header,
                    table: summary.table(case.motion),
                    summary: KeptSummary::Trains(Box::new(summary)),
                };
                KeptReport { rows, end, failure }
            }
        }
    }
}

/// The report of a run, and why it failed.
fn parts(result: Result<RunReport, Box<RunFailure>>) -> (RunReport, Option<Box<RunFailure>>) {
    match result {
        Ok(report) => (report, None),
        Err(mut failure) => (std::mem::take(&mut failure.report), Some(failure)),
    }
}

fn status_of(report: &RunReport, failure: Option<&RunFailure>) -> Status {
    match failure {
        Some(error) => Status::Failed(error.to_string()),
        None if report.interrupted => Status::Interrupted,
        None => Status::Complete,
    }
}
