//! File of a shard: some points of a study, with all data that the merge needs.
//!
//! The points form a table, whatever the study's layout. `point` holds their numbers in the study. Root attributes
//! name the shard and the number of shards. The axes of a grid are in /axes.

use std::path::Path;
use std::sync::Arc;

use super::writer::write_axis;
use super::{
    AXES_GROUP, EVENTS, EventForm, POINT, POINT_STATUS, POINT_STATUSES, Partition, ShardPlan, SweepAxis, SweepEvent,
    SweepLayout, SweepPlan, SweepRow,
};
use crate::attributes::{AttributeValue, write_attribute};
use crate::schema::{self, INPUT_CASE, StorageKind, root};
use crate::study::{DIGEST, INPUT_STUDY, StudyFile, StudyHeader};
use crate::table::create_group;
use crate::{Reason, ResultError};

/// Root attributes: number of the shard (from 1), and number of shards.
const SHARD: &str = "shard";
const SHARD_COUNT: &str = "shard_count";
/// Root attribute: axis lengths of a grid, or number of points of a table.
const SHAPE: &str = "study_shape";
/// Root attribute: layout of the study, "grid" or "table".
const LAYOUT: &str = "study_layout";
/// Root attributes: names of axes and of variables, in order, separated by blanks.
const AXES: &str = "study_axes";
const VARIABLES: &str = "study_variables";
/// Root attribute: names of the attributes of /meta, in order.
const META: &str = "study_meta";
/// Limits of a study, far beyond any real one: points; shards; axes, or variables of a point.
const POINTS: usize = 1 << 40;
const SHARDS: usize = 1 << 20;
const NAMES: usize = 4096;

pub(super) fn describe(
    file: &hdf5::File,
    header: &StudyHeader,
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
    let axes = plan.axes.iter().map(|axis| &axis.variable.name);
    let variables = plan.variables.iter().map(|variable| &variable.name);
    let meta = header.meta.iter().map(|(name, _)| name);
    for (name, names) in [
        (AXES, Vec::from_iter(axes)),
        (VARIABLES, variables.collect()),
        (META, meta.collect()),
    ] {
        let names: Vec<&str> = names.into_iter().map(String::as_str).collect();
        write_attribute(file, name, names.join(" "))?;
    }
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
pub struct ShardFile {
    inner: Arc<StudyFile>,
    shard: usize,
    partition: Partition,
    layout: SweepLayout,
}

impl ShardFile {
    /// Opens the file of a shard. Fails if it is missing, of another kind, damaged, or of a newer version.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let inner = StudyFile::open(path, schema::SWEEP_SHARD_FORMAT)?;
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
        let layout = match inner.text(LAYOUT)?.as_deref() {
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

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.inner.path()
    }

    pub(super) fn close(&self) {
        self.inner.source.close();
    }

    /// Index of the shard, from 0.
    pub fn shard(&self) -> usize {
        self.shard
    }

    /// Distribution of the study's points among its shards.
    pub fn partition(&self) -> &Partition {
        &self.partition
    }

    /// Digest of the study. Fails if it is unreadable.
    pub fn digest(&self) -> Result<Option<String>, ResultError> {
        self.inner.digest()
    }

    /// Failed points with their messages. Fails if they are unreadable.
    pub fn failures(&self) -> Result<Vec<(u64, String)>, ResultError> {
        self.inner.failures()
    }

    /// Number of finished points, including failed ones. Fails if it is unreadable.
    pub fn done(&self) -> Result<usize, ResultError> {
        let missing = f64::from(POINT_STATUSES[2].0);
        let status = self.inner.numbers(POINT_STATUS)?;
        Ok(status.iter().filter(|&&status| status != missing).count())
    }

    fn event_form(&self) -> Result<Option<EventForm>, ResultError> {
        if !self.inner.source.has(EVENTS.0)? {
            return Ok(None);
        }
        let motion = self
            .inner
            .source
            .text_attribute(schema::group::META, schema::META_MOTION)?;
        Ok(Some(EventForm {
            numbers_parts: motion.is_some(),
            translation: motion.as_deref() == Some(schema::TRANSLATION),
        }))
    }

    pub(super) fn header(&self) -> Result<StudyHeader, ResultError> {
        let text = |name: &str| self.inner.text(name)?.ok_or_else(|| self.inner.missing(name));
        let missing = |name: &str| self.inner.missing(&format!("{}/{name}", schema::group::INPUT));
        let input = |name: &str| self.inner.input(name)?.ok_or_else(|| missing(name));
        let mut meta = Vec::new();
        for name in text(META)?.split_whitespace() {
            let value = self.inner.source.attribute(schema::group::META, name)?;
            let missing = || self.inner.missing(&format!("{}/{name}", schema::group::META));
            meta.push((name.to_owned(), value.ok_or_else(missing)?));
        }
        Ok(StudyHeader {
            title: text(root::TITLE)?,
            source: text(root::SOURCE)?,
            references: Some(text(root::REFERENCES)?),
            digest: text(DIGEST)?,
            history: text(root::HISTORY)?,
            study: input(INPUT_STUDY)?,
            inputs: vec![StudyHeader::case_of_sweep(input(INPUT_CASE)?)],
            changed: self.inner.changed(),
            meta,
        })
    }

    pub(super) fn plan(&self) -> Result<SweepPlan, ResultError> {
        let names = |list: &str| -> Result<Vec<String>, ResultError> {
            let text = self.inner.text(list)?.ok_or_else(|| self.inner.missing(list))?;
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
                keys: self.inner.text(&format!("{name}/keys"))?.unwrap_or_default(),
                values: match self.layout {
                    SweepLayout::Grid => self.inner.numbers(&format!("{AXES_GROUP}/{name}"))?,
                    SweepLayout::Table => Vec::new(),
                },
                variable: match described.flags.is_empty() {
                    true => described.variable(name, StorageKind::Float64),
                    false => described.variable(name, StorageKind::Int32),
                },
            });
        }
        let mut variables = Vec::new();
        for name in names(VARIABLES)? {
            self.inner.dataset(&name)?;
            let described = self.inner.source.described(&name)?;
            let kind = described
                .count_fill()
                .map_or(StorageKind::Float64, |_| StorageKind::Int64);
            variables.push(described.variable(name, kind));
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

    pub(super) fn rows(&self, plan: &SweepPlan) -> Result<ShardRows, ResultError> {
        let is_table = self.layout == SweepLayout::Table;
        let axes = plan.axes.iter().filter(|_| is_table);
        let coordinates = axes
            .map(|axis| self.column(&axis.variable.name))
            .collect::<Result<_, _>>()?;
        let values = plan.variables.iter();
        let values = values.map(|variable| Ok((self.column(&variable.name)?, variable.fill)));
        let names = [
            POINT,
            "time",
            "kind",
            "mode_after",
            "relative_velocity",
            "internal_force",
        ];
        let events = names.into_iter().filter(|_| plan.events.is_some());
        let events = events.map(|name| self.column(&format!("{}/{name}", EVENTS.0)));
        Ok(ShardRows {
            number: self.column(POINT)?,
            status: self.column(POINT_STATUS)?,
            coordinates,
            values: values.collect::<Result<_, ResultError>>()?,
            failures: self.failures()?.into_iter().rev().collect(),
            events: events.collect::<Result<_, _>>()?,
            next: 0,
            next_event: 0,
            file: Arc::clone(&self.inner),
        })
    }

    fn column(&self, name: &str) -> Result<ColumnBlocks, ResultError> {
        let info = self.inner.dataset(name)?;
        let ([length], true) = (&info.shape[..], info.holds.is_number()) else {
            return Err(self.inner.missing(&format!("{name} that is a column of numbers")));
        };
        Ok(ColumnBlocks {
            length: *length,
            file: Arc::clone(&self.inner),
            name: name.to_owned(),
            start: 0,
            rows: Vec::new(),
        })
    }
}

const BLOCK: usize = 4096;

struct ColumnBlocks {
    file: Arc<StudyFile>,
    name: String,
    length: usize,
    start: usize,
    rows: Vec<f64>,
}

impl ColumnBlocks {
    /// Value of a row, which must not lie before the last one read; `None` beyond the end.
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

    fn value(&mut self, row: usize) -> Result<f64, ResultError> {
        self.at(row)?.ok_or_else(|| {
            self.file
                .missing(&format!("{} with a row {row}, as its neighbours have", self.name))
        })
    }
}

pub(super) struct ShardRows {
    file: Arc<StudyFile>,
    number: ColumnBlocks,
    status: ColumnBlocks,
    coordinates: Vec<ColumnBlocks>,
    values: Vec<(ColumnBlocks, Option<i64>)>,
    /// In reverse order.
    failures: Vec<(u64, String)>,
    /// Number of the point, and the five numbers of an event; empty if events are not kept.
    events: Vec<ColumnBlocks>,
    next: usize,
    next_event: usize,
}

impl ShardRows {
    /// Reads the next point, which must have this number, and closes the file.
    pub(super) fn next(&mut self, number: u64) -> Result<SweepRow, ResultError> {
        let row = self.read(number)?;
        self.file.source.close();
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
        if let [point, columns @ ..] = &mut self.events[..] {
            while point.at(self.next_event)? == Some(number as f64) {
                let mut event: SweepEvent = [0.0; 5];
                for (value, column) in event.iter_mut().zip(&mut *columns) {
                    *value = column.value(self.next_event)?;
                }
                row.events.push(event);
                self.next_event += 1;
            }
        }
        Ok(Some(row))
    }
}
