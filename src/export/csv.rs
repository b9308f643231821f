//! Writer of comma-separated values. The header contains names with units in brackets. A number is the shortest
//! decimal of the same double, a code is its word, and NaN is `NaN`.

use super::table::ExportTable;
use crate::Error;
use crate::output::Product;
use std::io::{BufWriter, Write};
use std::path::Path;
use stickslip_files::schema::{StorageKind, Variable};

pub(super) fn header(columns: &[Variable]) -> String {
    line(columns.iter().map(Variable::header))
}

pub(super) fn plain_header(columns: &[Variable]) -> String {
    line(columns.iter().map(|column| column.name.clone()))
}

fn line(fields: impl Iterator<Item = String>) -> String {
    fields.map(|field| quoted(&field)).collect::<Vec<_>>().join(",") + "\n"
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn push(line: &mut String, column: &Variable, value: f64) {
    use std::fmt::Write;
    // Writing to a string cannot fail.
    let _ = match column.kind {
        _ if value.is_nan() => write!(line, "NaN"),
        StorageKind::Int8 => write!(line, "{}", quoted(&column.word(value as i64))),
        StorageKind::Int32 | StorageKind::Int64 => write!(line, "{value:.0}"),
        StorageKind::Float64 => write!(line, "{value:?}"),
    };
}

pub(super) fn write(header: &str, table: &ExportTable, sink: impl Write, path: &Path) -> Result<(), Error> {
    let failed = |error| Product::Table.failed(path, "writing", error);
    let mut sink = BufWriter::new(sink);
    sink.write_all(header.as_bytes()).map_err(failed)?;
    let mut line = String::new();
    for rows in table.blocks() {
        let columns = (0..table.columns.len())
            .map(|k| table.read(k, rows.clone()))
            .collect::<Result<Vec<_>, _>>()?;
        for row in 0..rows.len() {
            line.clear();
            for (k, (column, values)) in table.columns.iter().zip(&columns).enumerate() {
                if k > 0 {
                    line.push(',');
                }
                push(&mut line, column, values[row]);
            }
            line.push('\n');
            sink.write_all(line.as_bytes()).map_err(failed)?;
        }
    }
    sink.flush().map_err(failed)
}
