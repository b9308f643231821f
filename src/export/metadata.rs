//! Origin and columns of a table, as metadata for the formats that can store them.

use super::table::ExportTable;
use serde::Serialize;
use stickslip_files::schema::{StorageKind, Variable};
use stickslip_system::quote;

/// Mark of this program's exports, which CSV cannot store.
pub(super) const MARK: &str = "stickslip-export";

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

pub(super) fn metadata(table: &ExportTable, origin: &TableOrigin) -> String {
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

/// Binary values, little-endian: numbers as doubles, integers in 8 bytes, codes in 1 byte.
pub(super) fn raw(column: &Variable, values: &[f64]) -> Vec<u8> {
    match column.kind {
        StorageKind::Float64 => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        StorageKind::Int32 | StorageKind::Int64 => {
            values.iter().flat_map(|&value| (value as i64).to_le_bytes()).collect()
        }
        StorageKind::Int8 => values.iter().map(|&value| (value as i8).cast_unsigned()).collect(),
    }
}
