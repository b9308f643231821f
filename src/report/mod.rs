//! Reports: the result of a command as a JSON document (by serde) and as a [`Page`] of texts, tables and figures, which is
//! printed on a terminal, as Markdown or as HTML.
//!
//! A report is a serde struct. Its `page` declares each table by its columns: title, unit, how a value is printed (`PageRows`).
//! A page begins with its headline. Details are printed on a terminal only with `-v`, and always as Markdown and HTML.

mod branches;
mod calibration;
mod certificate;
mod comparison;
mod cycle;
mod file;
mod keys;
mod modes;
mod precision;
mod render;
mod run;
mod sweep;

pub use comparison::CompareReport;
pub(crate) use comparison::comparison_page;
pub use cycle::{CycleCertificateReport, CycleReport};
pub use modes::ModesReport;

pub(crate) use branches::BranchesReport;
pub(crate) use calibration::CalibrationReport;
pub(crate) use file::FilesReport;
pub(crate) use keys::{ListedKey, listed_keys};
pub(crate) use precision::PrecisionReport;
pub(crate) use render::{html, markdown, terminal};
pub(crate) use run::RunSummary;
pub(crate) use sweep::{DistributionSummary, SweepSummary, distribution};

use crate::Error;
use serde::Serialize;
use std::ops::Range;
use stickslip_case::changed_line;
use stickslip_system::quote::bound;

/// The result of a command: its fields are the keys of the JSON document, its page is the text.
pub trait Report: Serialize {
    /// Whether the keys of the document are in alphabetical order instead of that of the fields.
    const SORTED: bool = false;

    /// The texts and tables of the report.
    fn page(&self) -> Page;

    /// The whole report as text.
    fn text(&self) -> String {
        terminal(&self.page(), true)
    }

    /// The report as a JSON document.
    ///
    /// # Errors
    /// A value that JSON cannot express.
    fn document(&self) -> Result<String, Error>
    where
        Self: Sized,
    {
        let text = match Self::SORTED {
            true => serde_json::to_value(self).and_then(|value| serde_json::to_string_pretty(&value)),
            false => serde_json::to_string_pretty(self),
        };
        text.map_err(unwritten)
    }
}

pub(crate) fn unwritten(error: serde_json::Error) -> Error {
    Error::computation(format!("writing JSON failed: {error}"))
}

/// The line above `text` that names what was changed, if anything was.
pub(crate) fn below_changes(changed: &[String], text: impl Into<String>) -> String {
    let text = text.into();
    match (changed.is_empty(), text.is_empty()) {
        (true, _) => text,
        (false, true) => changed_line(changed),
        (false, false) => format!("{}\n{text}", changed_line(changed)),
    }
}

/// Texts, tables and figures of a report, in reading order.
#[derive(Debug, Default)]
pub struct Page {
    pub(crate) title: String,
    /// The main result, below the title; may be empty.
    pub(crate) verdict: String,
    pub(crate) parts: Vec<PagePart>,
}

#[derive(Debug)]
pub(crate) enum PagePart {
    Text(String),
    List(Vec<String>),
    Table(PageTable),
    /// Only a report in a file has figures.
    Figure(DrawnPage),
    /// A part that belongs to the one above: no blank line separates them on a terminal.
    Below(Box<PagePart>),
    /// A part that a terminal shows with `-v` only.
    Detail(Box<PagePart>),
}

#[derive(Debug)]
pub(crate) struct DrawnPage {
    pub file: String,
    pub title: String,
    pub svg: String,
}

impl From<String> for PagePart {
    fn from(text: String) -> Self {
        PagePart::Text(text)
    }
}

impl From<&str> for PagePart {
    fn from(text: &str) -> Self {
        PagePart::Text(text.to_owned())
    }
}

impl From<PageTable> for PagePart {
    fn from(table: PageTable) -> Self {
        PagePart::Table(table)
    }
}

impl Page {
    pub(crate) fn new(title: impl Into<String>, verdict: impl Into<String>) -> Page {
        Page {
            title: title.into(),
            verdict: verdict.into(),
            parts: Vec::new(),
        }
    }

    pub(crate) fn with(mut self, part: impl Into<PagePart>) -> Page {
        self.parts.push(part.into());
        self
    }

    /// Adds all parts; an `Option` adds one or none.
    pub(crate) fn with_all(mut self, parts: impl IntoIterator<Item = impl Into<PagePart>>) -> Page {
        self.parts.extend(parts.into_iter().map(Into::into));
        self
    }

    /// Adds lines, such as names of files, as one part.
    pub(crate) fn with_lines<'a>(self, lines: impl IntoIterator<Item = &'a String>) -> Page {
        let lines: Vec<&str> = lines.into_iter().map(String::as_str).collect();
        self.with(lines.join("\n"))
    }

    /// Adds parts without blank lines before them. Below a detail they are details, too.
    pub(crate) fn below(mut self, parts: impl IntoIterator<Item = impl Into<PagePart>>) -> Page {
        let is_detail = matches!(self.parts.last(), Some(PagePart::Detail(_)));
        for part in parts {
            let part = PagePart::Below(Box::new(part.into()));
            self.parts.push(if is_detail { part.detail() } else { part });
        }
        self
    }

    /// Adds details.
    pub(crate) fn details(mut self, parts: impl IntoIterator<Item = impl Into<PagePart>>) -> Page {
        self.parts.extend(parts.into_iter().map(|part| part.into().detail()));
        self
    }
}

impl PagePart {
    /// The part as a detail.
    pub fn detail(self) -> PagePart {
        PagePart::Detail(Box::new(self))
    }
}

/// A table in words. Without titles of columns it has no header.
#[derive(Debug, Default)]
pub(crate) struct PageTable {
    pub title: String,
    pub columns: Vec<Heading>,
    pub rows: Vec<Vec<String>>,
    /// Number of first rows that are no details; `None`: all.
    pub brief: Option<usize>,
}

#[derive(Debug)]
pub(crate) struct Heading {
    pub title: String,
    /// Numbers are aligned to the right.
    pub number: bool,
}

impl PageTable {
    /// A table with a row for each of these; its columns are declared one by one.
    pub fn of<R: Copy>(rows: impl IntoIterator<Item = R>) -> PageRows<R> {
        let of: Vec<R> = rows.into_iter().collect();
        let table = PageTable {
            rows: vec![Vec::new(); of.len()],
            ..PageTable::default()
        };
        PageRows { of, table }
    }

    /// A table of names and values, without a header.
    pub fn pairs<'a>(rows: impl IntoIterator<Item = (&'a str, String)>) -> PageTable {
        let rows: Vec<_> = rows.into_iter().collect();
        PageTable::of(&rows)
            .text("", |row| row.0)
            .text("", |row| row.1.as_str())
            .done()
    }

    pub fn titled(mut self, title: impl Into<String>) -> PageTable {
        self.title = title.into();
        self
    }

    /// Makes details of all rows but the first ones.
    pub fn brief(mut self, rows: usize) -> PageTable {
        self.brief = Some(rows);
        self
    }

    /// Replaces these rows by one row with `words`, such as "... 12 more".
    pub fn without(mut self, rows: Range<usize>, words: &[String]) -> PageTable {
        if !rows.is_empty() {
            self.rows.splice(rows, [words.to_vec()]);
        }
        self
    }

    pub fn has_header(&self) -> bool {
        self.columns.iter().any(|column| !column.title.is_empty())
    }
}

/// A table under construction: each column is a title, and how a row's value is printed.
pub(crate) struct PageRows<R> {
    of: Vec<R>,
    table: PageTable,
}

impl<R: Copy> PageRows<R> {
    fn column<S: ToString>(mut self, title: String, number: bool, value: impl Fn(R) -> S) -> Self {
        for (row, cells) in self.of.iter().zip(&mut self.table.rows) {
            cells.push(value(*row).to_string());
        }
        self.table.columns.push(Heading { title, number });
        self
    }

    /// A column of texts.
    pub fn text<S: ToString>(self, title: &str, value: impl Fn(R) -> S) -> Self {
        self.column(title.to_owned(), false, value)
    }

    /// A column of counts, or of numbers that are printed already.
    pub fn count<S: ToString>(self, title: &str, value: impl Fn(R) -> S) -> Self {
        self.column(title.to_owned(), true, value)
    }

    /// A column of numbers in a unit, which is part of the title unless it is empty.
    pub fn number<N: Into<Option<f64>>>(
        self,
        title: &str,
        unit: &str,
        digits: NumberFormat,
        value: impl Fn(R) -> N,
    ) -> Self {
        let title = match unit {
            "" => title.to_owned(),
            unit => format!("{title}, {unit}"),
        };
        self.column(title, true, |row| digits.print(value(row)))
    }

    /// Takes the last column out again unless the condition holds.
    pub fn only_if(mut self, condition: bool) -> Self {
        if !condition {
            self.table.columns.pop();
            for cells in &mut self.table.rows {
                cells.pop();
            }
        }
        self
    }

    pub fn done(self) -> PageTable {
        self.table
    }
}

/// How a number is printed: in a style, with so many digits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NumberFormat {
    style: fn(f64, usize) -> String,
    digits: usize,
    missing: &'static str,
}

const fn format(style: fn(f64, usize) -> String, digits: usize) -> NumberFormat {
    NumberFormat {
        style,
        digits,
        missing: "none",
    }
}

/// Fixed-point notation with this number of decimals.
pub(crate) const fn fixed(decimals: usize) -> NumberFormat {
    format(|value, decimals| format!("{value:.decimals$}"), decimals)
}

/// Scientific notation with this number of decimals.
pub(crate) const fn exponent(decimals: usize) -> NumberFormat {
    format(|value, decimals| format!("{value:.decimals$e}"), decimals)
}

/// An upper bound, rounded up; one that is not finite is unknown.
pub(crate) const fn upper_bound() -> NumberFormat {
    format(bound_or_unknown, 1)
}

/// At most this number of significant digits, without trailing zeros.
pub(crate) const fn significant(digits: usize) -> NumberFormat {
    format(significant_digits, digits)
}

/// Six significant digits, with trailing zeros.
pub(crate) const fn six_digits() -> NumberFormat {
    format(all_digits, 6)
}

impl NumberFormat {
    /// The text of a missing number, instead of "none".
    pub const fn or(self, missing: &'static str) -> NumberFormat {
        NumberFormat { missing, ..self }
    }

    pub fn print(self, value: impl Into<Option<f64>>) -> String {
        let text = value.into().map(|value| (self.style)(value, self.digits));
        text.unwrap_or_else(|| self.missing.to_owned())
    }
}

fn bound_or_unknown(value: f64, decimals: usize) -> String {
    match value.is_finite() {
        true => bound(value, decimals),
        false => "unknown".to_owned(),
    }
}

fn all_digits(value: f64, digits: usize) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if (1e-3..1e6).contains(&size) => {
            let places = digits as f64 - 1.0 - size.log10().floor();
            format!("{value:.0$}", places.max(0.0) as usize)
        }
        _ => format!("{value:.*e}", digits - 1),
    }
}

fn significant_digits(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..9.0).contains(&magnitude) {
        return format!("{value:.*e}", digits - 1);
    }
    let decimals = (digits as f64 - 1.0 - magnitude).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// The status of a computation in its document.
fn status(interrupted: bool) -> &'static str {
    if interrupted { "interrupted" } else { "complete" }
}

/// Least and largest of some numbers.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    })
}
