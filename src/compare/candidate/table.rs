//! Files as columns of numbers, read block by block.

use super::super::CompareError;
use super::super::resolution::Rounding;
use std::path::Path;

/// Rows read at a time.
pub(crate) const BLOCK: usize = 65_536;

/// A file whose columns have names.
pub trait Table: std::fmt::Debug {
    /// The file.
    fn path(&self) -> &Path;
    /// Names of the columns, as people would write them in a mapping.
    fn names(&self) -> Vec<String>;
    /// Whether there is a column of this name, which may be a slice.
    fn has(&self, name: &str) -> bool;
    /// Whether there is a column of this name that can be read as texts.
    fn has_texts(&self, name: &str) -> bool {
        self.has(name)
    }
    /// Whether a column of this name is what the program itself calls so: of a file that names its columns after its own
    /// variables, only the mapping says what they are.
    fn recognises(&self, name: &str) -> bool {
        self.has(name)
    }
    /// The column of times beside another one, of a file that has several.
    fn time_beside(&self, _column: &str) -> Option<String> {
        None
    }
    /// Why there is no column of a name, where the file can say more than that.
    fn why_not(&self, _name: &str) -> Option<String> {
        None
    }
    /// Whether a column holds the integral of a force over time, by what the format says.
    fn is_impulse(&self, _name: &str) -> bool {
        false
    }
    /// To what the numbers of a column are rounded where they are texts.
    ///
    /// # Errors
    /// Of the file.
    fn rounding(&self, _name: &str) -> Result<Option<Rounding>, CompareError> {
        Ok(None)
    }
    /// Why a column of the file was left out: one that cannot be read.
    fn left_out(&self) -> Option<&str> {
        None
    }
    /// The unit that the file itself states for a column.
    fn unit(&self, _name: &str) -> Option<String> {
        None
    }
    /// Starts reading columns from their first row.
    ///
    /// # Errors
    /// Of the file, or if the columns differ in length.
    fn pass(&self, columns: &[String]) -> Result<Box<dyn Pass + '_>, CompareError>;
    /// A column as text, for kinds of events; nothing of a format without texts.
    ///
    /// # Errors
    /// Of the file.
    fn texts(&self, _column: &str) -> Result<Vec<String>, CompareError> {
        Ok(Vec::new())
    }
    /// How messages name a row, counted from 0: "line 12", "row 10".
    fn place(&self, row: u64, column: &str) -> String {
        format!("row {row} of {column}")
    }
}

/// That a column has as many rows as another one before it.
///
/// # Errors
/// It has not.
pub(super) fn of_one_length(path: &Path, name: &str, rows: usize, other: (&str, usize)) -> Result<(), CompareError> {
    if rows == other.1 {
        return Ok(());
    }
    let what = format!("has {rows} rows, but {} has {}", other.0, other.1);
    Err(CompareError::content(path, name, what, "columns are of one length"))
}

/// A pass over some columns of a table.
pub trait Pass {
    /// Replaces `columns` by the next rows, up to `BLOCK` of them, as many of each; none at the end.
    ///
    /// # Errors
    /// Of the file, with the place.
    fn next(&mut self, columns: &mut [Vec<f64>]) -> Result<(), CompareError>;
}

/// The array and the slice that `NAME[2]`, `NAME[2,:]` or `NAME[:,2]` mean.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Slice<'a> {
    /// Name of the array.
    pub array: &'a str,
    /// Which row (`true`) or column (`false`) of two dimensions; `None` for an array of one.
    pub of: Option<(usize, Option<bool>)>,
}

impl<'a> Slice<'a> {
    /// Reads a name.
    pub fn parse(name: &'a str) -> Slice<'a> {
        let whole = Slice { array: name, of: None };
        let Some((array, rest)) = name.split_once('[') else {
            return whole;
        };
        let Some(index) = rest.strip_suffix(']') else {
            return whole;
        };
        let parts: Vec<&str> = index.split(',').map(str::trim).collect();
        let number = |text: &str| text.parse::<usize>().ok();
        let of = match parts[..] {
            [k] => number(k).map(|k| (k, None)),
            [k, ":"] => number(k).map(|k| (k, Some(true))),
            [":", k] => number(k).map(|k| (k, Some(false))),
            _ => None,
        };
        if of.is_some() { Slice { array, of } } else { whole }
    }

    /// Start, stride and number of the elements in an array of this shape, stored row by row; `None` if the array has
    /// no such slice. `NAME[2]` is a row if the array has fewer rows than columns.
    pub fn elements(&self, shape: &[usize]) -> Option<(usize, usize, usize)> {
        match (shape, self.of) {
            ([n] | [n, 1] | [1, n], None) => Some((0, 1, *n)),
            (&[rows, columns], Some((k, row))) => {
                if row.unwrap_or(rows < columns) {
                    (k < rows).then(|| (k.saturating_mul(columns), 1, columns))
                } else {
                    (k < columns).then_some((k, columns, rows))
                }
            }
            _ => None,
        }
    }
}
