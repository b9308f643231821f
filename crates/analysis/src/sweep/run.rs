//! Sweep of a study into a file: the remaining points run, then the journal becomes the sweep file.

use super::boundary::trace;
use super::earlier::already_there;
use super::error::{SweepEnd, SweepError};
use super::executor::Executor;
use super::file::write;
use super::journal::journal_path;
use super::point_file::{folder_of_runs, into_a_file};
use super::report::SweepReport;
use super::runner::{Integrate, without_a_file};
use super::running::{Running, RunningPoints};
use super::shard::{Shard, plan};
use super::study::{Design, Study};
use crate::study::StudyRun;
use stickslip_case::Case;
use stickslip_files::{Reason, check_target};
use stickslip_system::watch::Watch;

/// Builder of a sweep; [`Sweep::start`] runs the study into its file.
///
/// The file is made from the journal after the last point or after an interruption. On one kind of machine and with one
/// program version, the same study gives the same bytes for any number of threads, processes and interruptions.
///
/// ```
/// use stickslip_analysis::Sweep;
/// use stickslip_analysis::sweep::{Study, StudySource};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("damping.h5");
/// let text = "case = 'paper-si'\n[[axis]]\nkey = 'torsion.damping'\nvalues = ['20 N m s/rad', '25 N m s/rad']\n";
/// let study = Study::parse(StudySource::text("damping", text), &[])?;
/// let report = Sweep::new(&study, &path).start()?;
/// assert_eq!((report.points, report.failed), (2, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type Sweep<'a> = StudyRun<'a, Study>;

impl<'a> Sweep<'a> {
    /// Runs only a part of the points, into the file of a shard.
    pub fn shard(mut self, shard: Option<Shard>) -> Self {
        self.shard = shard;
        self
    }

    /// Sets the number of threads.
    pub fn workers(mut self, workers: usize) -> Self {
        self.workers = workers;
        self
    }

    /// Runs the points in other processes.
    pub fn executor(mut self, executor: &'a mut dyn Executor) -> Self {
        self.executor = Some(executor);
        self
    }

    /// Runs the points into the file. Failed runs are part of the result.
    ///
    /// # Errors
    /// The file or the journal is protected, or the disk or the executor fails.
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
        let executor = self.executor.take();
        if self.study.keep.trajectory && executor.is_some() {
            let why =
                "the result files of the runs are written by the process that runs them; leave it out, or the executor";
            return Err(SweepError::Refused(format!("keep.trajectory: {why}")));
        }
        let into_files =
            |number: u64, case: &Case, watch: &dyn Watch| into_a_file(&folder, self.study, number, case, watch);
        let integrate: &Integrate = match self.study.keep.trajectory {
            true => &into_files,
            false => &without_a_file,
        };
        run(&self, integrate, executor)
    }
}

fn run(sweep: &Sweep, integrate: &Integrate, executor: Option<&mut dyn Executor>) -> Result<SweepReport, SweepError> {
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
    if sweep.resume && path.exists() && !journal_file.exists() {
        return already_there(path, &digest, sweep.shard);
    }
    let journal = sweep.journal(&digest)?;
    let before = journal.points();
    let mut state = Running {
        study,
        workers: sweep.workers,
        integrate,
        executor: executor.map(|executor| executor as _),
        watch: sweep.watch,
        journal,
        failed: 0,
    };
    let mut points = RunningPoints::of(study);
    let mut boundaries = None;
    let ended = match &study.design {
        Design::Boundary(spec) => trace(spec, &mut state, &mut points).map(|found| boundaries = Some(found)),
        _ => state.run_numbers(study.point_count().unwrap_or(0), part.as_ref()),
    };
    let interrupted = match ended {
        Ok(()) => false,
        Err(SweepEnd::Interrupted) => true,
        Err(SweepEnd::Error(error)) => return Err(error),
    };
    let Running { mut journal, .. } = state;
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
