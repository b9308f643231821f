//! From a study to its file: what is left to follow is followed, with a journal beside the file.

use super::explore::{ExploreError, Explored, Explorer};
use super::file::contents;
use super::study::ContinuationStudy;
use crate::case::CaseError;
use crate::cycle::{CycleError, Family};
use crate::results::{Overwrite, Reservation, ResultError, Status, partial_path};
use crate::sweep::{Existing, Journal, JournalError, journal_path};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A continuation that is being prepared; [`Continuation::start`] follows the branches into its file.
#[must_use = "nothing is computed before `start`"]
pub struct Continuation<'a> {
    study: &'a ContinuationStudy,
    path: &'a Path,
    overwrite: Overwrite,
    resume: bool,
    stop: &'a AtomicBool,
    progress: Box<dyn FnMut(ContinuationProgress) + 'a>,
}

/// How far a continuation is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContinuationProgress {
    /// Branches, with the one under way.
    pub branches: usize,
    /// Points of all.
    pub points: usize,
    /// Of the number that varies, at the last point.
    pub value: f64,
}

/// What a continuation came to.
#[derive(Debug)]
pub struct ContinuationReport {
    /// Where it is.
    pub file: PathBuf,
    /// The branches.
    pub explored: Explored,
}

/// Why there is none.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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

/// Of a continuation that nobody ends.
static NEVER: AtomicBool = AtomicBool::new(false);

impl<'a> Continuation<'a> {
    /// A study into a file that replaces no other but a result of this program.
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

    /// What may be replaced.
    pub fn overwrite(mut self, overwrite: Overwrite) -> Self {
        self.overwrite = overwrite;
        self
    }

    /// Go on with what an interrupted continuation of the same study has left.
    pub fn resume(mut self, resume: bool) -> Self {
        self.resume = resume;
        self
    }

    /// Set from outside to end it in good order.
    pub fn stop(mut self, stop: &'a AtomicBool) -> Self {
        self.stop = stop;
        self
    }

    /// Told of every point.
    pub fn progress(mut self, progress: impl FnMut(ContinuationProgress) + 'a) -> Self {
        self.progress = Box::new(progress);
        self
    }

    /// Follows the branches. Points go to a journal beside the file first; an interrupted continuation leaves what it has in the
    /// partial file, and goes on from the journal.
    ///
    /// # Errors
    /// A case without a start, a file that may not be replaced, a failure of the disk.
    pub fn start(mut self) -> Result<ContinuationReport, ContinuationError> {
        let study = self.study;
        let place = Reservation::take(self.path, self.overwrite, &study.files)?;
        let existing = match (self.resume, self.overwrite) {
            (true, _) => Existing::Resume,
            (false, Overwrite::Force) => Existing::Discard,
            (false, _) => Existing::Refuse,
        };
        let written = study.written()?;
        let motion = written.case().motion();
        let family = Family::new(written, &[study.axes[0].keys.clone()])?;
        let at = journal_path(self.path);
        let mut journal = Journal::open(&at, &study.digest(), existing)?;
        let stop = || self.stop.load(Ordering::Relaxed);
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
            // What an interruption has left.
            let _ = std::fs::remove_file(partial_path(self.path));
            let _ = std::fs::remove_file(&at);
        }
        Ok(ContinuationReport { file, explored })
    }
}

fn explore(mut explorer: Explorer<'_>) -> Result<Explored, ExploreError> {
    explorer.explore()
}
