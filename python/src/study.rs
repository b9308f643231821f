//! The file of a sweep.

use crate::errors::Raised;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use stickslip::results::{ResultError, ShapedColumn, StudyFile, check_sound, schema};

/// Whether it is a grid; its variables, each with its keys if it is an axis; title and status; its failures.
type Study = (bool, Vec<(ShapedColumn, String)>, [String; 2], Vec<(u64, String)>);

fn read(path: &Path) -> Result<Study, ResultError> {
    let file = StudyFile::open(path, schema::SWEEP_FORMAT)?;
    check_sound(path)?;
    let text = |name: &str| Ok::<_, ResultError>(file.text(name)?.unwrap_or_default());
    let columns = file.columns("")?.into_iter();
    let columns = columns.map(|column| {
        let keys = text(&format!("{}/keys", column.0.name))?;
        Ok((column, keys))
    });
    let columns = columns.collect::<Result<Vec<_>, ResultError>>()?;
    Ok((
        file.is_grid()?,
        columns,
        [text("title")?, text("status")?],
        file.failures()?,
    ))
}

/// Whether a file is one of a sweep, sound or not.
#[pyfunction]
pub fn is_study(py: Python<'_>, path: PathBuf) -> bool {
    py.detach(|| StudyFile::is(&path, schema::SWEEP_FORMAT))
}

/// The points of a sweep file: whether they lie in a grid, its variables, and its failures.
#[pyfunction]
pub fn read_study(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let found = py.detach(|| read(&path));
    let (grid, variables, [title, status], failures) = found.map_err(Raised::from)?;
    let study = PyDict::new(py);
    study.set_item("grid", grid)?;
    study.set_item("title", title)?;
    study.set_item("status", status)?;
    study.set_item("failures", failures)?;
    let all = PyDict::new(py);
    let mut axes = Vec::new();
    for ((variable, shape, values), keys) in variables {
        let one = PyDict::new(py);
        if !keys.is_empty() {
            axes.push(variable.name.clone());
        }
        one.set_item("shape", shape)?;
        one.set_item("values", PyArray1::from_vec(py, values))?;
        one.set_item("units", variable.units)?;
        one.set_item("long_name", variable.long_name)?;
        one.set_item("keys", keys)?;
        one.set_item("flags", variable.flags)?;
        one.set_item("whole", variable.fill.is_some())?;
        all.set_item(variable.name, one)?;
    }
    study.set_item("variables", all)?;
    study.set_item("axes", axes)?;
    Ok(study)
}
