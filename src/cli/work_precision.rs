//! `stickslip work-precision`.

use super::arguments::{Common, DPI, Format, WorkPrecisionOptions};
use super::input::{bad_case, bad_file, interrupt_flag, overwrite};
use super::modes::FIGURE;
use super::plot::{bad, check_target, save};
use super::progress::Bar;
use super::{CommandError, End, complain, tell, terminal};
use crate::analysis::work_precision::{Errors, Measurement, STUDIES, Study, StudyError, StudyResult, StudySource, run};
use crate::plot::{PlotError, style, svg, work_precision as figure};
use crate::provenance;
use crate::results::{ReferenceRow, Reservation, Status, WorkPrecisionFile, WorkPrecisionRow};
use crate::simulation::Method;
use serde::Serialize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

/// The JSON document of a study.
#[derive(Serialize)]
struct StudyDocument<'a> {
    status: &'static str,
    file: String,
    figures: Vec<String>,
    title: &'a str,
    case: &'a str,
    reference: ReferenceDocument<'a>,
    runs: &'a [Measurement],
}

#[derive(Serialize)]
struct ReferenceDocument<'a> {
    description: &'a str,
    events: usize,
    /// Of each error, s.
    uncertainty: Errors,
}

/// Runs a study into a file and a table, and a figure on request.
pub(super) fn work_precision(options: &WorkPrecisionOptions, common: &Common) -> Result<End, CommandError> {
    let source = StudySource::find(&options.study, STUDIES).map_err(bad_case)?;
    let study = Study::parse(source).map_err(bad_case)?;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}.h5", study.source.name)));
    // Everything that can be refused is refused before minutes are spent.
    let stop = interrupt_flag()?;
    let place = Reservation::take(&path, overwrite(options.force), &study.files).map_err(bad_file)?;
    let figures = figure_targets(options.figure.as_deref(), options.force, &study.files)?;
    let started = provenance::now();
    let bar = Bar::new(common);
    let result = run(&study, &mut |progress| {
        bar.count(progress.done, progress.of, "runs", progress.method.name());
        if stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    bar.finish();
    let result = result.map_err(|error| match error {
        StudyError::Truth(_) => CommandError::Input(error.to_string()),
        _ => CommandError::Computation(error.to_string()),
    })?;
    let Some(result) = result else {
        if !common.quiet {
            complain("interrupted before there was a reference; nothing is saved");
        }
        return Ok(End::Interrupted);
    };
    let status = if result.interrupted {
        Status::Interrupted
    } else {
        Status::Complete
    };
    let file = contents(&study, &result, &started)
        .write(&place, &status)
        .map_err(|error| CommandError::Computation(error.to_string()))?;
    let figures = draw(&study, &result, &figures).map_err(bad)?;
    tell(
        common,
        || document(&study, &result, &status, &file, &figures),
        || {
            let files = std::iter::once(&file).chain(&figures);
            let lines: String = files.map(|path| format!("{}\n", path.display())).collect();
            format!("{}\n{lines}", report(&study, &result))
        },
    )?;
    if result.interrupted {
        if !common.quiet {
            complain(&format!(
                "interrupted after {} of {} runs; they are saved in {}",
                result.measurements.len(),
                study.runs.len(),
                file.display()
            ));
        }
        return Ok(End::Interrupted);
    }
    Ok(End::Done)
}

/// The files of the figure in a folder, which is made if it is not there.
fn figure_targets(
    folder: Option<&Path>,
    force: bool,
    inputs: &[PathBuf],
) -> Result<Vec<(PathBuf, Format)>, CommandError> {
    let Some(folder) = folder else {
        return Ok(Vec::new());
    };
    std::fs::create_dir_all(folder).map_err(|source| {
        CommandError::Computation(format!(
            "{}: creating the folder of the figure failed: {source}; choose another with --figure",
            folder.display()
        ))
    })?;
    let mut targets = Vec::with_capacity(2);
    for format in [Format::Svg, Format::Png] {
        let path = folder.join(format!("{}.{}", figure::NAME, format.extension()));
        check_target(&path, FIGURE, inputs, force)?;
        targets.push((path, format));
    }
    Ok(targets)
}

fn draw(study: &Study, result: &StudyResult, targets: &[(PathBuf, Format)]) -> Result<Vec<PathBuf>, PlotError> {
    if targets.is_empty() || result.measurements.is_empty() {
        return Ok(Vec::new());
    }
    let figure = figure::figure(&study.title, result);
    let text = svg::svg(&figure, style::COLUMN_WIDTH)?;
    targets
        .iter()
        .map(|(path, format)| save(path, FIGURE, &text, &figure.full_title(), *format, DPI).map(|()| path.clone()))
        .collect()
}

fn contents(study: &Study, result: &StudyResult, started: &str) -> WorkPrecisionFile {
    let mut methods: Vec<Method> = Vec::new();
    for m in &result.measurements {
        if !methods.contains(&m.method) {
            methods.push(m.method);
        }
    }
    let missing = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let runs = result.measurements.iter().map(|m| {
        let (rtol, fixed_step) = m.knob.rtol_and_step();
        let method = methods
            .iter()
            .position(|&method| method == m.method)
            .unwrap_or_default();
        WorkPrecisionRow {
            method: i8::try_from(method).unwrap_or(i8::MAX),
            rtol: missing(rtol),
            fixed_step: missing(fixed_step),
            failed: m.failure.is_some(),
            same_sequence: m.same_sequence,
            events: m.events as u64,
            onset_error: missing(m.errors.onset),
            final_stick_error: missing(m.errors.final_stick),
            largest_event_error: missing(m.errors.largest),
            steps: m.steps,
            rhs_evaluations: m.rhs_evaluations,
            jacobian_evaluations: m.jacobian_evaluations,
            wall_time: m.wall_time,
        }
    });
    let reference = &result.reference;
    let Errors {
        onset,
        final_stick,
        largest,
    } = result.uncertainty;
    WorkPrecisionFile {
        title: study.title.clone(),
        source: provenance::source(),
        history: format!("{started} {}", provenance::command_line()),
        study: study.source.text.clone(),
        resolved: study.runs.first().map(|run| run.2.resolved()).unwrap_or_default(),
        meta: provenance::program(started),
        runs: runs.collect(),
        methods: methods.iter().map(|method| method.name()).collect(),
        reference: reference.description.clone(),
        events: reference
            .events
            .iter()
            .zip(&reference.uncertainties)
            .map(|(&(kind, time), &uncertainty)| ReferenceRow {
                kind: kind.code(),
                time,
                uncertainty,
            })
            .collect(),
        uncertainties: [onset, final_stick, largest].map(missing),
    }
}

fn document<'a>(
    study: &'a Study,
    result: &'a StudyResult,
    status: &Status,
    file: &Path,
    figures: &[PathBuf],
) -> StudyDocument<'a> {
    StudyDocument {
        status: if *status == Status::Complete {
            "complete"
        } else {
            "interrupted"
        },
        file: file.display().to_string(),
        figures: figures.iter().map(|path| path.display().to_string()).collect(),
        title: &study.title,
        case: &study.case_label,
        reference: ReferenceDocument {
            description: &result.reference.description,
            events: result.reference.events.len(),
            uncertainty: result.uncertainty,
        },
        runs: &result.measurements,
    }
}

fn report(study: &Study, result: &StudyResult) -> String {
    let header = [
        "method", "rtol", "step", "onset", "final", "all", "events", "calls", "time",
    ];
    let rows = result.measurements.iter().map(|m| row(m, &result.uncertainty));
    let table = terminal::lines(&header, rows, 1..9);
    let uncertainty = |error: Option<f64>| error.map_or_else(|| "none".to_owned(), |e| format!("{e:.0e} s"));
    let Errors {
        onset,
        final_stick,
        largest,
    } = result.uncertainty;
    format!(
        "{}\n{}, {} events\n\n{}\nonset, final, all: errors of the first stick, of the last and the largest of all events, s; \
         calls of the\nright-hand side; time in s. Another sequence of events than the reference's is marked *, and has \
         no \"all\".\nReference: {}.\nIts uncertainty is {} (onset), {} (final), {} (all); an error in brackets is below it.\n",
        study.title,
        study.case_label,
        result.reference.events.len(),
        table,
        result.reference.description,
        uncertainty(onset),
        uncertainty(final_stick),
        uncertainty(largest),
    )
}

fn row(m: &Measurement, uncertainty: &Errors) -> Vec<String> {
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
