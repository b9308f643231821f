//! File of a calibration: a sweep file of all runs, with the results of the search.

use super::region::Determined;
use super::search::Calibration;
use super::study::CalibrationStudy;
use super::target::Role;
use crate::provenance;
use crate::sweep::{command_attribute, header, sweep_variables};
use std::path::PathBuf;
use stickslip_files::{FileColumn, Reservation, ResultError, Status, SweepLayout, SweepPlan, SweepRow, SweepWriter};

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

fn index(name: &str, long_name: &str, words: impl Iterator<Item = String>) -> FileColumn {
    let words: Vec<(i64, String)> = (0..).zip(words).collect();
    FileColumn::codes(name, long_name, 0..words.len() as i8, words)
}

fn parameter_names(study: &CalibrationStudy) -> impl Iterator<Item = String> {
    study.runs.axes.iter().map(|axis| axis.keys[0].clone())
}

fn parameter_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<FileColumn> {
    let ends = |share: f64| {
        let axes = study.runs.axes.iter();
        axes.map(move |axis| axis.at(share).as_number().unwrap_or(f64::NAN))
    };
    let optimum = "where the largest residual is least, in the unit of the parameter";
    let mut columns = vec![
        index("parameter", "the key of the parameter", parameter_names(study)),
        FileColumn::numbers("optimum", "1", optimum, calibration.parameters.iter().copied()),
        FileColumn::numbers(
            "range_from",
            "1",
            "one end of the range it was looked for in",
            ends(0.0),
        ),
        FileColumn::numbers("range_to", "1", "the other end", ends(1.0)),
    ];
    if let Some(compromise) = &calibration.compromise {
        let long_name = "where the largest residual is least if no target is set aside";
        columns.push(FileColumn::numbers(
            "compromise",
            "1",
            long_name,
            compromise.parameters.iter().copied(),
        ));
    }
    if !calibration.intervals.is_empty() {
        let intervals = || calibration.intervals.iter();
        let long_name = "least value for which the held targets hold";
        columns.push(FileColumn::numbers(
            "least",
            "1",
            long_name,
            intervals().map(|interval| interval.least),
        ));
        let long_name = "largest value for which the held targets hold";
        columns.push(FileColumn::numbers(
            "largest",
            "1",
            long_name,
            intervals().map(|interval| interval.largest),
        ));
        columns.push(FileColumn::codes(
            "determined",
            "from which sides the targets bound it within the range",
            intervals().map(|interval| interval.determined as i8),
            Determined::ALL
                .map(|found| (found as i64, found.name().to_owned()))
                .into(),
        ));
    }
    columns
}

fn target_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<FileColumn> {
    let (targets, results) = (|| study.targets.iter(), || calibration.targets.iter());
    let half_width = "half-width of the interval of the target, in its unit";
    let here = "of the run with the calibrated parameters, in the unit of the target";
    let nearest = "the least residual found anywhere in the ranges";
    let together = "the largest residual that is left if it is held with the others; only of those that contradict";
    let measured = targets().map(|target| target.name().to_owned());
    vec![
        index("target", "the quantity that was measured", measured),
        FileColumn::numbers(
            "value",
            "1",
            "as measured, in the unit of the target",
            targets().map(|target| target.value),
        ),
        FileColumn::numbers("half_width", "1", half_width, targets().map(|target| target.half_width)),
        FileColumn::numbers("here", "1", here, results().map(|result| result.here)),
        FileColumn::numbers(
            "residual",
            "1",
            "distance from the measured value in half-widths",
            results().map(|result| result.residual),
        ),
        FileColumn::numbers("nearest", "1", nearest, results().map(|result| result.nearest)),
        FileColumn::numbers("together", "1", together, results().map(|result| result.together)),
        FileColumn::codes(
            "role",
            "role of the target",
            results().map(|result| result.role as i8),
            Role::ALL.map(|role| (role as i64, role.name().to_owned())).into(),
        ),
    ]
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
