//! File of a calibration: a sweep file of all runs, with the results of the search.

use super::region::{Determined, Interval};
use super::search::{Calibration, calibrate};
use super::study::{CalibrationStudy, Role, Target, TargetResult};
use crate::error::Error;
use crate::provenance;
use crate::study::StudyRun;
use crate::sweep::{header, sweep_variables};
use std::path::PathBuf;
use stickslip_files::schema::Variable;
use stickslip_files::{
    Addition, CALIBRATION, DeclaredColumn, FileColumn, FileKind, Reservation, ResultError, Status, SweepLayout,
    SweepPlan, SweepRow, SweepWriter, columns,
};

/// Builder of a calibration; `start` finds the parameters and writes the file.
pub type CalibrationRun<'a> = StudyRun<'a, CalibrationStudy>;

impl CalibrationRun<'_> {
    /// Calibrates, and returns the path of the file and the results. An incomplete calibration keeps the partial name.
    ///
    /// # Errors
    /// Those of [`calibrate`], or the file cannot be written.
    pub fn start(self) -> Result<(PathBuf, Calibration), Error> {
        let digest = self.study.digest();
        let of_study = header(&self.study.runs, "calibrate", digest.clone(), Vec::new());
        let inputs = &self.study.runs.head.files;
        let place = self.place(FileKind::Calibration, &of_study, Some(&digest), inputs)?;
        let calibration = calibrate(self.study, self.workers, self.watch)?;
        let file = write(self.study, &calibration, place).map_err(Error::computation)?;
        Ok((file, calibration))
    }
}

fn write(study: &CalibrationStudy, calibration: &Calibration, place: Reservation) -> Result<PathBuf, ResultError> {
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
    let mut parameters = Addition::of_table(CALIBRATION, parameter_columns(study, calibration));
    parameters.attribute("parameter_units", units.collect::<Vec<_>>().join(", "));
    parameters.attribute("largest_residual", format!("{:?}", calibration.worst));
    if let Some(compromise) = &calibration.compromise {
        parameters.attribute("largest_residual_of_compromise", format!("{:?}", compromise.worst));
    }
    writer.add(&parameters)?;
    let units = study.targets.iter().map(|target| target.unit);
    let mut targets = Addition::of_table("targets", target_columns(study, calibration));
    targets.attribute("target_units", units.collect::<Vec<_>>().join(", "));
    writer.add(&targets)?;
    if !calibration.correlations.is_empty() {
        writer.add(&Addition::of_table(
            "correlations",
            correlation_columns(study, calibration),
        ))?;
    }
    writer.finish(&Status::of(calibration.interrupted))
}

/// Column of the codes 0, 1, ... with these words.
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
    let ends = |share: f64| study.parameters(&vec![share; study.runs.axes.len()]);
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
        columns.extend(INTERVAL_COLUMNS.iter().map(|column| column.of(&calibration.intervals)));
    }
    columns
}

const INTERVAL_COLUMNS: &[DeclaredColumn<Interval>] = &columns! { interval, x:
    Variable::quantity("least", "1", "least value for which the held targets hold"), interval.least, interval.least = x;
    Variable::quantity("largest", "1", "largest value for which the held targets hold"),
        interval.largest, interval.largest = x;
    Variable::words("determined", "from which sides the targets bound it within the range", Determined::codes()),
        f64::from(interval.determined as i8), _ = (interval, x);
};

fn target_columns(study: &CalibrationStudy, calibration: &Calibration) -> Vec<FileColumn> {
    // Numbers are in the unit of the target, residuals in half-widths.
    let declared: [DeclaredColumn<(&Target, &TargetResult)>; 7] = columns! { of:
        Variable::quantity("value", "1", "as measured, in the unit of the target"), of.0.value;
        Variable::quantity("half_width", "1", "how far the quantity may lie from it, in the unit of the target"),
            of.0.half_width;
        Variable::quantity("here", "1", "of the run with the calibrated parameters, in the unit of the target"),
            of.1.here;
        Variable::quantity("residual", "1", "distance from the measured value in half-widths"), of.1.residual;
        Variable::quantity("nearest", "1", "the least residual found anywhere in the ranges"), of.1.nearest;
        Variable::quantity(
            "together", "1", "the largest residual that is left if it is held with the others; only of those that contradict"),
            of.1.together;
        Variable::words("role", "role of the target", Role::codes()), f64::from(of.1.role as i8);
    };
    let pairs: Vec<(&Target, &TargetResult)> = study.targets.iter().zip(&calibration.targets).collect();
    let measured = study.targets.iter().map(|target| target.name().to_owned());
    let names = index("target", "the quantity that was measured", measured);
    std::iter::once(names)
        .chain(declared.iter().map(|column| column.of(&pairs)))
        .collect()
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
        numbers("correlation", long_name, pairs().map(|pair| pair.coefficient)),
    ]
}
