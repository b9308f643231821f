//! Exports for programs that cannot read HDF5: tables as CSV, NPZ and MAT, and benchmark packages.
//!
//! | module | contents |
//! |---|---|
//! | `table` | columns read block by block, from a file or from evaluated values |
//! | `request` | the requested table, columns, rows or times |
//! | `formats` | the file formats and their writers |
//! | [`benchmark`] | a certified run as a folder that can be used and cited |
//! | `error` | errors of exports |
//!
//! Memory is limited: a writer holds one block of rows, and evaluated values wait in a temporary file.

pub mod benchmark;

mod error;
mod formats;
mod request;
mod table;

pub use error::ExportError;
pub use formats::Format;
pub use request::{Request, Times, Which, evaluated, read_times, stored};
pub use table::ExportTable;

use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use stickslip_files::disk::{Obstacle, Temporary, in_the_way, misplaced};
use stickslip_files::folder_of;

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
    pub fn save(&self, path: &Path, format: Format, inputs: &[PathBuf], force: bool) -> Result<(), ExportError> {
        check_target(path, inputs, force, |path| format.is_own(path, &self.table))?;
        let failed = |error| ExportError::io(path, "writing", error);
        let file = Temporary::create(&folder_of(path)).map_err(failed)?;
        format.write(&self.table, &self.origin, file.file(), path)?;
        file.persist(path).map_err(failed)
    }

    /// Writes the table as CSV to an open sink, such as standard output.
    pub fn stream(&self, sink: impl Write) -> Result<(), ExportError> {
        let header = formats::csv_header(&self.table.columns);
        formats::csv(&header, &self.table, sink, Path::new("standard output"))
    }
}

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
