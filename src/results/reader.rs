//! Reads result files, complete or partial, and lists what is in them.

use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::attributes::AttributeValue;
use super::schema::{self, attribute, group, root};
use super::source::{DatasetInfo, Holds, Kind, Numeric, Source};
use super::{Extra, ResultError, Status, StickSlipTable, Values};
use crate::model::Mode;
use crate::record::{Channels, Event, EventKind, Sample, Segment, State};

/// Rows read at a time.
const BLOCK: usize = 65_536;
/// Most events, segments and cycles that are held at once: 0.5 GB of events.
const MOST_ROWS: usize = 1 << 21;

/// A result file, open for reading.
///
/// A partial file can be read while it is written: each column is then as long as it was when the
/// file was opened.
#[derive(Debug)]
pub struct ResultFile {
    path: PathBuf,
    pub(super) source: Source,
    status: Status,
    title: String,
}

impl ResultFile {
    /// Opens a result file and checks that this program understands it.
    ///
    /// # Errors
    ///
    /// No such file; not HDF5; HDF5, but not a result; of a newer format; truncated or damaged; or
    /// locked by a program that writes it.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let path = path.to_owned();
        let source = Source::open(&path)?;
        let found = source.text_attribute("", root::FORMAT)?;
        if found.as_deref() != Some(schema::FORMAT) {
            let own = schema::FORMATS.into_iter().find(|own| found.as_deref() == Some(*own));
            return Err(match own {
                Some(format) => ResultError::AnotherKind { path, format },
                None => ResultError::NotAResult { path, found },
            });
        }
        let mut result = ResultFile {
            path,
            source,
            status: Status::Interrupted,
            title: String::new(),
        };
        let found = match result.attribute("", root::FORMAT_VERSION)? {
            AttributeValue::Integer(version) => version,
            _ => return Err(result.missing("integer root attribute format_version")),
        };
        let known = i64::from(schema::FORMAT_VERSION);
        if found > known {
            return Err(ResultError::Newer {
                path: result.path,
                found,
                known,
            });
        }
        result.status = match result.text(root::STATUS)?.as_str() {
            "complete" => Status::Complete,
            "failed" => Status::Failed(result.source.text_attribute("", root::FAILURE)?.unwrap_or_default()),
            _ => Status::Interrupted,
        };
        result.title = result.text(root::TITLE)?;
        Ok(result)
    }

    /// As it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How the run ended. A file that is still being written counts as interrupted.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Of the case.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// A root attribute that is a text: see [`schema::root`].
    pub fn text(&self, name: &str) -> Result<String, ResultError> {
        self.source
            .text_attribute("", name)?
            .ok_or_else(|| self.missing(&format!("text in root attribute {name}")))
    }

    /// The TOML text as it was given.
    pub fn case_text(&self) -> Result<String, ResultError> {
        self.input(schema::INPUT_CASE)
    }

    /// Every parameter in SI and in full precision, as TOML: what repeats the run.
    pub fn resolved(&self) -> Result<String, ResultError> {
        self.input(schema::INPUT_RESOLVED)
    }

    /// The attributes of /meta, in alphabetical order.
    pub fn meta(&self) -> Result<Vec<(String, AttributeValue)>, ResultError> {
        self.attributes_of(group::META)
    }

    /// Samples that every column of the trajectory has.
    pub fn sample_count(&self) -> Result<usize, ResultError> {
        self.rows(&schema::trajectory())
    }

    /// Rows `range` of a column of the trajectory, as numbers.
    pub fn column(&self, name: &str, range: Range<usize>) -> Result<Vec<f64>, ResultError> {
        self.values(group::TRAJECTORY, name, range)
    }

    /// The first of `rows` of a column from which on a condition holds.
    ///
    /// # Errors
    /// There is no such column or row; or of the file.
    #[cfg(feature = "plot")]
    pub(crate) fn first_row(
        &self,
        group: &str,
        name: &str,
        rows: Range<usize>,
        is_past: impl Fn(f64) -> bool,
    ) -> Result<usize, ResultError> {
        let (mut low, mut high) = (rows.start, rows.end);
        while low < high {
            let middle = low + (high - low) / 2;
            if is_past(self.values::<f64>(group, name, middle..middle + 1)?[0]) {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        Ok(low)
    }

    /// A column of the trajectory, block by block.
    pub fn column_blocks(
        &self,
        name: &str,
    ) -> Result<impl Iterator<Item = Result<Vec<f64>, ResultError>>, ResultError> {
        self.dataset(group::TRAJECTORY, name)?;
        let name = name.to_owned();
        Ok(blocks(self.sample_count()?).map(move |range| self.values(group::TRAJECTORY, &name, range)))
    }

    /// Rows `range` of the trajectory, none of which has a number that is none.
    ///
    /// # Errors
    /// A state or a channel that is not finite; or of the file.
    pub fn finite_samples(&self, range: Range<usize>) -> Result<Vec<Sample>, ResultError> {
        let samples = self.samples(range.clone())?;
        for (row, sample) in range.zip(&samples) {
            self.finite(row, State::DESCRIPTIONS, sample.state.values())?;
            self.finite(row, Channels::DESCRIPTIONS, sample.channels.values())?;
        }
        Ok(samples)
    }

    fn finite<const N: usize>(
        &self,
        row: usize,
        names: &[(&'static str, &'static str, &'static str)],
        values: [f64; N],
    ) -> Result<(), ResultError> {
        let odd = names.iter().zip(values).find(|(_, value)| !value.is_finite());
        odd.map_or(Ok(()), |(&(name, _, _), value)| {
            let path = self.path.clone();
            Err(ResultError::NotFinite { path, row, name, value })
        })
    }

    /// Rows `range` of the trajectory, whatever numbers they have.
    pub fn samples(&self, range: Range<usize>) -> Result<Vec<Sample>, ResultError> {
        let modes = self.modes(group::TRAJECTORY, "mode", range.clone())?;
        let segments: Vec<i32> = self.values(group::TRAJECTORY, "segment", range.clone())?;
        let times = self.column("time", range.clone())?;
        let column = |(name, _, _): &(&str, &str, &str)| self.column(name, range.clone());
        let states = State::DESCRIPTIONS.iter().map(column).collect::<Result<Vec<_>, _>>()?;
        let channels = Channels::DESCRIPTIONS
            .iter()
            .map(column)
            .collect::<Result<Vec<_>, _>>()?;
        let sample = |row: usize| {
            Ok(Sample {
                time: times[row],
                mode: modes[row],
                segment: self.count(group::TRAJECTORY, range.start + row, "segment", segments[row])?,
                state: State::from_values(std::array::from_fn(|k| states[k][row])),
                channels: Channels::from_values(std::array::from_fn(|k| channels[k][row])),
            })
        };
        (0..times.len()).map(sample).collect()
    }

    /// Time (s), mode and state of rows `range` of the trajectory.
    ///
    /// # Errors
    /// A state that is not finite; or of the file.
    pub fn states(&self, range: Range<usize>) -> Result<Vec<(f64, Mode, State)>, ResultError> {
        let modes = self.modes(group::TRAJECTORY, "mode", range.clone())?;
        let times = self.column("time", range.clone())?;
        let column = |(name, _, _): &(&str, &str, &str)| self.column(name, range.clone());
        let states = State::DESCRIPTIONS.iter().map(column).collect::<Result<Vec<_>, _>>()?;
        let state = |row: usize| {
            let values = std::array::from_fn(|k| states[k][row]);
            self.finite(range.start + row, State::DESCRIPTIONS, values)?;
            Ok((times[row], modes[row], State::from_values(values)))
        };
        (0..times.len()).map(state).collect()
    }

    /// Every event, in order of time.
    pub fn events(&self) -> Result<Vec<Event>, ResultError> {
        let rows = self.few(&schema::events())?;
        let mut events = Vec::with_capacity(rows);
        for all in blocks(rows) {
            events.extend(self.some_events(all)?);
        }
        Ok(events)
    }

    /// A column of /events, a row for each event.
    ///
    /// # Errors
    /// There is no such column; or of the file.
    pub fn event_column(&self, name: &str) -> Result<Vec<f64>, ResultError> {
        self.values(group::EVENTS, name, 0..self.few(&schema::events())?)
    }

    fn some_events(&self, all: Range<usize>) -> Result<Vec<Event>, ResultError> {
        let column = |name: &str| -> Result<Vec<f64>, ResultError> { self.values(group::EVENTS, name, all.clone()) };
        let side = |side: &str| -> Result<Vec<Vec<f64>>, ResultError> {
            State::DESCRIPTIONS
                .iter()
                .map(|(name, _, _)| column(&format!("{name}_{side}")))
                .collect()
        };
        let kinds: Vec<i8> = self.values(group::EVENTS, "kind", all.clone())?;
        let modes = self.modes(group::EVENTS, "mode_after", all.clone())?;
        let segments: Vec<i32> = self.values(group::EVENTS, "segment", all.clone())?;
        let (times, forces) = (column("time")?, column("internal_force")?);
        let (before, after) = (side("before")?, side("after")?);
        let event = |row: usize| {
            let kind = EventKind::ALL.into_iter().find(|kind| kind.code() == kinds[row]);
            Ok(Event {
                time: times[row],
                kind: kind.ok_or_else(|| self.unknown("an event's kind", kinds[row]))?,
                mode_after: modes[row],
                segment: self.count(group::EVENTS, all.start + row, "segment", segments[row])?,
                before: State::from_values(std::array::from_fn(|k| before[k][row])),
                after: State::from_values(std::array::from_fn(|k| after[k][row])),
                internal_force: forces[row],
            })
        };
        (0..all.len()).map(event).collect()
    }

    /// Every segment, in order of time.
    pub fn segments(&self) -> Result<Vec<Segment>, ResultError> {
        let all = 0..self.few(&schema::segments())?;
        let column = |name: &str| -> Result<Vec<f64>, ResultError> { self.values(group::SEGMENTS, name, all.clone()) };
        let counts = |name: &str| -> Result<Vec<u64>, ResultError> {
            let values: Vec<i64> = self.values(group::SEGMENTS, name, all.clone())?;
            let count = |(row, value)| self.count(group::SEGMENTS, row, name, value);
            values.into_iter().enumerate().map(count).collect()
        };
        let (starts, ends, last_steps) = (column("start")?, column("end")?, column("last_step")?);
        let modes = self.modes(group::SEGMENTS, "mode", all.clone())?;
        let solvers: Vec<i8> = self.values(group::SEGMENTS, "solver", all.clone())?;
        let orders: Vec<i32> = self.values(group::SEGMENTS, "last_order", all.clone())?;
        let (steps, rhs) = (counts("steps")?, counts("rhs_evaluations")?);
        let (jacobians, setups) = (counts("jacobian_evaluations")?, counts("linear_solver_setups")?);
        let (failures, iterations) = (counts("error_test_failures")?, counts("nonlinear_iterations")?);
        let (divergences, roots) = (counts("nonlinear_convergence_failures")?, counts("root_evaluations")?);
        let segment = |row: usize| {
            let solver = schema::SOLVERS.iter().find(|flag| flag.0 == solvers[row]);
            Ok(Segment {
                start: starts[row],
                end: ends[row],
                mode: modes[row],
                solver: solver
                    .ok_or_else(|| self.unknown("a segment's solver", solvers[row]))?
                    .1,
                resolved: None,
                steps: steps[row],
                rhs_evaluations: rhs[row],
                jacobian_evaluations: jacobians[row],
                linear_solver_setups: setups[row],
                error_test_failures: failures[row],
                nonlinear_iterations: iterations[row],
                nonlinear_convergence_failures: divergences[row],
                root_evaluations: roots[row],
                last_order: self.count(group::SEGMENTS, row, "last_order", orders[row])?,
                last_step: last_steps[row],
            })
        };
        all.map(segment).collect()
    }

    /// The statistics of stick-slip; `None` in a file whose run was killed before they were written.
    pub fn stick_slip(&self) -> Result<Option<StickSlipTable>, ResultError> {
        let attributes = self.attributes_of(group::STICK_SLIP)?;
        if attributes.is_empty() {
            return Ok(None);
        }
        let find = |name: &str| attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value);
        let number = |name: &str| match find(name) {
            Some(AttributeValue::Number(value)) => *value,
            _ => f64::NAN,
        };
        let text = |name: &str, suffix: &str| match find(&format!("{name}{suffix}")) {
            Some(AttributeValue::Text(text)) => text.clone(),
            _ => String::new(),
        };
        let count = |name: &str| match find(name) {
            Some(AttributeValue::Integer(value)) => u64::try_from(*value).unwrap_or(0),
            _ => 0,
        };
        let all = 0..self.few(&schema::stick_slip())?;
        let column =
            |name: &str| -> Result<Vec<f64>, ResultError> { self.values(group::STICK_SLIP, name, all.clone()) };
        let mut table = StickSlipTable {
            stick_duration: column("stick_duration")?,
            slip_duration: column("slip_duration")?,
            period: column("period")?,
            stick_count: count(schema::STICK_SLIP_COUNTS[0].0),
            slip_count: count(schema::STICK_SLIP_COUNTS[1].0),
            ..StickSlipTable::default()
        };
        for (quantity, (name, ..)) in table.quantities().into_iter().zip(schema::STICK_SLIP_QUANTITIES) {
            *quantity = number(name);
        }
        for (name, value) in &attributes {
            let known = schema::STICK_SLIP_QUANTITIES.iter().any(|(known, _, _)| known == name);
            if let (AttributeValue::Number(value), false) = (value, known) {
                table.extras.push(Extra {
                    name: name.clone(),
                    unit: text(name, attribute::UNITS_SUFFIX),
                    description: text(name, attribute::LONG_NAME_SUFFIX),
                    value: *value,
                });
            }
        }
        Ok(Some(table))
    }

    /// What a group holds that later versions of the program, or others, have added: its attributes,
    /// and its one-dimensional numeric variables with up to `limit` of their first values; `None`
    /// if there is no such group.
    pub fn added_group(&self, name: &str, limit: usize) -> Result<Option<AddedGroup>, ResultError> {
        let members = match self.source.members(name) {
            Ok(members) => members,
            Err(ResultError::Damaged { .. }) if !self.has(name)? => return Ok(None),
            Err(error) => return Err(error),
        };
        let mut columns = Vec::new();
        for member in members {
            let Kind::Dataset(info) = member.is else { continue };
            if info.shape.len() == 1 && info.holds.is_number() {
                let path = format!("{name}/{}", member.name);
                let described = self.source.described(&path)?;
                columns.push(AddedColumn {
                    units: described.units,
                    long_name: described.long_name,
                    rows: info.size(),
                    values: self.values(name, &member.name, 0..info.size().min(limit))?,
                    name: member.name,
                });
            }
        }
        let attributes = self.attributes_of(name)?;
        Ok(Some(AddedGroup { attributes, columns }))
    }

    /// The groups with their columns of numbers, in the order of the file; a group within another by its path. Groups without
    /// such columns are left out.
    ///
    /// # Errors
    /// Of the file.
    pub fn tables(&self) -> Result<Vec<(String, Vec<TableColumn>)>, ResultError> {
        let mut groups = Vec::new();
        self.source.walk(&mut |path, member| {
            if let Kind::Group(_) = member.is {
                groups.push(path.to_owned());
            }
            Ok(())
        })?;
        let mut tables = Vec::new();
        for group in groups {
            let columns = self.columns_in(&group)?;
            if !columns.is_empty() {
                tables.push((group, columns));
            }
        }
        Ok(tables)
    }

    /// A column of [`Self::tables`] in the type that it has; of a file that is not whole the rows that are there for certain.
    ///
    /// # Errors
    /// There is no such column; or of the file.
    pub fn typed_column(&self, group: &str, name: &str) -> Result<Values, ResultError> {
        let info = self.dataset(group, name)?;
        let all = 0..match schema::tables().iter().any(|table| table.group == group) {
            true => self.table_rows(group)?,
            false => info.size(),
        };
        Ok(match info.holds {
            Holds::Integers(1) => Values::Int8(self.values(group, name, all)?),
            Holds::Integers(4) => Values::Int32(self.values(group, name, all)?),
            Holds::Integers(_) => Values::Int64(self.values(group, name, all)?),
            _ => Values::Float64(self.values(group, name, all)?),
        })
    }

    /// The columns of numbers of a group, in the order of the file; none if there is no such group.
    ///
    /// # Errors
    /// Of the file.
    pub fn table(&self, group: &str) -> Result<Vec<TableColumn>, ResultError> {
        if !self.has(group)? {
            return Ok(Vec::new());
        }
        self.columns_in(group)
    }

    fn columns_in(&self, group: &str) -> Result<Vec<TableColumn>, ResultError> {
        let mut columns = Vec::new();
        for member in self.source.members(group)? {
            let Kind::Dataset(info) = member.is else { continue };
            if info.shape.len() != 1 || !info.holds.is_number() {
                continue;
            }
            let path = format!("{group}/{}", member.name);
            let described = self.source.described(&path)?;
            columns.push(TableColumn {
                units: described.units.unwrap_or_default(),
                long_name: described.long_name.unwrap_or_default(),
                whole: !matches!(info.holds, Holds::Floats(_)),
                flags: described.flags,
                rows: info.size(),
                name: member.name,
            });
        }
        Ok(columns)
    }

    /// Rows `range` of a column of [`Self::table`].
    ///
    /// # Errors
    /// There is no such column or row; or of the file.
    pub fn table_values(&self, group: &str, name: &str, range: Range<usize>) -> Result<Vec<f64>, ResultError> {
        self.values(group, name, range)
    }

    /// The rows that every column of a table of the schema has for certain, by its group: of a file that is not whole some may
    /// have more.
    ///
    /// # Errors
    /// Of the file.
    pub fn table_rows(&self, group: &str) -> Result<usize, ResultError> {
        match schema::tables().iter().find(|table| table.group == group) {
            Some(table) => self.rows(table),
            None => Ok(self.table(group)?.iter().map(|column| column.rows).min().unwrap_or(0)),
        }
    }

    /// A text attribute of a group.
    ///
    /// # Errors
    /// Of the file.
    pub fn group_text(&self, group: &str, name: &str) -> Result<Option<String>, ResultError> {
        self.source.text_attribute(group, name)
    }

    /// A table of two dimensions, row by row, with its shape; `None` if there is none.
    ///
    /// # Errors
    /// Of the file.
    pub fn matrix(&self, group: &str, name: &str) -> Result<Option<Matrix>, ResultError> {
        let path = format!("{group}/{name}");
        let Some(info) = self.source.dataset(&path)? else {
            return Ok(None);
        };
        let &[rows, columns] = &info.shape[..] else {
            return Ok(None);
        };
        let values = self.source.read::<f64>(&path, &[0..rows, 0..columns])?;
        Ok(Some((values, [rows, columns])))
    }

    /// A text that is a variable; `None` if there is none.
    ///
    /// # Errors
    /// Of the file.
    pub fn text_variable(&self, group: &str, name: &str) -> Result<Option<String>, ResultError> {
        let path = format!("{group}/{name}");
        match self.source.dataset(&path)? {
            Some(_) => self.source.text(&path),
            None => Ok(None),
        }
    }

    /// Whether the file has something of this name.
    pub(super) fn has(&self, name: &str) -> Result<bool, ResultError> {
        Ok(self.source.members("")?.iter().any(|member| member.name == name))
    }

    fn input(&self, name: &str) -> Result<String, ResultError> {
        self.dataset(group::INPUT, name)?;
        self.source
            .text(&format!("{}/{name}", group::INPUT))?
            .ok_or_else(|| self.missing(&format!("text in /{}/{name}", group::INPUT)))
    }

    /// The rows of a table that is read as a whole.
    pub(super) fn few(&self, table: &schema::Table) -> Result<usize, ResultError> {
        let rows = self.rows(table)?;
        if rows > MOST_ROWS {
            return Err(self.source.refused(format!("/{} has {rows} rows", table.group)));
        }
        Ok(rows)
    }

    /// Rows that every column of a table has. A run that was killed in the middle of a flush may
    /// have left some columns longer than others, or longer than their data.
    pub(super) fn rows(&self, table: &schema::Table) -> Result<usize, ResultError> {
        let mut rows = usize::MAX;
        for variable in &table.variables {
            let info = self.dataset(table.group, &variable.name)?;
            let mut sound = info.size().min(rows);
            if self.status != Status::Complete {
                let chunk = info
                    .chunk
                    .as_ref()
                    .and_then(|shape| shape.first().copied())
                    .unwrap_or(1)
                    .max(1);
                sound = sound.min(info.chunks.unwrap_or(0).saturating_mul(chunk));
                while sound > 0
                    && self
                        .values::<f64>(table.group, &variable.name, sound - 1..sound)
                        .is_err()
                {
                    sound = (sound - 1) / chunk * chunk;
                }
            }
            rows = sound;
        }
        Ok(rows)
    }

    fn modes(&self, group: &str, name: &str, range: Range<usize>) -> Result<Vec<Mode>, ResultError> {
        let codes: Vec<i8> = self.values(group, name, range)?;
        let mode = |code: i8| Mode::ALL.into_iter().find(|mode| mode.code() == code);
        codes
            .into_iter()
            .map(|code| mode(code).ok_or_else(|| self.unknown("a mode", code)))
            .collect()
    }

    pub(super) fn values<T: Numeric>(
        &self,
        group: &str,
        name: &str,
        range: Range<usize>,
    ) -> Result<Vec<T>, ResultError> {
        let info = self.dataset(group, name)?;
        let size = info.size();
        if range.end > size {
            return Err(self.missing(&format!("row {} in /{group}/{name}, but {size} rows", range.end - 1)));
        }
        self.source.read_rows(&format!("{group}/{name}"), range)
    }

    /// A column: one dimension of numbers, or a scalar text.
    fn dataset(&self, group: &str, name: &str) -> Result<DatasetInfo, ResultError> {
        let info = self.source.dataset(&format!("{group}/{name}"))?;
        let info = match info {
            Some(info) => info,
            None if self.has(group)? => return Err(self.missing(&format!("variable /{group}/{name}"))),
            None => {
                let there: Vec<String> = self.source.members("")?.into_iter().map(|member| member.name).collect();
                return Err(self.missing(&format!("group /{group} (there are: {})", there.join(", "))));
            }
        };
        if group != group::INPUT && (info.shape.len() != 1 || !info.holds.is_number()) {
            let what = format!(
                "column of numbers /{group}/{name}, but {} of shape {:?}",
                info.holds.name(),
                info.shape
            );
            return Err(self.missing(&what));
        }
        Ok(info)
    }

    fn attribute(&self, object: &str, name: &str) -> Result<AttributeValue, ResultError> {
        self.source
            .attribute(object, name)?
            .ok_or_else(|| self.missing(&format!("attribute {name} in /{object}")))
    }

    fn attributes_of(&self, group: &str) -> Result<Vec<(String, AttributeValue)>, ResultError> {
        self.source.attributes(group).map_err(|error| match error {
            ResultError::Damaged { .. } if !self.has(group).unwrap_or(true) => self.missing(&format!("group /{group}")),
            error => error,
        })
    }

    /// A number that counts something.
    fn count<T, U>(&self, group: &str, row: usize, name: &str, value: T) -> Result<U, ResultError>
    where
        T: Copy + std::fmt::Display,
        U: TryFrom<T>,
    {
        let wrong = |_| self.missing(&format!("count in row {row} of /{group}/{name}, but {value}"));
        U::try_from(value).map_err(wrong)
    }

    pub(super) fn missing(&self, what: &str) -> ResultError {
        ResultError::Missing {
            path: self.path.clone(),
            what: what.to_owned(),
        }
    }

    fn unknown(&self, what: &'static str, code: i8) -> ResultError {
        ResultError::UnknownCode {
            path: self.path.clone(),
            what,
            code,
        }
    }
}

/// A group of which this version of the program knows the name only.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AddedGroup {
    /// In alphabetical order.
    pub attributes: Vec<(String, AttributeValue)>,
    /// In the order of the file.
    pub columns: Vec<AddedColumn>,
}

/// A variable of such a group.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AddedColumn {
    /// As in the file.
    pub name: String,
    /// UDUNITS.
    pub units: Option<String>,
    /// What it is.
    pub long_name: Option<String>,
    /// Rows in the file, of which `values` are the first.
    pub rows: usize,
    /// One for each row.
    pub values: Vec<f64>,
}

/// Values row by row, with the numbers of rows and columns.
pub type Matrix = (Vec<f64>, [usize; 2]);

/// A column of numbers in a result file.
#[derive(Debug, Clone, PartialEq)]
pub struct TableColumn {
    /// Within its group.
    pub name: String,
    /// UDUNITS.
    pub units: String,
    /// Description.
    pub long_name: String,
    /// Whole numbers.
    pub whole: bool,
    /// What codes mean; empty where it has none.
    pub flags: Vec<(i64, String)>,
    /// How many values it has.
    pub rows: usize,
}

/// The ranges that cover `0..rows`, [`BLOCK`] by block.
fn blocks(rows: usize) -> impl Iterator<Item = Range<usize>> {
    (0..rows)
        .step_by(BLOCK)
        .map(move |start| start..rows.min(start + BLOCK))
}
