//! Exports for programs that cannot read HDF5: tables as CSV, NPZ and MAT, and benchmark packages.
//!
//! | module | contents |
//! |---|---|
//! | `table` | columns read block by block, from a file or from evaluated values |
//! | `request` | the requested table, columns, rows or times |
//! | `metadata` | origin and columns of a table |
//! | `formats` | the file formats |
//! | `csv`, `npz`, `mat` | the writers |
//! | [`benchmark`] | a certified run as a folder that can be used and cited |
//!
//! Memory is limited: a writer holds one block of rows, and evaluated values wait in a temporary file.

pub mod benchmark;

mod csv;
mod formats;
mod mat;
mod metadata;
mod npz;
mod request;
mod table;

pub use formats::Format;
pub use metadata::TableOrigin;
pub use request::{Request, Times, Which, evaluated, read_times, span, stored};
pub use table::ExportTable;

use crate::Error;
use crate::output::{Output, Product};
use std::io::Write;
use std::path::{Path, PathBuf};

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
        let header = csv::header(&self.table.columns);
        csv::write(&header, &self.table, sink, Path::new("standard output"))
    }
}
