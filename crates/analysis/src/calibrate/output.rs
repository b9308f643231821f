//! File of a calibration: a sweep file of all runs, with the results of the search.

use super::region::Determined;
use super::search::Calibration;
use super::study::CalibrationStudy;
use super::target::{Role, Target, TargetResult};
use crate::provenance;
use crate::sweep::{command_attribute, header, sweep_variables};
use std::path::PathBuf;
use stickslip_files::{
    FileColumn, FileRows, Reservation, ResultError, Status, SweepLayout, SweepPlan, SweepRow, SweepWriter,
};

/// Writes a calibration to a reserved place and returns its path. An incomplete calibration keeps the partial name.
pub fn write_file(
    study: &CalibrationStudy,
    calibration: &Calibration,
    place: Reservation,
) -> Result<PathBuf, ResultError> {
    let mut meta = provenance::build();
    meta.extend(command_attribute(&study.runs));
    let header = header(&study.runs, "calibrate", study.digest(), meta);
    let axes = study.runs.axes.iter().map(|axis| axis.in_a_file(&[], Vec::new()));
    let plan = SweepPlan {
        shard: None,
        layout: SweepLayout::Table,
        axes: axes.collect(),
        variables: sweep_variables(&study.runs),
        points: calibration.runs.len(),
        events: None,
    };
    let mut writer = SweepWriter::create(place, &header, &plan)?;
    for (number, (shares, result)) in (0..).zip(&calibration.runs) {
        writer.push(SweepRow {
            number,
            coordinates: study.parameters(shares),
            values: result.as_ref().ok().cloned(),
            failure: result.as_ref().err().cloned(),
            events: Vec::new(),
        })?;
    }
    let units = study.runs.axes.iter().map(|axis| axis.unit.unwrap_or("1"));
    let mut attributes = vec![("parameter_units", units.collect::<Vec<_>>().join(", "))];
    attributes.push(("largest_residual", format!("{:?}", calibration.worst)));
    if let Some(compromise) = &calibration.compromise {
        attributes.push(("largest_residual_of_compromise", format!("{:?}", compromise.worst)));
    }
    writer.add_table("calibration", &attributes, &parameter_columns(study, calibration))?;
    let units = study.targets.iter().map(|target| target.unit);
    let attributes = [("target_units", units.collect::<Vec<_>>().join(", "))];
    writer.add_table("targets", &attributes, &target_columns(study, calibration))?;
    if !calibration.correlations.is_empty() {
        writer.add_table("correlations", &[], &correlation_columns(study, calibration))?;
    }
    writer.finish(&if calibration.interrupted {
        Status::Interrupted
    } else {
        Status::Complete
    })
}

fn words(names: impl Iterator<Item = String>) -> Vec<(i64, String)> {
    (0..).zip(names).collect()
}

fn index(name: &str, long_name: &str, names: impl Iterator<Item = String>) -> FileColumn {
    let words = words(names);
    FileColumn::codes(name, long_name, 0..words.len() as i8, words)
}

fn parameter_names(study: &CalibrationStudy) -> impl Iterator<Item = String> {
    study.runs.axes.iter().map(|axis| axis.keys[0].clone())
}

const OPTIMUM: &str = "where the largest residual is least, in the unit of the parameter";
const RANGE_FROM: &str = "one end of the range it was looked for in";
const COMPROMISE: &str = "where the largest residual is least if no target is set aside";
const LEAST: &str = "least value for which the held targets hold";
const LARGEST: &str = "largest value for which the held targets hold";
const DETERMINED: &str = "from which sides the targets bound it within the range";
const HALF_WIDTH: &str = "how far the quantity may lie from it, in the unit of the target";
const HERE: &str = "of the run with the calibrated parameters, in the unit of the target";
const RESIDUAL: &str = "distance from the measured value in half-widths";
const NEAREST: &str = "the least residual found anywhere in the ranges";
const TOGETHER: &str = "the largest residual that is left if it is held with the others; only of those that contradict";
const CORRELATION: &str = "of their places in the ranges, over the points at which the held targets hold";

fn parameter_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<FileColumn> {
    let all: Vec<usize> = (0..study.runs.axes.len()).collect();
    let end = |k: usize, share: f64| study.runs.axes[k].at(share).as_number().unwrap_or(f64::NAN);
    let mut rows = FileRows::of(&all)
        .column(index("parameter", "the key of the parameter", parameter_names(study)))
        .numbers("optimum", "1", OPTIMUM, |&k| calibration.parameters[k])
        .numbers("range_from", "1", RANGE_FROM, |&k| end(k, 0.0))
        .numbers("range_to", "1", "the other end", |&k| end(k, 1.0));
    if let Some(compromise) = &calibration.compromise {
        rows = rows.numbers("compromise", "1", COMPROMISE, |&k| compromise.parameters[k]);
    }
    let intervals = &calibration.intervals;
    if !intervals.is_empty() {
        let determined = words(Determined::ALL.iter().map(|found| found.name().to_owned()));
        rows = rows
            .numbers("least", "1", LEAST, |&k| intervals[k].least)
            .numbers("largest", "1", LARGEST, |&k| intervals[k].largest)
            .codes("determined", DETERMINED, &determined, |&k| {
                intervals[k].determined as i8
            });
    }
    rows.columns()
}

fn target_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<FileColumn> {
    let measured = study.targets.iter().map(|target| target.name().to_owned());
    let roles = words(Role::ALL.iter().map(|role| role.name().to_owned()));
    let all: Vec<(&Target, &TargetResult)> = study.targets.iter().zip(&calibration.targets).collect();
    FileRows::of(&all)
        .column(index("target", "the quantity that was measured", measured))
        .numbers("value", "1", "as measured, in the unit of the target", |row| {
            row.0.value
        })
        .numbers("half_width", "1", HALF_WIDTH, |row| row.0.half_width)
        .numbers("here", "1", HERE, |row| row.1.here)
        .numbers("residual", "1", RESIDUAL, |row| row.1.residual)
        .numbers("nearest", "1", NEAREST, |row| row.1.nearest)
        .numbers("together", "1", TOGETHER, |row| row.1.together)
        .codes("role", "what became of the target", &roles, |row| row.1.role as i8)
        .columns()
}

fn correlation_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<FileColumn> {
    let pairs = &calibration.correlations;
    let names = words(parameter_names(study));
    FileRows::of(pairs)
        .column(FileColumn::counts("pair", "index of the pair", 0..pairs.len() as i64))
        .codes("first", "one parameter", &names, |pair| pair.parameters[0] as i8)
        .codes("second", "the other", &names, |pair| pair.parameters[1] as i8)
        .numbers("correlation", "1", CORRELATION, |pair| pair.coefficient)
        .columns()
}
