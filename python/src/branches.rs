//! The file of a continuation.

use crate::errors::Raised;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use stickslip::results::schema::{self, StorageKind};
use stickslip::results::{ResultError, ShapedColumn, StudyFile, check_sound};

const GROUPS: [&str; 3] = ["branches", "points", "curves"];

/// The columns of each group; title, status, name and keys of the number that varies.
type Branches = ([Vec<ShapedColumn>; 3], [String; 4]);

fn read(path: &Path) -> Result<Branches, ResultError> {
    let file = StudyFile::open(path, schema::CONTINUATION_FORMAT)?;
    check_sound(path)?;
    let text = |name| Ok(file.text(name)?.unwrap_or_default());
    let texts = [
        text("title")?,
        text("status")?,
        text("points/number")?,
        text("points/keys")?,
    ];
    let [branches, points, curves] = GROUPS.map(|group| file.columns(group));
    Ok(([branches?, points?, curves?], texts))
}

/// Whether a file is one of a continuation, sound or not.
#[pyfunction]
pub fn is_continuation(py: Python<'_>, path: PathBuf) -> bool {
    py.detach(|| StudyFile::is(&path, schema::CONTINUATION_FORMAT))
}

/// The branches of a file, as columns with their groups.
#[pyfunction]
pub fn read_continuation(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let found = py.detach(|| read(&path));
    let (groups, [title, status, number, keys]) = found.map_err(Raised::from)?;
    let all = PyDict::new(py);
    all.set_item("title", title)?;
    all.set_item("status", status)?;
    all.set_item("number", number)?;
    all.set_item("keys", keys)?;
    let mut listed = Vec::new();
    let columns = GROUPS.into_iter().zip(groups);
    for (group, (column, shape, values)) in
        columns.flat_map(|(group, columns)| columns.into_iter().map(move |column| (group, column)))
    {
        let one = PyDict::new(py);
        one.set_item("group", group)?;
        one.set_item("name", column.name)?;
        one.set_item("shape", shape)?;
        one.set_item("values", PyArray1::from_vec(py, values))?;
        let units = if column.units.is_empty() { "1" } else { &column.units };
        one.set_item("units", units)?;
        one.set_item("long_name", column.long_name)?;
        one.set_item("flags", column.flags)?;
        one.set_item("whole", column.kind != StorageKind::Float64)?;
        listed.push(one);
    }
    all.set_item("columns", listed)?;
    Ok(all)
}
