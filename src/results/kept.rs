//! The rows of a run kept in memory, in the columns of a result file.

use super::cells::{self, EVENTS, SEGMENTS, STICK_SLIP, TRAJECTORY};
use super::schema::{self, Extension, Table};
use super::table::{Cell, Values};
use super::{Status, StickSlipTable, WitnessAttributes};
use crate::numerics::chebyshev::COEFFICIENTS;
use crate::record::{Cycle, Event, Piece, Recorder, RecorderError, Sample, Segment};

/// Position of the pieces of the dense output after the tables that all runs have; their coefficients come after them.
pub(super) const PIECES: usize = STICK_SLIP + 1;

/// A table with its columns.
#[derive(Debug, Clone)]
pub struct KeptTable {
    /// Name, unit and description of each column.
    pub schema: Table,
    /// In the order of `schema.variables`, all of one length.
    pub columns: Vec<Values>,
}

impl KeptTable {
    fn new(schema: Table) -> Self {
        let columns = schema.variables.iter().map(|variable| Values::new(variable.kind, 0));
        KeptTable {
            columns: columns.collect(),
            schema,
        }
    }

    fn push(&mut self, cells: impl IntoIterator<Item = Cell>) {
        for (column, cell) in self.columns.iter_mut().zip(cells) {
            column.push(cell);
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.view().len())
    }

    fn next_index(&self) -> i32 {
        i32::try_from(self.rows()).unwrap_or(i32::MAX)
    }
}

/// A recorder that keeps in memory all that a result file of the run has, in the same columns.
#[derive(Debug, Clone)]
pub struct KeptRows {
    /// Those of every run, and /dense and /dense/coefficients of one with dense output.
    pub tables: Vec<KeptTable>,
    /// The tables in which the rows were recorded, one after the other.
    pub order: Vec<u8>,
    /// Of the row that comes next.
    further: Vec<f64>,
    events_alone: bool,
}

impl KeptRows {
    /// For a run whose files have this beyond the tables of all.
    pub fn new(extension: &Extension) -> Self {
        let tables = schema::extended_tables(extension);
        let dense = extension.dense.then(|| schema::dense_tables(&tables[TRAJECTORY]));
        let tables = tables.into_iter().chain(dense.into_iter().flatten());
        KeptRows {
            tables: tables.map(KeptTable::new).collect(),
            order: Vec::new(),
            further: Vec::new(),
            events_alone: false,
        }
    }

    /// Keeps no sample and no piece: none are made around events.
    pub fn events_alone(mut self) -> Self {
        self.events_alone = true;
        self
    }

    fn record(&mut self, table: usize, cells: impl IntoIterator<Item = Cell>) {
        self.tables[table].push(cells);
        self.order.push(table as u8);
    }
}

impl Recorder for KeptRows {
    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        self.further.clear();
        self.further.extend_from_slice(values);
        Ok(())
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        if self.events_alone {
            return Ok(());
        }
        let further = std::mem::take(&mut self.further);
        self.record(TRAJECTORY, cells::of_sample(sample, &further));
        self.further = further;
        Ok(())
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        let further = std::mem::take(&mut self.further);
        let index = self.tables[EVENTS].next_index();
        self.record(EVENTS, cells::of_event(index, event, &further));
        self.further = further;
        Ok(())
    }

    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        let index = self.tables[SEGMENTS].next_index();
        self.record(SEGMENTS, cells::of_segment(index, segment));
        Ok(())
    }

    fn piece(&mut self, piece: &Piece<'_>) -> Result<(), RecorderError> {
        if self.tables.len() > PIECES && !self.events_alone {
            let index = self.tables[PIECES].next_index();
            self.record(PIECES, cells::of_piece(index, piece));
            let coefficients = &mut self.tables[PIECES + 1];
            for degree in 0..COEFFICIENTS {
                let number = coefficients.next_index();
                coefficients.push(cells::of_coefficients(number, piece, degree));
            }
        }
        Ok(())
    }

    fn cycle(&mut self, cycle: &Cycle) -> Result<(), RecorderError> {
        let index = self.tables[STICK_SLIP].next_index();
        self.record(STICK_SLIP, cells::of_cycle(index, cycle));
        Ok(())
    }

    fn stores_events(&self) -> bool {
        true
    }

    fn stores_motion(&self) -> bool {
        !self.events_alone
    }
}

/// The values of a column, wherever they are.
#[derive(Debug, Clone, Copy)]
pub enum ValuesView<'a> {
    /// Codes.
    Int8(&'a [i8]),
    /// Indices.
    Int32(&'a [i32]),
    /// Counts.
    Int64(&'a [i64]),
    /// Quantities.
    Float64(&'a [f64]),
}

impl ValuesView<'_> {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            ValuesView::Int8(values) => values.len(),
            ValuesView::Int32(values) => values.len(),
            ValuesView::Int64(values) => values.len(),
            ValuesView::Float64(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn cell(&self, row: usize) -> Cell {
        match self {
            ValuesView::Int8(values) => Cell::I8(values[row]),
            ValuesView::Int32(values) => Cell::I32(values[row]),
            ValuesView::Int64(values) => Cell::I64(values[row]),
            ValuesView::Float64(values) => Cell::F64(values[row]),
        }
    }
}

impl Values {
    /// The values.
    pub fn view(&self) -> ValuesView<'_> {
        match self {
            Values::Int8(values) => ValuesView::Int8(values),
            Values::Int32(values) => ValuesView::Int32(values),
            Values::Int64(values) => ValuesView::Int64(values),
            Values::Float64(values) => ValuesView::Float64(values),
        }
    }
}

/// [`KeptRows`] whose columns may have gone elsewhere.
#[derive(Debug)]
pub struct KeptView<'a> {
    /// The columns of [`KeptRows::tables`].
    pub tables: Vec<Vec<ValuesView<'a>>>,
    /// That of [`KeptRows`].
    pub order: &'a [u8],
}

impl KeptView<'_> {
    pub(super) fn cells(&self, table: usize, row: usize) -> impl Iterator<Item = Cell> {
        self.tables[table].iter().map(move |column| column.cell(row))
    }
}

/// What a result file says of its run beside its rows.
#[derive(Debug)]
pub struct KeptEnd<'a> {
    /// How it ended.
    pub status: &'a Status,
    /// The attributes of /stick_slip, and rows after those that were recorded.
    pub stick_slip: &'a StickSlipTable,
    /// What another method made of the case.
    pub witness: Option<&'a WitnessAttributes>,
    /// s.
    pub wall_time: f64,
}
