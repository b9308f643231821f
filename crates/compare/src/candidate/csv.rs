//! Columns of CSV files.

use super::super::CompareError;
use super::super::resolution::{Digits, Rounding};
use super::absent;
use super::table::{BLOCK, CandidatePlace, CandidateSource, CandidateTable, Pass, each_once, place_of};
use csv::{ByteRecord, ReaderBuilder, Trim};
use std::io::{BufRead, BufReader};
use std::path::Path;
use stickslip_case::input::{InputRows, Lines};
use stickslip_system::quote::shown;

/// A CSV file with a header, separated by commas, semicolons, tabs or blanks. Lines that begin with `#` are comments;
/// the last comment before the numbers may be the header.
#[derive(Debug)]
pub(super) struct CsvTable {
    source: CandidateSource,
    separator: u8,
    headers: Vec<CsvHeader>,
    /// The first line is data. Unless a comment names the columns, they are called #1, #2, ...
    bare: bool,
}

#[derive(Debug)]
struct CsvHeader {
    name: String,
    unit: Option<String>,
}

impl CsvTable {
    pub fn open(source: CandidateSource) -> Result<CsvTable, CompareError> {
        let path = source.path();
        let (mut comment, mut commented) = (String::new(), 0);
        let mut header = None;
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
                    header = Some((number, line.trim().to_owned()));
                    break;
                }
            }
        }
        let nothing = || CompareError::whole(path, "holds no line of data", "check how it was written");
        let (number, header) = header.ok_or_else(nothing)?;
        let mut separators = [b',', b';', b'\t', b' '].into_iter();
        let separator = separators.find(|s| header.as_bytes().contains(s)).unwrap_or(b',');
        let mut reader = reader(separator).has_headers(false).from_reader(header.as_bytes());
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
        let numbered = |k| CsvHeader {
            name: format!("#{k}"),
            unit: None,
        };
        let headers: Vec<CsvHeader> = match bare {
            false => fields.iter().map(|field| CsvHeader::parse(field)).collect(),
            true => headers_in(&comment, fields.len()).unwrap_or_else(|| (1..=fields.len()).map(numbered).collect()),
        };
        let names: Vec<String> = headers.iter().map(|header| joined(&header.name)).collect();
        let names = (1..).zip(names.iter().map(String::as_str));
        each_once(path, if bare { commented } else { number }, names)?;
        Ok(CsvTable {
            source,
            separator,
            headers,
            bare,
        })
    }

    fn position(&self, name: &str) -> Option<usize> {
        // OpenRadioss's th_to_csv fills titles with blanks.
        let close = |h: &CsvHeader| h.name.contains("  ") && joined(&h.name) == joined(name);
        let known = place_of(self.headers.iter().map(|h| h.name.as_str()), name);
        known.or_else(|| self.headers.iter().position(close))
    }

    fn known(&self, name: &str) -> Result<usize, CompareError> {
        self.position(name).ok_or_else(|| absent(self, name))
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
        CompareError::content(self.path(), place, error.to_string(), "correct the file")
    }
}

impl CsvHeader {
    fn parse(text: &str) -> CsvHeader {
        for (open, close) in [('[', ']'), ('(', ')')] {
            if let Some((name, rest)) = text.split_once(open)
                && let Some(unit) = rest.strip_suffix(close)
                && !name.trim().is_empty()
            {
                return CsvHeader {
                    name: name.trim().to_owned(),
                    unit: Some(unit.trim().to_owned()),
                };
            }
        }
        CsvHeader {
            name: text.to_owned(),
            unit: None,
        }
    }
}

impl CandidateTable for CsvTable {
    fn path(&self) -> &Path {
        self.source.path()
    }

    fn names(&self) -> Vec<String> {
        self.headers.iter().map(|h| joined(&h.name)).collect()
    }

    fn has(&self, name: &str) -> bool {
        self.position(name).is_some()
    }

    fn columns_of(&self, name: &str, exact: bool) -> Vec<String> {
        let is_it = |known: &&String| match exact {
            true => *known == name,
            false => known.eq_ignore_ascii_case(&joined(name)),
        };
        self.names().iter().filter(is_it).cloned().collect()
    }

    fn has_texts(&self, name: &str) -> bool {
        self.has(name)
    }

    fn unit(&self, name: &str) -> Option<String> {
        self.headers.get(self.position(name)?)?.unit.clone()
    }

    fn pass(&self, columns: &[String]) -> Result<Pass<'_>, CompareError> {
        let places = columns.iter().map(|name| Ok((self.known(name)?, shown(name))));
        let places: Vec<_> = places.collect::<Result<_, CompareError>>()?;
        let mut records = self.records()?;
        Ok(Box::new(move |columns| {
            columns.iter_mut().for_each(Vec::clear);
            while columns[0].len() < BLOCK {
                let fault = |line: u64, what: String, remedy: &str| {
                    CompareError::content(self.path(), format!("line {line}"), what, remedy)
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
                if record.len() != self.headers.len() {
                    let what = format!(
                        "has {} fields, where the header has {}",
                        record.len(),
                        self.headers.len()
                    );
                    let remedy = "a line that was cut off or written by two programs? write it again";
                    return Err(fault(line, what, remedy));
                }
                for ((position, name), column) in places.iter().zip(&mut *columns) {
                    let field = &record[*position];
                    let value = std::str::from_utf8(field).ok().and_then(|text| text.parse().ok());
                    column.push(value.ok_or_else(|| {
                        let field = String::from_utf8_lossy(field);
                        let what = format!("column {name}: \"{}\" is no number", shown(&field));
                        fault(line, what, "write numbers as 1.5e-3, with a decimal point")
                    })?);
                }
            }
            Ok(())
        }))
    }

    fn roundings(&self, names: &[String]) -> Result<Vec<Option<Rounding>>, CompareError> {
        let positions: Vec<usize> = names.iter().map(|name| self.known(name)).collect::<Result<_, _>>()?;
        let (mut records, mut digits) = (self.records()?, vec![Digits::default(); names.len()]);
        for _ in 0..BLOCK {
            if !records.next().unwrap_or(false) {
                break;
            }
            for (&position, digits) in positions.iter().zip(&mut digits) {
                if let Some(Ok(text)) = records.record.get(position).map(std::str::from_utf8) {
                    digits.add(text);
                }
            }
        }
        Ok(digits.iter().map(Digits::rounding).collect())
    }

    fn texts(&self, column: &str) -> Result<Vec<String>, CompareError> {
        let (position, mut records) = (self.known(column)?, self.records()?);
        let mut texts = Vec::new();
        while records.next().map_err(|error| self.failed(&error))? {
            let field = records.record.get(position).unwrap_or_default();
            texts.push(String::from_utf8_lossy(field).into_owned());
        }
        Ok(texts)
    }
}

fn reader(separator: u8) -> ReaderBuilder {
    let mut builder = ReaderBuilder::new();
    builder.delimiter(separator).trim(Trim::All);
    builder
}

fn joined(name: &str) -> String {
    name.split_whitespace().collect::<Vec<_>>().join(" ")
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
    Some(names.next()?.into_iter().map(CsvHeader::parse).collect())
}
