//! A run of a case that is kept in memory, with its summary.

use super::headline::{HeadlineRow, headline};
use super::recorded::{Recorded, case_of_repetition, recorded};
use super::witness::Witness;
use crate::case::Case;
use crate::results::{Header, KeptEnd, KeptRows, KeptView, Overwrite, ResultError, ResultWriter};
use crate::workers::go_on_unless;
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

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
    /// What it comes to.
    pub end: KeptReportEnd,
}

/// How a run ended, and what a file says of it beside its rows.
#[derive(Debug)]
pub struct KeptReportEnd {
    /// The run.
    pub run: Recorded,
    /// What its file says at its begin.
    pub header: Header,
    case: Case,
}

impl KeptReportEnd {
    /// The run as a reader sees it. The numbers of the paper stand beside those of its own case.
    pub fn headline(&self) -> Vec<HeadlineRow> {
        headline(&self.case, &self.run.summary)
    }

    /// Writes the result file of the run, with its rows: the bytes are those of the file that
    /// [`SavedRun`](crate::SavedRun) writes, but for what tells when and by which command. Returns where it is: of a run that is
    /// not complete the partial file.
    ///
    /// # Errors
    /// Another file is there that may not be replaced, or a failure to write.
    pub fn write(&self, path: &Path, overwrite: Overwrite, rows: &KeptView<'_>) -> Result<PathBuf, ResultError> {
        let run = &self.run;
        let witness = run.witness.as_ref().map(Witness::additions);
        let end = KeptEnd {
            status: &run.status,
            stick_slip: &run.table,
            witness: witness.as_ref().map_or(&[], |additions| &additions[..]),
            wall_time: run.wall_time,
        };
        ResultWriter::write_kept(path, overwrite, &self.header, rows, &end)
    }
}

impl<'a> KeptRun<'a> {
    /// The run that a case describes.
    pub fn new(case: &'a Case) -> Self {
        KeptRun {
            case,
            header: Header::new(case),
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

    /// Ask another method, after the run. Where it does not agree, the run is made again with finer settings, if these help.
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
        let KeptRun { case, mut header, .. } = self;
        let (mut control, mut stopped) = (self.control, false);
        let asked = RefCell::new(move || {
            if !stopped && let Some(control) = &mut control {
                stopped = control().is_break();
            }
            stopped
        });
        let stop = || (asked.borrow_mut())();
        let stop_of_witness: Option<&dyn Fn() -> bool> = if self.witness { Some(&stop) } else { None };
        let mut rows = KeptRows::new(&header.extension);
        if self.events_alone {
            rows = rows.events_alone();
        }
        let mut asked = |_| go_on_unless(stop());
        let mut run = recorded(case, &mut rows, false, stop_of_witness, None, &mut asked);
        let mut case = case.clone();
        let again = stop_of_witness.and_then(|stop| case_of_repetition(&case, &run, stop));
        if let Some((finer, why)) = again {
            header = header.of_repetition(&finer);
            rows = rows.emptied(&header.extension);
            run = recorded(&finer, &mut rows, false, stop_of_witness, None, &mut asked);
            run.repeated(why);
            case = finer;
        }
        run.find_exponent(&case);
        KeptReport {
            rows,
            end: KeptReportEnd { run, header, case },
        }
    }
}
