//! Writer of sweep files: a row, or a cell of a grid, for each point in the order of the numbers.

use std::fs;
use std::path::PathBuf;

use super::columns::{SweepColumns, write_columns};
use super::schema::{SweepPlan, SweepRow};
use super::shard;
use crate::attributes::write_attribute;
use crate::schema;
use crate::study::StudyHeader;
use crate::table::create_group;
use crate::target::{self, Reservation};
use crate::{FileColumn, ResultError, Status};

/// Writer of one sweep file, which has a hidden name until it is complete.
pub struct SweepWriter {
    made: PathBuf,
    /// Declared first: the datasets must close before their file.
    columns: SweepColumns,
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
            let columns = SweepColumns::create(&file, plan)?;
            Ok((file, columns))
        })();
        let (file, columns) = created.map_err(|error| ResultError::write(&place.path, false, &error))?;
        Ok(SweepWriter {
            made,
            columns,
            file,
            place,
        })
    }

    /// Adds the next point, in the order of the numbers.
    pub fn push(&mut self, row: SweepRow) -> Result<(), ResultError> {
        self.columns
            .push(row)
            .map_err(|error| ResultError::write(&self.place.path, false, &error))
    }

    /// Adds a group with a table. Its first column is the dimension.
    pub fn add_table(
        &mut self,
        group: &str,
        attributes: &[(&str, String)],
        columns: &[FileColumn],
    ) -> Result<(), ResultError> {
        (|| {
            let group = create_group(&self.file, group)?;
            for (name, text) in attributes {
                write_attribute(&group, name, text)?;
            }
            write_columns(&group, columns).map(drop)
        })()
        .map_err(|error| ResultError::write(&self.place.path, false, &error))
    }

    /// Ends the file, and returns its path: its own name if the sweep is complete, otherwise its partial name. Fails
    /// if the file cannot be written, or if a file that may not be replaced has appeared at the target.
    pub fn finish(self, status: &Status) -> Result<PathBuf, ResultError> {
        let SweepWriter {
            made,
            mut columns,
            file,
            place,
        } = self;
        let Reservation { path, partial, .. } = &place;
        let closed = (|| {
            columns.flush()?;
            columns.finish(&file)?;
            write_attribute(&file, schema::root::STATUS, status.name())?;
            drop(columns);
            file.close()
        })();
        closed.map_err(|error| ResultError::write(path, false, &error))?;
        target::save(&made)?;
        let target = if *status == Status::Complete { path } else { partial };
        target::rename(&made, target, place.overwrite)?;
        if *status == Status::Complete {
            // An earlier interruption may have left this file.
            let _ = fs::remove_file(partial);
        }
        Ok(target.clone())
    }
}
