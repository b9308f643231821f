//! Writer of MAT-files, level 5 ("MAT-File Format", The MathWorks): a column vector for each column, and the metadata
//! as a JSON text for `jsondecode`.

use super::metadata::{MARK, TableOrigin, metadata, raw};
use super::table::ExportTable;
use crate::Error;
use crate::output::Product;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use stickslip_files::schema::StorageKind;

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

/// A data element: tag, data, and padding to a multiple of 8 bytes. Data of up to 4 bytes are stored in the tag.
fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
    let mut found = Vec::with_capacity(bytes.len() + 16);
    if bytes.len() <= 4 && !bytes.is_empty() {
        found.extend((kind | (bytes.len() as u32) << 16).to_le_bytes());
        found.extend(bytes);
    } else {
        found.extend(kind.to_le_bytes());
        found.extend((bytes.len() as u32).to_le_bytes());
        found.extend(bytes);
    }
    found.resize(found.len().next_multiple_of(8), 0);
    found
}

fn head(class: u32, rows: usize, columns: usize, name: &str) -> Vec<u8> {
    let pair = |a: u32, b: u32| [a.to_le_bytes(), b.to_le_bytes()].concat();
    let mut found = element(UINT32, &pair(class, 0));
    found.extend(element(INT32, &pair(rows as u32, columns as u32)));
    found.extend(element(INT8, name.as_bytes()));
    found
}

pub(super) fn write(table: &ExportTable, origin: &TableOrigin, file: &File, path: &Path) -> Result<(), Error> {
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
        let head = head(class, table.rows, 1, &name);
        let bytes = size * table.rows;
        let small = (1..=4).contains(&bytes);
        let padded = bytes.next_multiple_of(8);
        let whole = head.len() + if small { 8 } else { 8 + padded };
        sink.write_all(&[MATRIX.to_le_bytes(), (whole as u32).to_le_bytes()].concat())
            .and_then(|()| sink.write_all(&head))
            .map_err(failed)?;
        if small {
            let values = table.read(k, 0..table.rows)?;
            sink.write_all(&element(kind, &raw(column, &values))).map_err(failed)?;
            continue;
        }
        sink.write_all(&[kind.to_le_bytes(), (bytes as u32).to_le_bytes()].concat())
            .map_err(failed)?;
        for rows in table.blocks() {
            let values = table.read(k, rows)?;
            sink.write_all(&raw(column, &values)).map_err(failed)?;
        }
        sink.write_all(&vec![0; padded - bytes]).map_err(failed)?;
    }
    let text = metadata(table, origin);
    let units: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let mut array = head(CHAR_CLASS, 1, text.len(), "metadata");
    array.extend(element(UINT16, &units));
    sink.write_all(&element(MATRIX, &array))
        .and_then(|()| sink.flush())
        .map_err(failed)
}
