//! A run of a case of either form that is kept in memory, and what it comes to.

use super::Summary;
use super::headline::{HeadlineRow, headline};
use super::recorded::{Recorded, recorded};
use super::witness::Witness;
use crate::case::Case;
use crate::provenance;
use crate::results::{
    AttributeValue, Header, KeptEnd, KeptRows, KeptView, Overwrite, ResultError, ResultWriter, Status, StickSlipTable,
};
use crate::simulation::{Progress, RunFailure};
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A run in memory that is being prepared; [`KeptRun::start`] computes it.
///
/// ```
/// use stickslip::analysis::KeptRun;
/// use stickslip::case::{Case, CaseSource};
///
/// let case = Case::read(&CaseSource::built_in("paper-si")?, &[])?;
/// let kept = KeptRun::new(&case).start();
/// println!("{} events", kept.rows.tables[1].rows());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "nothing is computed before `start`"]
pub struct KeptRun<'a> {
    case: &'a Case,
    header: Header,
    witness: bool,
    events_alone: bool,
    control: Option<Box<dyn FnMut() -> ControlFlow<()> + 'a>>,
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
    pub summary: Summary,
    /// What a reader of the numbers has to know.
    pub warnings: Vec<String>,
    /// If it was asked for; none beside a run that is not complete.
    pub witness: Option<Witness>,
    /// s.
    pub wall_time: f64,
    case: Case,
    header: Header,
    table: StickSlipTable,
}

impl KeptReportEnd {
    /// The run as a reader sees it. The numbers of the paper stand beside those of its own case.
    pub fn headline(&self) -> Vec<HeadlineRow> {
        headline(&self.case, &self.summary)
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
    pub fn meta(&self) -> &[(String, AttributeValue)] {
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
        let witness = self.witness.as_ref().map(Witness::attributes);
        let end = KeptEnd {
            status: &self.status,
            stick_slip: &self.table,
            witness: witness.as_deref(),
            wall_time: self.wall_time,
        };
        ResultWriter::write_kept(path, overwrite, &self.header, rows, &end)
    }
}

impl<'a> KeptRun<'a> {
    /// The run that a case describes.
    pub fn new(case: &'a Case) -> Self {
        let mut header = Header::new(case, String::new());
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

    /// Keep no sample. What the case says of them still costs time; see [`Case::without_trajectory`].
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
        let mut rows = KeptRows::new(&provenance::extension(any));
        if events_alone {
            rows = rows.events_alone();
        }
        let run = recorded(any, &mut rows, false, &mut |_: Progress| go_on());
        let asks = RefCell::new(&mut go_on);
        let stop = || (asks.borrow_mut())().is_break();
        let witness = if wants_witness { run.witness(&stop) } else { None };
        let (warnings, table) = (run.warnings(witness.as_ref()), run.table());
        let Recorded {
            summary,
            status,
            failure,
            ..
        } = run;
        let end = KeptReportEnd {
            status,
            case: any.clone(),
            warnings: warnings.iter().map(ToString::to_string).collect(),
            witness,
            wall_time: clock.elapsed().as_secs_f64(),
            header,
            table,
            summary,
        };
        KeptReport { rows, end, failure }
    }
}
