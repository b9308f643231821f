//! A run of a case into its result file, with its summary.

use super::recorded::{Recorded, case_of_repetition, recorded};
use crate::case::Case;
use crate::results::{Addition, Header, Overwrite, ResultError, ResultWriter, SavedRows, Status};
use crate::simulation::Progress;
use crate::workers::go_on_unless;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// A run into a result file that is being prepared; [`SavedRun::start`] computes it.
///
/// ```
/// use stickslip::SavedRun;
/// use stickslip::case::{Case, CaseSource};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("paper-si.h5");
/// let case = Case::read(&CaseSource::built_in("paper-si")?, &[])?;
/// let saved = SavedRun::new(&case, &path).start()?;
/// println!("{} sticks, in {}", saved.run.summary.sticks, saved.file.display());
/// # assert_eq!(stickslip::results::ResultFile::open(&path)?.events()?.len(), saved.run.summary.events);
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
    stop: Option<&'a AtomicBool>,
    control: Option<Box<dyn FnMut(Progress) -> ControlFlow<()> + 'a>>,
}

/// What a run into a file came to.
#[derive(Debug)]
pub struct SavedReport {
    /// The result, or the partial file of a run that is not complete.
    pub file: PathBuf,
    /// The run. Its status is that of the file, unless there is something [`Self::unsaved`].
    pub run: Recorded,
    /// Why the file could not be written to its end: then it is marked interrupted.
    pub unsaved: Option<ResultError>,
    /// Rows that the file had for certain before its end was written.
    pub saved: SavedRows,
}

impl<'a> SavedRun<'a> {
    /// The run that a case describes, into a file that replaces no other but a result of this program.
    pub fn new(case: &'a Case, path: &'a Path) -> Self {
        SavedRun {
            case,
            path,
            header: Header::new(case),
            overwrite: Overwrite::OwnResults,
            inputs: &[],
            keeps_events: false,
            witness: false,
            additions: &[],
            stop: None,
            control: None,
        }
    }

    /// The case as it was given, for the file; else it holds the resolved one twice.
    pub fn text(mut self, text: &str) -> Self {
        text.clone_into(&mut self.header.case_text);
        self
    }

    /// Another title than the case's.
    pub fn title(mut self, title: String) -> Self {
        self.header.title = title;
        self
    }

    /// What may be replaced.
    pub fn overwrite(mut self, overwrite: Overwrite) -> Self {
        self.overwrite = overwrite;
        self
    }

    /// Files that the case was read from: they are never replaced.
    pub fn inputs(mut self, inputs: &'a [PathBuf]) -> Self {
        self.inputs = inputs;
        self
    }

    /// Keep the events in the report, too.
    pub fn keep_events(mut self) -> Self {
        self.keeps_events = true;
        self
    }

    /// Ask another method, after the run; see [`witness`](mod@super::witness). Where it does not agree, the run is made again with finer
    /// settings, if these help.
    pub fn witness(mut self, wanted: bool) -> Self {
        self.witness = wanted;
        self
    }

    /// What the file has of a complete run beside it.
    pub fn additions(mut self, additions: &'a [Addition]) -> Self {
        self.additions = additions;
        self
    }

    /// Set from outside to end the run, and its witness, in good order.
    pub fn stop(mut self, stop: &'a AtomicBool) -> Self {
        self.stop = Some(stop);
        self
    }

    /// What is asked now and then while the run goes on; `Break` ends it in good order.
    pub fn control(mut self, control: impl FnMut(Progress) -> ControlFlow<()> + 'a) -> Self {
        self.control = Some(Box::new(control));
        self
    }

    /// Computes the run, to its end or as far as it comes; what was computed is in the file.
    ///
    /// # Errors
    /// If the file cannot be created, or another is there that may not be replaced. A run that fails, and a file that
    /// cannot be written to its end, are part of the report.
    pub fn start(self) -> Result<SavedReport, ResultError> {
        let SavedRun { case, stop, .. } = self;
        let mut writer = ResultWriter::create(self.path, self.overwrite, self.inputs, &self.header)?;
        let partial = writer.partial().to_owned();
        let stopped = || stop.is_some_and(|stop| stop.load(Ordering::Relaxed));
        let mut control = self.control;
        let mut asked = |progress: Progress| {
            if let Some(control) = &mut control {
                control(progress)?;
            }
            go_on_unless(stopped())
        };
        let stop_of_witness: Option<&dyn Fn() -> bool> = if self.witness { Some(&stopped) } else { None };
        let mut run = recorded(case, &mut writer, self.keeps_events, stop_of_witness, None, &mut asked);
        let again = stop_of_witness.and_then(|stop| case_of_repetition(case, &run, stop));
        if let Some((finer, why)) = again {
            writer.begin_again(&self.header.of_repetition(&finer))?;
            run = recorded(
                &finer,
                &mut writer,
                self.keeps_events,
                stop_of_witness,
                None,
                &mut asked,
            );
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
