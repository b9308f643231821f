//! The file of a work-precision study: small, so written whole at the end.

use std::fs;
use std::path::{Path, PathBuf};

use super::attributes::{self, write_attributes, write_text_attribute};
use super::source::Source;
use super::table::{self, Cell, TableWriter};
use super::target::{self, Reservation};
use super::{AttributeValue, MetaValue, ResultError, Status, schema, seal};

/// A row of /runs; NaN where there is no value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkPrecisionRow {
    /// Index into [`WorkPrecisionFile::methods`].
    pub method: i8,
    /// `solver.rtol`.
    pub rtol: f64,
    /// `solver.fixed_step`, s.
    pub fixed_step: f64,
    /// Whether the run failed.
    pub failed: bool,
    /// Whether its events are those of the reference.
    pub same_sequence: bool,
    /// Events of its sequence.
    pub events: u64,
    /// s.
    pub onset_error: f64,
    /// s.
    pub final_stick_error: f64,
    /// s.
    pub largest_event_error: f64,
    /// Of all integrators.
    pub steps: u64,
    /// Of the right-hand side.
    pub rhs_evaluations: u64,
    /// Of the Jacobian.
    pub jacobian_evaluations: u64,
    /// s.
    pub wall_time: f64,
}

/// A row of /reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceRow {
    /// The code of the kind of event.
    pub kind: i8,
    /// s.
    pub time: f64,
    /// s.
    pub uncertainty: f64,
}

/// What the file of a study holds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WorkPrecisionFile {
    /// Root attribute `title`.
    pub title: String,
    /// Root attribute `source`: the program with its version.
    pub source: String,
    /// Root attribute `history`: when, and by which command.
    pub history: String,
    /// /input/study: the TOML text.
    pub study: String,
    /// /input/resolved: the case of the first run in SI.
    pub resolved: String,
    /// Attributes of /meta.
    pub meta: Vec<(String, MetaValue)>,
    /// Names behind the codes of `method`.
    pub methods: Vec<&'static str>,
    /// In the order of the study.
    pub runs: Vec<WorkPrecisionRow>,
    /// Attribute `description` of /reference.
    pub reference: String,
    /// In order of time.
    pub events: Vec<ReferenceRow>,
    /// Of onset, final stick and all events, s; in the order of `schema::WORK_PRECISION_UNCERTAINTIES`.
    pub uncertainties: [f64; 3],
}

/// What is read of the file of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkPrecisionRead {
    /// Root attribute `title`.
    pub title: String,
    /// In the order of the study.
    pub runs: Vec<WorkPrecisionRow>,
    /// (code, name) of the methods.
    pub methods: Vec<(i64, String)>,
    /// How the reference came about.
    pub reference: String,
    /// As [`WorkPrecisionFile::uncertainties`].
    pub uncertainties: [f64; 3],
}

impl WorkPrecisionFile {
    /// Writes the file where a place is reserved: under its name if the study is complete, else as its partial file. Returns
    /// where it is.
    ///
    /// # Errors
    /// Any failure to write.
    pub fn write(&self, place: &Reservation, status: &Status) -> Result<PathBuf, ResultError> {
        let made = place.lock.sibling();
        let target = match status {
            Status::Complete => &place.path,
            _ => &place.partial,
        };
        target::check_replaceable(target, place.overwrite)?;
        let written = self
            .store(&made, status)
            .map_err(|error| ResultError::write(target, false, &error))
            .and_then(|()| {
                let saved = seal::write(&made).and_then(|()| fs::File::open(&made)?.sync_all());
                saved.map_err(|error| ResultError::io(target, "saving the file", error))
            })
            .and_then(|()| {
                let renamed = fs::rename(&made, target);
                renamed.map_err(|error| ResultError::io(target, "giving the finished file its name", error))
            });
        if written.is_err() {
            let _ = fs::remove_file(&made);
        }
        written.map(|()| target.to_owned())
    }

    /// Whether the file at `path` is one of a work-precision study.
    pub fn is_one(path: &Path) -> bool {
        let format = Source::open_known(path).and_then(|source| source.text_attribute("", schema::root::FORMAT));
        matches!(format, Ok(Some(format)) if format == schema::WORK_PRECISION_FORMAT)
    }

    /// Reads what a figure of it needs: title, methods, runs and uncertainties.
    ///
    /// # Errors
    /// A file that is not there, of another kind, of a newer version of the program, or damaged.
    pub fn read(path: &Path) -> Result<WorkPrecisionRead, ResultError> {
        let source = Source::open_known(path)?;
        if source.text_attribute("", schema::root::FORMAT)?.as_deref() != Some(schema::WORK_PRECISION_FORMAT) {
            let found = source.text_attribute("", schema::root::FORMAT)?;
            return Err(ResultError::NotAResult {
                path: path.to_owned(),
                found,
            });
        }
        let missing = |what: String| ResultError::Missing {
            path: path.to_owned(),
            what,
        };
        let methods = super::sweep::flags(&source, "runs/method");
        let column = |name: &str| -> Result<Vec<f64>, ResultError> {
            let variable = format!("runs/{name}");
            let found = source.dataset(&variable)?;
            let info = found.ok_or_else(|| missing(format!("variable {variable}")))?;
            source.read_rows(&variable, 0..info.size())
        };
        let (method, rtol, fixed_step) = (column("method")?, column("rtol")?, column("fixed_step")?);
        let (outcome, same_sequence, events) = (column("outcome")?, column("same_sequence")?, column("events")?);
        let errors = [
            column("onset_error")?,
            column("final_stick_error")?,
            column("largest_event_error")?,
        ];
        let (steps, rhs, jacobians) = (
            column("steps")?,
            column("rhs_evaluations")?,
            column("jacobian_evaluations")?,
        );
        let wall_time = column("wall_time")?;
        let mut uncertainties = [f64::NAN; 3];
        for ((name, ..), value) in schema::WORK_PRECISION_UNCERTAINTIES.iter().zip(&mut uncertainties) {
            if let Some(AttributeValue::Number(number)) = source.attribute(schema::group::REFERENCE, name)? {
                *value = number;
            }
        }
        let rows = (0..method.len()).map(|k| WorkPrecisionRow {
            method: method[k] as i8,
            rtol: rtol[k],
            fixed_step: fixed_step[k],
            failed: outcome[k] != 0.0,
            same_sequence: same_sequence[k] != 0.0,
            events: events[k] as u64,
            onset_error: errors[0][k],
            final_stick_error: errors[1][k],
            largest_event_error: errors[2][k],
            steps: steps[k] as u64,
            rhs_evaluations: rhs[k] as u64,
            jacobian_evaluations: jacobians[k] as u64,
            wall_time: wall_time[k],
        });
        Ok(WorkPrecisionRead {
            title: source.text_attribute("", schema::root::TITLE)?.unwrap_or_default(),
            runs: rows.collect(),
            methods,
            reference: source
                .text_attribute(schema::group::REFERENCE, "description")?
                .unwrap_or_default(),
            uncertainties,
        })
    }

    fn store(&self, path: &Path, status: &Status) -> hdf5::Result<()> {
        let file = table::create_file(path)?;
        for (name, text) in [
            (schema::root::CONVENTIONS, schema::CONVENTIONS),
            (schema::root::TITLE, &self.title),
            (schema::root::SOURCE, &self.source),
            (schema::root::HISTORY, &self.history),
            (schema::root::FORMAT, schema::WORK_PRECISION_FORMAT),
            (schema::root::STATUS, status.name()),
        ] {
            write_text_attribute(&file, name, text)?;
        }
        file.new_attr::<i32>()
            .create(schema::root::FORMAT_VERSION)?
            .write_scalar(&schema::FORMAT_VERSION)?;
        let mut runs = TableWriter::create(&file, &schema::work_precision_runs(&self.methods))?;
        for row in &self.runs {
            let cells = row.cells(runs.next_index());
            runs.push(cells);
        }
        runs.append()?;
        let mut events = TableWriter::create(&file, &schema::work_precision_reference())?;
        for row in &self.events {
            let head = [Cell::I32(events.next_index()), Cell::I8(row.kind)];
            events.push(head.into_iter().chain([row.time, row.uncertainty].map(Cell::F64)));
        }
        events.append()?;
        let reference = file.group(schema::group::REFERENCE)?;
        write_text_attribute(&reference, "description", &self.reference)?;
        for ((name, units, long_name), value) in schema::WORK_PRECISION_UNCERTAINTIES.iter().zip(self.uncertainties) {
            attributes::write_number_attribute(&reference, name, value)?;
            attributes::write_companions(&reference, name, units, long_name)?;
        }
        let input = table::create_group(&file, schema::group::INPUT)?;
        attributes::write_input(&input, "study", &self.study, "the study as it was given (TOML)")?;
        let resolved = "every parameter of the first run in SI units (TOML)";
        attributes::write_input(&input, schema::INPUT_RESOLVED, &self.resolved, resolved)?;
        write_attributes(&table::create_group(&file, schema::group::META)?, &self.meta)?;
        super::checksums::write(&file, &super::checksums::Known::new())?;
        file.flush()
    }
}

impl WorkPrecisionRow {
    fn cells(&self, index: i32) -> [Cell; 14] {
        let count = |value: u64| Cell::I64(i64::try_from(value).unwrap_or(i64::MAX));
        [
            Cell::I32(index),
            Cell::I8(self.method),
            Cell::F64(self.rtol),
            Cell::F64(self.fixed_step),
            Cell::I8(self.failed.into()),
            Cell::I8(self.same_sequence.into()),
            count(self.events),
            Cell::F64(self.onset_error),
            Cell::F64(self.final_stick_error),
            Cell::F64(self.largest_event_error),
            count(self.steps),
            count(self.rhs_evaluations),
            count(self.jacobian_evaluations),
            Cell::F64(self.wall_time),
        ]
    }
}
