//! A run, in memory or in a result file.

use crate::errors::Raised;
use crate::waiting::{Signals, internal};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use stickslip::analysis::KeptReport;
use stickslip::analysis::headline::{self, HeadlineRow};
use stickslip::case::{Case, CaseError, CaseSource, Override, Words};
use stickslip::model::Mode;
use stickslip::record::{Channels, State};
use stickslip::results::schema::{StorageKind, Variable};
use stickslip::results::{
    AttributeValue, ColumnValues, Extra, FileColumn, KeptTable, KeptView, Overwrite, ResultError, ResultFile, Status,
    open_sound,
};
use stickslip::simulation::Course;
use stickslip::{GivenCase, overrides};

/// Name, unit, description, codes with their words, and type of a column.
type Column = (String, String, String, Vec<(i64, String)>, &'static str);
/// Name, value, unit and description of a quantity.
type Quantity = (String, f64, String, String);
/// Values before and after each event.
type Sides<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);
/// Name, value, and the paper's value.
type Line = (String, String, String);

/// A run with its tables.
#[pyclass(frozen, module = "stickslip._native")]
pub struct Run {
    rows: Rows,
    #[pyo3(get)]
    title: String,
    #[pyo3(get)]
    case_text: String,
    #[pyo3(get)]
    resolved: String,
    /// complete, interrupted or failed.
    #[pyo3(get)]
    status: &'static str,
    /// Why it failed.
    #[pyo3(get)]
    failure: Option<String>,
    #[pyo3(get)]
    warnings: Vec<String>,
    /// As JSON.
    #[pyo3(get)]
    witness: Option<String>,
    /// The attributes of /stick_slip.
    #[pyo3(get)]
    quantities: Vec<Quantity>,
    #[pyo3(get)]
    tables: Vec<(String, Vec<Column>)>,
    #[pyo3(get)]
    event_count: usize,
    meta: Vec<(String, AttributeValue)>,
    /// The columns that have become arrays.
    arrays: Mutex<HashMap<(String, String), Py<PyAny>>>,
}

/// Where the rows are.
enum Rows {
    Kept {
        end: Box<KeptReport>,
        order: Vec<u8>,
        /// Those that have not become arrays, by group and name.
        columns: Mutex<HashMap<(String, String), ColumnValues<'static>>>,
    },
    File {
        path: PathBuf,
        file: Box<Mutex<ResultFile>>,
        headline: Vec<HeadlineRow>,
    },
}

#[pymethods]
impl Run {
    /// The file that it was opened from.
    #[getter]
    fn path(&self) -> Option<&Path> {
        match &self.rows {
            Rows::Kept { .. } => None,
            Rows::File { path, .. } => Some(path),
        }
    }

    /// The summary as JSON; of a run in memory.
    #[getter]
    fn report(&self) -> PyResult<Option<String>> {
        match &self.rows {
            Rows::Kept { end, .. } => Ok(Some(json(&end.run.summary)?)),
            Rows::File { .. } => Ok(None),
        }
    }

    /// The lines of the report.
    #[getter]
    fn headline(&self) -> Vec<Line> {
        match &self.rows {
            Rows::Kept { end, .. } => end.headline().iter().map(line).collect(),
            Rows::File { headline, .. } => headline.iter().map(line).collect(),
        }
    }

    /// The attributes of /meta.
    #[getter]
    fn meta<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let meta = PyDict::new(py);
        for (name, value) in &self.meta {
            match value {
                AttributeValue::Number(number) => meta.set_item(name, number)?,
                AttributeValue::Integer(number) => meta.set_item(name, *number as f64)?,
                other => meta.set_item(name, other.to_string())?,
            }
        }
        Ok(meta)
    }

    /// A column as an array, the same one each time. Nobody may write into it, as all that asks for it has the same.
    fn column<'py>(&self, py: Python<'py>, group: String, name: String) -> PyResult<Bound<'py, PyAny>> {
        let key = (group, name);
        if let Some(array) = self.known(py, &key) {
            return Ok(array);
        }
        let values = match &self.rows {
            Rows::Kept { columns, .. } => columns.lock().ok().and_then(|mut columns| columns.remove(&key)),
            Rows::File { file, .. } => {
                let read = py.detach(|| match file.lock() {
                    Ok(file) => file.typed_column(&key.0, &key.1).map(Some),
                    Err(_) => Ok(None),
                });
                read.map_err(Raised::from)?
            }
        };
        let Some(values) = values else {
            // Another thread has taken them, and may not have made the array yet.
            let is_column =
                |(group, columns): &(String, Vec<Column>)| *group == key.0 && columns.iter().any(|c| c.0 == key.1);
            while self.tables.iter().any(is_column) {
                if let Some(array) = self.known(py, &key) {
                    return Ok(array);
                }
                py.detach(|| std::thread::sleep(std::time::Duration::from_millis(1)));
            }
            return Err(pyo3::exceptions::PyKeyError::new_err(format!("{}/{}", key.0, key.1)));
        };
        let array = match values {
            ColumnValues::Int8(values) => PyArray1::from_vec(py, values.into_owned()).into_any(),
            ColumnValues::Int32(values) => PyArray1::from_vec(py, values.into_owned()).into_any(),
            ColumnValues::Int64(values) => PyArray1::from_vec(py, values.into_owned()).into_any(),
            ColumnValues::Float64(values) => PyArray1::from_vec(py, values.into_owned()).into_any(),
        };
        array.getattr("flags")?.setattr("writeable", false)?;
        let Ok(mut arrays) = self.arrays.lock() else {
            return Err(internal().into());
        };
        let kept = arrays.entry(key).or_insert_with(|| array.unbind());
        Ok(kept.bind(py).clone())
    }

    /// Forces, torques and energies before and after every event, as far as the state determines them.
    fn at_events<'py>(&self, py: Python<'py>) -> PyResult<HashMap<&'static str, Sides<'py>>> {
        let floats = |group: &str, name: String| -> PyResult<Vec<f64>> {
            let column = self.column(py, group.to_owned(), name)?;
            let column: PyReadonlyArray1<'_, f64> = column.call_method1("astype", ("float64",))?.extract()?;
            Ok(column.as_slice()?.to_vec())
        };
        let case = Case::read(&CaseSource::text(&self.resolved), &[]).map_err(Raised::from)?;
        let course = Course::new(&case.system, case.threshold, &case.solver);
        let times = floats("events", "time".to_owned())?;
        let first = floats("segments", "mode".to_owned())?.first().copied();
        let after = floats("events", "mode_after".to_owned())?;
        let before: Vec<f64> = first
            .into_iter()
            .chain(after.iter().copied())
            .take(times.len())
            .collect();
        let mut sides = Vec::new();
        for (side, modes) in [("before", &before), ("after", &after)] {
            let columns = |names: Vec<String>| -> PyResult<Vec<Vec<f64>>> {
                let column = |name: String| floats("events", format!("{name}_{side}"));
                names.into_iter().map(column).collect()
            };
            let of_state = columns(State::CHANNELS.iter().map(|one| one.name.to_owned()).collect())?;
            let further = columns(course.further().into_iter().map(|one| one.name).collect())?;
            let mut rows = vec![Vec::new(); Channels::COUNT];
            for (row, (&time, &code)) in times.iter().zip(modes).enumerate() {
                let state = State::from_values(std::array::from_fn(|channel| of_state[channel][row]));
                let more: Vec<f64> = further.iter().map(|column| column[row]).collect();
                // What a signal jumps to belongs to the state after its corner.
                let at = if side == "before" {
                    time.next_down().max(0.0)
                } else {
                    time
                };
                let mode = Mode::ALL.into_iter().find(|mode| f64::from(mode.code()) == code);
                let mode = mode.ok_or_else(internal)?;
                let channels = course.channels(mode, at, &course.state(&state, &more));
                for (column, value) in rows.iter_mut().zip(channels.with_products(&state).values()) {
                    column.push(value);
                }
            }
            sides.push(rows);
        }
        let mut both = sides.into_iter();
        let (Some(before), Some(after)) = (both.next(), both.next()) else {
            return Err(internal().into());
        };
        let found = Channels::CHANNELS.iter().zip(before.into_iter().zip(after));
        let found = found.filter(|(channel, _)| !channel.has_history);
        let array = |values: Vec<f64>| PyArray1::from_vec(py, values);
        Ok(found
            .map(|(channel, (before, after))| (channel.name, (array(before), array(after))))
            .collect())
    }

    /// Writes the result file of a run in memory; returns where it is.
    fn save(&self, py: Python<'_>, path: PathBuf, replace: bool) -> PyResult<PathBuf> {
        let Rows::Kept { end, order, .. } = &self.rows else {
            let text = "this run is in a file already; copy that".to_owned();
            return Err(Raised("InputError", text).into());
        };
        let overwrite = Overwrite::by_force(replace);
        let mut borrowed = Vec::new();
        for (group, columns) in &self.tables {
            let mut of_table = Vec::new();
            for (name, .., kind) in columns {
                let array = self.column(py, group.clone(), name.clone())?;
                of_table.push(Borrowed::of(&array, kind)?);
            }
            borrowed.push(of_table);
        }
        let mut tables = Vec::new();
        for columns in &borrowed {
            let views = columns.iter().map(Borrowed::view).collect::<PyResult<Vec<_>>>()?;
            tables.push(views);
        }
        let view = KeptView { tables, order };
        let written = py.detach(|| end.write(&path, overwrite, &view));
        Ok(written.map_err(Raised::from)?)
    }
}

impl Run {
    fn known<'py>(&self, py: Python<'py>, key: &(String, String)) -> Option<Bound<'py, PyAny>> {
        let arrays = self.arrays.lock().ok()?;
        arrays.get(key).map(|array| array.bind(py).clone())
    }
}

/// An array that is read.
enum Borrowed<'py> {
    Int8(PyReadonlyArray1<'py, i8>),
    Int32(PyReadonlyArray1<'py, i32>),
    Int64(PyReadonlyArray1<'py, i64>),
    Float64(PyReadonlyArray1<'py, f64>),
}

impl<'py> Borrowed<'py> {
    fn of(array: &Bound<'py, PyAny>, kind: &str) -> PyResult<Self> {
        Ok(match kind {
            "int8" => Borrowed::Int8(array.extract()?),
            "int32" => Borrowed::Int32(array.extract()?),
            "int64" => Borrowed::Int64(array.extract()?),
            _ => Borrowed::Float64(array.extract()?),
        })
    }

    fn view(&self) -> PyResult<ColumnValues<'_>> {
        Ok(match self {
            Borrowed::Int8(array) => ColumnValues::Int8(array.as_slice()?.into()),
            Borrowed::Int32(array) => ColumnValues::Int32(array.as_slice()?.into()),
            Borrowed::Int64(array) => ColumnValues::Int64(array.as_slice()?.into()),
            Borrowed::Float64(array) => ColumnValues::Float64(array.as_slice()?.into()),
        })
    }
}

/// A case as it is given: a built-in name, a file (of a case, or a result whose case is repeated), or a text.
pub fn given<E: From<CaseError> + From<ResultError>>(kind: &str, text: &str) -> Result<GivenCase, E> {
    Ok(match kind {
        "built-in" => CaseSource::built_in(text)?.into(),
        "result" => GivenCase::of_result(Path::new(text))?,
        "file" => CaseSource::file(Path::new(text))?.into(),
        _ => CaseSource::text(text).into(),
    })
}

/// A case, as it is given and with its overrides.
fn case_of(
    py: Python<'_>,
    kind: &str,
    text: &str,
    settings: &[String],
) -> Result<(Case, GivenCase, Vec<Override>), Raised> {
    let given = py.detach(|| given::<Raised>(kind, text))?;
    let changes = overrides(settings)?;
    Ok((Case::read(&given.source, &changes)?, given, changes))
}

/// The case in SI, as TOML.
#[pyfunction]
pub fn resolve(py: Python<'_>, kind: &str, text: &str, settings: Vec<String>) -> PyResult<String> {
    Ok(case_of(py, kind, text, &settings)?.0.resolved())
}

/// Computes a run. One that fails, or is interrupted, is returned with its status.
#[pyfunction]
pub fn run(
    py: Python<'_>,
    kind: &str,
    text: &str,
    settings: Vec<String>,
    witness: bool,
    trajectory: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Run> {
    let (mut case, given, changes) = case_of(py, kind, text, &settings)?;
    if !trajectory {
        case.without_trajectory();
    }
    let signals = Signals::new(progress);
    let computed = py.detach(|| {
        catch_unwind(AssertUnwindSafe(|| {
            KeptReport::of_run(&case, &given.text, witness, trajectory, &signals)
        }))
    });
    if let Some(raised) = signals.raised() {
        return Err(raised);
    }
    let mut end = computed.map_err(|_| internal())?;
    end.header.changed = given.changed(&changes);
    let rows = std::mem::take(&mut end.rows);
    let event_count = rows.tables.get(1).map_or(0, KeptTable::rows);
    let mut tables = Vec::new();
    let mut columns = HashMap::new();
    for table in rows.tables {
        let group = table.group;
        let mut described = Vec::new();
        // As in the file, the column of the witness comes after those that a recorder fills.
        let of_witness = end.run.witness.as_ref().filter(|_| group == "events");
        let of_witness = of_witness.map(|witness| witness.column());
        for FileColumn { variable, values } in table.columns.into_iter().chain(of_witness) {
            let kind = variable.kind.name();
            columns.insert((group.to_owned(), variable.name.clone()), values);
            described.push((variable.name, variable.units, variable.long_name, variable.flags, kind));
        }
        tables.push((group.to_owned(), described));
    }
    Ok(Run {
        title: end.header.title.clone(),
        case_text: end.header.case_text.clone(),
        resolved: end.header.resolved.clone(),
        status: end.run.status.name(),
        failure: end.run.failure.as_ref().map(ToString::to_string),
        warnings: end.run.warnings.iter().map(ToString::to_string).collect(),
        witness: end.run.witness.as_ref().map(json).transpose()?,
        quantities: end.run.table.attributes.iter().cloned().map(quantity).collect(),
        tables,
        event_count,
        meta: end.header.meta.clone(),
        arrays: Mutex::default(),
        rows: Rows::Kept {
            end: Box::new(end),
            order: rows.order,
            columns: Mutex::new(columns),
        },
    })
}

fn json(value: &impl serde::Serialize) -> Result<String, Raised> {
    serde_json::to_string(value).map_err(|_| internal())
}

fn line(row: &HeadlineRow) -> Line {
    (row.name.to_owned(), row.value.clone(), row.paper.to_owned())
}

fn quantity(extra: Extra) -> Quantity {
    (extra.name, extra.value, extra.unit, extra.description)
}

/// Opens a result file.
#[pyfunction]
pub fn open_result(py: Python<'_>, path: PathBuf) -> PyResult<Run> {
    let read = py.detach(|| read(path));
    Ok(read.map_err(Raised::from)?)
}

fn read(path: PathBuf) -> Result<Run, ResultError> {
    let file = open_sound(&path)?;
    let resolved = file.resolved()?;
    let source = CaseSource::result(&path, resolved.clone());
    // A file of an earlier version may have a case that this one does not read.
    let events = file.events()?;
    let case = Case::read(&source, &[]).ok();
    let headline = match &case {
        None if Words::of(&source, &[]).numbers_parts() => Vec::new(),
        case => headline::of_file(&file, case.as_ref(), &events)?,
    };
    let column = |column: Variable| {
        let kind = match column.kind {
            StorageKind::Float64 => "float64",
            _ => "int64",
        };
        (column.name, column.units, column.long_name, column.flags, kind)
    };
    let tables = file.tables()?.into_iter();
    let tables = tables.map(|(group, columns)| (group, columns.into_iter().map(column).collect()));
    let quantities = file.stick_slip()?.map_or_else(Vec::new, |table| table.attributes);
    let witness = match file.group_text("witness", "statement") {
        Ok(Some(statement)) => Some(serde_json::json!({ "statement": statement }).to_string()),
        _ => None,
    };
    Ok(Run {
        title: file.title().to_owned(),
        case_text: file.case_text()?,
        resolved,
        status: file.status().name(),
        failure: match file.status() {
            Status::Failed(message) => Some(message.clone()),
            _ => None,
        },
        warnings: Vec::new(),
        witness,
        quantities: quantities.into_iter().map(quantity).collect(),
        tables: tables.collect(),
        event_count: events.len(),
        meta: file.meta()?,
        arrays: Mutex::default(),
        rows: Rows::File {
            path,
            file: Box::new(Mutex::new(file)),
            headline,
        },
    })
}
