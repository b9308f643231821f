//! Rows of a run in memory, with the columns of a result file.

use super::ResultError;
use super::rows::{PIECE_COEFFICIENTS, PIECES, TRAJECTORY, TableRows};
use super::schema::{self, Extension, TableSchema};
use super::values::{ColumnValues, FileColumn};

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
        KeptTable {
            group: schema.group,
            columns: schema
                .variables
                .into_iter()
                .map(|variable| FileColumn::new(variable, []))
                .collect(),
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
