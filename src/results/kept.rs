//! The rows of a run kept in memory, in the columns of a result file.

use super::rows::{PIECE_COEFFICIENTS, PIECES, TRAJECTORY, TableRows};
use super::schema::{self, Extension, Table};
use super::values::Values;
use super::{Addition, ResultError, Status, StickSlipTable};

/// A table with its columns.
#[derive(Debug, Clone)]
pub struct KeptTable {
    /// Name, unit and description of each column.
    pub schema: Table,
    /// In the order of `schema.variables`, all of one length.
    pub columns: Vec<Values<'static>>,
}

impl KeptTable {
    fn new(schema: Table) -> Self {
        let columns = schema.variables.iter().map(|variable| Values::new(variable.kind, 0));
        KeptTable {
            columns: columns.collect(),
            schema,
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Values::len)
    }
}

/// A recorder that keeps in memory all that a result file of the run has, in the same columns.
#[derive(Debug, Clone)]
pub struct KeptRows {
    /// Those of every run, and /dense and /dense/coefficients of one with dense output.
    pub tables: Vec<KeptTable>,
    /// The tables in which the rows were recorded, one after the other. The coefficients of a piece follow the piece.
    pub order: Vec<u8>,
    further: Vec<f64>,
    events_alone: bool,
}

impl KeptRows {
    /// For a run whose files have this beyond the tables of all.
    pub fn new(extension: &Extension) -> Self {
        KeptRows {
            tables: schema::all_tables(extension).into_iter().map(KeptTable::new).collect(),
            order: Vec::new(),
            further: Vec::new(),
            events_alone: false,
        }
    }

    /// The same without rows, for a run with this extension.
    pub(crate) fn emptied(self, extension: &Extension) -> Self {
        KeptRows {
            events_alone: self.events_alone,
            ..KeptRows::new(extension)
        }
    }

    /// Keeps no sample and no piece: none are made around events.
    pub fn events_alone(mut self) -> Self {
        self.events_alone = true;
        self
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
                column.push(value);
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

/// [`KeptRows`] whose columns may have gone elsewhere.
#[derive(Debug)]
pub struct KeptView<'a> {
    /// The columns of [`KeptRows::tables`].
    pub tables: Vec<Vec<Values<'a>>>,
    /// That of [`KeptRows`].
    pub order: &'a [u8],
}

impl KeptView<'_> {
    pub(super) fn row(&self, table: usize, row: usize) -> Vec<f64> {
        self.tables[table].iter().map(|column| column.at(row)).collect()
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
    pub witness: &'a [Addition],
    /// s.
    pub wall_time: f64,
}
