//! `stickslip calibrate`.

use super::arguments::{CalibrateOptions, Common};
use super::input::{bad_case, bad_file, interrupt_flag, overrides, overwrite};
use super::plot::bad;
use super::progress::Bar;
use super::terminal::lines;
use super::{CommandError, End, complain, tell};
use crate::calibrate::{
    CALIBRATIONS, Calibration, CalibrationError, CalibrationStudy, Determined, Role, Target, TargetResult,
    calibrate as find, write_file,
};
use crate::case::CaseError;
use crate::plot::target::{self, Product};
use crate::results::Reservation;
use crate::results::disk::same_file;
use crate::sweep::StudySource;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The JSON document of a calibration.
#[derive(Serialize)]
struct CalibrationDocument<'a> {
    /// complete or interrupted.
    status: &'a str,
    file: String,
    /// The case with the calibrated parameters, where one was asked for.
    case: Option<String>,
    study: String,
    title: &'a str,
    digest: String,
    /// Whether every target that is to be met is.
    consistent: bool,
    /// In half-widths, at the optimum.
    largest_residual: f64,
    /// The same at the compromise, where targets are set aside.
    largest_residual_of_compromise: Option<f64>,
    parameters: Vec<ParameterDocument>,
    targets: Vec<TargetDocument>,
    correlations: Vec<CorrelationDocument>,
    runs: usize,
    failed: usize,
    jobs: usize,
    /// s.
    wall_time: f64,
}

#[derive(Serialize)]
struct ParameterDocument {
    key: String,
    unit: &'static str,
    optimum: f64,
    /// If no target is set aside; only where some are.
    compromise: Option<f64>,
    least: Option<f64>,
    largest: Option<f64>,
    determined: Option<&'static str>,
    range: [f64; 2],
}

#[derive(Serialize)]
struct TargetDocument {
    quantity: &'static str,
    unit: &'static str,
    value: f64,
    half_width: f64,
    weight: f64,
    /// None where the run has no such quantity.
    here: Option<f64>,
    residual: Option<f64>,
    /// The least residual anywhere in the ranges.
    nearest: Option<f64>,
    /// Of a target that contradicts.
    together: Option<f64>,
    /// Of a target that contradicts: each of these could be set aside in its place.
    instead: Vec<&'static str>,
    role: &'static str,
}

#[derive(Serialize)]
struct CorrelationDocument {
    parameters: [String; 2],
    /// None where one of them does not vary.
    coefficient: Option<f64>,
}

/// From this correlation on, the data give a combination of two parameters rather than either.
const TRADED: f64 = 0.9;

/// Finds the parameters of a study, and reports them.
pub(super) fn calibrate(options: &CalibrateOptions, common: &Common) -> Result<End, CommandError> {
    let study = read_study(options).map_err(bad_case)?;
    let name = &study.runs.source.name;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{name}.h5")));
    // Before a file is there: from then on an interruption ends the calibration in good order.
    let stop = interrupt_flag()?;
    let place = Reservation::take(&path, overwrite(options.force), &study.runs.files).map_err(bad_file)?;
    if let Some(case) = &options.case {
        check_case_target(case, &path, &study, options.force)?;
    }
    let jobs = options.jobs.unwrap_or_else(crate::workers::processors);
    let bar = Bar::new(common);
    let clock = Instant::now();
    let result = find(
        &study,
        &crate::calibrate::CalibrationOptions {
            workers: jobs,
            stop: &stop,
        },
        &mut |progress| bar.count(progress.done, progress.total, "done", progress.stage),
    );
    bar.finish();
    let wall_time = clock.elapsed().as_secs_f64();
    let calibration = match result {
        Ok(calibration) => calibration,
        Err(CalibrationError::NothingRun) => {
            complain("interrupted before the first run was done; nothing is saved");
            return Ok(End::Interrupted);
        }
        Err(error) => return Err(CommandError::Computation(error.to_string())),
    };
    let file = write_file(&study, &calibration, place).map_err(|error| CommandError::Computation(error.to_string()))?;
    if let Some(case) = &options.case {
        write_case(case, &study, &calibration)?;
    }
    tell(
        common,
        || document(&study, &calibration, options, &file, jobs, wall_time),
        || text_report(&study, &calibration, options, &file, wall_time),
    )?;
    if calibration.interrupted {
        if !common.quiet {
            complain(&format!(
                "interrupted; the {} runs made so far are in {}, and the best of them is shown",
                calibration.runs.len(),
                file.display()
            ));
        }
        return Ok(End::Interrupted);
    }
    Ok(End::Done)
}

fn read_study(options: &CalibrateOptions) -> Result<CalibrationStudy, CaseError> {
    let source = StudySource::find(&options.study, CALIBRATIONS)?;
    let overrides = overrides(&options.budget.over(&options.set), options.method.as_deref())?;
    CalibrationStudy::parse(source, &overrides)
}

/// Whether the case may be written, before anything is computed.
fn check_case_target(case: &Path, result: &Path, study: &CalibrationStudy, force: bool) -> Result<(), CommandError> {
    if same_file(case, result) {
        return Err(CommandError::Input(format!(
            "{}: is the result file, too; choose another name with --case or -o",
            case.display()
        )));
    }
    target::check(case, Product::Case, &study.runs.files, force).map_err(|error| bad(error.into()))
}

/// Writes the base case with the calibrated parameters.
fn write_case(path: &Path, study: &CalibrationStudy, calibration: &Calibration) -> Result<(), CommandError> {
    let case = study.case_at(&calibration.shares).map_err(|error| {
        CommandError::Computation(format!("{}: the case cannot be written: {error}", path.display()))
    })?;
    let mut text = format!(
        "# Calibrated by stickslip {} from {}; free parameters:\n",
        env!("CARGO_PKG_VERSION"),
        study.runs.source.label()
    );
    for (axis, value) in study.runs.axes.iter().zip(&calibration.parameters) {
        text += &format!("#   {} = {value:?}\n", axis.keys.join(", "));
    }
    text += &case.resolved();
    target::write(path, Product::Case, &[text.as_bytes()]).map_err(|error| bad(error.into()))
}

fn document<'a>(
    study: &'a CalibrationStudy,
    calibration: &Calibration,
    options: &CalibrateOptions,
    file: &Path,
    jobs: usize,
    wall_time: f64,
) -> CalibrationDocument<'a> {
    let known = |value: f64| value.is_finite().then_some(value);
    let parameter = |k: usize| {
        let axis = &study.runs.axes[k];
        let interval = calibration.intervals.get(k);
        ParameterDocument {
            key: axis.keys[0].clone(),
            unit: axis.unit.unwrap_or("1"),
            optimum: calibration.parameters[k],
            compromise: calibration.compromise.as_ref().map(|point| point.parameters[k]),
            least: interval.map(|interval| interval.least),
            largest: interval.map(|interval| interval.largest),
            determined: interval.map(|interval| interval.determined.name()),
            range: axis.range.map_or([f64::NAN; 2], |range| [range.from, range.to]),
        }
    };
    let targets = study.targets.iter().zip(&calibration.targets);
    CalibrationDocument {
        status: if calibration.interrupted {
            "interrupted"
        } else {
            "complete"
        },
        file: file.display().to_string(),
        case: options.case.as_ref().map(|path| path.display().to_string()),
        study: study.runs.source.label(),
        title: &study.runs.title,
        digest: study.digest(),
        consistent: is_consistent(calibration),
        largest_residual: calibration.worst,
        largest_residual_of_compromise: calibration.compromise.as_ref().map(|point| point.worst),
        parameters: (0..study.runs.axes.len()).map(parameter).collect(),
        targets: targets
            .map(|(target, result)| TargetDocument {
                quantity: target.name(),
                unit: target.unit,
                value: target.value,
                half_width: target.half_width,
                weight: target.weight,
                here: known(result.here),
                residual: known(result.residual),
                nearest: known(result.nearest),
                together: known(result.together),
                instead: names(study, &result.instead),
                role: result.role.name(),
            })
            .collect(),
        correlations: calibration
            .correlations
            .iter()
            .map(|pair| CorrelationDocument {
                parameters: pair.parameters.map(|k| study.runs.axes[k].keys[0].clone()),
                coefficient: known(pair.coefficient),
            })
            .collect(),
        runs: calibration.runs.len(),
        failed: calibration.failed,
        jobs,
        wall_time,
    }
}

fn names(study: &CalibrationStudy, targets: &[usize]) -> Vec<&'static str> {
    targets.iter().map(|&k| study.targets[k].name()).collect()
}

fn is_consistent(calibration: &Calibration) -> bool {
    let mut roles = calibration.targets.iter().map(|target| target.role);
    calibration.worst <= 1.0 && roles.all(|role| matches!(role, Role::Held | Role::Compared))
}

fn text_report(
    study: &CalibrationStudy,
    calibration: &Calibration,
    options: &CalibrateOptions,
    file: &Path,
    wall_time: f64,
) -> String {
    let failed = match calibration.failed {
        0 => String::new(),
        failed => format!(", {failed} of them failed"),
    };
    let mut text = format!(
        "{}\n{} runs in {wall_time:.1} s{failed}\n\n",
        study.runs.title,
        calibration.runs.len()
    );
    text += &parameter_table(study, calibration);
    text.push('\n');
    text += &target_table(study, calibration);
    text.push('\n');
    for line in verdict(study, calibration) {
        text += &format!("{line}\n");
    }
    text += &format!("\n{}\n", file.display());
    if let Some(case) = &options.case {
        text += &format!("{}\n", case.display());
    }
    text
}

fn parameter_table(study: &CalibrationStudy, calibration: &Calibration) -> String {
    let row = |k: usize| {
        let axis = &study.runs.axes[k];
        let interval = calibration.intervals.get(k);
        let number = |value: Option<f64>| value.map_or_else(String::new, six_digits);
        vec![
            axis.keys[0].clone(),
            six_digits(calibration.parameters[k]),
            number(interval.map(|interval| interval.least)),
            number(interval.map(|interval| interval.largest)),
            axis.unit.unwrap_or("1").to_owned(),
            interval.map_or_else(String::new, |interval| interval.determined.name().to_owned()),
        ]
    };
    let header = ["parameter", "optimum", "least", "largest", "unit", ""];
    lines(&header, (0..study.runs.axes.len()).map(row), 1..4)
}

fn target_table(study: &CalibrationStudy, calibration: &Calibration) -> String {
    let row = |(target, result): (&Target, &TargetResult)| {
        // To a hundredth of the interval, so that the residual can be read off; as many digits for each.
        let places = (2.0 - target.half_width.log10().floor()).clamp(0.0, 12.0) as usize;
        let number = |value: f64| match value.is_finite() {
            true => format!("{value:.places$}"),
            false => "none".to_owned(),
        };
        vec![
            target.name().to_owned(),
            number(target.value),
            number(target.half_width),
            number(result.here),
            if target.unit == "1" { "" } else { target.unit }.to_owned(),
            match result.residual.is_finite() {
                true => format!("{:.2}", result.residual),
                false => "none".to_owned(),
            },
            result.role.name().to_owned(),
        ]
    };
    let rows = study.targets.iter().zip(&calibration.targets).map(row);
    let header = ["target", "measured", "+-", "here", "unit", "residual", ""];
    lines(&header, rows, [1, 2, 3, 5])
}

/// What the numbers say, in sentences.
fn verdict(study: &CalibrationStudy, calibration: &Calibration) -> Vec<String> {
    let mut lines = Vec::new();
    let targets = || study.targets.iter().zip(&calibration.targets);
    let held = targets().filter(|(_, result)| result.role == Role::Held).count();
    if calibration.intervals.is_empty() {
        return lines;
    }
    lines.push(match is_consistent(calibration) {
        true => "All targets hold together.".to_owned(),
        false => format!("{held} of the targets hold together; the spread is what they leave."),
    });
    for (target, result) in targets() {
        match result.role {
            Role::Contradicts => {
                let instead = match names(study, &result.instead).join(" or ") {
                    names if names.is_empty() => String::new(),
                    names => format!(" Setting aside {names} in its place does as well."),
                };
                lines.push(format!(
                    "{} contradicts them: with it held, too, the least largest residual found is {:.2}.{instead}",
                    target.name(),
                    result.together
                ));
            }
            Role::OutOfReach => lines.push(format!(
                "{} holds nowhere in the ranges; the nearest is {:.2} half-widths off.",
                target.name(),
                result.nearest
            )),
            Role::Held | Role::Compared => {}
        }
    }
    if let Some(compromise) = &calibration.compromise {
        let values = study.runs.axes.iter().zip(&compromise.parameters);
        let values = values.map(|(axis, &value)| format!("{} = {}", axis.keys[0], six_digits(value)));
        lines.push(format!(
            "With intervals {:.2} times as wide all that is in reach would hold together, at {}.",
            compromise.worst,
            values.collect::<Vec<_>>().join(", ")
        ));
    }
    for (axis, interval) in study.runs.axes.iter().zip(&calibration.intervals) {
        let key = &axis.keys[0];
        match interval.determined {
            Determined::Both => {}
            Determined::Not => lines.push(format!("{key} is not determined: both ends of its range will do.")),
            Determined::FromAboveOnly => lines.push(format!(
                "{key} is bounded from above only: the lower end of its range will do."
            )),
            Determined::FromBelowOnly => lines.push(format!(
                "{key} is bounded from below only: the upper end of its range will do."
            )),
        }
    }
    for pair in &calibration.correlations {
        if pair.coefficient.abs() >= TRADED {
            let [a, b] = pair.parameters.map(|k| study.runs.axes[k].keys[0].as_str());
            lines.push(format!(
                "{a} and {b} can be traded for each other (correlation {:.2}): the targets determine a combination of \
                 them better than either.",
                pair.coefficient
            ));
        }
    }
    lines
}

/// Six significant digits, with an exponent where the number is far from 1.
fn six_digits(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e6).contains(&size) {
        let places = if value == 0.0 { 0.0 } else { 5.0 - size.log10().floor() };
        format!("{value:.0$}", places.max(0.0) as usize)
    } else {
        format!("{value:.5e}")
    }
}
