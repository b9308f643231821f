//! Report of a calibration: parameters, targets, and what they leave open.

use super::{Page, PageTable, Report, fixed, six_digits};
use serde::Serialize;
use std::path::Path;
use stickslip_analysis::calibrate::{Calibration, CalibrationStudy, Determined, Role};

/// From this correlation on, the data determine a combination of two parameters rather than each of them.
const TRADED: f64 = 0.9;

/// Numbers that are unknown are null in JSON.
#[derive(Serialize)]
pub(crate) struct CalibrationReport<'a> {
    status: &'static str,
    file: String,
    /// The case with the calibrated parameters, if it was requested.
    case: Option<String>,
    study: String,
    title: &'a str,
    digest: String,
    /// Whether all required targets are met.
    consistent: bool,
    /// In half-widths, at the optimum; also at the compromise if targets are set aside.
    largest_residual: f64,
    largest_residual_of_compromise: Option<f64>,
    parameters: Vec<CalibratedParameter<'a>>,
    targets: Vec<CalibratedTarget>,
    correlations: Vec<TradedParameters<'a>>,
    runs: usize,
    failed: usize,
    jobs: usize,
    /// s.
    wall_time: f64,
}

#[derive(Serialize)]
struct CalibratedParameter<'a> {
    key: &'a str,
    unit: &'static str,
    optimum: f64,
    /// Exists only if targets are set aside.
    compromise: Option<f64>,
    least: Option<f64>,
    largest: Option<f64>,
    determined: Option<Determined>,
    range: [f64; 2],
}

#[derive(Serialize)]
struct CalibratedTarget {
    quantity: &'static str,
    unit: &'static str,
    value: f64,
    half_width: f64,
    weight: f64,
    /// NaN if the run lacks the quantity.
    here: f64,
    residual: f64,
    /// Least residual within the ranges.
    nearest: f64,
    /// For a contradicting target: the least residual together with it, and targets to set aside instead.
    together: f64,
    instead: Vec<&'static str>,
    role: Role,
}

#[derive(Serialize)]
struct TradedParameters<'a> {
    parameters: [&'a str; 2],
    /// NaN if one of the two does not vary.
    coefficient: f64,
}

impl<'a> CalibrationReport<'a> {
    pub fn new(
        (study, found): (&'a CalibrationStudy, &Calibration),
        (file, case): (&Path, Option<&Path>),
        (jobs, wall_time): (usize, f64),
    ) -> CalibrationReport<'a> {
        let axes = &study.runs.axes;
        let key = |k: usize| axes[k].keys[0].as_str();
        let parameter = |k: usize| {
            let interval = found.intervals.get(k);
            CalibratedParameter {
                key: key(k),
                unit: axes[k].unit.unwrap_or("1"),
                optimum: found.parameters[k],
                compromise: found.compromise.as_ref().map(|point| point.parameters[k]),
                least: interval.map(|interval| interval.least),
                largest: interval.map(|interval| interval.largest),
                determined: interval.map(|interval| interval.determined),
                range: axes[k].range.map_or([f64::NAN; 2], |range| [range.from, range.to]),
            }
        };
        let targets = study
            .targets
            .iter()
            .zip(&found.targets)
            .map(|(target, result)| CalibratedTarget {
                quantity: target.name(),
                unit: target.unit,
                value: target.value,
                half_width: target.half_width,
                weight: target.weight,
                here: result.here,
                residual: result.residual,
                nearest: result.nearest,
                together: result.together,
                instead: result.instead.iter().map(|&k| study.targets[k].name()).collect(),
                role: result.role,
            });
        let correlations = found.correlations.iter().map(|pair| TradedParameters {
            parameters: pair.parameters.map(key),
            coefficient: pair.coefficient,
        });
        let mut roles = found.targets.iter().map(|target| target.role);
        CalibrationReport {
            status: super::status(found.interrupted),
            file: file.display().to_string(),
            case: case.map(|path| path.display().to_string()),
            study: study.runs.head.source.label(),
            title: &study.runs.head.title,
            digest: study.digest(),
            consistent: found.worst <= 1.0 && roles.all(|role| matches!(role, Role::Held | Role::Compared)),
            largest_residual: found.worst,
            largest_residual_of_compromise: found.compromise.as_ref().map(|point| point.worst),
            parameters: (0..axes.len()).map(parameter).collect(),
            targets: targets.collect(),
            correlations: correlations.collect(),
            runs: found.runs.len(),
            failed: found.failed,
            jobs,
            wall_time,
        }
    }

    /// Sentences on the parameters that the targets determine; none after an early interruption.
    fn verdict(&self) -> Vec<String> {
        if self.parameters.iter().all(|parameter| parameter.determined.is_none()) {
            return Vec::new();
        }
        let held = self.targets.iter().filter(|target| target.role == Role::Held).count();
        let mut lines = vec![match self.consistent {
            true => "All targets hold together.".to_owned(),
            false => format!("{held} of the targets hold together; the spread is what they leave."),
        }];
        lines.extend(self.targets.iter().filter_map(CalibratedTarget::set_aside));
        if let Some(worst) = self.largest_residual_of_compromise {
            let value =
                |one: &CalibratedParameter| Some(format!("{} = {}", one.key, six_digits().print(one.compromise?)));
            let values: Vec<String> = self.parameters.iter().filter_map(value).collect();
            lines.push(format!(
                "With intervals {worst:.2} times as wide all that is in reach would hold together, at {}.",
                values.join(", ")
            ));
        }
        lines.extend(self.parameters.iter().filter_map(|parameter| {
            let how = match parameter.determined? {
                Determined::Both => return None,
                Determined::Not => "not determined: both ends of its range",
                Determined::FromAboveOnly => "bounded from above only: the lower end of its range",
                Determined::FromBelowOnly => "bounded from below only: the upper end of its range",
            };
            Some(format!("{} is {how} will do.", parameter.key))
        }));
        let traded = self.correlations.iter().filter(|pair| pair.coefficient.abs() >= TRADED);
        lines.extend(traded.map(|TradedParameters { parameters: [a, b], coefficient }| {
            format!(
                "{a} and {b} can be traded for each other (correlation {coefficient:.2}): the targets determine a combination of \
                 them better than either."
            )
        }));
        lines
    }
}

impl CalibratedTarget {
    /// Why the target is not held.
    fn set_aside(&self) -> Option<String> {
        let instead = match self.instead.join(" or ") {
            names if names.is_empty() => String::new(),
            names => format!(" Setting aside {names} in its place does as well."),
        };
        match self.role {
            Role::Contradicts => Some(format!(
                "{} contradicts them: with it held, too, the least largest residual found is {:.2}.{instead}",
                self.quantity, self.together
            )),
            Role::OutOfReach => Some(format!(
                "{} holds nowhere in the ranges; the nearest is {:.2} half-widths off.",
                self.quantity, self.nearest
            )),
            Role::Held | Role::Compared => None,
        }
    }

    /// A number with decimals to 1/100 of the interval, so that residuals are visible.
    fn print(&self, value: f64) -> String {
        let places = (2.0 - self.half_width.log10().floor()).clamp(0.0, 12.0) as usize;
        fixed(places).print(finite(value))
    }
}

fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

impl Report for CalibrationReport<'_> {
    fn page(&self) -> Page {
        let failed = match self.failed {
            0 => String::new(),
            failed => format!(", {failed} of them failed"),
        };
        let parameters = PageTable::of(&self.parameters)
            .text("parameter", |one| one.key.to_owned())
            .number("optimum", "", six_digits(), |one| one.optimum)
            .number("least", "", six_digits().or(""), |one| one.least)
            .number("largest", "", six_digits().or(""), |one| one.largest)
            .text("unit", |one| one.unit)
            .text("", |one| one.determined.map_or("", Determined::name))
            .done();
        let targets = PageTable::of(&self.targets)
            .text("target", |one| one.quantity)
            .count("measured", |one| one.print(one.value))
            .count("+-", |one| one.print(one.half_width))
            .count("here", |one| one.print(one.here))
            .text("unit", |one| if one.unit == "1" { "" } else { one.unit })
            .number("residual", "", fixed(2), |one| finite(one.residual))
            .text("", |one| one.role.name())
            .done();
        let verdict = Some(self.verdict().join("\n")).filter(|lines| !lines.is_empty());
        Page::new(
            self.title,
            format!("{} runs in {:.1} s{failed}", self.runs, self.wall_time),
        )
        .with_all(verdict)
        .with(parameters)
        .details([targets])
        .with_lines(std::iter::once(&self.file).chain(&self.case))
    }
}
