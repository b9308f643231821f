//! The file formats of tables, and what all of them say of their columns.

use super::table::{Column, Kind, Table};
use super::{ExportError, csv, mat, npz, parquet};
use crate::quote;
use serde::Serialize;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// The format of an exported table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values, UTF-8.
    Csv,
    /// An archive of NumPy, an array for each column.
    Npz,
    /// A MAT-file, level 5, a column vector for each column.
    Mat,
    /// Apache Parquet, uncompressed.
    Parquet,
}

/// By which the program knows what it has exported; CSV has no place for it.
pub(super) const MARK: &str = "stickslip-export";

/// Bytes at either end of a file in which the mark stands.
const REACH: u64 = 1 << 16;

impl Format {
    /// Every format.
    pub const ALL: [Format; 4] = [Format::Csv, Format::Npz, Format::Mat, Format::Parquet];

    /// Its name, which is also the extension of its files.
    pub fn name(self) -> &'static str {
        match self {
            Format::Csv => "csv",
            Format::Npz => "npz",
            Format::Mat => "mat",
            Format::Parquet => "parquet",
        }
    }

    /// By the extension of a file name.
    pub fn of_path(path: &Path) -> Option<Format> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Format::ALL.into_iter().find(|format| format.name() == extension)
    }

    /// Whether the file at `path` is an export of this program in this format; a CSV file is taken for one by its header, which
    /// is that of the table.
    pub(super) fn is_own(self, path: &Path, table: &Table) -> io::Result<bool> {
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

    /// Writes a table to an open file.
    ///
    /// # Errors
    /// The table cannot be read, or the file not be written, or the format has no room for so many rows.
    pub(super) fn write(self, table: &Table, origin: &Origin, file: &File, path: &Path) -> Result<(), ExportError> {
        match self {
            Format::Csv => csv::write(table, file, path),
            Format::Npz => npz::write(table, origin, file, path),
            Format::Mat => mat::write(table, origin, file, path),
            Format::Parquet => parquet::write(table, origin, file, path),
        }
    }
}

/// What a table is from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Origin {
    /// The program, with its version.
    pub source: String,
    /// Of the case.
    pub title: String,
    /// The result file.
    pub file: String,
    /// How the run ended: complete, interrupted or failed.
    pub status: String,
    /// How values between the samples were obtained; `None` of the samples themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evaluated: Option<String>,
}

/// What formats with a place for it say of a table, as JSON in ASCII.
pub(super) fn metadata(table: &Table, origin: &Origin) -> String {
    #[derive(Serialize)]
    struct Metadata<'a> {
        format: &'static str,
        table: &'a str,
        rows: usize,
        #[serde(flatten)]
        origin: &'a Origin,
        columns: Vec<Described<'a>>,
    }
    #[derive(Serialize)]
    struct Described<'a> {
        name: &'a str,
        units: &'a str,
        long_name: &'a str,
        /// Code by word.
        #[serde(skip_serializing_if = "serde_json::Map::is_empty")]
        codes: serde_json::Map<String, serde_json::Value>,
    }
    let columns = table.columns.iter().map(|column| Described {
        name: &column.name,
        units: &column.units,
        long_name: &column.long_name,
        codes: column
            .meanings
            .iter()
            .map(|(code, word)| (word.clone(), (*code).into()))
            .collect(),
    });
    let document = Metadata {
        format: MARK,
        table: &table.name,
        rows: table.rows,
        origin,
        columns: columns.collect(),
    };
    let text = serde_json::to_string(&document).unwrap_or_default();
    // Characters beyond the first plane are two units of UTF-16 there.
    let mut ascii = String::with_capacity(text.len());
    for c in quote::in_json(&text, |_| false).chars() {
        if c.is_ascii() {
            ascii.push(c);
        } else {
            let mut units = [0; 2];
            for unit in c.encode_utf16(&mut units) {
                ascii.push_str(&format!("\\u{unit:04x}"));
            }
        }
    }
    ascii
}

/// How many bytes a whole number of a column takes: 1 for codes, 8 for others.
pub(super) fn is_short(column: &Column) -> bool {
    matches!(column.kind, Kind::Code | Kind::Boolean)
}
