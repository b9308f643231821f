//! Runs the continuation of a study into a file, with a journal next to it.

use super::explore::{ExploreError, Explored, Explorer};
use super::file::write;
use super::study::ContinuationStudy;
use crate::analysis::Deadline;
use crate::cycle::{CycleError, Family};
use crate::study::StudyRun;
use crate::sweep::{JournalError, journal_path};
use std::path::PathBuf;
use std::time::Instant;
use stickslip_case::CaseError;
use stickslip_files::{Reservation, ResultError, Status, partial_path};

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

/// Builder of a continuation; [`Continuation::start`] follows the branches into its file.
pub type Continuation<'a> = StudyRun<'a, ContinuationStudy>;

impl Continuation<'_> {
    /// Follows the branches, at most for `solver.max_wall_time` of the base case. Points first go to a journal next to
    /// the file. An interrupted continuation leaves a partial file and can resume from the journal.
    ///
    /// # Errors
    /// There is no start, the file is protected, or the disk fails.
    pub fn start(self) -> Result<ContinuationReport, ContinuationError> {
        let (study, watch) = (self.study, self.watch);
        let place = Reservation::take(self.path, self.overwrite, &study.files)?;
        let begin = Instant::now();
        let written = study.written()?;
        let motion = written.case().motion();
        let deadline = Deadline::after(begin, written.case().solver.max_wall_time);
        let family = Family::new(written, &[study.axes[0].keys.clone()])?;
        let at = journal_path(self.path);
        let mut journal = self.journal(&study.digest())?;
        let stop = || watch.stopped() || deadline.is_over();
        let told = |explored: &Explored| {
            let last = explored.branches.last().and_then(|branch| branch.points.last());
            let (branch, points) = (explored.branches.len().saturating_sub(1), explored.points());
            let value = last.map_or(f64::NAN, |point| point.value);
            let what = format_args!("branch {branch}, {points} points, at {value:.9}");
            let _ = watch.at(points as f64, points as f64, what);
        };
        let explored = Explorer {
            study,
            family: &family,
            journal: &mut journal,
            waiting: (Vec::new(), Instant::now()),
            stop: &stop,
            told: &told,
        }
        .explore();
        let explored = match explored {
            Ok(explored) => explored,
            Err(error) => {
                if journal.points() == 0 {
                    let _ = std::fs::remove_file(&at);
                }
                return Err(error.into());
            }
        };
        let status = Status::of(explored.interrupted);
        let file = write(study, motion, &explored, &place, &status)?;
        drop(journal);
        if !explored.interrupted {
            // Removes what an interruption left.
            let _ = std::fs::remove_file(partial_path(self.path));
            let _ = std::fs::remove_file(&at);
        }
        Ok(ContinuationReport { file, explored })
    }
}
