//! Exports for programs that cannot read HDF5: tables as CSV, NPZ and MAT, and benchmark packages.
//!
//! | module | contents |
//! |---|---|
//! | `table` | columns read block by block, from a file or from evaluated values |
//! | `request` | the requested table, columns, rows or times |
//! | `formats` | the file formats and their writers |
//! | [`benchmark`] | a certified run as a folder that can be used and cited |
//!
//! Memory is limited: a writer holds one block of rows, and evaluated values wait in a temporary file.

pub mod benchmark;

mod formats;
mod request;
mod table;

pub use formats::Format;
pub use request::{Request, Times, Which, evaluated, read_times, stored};
pub use table::ExportTable;

use crate::Error;
use crate::output::{Output, Product};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

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
    /// Writes the table under a temporary name, which becomes `path` at the end. An earlier export (for CSV: one with
    /// the same header) is replaced. Any other file is replaced only with `force`, and an input never.
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
