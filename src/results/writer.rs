//! Writes a run as it is computed.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::attributes::{quantity, text_value, write_attribute, write_attributes, write_input, write_root};
use super::certificate::Addition;
use super::checksums::{self, Known};
use super::kept::{KeptEnd, KeptView};
use super::lock::WriteLock;
use super::rows::{EVENTS, PIECE_COEFFICIENTS, PIECES, STICK_SLIP, TRAJECTORY, TableRows};
use super::schema;
use super::table::{LibraryVersion, TableWriter, create_file, create_group};
use super::target::{self, Overwrite, Reservation};
use super::{AttributeValue, Extra, Header, Reason, ResultError, Status, StickSlipTable};
use crate::numerics::chebyshev::COEFFICIENTS;

/// Longest time between flushes, if rows come. In a flush some thousands of bytes all over the file change, which
/// takes less than a millisecond and is not atomic: a program that reads at that very moment may
/// have to try again, and a kill can cost the last blocks. Between flushes the file only grows at
/// its end, past what readers see. That is why flushes are not more frequent than the next bound makes
/// them. When a flush comes does not change what the file is in the end.
const FLUSH_INTERVAL: Duration = Duration::from_secs(1);

/// The file is also flushed when a block has been added and with it this share of all samples: on a full disk a run of
/// a tenth of a second keeps what a long one keeps, and a long one is flushed no more often for it.
const FLUSH_SHARE: f64 = 0.25;

/// Rows that are on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct SavedRows {
    /// Of /trajectory.
    pub samples: usize,
    /// Of /events.
    pub events: usize,
    /// Of /stick_slip.
    pub cycles: usize,
}

/// Writes one result file, in blocks of rows: memory is bounded however long the run.
///
/// Rows go to the partial file ([`super::partial_path`]), which is marked interrupted and flushed
/// as a whole at a block if the last flush was a second before or a good part of the samples is new, so that other
/// programs can read it at any time and a kill or a full disk leaves it readable. [`Self::finish`] with [`Status::Complete`] gives it its name. A writer that is dropped
/// without that leaves the partial file, with all rows. After an error nothing more is written: the
/// partial file stays as the last good flush left it.
pub struct ResultWriter {
    /// `None` after an error, and at the end.
    open: Option<Open>,
    /// Of the row that comes next.
    further: Vec<f64>,
    /// As of the last flush.
    saved: SavedRows,
    started: Instant,
    /// Last, so that it is dropped after the file is closed.
    place: Reservation,
}

impl std::fmt::Debug for ResultWriter {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("ResultWriter")
            .field("partial", &self.place.partial)
            .finish_non_exhaustive()
    }
}

impl ResultWriter {
    /// Creates the partial file of `path`, with all groups and variables and no rows.
    ///
    /// # Errors
    ///
    /// Those of [`super::check_target`]; another run that writes the same file; any failure to
    /// create it.
    pub fn create(path: &Path, overwrite: Overwrite, inputs: &[PathBuf], header: &Header) -> Result<Self, ResultError> {
        let place = Reservation::take(path, overwrite, inputs)?;
        Ok(ResultWriter {
            open: Some(Open::within(&place, header)?),
            further: Vec::new(),
            saved: SavedRows::default(),
            started: Instant::now(),
            place,
        })
    }

    /// Begins again, with another header and no rows: what was written is dropped.
    ///
    /// # Errors
    ///
    /// A failure to close the partial file or to create it.
    pub fn begin_again(&mut self, header: &Header) -> Result<(), ResultError> {
        self.close()?;
        self.open = Some(Open::within(&self.place, header)?);
        self.saved = SavedRows::default();
        Ok(())
    }

    /// Where the rows go until the run is complete.
    pub fn partial(&self) -> &Path {
        &self.place.partial
    }

    /// Writes the rows that are still buffered, and flushes the file.
    ///
    /// When it is called decides where the file keeps its blocks: identical runs give identical
    /// bytes only if they call it at the same rows.
    pub fn flush(&mut self) -> Result<(), ResultError> {
        self.with_open(|open, lock| open.append_all().and_then(|()| open.flush(lock)))
    }

    /// What the file has for certain: the rows of the last good flush.
    pub fn saved(&self) -> SavedRows {
        self.saved
    }

    /// Ends the file: /stick_slip (its rows after the cycles that were recorded as they came), the status, the wall time. Returns where the file is: at its own
    /// name if the run is complete, else still at [`Self::partial`].
    ///
    /// # Errors
    ///
    /// A failure to write; or a file that has come to be at the target since the run began and that
    /// may not be replaced. The partial file is left.
    pub fn finish(
        mut self,
        status: Status,
        stick_slip: &StickSlipTable,
        wall_time_s: f64,
    ) -> Result<PathBuf, ResultError> {
        if self.open.is_none() && status != Status::Complete {
            return Ok(self.place.partial.clone());
        }
        for cycle in &stick_slip.cycles {
            let row = [cycle.stick_duration, cycle.slip_duration, cycle.period];
            self.numbered(STICK_SLIP, &row)?;
        }
        self.with_open(|open, lock| open.finish(&status, stick_slip, wall_time_s, lock))?;
        self.close()?;
        target::save(&self.place.partial)?;
        if status != Status::Complete {
            return Ok(self.place.partial.clone());
        }
        target::rename(&self.place.partial, &self.place.path, self.place.overwrite)?;
        Ok(self.place.path.clone())
    }

    /// Writes what is known of a run once it is over, such as what another method made of the case. Once, before
    /// [`Self::finish`].
    ///
    /// # Errors
    ///
    /// A failure to write; [`Self::finish`] then leaves the partial file.
    pub fn add(&mut self, additions: &[Addition]) -> Result<(), ResultError> {
        if additions.is_empty() {
            return Ok(());
        }
        self.with_open(|open, _| {
            // Columns over the events want all of these.
            open.append_all()?;
            additions.iter().try_for_each(|addition| addition.write(&open.file))
        })
    }

    /// Closes the file, with whatever is buffered.
    fn close(&mut self) -> Result<(), ResultError> {
        let Some(open) = self.open.take() else {
            return Ok(());
        };
        self.place.lock.count_flush();
        let closed = open.close();
        self.place.lock.count_flush();
        closed.map_err(|error| ResultError::write(&self.place.partial, true, &error))
    }

    fn with_open(
        &mut self,
        action: impl FnOnce(&mut Open, &mut WriteLock) -> hdf5::Result<()>,
    ) -> Result<(), ResultError> {
        let Some(open) = &mut self.open else {
            let detail = "an earlier write failed".to_owned();
            return Err(Reason::Write { detail, kept: true }.of(&self.place.partial));
        };
        let result = action(open, &mut self.place.lock);
        self.saved = open.saved;
        result.map_err(|error| {
            let error = ResultError::write(&self.place.partial, true, &error);
            // Closing would write what is half done over what is good. Without its handles being
            // closed HDF5 writes nothing more, not even at the end of the program.
            std::mem::forget(self.open.take());
            error
        })
    }

    /// Writes a run that was kept in memory, row by row in the order in which it was recorded: the bytes are those of a run
    /// that was recorded by the writer itself.
    ///
    /// # Errors
    ///
    /// Those of [`Self::create`] and [`Self::finish`].
    pub fn write_kept(
        path: &Path,
        overwrite: Overwrite,
        header: &Header,
        rows: &KeptView<'_>,
        end: &KeptEnd<'_>,
    ) -> Result<PathBuf, ResultError> {
        let mut writer = ResultWriter::create(path, overwrite, &[], header)?;
        let mut next = [0; PIECES + 1];
        for &table in rows.order {
            let table = usize::from(table);
            let row = next[table];
            next[table] += 1;
            writer.take(table, &[&rows.row(table, row)])?;
            if table == PIECES {
                for row in row * COEFFICIENTS..(row + 1) * COEFFICIENTS {
                    writer.take(PIECE_COEFFICIENTS, &[&rows.row(PIECE_COEFFICIENTS, row)])?;
                }
            }
        }
        writer.add(end.witness)?;
        writer.finish(end.status.clone(), end.stick_slip, end.wall_time)
    }

    /// How long the writer has existed, s.
    pub fn elapsed(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }
}

impl Drop for ResultWriter {
    fn drop(&mut self) {
        if self.open.is_some()
            && let Err(error) = self.flush().and_then(|()| self.close())
        {
            log::warn!("{error}");
        }
    }
}

impl TableRows for ResultWriter {
    fn rows(&self, table: usize) -> usize {
        let open = self.open.as_ref();
        open.and_then(|open| open.tables.get(table))
            .map_or(0, TableWriter::rows)
    }

    /// Appends a row to a table, and whatever that completes to the file.
    fn take(&mut self, table: usize, row: &[&[f64]]) -> Result<(), ResultError> {
        self.with_open(
            |open, lock| match open.tables.get_mut(table).map(|rows| rows.push(row)) {
                Some(true) => open.append_block(table, lock),
                _ => Ok(()),
            },
        )
    }

    fn further(&mut self) -> &mut Vec<f64> {
        &mut self.further
    }
}

/// The HDF5 side of a writer.
struct Open {
    /// Before the file, so that they are dropped, and so closed, first.
    tables: Vec<TableWriter>,
    file: hdf5::File,
    /// `None` until the first rows are on disk.
    flushed: Option<Instant>,
    saved: SavedRows,
}

impl Open {
    /// The partial file of a place. It is made under a name of the lock's and then renamed: a file that is not yet whole is never
    /// seen.
    fn within(place: &Reservation, header: &Header) -> Result<Self, ResultError> {
        let (partial, made) = (&place.partial, place.lock.sibling());
        let created = Open::create(&made, header).map_err(|error| ResultError::write(partial, false, &error));
        let open = created.and_then(|open| match fs::rename(&made, partial) {
            Ok(()) => Ok(open),
            Err(error) => Err(ResultError::not_created(partial, error)),
        });
        if open.is_err() {
            let _ = fs::remove_file(&made);
        }
        open
    }

    fn create(path: &Path, header: &Header) -> hdf5::Result<Self> {
        let file = create_file(path, LibraryVersion::Earliest)?;
        let texts = [
            (schema::root::CONVENTIONS, schema::CONVENTIONS),
            (schema::root::TITLE, &header.title),
            (schema::root::SOURCE, &header.source),
            (schema::root::HISTORY, &header.history),
            (schema::root::REFERENCES, &header.references),
            (schema::root::FORMAT, schema::FORMAT),
            (schema::root::STATUS, Status::Interrupted.name()),
        ];
        write_root(&file, &texts)?;
        let tables = schema::all_tables(&header.extension);
        let tables = tables.iter().map(|table| TableWriter::create(&file, table));
        let tables = tables.collect::<hdf5::Result<_>>()?;
        let input = create_group(&file, schema::group::INPUT)?;
        for (name, text, long_name) in [
            (schema::INPUT_CASE, &header.case_text, "the case as it was given (TOML)"),
            (
                schema::INPUT_RESOLVED,
                &header.resolved,
                "every parameter in SI units (TOML)",
            ),
        ] {
            write_input(&input, name, text, long_name)?;
        }
        let meta = create_group(&file, schema::group::META)?;
        write_attributes(&meta, &header.meta)?;
        write_attributes(&file.group(schema::group::EVENTS)?, &header.events)?;
        write_attribute(&meta, schema::META_WALL_TIME, f64::NAN)?;
        file.flush()?;
        Ok(Open {
            tables,
            file,
            flushed: None,
            saved: SavedRows::default(),
        })
    }

    /// Appends a table that has completed a chunk. The trajectory takes the other tables along, so
    /// that what is on disk reaches to one time. Pieces alone are no reason for a flush.
    fn append_block(&mut self, table: usize, lock: &mut WriteLock) -> hdf5::Result<()> {
        match table {
            TRAJECTORY => self.append_all()?,
            PIECES | PIECE_COEFFICIENTS => return self.tables[table].append(),
            _ => self.tables[table].append()?,
        }
        let samples = self.tables[TRAJECTORY].written();
        let new = samples - self.saved.samples;
        let much = new > 0 && new as f64 >= FLUSH_SHARE * self.saved.samples as f64;
        if much || self.flushed.is_none_or(|flushed| flushed.elapsed() >= FLUSH_INTERVAL) {
            self.flush(lock)?;
        }
        Ok(())
    }

    fn flush(&mut self, lock: &mut WriteLock) -> hdf5::Result<()> {
        lock.count_flush();
        let flushed = self.file.flush();
        lock.count_flush();
        flushed?;
        self.flushed = Some(Instant::now());
        self.saved = SavedRows {
            samples: self.tables[TRAJECTORY].written(),
            events: self.tables[EVENTS].written(),
            cycles: self.tables[STICK_SLIP].written(),
        };
        Ok(())
    }

    fn append_all(&mut self) -> hdf5::Result<()> {
        self.tables.iter_mut().try_for_each(TableWriter::append)
    }

    fn finish(
        &mut self,
        status: &Status,
        stick_slip: &StickSlipTable,
        wall_time_s: f64,
        lock: &mut WriteLock,
    ) -> hdf5::Result<()> {
        let group = self.file.group(schema::group::STICK_SLIP)?;
        for Extra {
            name,
            unit,
            description,
            value,
        } in &stick_slip.attributes
        {
            let value = match schema::STICK_SLIP_COUNTS.iter().any(|count| count.0 == *name) {
                true => AttributeValue::Integer(*value as i64),
                false => AttributeValue::Number(*value),
            };
            write_attributes(&group, &quantity(name, value, unit, description))?;
        }
        self.file
            .group(schema::group::META)?
            .attr(schema::META_WALL_TIME)?
            .write_scalar(&wall_time_s)?;
        if let Status::Failed(message) = status {
            write_attribute(&self.file, schema::root::FAILURE, message)?;
        }
        self.append_all()?;
        let mut known = Known::default();
        self.tables.iter().for_each(|table| table.tell(&mut known));
        checksums::write(&self.file, &known)?;
        // All the rest is on disk before the file says that it is complete.
        self.flush(lock)?;
        self.file
            .attr(schema::root::STATUS)?
            .write_scalar(&text_value(status.name())?)?;
        self.flush(lock)
    }

    fn close(self) -> hdf5::Result<()> {
        drop(self.tables);
        self.file.close()
    }
}
