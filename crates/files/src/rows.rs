//! Rows of a run as table rows of a result file, in memory or on disk.

use super::ResultError;
use super::schema::{self, Extension, TableSchema};
use super::table::{ColumnValues, FileColumn};
use stickslip_system::numerics::chebyshev::COEFFICIENTS;
use stickslip_system::record::{Cycle, DensePiece, Event, Recorder, RecorderError, Sample, Segment};

pub(super) const TRAJECTORY: usize = 0;
pub(super) const EVENTS: usize = 1;
pub(super) const SEGMENTS: usize = 2;
pub(super) const STICK_SLIP: usize = 3;
pub(super) const PIECES: usize = 4;
pub(super) const PIECE_COEFFICIENTS: usize = 5;

/// A receiver of table rows, which have a value for every variable of the table in the order of the schema.
pub(super) trait TableRows {
    fn rows(&self, table: usize) -> usize;

    /// Takes a row in consecutive parts. A row of a table that does not exist is ignored.
    fn take(&mut self, table: usize, row: &[&[f64]]) -> Result<(), ResultError>;

    /// Values of the next row beyond [`State`](stickslip_system::record::State).
    fn further(&mut self) -> &mut Vec<f64>;

    fn stores_motion(&self) -> bool {
        true
    }

    fn numbered(&mut self, table: usize, row: &[f64]) -> Result<(), ResultError> {
        let number = self.rows(table) as f64;
        self.take(table, &[&[number], row])
    }
}

/// Implements the recorder for types that take rows. A blanket implementation would also cover types of other crates.
macro_rules! record_rows {
    ($($takes:ty),*) => {$(
        impl Recorder for $takes {
            fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
                values.clone_into(TableRows::further(self));
                Ok(())
            }

            fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
                let further = std::mem::take(TableRows::further(self));
                let head = [sample.time, sample.mode.code().into(), sample.segment.into()];
                let (state, channels) = (sample.state.values(), sample.channels.values());
                let taken = self.take(TRAJECTORY, &[&head, &state, &channels, &further]);
                *TableRows::further(self) = further;
                Ok(taken?)
            }

            fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
                let further = std::mem::take(TableRows::further(self));
                let head = [
                    TableRows::rows(self, EVENTS) as f64,
                    event.time,
                    event.kind.code().into(),
                    event.mode_after.code().into(),
                    event.mode_after.sense().into(),
                    event.segment.into(),
                ];
                let (before, after) = (event.before.values(), event.after.values());
                let taken = self.take(EVENTS, &[&head, &before, &after, &[event.internal_force], &further]);
                *TableRows::further(self) = further;
                Ok(taken?)
            }

            fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
                let work = &segment.counters;
                let row = [
                    segment.start,
                    segment.end,
                    segment.mode.code().into(),
                    solver_code(segment.solver).into(),
                    work.steps as f64,
                    work.rhs_evaluations as f64,
                    work.jacobian_evaluations as f64,
                    work.linear_solver_setups as f64,
                    work.error_test_failures as f64,
                    work.nonlinear_iterations as f64,
                    work.nonlinear_convergence_failures as f64,
                    work.root_evaluations as f64,
                    work.last_order.into(),
                    work.last_step,
                ];
                Ok(self.numbered(SEGMENTS, &row)?)
            }

            fn piece(&mut self, piece: &DensePiece<'_>) -> Result<(), RecorderError> {
                let row = [piece.start, piece.end, piece.mode.code().into(), piece.segment.into()];
                self.numbered(PIECES, &row)?;
                for degree in 0..COEFFICIENTS {
                    let of_channels = piece.coefficients.iter().skip(degree).step_by(COEFFICIENTS);
                    let row: Vec<f64> = of_channels.copied().collect();
                    self.numbered(PIECE_COEFFICIENTS, &row)?;
                }
                Ok(())
            }

            fn cycle(&mut self, cycle: &Cycle) -> Result<(), RecorderError> {
                let row = [cycle.stick_duration, cycle.slip_duration, cycle.period];
                Ok(self.numbered(STICK_SLIP, &row)?)
            }

            fn stores_events(&self) -> bool {
                true
            }

            fn stores_motion(&self) -> bool {
                TableRows::stores_motion(self)
            }
        }
    )*};
}

record_rows!(KeptRows, super::writer::ResultWriter);

/// "erk-NAME" has the code of "erk".
fn solver_code(solver: &str) -> i8 {
    let named = |name: &str| schema::SOLVERS.iter().find(|flag| flag.1 == name).map(|flag| flag.0);
    named(solver)
        .or_else(|| named(solver.split('-').next().unwrap_or_default()))
        .unwrap_or(-1)
}

/// A table with its columns.
#[derive(Debug, Clone)]
pub struct KeptTable {
    /// Group of the file.
    pub group: &'static str,
    /// Columns in the order of the file, all of one length.
    pub columns: Vec<FileColumn>,
}

impl KeptTable {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }
}

impl From<TableSchema> for KeptTable {
    fn from(schema: TableSchema) -> Self {
        let columns = schema
            .variables
            .into_iter()
            .map(|variable| FileColumn::new(variable, []));
        KeptTable {
            group: schema.group,
            columns: columns.collect(),
        }
    }
}

/// A recorder that keeps all tables of a result file in memory.
#[derive(Debug, Clone, Default)]
pub struct KeptRows {
    /// Tables of every run, then /dense and /dense/coefficients if there is dense output.
    pub tables: Vec<KeptTable>,
    /// Table of each row, in the order of recording. The coefficients of a piece follow the piece.
    pub order: Vec<u8>,
    further: Vec<f64>,
    events_alone: bool,
}

impl KeptRows {
    /// An empty recorder for a run whose files have this extension. With `events_alone` it keeps no samples and no pieces
    /// of the dense output.
    pub fn new(extension: &Extension, events_alone: bool) -> Self {
        KeptRows {
            tables: schema::all_tables(extension).into_iter().map(KeptTable::from).collect(),
            order: Vec::new(),
            further: Vec::new(),
            events_alone,
        }
    }

    /// Removes all rows, and prepares for a run with this extension.
    pub fn begin_again(&mut self, extension: &Extension) {
        *self = KeptRows::new(extension, self.events_alone);
    }
}

impl TableRows for KeptRows {
    fn rows(&self, table: usize) -> usize {
        self.tables.get(table).map_or(0, KeptTable::rows)
    }

    fn take(&mut self, table: usize, row: &[&[f64]]) -> Result<(), ResultError> {
        let of_motion = [TRAJECTORY, PIECES, PIECE_COEFFICIENTS].contains(&table);
        if let Some(kept) = self.tables.get_mut(table).filter(|_| !(of_motion && self.events_alone)) {
            for (column, &value) in kept.columns.iter_mut().zip(row.iter().copied().flatten()) {
                column.values.push(value);
            }
            if table != PIECE_COEFFICIENTS {
                self.order.push(table as u8);
            }
        }
        Ok(())
    }

    fn further(&mut self) -> &mut Vec<f64> {
        &mut self.further
    }

    fn stores_motion(&self) -> bool {
        !self.events_alone
    }
}

/// A view of [`KeptRows`] whose columns may be stored elsewhere.
#[derive(Debug)]
pub struct KeptView<'a> {
    /// Columns of [`KeptRows::tables`]. Further columns of a displayed table, such as the witness's, are not written.
    pub tables: Vec<Vec<ColumnValues<'a>>>,
    /// [`KeptRows::order`].
    pub order: &'a [u8],
}
