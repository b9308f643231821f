//! Run of a case into its result file, with its summary.

use super::recorded::{Recorded, case_of_repetition, recorded};
use crate::provenance;
use std::path::{Path, PathBuf};
use stickslip_case::Case;
use stickslip_files::{Addition, Header, Overwrite, ResultError, ResultWriter, SavedRows, Status};
use stickslip_system::watch::Watch;

/// Builder of a run into a result file; [`SavedRun::start`] computes it.
///
/// ```
/// use stickslip_analysis::SavedRun;
/// use stickslip_case::{Case, CaseSource};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("paper-si.h5");
/// let case = Case::read(&CaseSource::built_in("paper-si")?, &[])?;
/// let saved = SavedRun::new(&case, &path).start()?;
/// println!("{} sticks, in {}", saved.run.summary.sticks, saved.file.display());
/// # assert_eq!(stickslip_files::ResultFile::open(&path)?.events()?.len(), saved.run.summary.events);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "nothing is computed before `start`"]
pub struct SavedRun<'a> {
    case: &'a Case,
    path: &'a Path,
    header: Header,
    overwrite: Overwrite,
    inputs: &'a [PathBuf],
    keeps_events: bool,
    witness: bool,
    additions: &'a [Addition],
    watch: &'a dyn Watch,
}

/// Outcome of a run into a file.
#[derive(Debug)]
pub struct SavedReport {
    /// Result file, or the partial file of an incomplete run.
    pub file: PathBuf,
    /// The run. Its status is that of the file, unless [`Self::unsaved`] is set.
    pub run: Recorded,
    /// Error that interrupted the writing of the file.
    pub unsaved: Option<ResultError>,
    /// Rows that were certainly in the file before its end was written.
    pub saved: SavedRows,
}

impl<'a> SavedRun<'a> {
    /// Run of a case. By default, the file may only replace results of this program.
    pub fn new(case: &'a Case, path: &'a Path) -> Self {
        SavedRun {
            case,
            path,
            header: provenance::header(case),
            overwrite: Overwrite::OwnResults,
            inputs: &[],
            keeps_events: false,
            witness: false,
            additions: &[],
            watch: &(),
        }
    }

    /// Sets the text of the case for the file. By default it is the resolved case.
    pub fn text(mut self, text: &str) -> Self {
        text.clone_into(&mut self.header.case_text);
        self
    }

    /// Replaces the case's title.
    pub fn title(mut self, title: String) -> Self {
        self.header.title = title;
        self
    }

    /// Sets which files may be replaced.
    pub fn overwrite(mut self, overwrite: Overwrite) -> Self {
        self.overwrite = overwrite;
        self
    }

    /// Sets the input files of the case, which are never replaced.
    pub fn inputs(mut self, inputs: &'a [PathBuf]) -> Self {
        self.inputs = inputs;
        self
    }

    /// Keeps the events in the report as well.
    pub fn keep_events(mut self) -> Self {
        self.keeps_events = true;
        self
    }

    /// Compares the run with another method ([`witness`](mod@super::witness)). If they disagree, the run is repeated
    /// with finer settings, if they help.
    pub fn witness(mut self, wanted: bool) -> Self {
        self.witness = wanted;
        self
    }

    /// Sets groups that the file of a complete run has in addition.
    pub fn additions(mut self, additions: &'a [Addition]) -> Self {
        self.additions = additions;
        self
    }

    /// Sets the observer of the run and its witness.
    pub fn watch(mut self, watch: &'a dyn Watch) -> Self {
        self.watch = watch;
        self
    }

    /// Computes the run to its end, or as far as possible, and writes the file.
    ///
    /// # Errors
    /// The file cannot be created, or a file that must not be replaced exists. Later failures are in the report.
    pub fn start(self) -> Result<SavedReport, ResultError> {
        let SavedRun { case, watch, .. } = self;
        let mut writer = ResultWriter::create(self.path, self.overwrite, self.inputs, &self.header)?;
        let partial = writer.partial().to_owned();
        let mut run = recorded(case, &mut writer, self.keeps_events, self.witness, watch);
        if let Some((finer, why)) = case_of_repetition(case, &run, watch) {
            writer.begin_again(&provenance::header_of_repetition(&self.header, &finer))?;
            run = recorded(&finer, &mut writer, self.keeps_events, self.witness, watch);
            run.repeated(why);
        }
        run.find_exponent(case);
        let saved = writer.saved();
        let said = match &run.witness {
            Some(witness) => writer.add(&witness.additions()),
            None => Ok(()),
        };
        let said = said.and_then(|()| match run.status {
            Status::Complete => writer.add(self.additions),
            _ => Ok(()),
        });
        let finished = said.and_then(|()| writer.finish(run.status.clone(), &run.table, run.wall_time));
        let (file, unsaved) = match finished {
            Ok(file) => (file, None),
            Err(error) => (partial, Some(error)),
        };
        Ok(SavedReport {
            file,
            run,
            unsaved,
            saved,
        })
    }
}
