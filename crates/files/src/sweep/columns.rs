//! Datasets of a sweep file: points, events, further tables.

use hdf5::{Dataset, Group, Hyperslab, Selection, SliceOrIndex};

use super::schema::{
    BLOCK, FAILURES, POINT, POINT_STATUS, POINT_STATUSES, SweepAxis, SweepLayout, SweepPlan, SweepRow,
};
use crate::attributes::{describe, describe_text, write_attribute};
use crate::raw;
use crate::schema::{StorageKind, Variable};
use crate::table::{TableWriter, compressed, create_empty, create_group};
use crate::values::{ColumnValues, FileColumn, with_type};

pub(super) struct SweepColumns {
    shape: Vec<usize>,
    /// Points in a block: whole indices of the first dimension.
    block: usize,
    written: usize,
    status: Buffered,
    coordinates: Vec<Buffered>,
    numbers: Option<Buffered>,
    values: Vec<(Buffered, f64)>,
    failures: Vec<(i64, String)>,
    events: Option<TableWriter>,
}

type Buffered = (Dataset, ColumnValues<'static>);

fn buffered(dataset: Dataset, kind: StorageKind) -> Buffered {
    (dataset, ColumnValues::of(kind, []))
}

impl SweepColumns {
    pub(super) fn create(file: &hdf5::File, plan: &SweepPlan) -> hdf5::Result<Self> {
        let points = plan.points;
        let mut scales = Vec::new();
        let mut numbers = None;
        let shape = match plan.layout {
            SweepLayout::Grid => {
                for axis in &plan.axes {
                    scales.push(write_axis(file, axis)?);
                }
                plan.axes.iter().map(|axis| axis.values.len()).collect()
            }
            SweepLayout::Table => {
                let variable = Variable::count(POINT, "number of the point");
                let dataset = create(file, &variable, &[points])?;
                raw::set_scale(&dataset, POINT)?;
                numbers = Some(buffered(dataset.clone(), StorageKind::Int64));
                scales.push(dataset);
                vec![points]
            }
        };
        let attached = |dataset: Dataset, kind: StorageKind| {
            let attach = |(index, scale)| raw::attach_scale(&dataset, scale, index);
            (0..).zip(&scales).try_for_each(attach)?;
            Ok::<_, hdf5::Error>(buffered(dataset, kind))
        };
        let mut coordinates = Vec::new();
        if plan.layout == SweepLayout::Table {
            for axis in &plan.axes {
                coordinates.push(attached(create_axis(file, axis, points)?, axis.variable.kind)?);
            }
        }
        let status = Variable::code(POINT_STATUS, "outcome of the point", &POINT_STATUSES);
        let status = attached(create(file, &status, &shape)?, status.kind)?;
        let mut values = Vec::with_capacity(plan.variables.len());
        for variable in &plan.variables {
            let column = attached(create(file, variable, &shape)?, variable.kind)?;
            values.push((column, variable.fill.map_or(f64::NAN, |fill| fill as f64)));
        }
        let inner = shape.iter().skip(1).product::<usize>().max(1);
        Ok(SweepColumns {
            block: (BLOCK / inner).max(1) * inner,
            shape,
            written: 0,
            status,
            coordinates,
            numbers,
            values,
            failures: Vec::new(),
            events: match plan.events {
                None => None,
                Some(form) => Some(TableWriter::create(file, &form.table())?),
            },
        })
    }

    pub(super) fn push(&mut self, row: SweepRow) -> hdf5::Result<()> {
        let status = match (&row.values, &row.failure) {
            (Some(_), _) => POINT_STATUSES[0],
            (None, Some(_)) => POINT_STATUSES[1],
            (None, None) => POINT_STATUSES[2],
        };
        self.status.1.push(status.0.into());
        if let Some((_, numbers)) = &mut self.numbers {
            numbers.push(row.number as f64);
        }
        for ((_, column), value) in self.coordinates.iter_mut().zip(&row.coordinates) {
            column.push(*value);
        }
        for (k, ((_, column), nothing)) in self.values.iter_mut().enumerate() {
            let value = row.values.as_ref().map_or(f64::NAN, |values| values[k]);
            column.push(if value.is_nan() { *nothing } else { value });
        }
        if let Some(message) = row.failure {
            self.failures.push((row.number as i64, message));
        }
        if let Some(events) = &mut self.events {
            for event in row.events {
                let head = [events.rows() as f64, row.number as f64];
                if events.push(&[&head, &event]) {
                    events.append()?;
                }
            }
        }
        if self.status.1.len() == self.block {
            self.flush()?;
        }
        Ok(())
    }

    pub(super) fn flush(&mut self) -> hdf5::Result<()> {
        let count = self.status.1.len();
        if count == 0 {
            return Ok(());
        }
        let inner = self.shape.iter().skip(1).product::<usize>().max(1);
        let (first, rows) = (self.written / inner, count / inner);
        let mut block = self.shape.clone();
        block[0] = rows;
        let mut slices: Vec<SliceOrIndex> = block.iter().map(|&length| (0..length).into()).collect();
        slices[0] = (first..first + rows).into();
        let place = Selection::Hyperslab(Hyperslab::from(slices));
        let values = self.values.iter_mut().map(|(column, _)| column);
        let columns = std::iter::once(&mut self.status).chain(&mut self.numbers);
        for (dataset, column) in columns.chain(&mut self.coordinates).chain(values) {
            column.write_block(dataset, &block, place.clone())?;
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
        let (numbers, texts): (Vec<i64>, Vec<String>) = self.failures.drain(..).unzip();
        let (group, dimension) = FAILURES;
        let group = create_group(file, group)?;
        let columns = [
            FileColumn::counts(dimension, "index of the failure", 0..numbers.len() as i64),
            FileColumn::counts(POINT, "number of the point", numbers),
        ];
        let index = write_columns(&group, &columns)?;
        let message = raw::write_texts(&group, "message", &texts)?;
        describe_text(&message, "1", "why the point failed")?;
        index.map_or(Ok(()), |index| raw::attach_scale(&message, &index, 0))
    }
}

pub(super) fn write_axis(group: &Group, axis: &SweepAxis) -> hdf5::Result<Dataset> {
    let dataset = create_axis(group, axis, axis.values.len())?;
    ColumnValues::of(axis.variable.kind, axis.values.iter().copied()).write(&dataset)?;
    raw::set_scale(&dataset, &axis.variable.name)?;
    Ok(dataset)
}

fn create_axis(group: &Group, axis: &SweepAxis, length: usize) -> hdf5::Result<Dataset> {
    let dataset = create(group, &axis.variable, &[length])?;
    write_attribute(&dataset, "keys", &axis.keys)?;
    Ok(dataset)
}

fn create(group: &Group, variable: &Variable, shape: &[usize]) -> hdf5::Result<Dataset> {
    let inner = shape.iter().skip(1).product::<usize>().max(1);
    let mut chunk = shape.to_vec();
    chunk[0] = (BLOCK / inner).clamp(1, shape[0].max(1));
    let builder = compressed(group).chunk(chunk);
    let dataset = with_type!(variable.kind, create_empty(builder, shape.to_vec(), &variable.name))?;
    describe(&dataset, variable)?;
    Ok(dataset)
}

/// Writes a table, and returns its first column, which is the dimension.
pub(super) fn write_columns(group: &Group, columns: &[FileColumn]) -> hdf5::Result<Option<Dataset>> {
    let mut scale: Option<Dataset> = None;
    for FileColumn { variable, values } in columns {
        let dataset = create(group, variable, &[values.len()])?;
        values.write(&dataset)?;
        match &scale {
            Some(scale) => raw::attach_scale(&dataset, scale, 0)?,
            None => {
                raw::set_scale(&dataset, &variable.name)?;
                scale = Some(dataset);
            }
        }
    }
    Ok(scale)
}
