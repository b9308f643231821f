//! Reads result files, complete or partial, and lists their contents.

use std::ops::Range;
use std::path::Path;

use super::attributes::AttributeValue;
use super::schema::{self, Extension, StorageKind, Variable, attribute, group, root};
use super::source::{BLOCK, DatasetInfo, FileSource, Holds, Object, uneven};
use super::table::StoredNumber;
use super::{ColumnValues, Extra, Reason, ResultError, Status, StickSlipTable};
use stickslip_system::model::Mode;
use stickslip_system::record::{
    Channels, Counters, Cycle, Event, EventKind, RecordedChannel, Sample, Segment, State, channel,
};

/// Largest number of events, segments or cycles held at once: 0.5 GB of events.
const MOST_ROWS: usize = 1 << 21;

/// A result file, open for reading. Readers fail if the file is damaged, or lacks the requested column or row.
///
/// A partial file can be read while it is written: each column then has its length at the time of opening.
#[derive(Debug)]
pub struct ResultFile {
    pub(super) source: FileSource,
    status: Status,
    title: String,
}

impl ResultFile {
    /// Opens a result file and checks that this program understands it.
    ///
    /// # Errors
    /// A file that is missing, not HDF5, no result, of a newer format, truncated or damaged, or locked by its writer, or a
    /// complete one with a table whose columns differ in length.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let file = Self::open_unchecked(path)?;
        // A run that was killed leaves columns of different lengths.
        if file.status == Status::Complete {
            file.source.check_tables()?;
        }
        Ok(file)
    }

    pub(super) fn open_unchecked(path: &Path) -> Result<Self, ResultError> {
        let source = FileSource::open(path)?;
        let found = source.text_attribute("", root::FORMAT)?;
        if found.as_deref() != Some(schema::FORMAT) {
            let own = schema::own_format(found.as_deref());
            return Err(own.map_or(Reason::NotAResult(found), Reason::AnotherKind).of(path));
        }
        let mut result = ResultFile {
            source,
            status: Status::Interrupted,
            title: String::new(),
        };
        let AttributeValue::Integer(found) = result.attribute("", root::FORMAT_VERSION)? else {
            return Err(result.source.missing("integer root attribute format_version"));
        };
        let known = i64::from(schema::FORMAT_VERSION);
        if found > known {
            return Err(Reason::Newer { found, known }.of(path));
        }
        result.status = match result.text(root::STATUS)?.as_str() {
            "complete" => Status::Complete,
            "failed" => Status::Failed(result.source.text_attribute("", root::FAILURE)?.unwrap_or_default()),
            _ => Status::Interrupted,
        };
        result.title = result.text(root::TITLE)?;
        Ok(result)
    }

    /// Path as opened.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// Status of the run. A file that is still being written counts as interrupted.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Title of the case.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// A text root attribute: see [`schema::root`].
    pub fn text(&self, name: &str) -> Result<String, ResultError> {
        let text = self.source.text_attribute("", name)?;
        text.ok_or_else(|| self.source.missing(format!("text in root attribute {name}")))
    }

    /// TOML text of the case as given.
    pub fn case_text(&self) -> Result<String, ResultError> {
        self.input(schema::INPUT_CASE)
    }

    /// Every parameter in SI and in full precision, as TOML, which repeats the run.
    pub fn resolved(&self) -> Result<String, ResultError> {
        self.input(schema::INPUT_RESOLVED)
    }

    /// Resolved texts of the case that this file is a result of: as asked for, and as run, which may have finer settings.
    pub fn settings(&self) -> Result<Vec<String>, ResultError> {
        let asked = self.text_variable(group::INPUT, schema::INPUT_ASKED)?;
        Ok(asked.into_iter().chain([self.resolved()?]).collect())
    }

    /// Overrides of the case in words, such as `friction.decay = 4 s/rad`; none in files of earlier versions.
    pub fn changed(&self) -> Vec<String> {
        self.source.changed()
    }

    /// Attributes of /meta, in alphabetical order.
    pub fn meta(&self) -> Result<Vec<(String, AttributeValue)>, ResultError> {
        self.attributes_of(group::META)
    }

    /// Number of samples that every column of the trajectory has.
    pub fn sample_count(&self) -> Result<usize, ResultError> {
        self.rows(&schema::trajectory())
    }

    /// Times of the first and the last sample, s; `None` without samples.
    pub fn span(&self) -> Result<Option<(f64, f64)>, ResultError> {
        let Some(last) = self.sample_count()?.checked_sub(1) else {
            return Ok(None);
        };
        let time = |row: usize| Ok(self.column("time", row..row + 1)?[0]);
        Ok(Some((time(0)?, time(last)?)))
    }

    /// Rows `range` of a column of the trajectory, as numbers. A channel that an earlier version did not write is the
    /// product of its factors, or NaN.
    pub fn column(&self, name: &str, range: Range<usize>) -> Result<Vec<f64>, ResultError> {
        self.table_values(group::TRAJECTORY, name, range)
    }

    /// The first of `rows` of a column from which on a condition holds, by bisection.
    pub fn first_row(
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

    /// A column of the trajectory, by blocks.
    pub fn column_blocks(
        &self,
        name: &str,
    ) -> Result<impl Iterator<Item = Result<Vec<f64>, ResultError>>, ResultError> {
        self.column(name, 0..0)?;
        let name = name.to_owned();
        Ok(blocks(self.sample_count()?).map(move |range| self.column(&name, range)))
    }

    /// Checks that the times of the trajectory are finite and increasing: searches in a file, and divisions by time
    /// differences, rely on it. Fails at the first wrong time.
    pub fn check_times(&self) -> Result<(), ResultError> {
        let (mut row, mut before) = (0, f64::NEG_INFINITY);
        for block in self.column_blocks("time")? {
            for time in block? {
                if !(time > before && time.is_finite()) {
                    return Err(Reason::Times { row, time, before }.of(self.path()));
                }
                (row, before) = (row + 1, time);
            }
        }
        Ok(())
    }

    /// Rows `range` of the trajectory. Fails if a state or a channel is not finite.
    pub fn finite_samples(&self, range: Range<usize>) -> Result<Vec<Sample>, ResultError> {
        let samples = self.samples(range.clone())?;
        let stored = self.stored_channels()?;
        for (row, sample) in range.zip(&samples) {
            let values = sample.state.values().into_iter().chain(sample.channels.values());
            self.finite(row, &stored, values)?;
        }
        Ok(samples)
    }

    fn finite(
        &self,
        row: usize,
        stored: &[Option<&'static str>],
        values: impl IntoIterator<Item = f64>,
    ) -> Result<(), ResultError> {
        match not_finite(stored, values) {
            Some((name, value)) => Err(Reason::NotFinite { row, name, value }.of(self.path())),
            None => Ok(()),
        }
    }

    /// Names of the channels in the order of a row; `None` for a channel that the file lacks.
    pub(super) fn stored_channels(&self) -> Result<Vec<Option<&'static str>>, ResultError> {
        let stored = |channel: &RecordedChannel| {
            let lacking = self.lacking(group::TRAJECTORY, channel.name)?;
            Ok(lacking.is_none().then_some(channel.name))
        };
        channel::all().map(stored).collect()
    }

    /// The channel of a column that an earlier version did not write; `None` for any other column.
    pub(super) fn lacking(&self, group: &str, name: &str) -> Result<Option<&'static RecordedChannel>, ResultError> {
        let of_rows = [group::TRAJECTORY, group::DENSE_COEFFICIENTS].contains(&group);
        match channel::find(name).filter(|channel| of_rows && channel.optional) {
            Some(channel) if self.source.dataset(&format!("{group}/{name}"))?.is_none() => Ok(Some(channel)),
            _ => Ok(None),
        }
    }

    /// Rows `range` of a column of [`Self::table`], as numbers; like [`Self::column`] in a trajectory.
    pub fn table_values(&self, group: &str, name: &str, range: Range<usize>) -> Result<Vec<f64>, ResultError> {
        let Some(channel) = self.lacking(group, name)? else {
            return self.values(group, name, range);
        };
        let Some(factors) = channel.product else {
            return Ok(vec![f64::NAN; range.len()]);
        };
        let [a, b] = factors.map(|factor| self.values::<f64>(group, factor, range.clone()));
        Ok(channel::products(a?, b?))
    }

    /// Additions of the case to the tables, without the columns of its parts.
    pub(super) fn extension(&self) -> Result<Extension, ResultError> {
        let motion = self.group_text(group::META, schema::META_MOTION)?;
        Ok(Extension {
            numbers_parts: motion.is_some(),
            translation: motion.is_some_and(|motion| motion == schema::TRANSLATION),
            dense: self.source.dataset(&format!("{}/piece", group::DENSE))?.is_some(),
            ..Extension::default()
        })
    }

    /// Rows `range` of the trajectory, finite or not.
    pub fn samples(&self, range: Range<usize>) -> Result<Vec<Sample>, ResultError> {
        let table = schema::trajectory();
        let rows = ReaderRows::read(self, &table, range.clone())?;
        let sample = |row: usize| {
            Ok(Sample {
                time: rows.columns[0][row],
                mode: rows.mode(1, row)?,
                segment: rows.count(2, row)?,
                state: State::from_values(rows.part(3, row)),
                channels: Channels::from_values(rows.part(3 + State::COUNT, row)),
            })
        };
        (0..range.len()).map(sample).collect()
    }

    /// Time (s), mode and state of rows `range` of the trajectory. Fails if a state is not finite.
    pub fn states(&self, range: Range<usize>) -> Result<Vec<(f64, Mode, State)>, ResultError> {
        let mut table = schema::trajectory();
        table.variables.truncate(3 + State::COUNT);
        let rows = ReaderRows::read(self, &table, range.clone())?;
        let names: Vec<_> = State::CHANNELS.iter().map(|state| Some(state.name)).collect();
        let state = |row: usize| {
            let values = rows.part(3, row);
            self.finite(range.start + row, &names, values)?;
            Ok((rows.columns[0][row], rows.mode(1, row)?, State::from_values(values)))
        };
        (0..range.len()).map(state).collect()
    }

    /// Every event, in order of time.
    pub fn events(&self) -> Result<Vec<Event>, ResultError> {
        let table = schema::events();
        let count = self.few(&table)?;
        let mut events = Vec::with_capacity(count);
        for block in blocks(count) {
            let rows = ReaderRows::read(self, &table, block.clone())?;
            for row in 0..block.len() {
                let code = rows.columns[2][row] as i8;
                let kind = EventKind::ALL.into_iter().find(|kind| kind.code() == code);
                events.push(Event {
                    time: rows.columns[1][row],
                    kind: kind.ok_or_else(|| self.unknown("an event's kind", code))?,
                    mode_after: rows.mode(3, row)?,
                    segment: rows.count(5, row)?,
                    before: State::from_values(rows.part(6, row)),
                    after: State::from_values(rows.part(6 + State::COUNT, row)),
                    internal_force: rows.columns[6 + 2 * State::COUNT][row],
                });
            }
        }
        Ok(events)
    }

    /// A column of /events, a row for each event.
    pub fn event_column(&self, name: &str) -> Result<Vec<f64>, ResultError> {
        self.values(group::EVENTS, name, 0..self.few(&schema::events())?)
    }

    /// Every segment, in order of time.
    pub fn segments(&self) -> Result<Vec<Segment>, ResultError> {
        let table = schema::segments();
        let all = 0..self.few(&table)?;
        let rows = ReaderRows::read(self, &table, all.clone())?;
        let segment = |row: usize| {
            let code = rows.columns[4][row] as i8;
            let solver = schema::SOLVERS.iter().find(|flag| flag.0 == code);
            Ok(Segment {
                start: rows.columns[1][row],
                end: rows.columns[2][row],
                mode: rows.mode(3, row)?,
                solver: solver.ok_or_else(|| self.unknown("a segment's solver", code))?.1,
                resolved: None,
                counters: Counters {
                    steps: rows.count(5, row)?,
                    rhs_evaluations: rows.count(6, row)?,
                    jacobian_evaluations: rows.count(7, row)?,
                    linear_solver_setups: rows.count(8, row)?,
                    error_test_failures: rows.count(9, row)?,
                    nonlinear_iterations: rows.count(10, row)?,
                    nonlinear_convergence_failures: rows.count(11, row)?,
                    root_evaluations: rows.count(12, row)?,
                    last_order: rows.count(13, row)?,
                    last_step: rows.columns[14][row],
                },
            })
        };
        all.map(segment).collect()
    }

    /// Statistics of stick-slip; `None` if the run was killed before they were written.
    pub fn stick_slip(&self) -> Result<Option<StickSlipTable>, ResultError> {
        let attributes = self.attributes_of(group::STICK_SLIP)?;
        if attributes.is_empty() {
            return Ok(None);
        }
        let cycles = schema::stick_slip();
        let all = 0..self.few(&cycles)?;
        let rows = ReaderRows::read(self, &cycles, all.clone())?;
        let cycle = |row: usize| {
            let [stick_duration, slip_duration, period] = rows.part(1, row);
            Cycle {
                stick_duration,
                slip_duration,
                period,
            }
        };
        let text = |name: &str, suffix: &str| {
            let name = format!("{name}{suffix}");
            let found = attributes.iter().find(|(known, _)| *known == name);
            found.map_or_else(String::new, |(_, value)| value.to_string())
        };
        let number = |(name, value): &(String, AttributeValue)| {
            let (value, whole) = match value {
                AttributeValue::Number(value) => (*value, false),
                AttributeValue::Integer(value) => (*value as f64, true),
                _ => return None,
            };
            Some(Extra {
                name: name.clone(),
                unit: text(name, attribute::UNITS_SUFFIX),
                description: text(name, attribute::LONG_NAME_SUFFIX),
                value,
                whole,
            })
        };
        Ok(Some(StickSlipTable {
            cycles: all.map(cycle).collect(),
            attributes: attributes.iter().filter_map(number).collect(),
        }))
    }

    /// Attributes of a group added by later versions or other programs, and its one-dimensional numeric variables with
    /// up to `limit` of their first values; `None` if there is no such group.
    pub fn added_group(&self, name: &str, limit: usize) -> Result<Option<AddedGroup>, ResultError> {
        match self.source.members(name) {
            Err(ResultError {
                reason: Reason::Damaged(_),
                ..
            }) if !self.source.has(name)? => return Ok(None),
            members => members?,
        };
        let columns = self.columns_in(name)?.into_iter().map(|(column, rows)| {
            let values = self.values(name, &column.name, 0..rows.min(limit))?;
            Ok((column, rows, values))
        });
        Ok(Some(AddedGroup {
            columns: columns.collect::<Result<_, ResultError>>()?,
            attributes: self.attributes_of(name)?,
        }))
    }

    /// Groups with their numeric columns, in the order of the file; nested groups by their paths. Groups without such
    /// columns are left out.
    pub fn tables(&self) -> Result<Vec<(String, Vec<Variable>)>, ResultError> {
        let mut groups = Vec::new();
        self.source.walk(&mut |path, member| {
            if let Object::Group(_) = member.is {
                groups.push(path.to_owned());
            }
            Ok(())
        })?;
        let mut tables = Vec::new();
        for group in groups {
            let columns: Vec<Variable> = self.columns_in(&group)?.into_iter().map(|column| column.0).collect();
            if !columns.is_empty() {
                tables.push((group, columns));
            }
        }
        Ok(tables)
    }

    /// A column of [`Self::tables`] in its own type; in a partial file only the rows that are certain.
    pub fn typed_column(&self, group: &str, name: &str) -> Result<ColumnValues<'static>, ResultError> {
        if self.lacking(group, name)?.is_some() {
            let values = self.table_values(group, name, 0..self.table_rows(group)?)?;
            return Ok(ColumnValues::Float64(values.into()));
        }
        let info = self.dataset(group, name)?;
        let all = 0..match schema::tables().iter().any(|table| table.group == group) {
            true => self.table_rows(group)?,
            false => info.size(),
        };
        Ok(match info.holds {
            Holds::Integers(1) => ColumnValues::Int8(self.values(group, name, all)?.into()),
            Holds::Integers(4) => ColumnValues::Int32(self.values(group, name, all)?.into()),
            Holds::Integers(_) => ColumnValues::Int64(self.values(group, name, all)?.into()),
            _ => ColumnValues::Float64(self.values(group, name, all)?.into()),
        })
    }

    /// Numeric columns of a group, in the order of the file; none if there is no such group. A trajectory has the channels
    /// that an earlier version did not write, too.
    pub fn table(&self, group: &str) -> Result<Vec<Variable>, ResultError> {
        if !self.source.has(group)? {
            return Ok(Vec::new());
        }
        Ok(self.columns_in(group)?.into_iter().map(|column| column.0).collect())
    }

    /// The columns of a group, each with its number of rows.
    fn columns_in(&self, group: &str) -> Result<Vec<(Variable, usize)>, ResultError> {
        let mut columns = Vec::new();
        for member in self.source.members(group)? {
            let Object::Dataset(info) = member.is else { continue };
            if info.shape.len() != 1 || !info.holds.is_number() {
                continue;
            }
            let path = format!("{group}/{}", member.name);
            let described = self.source.described(&path)?;
            let kind = match (&info.holds, described.flags.is_empty()) {
                (Holds::Floats(_), _) => StorageKind::Float64,
                (_, true) => StorageKind::Int64,
                (_, false) => StorageKind::Int8,
            };
            columns.push((described.variable(member.name, kind), info.size()));
        }
        let rows = columns.first().map(|column| column.1);
        if let Some(rows) = rows.filter(|_| group == group::TRAJECTORY) {
            let [trajectory, ..] = schema::extended_tables(&self.extension()?);
            let mut place = 0;
            for variable in trajectory.variables {
                if let Some(known) = columns.iter().position(|(column, _)| column.name == variable.name) {
                    place = known + 1;
                } else if self.lacking(group, &variable.name)?.is_some() {
                    columns.insert(place, (variable, rows));
                    place += 1;
                }
            }
        }
        Ok(columns)
    }

    /// Number of rows that every column of a group's table certainly has; in a partial file some columns may have more.
    pub fn table_rows(&self, group: &str) -> Result<usize, ResultError> {
        match schema::tables().iter().find(|table| table.group == group) {
            Some(table) => self.rows(table),
            None if !self.source.has(group)? => Ok(0),
            None => Ok(self.columns_in(group)?.iter().map(|column| column.1).min().unwrap_or(0)),
        }
    }

    /// A text attribute of a group.
    pub fn group_text(&self, group: &str, name: &str) -> Result<Option<String>, ResultError> {
        self.source.text_attribute(group, name)
    }

    /// A two-dimensional table, row by row, with its shape; `None` if it does not exist.
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

    /// A text variable; `None` if it does not exist.
    pub fn text_variable(&self, group: &str, name: &str) -> Result<Option<String>, ResultError> {
        self.source.text(&format!("{group}/{name}"))
    }

    fn input(&self, name: &str) -> Result<String, ResultError> {
        self.dataset(group::INPUT, name)?;
        let text = self.source.text(&format!("{}/{name}", group::INPUT))?;
        text.ok_or_else(|| self.source.missing(format!("text in /{}/{name}", group::INPUT)))
    }

    pub(super) fn few(&self, table: &schema::TableSchema) -> Result<usize, ResultError> {
        let rows = self.rows(table)?;
        if rows > MOST_ROWS {
            return Err(self.source.refused(format!("/{} has {rows} rows", table.group)));
        }
        Ok(rows)
    }

    /// Number of rows that every column of a table has. A run killed in a flush may leave columns of different lengths,
    /// or longer than their data.
    pub(super) fn rows(&self, table: &schema::TableSchema) -> Result<usize, ResultError> {
        let mut rows = usize::MAX;
        for variable in &table.variables {
            if self.lacking(table.group, &variable.name)?.is_some() {
                continue;
            }
            let info = self.dataset(table.group, &variable.name)?;
            let mut sound = info.size().min(rows);
            if self.status == Status::Complete && rows != usize::MAX && info.size() != rows {
                let path = format!("{}/{}", table.group, variable.name);
                return Err(uneven(&path, &info.shape, &[rows]).of(self.path()));
            }
            if self.status != Status::Complete {
                let chunk = info.chunk.as_ref().and_then(|shape| shape.first().copied());
                let chunk = chunk.unwrap_or(1).max(1);
                sound = sound.min(info.chunks.unwrap_or(0).saturating_mul(chunk));
                let last = |rows: usize| self.values::<f64>(table.group, &variable.name, rows - 1..rows);
                while sound > 0 && last(sound).is_err() {
                    sound = (sound - 1) / chunk * chunk;
                }
            }
            rows = sound;
        }
        Ok(rows)
    }

    pub(super) fn values<T: StoredNumber>(
        &self,
        group: &str,
        name: &str,
        range: Range<usize>,
    ) -> Result<Vec<T>, ResultError> {
        let size = self.dataset(group, name)?.size();
        if range.end > size {
            let what = format!("row {} in /{group}/{name}, but {size} rows", range.end - 1);
            return Err(self.source.missing(what));
        }
        self.source.read_rows(&format!("{group}/{name}"), range)
    }

    fn dataset(&self, group: &str, name: &str) -> Result<DatasetInfo, ResultError> {
        let what = match self.source.dataset(&format!("{group}/{name}"))? {
            Some(info) if group != group::INPUT && (info.shape.len() != 1 || !info.holds.is_number()) => {
                let (found, shape) = (info.holds.name(), info.shape);
                format!("column of numbers /{group}/{name}, but {found} of shape {shape:?}")
            }
            Some(info) => return Ok(info),
            None if self.source.has(group)? => format!("variable /{group}/{name}"),
            None => {
                let there: Vec<String> = self.source.members("")?.into_iter().map(|member| member.name).collect();
                format!("group /{group} (there are: {})", there.join(", "))
            }
        };
        Err(self.source.missing(what))
    }

    fn attribute(&self, object: &str, name: &str) -> Result<AttributeValue, ResultError> {
        let value = self.source.attribute(object, name)?;
        value.ok_or_else(|| self.source.missing(format!("attribute {name} in /{object}")))
    }

    fn attributes_of(&self, group: &str) -> Result<Vec<(String, AttributeValue)>, ResultError> {
        self.source.attributes(group).map_err(|error| match &error.reason {
            Reason::Damaged(_) if !self.source.has(group).unwrap_or(true) => {
                self.source.missing(format!("group /{group}"))
            }
            _ => error,
        })
    }

    fn unknown(&self, what: &'static str, code: i8) -> ResultError {
        Reason::UnknownCode { what, code }.of(self.path())
    }
}

/// The first stored value of a row that is not finite, with its name.
pub(super) fn not_finite(
    stored: &[Option<&'static str>],
    values: impl IntoIterator<Item = f64>,
) -> Option<(&'static str, f64)> {
    let mut named = stored.iter().zip(values);
    named.find_map(|(name, value)| name.filter(|_| !value.is_finite()).map(|name| (name, value)))
}

struct ReaderRows<'a> {
    file: &'a ResultFile,
    table: &'a schema::TableSchema,
    first: usize,
    columns: Vec<Vec<f64>>,
}

impl<'a> ReaderRows<'a> {
    fn read(file: &'a ResultFile, table: &'a schema::TableSchema, range: Range<usize>) -> Result<Self, ResultError> {
        let column = |variable: &Variable| file.table_values(table.group, &variable.name, range.clone());
        Ok(ReaderRows {
            columns: table.variables.iter().map(column).collect::<Result<_, _>>()?,
            first: range.start,
            file,
            table,
        })
    }

    /// Values of a row in `N` columns from `first` on.
    fn part<const N: usize>(&self, first: usize, row: usize) -> [f64; N] {
        std::array::from_fn(|k| self.columns[first + k][row])
    }

    fn mode(&self, column: usize, row: usize) -> Result<Mode, ResultError> {
        let code = self.columns[column][row] as i8;
        let mode = Mode::ALL.into_iter().find(|mode| mode.code() == code);
        mode.ok_or_else(|| self.file.unknown("a mode", code))
    }

    fn count<T: TryFrom<i64>>(&self, column: usize, row: usize) -> Result<T, ResultError> {
        let value = self.columns[column][row] as i64;
        T::try_from(value).map_err(|_| {
            let (group, name) = (self.table.group, &self.table.variables[column].name);
            let row = self.first + row;
            self.file
                .source
                .missing(format!("count in row {row} of /{group}/{name}, but {value}"))
        })
    }
}

/// A group of which this version knows the name only.
#[derive(Debug, Clone, PartialEq)]
pub struct AddedGroup {
    /// Attributes in alphabetical order.
    pub attributes: Vec<(String, AttributeValue)>,
    /// Columns in the order of the file, with their numbers of rows and their first values.
    pub columns: Vec<(Variable, usize, Vec<f64>)>,
}

/// Values row by row, and numbers of rows and columns.
pub type Matrix = (Vec<f64>, [usize; 2]);

pub(super) fn blocks(rows: usize) -> impl Iterator<Item = Range<usize>> {
    (0..rows)
        .step_by(BLOCK)
        .map(move |start| start..rows.min(start + BLOCK))
}
