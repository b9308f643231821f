//! Tables of studies: one row for each point, with its parameters and its quantities.

use super::request::chosen;
use super::{Export, ExportTable, TableOrigin};
use crate::Error;
use crate::plot::html::file_name;
use crate::plot::studies::{StudyColumn, StudyData};
use std::path::Path;
use stickslip_analysis::provenance;
use stickslip_files::schema::{CONTINUATION_FORMAT, SWEEP_FORMAT, StorageKind, Variable, WORK_PRECISION_FORMAT, group};
use stickslip_files::{FileKind, StudyFile};

/// Code and word where a run has no word of a quantity.
const NO_WORD: (i64, &str) = (-1, "none");

type Columns = Vec<(Variable, Vec<f64>)>;

/// The points of a sweep or a calibration, the points of a continuation's branches, or the runs of a work-precision
/// study, with the columns `wanted` (empty: all). `None` if the file holds none of these.
///
/// # Errors
/// The file is unreadable, or a column is unknown.
pub fn of_study(path: &Path, wanted: &[String]) -> Result<Option<Export<'static>>, Error> {
    let (format, name) = match FileKind::of(path) {
        Some(FileKind::Sweep | FileKind::Calibration) => (SWEEP_FORMAT, "points"),
        Some(FileKind::Branches) => (CONTINUATION_FORMAT, "points"),
        Some(FileKind::WorkPrecision) => (WORK_PRECISION_FORMAT, group::RUNS),
        _ => return Ok(None),
    };
    let file = StudyFile::open(path, format)?;
    let all = match format {
        SWEEP_FORMAT => points(&file)?,
        CONTINUATION_FORMAT => rows_of(&file, name, "period")?,
        _ => rows_of(&file, name, "method")?,
    };
    let (columns, values): (Vec<Variable>, Vec<Vec<f64>>) = chosen(path, name, all, wanted)?.into_iter().unzip();
    let origin = TableOrigin {
        source: provenance::source(),
        title: file.text("title")?.unwrap_or_default(),
        file: file_name(path),
        status: file.text("status")?.unwrap_or_default(),
        evaluated: None,
    };
    Ok(Some(Export {
        table: ExportTable::of_columns(name, columns, values),
        origin,
        left_out: Vec::new(),
    }))
}

/// Points of a sweep: number, axes, status, quantities.
fn points(file: &StudyFile) -> Result<Columns, Error> {
    let data = StudyData::read(file)?;
    let count = data.status.len();
    let numbers = match data.is_grid {
        true => (0..count).map(|point| point as f64).collect(),
        false => file.numbers("point")?,
    };
    let mut columns = vec![(Variable::count("point", "number of the point"), numbers)];
    columns.extend(data.axes.iter().map(column));
    let mut status = Variable::words(
        "status",
        "how the run of the point ended",
        file.variable("status")?.flags,
    );
    status.kind = StorageKind::Int8;
    columns.push((status, data.status.clone()));
    columns.extend(data.quantities.iter().map(column));
    Ok(columns)
}

fn column(found: &StudyColumn) -> (Variable, Vec<f64>) {
    let StudyColumn {
        name, units, long_name, ..
    } = found;
    let is_known = found.values.iter().all(|value| !value.is_nan());
    let mut values = found.values.clone();
    if found.flags.is_empty() {
        // An integer cannot be missing in the formats of arrays.
        let kind = match found.whole && is_known {
            true => StorageKind::Int64,
            false => StorageKind::Float64,
        };
        let mut variable = Variable::quantity(name, units, long_name);
        variable.kind = kind;
        return (variable, values);
    }
    let mut flags = found.flags.clone();
    if !is_known {
        flags.push((NO_WORD.0, NO_WORD.1.to_owned()));
        let missing = values.iter_mut().filter(|value| value.is_nan());
        missing.for_each(|value| *value = NO_WORD.0 as f64);
    }
    (Variable::words(name, long_name, flags), values)
}

/// Columns of a table with a value for each row, as the column `counted` has.
fn rows_of(file: &StudyFile, table: &str, counted: &str) -> Result<Columns, Error> {
    let rows = file.shape(&format!("{table}/{counted}"))?;
    let found = file.columns(table)?.into_iter();
    let found = found.filter(|(_, shape, _)| *shape == rows);
    let found = found.map(|(mut variable, _, values)| {
        if !variable.flags.is_empty() {
            variable.kind = StorageKind::Int8;
        }
        (variable, values)
    });
    Ok(found.collect())
}
