//! File of a calibration: a sweep file of all runs, with the results of the search.

use super::region::Determined;
use super::search::Calibration;
use super::study::CalibrationStudy;
use super::target::{Role, Target, TargetResult};
use crate::provenance;
use crate::sweep::{header, sweep_variables};
use std::path::PathBuf;
use stickslip_files::{FileColumn, Reservation, ResultError, Status, SweepLayout, SweepPlan, SweepRow, SweepWriter};

/// Writes a calibration to a reserved place and returns its path. An incomplete calibration keeps the partial name.
pub fn write_file(
    study: &CalibrationStudy,
    calibration: &Calibration,
    place: Reservation,
) -> Result<PathBuf, ResultError> {
    let mut meta = provenance::build();
    meta.extend(provenance::point_command(study.runs.point_command()));
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
    writer.finish(&Status::of(calibration.interrupted))
}

fn index(name: &str, long_name: &str, words: impl Iterator<Item = String>) -> FileColumn {
    let words: Vec<(i64, String)> = (0..).zip(words).collect();
    FileColumn::codes(name, long_name, 0..words.len() as i8, words)
}

fn parameter_names(study: &CalibrationStudy) -> impl Iterator<Item = String> {
    study.runs.axes.iter().map(|axis| axis.keys[0].clone())
}

fn numbers(name: &str, long_name: &str, values: impl IntoIterator<Item = f64>) -> FileColumn {
    FileColumn::numbers(name, "1", long_name, values)
}

fn parameter_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<FileColumn> {
    let ends = |share: f64| {
        let axes = study.runs.axes.iter();
        axes.map(move |axis| axis.at(share).as_number().unwrap_or(f64::NAN))
    };
    let optimum = "where the largest residual is least, in the unit of the parameter";
    let mut columns = vec![
        index("parameter", "the key of the parameter", parameter_names(study)),
        numbers("optimum", optimum, calibration.parameters.clone()),
        numbers("range_from", "one end of the range it was looked for in", ends(0.0)),
        numbers("range_to", "the other end", ends(1.0)),
    ];
    if let Some(compromise) = &calibration.compromise {
        let long_name = "where the largest residual is least if no target is set aside";
        columns.push(numbers("compromise", long_name, compromise.parameters.clone()));
    }
    if !calibration.intervals.is_empty() {
        let intervals = || calibration.intervals.iter();
        let (least, largest) = (intervals().map(|one| one.least), intervals().map(|one| one.largest));
        columns.push(numbers("least", "least value for which the held targets hold", least));
        columns.push(numbers(
            "largest",
            "largest value for which the held targets hold",
            largest,
        ));
        let long_name = "from which sides the targets bound it within the range";
        let words = Determined::ALL.map(|found| (found as i64, found.name().to_owned()));
        let codes = intervals().map(|interval| interval.determined as i8);
        columns.push(FileColumn::codes("determined", long_name, codes, words.into()));
    }
    columns
}

fn target_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<FileColumn> {
    let measured = study.targets.iter().map(|target| target.name().to_owned());
    let mut columns = vec![index("target", "the quantity that was measured", measured)];
    type OfTarget = fn(&Target, &TargetResult) -> f64;
    let declared: [(&str, &str, OfTarget); 6] = [
        ("value", "as measured, in the unit of the target", |target, _| {
            target.value
        }),
        (
            "half_width",
            "how far the quantity may lie from it, in the unit of the target",
            |target, _| target.half_width,
        ),
        (
            "here",
            "of the run with the calibrated parameters, in the unit of the target",
            |_, result| result.here,
        ),
        (
            "residual",
            "distance from the measured value in half-widths",
            |_, result| result.residual,
        ),
        (
            "nearest",
            "the least residual found anywhere in the ranges",
            |_, result| result.nearest,
        ),
        (
            "together",
            "the largest residual that is left if it is held with the others; only of those that contradict",
            |_, result| result.together,
        ),
    ];
    columns.extend(declared.into_iter().map(|(name, long_name, of)| {
        let pairs = study.targets.iter().zip(&calibration.targets);
        numbers(name, long_name, pairs.map(|(target, result)| of(target, result)))
    }));
    let roles = calibration.targets.iter().map(|result| result.role as i8);
    let words = Role::ALL.map(|role| (role as i64, role.name().to_owned()));
    columns.push(FileColumn::codes("role", "role of the target", roles, words.into()));
    columns
}

fn correlation_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<FileColumn> {
    let pairs = || calibration.correlations.iter();
    let words: Vec<(i64, String)> = (0..).zip(parameter_names(study)).collect();
    let side = |k: usize| pairs().map(move |pair| pair.parameters[k] as i8);
    let long_name = "of their places in the ranges, over the points at which the held targets hold";
    vec![
        FileColumn::counts("pair", "index of the pair", 0..pairs().len() as i64),
        FileColumn::codes("first", "one parameter", side(0), words.clone()),
        FileColumn::codes("second", "the other", side(1), words),
        FileColumn::numbers("correlation", "1", long_name, pairs().map(|pair| pair.coefficient)),
    ]
}
