//! `stickslip calibrate`: finds parameters that reproduce measured values.

use super::arguments::{CalibrateOptions, Common};
use super::input::{interrupt_flag, overwrite};
use super::progress::{Bar, BarKind};
use super::terminal::{lines, or_none};
use super::{CommandEnd, CommandError, interrupted, tell};
use crate::plot::target::{self, Product};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;
use stickslip_analysis::calibrate::{
    CALIBRATIONS, Calibration, CalibrationError, CalibrationStudy, Correlation, Determined, Role, Target, TargetResult,
    calibrate as find, write_file,
};
use stickslip_analysis::sweep::StudySource;
use stickslip_case::CaseError;
use stickslip_files::Reservation;
use stickslip_files::disk::same_file;

/// From this correlation on, the data determine a combination of two parameters rather than each of them.
const TRADED: f64 = 0.9;

pub(super) fn calibrate(options: &CalibrateOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let study = read_study(options)?;
    let name = &study.runs.source.name;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{name}.h5")));
    // Set before the file is created, so that an interruption ends the calibration cleanly from then on.
    let stop = interrupt_flag()?;
    let place = Reservation::take(&path, overwrite(options.force), &study.runs.files)?;
    if let Some(case) = &options.case {
        check_case_target(case, &path, &study, options.force)?;
    }
    let jobs = options.runs.jobs.unwrap_or_else(stickslip_engine::workers::processors);
    let bar = Bar::new(common, BarKind::Parts, &stop);
    let clock = Instant::now();
    let result = find(&study, jobs, &bar);
    bar.finish();
    let wall_time = clock.elapsed().as_secs_f64();
    let calibration = match result {
        Ok(calibration) => calibration,
        Err(CalibrationError::NothingRun) => {
            return interrupted(common, " before the first run was done; nothing is saved");
        }
        Err(error) => return Err(CommandError::computation(error)),
    };
    let file = write_file(&study, &calibration, place).map_err(CommandError::computation)?;
    if let Some(case) = &options.case {
        write_case(case, &study, &calibration)?;
    }
    tell(
        common,
        || document(&study, &calibration, options, &file, jobs, wall_time),
        || text_report(&study, &calibration, options, &file, wall_time),
    )?;
    if calibration.interrupted {
        let (runs, file) = (calibration.runs.len(), file.display());
        let how = format!("; the {runs} runs made so far are in {file}, and the best of them is shown");
        return interrupted(common, &how);
    }
    Ok(CommandEnd::Done)
}

fn read_study(options: &CalibrateOptions) -> Result<CalibrationStudy, CaseError> {
    let source = StudySource::find(&options.study, CALIBRATIONS)?;
    CalibrationStudy::parse(source, &options.runs.overrides()?)
}

fn check_case_target(case: &Path, result: &Path, study: &CalibrationStudy, force: bool) -> Result<(), CommandError> {
    if same_file(case, result) {
        return Err(CommandError::input(format!(
            "{}: is the result file, too; choose another name with --case or -o",
            case.display()
        )));
    }
    Ok(target::check(case, Product::Case, &study.runs.files, force)?)
}

fn write_case(path: &Path, study: &CalibrationStudy, calibration: &Calibration) -> Result<(), CommandError> {
    let case = study.case_at(&calibration.shares).map_err(|error| {
        CommandError::computation(format!("{}: the case cannot be written: {error}", path.display()))
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
    Ok(target::write(path, Product::Case, &[text.as_bytes()])?)
}

fn document(
    study: &CalibrationStudy,
    calibration: &Calibration,
    options: &CalibrateOptions,
    file: &Path,
    jobs: usize,
    wall_time: f64,
) -> impl Serialize {
    let known = |value: f64| value.is_finite().then_some(value);
    let key = |k: usize| study.runs.axes[k].keys[0].clone();
    let parameter = |k: usize| {
        let (axis, interval) = (&study.runs.axes[k], calibration.intervals.get(k));
        document! {
            key: key(k),
            unit: axis.unit.unwrap_or("1"),
            optimum: calibration.parameters[k],
            // Exists only if targets are set aside.
            compromise: calibration.compromise.as_ref().map(|point| point.parameters[k]),
            least: interval.map(|interval| interval.least),
            largest: interval.map(|interval| interval.largest),
            determined: interval.map(|interval| interval.determined.name()),
            range: axis.range.map_or([f64::NAN; 2], |range| [range.from, range.to]),
        }
    };
    let target = |(target, result): (&Target, &TargetResult)| {
        document! {
            quantity: target.name(),
            unit: target.unit,
            value: target.value,
            half_width: target.half_width,
            weight: target.weight,
            // `None` if the run lacks the quantity.
            here: known(result.here),
            residual: known(result.residual),
            // Least residual within the ranges.
            nearest: known(result.nearest),
            // For a contradicting target: the least residual together with it, and targets to set aside instead.
            together: known(result.together),
            instead: names(study, &result.instead),
            role: result.role.name(),
        }
    };
    // `None` if one of the two does not vary.
    let correlation = |pair: &Correlation| {
        document! {
            parameters: pair.parameters.map(key),
            coefficient: known(pair.coefficient),
        }
    };
    let targets = study.targets.iter().zip(&calibration.targets);
    document! {
        status: if calibration.interrupted { "interrupted" } else { "complete" },
        file: file.display().to_string(),
        // The case with the calibrated parameters, if it was requested.
        case: options.case.as_ref().map(|path| path.display().to_string()),
        study: study.runs.source.label(),
        title: study.runs.title.clone(),
        digest: study.digest(),
        // Whether all required targets are met.
        consistent: is_consistent(calibration),
        // In half-widths, at the optimum; also at the compromise if targets are set aside.
        largest_residual: calibration.worst,
        largest_residual_of_compromise: calibration.compromise.as_ref().map(|point| point.worst),
        parameters: (0..study.runs.axes.len()).map(parameter).collect::<Vec<_>>(),
        targets: targets.map(target).collect::<Vec<_>>(),
        correlations: calibration.correlations.iter().map(correlation).collect::<Vec<_>>(),
        runs: calibration.runs.len(),
        failed: calibration.failed,
        jobs: jobs,
        // s.
        wall_time: wall_time,
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
    let (title, runs) = (&study.runs.title, calibration.runs.len());
    let (parameters, targets) = (parameter_table(study, calibration), target_table(study, calibration));
    let verdict: String = verdict(study, calibration)
        .iter()
        .map(|line| format!("{line}\n"))
        .collect();
    let files = std::iter::once(file).chain(options.case.as_deref());
    let files: String = files.map(|path| format!("{}\n", path.display())).collect();
    format!("{title}\n{runs} runs in {wall_time:.1} s{failed}\n\n{parameters}\n{targets}\n{verdict}\n{files}")
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
        // All numbers have the same decimals, to 1/100 of the interval, so that residuals are visible.
        let places = (2.0 - target.half_width.log10().floor()).clamp(0.0, 12.0) as usize;
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        let number = |value: f64| or_none(finite(value), |value| format!("{value:.places$}"));
        vec![
            target.name().to_owned(),
            number(target.value),
            number(target.half_width),
            number(result.here),
            if target.unit == "1" { "" } else { target.unit }.to_owned(),
            or_none(finite(result.residual), |residual| format!("{residual:.2}")),
            result.role.name().to_owned(),
        ]
    };
    let rows = study.targets.iter().zip(&calibration.targets).map(row);
    let header = ["target", "measured", "+-", "here", "unit", "residual", ""];
    lines(&header, rows, [1, 2, 3, 5])
}

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
        let how = match interval.determined {
            Determined::Both => continue,
            Determined::Not => "not determined: both ends of its range",
            Determined::FromAboveOnly => "bounded from above only: the lower end of its range",
            Determined::FromBelowOnly => "bounded from below only: the upper end of its range",
        };
        lines.push(format!("{key} is {how} will do."));
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

fn six_digits(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e6).contains(&size) {
        let places = if value == 0.0 { 0.0 } else { 5.0 - size.log10().floor() };
        format!("{value:.0$}", places.max(0.0) as usize)
    } else {
        format!("{value:.5e}")
    }
}
