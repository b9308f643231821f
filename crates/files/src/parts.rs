//! Parts of a result file that are not rows: its header, the statistics of stick-slip, and additions. `certify` adds
//! /certificate, /sensitivity and /events/time_uncertainty; a second method adds /witness and /events/witness_time.

use std::fs;
use std::path::Path;

use super::attributes::{describe, describe_text, quantity, write_attributes};
use super::schema::{self, Variable};
use super::table::{ColumnValues, DeclaredColumn, FileColumn, create_empty, create_group, with_type};
use super::target::{self, Reservation};
use super::{AttributeValue, ResultError, raw};
use stickslip_system::record::Cycle;

/// Metadata of a run, known before it starts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Header {
    /// Title of the case; root attribute `title`.
    pub title: String,
    /// Program with its version; root attribute `source`.
    pub source: String,
    /// Publication of the model; root attribute `references`.
    pub references: String,
    /// Date and command in one line; root attribute `history`.
    pub history: String,
    /// The TOML text as given.
    pub case_text: String,
    /// Every parameter in SI and in full precision, as TOML.
    pub resolved: String,
    /// Resolved text of the case as asked for, if the run was repeated with finer settings.
    pub asked: Option<String>,
    /// Overrides of the case in words, such as `friction.decay = 4 s/rad`.
    pub changed: Vec<String>,
    /// Attributes of /meta: versions, platform, command line, method, tolerances, start.
    pub meta: Vec<(String, AttributeValue)>,
    /// Attributes of /events: method of location.
    pub events: Vec<(String, AttributeValue)>,
    /// Columns beyond those of every file.
    pub extension: schema::Extension,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Status {
    /// The run reached the end of the case.
    Complete,
    /// The user or a kill ended the run; the results until then are good.
    Interrupted,
    /// The run failed with this message; the results until then are good.
    Failed(String),
}

impl Status {
    /// Status of a computation that has not failed.
    pub fn of(interrupted: bool) -> Status {
        match interrupted {
            true => Status::Interrupted,
            false => Status::Complete,
        }
    }

    /// Root attribute `status`.
    pub fn name(&self) -> &'static str {
        match self {
            Status::Complete => "complete",
            Status::Interrupted => "interrupted",
            Status::Failed(_) => "failed",
        }
    }
}

/// The table /stick_slip. Cycle k (0-based) is stick k and the slip after it; its period is from stick k to stick k+1.
/// The final stick has no duration, so there are one fewer cycles than sticks.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StickSlipTable {
    /// Cycles; empty if the writer has recorded them already.
    pub cycles: Vec<Cycle>,
    /// Attributes: quantities and counts. A quantity that the run lacks, such as an onset without a stick, is NaN.
    pub attributes: Vec<Extra>,
}

/// A quantity of /stick_slip.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// Name of the attribute.
    pub name: String,
    /// UDUNITS unit; "1" for a pure number.
    pub unit: String,
    /// Description with the unit.
    pub description: String,
    /// Value in its unit.
    pub value: f64,
    /// Whether it is stored as int64, not as float64.
    pub whole: bool,
}

impl Extra {
    /// A quantity; `None` is stored as NaN.
    pub fn new(name: &str, unit: &str, description: &str, value: Option<f64>) -> Self {
        Extra {
            name: name.to_owned(),
            unit: unit.to_owned(),
            description: description.to_owned(),
            value: value.unwrap_or(f64::NAN),
            whole: false,
        }
    }
}

impl StickSlipTable {
    /// Value of a quantity or a count; `None` if it is missing.
    pub fn value(&self, name: &str) -> Option<f64> {
        let found = self.attributes.iter().find(|attribute| attribute.name == name);
        found.map(|attribute| attribute.value).filter(|value| !value.is_nan())
    }
}

/// Additions to a group of a result file. /events exists already; every other group is created.
#[derive(Debug, Clone, PartialEq)]
pub struct Addition {
    group: String,
    /// Attributes of the group.
    pub attributes: Vec<(String, AttributeValue)>,
    /// In the order of the file, with their dimensions. A column without dimensions is a dimension itself.
    columns: Vec<(FileColumn, Vec<String>)>,
    /// Name, description, text.
    texts: Vec<[String; 3]>,
}

impl Addition {
    /// An empty addition.
    pub fn new(group: &str) -> Self {
        Addition {
            group: group.to_owned(),
            attributes: Vec::new(),
            columns: Vec::new(),
            texts: Vec::new(),
        }
    }

    /// A table, whose first column is the dimension of the others.
    pub fn of_table(group: &str, columns: Vec<FileColumn>) -> Self {
        let dimension = columns.first().map(|column| column.variable.name.clone());
        let over = |index: usize| dimension.iter().filter(|_| index > 0).cloned().collect();
        let columns = columns.into_iter().enumerate();
        Addition {
            columns: columns.map(|(index, column)| (column, over(index))).collect(),
            ..Addition::new(group)
        }
    }

    /// The group.
    pub fn group(&self) -> &str {
        &self.group
    }

    /// Adds an attribute.
    pub fn attribute(&mut self, name: &str, value: impl Into<AttributeValue>) {
        self.attributes.push((name.to_owned(), value.into()));
    }

    /// Adds quantities with their values as attributes.
    pub fn quantities(&mut self, all: impl Iterator<Item = (Variable, f64)>) {
        let all =
            all.flat_map(|(variable, value)| quantity(&variable.name, value, &variable.units, &variable.long_name));
        self.attributes.extend(all);
    }

    /// Adds a dimension with its coordinate: 0, 1, ...
    pub fn dimension(&mut self, name: &str, length: usize, long_name: &str) {
        let column = FileColumn {
            variable: Variable::index(name, long_name),
            values: ColumnValues::Int32((0..length as i32).collect()),
        };
        self.columns.push((column, Vec::new()));
    }

    /// Adds a column over one or several dimensions, the last one fastest.
    pub fn over(&mut self, dimensions: &[&str], column: FileColumn) {
        let dimensions = dimensions.iter().map(|&name| name.to_owned());
        self.columns.push((column, dimensions.collect()));
    }

    /// Adds declared columns of rows over a dimension.
    pub fn table<'a, R: 'a>(
        &mut self,
        dimension: &str,
        columns: impl IntoIterator<Item = &'a DeclaredColumn<R>>,
        rows: &[R],
    ) {
        let columns = columns.into_iter().map(|column| column.of(rows));
        columns.for_each(|column| self.over(&[dimension], column));
    }

    /// Adds a text after the columns.
    pub fn text(&mut self, name: &str, long_name: &str, text: String) {
        self.texts.push([name.to_owned(), long_name.to_owned(), text]);
    }

    pub(super) fn write(&self, file: &hdf5::File) -> hdf5::Result<()> {
        let group = match file.link_exists(&self.group) {
            true => file.group(&self.group)?,
            false => create_group(file, &self.group)?,
        };
        write_attributes(&group, &self.attributes)?;
        for (FileColumn { variable, values }, dimensions) in &self.columns {
            if group.link_exists(&variable.name) {
                group.unlink(&variable.name)?;
            }
            let scales = dimensions.iter().map(|name| group.dataset(name));
            let scales = scales.collect::<hdf5::Result<Vec<_>>>()?;
            let shape: Vec<usize> = match &scales[..] {
                [] => vec![values.len()],
                scales => scales.iter().map(|scale| scale.size()).collect(),
            };
            let builder = group.new_dataset_builder();
            let dataset = with_type!(variable.kind, create_empty(builder, shape, &variable.name))?;
            values.write(&dataset)?;
            describe(&dataset, variable)?;
            if scales.is_empty() {
                raw::set_scale(&dataset, &variable.name)?;
            }
            for (index, scale) in (0..).zip(&scales) {
                raw::attach_scale(&dataset, scale, index)?;
            }
        }
        for [name, long_name, text] in &self.texts {
            describe_text(&raw::write_text(&group, name, text)?, "1", long_name)?;
        }
        Ok(())
    }
}

/// Copies a complete result file to a reserved place and adds the certificate. The copy appears when it is complete.
///
/// # Errors
/// The file cannot be copied or written; meanwhile another file has come to the place.
pub fn write_certified(from: &Path, place: &Reservation, additions: &[Addition]) -> Result<(), ResultError> {
    let partial = &place.partial;
    let whole =
        copy_with(from, partial, additions).and_then(|()| target::rename(partial, &place.path, place.overwrite));
    if whole.is_err() {
        let _ = fs::remove_file(partial);
    }
    whole
}

fn copy_with(from: &Path, partial: &Path, additions: &[Addition]) -> Result<(), ResultError> {
    fs::copy(from, partial).map_err(|error| ResultError::io(partial, "copying the result", error))?;
    add_to(partial, additions).map_err(|error| ResultError::write(partial, false, &error))?;
    target::save(partial)
}

fn add_to(path: &Path, additions: &[Addition]) -> hdf5::Result<()> {
    let file = hdf5::File::open_rw(path)?;
    // The checksums of an earlier version would not cover the certificate.
    if file.link_exists(schema::CHECKSUMS) {
        file.unlink(schema::CHECKSUMS)?;
    }
    let groups = additions.iter().map(|addition| &addition.group);
    for group in groups.filter(|group| *group != schema::group::EVENTS && file.link_exists(group)) {
        file.unlink(group)?;
    }
    additions.iter().try_for_each(|addition| addition.write(&file))?;
    file.flush()
}
