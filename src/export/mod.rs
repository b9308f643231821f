//! What a result file holds, for programs that read no HDF5: tables as CSV, NPZ, MAT and Parquet, and benchmark packages.
//!
//! | module | what it is |
//! |---|---|
//! | `table` | columns that are read block by block, of a file or of values that were evaluated |
//! | `request` | which table, which columns, which rows or times |
//! | `metadata` | what a table is from, and what the formats say of it |
//! | `formats` | the formats by their names |
//! | `csv`, `npz`, `mat`, `parquet` | the writers |
//! | [`benchmark`] | a certified run as a folder that others can use and cite |
//! | `error` | why a table cannot be exported |
//!
//! Memory is bounded: no writer holds more than a block of rows, and what is evaluated waits in a temporary file.

pub mod benchmark;

mod csv;
mod error;
mod formats;
mod mat;
mod metadata;
mod npz;
mod parquet;
mod request;
mod table;

pub use error::ExportError;
pub use formats::Format;
pub use metadata::Origin;
pub use request::{Request, Times, Which, evaluated, read_times, span, stored};
pub use table::{Column, Kind, Table};

use crate::results::disk::{Obstacle, in_the_way, misplaced, temporary_in};
use crate::results::folder_of;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A table with what it is from, and the columns that it leaves out.
#[derive(Debug)]
pub struct Export<'a> {
    /// What is exported.
    pub table: Table<'a>,
    /// Where it is from.
    pub origin: Origin,
    /// Columns of the file that are known at its samples alone, and were not asked for by name.
    pub left_out: Vec<String>,
}

impl Export<'_> {
    /// Writes it under a temporary name, which becomes `path` when all is written. An earlier export of the program is replaced
    /// (of CSV one with the same header), any other file only with `force`, and none of the `inputs`.
    ///
    /// # Errors
    /// A file that is not to be replaced, a folder that is missing, or one of the disk.
    pub fn save(&self, path: &Path, format: Format, inputs: &[PathBuf], force: bool) -> Result<(), ExportError> {
        check_target(path, inputs, force, |path| format.is_own(path, &self.table))?;
        let failed = |error| ExportError::io(path, "writing", error);
        let file = temporary_in(&folder_of(path)).map_err(failed)?;
        format.write(&self.table, &self.origin, file.as_file(), path)?;
        file.persist(path).map_err(|error| failed(error.error))?;
        Ok(())
    }

    /// Writes it as CSV to what is open already, such as standard output.
    ///
    /// # Errors
    /// Of the file or the sink.
    pub fn stream(&self, sink: impl Write) -> Result<(), ExportError> {
        let header = csv::header(&self.table.columns);
        csv::write(&header, &self.table, sink, Path::new("standard output"))
    }
}

/// Whether a file may be written.
fn check_target(
    path: &Path,
    inputs: &[PathBuf],
    force: bool,
    is_own: impl Fn(&Path) -> std::io::Result<bool>,
) -> Result<(), ExportError> {
    let is_own = |path: &Path| is_own(path).map_err(|error| ExportError::io(path, "reading the file", error));
    let obstacle = match misplaced(path, inputs) {
        Some(obstacle) => Some(obstacle),
        None => in_the_way(path, force, is_own)?,
    };
    let what = match obstacle {
        None => return Ok(()),
        Some(Obstacle::Folder) => "this is a folder; name a file in it with -o",
        Some(Obstacle::NoFileName) => "not a usable file name; name a file with -o",
        Some(Obstacle::NoFolder(_)) => "the folder does not exist; create it, or choose another with -o",
        Some(Obstacle::Input) => "this is the file to be exported; choose another name with -o",
        Some(Obstacle::PipeOrDevice) => {
            "a pipe or a device, which no file replaces; choose another name with -o, or - for standard output"
        }
        Some(Obstacle::Protected) => "write-protected; choose another name with -o, or replace it with --force",
        Some(Obstacle::NotOwn) => {
            "there already, and not an earlier export of this table; choose another name with -o, or replace it with --force"
        }
        Some(Obstacle::NotSeen(error)) => return Err(ExportError::io(path, "looking at the file", error)),
    };
    Err(ExportError::Asked(format!("{}: {what}", path.display())))
}
