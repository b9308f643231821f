//! Writes a run as it is computed.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::attributes::{
    quantity, text_value, write_attribute, write_attributes, write_changed, write_input, write_root,
};
use super::parts::Addition;
use super::rows::{EVENTS, KeptView, PIECE_COEFFICIENTS, PIECES, STICK_SLIP, TRAJECTORY, TableRows};
use super::schema;
use super::table::{TableWriter, create_file, create_group};
use super::target::{self, Overwrite, Reservation, WriteLock};
use super::{AttributeValue, Extra, Header, Reason, ResultError, Status, StickSlipTable};
use stickslip_system::numerics::chebyshev::COEFFICIENTS;

/// Longest time between flushes, if rows come. A flush changes some thousands of bytes all over the file, in less than
/// a millisecond but not atomically: a reader at that moment may have to try again, and a kill can lose the last
/// blocks. Between flushes the file only grows at its end, beyond what readers see. The times of flushes do not change
/// the final file.
const FLUSH_INTERVAL: Duration = Duration::from_secs(1);

/// Share of new samples at which a completed block is flushed too: on a full disk a short run keeps as much as a long
/// one.
const FLUSH_SHARE: f64 = 0.25;

/// Numbers of rows on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct SavedRows {
    /// Rows of /trajectory.
    pub samples: usize,
    /// Rows of /events.
    pub events: usize,
    /// Rows of /stick_slip.
    pub cycles: usize,
}

/// Writes one result file, in blocks of rows, with bounded memory.
///
/// Rows go to the partial file ([`super::partial_path`]), marked interrupted. It is flushed every second or after a
/// good part of new samples, so that other programs can read it, and a kill or a full disk leaves it readable.
/// [`Self::finish`] with [`Status::Complete`] renames it. A dropped writer leaves the partial file with all rows; after
/// an error nothing more is written, and the last good flush remains.
pub struct ResultWriter {
    /// `None` after an error, and at the end.
    open: Option<Open>,
    /// Values of the next row.
    further: Vec<f64>,
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
    /// Errors of [`super::check_target`]; another run that writes the same file; any failure to create it.
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

    /// Restarts with another header and no rows; fails if the partial file cannot be closed or created.
    pub fn begin_again(&mut self, header: &Header) -> Result<(), ResultError> {
        self.close()?;
        self.open = Some(Open::within(&self.place, header)?);
        self.saved = SavedRows::default();
        Ok(())
    }

    /// Partial file, which holds the rows until the run is complete.
    pub fn partial(&self) -> &Path {
        &self.place.partial
    }

    /// Writes the buffered rows, and flushes the file. Its calls determine the place of blocks: identical runs give
    /// identical bytes only if they flush at the same rows.
    pub fn flush(&mut self) -> Result<(), ResultError> {
        self.with_open(|open, lock| open.append_all().and_then(|()| open.flush(lock)))
    }

    /// Rows that are certainly in the file: those of the last good flush.
    pub fn saved(&self) -> SavedRows {
        self.saved
    }

    /// Ends the file: /stick_slip (rows after the recorded cycles), status, wall time. Returns the path: its own name
    /// if the run is complete, otherwise [`Self::partial`].
    ///
    /// # Errors
    /// A failure to write, or a file that may not be replaced and has appeared at the target. The partial file is left.
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

    /// Writes results that are known after the run, such as another method's, once and before [`Self::finish`], which
    /// leaves the partial file if this fails.
    pub fn add(&mut self, additions: &[Addition]) -> Result<(), ResultError> {
        if additions.is_empty() {
            return Ok(());
        }
        self.with_open(|open, _| {
            // Columns over the events need all of them.
            open.append_all()?;
            additions.iter().try_for_each(|addition| addition.write(&open.file))
        })
    }

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
            // Closing would write unfinished data over good data. HDF5 writes nothing more while its handles stay open,
            // even at the end of the program.
            std::mem::forget(self.open.take());
            error
        })
    }

    /// Records the rows of a run from memory in their order: the bytes are the same as if the writer had recorded it.
    pub fn replay(&mut self, rows: &KeptView<'_>) -> Result<(), ResultError> {
        let mut next = [0; PIECES + 1];
        for table in rows.order.iter().map(|&table| usize::from(table)) {
            let row = next[table];
            next[table] += 1;
            self.copy_row(rows, table, row)?;
            if table == PIECES {
                let mut coefficients = row * COEFFICIENTS..(row + 1) * COEFFICIENTS;
                coefficients.try_for_each(|row| self.copy_row(rows, PIECE_COEFFICIENTS, row))?;
            }
        }
        Ok(())
    }

    fn copy_row(&mut self, rows: &KeptView<'_>, table: usize, row: usize) -> Result<(), ResultError> {
        let open = self.open.as_ref();
        let columns = open.map_or(0, |open| open.tables[table].width());
        let columns = rows.tables[table].iter().take(columns);
        self.take(table, &[&columns.map(|column| column.at(row)).collect::<Vec<_>>()])
    }

    /// Age of the writer, s.
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

struct Open {
    /// Before the file, so that they are closed first.
    tables: Vec<TableWriter>,
    file: hdf5::File,
    /// `None` until the first rows are on disk.
    flushed: Option<Instant>,
    saved: SavedRows,
}

impl Open {
    /// Makes the partial file under the lock's name and renames it: an incomplete file is never seen.
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
        let file = create_file(path)?;
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
        if let Some(asked) = &header.asked {
            let about = "every parameter as asked for, before the run was repeated with finer settings (TOML)";
            write_input(&input, schema::INPUT_ASKED, asked, about)?;
        }
        write_changed(&input, &header.changed)?;
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

    /// Appends a table with a completed chunk. The trajectory appends all tables, so that the disk has all rows up to
    /// one time. Pieces alone cause no flush.
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
            whole,
        } in &stick_slip.attributes
        {
            let value = match whole {
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
        // All other data is on disk before the status says complete.
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
