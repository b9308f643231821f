//! Runs the continuation of a study into a file, with a journal next to it.

use super::explore::{ExploreError, Explored, Explorer};
use super::file::contents;
use super::study::ContinuationStudy;
use crate::analysis::Deadline;
use crate::cycle::{CycleError, Family};
use crate::sweep::{Existing, Journal, JournalError, journal_path};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use stickslip_case::CaseError;
use stickslip_files::{Overwrite, Reservation, ResultError, Status, partial_path};

/// Builder of a continuation; [`Continuation::start`] follows the branches into its file.
#[must_use = "nothing is computed before `start`"]
pub struct Continuation<'a> {
    study: &'a ContinuationStudy,
    path: &'a Path,
    overwrite: Overwrite,
    resume: bool,
    stop: &'a AtomicBool,
    progress: Box<dyn FnMut(ContinuationProgress) + 'a>,
}

/// Progress of a continuation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContinuationProgress {
    /// Number of branches, including the current one.
    pub branches: usize,
    /// Total number of points.
    pub points: usize,
    /// Parameter at the last point.
    pub value: f64,
}

/// Result of a continuation.
#[derive(Debug)]
pub struct ContinuationReport {
    /// Path of the file.
    pub file: PathBuf,
    /// The branches.
    pub explored: Explored,
}

/// Error of a continuation.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum ContinuationError {
    #[error(transparent)]
    Case(#[from] CaseError),
    #[error(transparent)]
    Cycle(#[from] CycleError),
    #[error(transparent)]
    Explore(#[from] ExploreError),
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    File(#[from] ResultError),
}

static NEVER: AtomicBool = AtomicBool::new(false);

impl<'a> Continuation<'a> {
    /// Continuation of a study. By default, the file may only replace results of this program.
    pub fn new(study: &'a ContinuationStudy, path: &'a Path) -> Self {
        Continuation {
            study,
            path,
            overwrite: Overwrite::OwnResults,
            resume: false,
            stop: &NEVER,
            progress: Box::new(|_| {}),
        }
    }

    /// Sets which files may be replaced.
    pub fn overwrite(mut self, overwrite: Overwrite) -> Self {
        self.overwrite = overwrite;
        self
    }

    /// Resumes an interrupted continuation of the same study.
    pub fn resume(mut self, resume: bool) -> Self {
        self.resume = resume;
        self
    }

    /// Sets a flag that ends the continuation cleanly.
    pub fn stop(mut self, stop: &'a AtomicBool) -> Self {
        self.stop = stop;
        self
    }

    /// Sets a callback for every point.
    pub fn progress(mut self, progress: impl FnMut(ContinuationProgress) + 'a) -> Self {
        self.progress = Box::new(progress);
        self
    }

    /// Follows the branches, at most for `solver.max_wall_time` of the base case. Points first go to a journal next to
    /// the file. An interrupted continuation leaves a partial file and can resume from the journal.
    ///
    /// # Errors
    /// There is no start, the file is protected, or the disk fails.
    pub fn start(mut self) -> Result<ContinuationReport, ContinuationError> {
        let study = self.study;
        let place = Reservation::take(self.path, self.overwrite, &study.files)?;
        let existing = match (self.resume, self.overwrite) {
            (true, _) => Existing::Resume,
            (false, Overwrite::Force) => Existing::Discard,
            (false, _) => Existing::Refuse,
        };
        let begin = Instant::now();
        let written = study.written()?;
        let motion = written.case().motion();
        let deadline = Deadline::after(begin, written.case().solver.max_wall_time);
        let family = Family::new(written, &[study.axes[0].keys.clone()])?;
        let at = journal_path(self.path);
        let mut journal = Journal::open(&at, &study.digest(), existing)?;
        let stop = || self.stop.load(Ordering::Relaxed) || deadline.is_over();
        let mut told = |explored: &Explored| {
            let last = explored.branches.last().and_then(|branch| branch.points.last());
            (self.progress)(ContinuationProgress {
                branches: explored.branches.len(),
                points: explored.points(),
                value: last.map_or(f64::NAN, |point| point.value),
            });
        };
        let explorer = Explorer {
            study,
            family: &family,
            journal: &mut journal,
            waiting: (Vec::new(), Instant::now()),
            stop: &stop,
            told: &mut told,
        };
        let explored = explore(explorer);
        let explored = match explored {
            Ok(explored) => explored,
            Err(error) => {
                if journal.points() == 0 {
                    let _ = std::fs::remove_file(&at);
                }
                return Err(error.into());
            }
        };
        let status = match explored.interrupted {
            true => Status::Interrupted,
            false => Status::Complete,
        };
        let file = contents(study, motion, &explored).write(&place, &status)?;
        drop(journal);
        if !explored.interrupted {
            // Removes what an interruption left.
            let _ = std::fs::remove_file(partial_path(self.path));
            let _ = std::fs::remove_file(&at);
        }
        Ok(ContinuationReport { file, explored })
    }
}

fn explore(mut explorer: Explorer<'_>) -> Result<Explored, ExploreError> {
    explorer.explore()
}
