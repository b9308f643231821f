//! `stickslip work-precision`: measures errors and costs of methods.

use super::arguments::{Common, FigureFormat, WorkPrecisionOptions};
use super::input::{interrupt_flag, overwrite};
use super::plot;
use super::progress::Bar;
use super::{CommandEnd, CommandError, interrupted, tell};
use crate::plot::{PlotError, signature, target, work_precision as figure};
use crate::report::PrecisionReport;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use stickslip_analysis::analysis::work_precision::{
    Measurement, PrecisionStudy, STUDIES, StudyError, StudyResult, StudySource, run,
};
use stickslip_analysis::provenance;
use stickslip_engine::simulation::Method;
use stickslip_engine::workers::go_on_unless;
use stickslip_files::{Reservation, Status, WorkPrecisionFile, WorkPrecisionRow};

pub(super) fn work_precision(options: &WorkPrecisionOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let source = StudySource::find(&options.study, STUDIES)?;
    let study = PrecisionStudy::parse(source)?;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}.h5", study.source.name)));
    // Everything is checked before minutes of computation.
    let stop = interrupt_flag()?;
    let place = Reservation::take(&path, overwrite(options.force), &study.files)?;
    let names = signature::source(std::slice::from_ref(&path));
    let figures = figure_targets(options.figure.as_deref(), options.force, &study.files, &names)?;
    let started = provenance::now();
    let bar = Bar::new(common);
    let result = run(&study, &mut |progress| {
        bar.count(progress.done, progress.of, "runs", progress.method.name());
        go_on_unless(stop.load(Ordering::Relaxed))
    });
    bar.finish();
    let result = result.map_err(|error| match error {
        StudyError::Truth(_) => CommandError::input(error),
        _ => CommandError::computation(error),
    })?;
    let Some(result) = result else {
        return interrupted(common, " before there was a reference; nothing is saved");
    };
    let status = if result.interrupted {
        Status::Interrupted
    } else {
        Status::Complete
    };
    let file = contents(&study, &result, &started)
        .write(&place, &status)
        .map_err(CommandError::computation)?;
    let figures = draw(&study, &result, &figures, &names)?;
    tell(common, &PrecisionReport::new(&study, &result, &file, &figures))?;
    if result.interrupted {
        let (done, all) = (result.measurements.len(), study.runs.len());
        let how = format!(" after {done} of {all} runs; they are saved in {}", file.display());
        return interrupted(common, &how);
    }
    Ok(CommandEnd::Done)
}

fn figure_targets(
    folder: Option<&Path>,
    force: bool,
    inputs: &[PathBuf],
    source: &str,
) -> Result<Vec<(PathBuf, FigureFormat)>, CommandError> {
    let Some(folder) = folder else {
        return Ok(Vec::new());
    };
    std::fs::create_dir_all(folder).map_err(|source| {
        CommandError::computation(format!(
            "{}: creating the folder of the figure failed: {source}; choose another with --figure",
            folder.display()
        ))
    })?;
    let mut targets = Vec::with_capacity(2);
    for format in [FigureFormat::Svg, FigureFormat::Png] {
        let path = folder.join(format!("{}.{}", figure::NAME, format.extension()));
        target::check(&path, plot::OF_COMMAND, inputs, force)?;
        if !force {
            plot::spare(&path, source, plot::OF_COMMAND)?;
        }
        targets.push((path, format));
    }
    Ok(targets)
}

fn draw(
    study: &PrecisionStudy,
    result: &StudyResult,
    targets: &[(PathBuf, FigureFormat)],
    source: &str,
) -> Result<Vec<PathBuf>, PlotError> {
    if targets.is_empty() || result.measurements.is_empty() {
        return Ok(Vec::new());
    }
    let figure = figure::figure(&study.title, result);
    targets
        .iter()
        .map(|(path, format)| plot::draw(&figure, (path, *format), source.to_owned()).map(|()| path.clone()))
        .collect()
}

fn contents(study: &PrecisionStudy, result: &StudyResult, started: &str) -> WorkPrecisionFile {
    let mut methods: Vec<Method> = Vec::new();
    for m in &result.measurements {
        if !methods.contains(&m.method) {
            methods.push(m.method);
        }
    }
    let missing = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let run = |m: &Measurement| -> WorkPrecisionRow {
        let (rtol, fixed_step) = m.knob.rtol_and_step();
        let method = methods.iter().position(|&method| method == m.method);
        [
            method.unwrap_or_default() as f64,
            missing(rtol),
            missing(fixed_step),
            m.failure.is_some().into(),
            m.same_sequence.into(),
            m.events as f64,
            missing(m.errors.onset),
            missing(m.errors.final_stick),
            missing(m.errors.largest),
            m.steps as f64,
            m.rhs_evaluations as f64,
            m.jacobian_evaluations as f64,
            m.wall_time,
        ]
    };
    let (reference, unsure) = (&result.reference, &result.uncertainty);
    let events = reference.events.iter().zip(&reference.uncertainties);
    WorkPrecisionFile {
        title: study.title.clone(),
        source: provenance::source(),
        history: format!("{started} {}", provenance::command_line()),
        study: study.source.text.clone(),
        resolved: study.runs.first().map(|run| run.2.resolved()).unwrap_or_default(),
        meta: provenance::program(started),
        runs: result.measurements.iter().map(run).collect(),
        methods: methods.iter().map(|method| method.name().to_owned()).collect(),
        reference: reference.description.clone(),
        events: events
            .map(|(&(kind, time), &uncertainty)| [kind.code().into(), time, uncertainty])
            .collect(),
        uncertainties: [unsure.onset, unsure.final_stick, unsure.largest].map(missing),
    }
}
