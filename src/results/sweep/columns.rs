//! The datasets of a sweep file: the columns of its points, its events, and further tables.

use hdf5::{Dataset, Group, H5Type, Hyperslab, Selection, SliceOrIndex};
use ndarray::{ArrayViewD, IxDyn};

use super::schema::{
    Column, ColumnData, EVENTS, EventForm, FAILURES, POINT, POINT_STATUS, POINT_STATUSES, SweepAxis, SweepCell,
    SweepLayout, SweepPlan, SweepRow,
};
use super::storage::{Rows, Storage, Stored};
use crate::results::attributes::write_text_attribute;
use crate::results::checksums::{Summed, Sums};
use crate::results::raw;
use crate::results::schema::{self, attribute};
use crate::results::table::{DEFLATE_LEVEL, append, create_group};

/// Points that are buffered before they are written, at least; also the size of a chunk.
const BLOCK: usize = 16_384;

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
    events: Option<Events>,
    /// Of the values in the file.
    pub(super) sums: Sums,
}

enum Buffer {
    Counts(Vec<i64>, i64),
    Numbers(Vec<f64>),
}

/// The events of all points, one after the other.
struct Events {
    index: (Dataset, Vec<i64>),
    point: (Dataset, Vec<i64>),
    time: (Dataset, Vec<f64>),
    kind: (Dataset, Vec<i8>),
    mode_after: (Dataset, Vec<i8>),
    relative_velocity: (Dataset, Vec<f64>),
    internal_force: (Dataset, Vec<f64>),
    written: usize,
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
        write_flags(&status, &POINT_STATUSES)?;
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
                (Some(form), Storage::Own) => Some(Events::create(file, form)?),
                (Some(form), Storage::Shards(_)) => {
                    Events::create_virtual(file, form, storage)?;
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
            events.push(number, &row.events, &mut self.sums)?;
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
            events.flush(&mut self.sums)?;
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
        write_text_attribute(&message, attribute::UNITS, "1")?;
        write_text_attribute(&message, attribute::LONG_NAME, "why the point failed")?;
        raw::attach_scale(&message, &index, 0)
    }
}

/// Name, unit and description of the float64 columns of the events; between them stand the codes.
const EVENT_TIME: [&str; 3] = ["time", "s", "time of the event"];
const EVENT_VELOCITY: [&str; 3] = [
    "relative_velocity",
    "rad s-1",
    "relative velocity omega_r before the event",
];
const EVENT_FORCE: [&str; 3] = ["internal_force", "N", "T_f / r just before the event"];
const EVENT_POINT: [&str; 3] = [POINT, "1", "number of the point that the event belongs to"];
const EVENT_KIND: [&str; 3] = ["kind", "1", "what happened"];
const EVENT_MODE: [&str; 3] = ["mode_after", "1", "mode after the event"];

impl EventForm {
    /// Codes of the mode.
    fn modes(self) -> Vec<(i8, &'static str)> {
        match self.trains {
            true => schema::all_mode_flags(),
            false => schema::mode_flags(),
        }
    }

    /// The column of the relative velocity.
    fn velocity(self) -> [&'static str; 3] {
        let [name, units, long_name] = EVENT_VELOCITY;
        [name, if self.translation { "m s-1" } else { units }, long_name]
    }
}

impl Events {
    fn create(file: &hdf5::File, form: EventForm) -> hdf5::Result<Self> {
        let (group, dimension) = EVENTS;
        let group = create_group(file, group)?;
        fn column<T: H5Type>(group: &Group, [name, units, long_name]: [&str; 3]) -> hdf5::Result<(Dataset, Vec<T>)> {
            let dataset = group
                .new_dataset_builder()
                .obj_track_times(false)
                .shuffle()
                .deflate(DEFLATE_LEVEL)
                .fletcher32()
                .chunk(BLOCK)
                .empty::<T>()
                .shape(0..)
                .create(name)?;
            write_text_attribute(&dataset, attribute::UNITS, units)?;
            write_text_attribute(&dataset, attribute::LONG_NAME, long_name)?;
            Ok((dataset, Vec::new()))
        }
        let index = column::<i64>(&group, [dimension, "1", "index of the event"])?;
        let point = column::<i64>(&group, EVENT_POINT)?;
        let time = column::<f64>(&group, EVENT_TIME)?;
        let kind = column::<i8>(&group, EVENT_KIND)?;
        write_flags(&kind.0, &schema::kind_flags())?;
        let mode_after = column::<i8>(&group, EVENT_MODE)?;
        write_flags(&mode_after.0, &form.modes())?;
        let relative_velocity = column::<f64>(&group, form.velocity())?;
        let internal_force = column::<f64>(&group, EVENT_FORCE)?;
        raw::set_scale(&index.0, dimension)?;
        for dataset in [
            &point.0,
            &time.0,
            &kind.0,
            &mode_after.0,
            &relative_velocity.0,
            &internal_force.0,
        ] {
            raw::attach_scale(dataset, &index.0, 0)?;
        }
        Ok(Events {
            index,
            point,
            time,
            kind,
            mode_after,
            relative_velocity,
            internal_force,
            written: 0,
        })
    }

    /// The same columns over those of the shards, one shard after the other.
    fn create_virtual(file: &hdf5::File, form: EventForm, storage: Storage) -> hdf5::Result<()> {
        let (group, dimension) = EVENTS;
        let length = [storage.events()];
        let storage = storage.of(Rows::Events);
        let group = create_group(file, group)?;
        let index = create::<i64>(&group, dimension, &length, "1", "index of the event", Storage::Own)?;
        index.write(&(0..length[0] as i64).collect::<Vec<_>>())?;
        raw::set_scale(&index, dimension)?;
        fn column<T: Stored>(
            group: &Group,
            [name, units, long_name]: [&str; 3],
            length: [usize; 1],
            storage: Storage,
            index: &Dataset,
        ) -> hdf5::Result<Dataset> {
            let dataset = create::<T>(group, name, &length, units, long_name, storage)?;
            raw::attach_scale(&dataset, index, 0)?;
            Ok(dataset)
        }
        column::<i64>(&group, EVENT_POINT, length, storage, &index)?;
        column::<f64>(&group, EVENT_TIME, length, storage, &index)?;
        let kind = column::<i8>(&group, EVENT_KIND, length, storage, &index)?;
        write_flags(&kind, &schema::kind_flags())?;
        let mode_after = column::<i8>(&group, EVENT_MODE, length, storage, &index)?;
        write_flags(&mode_after, &form.modes())?;
        column::<f64>(&group, form.velocity(), length, storage, &index)?;
        column::<f64>(&group, EVENT_FORCE, length, storage, &index)?;
        Ok(())
    }

    fn push(&mut self, point: i64, events: &[SweepCell], sums: &mut Sums) -> hdf5::Result<()> {
        for &(time, kind, mode_after, relative_velocity, internal_force) in events {
            self.index.1.push((self.written + self.point.1.len()) as i64);
            self.point.1.push(point);
            self.time.1.push(time);
            self.kind.1.push(kind);
            self.mode_after.1.push(mode_after);
            self.relative_velocity.1.push(relative_velocity);
            self.internal_force.1.push(internal_force);
            if self.point.1.len() == BLOCK {
                self.flush(sums)?;
            }
        }
        Ok(())
    }

    fn flush(&mut self, sums: &mut Sums) -> hdf5::Result<()> {
        let (start, count) = (self.written, self.point.1.len());
        if count == 0 {
            return Ok(());
        }
        append(&mut self.index.1, &self.index.0, start, sums)?;
        append(&mut self.point.1, &self.point.0, start, sums)?;
        append(&mut self.time.1, &self.time.0, start, sums)?;
        append(&mut self.kind.1, &self.kind.0, start, sums)?;
        append(&mut self.mode_after.1, &self.mode_after.0, start, sums)?;
        append(&mut self.relative_velocity.1, &self.relative_velocity.0, start, sums)?;
        append(&mut self.internal_force.1, &self.internal_force.0, start, sums)?;
        self.written += count;
        Ok(())
    }
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
        let codes: Vec<i32> = (0..axis.words.len() as i32).collect();
        dataset
            .new_attr_builder()
            .with_data(&codes[..])
            .create(attribute::FLAG_VALUES)?;
        let words: Vec<String> = axis
            .words
            .iter()
            .map(|word| word.replace(char::is_whitespace, "_"))
            .collect();
        write_text_attribute(&dataset, attribute::FLAG_MEANINGS, &words.join(" "))?;
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
    write_text_attribute(&dataset, attribute::UNITS, units)?;
    write_text_attribute(&dataset, attribute::LONG_NAME, long_name)?;
    Ok(dataset)
}

fn write_flags(dataset: &Dataset, flags: &[(i8, &str)]) -> hdf5::Result<()> {
    write_codes(dataset, flags.iter().copied())
}

fn write_codes<'a, T: H5Type>(dataset: &Dataset, flags: impl Iterator<Item = (T, &'a str)>) -> hdf5::Result<()> {
    let (values, meanings): (Vec<T>, Vec<&str>) = flags.unzip();
    dataset
        .new_attr_builder()
        .with_data(&values[..])
        .create(attribute::FLAG_VALUES)?;
    write_text_attribute(dataset, attribute::FLAG_MEANINGS, &meanings.join(" "))
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
            let flags: Vec<(i8, &str)> = flags.iter().map(|(code, word)| (*code, word.as_str())).collect();
            write_flags(&dataset, &flags)?;
            dataset
        }
    };
    Ok(dataset)
}
