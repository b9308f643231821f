//! The datasets of a sweep file: the columns of its points, its events, and further tables.

use hdf5::{Dataset, Group, H5Type, Hyperslab, Selection, SliceOrIndex};
use ndarray::{ArrayViewD, IxDyn};

use super::schema::{
    BLOCK, Column, ColumnData, FAILURES, POINT, POINT_STATUS, POINT_STATUSES, SweepAxis, SweepLayout, SweepPlan,
    SweepRow,
};
use super::storage::{Rows, Storage, Stored};
use crate::results::attributes::{describe, write_codes, write_text_attribute};
use crate::results::checksums::{Known, Summed, Sums};
use crate::results::raw;
use crate::results::schema::{Kind, Table, attribute};
use crate::results::table::{Cell, DEFLATE_LEVEL, TableWriter, create_group};

/// The datasets of the points with what is buffered for them.
pub(super) struct Columns {
    shape: Vec<usize>,
    /// Points in a block: whole indices of the first dimension.
    block: usize,
    written: usize,
    status: (Dataset, Vec<i8>),
    coordinates: Vec<(Dataset, Vec<f64>, bool)>,
    numbers: Option<(Dataset, Vec<i64>)>,
    values: Vec<(Dataset, Buffer)>,
    failures: Vec<(i64, String)>,
    events: Option<TableWriter>,
    /// Of the values in the file, but those of the events.
    sums: Sums,
}

enum Buffer {
    Counts(Vec<i64>, i64),
    Numbers(Vec<f64>),
}

impl Columns {
    pub(super) fn create(file: &hdf5::File, plan: &SweepPlan, storage: Storage) -> hdf5::Result<Self> {
        let &SweepPlan {
            layout,
            ref axes,
            ref variables,
            points,
            events,
            shard: _,
        } = plan;
        let mut scales = Vec::new();
        let mut numbers = None;
        let shape = match layout {
            SweepLayout::Grid => {
                for axis in axes {
                    scales.push(write_axis(file, axis)?);
                }
                axes.iter().map(|axis| axis.values.len()).collect()
            }
            SweepLayout::Table => {
                let dataset = create::<i64>(file, POINT, &[points], "1", "number of the point", Storage::Own)?;
                raw::set_scale(&dataset, POINT)?;
                if storage.is_own() {
                    numbers = Some((dataset.clone(), Vec::new()));
                } else {
                    dataset.write(&(0..points as i64).collect::<Vec<_>>())?;
                }
                scales.push(dataset);
                vec![points]
            }
        };
        let attach = |dataset: &Dataset| {
            (0..)
                .zip(&scales)
                .try_for_each(|(index, scale)| raw::attach_scale(dataset, scale, index))
        };
        let mut coordinates = Vec::new();
        if layout == SweepLayout::Table {
            for axis in axes {
                let dataset = create_axis(file, axis, points, storage)?;
                attach(&dataset)?;
                coordinates.push((dataset, Vec::new(), !axis.words.is_empty()));
            }
        }
        let status = create::<i8>(file, POINT_STATUS, &shape, "1", "what came of the point", storage)?;
        write_codes(&status, POINT_STATUSES)?;
        attach(&status)?;
        let mut values = Vec::with_capacity(variables.len());
        for variable in variables {
            let (name, units, long_name) = (&variable.name, &variable.units, &variable.long_name);
            let (dataset, buffer) = match variable.count_fill {
                Some(fill) => {
                    let dataset = create::<i64>(file, name, &shape, units, long_name, storage)?;
                    dataset
                        .new_attr_builder()
                        .with_data(&[fill])
                        .create(attribute::FILL_VALUE)?;
                    if !variable.flags.is_empty() {
                        let flags = &variable.flags;
                        write_codes(&dataset, flags.iter().map(|(code, word)| (*code, word.as_str())))?;
                    }
                    (dataset, Buffer::Counts(Vec::new(), fill))
                }
                None => {
                    let dataset = create::<f64>(file, name, &shape, units, long_name, storage)?;
                    (dataset, Buffer::Numbers(Vec::new()))
                }
            };
            attach(&dataset)?;
            values.push((dataset, buffer));
        }
        let inner = shape.iter().skip(1).product::<usize>().max(1);
        Ok(Columns {
            block: (BLOCK / inner).max(1) * inner,
            shape,
            written: 0,
            status: (status, Vec::new()),
            coordinates,
            numbers,
            values,
            failures: Vec::new(),
            sums: Sums::default(),
            events: match (events, storage) {
                (None, _) => None,
                (Some(form), Storage::Own) => Some(TableWriter::create(file, &form.table())?),
                (Some(form), Storage::Shards(_)) => {
                    create_virtual(file, &form.table(), storage)?;
                    None
                }
            },
        })
    }

    pub(super) fn push(&mut self, row: SweepRow) -> hdf5::Result<()> {
        let number = i64::try_from(row.number).unwrap_or(i64::MAX);
        self.status.1.push(match (&row.values, &row.failure) {
            (Some(_), _) => POINT_STATUSES[0].0,
            (None, Some(_)) => POINT_STATUSES[1].0,
            (None, None) => POINT_STATUSES[2].0,
        });
        if let Some((_, numbers)) = &mut self.numbers {
            numbers.push(number);
        }
        for ((_, column, _), value) in self.coordinates.iter_mut().zip(&row.coordinates) {
            column.push(*value);
        }
        for (k, (_, buffer)) in self.values.iter_mut().enumerate() {
            let value = row.values.as_ref().map_or(f64::NAN, |values| values[k]);
            match buffer {
                Buffer::Counts(counts, fill) => counts.push(if value.is_nan() { *fill } else { value as i64 }),
                Buffer::Numbers(numbers) => numbers.push(value),
            }
        }
        if let Some(message) = row.failure {
            self.failures.push((number, message));
        }
        if let Some(events) = &mut self.events {
            for &(time, kind, mode_after, relative_velocity, internal_force) in &row.events {
                let (index, time, codes) = (events.rows() as i64, Cell::F64(time), [kind, mode_after].map(Cell::I8));
                let head = [Cell::I64(index), Cell::I64(number), time].into_iter().chain(codes);
                if events.push(head.chain([relative_velocity, internal_force].map(Cell::F64))) {
                    events.append()?;
                }
            }
        }
        if self.status.1.len() == self.block {
            self.flush()?;
        }
        Ok(())
    }

    /// Adds a point that failed to the table of failures alone.
    pub(super) fn push_failure(&mut self, number: i64, message: String) {
        self.failures.push((number, message));
    }

    /// The checksums of the values in the file.
    pub(super) fn known(&self) -> Known {
        let mut known = self.sums.known();
        known.extend(self.events.iter().flat_map(TableWriter::sums));
        known
    }

    /// Writes the points that are buffered: whole indices of the first dimension.
    pub(super) fn flush(&mut self) -> hdf5::Result<()> {
        let count = self.status.1.len();
        if count == 0 {
            return Ok(());
        }
        let (shape, start, sums) = (&self.shape, self.written, &mut self.sums);
        write_block(&self.status.0, shape, start, &mut self.status.1, sums)?;
        if let Some((dataset, numbers)) = &mut self.numbers {
            write_block(dataset, shape, start, numbers, sums)?;
        }
        for (dataset, column, words) in &mut self.coordinates {
            if *words {
                let mut codes: Vec<i32> = column.drain(..).map(|code| code as i32).collect();
                write_block(dataset, shape, start, &mut codes, sums)?;
            } else {
                write_block(dataset, shape, start, column, sums)?;
            }
        }
        for (dataset, buffer) in &mut self.values {
            match buffer {
                Buffer::Counts(counts, _) => write_block(dataset, shape, start, counts, sums)?,
                Buffer::Numbers(numbers) => write_block(dataset, shape, start, numbers, sums)?,
            }
        }
        self.written += count;
        Ok(())
    }

    pub(super) fn finish(&mut self, file: &hdf5::File) -> hdf5::Result<()> {
        if let Some(events) = &mut self.events {
            events.append()?;
        }
        if self.failures.is_empty() {
            return Ok(());
        }
        let (group, dimension) = FAILURES;
        let group = create_group(file, group)?;
        let numbers: Vec<i64> = self.failures.iter().map(|failure| failure.0).collect();
        let index = create::<i64>(
            &group,
            dimension,
            &[numbers.len()],
            "1",
            "index of the failure",
            Storage::Own,
        )?;
        index.write(&(0..numbers.len() as i64).collect::<Vec<_>>())?;
        raw::set_scale(&index, dimension)?;
        let length = [numbers.len()];
        let point = create::<i64>(&group, POINT, &length, "1", "number of the point", Storage::Own)?;
        point.write(&numbers)?;
        raw::attach_scale(&point, &index, 0)?;
        let texts: Vec<String> = self.failures.drain(..).map(|failure| failure.1).collect();
        let message = raw::write_texts(&group, "message", &texts)?;
        describe(&message, "1", "why the point failed")?;
        raw::attach_scale(&message, &index, 0)
    }
}

/// The columns of the events over those of the shards, one shard after the other.
fn create_virtual(file: &hdf5::File, table: &Table, storage: Storage) -> hdf5::Result<()> {
    let length = [storage.events()];
    let group = create_group(file, table.group)?;
    let mut index = None;
    for variable in &table.variables {
        let storage = match index {
            None => Storage::Own,
            Some(_) => storage.of(Rows::Events),
        };
        let (name, units, long_name) = (&variable.name, variable.units, &variable.long_name);
        let create = match variable.kind {
            Kind::Int8 => create::<i8>,
            Kind::Int32 => create::<i32>,
            Kind::Int64 => create::<i64>,
            Kind::Float64 => create::<f64>,
        };
        let dataset = create(&group, name, &length, units, long_name, storage)?;
        if !variable.flags.is_empty() {
            write_codes(&dataset, variable.flags.iter().copied())?;
        }
        match &index {
            Some(index) => raw::attach_scale(&dataset, index, 0)?,
            None => {
                dataset.write(&(0..length[0] as i64).collect::<Vec<_>>())?;
                raw::set_scale(&dataset, name)?;
                index = Some(dataset);
            }
        }
    }
    Ok(())
}

/// Writes `rows` at the points from `start` on, and forgets them.
fn write_block<T: H5Type + Summed>(
    dataset: &Dataset,
    shape: &[usize],
    start: usize,
    rows: &mut Vec<T>,
    sums: &mut Sums,
) -> hdf5::Result<()> {
    sums.add(dataset, rows);
    let inner = shape.iter().skip(1).product::<usize>().max(1);
    let (first, count) = (start / inner, rows.len() / inner);
    let mut block = shape.to_vec();
    block[0] = count;
    let view = ArrayViewD::from_shape(IxDyn(&block), &rows[..]).map_err(|error| error.to_string())?;
    let mut slices = vec![SliceOrIndex::from(first..first + count)];
    slices.extend(shape.iter().skip(1).map(|&length| SliceOrIndex::from(0..length)));
    dataset.write_slice(view, Selection::Hyperslab(Hyperslab::from(slices)))?;
    rows.clear();
    Ok(())
}

/// An axis of a grid with its values: a dimension scale.
pub(super) fn write_axis(group: &Group, axis: &SweepAxis) -> hdf5::Result<Dataset> {
    let dataset = create_axis(group, axis, axis.values.len(), Storage::Own)?;
    if axis.words.is_empty() {
        dataset.write(&axis.values)?;
    } else {
        dataset.write(&axis.values.iter().map(|&code| code as i32).collect::<Vec<_>>())?;
    }
    raw::set_scale(&dataset, &axis.name)?;
    Ok(dataset)
}

/// An axis as a coordinate or a column: numbers, or codes of words.
fn create_axis(group: &Group, axis: &SweepAxis, length: usize, storage: Storage) -> hdf5::Result<Dataset> {
    let dataset = if axis.words.is_empty() {
        create::<f64>(group, &axis.name, &[length], &axis.units, &axis.long_name, storage)?
    } else {
        let dataset = create::<i32>(group, &axis.name, &[length], "1", &axis.long_name, storage)?;
        let words = axis.words.iter().map(|word| word.replace(char::is_whitespace, "_"));
        let words: Vec<String> = words.collect();
        write_codes(&dataset, (0i32..).zip(words.iter().map(String::as_str)))?;
        dataset
    };
    write_text_attribute(&dataset, "keys", &axis.keys)?;
    Ok(dataset)
}

fn create<T: Stored>(
    group: &Group,
    name: &str,
    shape: &[usize],
    units: &str,
    long_name: &str,
    storage: Storage,
) -> hdf5::Result<Dataset> {
    let inner = shape.iter().skip(1).product::<usize>().max(1);
    let mut chunk = shape.to_vec();
    chunk[0] = (BLOCK / inner).clamp(1, shape[0].max(1));
    let dataset = match storage {
        Storage::Own => group
            .new_dataset_builder()
            .obj_track_times(false)
            .shuffle()
            .deflate(DEFLATE_LEVEL)
            .fletcher32()
            .chunk(chunk)
            .empty::<T>()
            .shape(shape.to_vec())
            .create(name)?,
        Storage::Shards(shards) => shards.create::<T>(group, name, shape)?,
    };
    describe(&dataset, units, long_name)?;
    Ok(dataset)
}

pub(super) fn write_column(group: &Group, column: &Column) -> hdf5::Result<Dataset> {
    let (name, units, long_name) = (&column.name, &column.units, &column.long_name);
    let dataset = match &column.data {
        ColumnData::Numbers(rows) => {
            let dataset = create::<f64>(group, name, &[rows.len()], units, long_name, Storage::Own)?;
            dataset.write(&rows[..])?;
            dataset
        }
        ColumnData::Counts(rows) => {
            let dataset = create::<i64>(group, name, &[rows.len()], units, long_name, Storage::Own)?;
            dataset.write(&rows[..])?;
            dataset
        }
        ColumnData::Codes(rows, flags) => {
            let dataset = create::<i8>(group, name, &[rows.len()], units, long_name, Storage::Own)?;
            dataset.write(&rows[..])?;
            write_codes(&dataset, flags.iter().map(|(code, word)| (*code, word.as_str())))?;
            dataset
        }
    };
    Ok(dataset)
}
