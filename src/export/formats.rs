//! File formats of tables.

use super::metadata::{MARK, TableOrigin};
use super::table::ExportTable;
use super::{Error, csv, mat, npz};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// The format of an exported table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
    /// Comma-separated values, UTF-8.
    Csv,
    /// An archive of NumPy, an array for each column.
    Npz,
    /// A MAT-file, level 5, a column vector for each column.
    Mat,
}

/// Number of bytes at either end of a file in which the mark is searched.
const REACH: u64 = 1 << 16;

impl Format {
    /// All formats.
    pub const ALL: [Format; 3] = [Format::Csv, Format::Npz, Format::Mat];

    /// The name, which is also the file extension.
    pub fn name(self) -> &'static str {
        match self {
            Format::Csv => "csv",
            Format::Npz => "npz",
            Format::Mat => "mat",
        }
    }

    /// The format to which the extension of a file name belongs.
    pub fn of_path(path: &Path) -> Option<Format> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Format::ALL.into_iter().find(|format| format.name() == extension)
    }

    /// Whether `path` is an earlier export in this format. A CSV file is recognised by its header.
    pub(super) fn is_own(self, path: &Path, table: &ExportTable) -> io::Result<bool> {
        let mut file = File::open(path)?;
        let mut bytes = Vec::new();
        if self == Format::Csv {
            let header = csv::header(&table.columns);
            (&file).take(header.len() as u64).read_to_end(&mut bytes)?;
            return Ok(bytes == header.as_bytes());
        }
        (&file).take(REACH).read_to_end(&mut bytes)?;
        let length = file.seek(SeekFrom::End(0))?;
        if length > REACH {
            file.seek(SeekFrom::Start(length.saturating_sub(REACH).max(REACH)))?;
            file.read_to_end(&mut bytes)?;
        }
        Ok(bytes.windows(MARK.len()).any(|window| window == MARK.as_bytes()))
    }

    pub(super) fn write(
        self,
        table: &ExportTable,
        origin: &TableOrigin,
        file: &File,
        path: &Path,
    ) -> Result<(), Error> {
        match self {
            Format::Csv => csv::write(&csv::header(&table.columns), table, file, path),
            Format::Npz => npz::write(table, origin, file, path),
            Format::Mat => mat::write(table, origin, file, path),
        }
    }
}
