//! Columns of CSV files.

use super::super::CompareError;
use super::super::resolution::{Digits, Rounding};
use super::source::{Place, Source};
use super::table::{BLOCK, Pass, Table};
use crate::input::{Lines, Rows};
use crate::quote::shown;
use csv::{ByteRecord, ReaderBuilder, Trim};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Lines before the header that may be comments.
const PREAMBLE: usize = 1000;

/// A CSV file with a header, separated by commas, semicolons, tabs or blanks; lines that begin with `#` are comments, of
/// which the last one before the numbers may be the header.
#[derive(Debug)]
pub(crate) struct CsvTable {
    source: Source,
    separator: u8,
    headers: Vec<Header>,
    /// The first line is data; without a comment that names them, the columns are called #1, #2, ...
    bare: bool,
}

#[derive(Debug)]
struct Header {
    name: String,
    unit: Option<String>,
}

impl CsvTable {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// No such file, an empty one, or one that is no text.
    pub(super) fn open(source: Source) -> Result<CsvTable, CompareError> {
        let path = source.path();
        let mut lines = BufReader::new(Lines::new(source.file()?)).split(b'\n').take(PREAMBLE);
        let mut comment = String::new();
        let header = loop {
            match lines.next() {
                Some(Ok(line)) if line.contains(&0) => {
                    let remedy = "give a CSV, NPZ or HDF5 file";
                    return Err(CompareError::whole(path, "this is no text", remedy));
                }
                // Whatever the encoding: numbers and the known names are the same in all that have no zero bytes.
                Some(Ok(line)) => {
                    let line = String::from_utf8_lossy(&line).trim_start_matches('\u{feff}').to_owned();
                    match line.strip_prefix('#') {
                        Some(text) => text.trim().clone_into(&mut comment),
                        None if line.trim().is_empty() => {}
                        None => break line,
                    }
                }
                Some(Err(error)) => return Err(CompareError::io(path, &error)),
                None => {
                    return Err(CompareError::whole(
                        path,
                        "holds no line of data",
                        "check how it was written",
                    ));
                }
            }
        };
        let header = header.trim();
        let separator = [b',', b';', b'\t', b' ']
            .into_iter()
            .find(|&s| header.as_bytes().contains(&s))
            .unwrap_or(b',');
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .delimiter(separator)
            .trim(Trim::All)
            .from_reader(header.as_bytes());
        let mut record = ByteRecord::new();
        reader
            .read_byte_record(&mut record)
            .map_err(|error| CompareError::content(path, "line 1", error.to_string(), "check how it was written"))?;
        join_blanks(&mut record, separator);
        let fields: Vec<String> = record
            .iter()
            .map(|f| String::from_utf8_lossy(f).trim().to_owned())
            .collect();
        let bare = fields.iter().all(|field| field.parse::<f64>().is_ok());
        let headers = if !bare {
            fields.iter().map(|field| Header::parse(field)).collect()
        } else if let Some(headers) = headers_in(&comment, fields.len()) {
            headers
        } else {
            (1..=fields.len())
                .map(|k| Header {
                    name: format!("#{k}"),
                    unit: None,
                })
                .collect()
        };
        Ok(CsvTable {
            source,
            separator,
            headers,
            bare,
        })
    }

    fn position(&self, name: &str) -> Option<usize> {
        let exact = self.headers.iter().position(|h| h.name == name);
        let same = || self.headers.iter().position(|h| h.name.eq_ignore_ascii_case(name));
        // OpenRadioss's th_to_csv fills titles with blanks.
        let close = || {
            self.headers
                .iter()
                .position(|h| h.name.contains("  ") && joined(&h.name) == joined(name))
        };
        exact.or_else(same).or_else(close)
    }

    fn reader(&self) -> Result<csv::Reader<Rows<Place>>, CompareError> {
        let file = Rows::new(self.source.file()?);
        let mut reader = ReaderBuilder::new()
            .has_headers(!self.bare)
            .delimiter(self.separator)
            .comment(Some(b'#'))
            .trim(Trim::All)
            .flexible(true)
            .buffer_capacity(1 << 20)
            .from_reader(file);
        if !self.bare {
            reader.byte_headers().map_err(|error| self.failed(&error))?;
        }
        Ok(reader)
    }

    fn failed(&self, error: &csv::Error) -> CompareError {
        let place = error.position().map_or(String::new(), |p| format!("line {}", p.line()));
        CompareError::content(self.source.path(), place, error.to_string(), "correct the file")
    }

    fn positions(&self, columns: &[String]) -> Result<Vec<usize>, CompareError> {
        let position = |name: &String| {
            self.position(name).ok_or_else(|| {
                let what = format!(
                    "has no column \"{name}\"; its columns are {}",
                    super::listed(&self.names()),
                    name = shown(name)
                );
                CompareError::whole(
                    self.source.path(),
                    what,
                    "name the column with --column or in a mapping",
                )
            })
        };
        columns.iter().map(position).collect()
    }
}

impl Header {
    /// `time [s]`, `time (s)`, `time` and so on.
    fn parse(text: &str) -> Header {
        for (open, close) in [('[', ']'), ('(', ')')] {
            if let Some((name, rest)) = text.split_once(open)
                && let Some(unit) = rest.strip_suffix(close)
                && !name.trim().is_empty()
            {
                return Header {
                    name: name.trim().to_owned(),
                    unit: Some(unit.trim().to_owned()),
                };
            }
        }
        Header {
            name: text.to_owned(),
            unit: None,
        }
    }
}

impl Table for CsvTable {
    fn path(&self) -> &Path {
        self.source.path()
    }

    fn names(&self) -> Vec<String> {
        self.headers.iter().map(|h| joined(&h.name)).collect()
    }

    fn has(&self, name: &str) -> bool {
        self.position(name).is_some()
    }

    fn unit(&self, name: &str) -> Option<String> {
        self.headers.get(self.position(name)?)?.unit.clone()
    }

    fn pass(&self, columns: &[String]) -> Result<Box<dyn Pass>, CompareError> {
        Ok(Box::new(CsvPass {
            path: self.source.path().to_owned(),
            positions: self.positions(columns)?,
            names: columns.to_vec(),
            fields: self.headers.len(),
            separator: self.separator,
            reader: self.reader()?,
            record: ByteRecord::new(),
        }))
    }

    fn rounding(&self, name: &str) -> Result<Option<Rounding>, CompareError> {
        let position = self.positions(&[name.to_owned()])?[0];
        let (mut digits, mut record) = (Digits::default(), ByteRecord::new());
        let mut reader = self.reader()?;
        for _ in 0..BLOCK {
            // What is wrong with a row, the pass says.
            if !next(&mut reader, &mut record, self.separator).unwrap_or(false) {
                break;
            }
            if let Some(Ok(text)) = record.get(position).map(std::str::from_utf8) {
                digits.add(text);
            }
        }
        Ok(digits.rounding())
    }

    fn texts(&self, column: &str) -> Result<Vec<String>, CompareError> {
        let position = self.positions(&[column.to_owned()])?[0];
        let mut texts = Vec::new();
        let mut reader = self.reader()?;
        let mut record = ByteRecord::new();
        while next(&mut reader, &mut record, self.separator).map_err(|error| self.failed(&error))? {
            let field = record.get(position).unwrap_or_default();
            texts.push(String::from_utf8_lossy(field).into_owned());
        }
        Ok(texts)
    }
}

/// A name with one blank in the place of several.
fn joined(name: &str) -> String {
    name.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A line of nothing but blanks; one of other separators has lost its fields.
fn is_blank(record: &ByteRecord, separator: u8) -> bool {
    record.as_slice().is_empty() && (separator == b' ' || record.len() < 2)
}

/// Reads the next record that is not blank; `false` at the end.
fn next(reader: &mut csv::Reader<Rows<Place>>, record: &mut ByteRecord, separator: u8) -> Result<bool, csv::Error> {
    while reader.read_byte_record(record)? {
        reader.get_mut().taken();
        if !is_blank(record, separator) {
            join_blanks(record, separator);
            return Ok(true);
        }
    }
    Ok(false)
}

/// Several blanks separate two fields like one.
fn join_blanks(record: &mut ByteRecord, separator: u8) {
    if separator == b' ' && record.iter().any(<[u8]>::is_empty) {
        *record = record.iter().filter(|field| !field.is_empty()).collect();
    }
}

/// A comment that is a header of so many columns, as `numpy.savetxt` writes one.
fn headers_in(comment: &str, columns: usize) -> Option<Vec<Header>> {
    let names = [',', ';', '\t', ' '].into_iter().map(|separator| {
        let fields = comment.split(separator).map(str::trim);
        fields.filter(|field| !field.is_empty()).collect::<Vec<_>>()
    });
    let is_name = |field: &&str| field.parse::<f64>().is_err();
    let names = names
        .into_iter()
        .find(|names| names.len() == columns && names.iter().all(is_name))?;
    Some(names.into_iter().map(Header::parse).collect())
}

struct CsvPass {
    path: PathBuf,
    positions: Vec<usize>,
    names: Vec<String>,
    fields: usize,
    separator: u8,
    reader: csv::Reader<Rows<Place>>,
    record: ByteRecord,
}

impl CsvPass {
    fn fault(&self, line: u64, what: String, remedy: &str) -> CompareError {
        CompareError::content(&self.path, format!("line {line}"), what, remedy)
    }
}

impl Pass for CsvPass {
    fn next(&mut self, columns: &mut [Vec<f64>]) -> Result<(), CompareError> {
        columns.iter_mut().for_each(Vec::clear);
        while columns[0].len() < BLOCK {
            let more = next(&mut self.reader, &mut self.record, self.separator).map_err(|error| {
                // Where no row was read, the one that was to be read begins.
                let at = error.position().unwrap_or(self.reader.position());
                self.fault(at.line(), error.to_string(), "correct the file")
            })?;
            if !more {
                break;
            }
            let line = self.record.position().map_or(0, csv::Position::line);
            if self.record.len() != self.fields {
                let what = format!("has {} fields, where the header has {}", self.record.len(), self.fields);
                return Err(self.fault(
                    line,
                    what,
                    "a line that was cut off or written by two programs? write it again",
                ));
            }
            for (k, &position) in self.positions.iter().enumerate() {
                let field = &self.record[position];
                let value = std::str::from_utf8(field)
                    .ok()
                    .and_then(|text| text.parse::<f64>().ok());
                let Some(value) = value else {
                    let what = format!(
                        "column {}: \"{}\" is no number",
                        shown(&self.names[k]),
                        shown(&String::from_utf8_lossy(field))
                    );
                    return Err(self.fault(line, what, "write numbers as 1.5e-3, with a decimal point"));
                };
                columns[k].push(value);
            }
        }
        Ok(())
    }
}
