//! Readers of files and streams from other programs, within size limits.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use toml_edit::{Item, Value};

/// Largest size of a case, study or mapping, bytes. Its tree of values takes a hundred times as much memory.
pub(crate) const LARGEST_TEXT: u64 = 8 << 20;

/// Longest line of a table, bytes.
pub const LONGEST_LINE: usize = 16 << 20;

/// The text of a small file. The inner error is the first line that is not UTF-8, or `None` for a binary file.
pub fn text(path: &Path) -> io::Result<Result<String, Option<usize>>> {
    text_of(File::open(path)?)
}

pub(crate) fn text_of(source: impl Read) -> io::Result<Result<String, Option<usize>>> {
    let mut bytes = Vec::new();
    source.take(LARGEST_TEXT + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST_TEXT {
        let largest = LARGEST_TEXT >> 20;
        let what = format!("it is larger than {largest} MB; check the name");
        return Err(io::Error::new(ErrorKind::FileTooLarge, what));
    }
    Ok(String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let is_binary = error.as_bytes().iter().any(|byte| matches!(byte, 0..=8 | 14..=26));
        (!is_binary).then(|| valid.iter().filter(|&&byte| byte == b'\n').count() + 1)
    }))
}

/// A TOML document, or a part of one, as JSON.
pub fn json_of_toml(item: &Item) -> serde_json::Value {
    let entry = |(key, item): (&str, &Item)| (key.to_owned(), json_of_toml(item));
    let of_table = |table: &toml_edit::Table| -> serde_json::Value { table.iter().map(entry).collect() };
    match item {
        Item::None => serde_json::Value::Null,
        Item::Value(value) => json_of_value(value),
        Item::Table(table) => of_table(table),
        Item::ArrayOfTables(tables) => tables.iter().map(of_table).collect(),
    }
}

/// A value of a TOML document as JSON.
pub fn json_of_value(value: &Value) -> serde_json::Value {
    match value {
        Value::String(text) => text.value().as_str().into(),
        Value::Integer(number) => (*number.value()).into(),
        Value::Float(number) => (*number.value()).into(),
        Value::Boolean(truth) => (*truth.value()).into(),
        Value::Datetime(time) => time.value().to_string().into(),
        Value::Array(list) => list.iter().map(json_of_value).collect(),
        Value::InlineTable(table) => {
            let entries = table.iter();
            entries
                .map(|(key, value)| (key.to_owned(), json_of_value(value)))
                .collect()
        }
    }
}

/// A file that is read by lines. A line is kept in memory, so that one longer than [`LONGEST_LINE`] is an error.
pub struct Lines<R> {
    inner: R,
    since_end: usize,
}

impl<R: Read> Lines<R> {
    /// Reads lines from `inner`.
    pub fn new(inner: R) -> Self {
        Lines { inner, since_end: 0 }
    }
}

impl<R: Read> Read for Lines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.since_end = match buffer[..count].iter().rposition(|&byte| byte == b'\n') {
            Some(last) => count - last - 1,
            None => self.since_end + count,
        };
        if self.since_end > LONGEST_LINE {
            let what = format!("a line of more than {} MB, which no table has", LONGEST_LINE >> 20);
            return Err(io::Error::new(ErrorKind::InvalidData, what));
        }
        Ok(count)
    }
}

/// A table that is read by rows. A row longer than [`LONGEST_LINE`] is an error, however many lines it has: an
/// unclosed quote joins all following lines to one row.
pub struct InputRows<R> {
    lines: Lines<R>,
    since_row: usize,
}

impl<R: Read> InputRows<R> {
    /// Reads rows from `inner`.
    pub fn new(inner: R) -> Self {
        InputRows {
            lines: Lines::new(inner),
            since_row: 0,
        }
    }

    /// Marks a row as taken. Later input belongs to the next row, even if it is already buffered.
    pub fn taken(&mut self) {
        self.since_row = 0;
    }
}

impl<R: Read> Read for InputRows<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.lines.read(buffer)?;
        self.since_row += count;
        if self.since_row > LONGEST_LINE {
            let most = LONGEST_LINE >> 20;
            let what = format!("a row of more than {most} MB, as a quote makes one that is not closed");
            return Err(io::Error::new(ErrorKind::InvalidData, what));
        }
        Ok(count)
    }
}
