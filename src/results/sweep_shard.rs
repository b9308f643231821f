//! The file of a shard: some of the points of a study, with all that is needed to put the whole together.
//!
//! Its points lie in a table, whatever the study's own layout; `point` has their numbers in the study. Root attributes
//! say which shard of how many it is; the axes of a grid are in /axes.

use std::path::{Path, PathBuf};

use hdf5::{Dataset, H5Type};

use super::attributes::{MetaValue, write_text_attribute};
use super::partition::Partition;
use super::schema::{self, attribute, root};
use super::sweep_columns::write_axis;
use super::sweep_file::{SweepFile, open_checked};
use super::sweep_writer::{
    DIGEST, EVENTS, INPUT_CASE, INPUT_STUDY, POINT, POINT_STATUS, POINT_STATUSES, SweepAxis, SweepCell, SweepHeader,
    SweepLayout, SweepPlan, SweepRow, SweepVariable,
};
use super::table::create_group;
use super::{ResultError, raw};

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
/// Group with the coordinates of a grid.
const AXES_GROUP: &str = "axes";

/// Which part of a study the file of a shard holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ShardPlan {
    /// Counted from 0.
    pub shard: usize,
    pub partition: Partition,
    /// Of the file of the whole study.
    pub layout: SweepLayout,
    /// Lengths of the axes of a grid, the number of points of a table.
    pub shape: Vec<usize>,
}

/// Writes what sets the file of a shard apart.
pub(super) fn describe(
    file: &hdf5::File,
    header: &SweepHeader,
    shard: &ShardPlan,
    plan: &SweepPlan,
) -> hdf5::Result<()> {
    for (name, number) in [(SHARD, shard.shard + 1), (SHARD_COUNT, shard.partition.shards())] {
        file.new_attr::<i64>().create(name)?.write_scalar(&(number as i64))?;
    }
    let shape: Vec<i64> = shard.shape.iter().map(|&length| length as i64).collect();
    file.new_attr_builder().with_data(&shape[..]).create(SHAPE)?;
    let layout = match shard.layout {
        SweepLayout::Grid => "grid",
        SweepLayout::Table => "table",
    };
    write_text_attribute(file, LAYOUT, layout)?;
    let names: Vec<&str> = plan.axes.iter().map(|axis| axis.name.as_str()).collect();
    write_text_attribute(file, AXES, &names.join(" "))?;
    let names: Vec<&str> = plan.variables.iter().map(|variable| variable.name.as_str()).collect();
    write_text_attribute(file, VARIABLES, &names.join(" "))?;
    let names: Vec<&str> = header.meta.iter().map(|(name, _)| name.as_str()).collect();
    write_text_attribute(file, META, &names.join(" "))?;
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
    inner: SweepFile,
    /// Counted from 0.
    shard: usize,
    partition: Partition,
    layout: SweepLayout,
    shape: Vec<usize>,
}

impl ShardFile {
    /// Opens the file of a shard.
    ///
    /// # Errors
    /// A file that is not there, is none of a shard, is damaged, or is of a newer version of the program.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let inner = open_checked(path)?;
        if inner.text(root::FORMAT).as_deref() != Some(schema::SWEEP_SHARD_FORMAT) {
            return Err(ResultError::NotAShard { path: path.to_owned() });
        }
        let damaged = |what: &str| ResultError::Missing {
            path: path.to_owned(),
            what: format!("usable attribute {what}"),
        };
        let number = |name: &str| {
            let value = inner
                .file
                .attr(name)
                .and_then(|attribute| attribute.read_scalar::<i64>());
            value
                .ok()
                .and_then(|value| usize::try_from(value).ok())
                .filter(|&value| value >= 1)
                .ok_or_else(|| damaged(name))
        };
        let (shard, count) = (number(SHARD)? - 1, number(SHARD_COUNT)?);
        let shape = inner.file.attr(SHAPE).and_then(|attribute| attribute.read_raw::<i64>());
        let shape: Vec<usize> = shape
            .map_err(|_| damaged(SHAPE))?
            .into_iter()
            .filter_map(|length| usize::try_from(length).ok().filter(|&length| length >= 1))
            .collect();
        let layout = match inner.text(LAYOUT).as_deref() {
            Some("grid") => SweepLayout::Grid,
            Some("table") => SweepLayout::Table,
            _ => return Err(damaged(LAYOUT)),
        };
        if shape.is_empty() || shard >= count {
            return Err(damaged(SHAPE));
        }
        Ok(ShardFile {
            inner,
            shard,
            partition: Partition::new(&shape, count),
            layout,
            shape,
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
    pub fn partition(&self) -> &Partition {
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
    pub fn event_count(&self) -> Result<usize, ResultError> {
        if !self.keeps_events() {
            return Ok(0);
        }
        Ok(self.inner.shape(&format!("{}/{POINT}", EVENTS.0))?[0])
    }

    fn keeps_events(&self) -> bool {
        self.inner.file.group(EVENTS.0).is_ok()
    }

    /// What it says about its study.
    pub(super) fn header(&self) -> Result<SweepHeader, ResultError> {
        let text = |name: &str| self.inner.text(name).ok_or_else(|| self.inner.missing(name));
        let input = |name: &str| {
            let name = format!("{}/{name}", schema::group::INPUT);
            let dataset = self.inner.file.dataset(&name).map_err(|_| self.inner.missing(&name))?;
            let found = raw::read_text(&dataset).map_err(|error| ResultError::read(self.path(), &error))?;
            found.ok_or_else(|| self.inner.missing(&name))
        };
        let mut meta = Vec::new();
        for name in text(META)?.split_whitespace() {
            let path = format!("{}/{name}", schema::group::META);
            let number = || {
                let group = self.inner.file.group(schema::group::META).ok()?;
                group.attr(name).ok()?.read_scalar::<f64>().ok()
            };
            let value = match self.inner.text(&path) {
                Some(text) => MetaValue::Text(text),
                None => MetaValue::Number(number().ok_or_else(|| self.inner.missing(&path))?),
            };
            meta.push((name.to_owned(), value));
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
            Ok(text.split_whitespace().map(str::to_owned).collect())
        };
        let mut axes = Vec::new();
        for name in names(AXES)? {
            let attribute = |what: &str| self.inner.attribute(&name, what).unwrap_or_default();
            let words = attribute(attribute::FLAG_MEANINGS);
            axes.push(SweepAxis {
                keys: attribute("keys"),
                units: attribute(attribute::UNITS),
                long_name: attribute(attribute::LONG_NAME),
                words: words.split_whitespace().map(str::to_owned).collect(),
                values: match self.layout {
                    SweepLayout::Grid => self.inner.numbers(&format!("{AXES_GROUP}/{name}"))?,
                    SweepLayout::Table => Vec::new(),
                },
                name,
            });
        }
        let mut variables = Vec::new();
        for name in names(VARIABLES)? {
            let attribute = |what: &str| self.inner.attribute(&name, what).unwrap_or_default();
            let dataset = self.inner.file.dataset(&name).map_err(|_| self.inner.missing(&name))?;
            let fill = dataset.attr("_FillValue").and_then(|fill| fill.read_raw::<i64>());
            variables.push(SweepVariable {
                units: attribute(attribute::UNITS),
                long_name: attribute(attribute::LONG_NAME),
                count_fill: fill.ok().and_then(|fill| fill.first().copied()),
                name,
            });
        }
        Ok(SweepPlan {
            layout: self.layout,
            axes,
            variables,
            points: self.shape.iter().product(),
            keep_events: self.keeps_events(),
            shard: None,
        })
    }

    /// Its points one by one, in the order of their numbers.
    pub(super) fn rows(&self, plan: &SweepPlan) -> Result<ShardRows, ResultError> {
        let path = self.path().to_owned();
        let axes: &[SweepAxis] = match self.layout {
            SweepLayout::Grid => &[],
            SweepLayout::Table => &plan.axes,
        };
        let mut events = None;
        if plan.keep_events {
            let name = |name: &str| format!("{}/{name}", EVENTS.0);
            events = Some(EventRows {
                point: self.column(&name(POINT))?,
                time: self.column(&name("time"))?,
                kind: self.column(&name("kind"))?,
                mode_after: self.column(&name("mode_after"))?,
                relative_velocity: self.column(&name("relative_velocity"))?,
                internal_force: self.column(&name("internal_force"))?,
                next: 0,
            });
        }
        Ok(ShardRows {
            number: self.column(POINT)?,
            status: self.column(POINT_STATUS)?,
            coordinates: axes
                .iter()
                .map(|axis| self.column(&axis.name))
                .collect::<Result<_, _>>()?,
            values: plan
                .variables
                .iter()
                .map(|variable| Ok((self.column(&variable.name)?, variable.count_fill)))
                .collect::<Result<_, ResultError>>()?,
            failures: self.failures()?.into_iter().rev().collect(),
            events,
            next: 0,
            path,
        })
    }

    fn column<T: H5Type + Copy>(&self, name: &str) -> Result<Blocks<T>, ResultError> {
        let dataset = self.inner.file.dataset(name).map_err(|_| self.inner.missing(name))?;
        Ok(Blocks {
            length: dataset.size(),
            dataset,
            start: 0,
            rows: Vec::new(),
        })
    }
}

/// Rows that are read at a time.
const BLOCK: usize = 4096;

/// A column, read in blocks from its beginning on.
struct Blocks<T> {
    dataset: Dataset,
    length: usize,
    start: usize,
    rows: Vec<T>,
}

impl<T: H5Type + Copy> Blocks<T> {
    /// The value of a row at or after the last that was asked for; `None` beyond the end.
    fn at(&mut self, row: usize) -> hdf5::Result<Option<T>> {
        if row >= self.length {
            return Ok(None);
        }
        if row >= self.start + self.rows.len() {
            self.start = row;
            let end = (row + BLOCK).min(self.length);
            self.rows = self.dataset.read_slice_1d(row..end)?.to_vec();
        }
        Ok(self.rows.get(row - self.start).copied())
    }
}

/// The points of a shard, one by one.
pub(super) struct ShardRows {
    path: PathBuf,
    number: Blocks<i64>,
    status: Blocks<i8>,
    coordinates: Vec<Blocks<f64>>,
    /// With what stands for nothing in a count.
    values: Vec<(Blocks<f64>, Option<i64>)>,
    /// The last first.
    failures: Vec<(u64, String)>,
    events: Option<EventRows>,
    next: usize,
}

struct EventRows {
    point: Blocks<i64>,
    time: Blocks<f64>,
    kind: Blocks<i8>,
    mode_after: Blocks<i8>,
    relative_velocity: Blocks<f64>,
    internal_force: Blocks<f64>,
    next: usize,
}

impl EventRows {
    fn of_point(&mut self, number: i64) -> hdf5::Result<Vec<SweepCell>> {
        let mut cells = Vec::new();
        let short = "columns of different lengths";
        while self.point.at(self.next)? == Some(number) {
            let row = self.next;
            cells.push((
                self.time.at(row)?.ok_or(short)?,
                self.kind.at(row)?.ok_or(short)?,
                self.mode_after.at(row)?.ok_or(short)?,
                self.relative_velocity.at(row)?.ok_or(short)?,
                self.internal_force.at(row)?.ok_or(short)?,
            ));
            self.next += 1;
        }
        Ok(cells)
    }
}

impl ShardRows {
    /// The next point, which has to be the one of this number.
    pub(super) fn next(&mut self, number: u64) -> Result<SweepRow, ResultError> {
        let row = self
            .read(number)
            .map_err(|error| ResultError::read(&self.path, &error))?;
        self.next += 1;
        row.ok_or_else(|| ResultError::Missing {
            path: self.path.clone(),
            what: format!("point {number} where it belongs"),
        })
    }

    fn read(&mut self, number: u64) -> hdf5::Result<Option<SweepRow>> {
        let at = self.next;
        let expected = i64::try_from(number).unwrap_or(i64::MAX);
        let (Some(found), Some(status)) = (self.number.at(at)?, self.status.at(at)?) else {
            return Ok(None);
        };
        if found != expected || status == POINT_STATUSES[2].0 {
            return Ok(None);
        }
        let short = "columns of different lengths";
        let mut row = SweepRow {
            number,
            ..SweepRow::default()
        };
        for column in &mut self.coordinates {
            row.coordinates.push(column.at(at)?.ok_or(short)?);
        }
        if status == POINT_STATUSES[0].0 {
            let mut values = Vec::with_capacity(self.values.len());
            for (column, fill) in &mut self.values {
                let value = column.at(at)?.ok_or(short)?;
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
            row.events = events.of_point(expected)?;
        }
        Ok(Some(row))
    }
}
