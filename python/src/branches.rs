//! The file of a continuation.

use crate::errors::of_file;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use stickslip::results::{ContinuationColumn, ResultError, StoredContinuation, check_sound};

/// Its columns; title, status, name and keys of the number that varies.
type Branches = (Vec<ContinuationColumn>, [String; 4]);

fn read(path: &Path) -> Result<Branches, ResultError> {
    let file = StoredContinuation::open(path)?;
    check_sound(path)?;
    let text = |name| Ok(file.text_attribute("points", name)?.unwrap_or_default());
    let texts = [file.title()?, file.status()?, text("number")?, text("keys")?];
    Ok((file.columns()?, texts))
}

/// Whether a file is one of a continuation, sound or not.
#[pyfunction]
pub fn is_continuation(py: Python<'_>, path: PathBuf) -> bool {
    py.detach(|| StoredContinuation::is_one(&path))
}

/// The branches of a file, as columns with their groups.
#[pyfunction]
pub fn read_continuation(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let found = py.detach(|| read(&path));
    let (columns, [title, status, number, keys]) = found.map_err(|error| of_file(py, &error))?;
    let all = PyDict::new(py);
    all.set_item("title", title)?;
    all.set_item("status", status)?;
    all.set_item("number", number)?;
    all.set_item("keys", keys)?;
    let mut listed = Vec::new();
    for column in columns {
        let one = PyDict::new(py);
        one.set_item("group", column.group)?;
        one.set_item("name", column.name)?;
        one.set_item("shape", column.shape)?;
        one.set_item("values", PyArray1::from_vec(py, column.values))?;
        one.set_item("units", column.units)?;
        one.set_item("long_name", column.long_name)?;
        one.set_item("flags", column.flags)?;
        one.set_item("whole", column.whole)?;
        listed.push(one);
    }
    all.set_item("columns", listed)?;
    Ok(all)
}
