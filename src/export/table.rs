//! A table to be exported: columns that can be read in any order, a block of rows at a time.

use super::ExportError;
use crate::results::ResultFile;
use serde::Serialize;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::ops::Range;

/// Rows that are read or written at a time.
pub(super) const BLOCK: usize = 16_384;

/// How the values of a column are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Doubles.
    Number,
    /// Whole numbers.
    Whole,
    /// Whole numbers that stand for words.
    Code,
}

/// One column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// As in the result file.
    pub name: String,
    /// UDUNITS; "1" of a pure number.
    pub units: String,
    /// Description.
    pub long_name: String,
    /// How its values are stored.
    pub kind: Kind,
    /// What codes stand for; empty where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub meanings: Vec<(i64, String)>,
}

impl Column {
    /// Its name with its unit, as the header of a table has it.
    pub fn header(&self) -> String {
        match self.units.as_str() {
            "" | "1" => self.name.clone(),
            units => format!("{} [{units}]", self.name),
        }
    }

    /// The word of a code; the code itself where it has none.
    pub(super) fn word(&self, value: f64) -> String {
        let code = value as i64;
        let known = self.meanings.iter().find(|(known, _)| *known == code);
        known.map_or_else(|| code.to_string(), |(_, word)| word.clone())
    }
}

/// Where the rows of a table are.
#[derive(Debug)]
enum Rows<'a> {
    /// Variables of a result file by their groups, from a row of the file on.
    File(&'a ResultFile, Vec<String>, usize),
    /// A temporary file, in which each block of rows is stored column by column.
    Spool(File),
}

/// See the module.
#[derive(Debug)]
pub struct Table<'a> {
    /// Its name, such as "trajectory".
    pub name: String,
    /// In their order.
    pub columns: Vec<Column>,
    /// How many rows it has.
    pub rows: usize,
    source: Rows<'a>,
}

impl<'a> Table<'a> {
    /// Rows of a result file; each column with the group that holds it.
    pub(super) fn of_file(
        name: &str,
        file: &'a ResultFile,
        columns: Vec<(Column, String)>,
        rows: Range<usize>,
    ) -> Table<'a> {
        let (columns, groups) = columns.into_iter().unzip();
        Table {
            name: name.to_owned(),
            columns,
            rows: rows.len(),
            source: Rows::File(file, groups, rows.start),
        }
    }

    /// Rows of a column.
    ///
    /// # Errors
    /// Of the file.
    pub fn read(&self, column: usize, rows: Range<usize>) -> Result<Vec<f64>, ExportError> {
        match &self.source {
            Rows::File(file, groups, first) => {
                let rows = first + rows.start..first + rows.end;
                Ok(file.table_values(&groups[column], &self.columns[column].name, rows)?)
            }
            Rows::Spool(file) => {
                let mut values = Vec::with_capacity(rows.len());
                let mut at = rows.start;
                while at < rows.end {
                    let (block, within) = (at / BLOCK, at % BLOCK);
                    let height = BLOCK.min(self.rows - block * BLOCK);
                    let count = (height - within).min(rows.end - at);
                    let place = block * BLOCK * self.columns.len() + column * height + within;
                    values.extend(self.stored(file, place, count)?);
                    at += count;
                }
                Ok(values)
            }
        }
    }

    fn stored(&self, mut file: &File, place: usize, count: usize) -> Result<Vec<f64>, ExportError> {
        let failed = |error| ExportError::io(&std::env::temp_dir(), "reading back a temporary file", error);
        let mut bytes = vec![0; 8 * count];
        file.seek(SeekFrom::Start(8 * place as u64)).map_err(failed)?;
        file.read_exact(&mut bytes).map_err(failed)?;
        let number = |raw: &[u8]| f64::from_le_bytes(raw.try_into().unwrap_or_default());
        Ok(bytes.chunks_exact(8).map(number).collect())
    }

    /// The ranges that cover all rows, block by block.
    pub(super) fn blocks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let rows = self.rows;
        (0..rows)
            .step_by(BLOCK)
            .map(move |start| start..rows.min(start + BLOCK))
    }
}

/// Takes the rows of a table one after the other into a temporary file.
#[derive(Debug)]
pub(super) struct Spool {
    file: File,
    block: Vec<Vec<f64>>,
    rows: usize,
}

impl Spool {
    pub(super) fn new(columns: usize) -> Result<Spool, ExportError> {
        let failed = |error| ExportError::io(&std::env::temp_dir(), "creating a temporary file", error);
        Ok(Spool {
            file: tempfile::tempfile().map_err(failed)?,
            block: vec![Vec::with_capacity(BLOCK); columns],
            rows: 0,
        })
    }

    pub(super) fn push(&mut self, row: &[f64]) -> Result<(), ExportError> {
        for (column, value) in self.block.iter_mut().zip(row) {
            column.push(*value);
        }
        self.rows += 1;
        if self.rows.is_multiple_of(BLOCK) {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), ExportError> {
        let mut bytes = Vec::with_capacity(8 * BLOCK * self.block.len());
        for column in &mut self.block {
            bytes.extend(column.iter().flat_map(|value| value.to_le_bytes()));
            column.clear();
        }
        let failed = |error| ExportError::io(&std::env::temp_dir(), "writing a temporary file", error);
        self.file.write_all(&bytes).map_err(failed)
    }

    pub(super) fn finish(mut self, name: &str, columns: Vec<Column>) -> Result<Table<'static>, ExportError> {
        self.flush()?;
        Ok(Table {
            name: name.to_owned(),
            columns,
            rows: self.rows,
            source: Rows::Spool(self.file),
        })
    }
}
