//! Runs of a case with summary, warnings and witness: into a recorder, a result file, or memory.

use super::Summary;
use super::attractor::Recurrence;
use super::exponent::exponent;
use super::headline::{HeadlineRow, headline};
use super::warning::{Warning, warnings};
use super::witness::{Witness, repetition, witness};
use crate::earlier::spare_run;
use crate::provenance;
use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::time::Instant;
use stickslip_case::Case;
use stickslip_engine::run::Run;
use stickslip_engine::simulation::{RunFailure, RunReport, Section, SolverOptions};
use stickslip_files::{
    Addition, FileKind, Header, KeptRows, KeptView, Overwrite, ResultError, ResultWriter, SavedRows, Status,
    StickSlipTable, schema::group,
};
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
    /// Adds the witness and, to a complete run, `additions`, and closes the file.
    fn finish(&self, mut writer: ResultWriter, additions: &[Addition]) -> Result<PathBuf, ResultError> {
        let mut all: Vec<Addition> = self.witness.iter().flat_map(Witness::additions).collect();
        if self.status == Status::Complete {
            all.extend_from_slice(additions);
        }
        writer.add(&all)?;
        writer.finish(self.status.clone(), &self.table, self.wall_time)
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
    let mut recurrence = Recurrence::new(&case.system, recorder, keeps_events, Some(end_time));
    let (report, failure) = match Run::new(case).record(&mut recurrence).watch(watch).start() {
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

/// Like [`recorded`]. If run and witness disagree, and finer settings help, `begin_again` prepares the recorder for a
/// repetition. Finds the exponent, which takes up to a second. Also returns the case with the settings of the run.
fn checked<R: Recorder, E>(
    case: &Case,
    (recorder, header): (&mut R, &mut Header),
    begin_again: fn(&mut R, &Header) -> Result<(), E>,
    (keeps_events, wanted): (bool, bool),
    watch: &dyn Watch,
) -> Result<(Recorded, Case), E> {
    let mut run = recorded(case, recorder, keeps_events, wanted, watch);
    let mut case = case.clone();
    let again = run
        .witness
        .as_ref()
        .and_then(|first| repetition(&case, first, &|| watch.stopped()));
    if let Some((finer, why)) = again {
        *header = provenance::header_of_repetition(header, &finer);
        begin_again(recorder, header)?;
        run = recorded(&finer, recorder, keeps_events, wanted, watch);
        run.witness
            .iter_mut()
            .for_each(|witness| witness.repeated = Some(why.clone()));
        case = finer;
    }
    if let Some((end, section)) = run.end.take().filter(|_| run.summary.goes_on()) {
        run.summary.exponent = exponent(&case.system, case.threshold, &end, section);
        run.table = run.summary.table(&case);
    }
    Ok((run, case))
}

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

    /// Sets the overrides of the case in words ([`stickslip_case::changed`]).
    pub fn changed(mut self, changed: Vec<String>) -> Self {
        self.header.changed = changed;
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
    /// The file cannot be created, or a file that must not be replaced exists, such as a run with other settings. Later failures are in the report.
    pub fn start(self) -> Result<SavedReport, ResultError> {
        let (case, mut header) = (self.case, self.header);
        let is_cycle = self.additions.iter().any(|one| one.group() == group::CYCLE);
        let kind = if is_cycle { FileKind::Cycle } else { FileKind::Run };
        spare_run(self.path, self.overwrite, kind, &header.resolved)?;
        let mut writer = ResultWriter::create(self.path, self.overwrite, self.inputs, &header)?;
        let partial = writer.partial().to_owned();
        let wanted = (self.keeps_events, self.witness);
        let (run, _) = checked(
            case,
            (&mut writer, &mut header),
            ResultWriter::begin_again,
            wanted,
            self.watch,
        )?;
        let saved = writer.saved();
        let (file, unsaved) = match run.finish(writer, self.additions) {
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

/// Run in memory, with the contents of its result file.
#[derive(Debug)]
pub struct KeptReport {
    /// Every row. [`Self::write`] takes them from its argument.
    pub rows: KeptRows,
    /// The run.
    pub run: Recorded,
    /// Header of the file.
    pub header: Header,
    case: Case,
}

impl KeptReport {
    /// Runs a case in memory to its end or as far as possible.
    ///
    /// `text` is the text of the case for the file. With `witness`, the run is compared with another method, and repeated
    /// with finer settings if they disagree and it helps. Without `trajectory` no samples are kept. Their integration
    /// still costs time ([`Case::without_trajectory`] avoids it).
    ///
    /// ```
    /// use stickslip_analysis::analysis::KeptReport;
    /// use stickslip_case::{Case, CaseSource};
    ///
    /// let case = Case::read(&CaseSource::built_in("paper-si")?, &[])?;
    /// let kept = KeptReport::of_run(&case, &case.resolved(), false, true, &());
    /// println!("{} events", kept.rows.tables[1].rows());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of_run(case: &Case, text: &str, witness: bool, trajectory: bool, watch: &dyn Watch) -> KeptReport {
        let mut header = provenance::header(case);
        text.clone_into(&mut header.case_text);
        let mut rows = KeptRows::new(&header.extension, !trajectory);
        let begin_again = |rows: &mut KeptRows, header: &Header| -> Result<(), Infallible> {
            rows.begin_again(&header.extension);
            Ok(())
        };
        let Ok((run, case)) = checked(case, (&mut rows, &mut header), begin_again, (false, witness), watch);
        KeptReport {
            rows,
            run,
            header,
            case,
        }
    }

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
        let asked = self.header.asked.as_ref().unwrap_or(&self.header.resolved);
        spare_run(path, overwrite, FileKind::Run, asked)?;
        let mut writer = ResultWriter::create(path, overwrite, &[], &self.header)?;
        writer.replay(rows)?;
        self.run.finish(writer, &[])
    }
}
