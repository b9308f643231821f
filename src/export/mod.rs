//! Exports for programs that cannot read HDF5: tables as CSV, NPZ and MAT, and benchmark packages.
//!
//! | module | contents |
//! |---|---|
//! | `request` | the requested table, columns, rows or times |
//! | `study` | the points of a study |
//! | `formats` | the file formats and their writers |
//! | [`benchmark`] | a certified run as a folder that can be used and cited |
//!
//! Memory is limited: a writer holds one block of rows, and evaluated values wait in a temporary file.

pub mod benchmark;

mod formats;
mod request;
mod study;

pub use formats::Format;
pub use request::{Request, Times, Which, evaluated, read_times, stored};
pub use study::of_study;

use crate::Error;
use crate::output::{Output, Product};
use request::TableColumn;
use serde::Serialize;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use stickslip_files::ResultFile;
use stickslip_files::schema::Variable;

/// The run that a table comes from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TableOrigin {
    /// The program, with its version.
    pub source: String,
    /// Title of the case.
    pub title: String,
    /// The result file.
    pub file: String,
    /// How the run ended: complete, interrupted or failed.
    pub status: String,
    /// Method that gave values between the samples; `None` for the samples themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evaluated: Option<String>,
}

/// A table to export.
#[derive(Debug)]
pub struct Export<'a> {
    /// The table.
    pub table: ExportTable<'a>,
    /// Its origin.
    pub origin: TableOrigin,
    /// Columns that exist only at the samples, and were not requested by name.
    pub left_out: Vec<String>,
}

impl Export<'_> {
    /// Writes the table under a temporary name, which becomes `path` at the end. An identical export is replaced. Any
    /// other file is replaced only with `force`, and an input never.
    ///
    /// # Errors
    /// The file may not be replaced, its folder does not exist, or the disk fails.
    pub fn save(&self, path: &Path, format: Format, inputs: &[PathBuf], force: bool) -> Result<(), Error> {
        let is_own = |path: &Path| format.is_own(path, &self.table);
        let output = Output::replacing(path, Product::Table, inputs, force, is_own)?;
        output.fill(|file| format.write(&self.table, &self.origin, file, path))
    }

    /// Writes the table as CSV to an open sink, such as standard output.
    pub fn stream(&self, sink: impl Write) -> Result<(), Error> {
        let header = formats::csv_header(&self.table.columns);
        formats::csv(&header, &self.table, sink, Path::new("standard output"))
    }
}

pub(super) const BLOCK: usize = 16_384;

#[derive(Debug)]
enum ExportRows<'a> {
    File(&'a ResultFile, Vec<String>, usize),
    /// Temporary file: blocks of rows, each stored column by column.
    Spool(File),
    /// The values of each column.
    Columns(Vec<Vec<f64>>),
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

    pub(super) fn of_columns(name: &str, columns: Vec<Variable>, values: Vec<Vec<f64>>) -> ExportTable<'static> {
        ExportTable {
            name: name.to_owned(),
            columns,
            rows: values.first().map_or(0, Vec::len),
            source: ExportRows::Columns(values),
        }
    }

    /// Reads rows of a column, as doubles.
    pub fn read(&self, column: usize, rows: Range<usize>) -> Result<Vec<f64>, Error> {
        match &self.source {
            ExportRows::File(file, groups, first) => {
                let rows = first + rows.start..first + rows.end;
                Ok(file.table_values(&groups[column], &self.columns[column].name, rows)?)
            }
            ExportRows::Columns(values) => Ok(values[column][rows].to_vec()),
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
