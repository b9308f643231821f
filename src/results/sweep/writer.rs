//! Writes the file of a sweep: one row or one cell of a grid for each point, in the order of their numbers.

use std::fs;
use std::path::{Path, PathBuf};

use super::columns::{Columns, write_columns};
use super::schema::{DIGEST, INPUT_CASE, INPUT_STUDY, SweepHeader, SweepPlan, SweepRow};
use super::shard;
use super::storage::Shards;
use crate::results::attributes::{write_attribute, write_attributes, write_input, write_root};
use crate::results::schema;
use crate::results::table::{LibraryVersion, create_file as create_hdf5, create_group};
use crate::results::target::{self, Reservation};
use crate::results::{Column, ResultError, Status, checksums};

/// Writes one sweep file, beside its name until it is whole.
pub(crate) struct SweepWriter {
    made: PathBuf,
    /// In the order in which they are dropped, and so closed: the datasets before their file.
    columns: Columns,
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
    ///
    /// # Errors
    /// Any failure to create it.
    pub fn create(place: Reservation, header: &SweepHeader, plan: &SweepPlan) -> Result<Self, ResultError> {
        Self::create_with(place, header, plan, None)
    }

    /// The same with the points stored elsewhere.
    pub(super) fn create_with(
        place: Reservation,
        header: &SweepHeader,
        plan: &SweepPlan,
        shards: Option<&Shards>,
    ) -> Result<Self, ResultError> {
        let made = place.lock.sibling();
        let created = (|| {
            let format = match plan.shard {
                Some(_) => schema::SWEEP_SHARD_FORMAT,
                None => schema::SWEEP_FORMAT,
            };
            let file = create_file(&made, header, format, shards)?;
            if let Some(shard) = &plan.shard {
                shard::describe(&file, header, shard, plan)?;
            }
            let columns = Columns::create(&file, plan, shards)?;
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

    /// Adds the next point; they come in the order of their numbers.
    ///
    /// # Errors
    /// A failure to write.
    pub fn push(&mut self, row: SweepRow) -> Result<(), ResultError> {
        self.columns
            .push(row)
            .map_err(|error| ResultError::write(&self.place.path, false, &error))
    }

    /// Adds a point that failed to the table of failures, where the points themselves are stored elsewhere.
    pub(super) fn push_failure(&mut self, number: i64, message: String) {
        self.columns.push_failure(number, message);
    }

    /// Adds a group with a table; the first column is its dimension.
    ///
    /// # Errors
    /// A failure to write.
    pub(crate) fn add_table(
        &mut self,
        group: &str,
        attributes: &[(&str, String)],
        columns: &[Column],
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

    /// Ends the file. Returns where it is: at its own name if the sweep is complete, else at its partial name.
    ///
    /// # Errors
    /// A failure to write; or a file that has come to be at the target and may not be replaced.
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
            checksums::write(&file, &columns.known())?;
            write_attribute(&file, schema::root::STATUS, status.name())?;
            drop(columns);
            file.close()
        })();
        closed.map_err(|error| ResultError::write(path, false, &error))?;
        target::save(&made)?;
        let target = if *status == Status::Complete { path } else { partial };
        target::rename(&made, target, place.overwrite)?;
        if *status == Status::Complete {
            // Of an interruption before; it may not be there.
            let _ = fs::remove_file(partial);
        }
        Ok(target.clone())
    }
}

fn create_file(path: &Path, header: &SweepHeader, format: &str, shards: Option<&Shards>) -> hdf5::Result<hdf5::File> {
    // Virtual datasets need HDF5 1.10 in any case. Its own form of a selection is a rule; the earlier one lists every
    // block, in a time that grows with the square of their number.
    let version = if shards.is_some() {
        LibraryVersion::V110
    } else {
        LibraryVersion::Earliest
    };
    let file = create_hdf5(path, version)?;
    let texts = [
        (schema::root::CONVENTIONS, schema::CONVENTIONS),
        (schema::root::TITLE, &header.title),
        (schema::root::SOURCE, &header.source),
        (schema::root::HISTORY, &header.history),
        (schema::root::REFERENCES, &header.references),
        (schema::root::FORMAT, format),
        (DIGEST, &header.digest),
    ];
    write_root(&file, &texts)?;
    let input = create_group(&file, schema::group::INPUT)?;
    for (name, text, long_name) in [
        (INPUT_STUDY, &header.study_text, "the study as it was given (TOML)"),
        (INPUT_CASE, &header.case_text, "the base case (TOML)"),
    ] {
        write_input(&input, name, text, long_name)?;
    }
    let meta = create_group(&file, schema::group::META)?;
    write_attributes(&meta, &header.meta)?;
    Ok(file)
}
