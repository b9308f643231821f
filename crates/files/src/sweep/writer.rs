//! Writer of sweep files: a row, or a cell of a grid, for each point in the order of the numbers.

use std::fs;
use std::path::PathBuf;

use hdf5::{Dataset, Group, Hyperslab, Selection, SliceOrIndex};

use super::{BLOCK, FAILURES, POINT, POINT_STATUS, POINT_STATUSES, SweepAxis, SweepLayout, SweepPlan, SweepRow, shard};
use crate::attributes::{describe, describe_text, write_attribute};
use crate::schema::{self, Variable};
use crate::study::StudyHeader;
use crate::table::{ColumnValues, TableWriter, compressed, create_empty, with_type};
use crate::target::{self, Reservation};
use crate::{Addition, FileColumn, ResultError, Status, raw};

/// Writer of one sweep file, which has a hidden name until it is complete.
pub struct SweepWriter {
    made: PathBuf,
    /// Declared first: the datasets must close before their file.
    points: PointColumns,
    file: hdf5::File,
    place: Reservation,
}

impl std::fmt::Debug for SweepWriter {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("SweepWriter")
            .field("path", &self.place.path)
            .finish_non_exhaustive()
    }
}

impl SweepWriter {
    /// Creates the file under a hidden name.
    pub fn create(place: Reservation, header: &StudyHeader, plan: &SweepPlan) -> Result<Self, ResultError> {
        let made = place.lock.sibling();
        let created = (|| {
            let format = match plan.shard {
                Some(_) => schema::SWEEP_SHARD_FORMAT,
                None => schema::SWEEP_FORMAT,
            };
            let file = header.create(&made, format, None)?;
            header.write_input(&file)?;
            if let Some(shard) = &plan.shard {
                shard::describe(&file, header, shard, plan)?;
            }
            Ok((PointColumns::create(&file, plan)?, file))
        })();
        let (points, file) = created.map_err(|error| ResultError::write(&place.path, false, &error))?;
        Ok(SweepWriter {
            made,
            points,
            file,
            place,
        })
    }

    /// Adds the next point, in the order of the numbers.
    pub fn push(&mut self, row: SweepRow) -> Result<(), ResultError> {
        let pushed = self.points.push(row);
        pushed.map_err(|error| ResultError::write(&self.place.path, false, &error))
    }

    /// Adds a group with a table.
    pub fn add(&mut self, table: &Addition) -> Result<(), ResultError> {
        let added = table.write(&self.file);
        added.map_err(|error| ResultError::write(&self.place.path, false, &error))
    }

    /// Ends the file, and returns its path: its own name if the sweep is complete, otherwise its partial name. Fails
    /// if the file cannot be written, or if a file that may not be replaced has appeared at the target.
    pub fn finish(mut self, status: &Status) -> Result<PathBuf, ResultError> {
        let Reservation { path, partial, .. } = &self.place;
        let closed = (move || {
            self.points.flush()?;
            self.points.finish(&self.file)?;
            write_attribute(&self.file, schema::root::STATUS, status.name())?;
            drop(self.points);
            self.file.close()
        })();
        closed.map_err(|error| ResultError::write(path, false, &error))?;
        target::save(&self.made)?;
        let is_complete = *status == Status::Complete;
        let target = if is_complete { path } else { partial };
        target::rename(&self.made, target, self.place.overwrite)?;
        if is_complete {
            // An earlier interruption may have left this file.
            let _ = fs::remove_file(partial);
        }
        Ok(target.clone())
    }
}

struct PointColumns {
    shape: Vec<usize>,
    /// Points in a block: whole indices of the first dimension.
    block: usize,
    written: usize,
    /// Status, coordinates and number in a table, values: each with what a missing value is stored as.
    columns: Vec<(Dataset, ColumnValues<'static>, f64)>,
    layout: SweepLayout,
    failures: Vec<(i64, String)>,
    events: Option<TableWriter>,
}

impl PointColumns {
    fn create(file: &hdf5::File, plan: &SweepPlan) -> hdf5::Result<Self> {
        let points = plan.points;
        let mut scales = Vec::new();
        let mut columns = Vec::new();
        let mut add = |dataset: Dataset, variable: &Variable| {
            let missing = variable.fill.map_or(f64::NAN, |fill| fill as f64);
            columns.push((dataset, ColumnValues::of(variable.kind, []), missing));
        };
        let attach = |dataset: &Dataset, scales: &[Dataset]| {
            let mut scales = (0..).zip(scales);
            scales.try_for_each(|(index, scale)| raw::attach_scale(dataset, scale, index))
        };
        let shape = match plan.layout {
            SweepLayout::Grid => {
                for axis in &plan.axes {
                    scales.push(write_axis(file, axis)?);
                }
                plan.axes.iter().map(|axis| axis.values.len()).collect()
            }
            SweepLayout::Table => {
                let variable = Variable::count(POINT, "number of the point");
                scales.push(create(file, &variable, &[points])?);
                raw::set_scale(&scales[0], POINT)?;
                for axis in &plan.axes {
                    let dataset = create_axis(file, axis, points)?;
                    attach(&dataset, &scales)?;
                    add(dataset, &axis.variable);
                }
                add(scales[0].clone(), &variable);
                vec![points]
            }
        };
        let status = Variable::code(POINT_STATUS, "outcome of the point", &POINT_STATUSES);
        for variable in std::iter::once(&status).chain(&plan.variables) {
            let dataset = create(file, variable, &shape)?;
            attach(&dataset, &scales)?;
            add(dataset, variable);
        }
        let values = columns.len() - plan.variables.len();
        columns[..values].rotate_right(1);
        Ok(PointColumns {
            block: (BLOCK / inner(&shape)).max(1) * inner(&shape),
            shape,
            written: 0,
            columns,
            layout: plan.layout,
            failures: Vec::new(),
            events: match plan.events {
                None => None,
                Some(form) => Some(TableWriter::create(file, &form.table())?),
            },
        })
    }

    fn push(&mut self, row: SweepRow) -> hdf5::Result<()> {
        let status = match (&row.values, &row.failure) {
            (Some(_), _) => POINT_STATUSES[0],
            (None, Some(_)) => POINT_STATUSES[1],
            (None, None) => POINT_STATUSES[2],
        };
        let number = (self.layout == SweepLayout::Table).then_some(row.number as f64);
        let cells = std::iter::once(f64::from(status.0))
            .chain(row.coordinates)
            .chain(number);
        let cells = cells
            .chain(row.values.into_iter().flatten())
            .chain(std::iter::repeat(f64::NAN));
        for ((_, column, missing), value) in self.columns.iter_mut().zip(cells) {
            column.push(if value.is_nan() { *missing } else { value });
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
        if self.columns[0].1.len() == self.block {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> hdf5::Result<()> {
        let count = self.columns[0].1.len();
        if count == 0 {
            return Ok(());
        }
        let (first, rows) = (self.written / inner(&self.shape), count / inner(&self.shape));
        let mut block = self.shape.clone();
        block[0] = rows;
        let mut slices: Vec<SliceOrIndex> = block.iter().map(|&length| (0..length).into()).collect();
        slices[0] = (first..first + rows).into();
        let place = Selection::Hyperslab(Hyperslab::from(slices));
        for (dataset, column, _) in &mut self.columns {
            column.write_block(dataset, &block, place.clone())?;
        }
        self.written += count;
        Ok(())
    }

    fn finish(&mut self, file: &hdf5::File) -> hdf5::Result<()> {
        if let Some(events) = &mut self.events {
            events.append()?;
        }
        if self.failures.is_empty() {
            return Ok(());
        }
        let (numbers, texts): (Vec<i64>, Vec<String>) = self.failures.drain(..).unzip();
        let (group, dimension) = FAILURES;
        let columns = vec![
            FileColumn::counts(dimension, "index of the failure", 0..numbers.len() as i64),
            FileColumn::counts(POINT, "number of the point", numbers),
        ];
        Addition::of_table(group, columns).write(file)?;
        let group = file.group(group)?;
        let message = raw::write_texts(&group, "message", &texts)?;
        describe_text(&message, "1", "why the point failed")?;
        raw::attach_scale(&message, &group.dataset(dimension)?, 0)
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
    let mut chunk = shape.to_vec();
    chunk[0] = (BLOCK / inner(shape)).clamp(1, shape[0].max(1));
    let builder = compressed(group).chunk(chunk);
    let dataset = with_type!(variable.kind, create_empty(builder, shape.to_vec(), &variable.name))?;
    describe(&dataset, variable)?;
    Ok(dataset)
}

/// Number of points for each index of the first dimension.
fn inner(shape: &[usize]) -> usize {
    shape.iter().skip(1).product::<usize>().max(1)
}
