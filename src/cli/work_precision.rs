//! `stickslip work-precision`: measures errors and costs of methods.

use super::arguments::{Common, FigureFormat, WorkPrecisionOptions};
use super::input::{interrupt_flag, overwrite};
use super::plot;
use super::progress::{Bar, BarKind};
use super::terminal::{self, or_none};
use super::{CommandEnd, CommandError, interrupted, tell};
use crate::plot::{PlotError, signature, target, work_precision as figure};
use std::path::{Path, PathBuf};
use stickslip_analysis::analysis::work_precision::{
    Measurement, MethodErrors, PrecisionStudy, STUDIES, StudyError, StudyResult, StudySource, run,
};
use stickslip_analysis::provenance;
use stickslip_files::Reservation;
use stickslip_system::quote::bound;

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
    let bar = Bar::new(common, BarKind::Parts, &stop);
    let result = run(&study, &bar);
    bar.finish();
    let result = result.map_err(|error| match error {
        StudyError::Truth(_) => CommandError::input(error),
        _ => CommandError::computation(error),
    })?;
    let Some(result) = result else {
        return interrupted(common, " before there was a reference; nothing is saved");
    };
    let file = result
        .write(&study, &started, &place)
        .map_err(CommandError::computation)?;
    let figures = draw(&study, &result, &figures, &names)?;
    tell(
        common,
        || {
            document! {
                status: if result.interrupted { "interrupted" } else { "complete" },
                file: file.display().to_string(),
                figures: figures.iter().map(|path| path.display().to_string()).collect::<Vec<_>>(),
                title: &study.title,
                case: &study.case_label,
                reference: document! {
                    description: &result.reference.description,
                    events: result.reference.events.len(),
                    // Uncertainty of each error, s.
                    uncertainty: result.uncertainty,
                },
                runs: &result.measurements,
            }
        },
        || {
            let files = std::iter::once(&file).chain(&figures);
            let lines: String = files.map(|path| format!("{}\n", path.display())).collect();
            format!("{}\n{lines}", report(&study, &result))
        },
    )?;
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

fn report(study: &PrecisionStudy, result: &StudyResult) -> String {
    let header = [
        "method", "rtol", "step", "onset", "final", "all", "events", "calls", "time",
    ];
    let rows = result.measurements.iter().map(|m| row(m, &result.uncertainty));
    let table = terminal::lines(&header, rows, 1..9);
    let uncertainty = |error: Option<f64>| or_none(error, |e| format!("{} s", bound(e, 0)));
    let unsure = &result.uncertainty;
    format!(
        "{}\n{}, {} events\n\n{}\nonset, final, all: errors of the first stick, of the last and the largest of all events, s; \
         calls of the\nright-hand side; time in s. Another sequence of events than the reference's is marked *, and has \
         no \"all\".\nReference: {}.\nIts uncertainty is {} (onset), {} (final), {} (all); an error in brackets is below it.\n",
        study.title,
        study.case_label,
        result.reference.events.len(),
        table,
        result.reference.description,
        uncertainty(unsure.onset),
        uncertainty(unsure.final_stick),
        uncertainty(unsure.largest),
    )
}

fn row(m: &Measurement, uncertainty: &MethodErrors) -> Vec<String> {
    let (rtol, step) = m.knob.rtol_and_step();
    let plain = |value: Option<f64>| value.map(|x| format!("{x:e}")).unwrap_or_default();
    if m.failure.is_some() {
        let failed = "failed".to_owned();
        return [m.method.name().to_owned(), plain(rtol), plain(step), failed]
            .into_iter()
            .chain(std::iter::repeat_n(String::new(), 5))
            .collect();
    }
    let error = |error: Option<f64>, uncertainty: Option<f64>| match error {
        None => "-".to_owned(),
        Some(e) if uncertainty.is_some_and(|u| e <= u) => format!("({e:.0e})"),
        Some(e) => format!("{e:.1e}"),
    };
    vec![
        m.method.name().to_owned(),
        plain(rtol),
        plain(step),
        error(m.errors.onset, uncertainty.onset),
        error(m.errors.final_stick, uncertainty.final_stick),
        error(m.errors.largest, uncertainty.largest),
        format!("{}{}", m.events, if m.same_sequence { "" } else { "*" }),
        m.rhs_evaluations.to_string(),
        format!("{:.3}", m.wall_time),
    ]
}
