//! The file of a calibration: a sweep file of all its runs, with what was found beside.

use super::region::Determined;
use super::search::Calibration;
use super::study::CalibrationStudy;
use super::target::Role;
use crate::provenance;
use crate::results::{
    Column, ColumnData, Reservation, ResultError, Status, SweepAxis, SweepHeader, SweepLayout, SweepPlan, SweepRow,
    SweepWriter,
};
use crate::sweep::{command_attribute, sweep_variables};
use std::path::PathBuf;

/// Writes a calibration where a place is reserved. Returns where it is: at its own name if it is complete, else at its partial
/// name.
///
/// # Errors
/// A failure to write.
pub fn write_file(
    study: &CalibrationStudy,
    calibration: &Calibration,
    place: Reservation,
) -> Result<PathBuf, ResultError> {
    let header = SweepHeader {
        title: study.runs.title.clone(),
        source: provenance::source(),
        references: study.runs.words.references().to_owned(),
        history: format!("stickslip calibrate {}", study.runs.source.name),
        digest: study.digest(),
        study_text: study.runs.source.text.clone(),
        case_text: study.runs.base.text.clone(),
        meta: provenance::build()
            .into_iter()
            .chain(command_attribute(&study.runs))
            .collect(),
    };
    let axes = study.runs.axes.iter().map(|axis| SweepAxis {
        name: axis.name.clone(),
        keys: axis.keys.join(" "),
        units: axis.unit.unwrap_or("1").to_owned(),
        long_name: axis.description.to_owned(),
        words: Vec::new(),
        values: Vec::new(),
    });
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
    let units = study.targets.iter().map(|target| target.unit());
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

fn column(name: &str, long_name: &str, data: ColumnData) -> Column {
    Column {
        name: name.to_owned(),
        units: "1".to_owned(),
        long_name: long_name.to_owned(),
        data,
    }
}

fn index(name: &str, long_name: &str, words: impl Iterator<Item = String>) -> Column {
    let words: Vec<(i8, String)> = (0..).zip(words).collect();
    let codes = words.iter().map(|(code, _)| *code).collect();
    column(name, long_name, ColumnData::Codes(codes, words))
}

fn parameter_names(study: &CalibrationStudy) -> impl Iterator<Item = String> {
    study.runs.axes.iter().map(|axis| axis.keys[0].clone())
}

fn parameter_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<Column> {
    let numbers = |values: Vec<f64>| ColumnData::Numbers(values);
    let ends = |share: f64| {
        let axes = study.runs.axes.iter();
        axes.map(|axis| axis.at(share).as_number().unwrap_or(f64::NAN))
            .collect::<Vec<_>>()
    };
    let mut columns = vec![
        index("parameter", "the key of the parameter", parameter_names(study)),
        column(
            "optimum",
            "where the largest residual is least, in the unit of the parameter",
            numbers(calibration.parameters.clone()),
        ),
        column(
            "range_from",
            "one end of the range it was looked for in",
            numbers(ends(0.0)),
        ),
        column("range_to", "the other end", numbers(ends(1.0))),
    ];
    if let Some(compromise) = &calibration.compromise {
        columns.push(column(
            "compromise",
            "where the largest residual is least if no target is set aside",
            numbers(compromise.parameters.clone()),
        ));
    }
    if !calibration.intervals.is_empty() {
        let intervals = &calibration.intervals;
        let words = Determined::ALL.map(|found| (found as i8, found.name().to_owned()));
        columns.push(column(
            "least",
            "least value for which the held targets hold",
            numbers(intervals.iter().map(|interval| interval.least).collect()),
        ));
        columns.push(column(
            "largest",
            "largest value for which the held targets hold",
            numbers(intervals.iter().map(|interval| interval.largest).collect()),
        ));
        columns.push(column(
            "determined",
            "from which sides the targets bound it within the range",
            ColumnData::Codes(
                intervals.iter().map(|interval| interval.determined as i8).collect(),
                words.to_vec(),
            ),
        ));
    }
    columns
}

fn target_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<Column> {
    let (targets, results) = (&study.targets, &calibration.targets);
    let roles = Role::ALL.map(|role| (role as i8, role.name().to_owned()));
    let of_targets = |f: fn(&super::Target) -> f64| ColumnData::Numbers(targets.iter().map(f).collect());
    let of_results = |f: fn(&super::TargetResult) -> f64| ColumnData::Numbers(results.iter().map(f).collect());
    vec![
        index(
            "target",
            "the quantity that was measured",
            targets.iter().map(|target| target.name().to_owned()),
        ),
        column(
            "value",
            "as measured, in the unit of the target",
            of_targets(|target| target.value),
        ),
        column(
            "half_width",
            "how far the quantity may lie from it, in the unit of the target",
            of_targets(|target| target.half_width),
        ),
        column(
            "here",
            "of the run with the calibrated parameters, in the unit of the target",
            of_results(|result| result.here),
        ),
        column(
            "residual",
            "distance from the measured value in half-widths",
            of_results(|result| result.residual),
        ),
        column(
            "nearest",
            "the least residual found anywhere in the ranges",
            of_results(|result| result.nearest),
        ),
        column(
            "together",
            "the largest residual that is left if it is held with the others; only of those that contradict",
            of_results(|result| result.together),
        ),
        column(
            "role",
            "what became of the target",
            ColumnData::Codes(results.iter().map(|result| result.role as i8).collect(), roles.to_vec()),
        ),
    ]
}

fn correlation_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<Column> {
    let correlations = &calibration.correlations;
    let words: Vec<(i8, String)> = (0..).zip(parameter_names(study)).collect();
    let side = |k: usize| {
        let codes = correlations.iter().map(|pair| pair.parameters[k] as i8);
        ColumnData::Codes(codes.collect(), words.clone())
    };
    vec![
        column(
            "pair",
            "index of the pair",
            ColumnData::Counts((0..correlations.len() as i64).collect()),
        ),
        column("first", "one parameter", side(0)),
        column("second", "the other", side(1)),
        column(
            "correlation",
            "of their places in the ranges, over the points at which the held targets hold",
            ColumnData::Numbers(correlations.iter().map(|pair| pair.coefficient).collect()),
        ),
    ]
}
