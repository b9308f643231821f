//! From a study to its file: what is left to run is run, and the journal becomes the sweep file.

use super::boundary::trace;
use super::earlier::{already_there, gather, ranks_left};
use super::error::{SweepEnd, SweepError};
use super::file::write;
use super::journal::{Existing, Journal, journal_path};
use super::point_file::{folder_of_runs, into_a_file};
use super::report::{SweepProgress, SweepReport};
use super::runner::{Integrate, without_a_file};
use super::running::{Points, Running};
use super::shard::{Shard, plan};
use super::study::{Design, Study};
use super::worker_pool::{Threads, Work, WorkerPool};
use crate::case::Case;
use crate::results::{Overwrite, Reason, check_target};
use crate::simulation::Progress;
use crate::simulation::ensemble::Seat;
use crate::workers::processors;
use std::collections::HashMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A sweep that is being prepared; [`Sweep::start`] runs the study into its file.
///
/// Every outcome goes to the journal beside the file first; the file is made from it when all points are done, or when
/// the sweep is interrupted, and the journal goes when the file is whole. The same study gives the same bytes, however
/// many threads ran it and however often it was interrupted, on one machine and with one version of the program.
///
/// ```
/// use stickslip::Sweep;
/// use stickslip::sweep::{Study, StudySource};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("damping.h5");
/// let text = "case = 'paper-si'\n[[axis]]\nkey = 'torsion.damping'\nvalues = ['20 N m s/rad', '25 N m s/rad']\n";
/// let study = Study::parse(StudySource::text("damping", text), &[])?;
/// let report = Sweep::new(&study, &path).start()?;
/// assert_eq!((report.points, report.failed), (2, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use = "nothing is computed before `start`"]
pub struct Sweep<'a> {
    pub(super) study: &'a Study,
    pub(super) path: &'a Path,
    pub(super) overwrite: Overwrite,
    resume: bool,
    shard: Option<Shard>,
    workers: usize,
    stop: &'a AtomicBool,
    worker_pool: Option<&'a mut dyn WorkerPool>,
    progress: Box<dyn FnMut(SweepProgress) + 'a>,
}

/// Of a sweep that nobody ends.
static NEVER: AtomicBool = AtomicBool::new(false);

impl<'a> Sweep<'a> {
    /// A study into a file that replaces no other but a result of this program, on all processors.
    pub fn new(study: &'a Study, path: &'a Path) -> Self {
        Sweep {
            study,
            path,
            overwrite: Overwrite::OwnResults,
            resume: false,
            shard: None,
            workers: processors(),
            stop: &NEVER,
            worker_pool: None,
            progress: Box::new(|_| {}),
        }
    }

    /// What may be replaced.
    pub fn overwrite(mut self, overwrite: Overwrite) -> Self {
        self.overwrite = overwrite;
        self
    }

    /// Go on with what an interrupted sweep of the same study has left.
    pub fn resume(mut self, resume: bool) -> Self {
        self.resume = resume;
        self
    }

    /// Only this part of the points, into the file of a shard.
    pub fn shard(mut self, shard: Option<Shard>) -> Self {
        self.shard = shard;
        self
    }

    /// Number of threads.
    pub fn workers(mut self, workers: usize) -> Self {
        self.workers = workers;
        self
    }

    /// Set from outside to end the sweep in good order.
    pub fn stop(mut self, stop: &'a AtomicBool) -> Self {
        self.stop = stop;
        self
    }

    /// Who runs the points, instead of threads of this process.
    pub fn worker_pool(mut self, worker_pool: &'a mut dyn WorkerPool) -> Self {
        self.worker_pool = Some(worker_pool);
        self
    }

    /// Told now and then how far the sweep is.
    pub fn progress(mut self, progress: impl FnMut(SweepProgress) + 'a) -> Self {
        self.progress = Box::new(progress);
        self
    }

    /// Hands over what is to be done by whoever runs the points.
    pub(crate) fn with_work<T>(&self, work: impl FnOnce(&Work) -> T) -> T {
        let folder = folder_of_runs(self.path);
        let into_files =
            |number: u64, case: &Case, _: Option<&Arc<Seat>>, control: &mut dyn FnMut(Progress) -> ControlFlow<()>| {
                into_a_file(&folder, self.study, number, case, control)
            };
        let integrate: &Integrate = match self.study.keep.trajectory {
            true => &into_files,
            false => &without_a_file,
        };
        work(&Work {
            study: self.study,
            workers: self.workers,
            integrate,
            stop: self.stop,
        })
    }

    /// Runs the points into the file.
    ///
    /// # Errors
    /// A file or a journal that is not to be touched, failures of the disk, and workers that were lost. Runs that fail are
    /// part of the result.
    pub fn start(mut self) -> Result<SweepReport, SweepError> {
        let folder = folder_of_runs(self.path);
        if self.study.keep.trajectory && folder == self.path {
            let what = "the results of its runs";
            let instead = self.path.with_extension("h5");
            return Err(Reason::Reserved { what, instead }.of(self.path).into());
        }
        if self.study.keep.trajectory && folder.exists() && !folder.is_dir() {
            let why = "is no folder, and that of the runs is to have this name; choose another name with -o";
            return Err(SweepError::Refused(format!("{}: {why}", folder.display())));
        }
        let mut threads = Threads;
        let worker_pool = self.worker_pool.take();
        let mut progress = std::mem::replace(&mut self.progress, Box::new(|_| {}));
        self.with_work(|work| run(&self, work, worker_pool.unwrap_or(&mut threads), &mut progress))
    }
}

fn run(
    sweep: &Sweep,
    work: &Work,
    worker_pool: &mut dyn WorkerPool,
    progress: &mut dyn FnMut(SweepProgress),
) -> Result<SweepReport, SweepError> {
    let Sweep { study, path, .. } = *sweep;
    let digest = study.digest();
    let part = sweep.shard.map(|shard| plan(study, shard)).transpose()?;
    check_target(path, sweep.overwrite, &study.files)?;
    let journal_file = journal_path(path);
    if journal_file == path {
        let what = "the outcomes of its points";
        let instead = path.with_extension("h5");
        return Err(Reason::Reserved { what, instead }.of(path).into());
    }
    if study.files.contains(&journal_file) {
        return Err(Reason::IsInput.of(&journal_file).into());
    }
    let nothing_left = || Ok::<_, SweepError>(!journal_file.exists() && ranks_left(path)?.is_empty());
    if sweep.resume && path.exists() && nothing_left()? {
        return already_there(path, &digest, sweep.shard);
    }
    let existing = match (sweep.resume, sweep.overwrite) {
        (true, _) => Existing::Resume,
        (false, Overwrite::Force) => Existing::Discard,
        (false, _) => Existing::Refuse,
    };
    let mut journal = Journal::open(&journal_file, &digest, existing)?;
    gather(&mut journal, path, &digest, existing)?;
    let before = journal.points();
    worker_pool.begin();
    let mut state = Running {
        work,
        journal,
        worker_pool,
        progress,
        failed: 0,
        stored: 0,
        outcomes: HashMap::new(),
    };
    let mut points = Points::of(study);
    let mut boundaries = None;
    let ended = match &study.design {
        Design::Boundary(spec) => trace(spec, &mut state, &mut points).map(|found| boundaries = Some(found)),
        _ => state.run_numbers(study.point_count().unwrap_or(0), part.as_ref()),
    };
    let silent = state.worker_pool.dismiss();
    let interrupted = match ended {
        Ok(()) => false,
        Err(SweepEnd::Interrupted) => true,
        Err(SweepEnd::Error(error)) => return Err(error),
    };
    let Running { mut journal, .. } = state;
    if !silent.is_empty() {
        return Err(SweepError::Lost { silent });
    }
    gather(&mut journal, path, &digest, Existing::Resume)?;
    let run_now = journal.points() - before;
    let mut report = write(
        study,
        (path, sweep.overwrite),
        &mut journal,
        &points,
        part.as_ref(),
        boundaries,
        interrupted,
    )?;
    report.run_now = run_now;
    if !interrupted {
        journal.remove()?;
    }
    Ok(report)
}
