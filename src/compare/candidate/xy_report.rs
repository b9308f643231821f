//! Columns of the XY reports of Abaqus/CAE (abaqus.rpt, `session.writeXYReport`).
//!
//! A table begins with a line of names, of which the first is `X`, and goes on, over empty lines and pages that repeat its names, until
//! another begins. A value that a curve does not have at an X is `NoValue`. A report is appended to a file that is there already.

use super::super::CompareError;
use super::super::resolution::{Digits, Rounding};
use super::source::{Place, Source};
use super::table::{BLOCK, Pass, Table};
use crate::input::Lines;
use crate::quote::shown;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// What Abaqus writes where a curve has no value.
const NOTHING: &str = "NoValue";
/// Rows whose digits are looked at.
const LOOKED_AT: u64 = BLOCK as u64;
/// Tables and pages of a report.
const MOST_PAGES: usize = 100_000;
/// Bytes of a file in which the names of the first table are looked for.
const PREAMBLE: usize = 512;

/// An XY report.
#[derive(Debug)]
pub(crate) struct XyReport {
    source: Source,
    curves: Vec<Curves>,
}

/// A table of the report.
#[derive(Debug)]
struct Curves {
    /// As they stand in its first line.
    header: String,
    /// Of the columns, the first of which is X.
    names: Vec<String>,
    rows: u64,
    /// The last X.
    last: f64,
}

/// Whether a file begins as an XY report does: its first line that is not empty has the names of columns, the first of them X.
pub(super) fn is_xy_report(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(&head[..head.len().min(PREAMBLE)]);
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    lines.next().is_some_and(is_header) && !head.contains(&0)
}

/// A line of names: X, and at least another name, which commas do not separate.
fn is_header(line: &str) -> bool {
    let mut words = line.split_whitespace();
    line.starts_with(' ') && words.next() == Some("X") && words.next().is_some()
}

/// A line of a report.
enum Line<'a> {
    Header(&'a str),
    Row(Vec<&'a str>),
    /// Neither, or empty.
    Other,
}

impl Line<'_> {
    fn of(text: &str) -> Line<'_> {
        if is_header(text) {
            return Line::Header(text.trim());
        }
        let words: Vec<&str> = text.split_whitespace().collect();
        let begins = |word: &&str| word.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.'));
        // Ruled lines consist of dashes.
        let ruled = words.first().is_some_and(|word| word.starts_with("--"));
        if words.first().is_some_and(begins) && !ruled {
            Line::Row(words)
        } else {
            Line::Other
        }
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok()
}

/// Names of columns: two blanks or more separate them, as one may be part of a name. If these are not so many as there are columns, those
/// that separate at every blank, else none.
fn names(header: &str, columns: usize) -> Vec<String> {
    let wide: Vec<&str> = header
        .split("  ")
        .map(str::trim)
        .filter(|name| !name.is_empty())
        .collect();
    let narrow: Vec<&str> = header.split_whitespace().collect();
    let found = [wide, narrow].into_iter().find(|names| names.len() == columns);
    match found {
        Some(names) => names.into_iter().map(str::to_owned).collect(),
        None => (1..=columns).map(|k| format!("#{k}")).collect(),
    }
}

impl XyReport {
    /// Opens a report and goes through it once.
    ///
    /// # Errors
    /// A damaged line, no rows, or a report that was appended to an earlier one of the same curves.
    pub(super) fn open(source: Source) -> Result<XyReport, CompareError> {
        let path = source.path();
        let fault = |line: usize, what: String, remedy: &str| {
            Err(CompareError::content(path, format!("line {line}"), what, remedy))
        };
        let mut curves: Vec<Curves> = Vec::new();
        let mut header: Option<String> = None;
        let mut pages = 0;
        let mut lines = BufReader::new(Lines::new(source.file()?));
        let (mut text, mut line) = (Vec::new(), 0);
        loop {
            text.clear();
            let count = lines.read_until(b'\n', &mut text);
            if count.map_err(|error| CompareError::io(path, &error))? == 0 {
                break;
            }
            line += 1;
            let text = String::from_utf8_lossy(&text);
            match Line::of(&text) {
                Line::Header(names) => header = Some(names.to_owned()),
                Line::Other => {}
                Line::Row(words) => {
                    let Some(x) = number(words[0]) else {
                        let what = format!("\"{}\" is no number", shown(words[0]));
                        return fault(line, what, "a line that was cut off? write the report again");
                    };
                    if let Some(header) = header.take() {
                        pages += 1;
                        if pages > MOST_PAGES {
                            return fault(line, format!("more than {MOST_PAGES} tables"), "write one table");
                        }
                        match curves.iter().position(|known| known.header == header) {
                            // A page of the table before it goes on.
                            Some(known) if known + 1 == curves.len() && x > curves[known].last => {}
                            Some(_) => {
                                let what = "a table of the same curves begins again: Abaqus appends a report to a file that \
                                            is there already";
                                return fault(
                                    line,
                                    what.to_owned(),
                                    "keep one of the two, or write with appendMode=OFF",
                                );
                            }
                            None => curves.push(Curves {
                                names: names(&header, words.len()),
                                header,
                                rows: 0,
                                last: x,
                            }),
                        }
                    }
                    let Some(known) = curves.last_mut() else {
                        return fault(
                            line,
                            "numbers in front of the names of columns".to_owned(),
                            "write an XY report",
                        );
                    };
                    if words.len() != known.names.len() {
                        let what = format!("has {} fields, where its table has {}", words.len(), known.names.len());
                        return fault(line, what, "a line that was cut off? write the report again");
                    }
                    known.last = x;
                    known.rows += 1;
                }
            }
        }
        if curves.is_empty() {
            return Err(CompareError::whole(
                path,
                "holds no row of numbers",
                "write the report again",
            ));
        }
        Ok(XyReport { source, curves })
    }

    /// Table and column of a name.
    fn find(&self, name: &str) -> Option<(usize, usize)> {
        if ["time", "t", "x"].iter().any(|known| name.eq_ignore_ascii_case(known)) {
            let named = self.named(name);
            return named.or(Some((0, 0)));
        }
        let numbered = name.strip_prefix('#').and_then(|number| number.parse::<usize>().ok());
        self.named(name).or_else(|| {
            let column = numbered?.checked_sub(1)?;
            let alone = self.curves.len() == 1 && column < self.curves[0].names.len();
            alone.then_some((0, column))
        })
    }

    fn named(&self, name: &str) -> Option<(usize, usize)> {
        let search = |same: &dyn Fn(&str) -> bool| {
            let mut tables = self.curves.iter().enumerate();
            tables.find_map(|(table, curves)| {
                let column = curves.names.iter().skip(1).position(|known| same(known))?;
                Some((table, column + 1))
            })
        };
        search(&|known| known == name).or_else(|| search(&|known| known.eq_ignore_ascii_case(name)))
    }

    fn rows(&self, table: usize) -> Result<RowsOf, CompareError> {
        Ok(RowsOf {
            path: self.source.path().to_owned(),
            lines: BufReader::new(Lines::new(self.source.file()?)),
            headers: self.curves[..=table]
                .iter()
                .map(|curves| curves.header.clone())
                .collect(),
            columns: self.curves[table].names.len(),
            inside: false,
            text: Vec::new(),
            line: 0,
        })
    }
}

/// Takes the number of a line and its words.
type Take<'a> = dyn FnMut(u64, &[&str]) -> Result<(), CompareError> + 'a;

/// The rows of one table.
struct RowsOf {
    path: PathBuf,
    lines: BufReader<Lines<Place>>,
    /// Of the tables up to it, which is the last.
    headers: Vec<String>,
    columns: usize,
    inside: bool,
    text: Vec<u8>,
    line: u64,
}

impl RowsOf {
    /// Gives the words of the next row to `take`; `false` at the end.
    fn next(&mut self, take: &mut Take<'_>) -> Result<bool, CompareError> {
        loop {
            self.text.clear();
            let count = self.lines.read_until(b'\n', &mut self.text);
            if count.map_err(|error| CompareError::io(&self.path, &error))? == 0 {
                return Ok(false);
            }
            self.line += 1;
            let text = String::from_utf8_lossy(&self.text);
            match Line::of(&text) {
                Line::Header(names) => self.inside = self.headers.last().is_some_and(|header| header == names),
                Line::Row(words) if self.inside && words.len() == self.columns => {
                    take(self.line, &words)?;
                    return Ok(true);
                }
                _ => {}
            }
        }
    }
}

impl Table for XyReport {
    fn path(&self) -> &Path {
        self.source.path()
    }

    fn names(&self) -> Vec<String> {
        let all = self
            .curves
            .iter()
            .flat_map(|curves| curves.names.iter().skip(1).cloned());
        std::iter::once("X".to_owned()).chain(all).collect()
    }

    fn has(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    fn recognises(&self, name: &str) -> bool {
        self.named(name).is_some()
    }

    fn has_texts(&self, _: &str) -> bool {
        false
    }

    fn rounding(&self, name: &str) -> Result<Option<Rounding>, CompareError> {
        let Some((table, column)) = self.find(name) else {
            return Ok(None);
        };
        let mut digits = Digits::default();
        let mut rows = self.rows(table)?;
        for _ in 0..LOOKED_AT {
            let more = rows.next(&mut |_, words| {
                digits.add(words[column]);
                Ok(())
            })?;
            if !more {
                break;
            }
        }
        Ok(digits.rounding())
    }

    fn pass(&self, columns: &[String]) -> Result<Box<dyn Pass>, CompareError> {
        let mut places = Vec::new();
        for name in columns {
            let Some(place) = self.find(name) else {
                let what = format!(
                    "has no column \"{}\"; there are {}",
                    shown(name),
                    super::listed(&self.names())
                );
                return Err(CompareError::whole(
                    self.path(),
                    what,
                    "name it with --column or in a mapping",
                ));
            };
            places.push(place);
        }
        // X is that of the first table that is read.
        let used: Vec<usize> = {
            let of_columns = places.iter().filter(|place| place.1 > 0).map(|place| place.0);
            let mut used: Vec<usize> = of_columns.collect();
            used.sort_unstable();
            used.dedup();
            if used.is_empty() { vec![0] } else { used }
        };
        let slot = |&(table, column): &(usize, usize)| match column {
            0 => (0, 0),
            _ => (used.iter().position(|&known| known == table).unwrap_or(0), column),
        };
        Ok(Box::new(XyPass {
            path: self.path().to_owned(),
            names: columns.to_vec(),
            places: places.iter().map(slot).collect(),
            values: vec![0.0; columns.len()],
            tables: used.iter().map(|&table| self.rows(table)).collect::<Result<_, _>>()?,
        }))
    }
}

struct XyPass {
    path: PathBuf,
    names: Vec<String>,
    /// Of each column: which of the tables that are read, and where in its rows.
    places: Vec<(usize, usize)>,
    values: Vec<f64>,
    tables: Vec<RowsOf>,
}

impl Pass for XyPass {
    fn next(&mut self, columns: &mut [Vec<f64>]) -> Result<(), CompareError> {
        columns.iter_mut().for_each(Vec::clear);
        while columns[0].len() < BLOCK {
            let (mut whole, mut x, mut ended) = (true, None, 0);
            for (table, rows) in self.tables.iter_mut().enumerate() {
                let (path, names, places, values) = (&self.path, &self.names, &self.places, &mut self.values);
                let more = rows.next(&mut |line, words| {
                    let fault = |what: String, remedy: &str| {
                        Err(CompareError::content(path, format!("line {line}"), what, remedy))
                    };
                    match (x, number(words[0])) {
                        (None, own) => x = own,
                        (Some(x), Some(own)) if x == own => {}
                        _ => {
                            let what = format!("X is {}, and not that of the table before it", shown(words[0]));
                            return fault(what, "write curves of the same times into one table");
                        }
                    }
                    for (k, &(of, column)) in places.iter().enumerate().filter(|(_, place)| place.0 == table) {
                        let word = words[column];
                        match number(word) {
                            Some(value) => values[k] = value,
                            None if word.eq_ignore_ascii_case(NOTHING) => whole = false,
                            None => {
                                let what = format!("column {}: \"{}\" is no number", shown(&names[k]), shown(word));
                                return fault(what, "a line that was cut off? write the report again");
                            }
                        }
                        debug_assert_eq!(of, table);
                    }
                    Ok(())
                })?;
                ended += usize::from(!more);
            }
            if ended == self.tables.len() {
                break;
            }
            if ended > 0 {
                return Err(CompareError::whole(
                    &self.path,
                    "its tables have different numbers of rows",
                    "write curves of the same times into one table",
                ));
            }
            if whole {
                for (column, value) in columns.iter_mut().zip(&self.values) {
                    column.push(*value);
                }
            }
        }
        Ok(())
    }
}
