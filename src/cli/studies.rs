//! Commands that compute a study: `stickslip sweep`, `calibrate`, `continue` and `work-precision`.

use super::arguments::{CalibrateOptions, Common, ContinueOptions, FigureFormat, SweepOptions, WorkPrecisionOptions};
use super::interrupt::interrupt_flag;
use super::plot::{self, FigureOutput};
use super::progress::{BarKind, watched};
use super::{CommandEnd, interrupted, strictly, tell};
use crate::Error;
use crate::output::{Output, Product};
use crate::plot::{accuracy, signature};
use crate::report::{BranchesReport, CalibrationReport, PrecisionReport, SweepSummary};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;
use stickslip_analysis::analysis::work_precision::{self, PrecisionRun, PrecisionStudy};
use stickslip_analysis::calibrate::{CALIBRATIONS, Calibration, CalibrationRun, CalibrationStudy};
use stickslip_analysis::continuation::{CONTINUATIONS, Continuation, ContinuationStudy};
use stickslip_analysis::sweep::{STUDIES, Shard, Study, StudySource, Sweep, journal_path};
use stickslip_analysis::{ErrorKind, overrides};
use stickslip_engine::workers::processors;
use stickslip_files::disk::same_file;
use stickslip_files::{Overwrite, Reason, check_target};

/// Environment variables with the number of MPI processes, of Open MPI and of MPICH and its relatives.
const MPI_SIZES: [&str; 2] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"];

/// Refuses to be one of several MPI ranks, because all of them would run the same points.
fn refuse_ranks(options: &SweepOptions) -> Result<(), Error> {
    let size = |name: &&str| std::env::var(name).ok().and_then(|text| text.parse::<usize>().ok());
    let is_rank = options.shard.is_none() && MPI_SIZES.iter().filter_map(size).any(|size| size > 1);
    if !is_rank && !options.mpi {
        return Ok(());
    }
    Err(Error::input(
        "a sweep is not shared by the ranks of an MPI job any more, and each of them would run all points; give each process \
         a part with --shard K/N (in a Slurm job array --shard slurm) and combine them by `stickslip merge`, or run the study \
         from Python by stickslip.sweep(study, executor=...) with mpi4py.futures (docs/reference/clusters.md)",
    ))
}

/// The file as named, or named after the study.
fn file_of(named: Option<&PathBuf>, study: &StudySource, shard: Option<Shard>) -> PathBuf {
    let shard = shard.map(|shard| format!(".shard-{}-of-{}", shard.index(), shard.count()));
    let own = || PathBuf::from(format!("{}{}.h5", study.name, shard.unwrap_or_default()));
    named.cloned().unwrap_or_else(own)
}

pub(super) fn sweep(options: &SweepOptions, common: &Common) -> Result<CommandEnd, Error> {
    refuse_ranks(options)?;
    let study = Study::parse(StudySource::find(&options.study, STUDIES)?, &options.runs.overrides()?)?;
    let path = file_of(options.output.as_ref(), &study.head.source, options.shard);
    let jobs = options.runs.jobs.unwrap_or_else(processors);
    let stop = interrupt_flag()?;
    let clock = Instant::now();
    let result = watched(common, BarKind::Points, &stop, |bar| {
        Sweep::new(&study, &path)
            .overwrite(Overwrite::by_force(options.force))
            .resume(options.resume)
            .shard(options.shard)
            .workers(jobs)
            .watch(bar)
            .start()
    });
    let wall_time = clock.elapsed().as_secs_f64();
    let report = result.map_err(|error| resumable(error, &path))?;
    tell(
        common,
        &SweepSummary::new(&study, options.shard, &report, jobs, wall_time),
    )?;
    if report.interrupted {
        return interrupted(common, &saved(report.points, &path));
    }
    // Other shards may have successful points; merge reports the case that none has.
    if options.shard.is_none() && report.failed > 0 && report.failed == report.points {
        let (point, message) = &report.failures[0];
        return Err(Error::computation(format!(
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

fn saved(points: impl std::fmt::Display, path: &Path) -> String {
    let journal = journal_path(path);
    format!(
        "; {points} points are saved in {}, and --resume goes on from there",
        journal.display()
    )
}

/// The error of a study. If a disk or an executor failed, it names the journal, if there is one.
fn resumable(error: stickslip_analysis::Error, path: &Path) -> Error {
    let journal = journal_path(path);
    let is_late = match &error.kind {
        ErrorKind::Executor => true,
        ErrorKind::File(error) => {
            error.is_of_the_system() && !matches!(error.reason, Reason::NoReader(_) | Reason::NotCreated(_))
        }
        _ => false,
    };
    let mut error = Error::from(error);
    if is_late && journal.exists() {
        error.text = format!(
            "{}. What was computed is in {}; --resume goes on from there",
            error.text.trim_end_matches('.'),
            journal.display()
        );
    }
    error
}

pub(super) fn continuation(options: &ContinueOptions, common: &Common) -> Result<CommandEnd, Error> {
    let source = StudySource::find(&options.study, CONTINUATIONS)?;
    let study = ContinuationStudy::parse(source, &overrides(&options.keys.over(&options.set))?)?;
    let path = file_of(options.output.as_ref(), &study.head.source, None);
    let stop = interrupt_flag()?;
    let clock = Instant::now();
    let result = watched(common, BarKind::Branches, &stop, |bar| {
        let run = Continuation::new(&study, &path).overwrite(Overwrite::by_force(options.force));
        run.resume(options.resume).watch(bar).start()
    });
    let wall_time = clock.elapsed().as_secs_f64();
    let report = result.map_err(|error| resumable(error, &path))?;
    let explored = &report.explored;
    tell(common, &BranchesReport::new(&study, &report, wall_time))?;
    if explored.interrupted {
        let how = saved(explored.points(), &path);
        if !stop.load(Ordering::Relaxed) {
            return Err(Error::computation(format!(
                "the time of solver.max_wall_time is over{how}; more time is --set solver.max_wall_time=T"
            )));
        }
        return interrupted(common, &how);
    }
    let said = !common.quiet && !common.json;
    strictly(options.strict, &explored.remarks, said, &report.file)
}

pub(super) fn calibrate(options: &CalibrateOptions, common: &Common) -> Result<CommandEnd, Error> {
    let source = StudySource::find(&options.study, CALIBRATIONS)?;
    let study = CalibrationStudy::parse(source, &options.runs.overrides()?)?;
    let path = file_of(options.output.as_ref(), &study.runs.head.source, None);
    // Set before the file is created, so that an interruption ends the calibration cleanly from then on.
    let stop = interrupt_flag()?;
    let reserve = |case: &PathBuf| match same_file(case, &path) {
        true => {
            let why = "is the result file, too; choose another name with --case or -o";
            Err(Error::of_file(case, why))
        }
        false => Output::new(case, Product::Case("--case"), &study.runs.head.files, options.force),
    };
    let case = options.case.as_ref().map(reserve).transpose()?;
    let jobs = options.runs.jobs.unwrap_or_else(processors);
    let clock = Instant::now();
    let result = watched(common, BarKind::Parts, &stop, |bar| {
        let run = CalibrationRun::new(&study, &path).overwrite(Overwrite::by_force(options.force));
        run.workers(jobs).watch(bar).start()
    });
    let wall_time = clock.elapsed().as_secs_f64();
    let (file, calibration) = match result {
        Err(error) if error.is_interrupted() => {
            return interrupted(common, " before the first run was done; nothing is saved");
        }
        result => result?,
    };
    if let Some(case) = &case {
        write_case(case, &study, &calibration)?;
    }
    let paths = (&*file, options.case.as_deref());
    let report = CalibrationReport::new((&study, &calibration), paths, (jobs, wall_time));
    tell(common, &report)?;
    if calibration.interrupted {
        let (runs, file) = (calibration.runs.len(), file.display());
        let how = format!("; the {runs} runs made so far are in {file}, and the best of them is shown");
        return interrupted(common, &how);
    }
    Ok(CommandEnd::Done)
}

fn write_case(output: &Output, study: &CalibrationStudy, calibration: &Calibration) -> Result<(), Error> {
    let case = study.case_at(&calibration.shares).map_err(|error| {
        Error::computation(format!(
            "{}: the case cannot be written: {error}",
            output.path().display()
        ))
    })?;
    let mut text = format!(
        "# Calibrated by stickslip {} from {}; free parameters:\n",
        env!("CARGO_PKG_VERSION"),
        study.runs.head.source.label()
    );
    for (axis, value) in study.runs.axes.iter().zip(&calibration.parameters) {
        text += &format!("#   {} = {value:?}\n", axis.keys.join(", "));
    }
    text += &case.resolved();
    output.write(&[text.as_bytes()])
}

pub(super) fn work_precision(options: &WorkPrecisionOptions, common: &Common) -> Result<CommandEnd, Error> {
    let study = PrecisionStudy::parse(StudySource::find(&options.study, work_precision::STUDIES)?)?;
    let path = file_of(options.output.as_ref(), &study.head.source, None);
    // Everything is checked before minutes of computation, and before a folder is made.
    let stop = interrupt_flag()?;
    check_target(&path, Overwrite::by_force(options.force), &study.head.files)?;
    let figures = options.figure.as_deref();
    let figures = figures.map(|folder| figure_outputs(folder, options.force, &study.head.files, &path));
    let figures = figures.transpose()?.unwrap_or_default();
    let result = watched(common, BarKind::Parts, &stop, |bar| {
        let run = PrecisionRun::new(&study, &path).overwrite(Overwrite::by_force(options.force));
        run.watch(bar).start()
    });
    let (file, result) = match result {
        Err(error) if error.is_interrupted() => {
            return interrupted(common, " before there was a reference; nothing is saved");
        }
        result => result?,
    };
    let mut drawn = Vec::new();
    if !result.measurements.is_empty() {
        let figure = accuracy::work_precision_figure(&study.head.title, &result);
        for output in &figures {
            plot::draw(&figure, output)?;
            drawn.push(output.0.path().display().to_string());
        }
    }
    tell(common, &PrecisionReport::new(&study, &result, &file, drawn))?;
    if result.interrupted {
        let (done, all) = (result.measurements.len(), study.runs.len());
        let how = format!(" after {done} of {all} runs; they are saved in {}", file.display());
        return interrupted(common, &how);
    }
    Ok(CommandEnd::Done)
}

fn figure_outputs(
    folder: &Path,
    force: bool,
    inputs: &[PathBuf],
    result: &PathBuf,
) -> Result<Vec<FigureOutput>, Error> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Error::io(folder, "creating the folder of the figure", error, "--figure"))?;
    let output = |format: FigureFormat| {
        let name = plot::file_name_of(&[result], accuracy::WORK_PRECISION);
        let path = folder.join(format!("{name}.{}", format.extension()));
        let source = signature::source(std::slice::from_ref(result));
        Ok((
            Output::made_from(&path, plot::OF_COMMAND, (inputs, source), force)?,
            format,
        ))
    };
    [FigureFormat::Svg, FigureFormat::Png].into_iter().map(output).collect()
}
