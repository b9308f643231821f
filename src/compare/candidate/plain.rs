//! Columns of a candidate by their names alone, whatever they mean.

use super::super::CompareError;
use super::source::Source;
use super::{HEAD, table_of};
use crate::input::Lines;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// A table as it stands in a file.
#[derive(Debug, Default)]
pub(in super::super) struct Plain {
    /// s; of rows at one time the last one is taken.
    pub time: Vec<f64>,
    /// Those of the names asked for that the file has.
    pub columns: Vec<(String, Vec<f64>)>,
    /// The column `kind`.
    pub kinds: Option<Vec<String>>,
    /// What a comment `# threshold:` says.
    pub threshold: Option<f64>,
}

impl Plain {
    /// Whether the file at `path` is a table of events by its column `kind`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn states_events(path: &Path) -> Result<bool, CompareError> {
        let source = Source::open(path)?;
        let head = source.head(HEAD)?;
        // A result of this program has events of its own.
        if head.starts_with(b"\x89HDF") {
            return Ok(false);
        }
        Ok(table_of(source, &head)?.1.has_texts("kind"))
    }

    /// Reads `time`, `kind`, and those columns of `names` that there are.
    ///
    /// # Errors
    /// If the file cannot be read, has no column `time`, or one that goes back.
    pub fn read(path: &Path, names: &[&str]) -> Result<Plain, CompareError> {
        let source = Source::open(path)?;
        let head = source.head(HEAD)?;
        let (format, table) = table_of(source, &head)?;
        if !table.has("time") {
            let remedy = "name the column of times so, and give them in seconds";
            return Err(CompareError::whole(path, "has no column time", remedy));
        }
        let has_kinds = table.has_texts("kind");
        let asked = names.iter().filter(|name| !has_kinds && table.has(name));
        let columns: Vec<String> = std::iter::once("time")
            .chain(asked.copied())
            .map(str::to_owned)
            .collect();
        let mut read: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
        let mut pass = table.pass(&columns)?;
        loop {
            let mut block = vec![Vec::new(); columns.len()];
            pass(&mut block)?;
            if block[0].is_empty() {
                break;
            }
            for row in 0..block[0].len() {
                let (time, last) = (block[0][row], read[0].last().copied().unwrap_or(f64::NEG_INFINITY));
                let place = || table.place((read[0].len()) as u64, "time");
                if !block.iter().all(|column| column[row].is_finite()) {
                    return Err(CompareError::content(
                        path,
                        place(),
                        "a value that is no number",
                        "leave out such rows",
                    ));
                }
                if time < last {
                    let what = format!("{time:?} s comes after {last:?} s");
                    return Err(CompareError::content(path, place(), what, "sort the rows by time"));
                }
                if time == last && !has_kinds {
                    for column in &mut read {
                        column.pop();
                    }
                }
                for (column, values) in read.iter_mut().zip(&block) {
                    column.push(values[row]);
                }
            }
        }
        let mut read = columns.into_iter().zip(read);
        Ok(Plain {
            time: read.next().map_or_else(Vec::new, |(_, time)| time),
            columns: read.collect(),
            kinds: has_kinds.then(|| table.texts("kind")).transpose()?,
            threshold: if format == "CSV" {
                said(path, "threshold")?
            } else {
                None
            },
        })
    }
}

/// The number that a comment of a CSV file says, as `# name: 1e-6`; the last one counts.
fn said(path: &Path, name: &str) -> Result<Option<f64>, CompareError> {
    let file = File::open(path).map_err(CompareError::io(path))?;
    let mut found = None;
    for line in BufReader::new(Lines::new(file)).split(b'\n') {
        let line = line.map_err(CompareError::io(path))?;
        let text = line.strip_prefix(b"#").map(String::from_utf8_lossy);
        let said = text.as_deref().and_then(|text| text.split_once(':'));
        if let Some((_, value)) = said.filter(|(said, _)| said.trim() == name) {
            found = value
                .trim()
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite())
                .or(found);
        }
    }
    Ok(found)
}
