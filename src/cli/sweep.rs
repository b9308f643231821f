//! `stickslip sweep`: runs a study of many runs.

use super::arguments::{Common, SweepOptions};
use super::input::{interrupt_flag, overwrite};
use super::progress::{Bar, BarKind};
use super::{CommandEnd, CommandError, captured, interrupted, strictly, tell};
use crate::report::SweepSummary;
use std::path::{Path, PathBuf};
use std::time::Instant;
use stickslip_analysis::sweep::{STUDIES, Shard, Study, StudySource, Sweep, journal_path};
use stickslip_analysis::{Error, ErrorKind};
use stickslip_case::CaseError;
use stickslip_files::Reason;

/// Environment variables with the number of MPI processes, of Open MPI and of MPICH and its relatives.
const MPI_SIZES: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

/// Refuses to be one of several MPI ranks, because all of them would run the same points. A command inside another
/// program, perhaps under `mpi4py.futures`, is exempt.
fn refuse_ranks(options: &SweepOptions) -> Result<(), CommandError> {
    let size = |name: &&str| std::env::var(name).ok().and_then(|text| text.parse::<usize>().ok());
    let is_rank = !captured::now() && options.shard.is_none() && MPI_SIZES.iter().filter_map(size).any(|size| size > 1);
    if !is_rank && !options.mpi {
        return Ok(());
    }
    Err(CommandError::input(
        "a sweep is not shared by the ranks of an MPI job any more, and each of them would run all points; give each process \
         a part with --shard K/N (in a Slurm job array --shard slurm) and combine them by `stickslip merge`, or run the study \
         from Python by stickslip.sweep(study, executor=...) with mpi4py.futures (docs/clusters.md)",
    ))
}

pub(super) fn sweep(options: &SweepOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    refuse_ranks(options)?;
    let study = read_study(options)?;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| default_path(&study, options.shard));
    let jobs = options.runs.jobs.unwrap_or_else(stickslip_engine::workers::processors);
    let stop = interrupt_flag()?;
    let bar = Bar::new(common, BarKind::Points, &stop);
    let mut executor = captured::executor();
    let mut sweep = Sweep::new(&study, &path)
        .overwrite(overwrite(options.force))
        .resume(options.resume)
        .shard(options.shard)
        .workers(jobs)
        .watch(&bar);
    if let Some(executor) = &mut executor {
        sweep = sweep.executor(&mut **executor);
    }
    let clock = Instant::now();
    let result = sweep.start();
    bar.finish();
    let wall_time = clock.elapsed().as_secs_f64();
    let report = result.map_err(|error| resumable(error, &path))?;
    tell(
        common,
        &SweepSummary::new(&study, options.shard, &report, jobs, wall_time),
    )?;
    if report.interrupted {
        let (points, journal) = (report.points, journal_path(&path));
        let how = format!(
            "; {points} points are saved in {}, and --resume goes on from there",
            journal.display()
        );
        return interrupted(common, &how);
    }
    // Other shards may have successful points; merge reports the case that none has.
    if options.shard.is_none() && report.failed > 0 && report.failed == report.points {
        let (point, message) = &report.failures[0];
        return Err(CommandError::computation(format!(
            "all {} points failed, point {point} with: {message}. The messages are in /failures of {}",
            report.points,
            report.file.display()
        )));
    }
    let mut doubts = Vec::new();
    if report.failed > 0 {
        doubts.push(format!("{} of {} points failed.", report.failed, report.points));
    }
    if let Some(count) = report.unfinished.filter(|count| *count > 0) {
        doubts.push(format!(
            "the runs of {count} of {} points end before their attractor is certain; raise output.end_time.",
            report.points
        ));
    }
    strictly(options.strict, &doubts, false, &report.file)
}

fn default_path(study: &Study, shard: Option<Shard>) -> PathBuf {
    let name = &study.head.source.name;
    PathBuf::from(match shard {
        Some(shard) => format!("{name}.shard-{}-of-{}.h5", shard.index(), shard.count()),
        None => format!("{name}.h5"),
    })
}

fn read_study(options: &SweepOptions) -> Result<Study, CaseError> {
    let source = StudySource::find(&options.study, STUDIES)?;
    Study::parse(source, &options.runs.overrides()?)
}

/// The error of a study. If a disk or an executor failed, it names the journal, if there is one.
pub(super) fn resumable(error: Error, path: &Path) -> CommandError {
    let journal = journal_path(path);
    let is_late = match &error.kind {
        ErrorKind::Executor => true,
        ErrorKind::File(error) => {
            error.is_of_the_system() && !matches!(error.reason, Reason::NoReader(_) | Reason::NotCreated(_))
        }
        _ => false,
    };
    let mut error = CommandError::from(error);
    if is_late && journal.exists() {
        error.text = format!(
            "{}. What was computed is in {}; --resume goes on from there",
            error.text.trim_end_matches('.'),
            journal.display()
        );
    }
    error
}
