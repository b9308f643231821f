//! Columns of a candidate by their names alone, whatever they mean.

use super::super::CompareError;
use super::source::Source;
use super::table::Table;
use super::{HEAD, table_of};
use crate::input::Lines;
use crate::quote::shown;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// A table as it stands in a file.
#[derive(Debug, Default)]
pub(in super::super) struct Plain {
    /// s; of rows at one time the last one is taken.
    pub time: Vec<f64>,
    /// Those of the names asked for that the file has, without a unit of its own.
    pub columns: Vec<(String, Vec<f64>)>,
    /// The column `kind`.
    pub kinds: Option<Vec<String>>,
    /// What a comment `# threshold:` says.
    pub threshold: Option<f64>,
}

/// Magnitudes of a row add up to no more.
const LARGEST: f64 = 1e100;

impl Plain {
    /// Whether the file at `path` is a table of events by its column `kind`.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn states_events(path: &Path) -> Result<bool, CompareError> {
        Ok(!is_hdf5(path)? && open(path)?.has_texts("kind"))
    }

    /// Reads `time`, `kind`, and those columns of `names` that there are.
    ///
    /// # Errors
    /// If the file cannot be read, has no column `time` in seconds, one that goes back, or a value that is no finite number.
    pub fn read(path: &Path, names: &[&str]) -> Result<Plain, CompareError> {
        let table = open(path)?;
        if !table.has("time") || table.unit("time").is_some() {
            let remedy = "give times in seconds, in a column of this name without a unit";
            return Err(CompareError::whole(path, "has no column time", remedy));
        }
        let has_kinds = table.has_texts("kind");
        let is_asked = |name: &&&str| !has_kinds && table.has(name) && table.unit(name).is_none();
        let asked = names.iter().filter(is_asked).map(|name| (*name).to_owned());
        let columns: Vec<String> = std::iter::once("time".to_owned()).chain(asked).collect();
        let mut read: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
        let mut pass = table.pass(&columns)?;
        let mut rows = 0;
        loop {
            let mut block = vec![Vec::new(); columns.len()];
            pass(&mut block)?;
            if block[0].is_empty() {
                break;
            }
            for row in 0..block[0].len() {
                let time = block[0][row];
                let last = read[0].last().copied().unwrap_or(f64::NEG_INFINITY);
                let refuse = |column: &str, what: String, remedy: &str| {
                    Err(CompareError::content(path, table.place(rows, column), what, remedy))
                };
                let size: f64 = block.iter().map(|column| column[row].abs()).sum();
                if size.is_nan() || size > LARGEST {
                    let wrong = |values: &Vec<f64>| !values[row].is_finite() || values[row].abs() > LARGEST;
                    let column = block.iter().position(wrong).unwrap_or(0);
                    let what = format!("{:?} is no number of a motion", block[column][row]);
                    return refuse(&columns[column], what, "leave out such rows");
                }
                if time < last {
                    return refuse(
                        "time",
                        format!("{time:?} s comes after {last:?} s"),
                        "sort the rows by time",
                    );
                }
                if time == last && !has_kinds {
                    for column in &mut read {
                        column.pop();
                    }
                }
                for (column, values) in read.iter_mut().zip(&block) {
                    column.push(values[row]);
                }
                rows += 1;
            }
        }
        let mut read = columns.into_iter().zip(read);
        Ok(Plain {
            time: read.next().map_or_else(Vec::new, |(_, time)| time),
            columns: read.collect(),
            kinds: has_kinds.then(|| table.texts("kind")).transpose()?,
            threshold: threshold(path)?,
        })
    }
}

fn is_hdf5(path: &Path) -> Result<bool, CompareError> {
    Ok(Source::open(path)?.head(HEAD)?.starts_with(b"\x89HDF"))
}

fn open(path: &Path) -> Result<Box<dyn Table>, CompareError> {
    let source = Source::open(path)?;
    let head = source.head(HEAD)?;
    Ok(table_of(source, &head)?.1)
}

/// The number at the beginning of what the first comment `# threshold:` of a text says.
fn threshold(path: &Path) -> Result<Option<f64>, CompareError> {
    let head = Source::open(path)?.head(HEAD)?;
    if head.contains(&0) || head.starts_with(b"PK") {
        return Ok(None);
    }
    let file = File::open(path).map_err(CompareError::io(path))?;
    for (number, line) in (1..).zip(BufReader::new(Lines::new(file)).split(b'\n')) {
        let line = line.map_err(CompareError::io(path))?;
        if !line.starts_with(b"#") {
            continue;
        }
        let text = String::from_utf8_lossy(&line);
        let said = text.trim_start_matches('#').split_once(':');
        let Some((_, value)) = said.filter(|(name, _)| name.trim().eq_ignore_ascii_case("threshold")) else {
            continue;
        };
        let speed = value.split_whitespace().next().and_then(|word| word.parse().ok());
        return match speed.filter(|speed: &f64| speed.is_finite() && *speed >= 0.0) {
            Some(speed) => Ok(Some(speed)),
            None => {
                let what = format!("threshold {} is no speed", shown(value.trim()));
                let remedy = "write a speed in the problem's unit, such as # threshold: 1e-6";
                Err(CompareError::content(path, format!("line {number}"), what, remedy))
            }
        };
    }
    Ok(None)
}
