//! File formats of tables.

use super::TableOrigin;
use super::table::ExportTable;
use crate::Error;
use crate::output::Product;
use serde::Serialize;
use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;
use stickslip_files::schema::{StorageKind, Variable};
use stickslip_system::quote;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

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

/// Mark of this program's exports, which CSV cannot store.
const MARK: &str = "stickslip-export";

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
            let header = csv_header(&table.columns);
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
            Format::Csv => csv(&csv_header(&table.columns), table, file, path),
            Format::Npz => npz(table, origin, file, path),
            Format::Mat => mat(table, origin, file, path),
        }
    }
}

/// Names with units in brackets.
pub(super) fn csv_header(columns: &[Variable]) -> String {
    csv_line(columns.iter().map(Variable::header))
}

pub(super) fn csv_line(fields: impl Iterator<Item = String>) -> String {
    fields.map(|field| in_quotes(&field)).collect::<Vec<_>>().join(",") + "\n"
}

fn in_quotes(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

/// Writes comma-separated values. A number is the shortest decimal of the same double, a code is its word, and NaN is
/// `NaN`.
pub(super) fn csv(header: &str, table: &ExportTable, sink: impl Write, path: &Path) -> Result<(), Error> {
    let failed = |error| Product::Table.failed(path, "writing", error);
    let mut sink = BufWriter::new(sink);
    sink.write_all(header.as_bytes()).map_err(failed)?;
    for rows in table.blocks() {
        let columns = (0..table.columns.len())
            .map(|k| table.read(k, rows.clone()))
            .collect::<Result<Vec<_>, _>>()?;
        for row in 0..rows.len() {
            for (k, (column, values)) in table.columns.iter().zip(&columns).enumerate() {
                let (comma, value) = (if k > 0 { "," } else { "" }, values[row]);
                let written = match column.kind {
                    _ if value.is_nan() => write!(sink, "{comma}NaN"),
                    StorageKind::Int8 => write!(sink, "{comma}{}", in_quotes(&column.word(value as i64))),
                    StorageKind::Int32 | StorageKind::Int64 => write!(sink, "{comma}{value:.0}"),
                    StorageKind::Float64 => write!(sink, "{comma}{value:?}"),
                };
                written.map_err(failed)?;
            }
            sink.write_all(b"\n").map_err(failed)?;
        }
    }
    sink.flush().map_err(failed)
}

/// Origin and columns of a table as JSON in ASCII.
fn metadata(table: &ExportTable, origin: &TableOrigin) -> String {
    #[derive(Serialize)]
    struct Metadata<'a> {
        format: &'static str,
        table: &'a str,
        rows: usize,
        #[serde(flatten)]
        origin: &'a TableOrigin,
        columns: Vec<Described<'a>>,
    }
    #[derive(Serialize)]
    struct Described<'a> {
        name: &'a str,
        units: &'a str,
        long_name: &'a str,
        #[serde(skip_serializing_if = "serde_json::Map::is_empty")]
        codes: serde_json::Map<String, serde_json::Value>,
    }
    let columns = table.columns.iter().map(|column| Described {
        name: &column.name,
        units: &column.units,
        long_name: &column.long_name,
        codes: column
            .flags
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
    // JSON writes a character beyond the basic plane as two UTF-16 units.
    let units = quote::in_json(&text, |_| false)
        .encode_utf16()
        .collect::<Vec<_>>()
        .into_iter();
    units
        .map(|unit| match u8::try_from(unit) {
            Ok(letter) if letter.is_ascii() => char::from(letter).to_string(),
            _ => format!("\\u{unit:04x}"),
        })
        .collect()
}

/// Binary values, little-endian: numbers as doubles, integers in 8 bytes, codes in 1 byte.
fn raw(column: &Variable, values: &[f64]) -> Vec<u8> {
    match column.kind {
        StorageKind::Float64 => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        StorageKind::Int32 | StorageKind::Int64 => {
            values.iter().flat_map(|&value| (value as i64).to_le_bytes()).collect()
        }
        StorageKind::Int8 => values.iter().map(|&value| (value as i8).cast_unsigned()).collect(),
    }
}

fn array_header(descr: &str, shape: &str) -> Vec<u8> {
    let mut text = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    let unpadded = 10 + text.len() + 1;
    text.push_str(&" ".repeat(unpadded.next_multiple_of(64) - unpadded));
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((text.len() as u16).to_le_bytes());
    header.extend(text.into_bytes());
    header
}

/// A file that keeps its first error and then pretends to accept everything. An archive that cannot be finished would
/// otherwise print a message on standard error when it is dropped.
struct FirstError<'a> {
    file: &'a File,
    error: &'a RefCell<Option<io::Error>>,
}

impl Write for FirstError<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.error.borrow().is_some() {
            return Ok(bytes.len());
        }
        match self.file.write(bytes) {
            Err(error) if error.kind() != io::ErrorKind::Interrupted => {
                *self.error.borrow_mut() = Some(error);
                Ok(bytes.len())
            }
            written => written,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for FirstError<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Writes a NumPy archive: an array for each column, and one array with the metadata.
fn npz(table: &ExportTable, origin: &TableOrigin, file: &File, path: &Path) -> Result<(), Error> {
    let failed = |error: io::Error| Product::Table.failed(path, "writing", error);
    let error = RefCell::new(None);
    let go_on = || error.take().map_or(Ok(()), |error| Err(failed(error)));
    let mut archive = ZipWriter::new(BufWriter::new(FirstError { file, error: &error }));
    archive.set_comment(MARK).map_err(|error| failed(error.into()))?;
    let member = |archive: &mut ZipWriter<_>, name: &str, bytes: usize, header: Vec<u8>| {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(bytes as u64 > u64::from(u32::MAX) / 2);
        archive.start_file(format!("{name}.npy"), options)?;
        archive.write_all(&header)
    };
    for (k, column) in table.columns.iter().enumerate() {
        let (descr, size) = match column.kind {
            StorageKind::Float64 => ("<f8", 8),
            StorageKind::Int32 | StorageKind::Int64 => ("<i8", 8),
            StorageKind::Int8 => ("|i1", 1),
        };
        let header = array_header(descr, &format!("({},)", table.rows));
        member(&mut archive, &column.name, size * table.rows, header).map_err(failed)?;
        for rows in table.blocks() {
            let values = table.read(k, rows)?;
            archive.write_all(&raw(column, &values)).map_err(failed)?;
            // Nothing is written after an error.
            if error.borrow().is_some() {
                drop(archive);
                return go_on();
            }
        }
    }
    let text = metadata(table, origin);
    let header = array_header(&format!("<U{}", text.len()), "()");
    let units: Vec<u8> = text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
    member(&mut archive, "metadata", 4 * text.len(), header)
        .and_then(|()| archive.write_all(&units))
        .map_err(failed)?;
    let mut sink = archive.finish().map_err(|error| failed(error.into()))?;
    sink.flush().map_err(failed)?;
    go_on()
}

/// Largest variable, bytes. Its size is a 32-bit number, one bit of which readers take for the sign.
const MOST_BYTES: u64 = (1 << 31) - 1024;

const LONGEST_NAME: usize = 63;

const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const INT64: u32 = 12;
const MATRIX: u32 = 14;

const CHAR_CLASS: u32 = 4;
const DOUBLE_CLASS: u32 = 6;
const INT8_CLASS: u32 = 8;
const INT64_CLASS: u32 = 14;

fn pair(a: u32, b: u32) -> Vec<u8> {
    [a.to_le_bytes(), b.to_le_bytes()].concat()
}

/// A data element: tag, data, and padding to a multiple of 8 bytes. Data of up to 4 bytes are stored in the tag.
fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let mut found = match bytes.len() {
        size @ 1..=4 => (kind | (size as u32) << 16).to_le_bytes().to_vec(),
        size => pair(kind, size as u32),
    };
    found.extend(bytes);
    found.resize(found.len().next_multiple_of(8), 0);
    found
}

fn array_head(class: u32, rows: usize, columns: usize, name: &str) -> Vec<u8> {
    let mut found = element(UINT32, &pair(class, 0));
    found.extend(element(INT32, &pair(rows as u32, columns as u32)));
    found.extend(element(INT8, name.as_bytes()));
    found
}

/// Writes a MAT-file, level 5 ("MAT-File Format", The MathWorks): a column vector for each column, and the metadata for
/// `jsondecode`.
fn mat(table: &ExportTable, origin: &TableOrigin, file: &File, path: &Path) -> Result<(), Error> {
    let failed = |error: io::Error| Product::Table.failed(path, "writing", error);
    if 8 * table.rows as u64 > MOST_BYTES {
        return Err(Error::input(format!(
            "{}: a variable of a MAT-file of level 5 has at most 2 GB, and {} rows take more; export .npz, or a --window",
            path.display(),
            table.rows
        )));
    }
    let mut sink = BufWriter::new(file);
    // The header is a text of 116 bytes, 8 empty bytes, version and byte order.
    let mut start = format!("MATLAB 5.0 MAT-file, {MARK}, {}", origin.source).into_bytes();
    start.retain(u8::is_ascii);
    start.resize(116, b' ');
    start.extend([0; 8]);
    start.extend(0x0100u16.to_le_bytes());
    start.extend(b"IM");
    sink.write_all(&start).map_err(failed)?;
    for (k, column) in table.columns.iter().enumerate() {
        let (kind, class, size) = match column.kind {
            StorageKind::Float64 => (DOUBLE, DOUBLE_CLASS, 8),
            StorageKind::Int32 | StorageKind::Int64 => (INT64, INT64_CLASS, 8),
            StorageKind::Int8 => (INT8, INT8_CLASS, 1),
        };
        let name: String = column.name.chars().take(LONGEST_NAME).collect();
        let mut head = array_head(class, table.rows, 1, &name);
        let bytes = size * table.rows;
        if (1..=4).contains(&bytes) {
            head.extend(element(kind, &raw(column, &table.read(k, 0..table.rows)?)));
            sink.write_all(&element(MATRIX, &head)).map_err(failed)?;
            continue;
        }
        let padded = bytes.next_multiple_of(8);
        let whole = head.len() + 8 + padded;
        let start = [pair(MATRIX, whole as u32), head, pair(kind, bytes as u32)].concat();
        sink.write_all(&start).map_err(failed)?;
        for rows in table.blocks() {
            sink.write_all(&raw(column, &table.read(k, rows)?)).map_err(failed)?;
        }
        sink.write_all(&vec![0; padded - bytes]).map_err(failed)?;
    }
    let text = metadata(table, origin);
    let units: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let mut array = array_head(CHAR_CLASS, 1, text.len(), "metadata");
    array.extend(element(UINT16, &units));
    sink.write_all(&element(MATRIX, &array))
        .and_then(|()| sink.flush())
        .map_err(failed)
}
