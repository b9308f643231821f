//! Run of a case in memory, with its summary.

use super::headline::{HeadlineRow, headline};
use super::recorded::{Recorded, case_of_repetition, recorded};
use crate::provenance;
use std::path::{Path, PathBuf};
use stickslip_case::Case;
use stickslip_files::{Header, KeptRows, KeptView, Overwrite, ResultError, ResultWriter};
use stickslip_system::watch::Watch;

/// Builder of a run in memory; [`KeptRun::start`] computes it.
///
/// ```
/// use stickslip_analysis::analysis::KeptRun;
/// use stickslip_case::{Case, CaseSource};
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
    watch: &'a dyn Watch,
}

/// Run in memory: the rows and the other contents of its result file.
#[derive(Debug)]
pub struct KeptReport {
    /// Every row.
    pub rows: KeptRows,
    /// Summary and end of the run.
    pub end: KeptReportEnd,
}

/// End of a run and the contents of its file besides the rows.
#[derive(Debug)]
pub struct KeptReportEnd {
    /// The run.
    pub run: Recorded,
    /// Header of the file.
    pub header: Header,
    case: Case,
}

impl KeptReportEnd {
    /// Main numbers of the run. For the paper's own case, the paper's numbers are shown too.
    pub fn headline(&self) -> Vec<HeadlineRow> {
        headline(&self.case, &self.run.summary)
    }

    /// Writes the result file of the run with its rows and returns the path. The bytes are those of a
    /// [`SavedRun`](crate::SavedRun)'s file, except for time and command. An incomplete run gives the partial file.
    ///
    /// # Errors
    /// A file that must not be replaced exists, or writing fails.
    pub fn write(&self, path: &Path, overwrite: Overwrite, rows: &KeptView<'_>) -> Result<PathBuf, ResultError> {
        let run = &self.run;
        let mut writer = ResultWriter::create(path, overwrite, &[], &self.header)?;
        writer.replay(rows)?;
        if let Some(witness) = &run.witness {
            writer.add(&witness.additions())?;
        }
        writer.finish(run.status.clone(), &run.table, run.wall_time)
    }
}

impl<'a> KeptRun<'a> {
    /// Run of a case.
    pub fn new(case: &'a Case) -> Self {
        KeptRun {
            case,
            header: provenance::header(case),
            witness: false,
            events_alone: false,
            watch: &(),
        }
    }

    /// Sets the text of the case for the file. By default it is the resolved case.
    pub fn text(mut self, text: &str) -> Self {
        text.clone_into(&mut self.header.case_text);
        self
    }

    /// Keeps no samples. Their integration still costs time ([`Case::without_trajectory`] avoids it).
    pub fn events_alone(mut self, wanted: bool) -> Self {
        self.events_alone = wanted;
        self
    }

    /// Compares the run with another method. If they disagree, the run is repeated with finer settings, if they help.
    pub fn witness(mut self, wanted: bool) -> Self {
        self.witness = wanted;
        self
    }

    /// Sets the observer of the run and its witness.
    pub fn watch(mut self, watch: &'a dyn Watch) -> Self {
        self.watch = watch;
        self
    }

    /// Computes the run to its end or as far as possible.
    pub fn start(self) -> KeptReport {
        let KeptRun {
            case,
            mut header,
            witness,
            watch,
            ..
        } = self;
        let mut rows = KeptRows::new(&header.extension);
        if self.events_alone {
            rows = rows.events_alone();
        }
        let mut run = recorded(case, &mut rows, false, witness, watch);
        let mut case = case.clone();
        if let Some((finer, why)) = case_of_repetition(&case, &run, watch) {
            header = provenance::header_of_repetition(&header, &finer);
            rows = rows.emptied(&header.extension);
            run = recorded(&finer, &mut rows, false, witness, watch);
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
