//! Sweep of a study into a file: the remaining points run, then the journal becomes the sweep file.

use super::boundary::trace;
use super::curves::Boundaries;
use super::executor::Executor;
use super::file::{header, write};
use super::journal::journal_path;
use super::runner::{Integrate, Running, without_a_file};
use super::study::{Design, Study};
use crate::analysis::{Recorded, SavedRun};
use crate::earlier::spare_study;
use crate::error::Error;
use crate::study::StudyRun;
use std::fmt;
use std::path::{Path, PathBuf};
use stickslip_case::Case;
use stickslip_engine::ErrorKind as RunErrorKind;
use stickslip_files::{
    FileKind, Partition, Reason, ShardFile, ShardPlan, StudyFile, check_sound, check_target, schema,
};
use stickslip_system::quote::shown;
use stickslip_system::watch::Watch;

/// Result of a sweep.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepReport {
    /// Sweep file, or partial file of an interrupted sweep.
    pub file: PathBuf,
    /// Whether the sweep was interrupted; it can be resumed.
    pub interrupted: bool,
    /// Finished points in the file.
    pub points: u64,
    /// Points that this start has run.
    pub run_now: u64,
    /// Failed points and reasons. If there are many, only the first ones.
    pub failures: Vec<(u64, String)>,
    /// Points whose run failed.
    pub failed: u64,
    /// Points without a lasting stick, or without a lasting motion; `None` if the sweep was already complete.
    pub unfinished: Option<u64>,
    /// Boundaries, in a boundary study.
    pub boundaries: Option<Boundaries>,
}

pub(super) const NAMED_FAILURES: usize = 5;

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

    /// Runs the points in other processes.
    pub fn executor(mut self, executor: &'a mut dyn Executor) -> Self {
        self.executor = Some(executor);
        self
    }

    /// Runs the points into the file. Failed runs are part of the result.
    ///
    /// # Errors
    /// The file or the journal is protected, or the disk or the executor fails.
    pub fn start(mut self) -> Result<SweepReport, Error> {
        let (study, folder) = (self.study, self.path.with_extension("runs"));
        let executor = self.executor.take();
        let into_files = |number: u64, case: &Case, watch: &dyn Watch| into_a_file(&folder, study, number, case, watch);
        if !study.keep.trajectory {
            return run(&self, &without_a_file, executor);
        }
        if folder == self.path {
            return Err(reserved(self.path, "the results of its runs"));
        }
        if folder.exists() && !folder.is_dir() {
            let why = "is no folder, and that of the runs is to have this name; choose another name with -o";
            return Err(Error::input(format!("{}: {why}", folder.display())));
        }
        if executor.is_some() {
            return Err(Error::input(
                "keep.trajectory: the result files of the runs are written by the process that runs them; leave it out, or the \
                 executor",
            ));
        }
        run(&self, &into_files, None)
    }
}

fn reserved(path: &Path, what: &'static str) -> Error {
    let instead = path.with_extension("h5");
    Reason::Reserved { what, instead }.of(path).into()
}

fn run(sweep: &Sweep, integrate: &Integrate, executor: Option<&mut dyn Executor>) -> Result<SweepReport, Error> {
    let Sweep { study, path, .. } = *sweep;
    let digest = study.digest();
    let part = sweep.shard.map(|shard| plan(study, shard)).transpose()?;
    check_target(path, sweep.overwrite, &study.head.files)?;
    let journal_file = journal_path(path);
    if journal_file == path {
        return Err(reserved(path, "the outcomes of its points"));
    }
    if study.head.files.contains(&journal_file) {
        return Err(Reason::IsInput.of(&journal_file).into());
    }
    if sweep.resume && path.exists() && !journal_file.exists() {
        return already_there(path, &digest, sweep.shard);
    }
    let (kind, header) = match part.is_some() {
        true => (FileKind::Shard, header(study, "sweep", digest.clone(), Vec::new())),
        false => (FileKind::Sweep, header(study, "sweep", digest.clone(), Vec::new())),
    };
    spare_study(path, sweep.overwrite, kind, &header, Some(&digest), part.as_ref())?;
    let journal = sweep.journal(&digest)?;
    let before = journal.points();
    let mut running = Running {
        study,
        workers: sweep.workers,
        watch: sweep.watch,
        integrate,
        executor: executor.map(|executor| executor as _),
        journal,
        asked: Vec::new(),
        failed: 0,
    };
    let mut boundaries = None;
    let ended = match &study.design {
        Design::Boundary(spec) => trace(spec, &mut running).map(|found| boundaries = Some(found)),
        _ => running.run_all(part.as_ref()),
    };
    let interrupted = match ended {
        Ok(()) => false,
        Err(error) if error.is_interrupted() => true,
        Err(error) => return Err(error),
    };
    let mut report = write(
        (path, sweep.overwrite),
        &mut running,
        part.as_ref(),
        boundaries,
        interrupted,
    )?;
    report.run_now = running.journal.points() - before;
    if !interrupted {
        running.journal.remove()?;
    }
    Ok(report)
}

/// Integrates a point into its result file `FOLDER/NUMBER.h5`.
fn into_a_file(folder: &Path, study: &Study, number: u64, case: &Case, watch: &dyn Watch) -> Result<Recorded, Error> {
    std::fs::create_dir_all(folder).map_err(|error| {
        Error::computation(format!(
            "{}: cannot be created: {error}; check its folder",
            folder.display()
        ))
    })?;
    let saved = SavedRun::new(case, &folder.join(format!("{number:06}.h5")))
        .title(format!("{}, point {number}", study.head.title))
        .inputs(&study.head.files)
        .keep_events()
        .watch(watch)
        .start()
        .map_err(Error::computation)?;
    if let Some(error) = saved.unsaved {
        return Err(Error::computation(error));
    }
    match saved.run.failure.as_deref().map(|failure| &failure.error) {
        Some(error) if error.kind == RunErrorKind::Recorder => Err(Error::computation(error)),
        _ => Ok(saved.run),
    }
}

/// Report of a sweep that was already complete when it was resumed.
fn already_there(path: &Path, digest: &str, shard: Option<Shard>) -> Result<SweepReport, Error> {
    let refused = |what: &str| {
        Error::input(format!(
            "{}: {what}, so there is nothing to resume; choose another name with -o, or start anew without --resume",
            path.display()
        ))
    };
    let check = |found: Option<String>| match found.as_deref() == Some(digest) {
        true => Ok(()),
        false => Err(refused(
            "is the file of another study, or of this one before it was changed",
        )),
    };
    let (points, mut failures) = match shard {
        None => {
            let file = StudyFile::open(path, schema::SWEEP_FORMAT)?;
            check_sound(path)?;
            check(file.digest()?)?;
            (file.numbers("status")?.len() as u64, file.failures()?)
        }
        Some(expected) => {
            let file = ShardFile::open(path)?;
            check_sound(path)?;
            check(file.digest()?)?;
            let (found, count) = (file.shard() + 1, file.partition().shards());
            if (found, count) != (expected.index(), expected.count()) {
                let what = format!("holds another shard ({found} of {count}, not {expected})");
                return Err(refused(&what));
            }
            (file.done()? as u64, file.failures()?)
        }
    };
    let failed = failures.len() as u64;
    failures.truncate(NAMED_FAILURES);
    Ok(SweepReport {
        file: path.to_owned(),
        points,
        failures,
        failed,
        ..SweepReport::default()
    })
}

/// Shard `index` (from 1) of `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Shard {
    index: usize,
    count: usize,
}

/// Largest number of shards; more are a mistake. Slurm's arrays end at 4,000,001.
const MOST_SHARDS: usize = 10_000_000;

impl Shard {
    /// Shard `index` of `count`; `None` unless 1 <= `index` <= `count` <= 10,000,000.
    pub fn new(index: usize, count: usize) -> Option<Self> {
        ((1..=count).contains(&index) && count <= MOST_SHARDS).then_some(Shard { index, count })
    }

    /// Reads `K/N`, or `slurm` for a task of a job array: K is the position in the array, N its size.
    ///
    /// # Errors
    /// The text has another form; the error gives the expected one.
    pub fn parse(text: &str, variable: &dyn Fn(&str) -> Option<String>) -> Result<Self, String> {
        if text == "slurm" {
            return Self::of_slurm(variable);
        }
        let pair = text
            .split_once('/')
            .and_then(|(index, count)| Some((index.trim().parse().ok()?, count.trim().parse().ok()?)));
        match pair {
            Some((index, count)) => Shard::new(index, count).ok_or_else(|| {
                format!(
                    "\"{text}\" is no shard: K/N with K from 1 to N, N at most {MOST_SHARDS}",
                    text = shown(text)
                )
            }),
            None => Err(format!(
                "\"{text}\" is no shard: write K/N, such as 3/8 for the third of eight, or slurm in the task of a job array",
                text = shown(text)
            )),
        }
    }

    fn of_slurm(variable: &dyn Fn(&str) -> Option<String>) -> Result<Self, String> {
        let number = |name: &str| -> Result<Option<usize>, String> {
            match variable(name) {
                None => Ok(None),
                Some(text) => match text.trim().parse() {
                    Ok(number) => Ok(Some(number)),
                    Err(_) => Err(format!(
                        "slurm: {name} is \"{text}\", not a whole number; give the shard as K/N",
                        text = shown(&text)
                    )),
                },
            }
        };
        let needed = |name: &str| {
            number(name)?.ok_or_else(|| {
                format!("slurm: {name} is not set, so this is no task of a Slurm job array; submit with sbatch --array, or give the shard as K/N")
            })
        };
        let task = needed("SLURM_ARRAY_TASK_ID")?;
        let (first, last) = (needed("SLURM_ARRAY_TASK_MIN")?, needed("SLURM_ARRAY_TASK_MAX")?);
        let count = needed("SLURM_ARRAY_TASK_COUNT")?;
        let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
        // An array of selected numbers, such as the failed tasks of another array, does not determine the shards.
        let even = last.checked_sub(first).is_some_and(|range| range / step + 1 == count);
        let place = task.checked_sub(first).filter(|place| even && place % step == 0);
        place
            .and_then(|place| Shard::new(place / step + 1, count))
            .ok_or_else(|| {
                format!("slurm: the {count} tasks of this array are not {first} to {last} in even steps, so the shard of task {task} is not clear; submit an array such as 1-{count}, or give the shard as K/N")
            })
    }

    /// Index, from 1.
    pub fn index(self) -> usize {
        self.index
    }

    /// Number of shards.
    pub fn count(self) -> usize {
        self.count
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} of {}", self.index, self.count)
    }
}

const BOUNDARY: &str = "the study traces a boundary: which points it needs depends on the results of the others, so it cannot \
     be split into shards; sweep it as one job on many threads (-j), on many machines by an executor of Python, or as \
                        one study for each value of its other axes";

/// Fails if the study has no numbered points, or fewer points than shards.
fn plan(study: &Study, shard: Shard) -> Result<ShardPlan, Error> {
    let points = study.point_count();
    let points = points.ok_or_else(|| Error::input(BOUNDARY))?;
    if points < shard.count() as u64 {
        let count = shard.count();
        let why = format!("the study has {points} points, too few for {count} shards; use at most {points}");
        return Err(Error::input(why));
    }
    let shape: Vec<usize> = match study.design {
        Design::Grid => study.axes.iter().map(|axis| axis.levels.len()).collect(),
        _ => vec![points as usize],
    };
    Ok(ShardPlan {
        shard: shard.index() - 1,
        partition: Partition::new(&shape, shard.count()),
        layout: study.layout(),
    })
}
