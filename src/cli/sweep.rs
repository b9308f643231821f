//! `stickslip sweep`: runs a study of many runs.

use super::arguments::{Common, SweepOptions};
use super::input::{interrupt_flag, overwrite};
use super::plot_studies;
use super::progress::{Bar, BarKind};
use super::{CommandEnd, CommandError, captured, interrupted, strictly, tell};
use crate::plot::PlotError;
use crate::plot::studies::{self, Choice};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;
use stickslip_analysis::sweep::{
    Boundaries, CurveBranch, Design, JournalError, STUDIES, Shard, Study, StudySource, Sweep, SweepError, SweepReport,
    journal_path,
};
use stickslip_case::CaseError;
use stickslip_files::{Reason, StudyFile};

/// A connected line of a boundary, in the units of its axes.
#[derive(Serialize)]
struct CurveDocument {
    plane: String,
    points: usize,
    x_range: [f64; 2],
    y_range: [f64; 2],
    nose: Option<[f64; 2]>,
}

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
    let report = result.map_err(|error| command_error(&error, &path))?;
    let curves = report
        .boundaries
        .as_ref()
        .map_or_else(Vec::new, |found| curve_documents(&study, found));
    let failure = |(point, message): &(u64, String)| document! { point: *point, message: message.clone() };
    let shard = |shard: Shard| document! { index: shard.index(), count: shard.count() };
    let document = || {
        document! {
            status: if report.interrupted { "interrupted" } else { "complete" },
            file: report.file.display().to_string(),
            study: study.source.label(),
            title: &study.title,
            digest: study.digest(),
            // Finished points, and points run by this command.
            points: report.points,
            run_now: report.run_now,
            failed: report.failed,
            failures: report.failures.iter().map(failure).collect::<Vec<_>>(),
            jobs: jobs,
            // s.
            wall_time: wall_time;
            optional:
            shard: options.shard.map(shard),
            // Runs that end before their result is certain: a lasting stick, or a periodic motion.
            unfinished: report.unfinished,
            curves: Some(&curves).filter(|curves| !curves.is_empty()),
        }
    };
    tell(common, document, || {
        text_report(&study, options.shard, &report, &curves, wall_time)
    })?;
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
    let name = &study.source.name;
    PathBuf::from(match shard {
        Some(shard) => format!("{name}.shard-{}-of-{}.h5", shard.index(), shard.count()),
        None => format!("{name}.h5"),
    })
}

fn read_study(options: &SweepOptions) -> Result<Study, CaseError> {
    let source = StudySource::find(&options.study, STUDIES)?;
    Study::parse(source, &options.runs.overrides()?)
}

/// The message of a study's error, which names the journal if there is one.
pub(super) fn resumable(error: &impl ToString, path: &Path) -> String {
    let (text, journal) = (error.to_string(), journal_path(path));
    match journal.exists() {
        true => format!(
            "{}. What was computed is in {}; --resume goes on from there",
            text.trim_end_matches('.'),
            journal.display()
        ),
        false => text,
    }
}

fn command_error(error: &SweepError, path: &Path) -> CommandError {
    let text = error.to_string();
    match error {
        SweepError::Refused(_) => CommandError::input(text),
        SweepError::Journal(JournalError::File(inner)) | SweepError::File(inner) => match inner.reason {
            Reason::NoReader(_) | Reason::NotCreated(_) => CommandError::computation(text),
            _ if inner.is_of_the_system() => CommandError::computation(resumable(error, path)),
            _ => CommandError::input(text),
        },
        SweepError::Journal(_) => CommandError::input(text),
        SweepError::Executor(_) => CommandError::computation(resumable(error, path)),
        _ => CommandError::computation(text),
    }
}

fn curve_documents(study: &Study, boundaries: &Boundaries) -> Vec<CurveDocument> {
    let Design::Boundary(spec) = &study.design else {
        return Vec::new();
    };
    let plane = |plane: usize| {
        let values = study.axes.iter().zip(&boundaries.planes[plane]).enumerate();
        let outside = values.filter(|(k, _)| !spec.plane.contains(k));
        let words = outside.map(|(_, (axis, value))| format!("{} = {}", axis.keys[0], value.word()));
        words.collect::<Vec<_>>().join(", ")
    };
    let documents = boundaries.curves.iter().map(|curve| {
        let range = |k: usize| {
            let values = curve.points.iter().map(|point| point.middle()[k]);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
                [low.min(v), high.max(v)]
            })
        };
        let nose = curve.points.iter().find(|point| point.branch == CurveBranch::Fold);
        CurveDocument {
            plane: plane(curve.plane),
            points: curve.points.len(),
            x_range: range(0),
            y_range: range(1),
            nose: nose.map(|point| point.middle()),
        }
    });
    documents.collect()
}

fn text_report(
    study: &Study,
    shard: Option<Shard>,
    report: &SweepReport,
    curves: &[CurveDocument],
    wall_time: f64,
) -> String {
    let rate = report.run_now as f64 / wall_time;
    let mut text = match shard {
        Some(shard) => format!("{}, shard {shard}\n", study.title),
        None => format!("{}\n", study.title),
    };
    text += &match report.run_now {
        0 => format!("{} points, none of them run now\n", report.points),
        1 if report.points == 1 => format!("1 point in {wall_time:.1} s\n"),
        now if now == report.points => format!("{now} points in {wall_time:.1} s, {rate:.1} a second\n"),
        now => format!(
            "{} points, {now} of them now in {wall_time:.1} s, {rate:.1} a second\n",
            report.points
        ),
    };
    if report.failed > 0 {
        text += &match report.failed {
            1 => "1 point failed:\n".to_owned(),
            failed => format!("{failed} points failed; the first of them:\n"),
        };
        for (point, message) in &report.failures {
            text += &format!("  {point}: {message}\n");
        }
    }
    if let Some(unfinished @ 1..) = report.unfinished {
        text += &match unfinished {
            1 => "1 run ends".to_owned(),
            many => format!("{many} runs end"),
        };
        text += match study.slows_down() {
            true => {
                " before a stick that lasts (final_stick_time is NaN), so that sticks may be missing; a later output.end_time \
                 would show them\n"
            }
            false => {
                " before the motion repeats itself or settles (motion is not-periodic, or stuck in a stick shorter than twice \
                 the longest before it); a later output.end_time may show the attractor\n"
            }
        };
    }
    if let (Design::Boundary(spec), Some(_), true) = (&study.design, &report.boundaries, curves.is_empty()) {
        let [columns, rows] = spec.nodes;
        text += &format!(
            "no boundary: between the runs of the first grid, {columns} x {rows}, {} changes nowhere; widen the ranges, \
             or raise count\n",
            spec.criterion.text()
        );
    }
    if !curves.is_empty() {
        let header = ["curve", "points", "x from", "to", "y from", "to", "fold x", "y"];
        let row = |curve: &CurveDocument| {
            let number = |x: f64| format!("{x:.6}");
            let mut row = vec![curve.plane.clone(), curve.points.to_string()];
            row.extend([curve.x_range, curve.y_range].into_iter().flatten().map(number));
            row.extend(curve.nose.map(|fold| fold.map(number)).unwrap_or_default());
            row
        };
        text += &format!("\n{}", super::terminal::lines(&header, curves.iter().map(row), 1..8));
    }
    format!("{text}{}\n{}\n", spread(study, shard, report), report.file.display())
}

fn spread(study: &Study, shard: Option<Shard>, report: &SweepReport) -> String {
    if !matches!(study.design, Design::Rows(_)) || shard.is_some() {
        return String::new();
    }
    let file = StudyFile::open_sweep(&report.file).map_err(PlotError::from);
    let found = file.and_then(|file| studies::distributions(&file, &Choice::default()));
    found.map_or_else(|_| String::new(), |found| plot_studies::report(&found))
}
