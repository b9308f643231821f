//! Tables to export, with columns that can be read in any order, block by block.

use super::request::TableColumn;
use crate::Error;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::ops::Range;
use stickslip_files::ResultFile;
use stickslip_files::schema::Variable;

pub(super) const BLOCK: usize = 16_384;

#[derive(Debug)]
enum ExportRows<'a> {
    File(&'a ResultFile, Vec<String>, usize),
    /// Temporary file: blocks of rows, each stored column by column.
    Spool(File),
}

/// A table to export.
#[derive(Debug)]
pub struct ExportTable<'a> {
    /// Name, such as "trajectory".
    pub name: String,
    /// Columns in their order.
    pub columns: Vec<Variable>,
    /// Number of rows.
    pub rows: usize,
    source: ExportRows<'a>,
}

impl<'a> ExportTable<'a> {
    pub(super) fn of_file(
        name: &str,
        file: &'a ResultFile,
        columns: Vec<TableColumn>,
        rows: Range<usize>,
    ) -> ExportTable<'a> {
        let (columns, groups) = columns.into_iter().unzip();
        ExportTable {
            name: name.to_owned(),
            columns,
            rows: rows.len(),
            source: ExportRows::File(file, groups, rows.start),
        }
    }

    /// Reads rows of a column, as doubles.
    pub fn read(&self, column: usize, rows: Range<usize>) -> Result<Vec<f64>, Error> {
        match &self.source {
            ExportRows::File(file, groups, first) => {
                let rows = first + rows.start..first + rows.end;
                Ok(file.table_values(&groups[column], &self.columns[column].name, rows)?)
            }
            ExportRows::Spool(file) => {
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

    fn stored(&self, mut file: &File, place: usize, count: usize) -> Result<Vec<f64>, Error> {
        let mut bytes = vec![0; 8 * count];
        file.seek(SeekFrom::Start(8 * place as u64)).map_err(Error::temporary)?;
        file.read_exact(&mut bytes).map_err(Error::temporary)?;
        let number = |raw: &[u8]| f64::from_le_bytes(raw.try_into().unwrap_or_default());
        Ok(bytes.chunks_exact(8).map(number).collect())
    }

    pub(super) fn blocks(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let rows = self.rows;
        (0..rows)
            .step_by(BLOCK)
            .map(move |start| start..rows.min(start + BLOCK))
    }
}

#[derive(Debug)]
pub(super) struct Spool {
    file: File,
    rows: usize,
}

impl Spool {
    pub(super) fn new() -> Result<Spool, Error> {
        Ok(Spool {
            file: tempfile::tempfile().map_err(Error::temporary)?,
            rows: 0,
        })
    }

    /// Adds the columns of [`BLOCK`] rows; the last block may be shorter.
    pub(super) fn push(&mut self, columns: &[Vec<f64>]) -> Result<(), Error> {
        self.rows += columns.first().map_or(0, Vec::len);
        let bytes: Vec<u8> = columns.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        self.file.write_all(&bytes).map_err(Error::temporary)
    }

    pub(super) fn finish(self, name: &str, columns: Vec<Variable>) -> ExportTable<'static> {
        ExportTable {
            name: name.to_owned(),
            columns,
            rows: self.rows,
            source: ExportRows::Spool(self.file),
        }
    }
}
