//! Columns of CSV files.

use super::super::CompareError;
use super::super::resolution::{Digits, Rounding};
use super::table::{
    ArrayReader, ArrayValues, BLOCK, CandidateColumn, CandidatePlace, CandidateSource, CandidateTable, Pass,
    TableArray, each_once,
};
use csv::{ByteRecord, ReaderBuilder, Trim};
use std::io::{BufRead, BufReader};
use stickslip_case::input::{InputRows, Lines};
use stickslip_system::quote::shown;

/// A CSV file with a header, separated by commas, semicolons, tabs or blanks. Lines that begin with `#` are comments;
/// the last comment before the numbers may be the header.
#[derive(Debug)]
pub(super) struct CsvReader {
    source: CandidateSource,
    separator: u8,
    units: Vec<Option<String>>,
    /// The first line is data. Unless a comment names the columns, they are called #1, #2, ...
    bare: bool,
}

impl CsvReader {
    pub fn open(source: CandidateSource) -> Result<CandidateTable, CompareError> {
        let path = source.path();
        let (mut comment, mut commented) = (String::new(), 0);
        let mut first = None;
        let lines = BufReader::new(Lines::new(source.file()?)).split(b'\n');
        for (number, line) in (1..).zip(lines) {
            let line = line.map_err(CompareError::io(path))?;
            if line.contains(&0) {
                return Err(CompareError::whole(
                    path,
                    "this is no text",
                    "give a CSV, NPZ or HDF5 file",
                ));
            }
            // The encoding does not matter: in all encodings without zero bytes, numbers and the known names are the
            // same.
            let line = String::from_utf8_lossy(&line);
            let line = line.trim_start_matches('\u{feff}');
            match line.strip_prefix('#') {
                Some(text) => {
                    text.trim().clone_into(&mut comment);
                    commented = number;
                }
                None if line.trim().is_empty() => {}
                None => {
                    first = Some((number, line.trim().to_owned()));
                    break;
                }
            }
        }
        let nothing = || CompareError::whole(path, "holds no line of data", "check how it was written");
        let (number, first) = first.ok_or_else(nothing)?;
        let mut separators = [b',', b';', b'\t', b' '].into_iter();
        let separator = separators.find(|s| first.as_bytes().contains(s)).unwrap_or(b',');
        let mut reader = reader(separator).has_headers(false).from_reader(first.as_bytes());
        let mut record = ByteRecord::new();
        reader
            .read_byte_record(&mut record)
            .map_err(|error| CompareError::content(path, "line 1", error.to_string(), "check how it was written"))?;
        join_blanks(&mut record, separator);
        let fields = record
            .iter()
            .map(|field| String::from_utf8_lossy(field).trim().to_owned());
        let fields: Vec<String> = fields.collect();
        let bare = fields.iter().all(|field| field.parse::<f64>().is_ok());
        let numbered = |k| (format!("#{k}"), None);
        let headers: Vec<CsvHeader> = match bare {
            false => fields.iter().map(|field| header(field)).collect(),
            true => headers_in(&comment, fields.len()).unwrap_or_else(|| (1..=fields.len()).map(numbered).collect()),
        };
        let names = (1..).zip(headers.iter().map(|(name, _)| name.as_str()));
        each_once(path, if bare { commented } else { number }, names)?;
        let (names, units): (Vec<String>, Vec<Option<String>>) = headers.into_iter().unzip();
        Ok(CandidateTable {
            path: path.to_owned(),
            left_out: Vec::new(),
            by_path: false,
            reader: Box::new(CsvReader {
                separator,
                units,
                bare,
                source,
            }),
            arrays: names
                .into_iter()
                .map(|name| TableArray::of_rows(name, ArrayValues::Either))
                .collect(),
        })
    }

    fn records(&self) -> Result<Records, CompareError> {
        let file = InputRows::new(self.source.file()?);
        let mut builder = reader(self.separator);
        let builder = builder.comment(Some(b'#')).flexible(true).buffer_capacity(1 << 20);
        let mut reader = builder.has_headers(!self.bare).from_reader(file);
        if !self.bare {
            reader.byte_headers().map_err(|error| self.failed(&error))?;
        }
        Ok(Records {
            reader,
            separator: self.separator,
            record: ByteRecord::new(),
        })
    }

    fn failed(&self, error: &csv::Error) -> CompareError {
        let place = error.position().map_or(String::new(), |p| format!("line {}", p.line()));
        CompareError::content(self.source.path(), place, error.to_string(), "correct the file")
    }
}

/// Name and unit of a column: `NAME`, `NAME [UNIT]` or `NAME (UNIT)`.
type CsvHeader = (String, Option<String>);

fn header(text: &str) -> CsvHeader {
    let with_unit = [('[', ']'), ('(', ')')].into_iter().find_map(|(open, close)| {
        let (name, rest) = text.split_once(open)?;
        let unit = rest.strip_suffix(close).filter(|_| !name.trim().is_empty())?;
        Some((name, Some(unit.trim().to_owned())))
    });
    let (name, unit) = with_unit.unwrap_or((text, None));
    (name.split_whitespace().collect::<Vec<_>>().join(" "), unit)
}

impl ArrayReader for CsvReader {
    fn pass(&self, of: Vec<CandidateColumn>) -> Result<Pass<'_>, CompareError> {
        let mut records = self.records()?;
        Ok(Box::new(move |columns| {
            columns.iter_mut().for_each(Vec::clear);
            while columns[0].len() < BLOCK {
                let fault = |line: u64, what: String, remedy: &str| {
                    CompareError::content(self.source.path(), format!("line {line}"), what, remedy)
                };
                let more = records.next().map_err(|error| {
                    // If no row has been read, the fault is where the next row begins.
                    let at = error.position().unwrap_or(records.reader.position());
                    fault(at.line(), error.to_string(), "correct the file")
                })?;
                if !more {
                    break;
                }
                let record = &records.record;
                let line = record.position().map_or(0, csv::Position::line);
                if record.len() != self.units.len() {
                    let what = format!("has {} fields, where the header has {}", record.len(), self.units.len());
                    let remedy = "a line that was cut off or written by two programs? write it again";
                    return Err(fault(line, what, remedy));
                }
                for (of, column) in of.iter().zip(&mut *columns) {
                    let field = &record[of.array];
                    let value = std::str::from_utf8(field).ok().and_then(|text| text.parse().ok());
                    column.push(value.ok_or_else(|| {
                        let (name, field) = (shown(&of.name), String::from_utf8_lossy(field));
                        let what = format!("column {name}: \"{}\" is no number", shown(&field));
                        fault(line, what, "write numbers as 1.5e-3, with a decimal point")
                    })?);
                }
            }
            Ok(())
        }))
    }

    fn roundings(&self, arrays: &[usize]) -> Result<Vec<Option<Rounding>>, CompareError> {
        let (mut records, mut digits) = (self.records()?, vec![Digits::default(); arrays.len()]);
        for _ in 0..BLOCK {
            if !records.next().unwrap_or(false) {
                break;
            }
            for (&array, digits) in arrays.iter().zip(&mut digits) {
                if let Some(Ok(text)) = records.record.get(array).map(std::str::from_utf8) {
                    digits.add(text);
                }
            }
        }
        Ok(digits.iter().map(Digits::rounding).collect())
    }

    fn unit(&self, array: usize) -> Option<String> {
        self.units[array].clone()
    }

    fn texts(&self, array: usize) -> Result<Option<Vec<String>>, CompareError> {
        let (mut records, mut texts) = (self.records()?, Vec::new());
        while records.next().map_err(|error| self.failed(&error))? {
            let field = records.record.get(array).unwrap_or_default();
            texts.push(String::from_utf8_lossy(field).into_owned());
        }
        Ok(Some(texts))
    }
}

fn reader(separator: u8) -> ReaderBuilder {
    let mut builder = ReaderBuilder::new();
    builder.delimiter(separator).trim(Trim::All);
    builder
}

struct Records {
    reader: csv::Reader<InputRows<CandidatePlace>>,
    separator: u8,
    record: ByteRecord,
}

impl Records {
    fn next(&mut self) -> Result<bool, csv::Error> {
        while self.reader.read_byte_record(&mut self.record)? {
            self.reader.get_mut().taken();
            // Blank lines are skipped. If the separator is not a blank, a line of separators alone is an error: its
            // fields are missing.
            let is_short = self.separator == b' ' || self.record.len() < 2;
            if !(self.record.as_slice().is_empty() && is_short) {
                join_blanks(&mut self.record, self.separator);
                return Ok(true);
            }
        }
        Ok(false)
    }
}

fn join_blanks(record: &mut ByteRecord, separator: u8) {
    if separator == b' ' && record.iter().any(<[u8]>::is_empty) {
        *record = record.iter().filter(|field| !field.is_empty()).collect();
    }
}

/// Names of `columns` columns in a comment, as `numpy.savetxt` writes them.
fn headers_in(comment: &str, columns: usize) -> Option<Vec<CsvHeader>> {
    let is_name = |field: &&str| field.parse::<f64>().is_err();
    let names = [',', ';', '\t', ' '].into_iter().map(|separator| {
        let fields = comment.split(separator).map(str::trim);
        fields.filter(|field| !field.is_empty()).collect::<Vec<_>>()
    });
    let mut names = names.filter(|names| names.len() == columns && names.iter().all(is_name));
    Some(names.next()?.into_iter().map(header).collect())
}
