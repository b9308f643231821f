//! The file of a shard: some of the points of a study, with all that is needed to put the whole together.
//!
//! Its points lie in a table, whatever the study's own layout; `point` has their numbers in the study. Root attributes
//! say which shard of how many it is; the axes of a grid are in /axes.

use std::path::Path;
use std::sync::Arc;

use super::columns::write_axis;
use super::file::SweepFile;
use super::partition::Partition;
use super::schema::{
    DIGEST, EVENTS, EventForm, INPUT_CASE, INPUT_STUDY, POINT, POINT_STATUS, POINT_STATUSES, ShardPlan, SweepAxis,
    SweepCell, SweepHeader, SweepLayout, SweepPlan, SweepRow,
};
use crate::results::attributes::{AttributeValue, write_attribute};
use crate::results::schema::{self, Kind, root};
use crate::results::source::Source;
use crate::results::table::create_group;
use crate::results::{Reason, ResultError};

/// Root attributes: which shard, counted from 1, and of how many.
const SHARD: &str = "shard";
const SHARD_COUNT: &str = "shard_count";
/// Root attribute: the axes' lengths in a grid, the number of points in a table.
const SHAPE: &str = "study_shape";
/// Root attribute: "grid" or "table", of the whole.
const LAYOUT: &str = "study_layout";
/// Root attributes: the names of axes and of variables, in order, separated by blanks.
const AXES: &str = "study_axes";
const VARIABLES: &str = "study_variables";
/// Root attribute: the names of the attributes of /meta, in order.
const META: &str = "study_meta";
/// Most points of a study, and most axes or variables of a point: far more than anyone computes.
const POINTS: usize = 1 << 40;
/// Most shards of a study.
const SHARDS: usize = 1 << 20;
const NAMES: usize = 4096;
/// Group with the coordinates of a grid.
const AXES_GROUP: &str = "axes";

/// Writes what sets the file of a shard apart.
pub(super) fn describe(
    file: &hdf5::File,
    header: &SweepHeader,
    shard: &ShardPlan,
    plan: &SweepPlan,
) -> hdf5::Result<()> {
    for (name, number) in [(SHARD, shard.shard + 1), (SHARD_COUNT, shard.partition.shards())] {
        write_attribute(file, name, number as i64)?;
    }
    let shape: Vec<i64> = shard.partition.shape().iter().map(|&length| length as i64).collect();
    write_attribute(file, SHAPE, shape)?;
    let layout = match shard.layout {
        SweepLayout::Grid => "grid",
        SweepLayout::Table => "table",
    };
    write_attribute(file, LAYOUT, layout)?;
    let names: Vec<&str> = plan.axes.iter().map(|axis| axis.variable.name.as_str()).collect();
    write_attribute(file, AXES, names.join(" "))?;
    let names: Vec<&str> = plan.variables.iter().map(|variable| variable.name.as_str()).collect();
    write_attribute(file, VARIABLES, names.join(" "))?;
    let names: Vec<&str> = header.meta.iter().map(|(name, _)| name.as_str()).collect();
    write_attribute(file, META, names.join(" "))?;
    if shard.layout == SweepLayout::Grid {
        let group = create_group(file, AXES_GROUP)?;
        for axis in &plan.axes {
            write_axis(&group, axis)?;
        }
    }
    Ok(())
}

/// The file of a shard, open for reading.
#[derive(Debug)]
pub(crate) struct ShardFile {
    inner: Arc<SweepFile>,
    /// Counted from 0.
    shard: usize,
    partition: Partition,
    layout: SweepLayout,
}

impl ShardFile {
    /// Opens the file of a shard.
    ///
    /// # Errors
    /// A file that is not there, is none of a shard, is damaged, or is of a newer version of the program.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let source = Source::open_known(path)?;
        let inner = SweepFile { source };
        if inner.text(root::FORMAT).as_deref() != Some(schema::SWEEP_SHARD_FORMAT) {
            return Err(Reason::NotAShard.of(path));
        }
        let damaged = |what: &str| Reason::Missing(format!("usable attribute {what}")).of(path);
        let positive = |value: i64| usize::try_from(value).ok().filter(|&value| value >= 1);
        let number = |name: &str| match inner.source.attribute("", name)? {
            Some(AttributeValue::Integer(value)) => positive(value).ok_or_else(|| damaged(name)),
            _ => Err(damaged(name)),
        };
        let (shard, count) = (number(SHARD)? - 1, number(SHARD_COUNT)?);
        let shape: Option<Vec<usize>> = match inner.source.attribute("", SHAPE)? {
            Some(AttributeValue::Integers(lengths)) => lengths.into_iter().map(positive).collect(),
            _ => None,
        };
        let shape = shape.ok_or_else(|| damaged(SHAPE))?;
        let layout = match inner.text(LAYOUT).as_deref() {
            Some("grid") => SweepLayout::Grid,
            Some("table") => SweepLayout::Table,
            _ => return Err(damaged(LAYOUT)),
        };
        let points = shape
            .iter()
            .try_fold(1_usize, |points, &length| points.checked_mul(length));
        if shape.is_empty() || points.is_none_or(|points| points > POINTS) {
            return Err(damaged(SHAPE));
        }
        if shard >= count || count > SHARDS || points.is_none_or(|points| count > points) {
            return Err(damaged(SHARD_COUNT));
        }
        let partition = Partition::new(&shape, count);
        let (rows, expected) = (inner.shape(POINT)?, partition.size(shard));
        if rows != [expected] {
            let what = format!("column {POINT} of {expected} points, but one of shape {rows:?}");
            return Err(Reason::Missing(what).of(path));
        }
        Ok(ShardFile {
            inner: Arc::new(inner),
            shard,
            partition,
            layout,
        })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.inner.path()
    }

    /// Which shard, counted from 0.
    pub fn shard(&self) -> usize {
        self.shard
    }

    /// How the points of its study are dealt out.
    pub(crate) fn partition(&self) -> &Partition {
        &self.partition
    }

    /// The digest of its study.
    pub fn digest(&self) -> Option<String> {
        self.inner.digest()
    }

    /// The points that failed, each with its message.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn failures(&self) -> Result<Vec<(u64, String)>, ResultError> {
        self.inner.failures()
    }

    /// How many of its points are done, whether they failed or not.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn done(&self) -> Result<usize, ResultError> {
        let missing = f64::from(POINT_STATUSES[2].0);
        let status = self.inner.numbers(POINT_STATUS)?;
        Ok(status.iter().filter(|&&status| status != missing).count())
    }

    /// How many events it holds.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(crate) fn event_count(&self) -> Result<usize, ResultError> {
        if !self.keeps_events()? {
            return Ok(0);
        }
        match self.inner.shape(&format!("{}/{POINT}", EVENTS.0))?[..] {
            [events] => Ok(events),
            _ => Err(self.inner.missing(&format!("{}/{POINT} of one dimension", EVENTS.0))),
        }
    }

    fn keeps_events(&self) -> Result<bool, ResultError> {
        let members = self.inner.source.members("")?;
        Ok(members.iter().any(|member| member.name == EVENTS.0))
    }

    /// In what words its events are, if it keeps them.
    fn event_form(&self) -> Result<Option<EventForm>, ResultError> {
        if !self.keeps_events()? {
            return Ok(None);
        }
        let motion = match self.inner.source.attribute(schema::group::META, schema::META_MOTION)? {
            Some(AttributeValue::Text(motion)) => Some(motion),
            _ => None,
        };
        Ok(Some(EventForm {
            numbers_parts: motion.is_some(),
            translation: motion.as_deref() == Some(schema::TRANSLATION),
        }))
    }

    /// What it says about its study.
    pub(super) fn header(&self) -> Result<SweepHeader, ResultError> {
        let text = |name: &str| self.inner.text(name).ok_or_else(|| self.inner.missing(name));
        let input = |name: &str| {
            let name = format!("{}/{name}", schema::group::INPUT);
            self.inner.dataset(&name)?;
            self.inner.source.text(&name)?.ok_or_else(|| self.inner.missing(&name))
        };
        let mut meta = Vec::new();
        for name in text(META)?.split_whitespace() {
            let value = self.inner.source.attribute(schema::group::META, name)?;
            let missing = || self.inner.missing(&format!("{}/{name}", schema::group::META));
            meta.push((name.to_owned(), value.ok_or_else(missing)?));
        }
        Ok(SweepHeader {
            title: text(root::TITLE)?,
            source: text(root::SOURCE)?,
            references: text(root::REFERENCES)?,
            history: text(root::HISTORY)?,
            digest: text(DIGEST)?,
            study_text: input(INPUT_STUDY)?,
            case_text: input(INPUT_CASE)?,
            meta,
        })
    }

    /// What the file of the whole study holds.
    pub(super) fn plan(&self) -> Result<SweepPlan, ResultError> {
        let names = |list: &str| -> Result<Vec<String>, ResultError> {
            let text = self.inner.text(list).ok_or_else(|| self.inner.missing(list))?;
            let names: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
            if names.is_empty() || names.len() > NAMES {
                let what = format!("usable attribute {list}: 1 to {NAMES} names");
                return Err(Reason::Missing(what).of(self.path()));
            }
            Ok(names)
        };
        let mut axes = Vec::new();
        for name in names(AXES)? {
            let described = self.inner.source.described(&name).unwrap_or_default();
            axes.push(SweepAxis {
                keys: self.inner.attribute(&name, "keys").unwrap_or_default(),
                values: match self.layout {
                    SweepLayout::Grid => self.inner.numbers(&format!("{AXES_GROUP}/{name}"))?,
                    SweepLayout::Table => Vec::new(),
                },
                variable: match described.flags.is_empty() {
                    true => described.variable(name, Kind::Float64),
                    false => described.variable(name, Kind::Int32),
                },
            });
        }
        let mut variables = Vec::new();
        for name in names(VARIABLES)? {
            self.inner.dataset(&name)?;
            let described = self.inner.source.described(&name)?;
            variables.push(match described.count_fill() {
                Some(_) => described.variable(name, Kind::Int64),
                None => described.variable(name, Kind::Float64),
            });
        }
        let shape = self.partition.shape();
        let fits = match self.layout {
            SweepLayout::Grid => axes.iter().map(|axis| axis.values.len()).eq(shape.iter().copied()),
            SweepLayout::Table => shape.len() == 1,
        };
        if !fits {
            let what = format!("usable attribute {SHAPE}: it is {shape:?}");
            return Err(Reason::Missing(what).of(self.path()));
        }
        Ok(SweepPlan {
            layout: self.layout,
            axes,
            variables,
            points: self.partition.points(),
            events: self.event_form()?,
            shard: None,
        })
    }

    /// Its points one by one, in the order of their numbers.
    pub(super) fn rows(&self, plan: &SweepPlan) -> Result<ShardRows, ResultError> {
        let axes: &[SweepAxis] = match self.layout {
            SweepLayout::Grid => &[],
            SweepLayout::Table => &plan.axes,
        };
        let mut events = None;
        if plan.events.is_some() {
            let number = |name: &str| self.column(&format!("{}/{name}", EVENTS.0));
            let names = ["time", "kind", "mode_after", "relative_velocity", "internal_force"];
            events = Some(EventRows {
                point: self.column(&format!("{}/{POINT}", EVENTS.0))?,
                columns: names.into_iter().map(number).collect::<Result<_, _>>()?,
                next: 0,
            });
        }
        Ok(ShardRows {
            number: self.column(POINT)?,
            status: self.column(POINT_STATUS)?,
            coordinates: axes
                .iter()
                .map(|axis| self.column(&axis.variable.name))
                .collect::<Result<_, _>>()?,
            values: plan
                .variables
                .iter()
                .map(|variable| Ok((self.column(&variable.name)?, variable.fill)))
                .collect::<Result<_, ResultError>>()?,
            failures: self.failures()?.into_iter().rev().collect(),
            events,
            next: 0,
            file: Arc::clone(&self.inner),
        })
    }

    fn column(&self, name: &str) -> Result<Blocks, ResultError> {
        let info = self.inner.dataset(name)?;
        let ([length], true) = (&info.shape[..], info.holds.is_number()) else {
            return Err(self.inner.missing(&format!("{name} that is a column of numbers")));
        };
        Ok(Blocks {
            length: *length,
            file: Arc::clone(&self.inner),
            name: name.to_owned(),
            start: 0,
            rows: Vec::new(),
        })
    }
}

/// Rows that are read at a time.
const BLOCK: usize = 4096;

/// A column, read in blocks from its beginning on.
struct Blocks {
    file: Arc<SweepFile>,
    name: String,
    length: usize,
    start: usize,
    rows: Vec<f64>,
}

impl Blocks {
    /// The value of a row at or after the last that was asked for; `None` beyond the end.
    fn at(&mut self, row: usize) -> Result<Option<f64>, ResultError> {
        if row >= self.length {
            return Ok(None);
        }
        if row >= self.start + self.rows.len() {
            self.start = row;
            let end = (row + BLOCK).min(self.length);
            self.rows = self.file.source.read_rows(&self.name, row..end)?;
        }
        Ok(self.rows.get(row - self.start).copied())
    }

    /// The value of a row that the other columns have.
    fn value(&mut self, row: usize) -> Result<f64, ResultError> {
        self.at(row)?.ok_or_else(|| {
            self.file
                .missing(&format!("{} with a row {row}, as its neighbours have", self.name))
        })
    }
}

/// The points of a shard, one by one.
pub(super) struct ShardRows {
    file: Arc<SweepFile>,
    number: Blocks,
    status: Blocks,
    coordinates: Vec<Blocks>,
    /// With what stands for nothing in a count.
    values: Vec<(Blocks, Option<i64>)>,
    /// The last first.
    failures: Vec<(u64, String)>,
    events: Option<EventRows>,
    next: usize,
}

struct EventRows {
    point: Blocks,
    /// Those of [`SweepCell`].
    columns: Vec<Blocks>,
    next: usize,
}

impl EventRows {
    fn of_point(&mut self, number: u64) -> Result<Vec<SweepCell>, ResultError> {
        let mut cells = Vec::new();
        while self.point.at(self.next)? == Some(number as f64) {
            let mut row = [0.0; 5];
            for (value, column) in row.iter_mut().zip(&mut self.columns) {
                *value = column.value(self.next)?;
            }
            cells.push(row);
            self.next += 1;
        }
        Ok(cells)
    }
}

impl ShardRows {
    /// The next point, which has to be the one of this number.
    pub(super) fn next(&mut self, number: u64) -> Result<SweepRow, ResultError> {
        let row = self.read(number)?;
        self.next += 1;
        row.ok_or_else(|| Reason::Missing(format!("point {number} where it belongs")).of(self.file.path()))
    }

    fn read(&mut self, number: u64) -> Result<Option<SweepRow>, ResultError> {
        let at = self.next;
        let (Some(found), Some(status)) = (self.number.at(at)?, self.status.at(at)?) else {
            return Ok(None);
        };
        let [complete, _, missing] = POINT_STATUSES.map(|status| f64::from(status.0));
        if found != number as f64 || status == missing {
            return Ok(None);
        }
        let mut row = SweepRow {
            number,
            ..SweepRow::default()
        };
        for column in &mut self.coordinates {
            row.coordinates.push(column.value(at)?);
        }
        if status == complete {
            let mut values = Vec::with_capacity(self.values.len());
            for (column, fill) in &mut self.values {
                let value = column.value(at)?;
                let nothing = fill.is_some_and(|fill| value == fill as f64);
                values.push(if nothing { f64::NAN } else { value });
            }
            row.values = Some(values);
        } else {
            match self.failures.pop() {
                Some((point, message)) if point == number => row.failure = Some(message),
                _ => return Ok(None),
            }
        }
        if let Some(events) = &mut self.events {
            row.events = events.of_point(number)?;
        }
        Ok(Some(row))
    }
}
