//! The origin of a table and its columns, as metadata for the formats that have a place for it.

use super::table::{Column, Kind, Table};
use crate::quote;
use serde::Serialize;

/// By which the program knows what it has exported; CSV has no place for it.
pub(super) const MARK: &str = "stickslip-export";

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

/// Values of a column as formats without words store them: doubles, whole numbers of 8 bytes, codes of one; little-endian.
pub(super) fn raw(column: &Column, values: &[f64]) -> Vec<u8> {
    match column.kind {
        Kind::Number => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        Kind::Whole => values.iter().flat_map(|&value| (value as i64).to_le_bytes()).collect(),
        Kind::Code => values.iter().map(|&value| (value as i8).cast_unsigned()).collect(),
    }
}
