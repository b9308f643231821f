//! The file of a sweep.

use crate::errors::of_file;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use stickslip::results::{ResultError, StudyFile, check_sound, schema};

/// A variable of the points.
struct Variable {
    name: String,
    shape: Vec<usize>,
    values: Vec<f64>,
    /// Unit, description, and of an axis the keys of the case.
    attributes: [String; 3],
    flags: Vec<(i64, String)>,
    whole: bool,
}

/// Whether it is a grid, its variables, title and status, and its failures.
type Study = (bool, Vec<Variable>, [String; 2], Vec<(u64, String)>);

fn read(path: &Path) -> Result<Study, ResultError> {
    let file = StudyFile::open(path, schema::SWEEP_FORMAT)?;
    check_sound(path)?;
    let variables = file
        .variables("/")
        .into_iter()
        .filter(|name| name != "checksums")
        .map(|name| {
            let text = |attribute| file.attribute(&name, attribute).unwrap_or_default();
            Ok(Variable {
                shape: file.shape(&name)?,
                values: file.values(&name)?,
                attributes: [text("units"), text("long_name"), text("keys")],
                flags: file.flags(&name),
                whole: file.is_whole(&name),
                name,
            })
        });
    let variables = variables.collect::<Result<Vec<_>, ResultError>>()?;
    let texts = ["title", "status"].map(|name| file.text(name).unwrap_or_default());
    Ok((file.is_grid(), variables, texts, file.failures()?))
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
    let (grid, variables, [title, status], failures) = found.map_err(|error| of_file(py, &error))?;
    let study = PyDict::new(py);
    study.set_item("grid", grid)?;
    study.set_item("title", title)?;
    study.set_item("status", status)?;
    study.set_item("failures", failures)?;
    let all = PyDict::new(py);
    let mut axes = Vec::new();
    for variable in variables {
        let one = PyDict::new(py);
        let [units, long_name, keys] = variable.attributes;
        if !keys.is_empty() {
            axes.push(variable.name.clone());
        }
        one.set_item("shape", variable.shape)?;
        one.set_item("values", PyArray1::from_vec(py, variable.values))?;
        one.set_item("units", units)?;
        one.set_item("long_name", long_name)?;
        one.set_item("keys", keys)?;
        one.set_item("flags", variable.flags)?;
        one.set_item("whole", variable.whole)?;
        all.set_item(variable.name, one)?;
    }
    study.set_item("variables", all)?;
    study.set_item("axes", axes)?;
    Ok(study)
}
