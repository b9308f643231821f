//! Columns of the XY reports of Abaqus/CAE (abaqus.rpt, `session.writeXYReport`).
//!
//! A table begins with a line of names, of which the first is `X`, and goes on, over empty lines and pages that repeat its names, until
//! another begins. A value that a curve does not have at an X is `NoValue`. A report is appended to a file that is there already.

use super::super::CompareError;
use super::super::resolution::{Digits, Rounding};
use super::absent;
use super::source::{Place, Source};
use super::table::{BLOCK, Pass, Table, each_once, place_of};
use crate::input::Lines;
use crate::quote::shown;
use std::io::{BufRead, BufReader};
use std::path::Path;

const REWRITE: &str = "a line that was cut off? write the report again";
/// What Abaqus writes where a curve has no value.
const NOTHING: &str = "NoValue";
/// Tables and pages of a report.
const MOST_PAGES: usize = 100_000;
/// Bytes of a file in which the names of the first table are looked for.
const PREAMBLE: usize = 512;

/// An XY report.
#[derive(Debug)]
pub(super) struct XyReport {
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

/// The lines of a report.
struct Reader<'a> {
    path: &'a Path,
    lines: BufReader<Lines<Place>>,
    text: String,
    number: u64,
}

impl<'a> Reader<'a> {
    fn of(source: &'a Source) -> Result<Reader<'a>, CompareError> {
        Ok(Reader {
            path: source.path(),
            lines: BufReader::new(Lines::new(source.file()?)),
            text: String::new(),
            number: 0,
        })
    }

    /// Reads the next line; `false` at the end.
    fn next(&mut self) -> Result<bool, CompareError> {
        let mut bytes = std::mem::take(&mut self.text).into_bytes();
        bytes.clear();
        let count = self.lines.read_until(b'\n', &mut bytes);
        self.text = String::from_utf8(bytes).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned());
        self.number += 1;
        Ok(count.map_err(CompareError::io(self.path))? > 0)
    }

    /// What is wrong with this line.
    fn fault<T>(&self, what: impl Into<String>, remedy: &str) -> Result<T, CompareError> {
        let place = format!("line {}", self.number);
        Err(CompareError::content(self.path, place, what, remedy))
    }
}

impl XyReport {
    /// Opens a report and goes through it once.
    ///
    /// # Errors
    /// A damaged line, no rows, or a report that was appended to an earlier one of the same curves.
    pub fn open(source: Source) -> Result<XyReport, CompareError> {
        let mut curves: Vec<Curves> = Vec::new();
        let mut header: Option<(u64, String)> = None;
        let mut pages = 0;
        let mut lines = Reader::of(&source)?;
        while lines.next()? {
            let words = match Line::of(&lines.text) {
                Line::Header(names) => {
                    header = Some((lines.number, names.to_owned()));
                    continue;
                }
                Line::Other => continue,
                Line::Row(words) => words,
            };
            let Some(x) = number(words[0]) else {
                return lines.fault(format!("\"{}\" is no number", shown(words[0])), REWRITE);
            };
            if let Some((line, header)) = header.take() {
                pages += 1;
                if pages > MOST_PAGES {
                    return lines.fault(format!("more than {MOST_PAGES} tables"), "write one table");
                }
                match curves.iter().position(|known| known.header == header) {
                    // A page of the table before it goes on.
                    Some(known) if known + 1 == curves.len() && x > curves[known].last => {}
                    Some(_) => {
                        let what = "a table of the same curves begins again: Abaqus appends a report to a file that is there \
                                    already";
                        return lines.fault(what, "keep one of the two, or write with appendMode=OFF");
                    }
                    None => {
                        let names = names(&header, words.len());
                        each_once(source.path(), line, (1..).zip(names.iter().map(String::as_str)))?;
                        let is_there = |name: &&String| curves.iter().any(|known| known.names[1..].contains(name));
                        let again = names[1..].iter().find(|name| !name.starts_with('#') && is_there(name));
                        if let Some(name) = again {
                            let what = format!("the curve \"{}\" is in a table before this one, too", shown(name));
                            let (place, remedy) = (format!("line {line}"), "give each curve a name of its own");
                            return Err(CompareError::content(source.path(), place, what, remedy));
                        }
                        curves.push(Curves { names, header, last: x });
                    }
                }
            }
            let Some(known) = curves.last_mut() else {
                return lines.fault("numbers in front of the names of columns", "write an XY report");
            };
            if words.len() != known.names.len() {
                let what = format!("has {} fields, where its table has {}", words.len(), known.names.len());
                return lines.fault(what, REWRITE);
            }
            known.last = x;
        }
        if curves.is_empty() {
            let what = "holds no row of numbers";
            return Err(CompareError::whole(source.path(), what, "write the report again"));
        }
        Ok(XyReport { source, curves })
    }

    /// Table and column of a name.
    fn find(&self, name: &str) -> Option<(usize, usize)> {
        let is_x = ["time", "t", "x"].iter().any(|known| name.eq_ignore_ascii_case(known));
        self.named(name).or_else(|| {
            if is_x {
                return Some((0, 0));
            }
            let column = name.strip_prefix('#')?.parse::<usize>().ok()?.checked_sub(1)?;
            let alone = self.curves.len() == 1 && column < self.curves[0].names.len();
            alone.then_some((0, column))
        })
    }

    fn named(&self, name: &str) -> Option<(usize, usize)> {
        let of_table = |(table, curves): (usize, &Curves)| (1..curves.names.len()).map(move |column| (table, column));
        let all = self.curves.iter().enumerate().flat_map(of_table);
        let names = all
            .clone()
            .map(|(table, column)| self.curves[table].names[column].as_str());
        all.clone().nth(place_of(names, name)?)
    }

    fn rows(&self, table: usize) -> Result<RowsOf<'_>, CompareError> {
        Ok(RowsOf {
            lines: Reader::of(&self.source)?,
            of: &self.curves[table],
            inside: false,
        })
    }
}

/// The rows of one table.
struct RowsOf<'a> {
    lines: Reader<'a>,
    of: &'a Curves,
    inside: bool,
}

impl RowsOf<'_> {
    /// Goes to the next row; `false` at the end.
    fn next(&mut self) -> Result<bool, CompareError> {
        while self.lines.next()? {
            match Line::of(&self.lines.text) {
                Line::Header(names) => self.inside = self.of.header == names,
                Line::Row(words) if self.inside && words.len() == self.of.names.len() => return Ok(true),
                _ => {}
            }
        }
        Ok(false)
    }

    fn words(&self) -> Vec<&str> {
        self.lines.text.split_whitespace().collect()
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

    fn columns_of(&self, name: &str, exact: bool) -> Vec<String> {
        let found = self.find(name).filter(|_| exact);
        let name = |(table, column): (usize, usize)| self.curves[table].names[column].clone();
        found.map(name).into_iter().collect()
    }

    fn recognises(&self, name: &str) -> bool {
        self.named(name).is_some()
    }

    fn rounding(&self, name: &str) -> Result<Option<Rounding>, CompareError> {
        let Some((table, column)) = self.find(name) else {
            return Ok(None);
        };
        let mut digits = Digits::default();
        let mut rows = self.rows(table)?;
        let mut left = BLOCK;
        while left > 0 && rows.next()? {
            digits.add(rows.words()[column]);
            left -= 1;
        }
        Ok(digits.rounding())
    }

    fn pass(&self, columns: &[String]) -> Result<Pass<'_>, CompareError> {
        // Of each column: its table, where it is in its rows, and its name.
        let place = |name: &String| {
            let (table, column) = self.find(name).ok_or_else(|| absent(self, name))?;
            Ok((table, column, shown(name)))
        };
        let mut places = columns.iter().map(place).collect::<Result<Vec<_>, CompareError>>()?;
        let mut used: Vec<usize> = places.iter().filter(|place| place.1 > 0).map(|place| place.0).collect();
        used.sort_unstable();
        used.dedup();
        // X is that of the first table that is read.
        let first = *used.first().unwrap_or(&0);
        places
            .iter_mut()
            .filter(|place| place.1 == 0)
            .for_each(|place| place.0 = first);
        if used.is_empty() {
            used.push(first);
        }
        let tables = used.into_iter().map(|table| Ok((table, self.rows(table)?)));
        let mut tables = tables.collect::<Result<Vec<_>, CompareError>>()?;
        let mut values = vec![0.0; columns.len()];
        Ok(Box::new(move |columns| {
            columns.iter_mut().for_each(Vec::clear);
            while columns[0].len() < BLOCK {
                let (mut whole, mut x, mut ended) = (true, None, 0);
                for (table, rows) in &mut tables {
                    if !rows.next()? {
                        ended += 1;
                        continue;
                    }
                    let words = rows.words();
                    let own = number(words[0]);
                    if x.is_some() && (own.is_none() || x != own) {
                        let what = format!("X is {}, and not that of the table before it", shown(words[0]));
                        return rows.lines.fault(what, "write curves of the same times into one table");
                    }
                    x = own;
                    for ((_, column, name), value) in
                        places.iter().zip(&mut values).filter(|(place, _)| place.0 == *table)
                    {
                        let word = words[*column];
                        match number(word) {
                            Some(there) => *value = there,
                            None if word.eq_ignore_ascii_case(NOTHING) => whole = false,
                            None => {
                                let what = format!("column {name}: \"{}\" is no number", shown(word));
                                return rows.lines.fault(what, REWRITE);
                            }
                        }
                    }
                }
                if ended == tables.len() {
                    break;
                }
                if ended > 0 {
                    let what = "its tables have different numbers of rows";
                    let remedy = "write curves of the same times into one table";
                    return Err(CompareError::whole(self.path(), what, remedy));
                }
                if whole {
                    columns
                        .iter_mut()
                        .zip(&values)
                        .for_each(|(column, value)| column.push(*value));
                }
            }
            Ok(())
        }))
    }
}
