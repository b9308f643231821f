//! Files as columns of numbers, read block by block.

use super::super::CompareError;
use super::super::resolution::Rounding;
use crate::quote::shown;
use std::collections::HashMap;
use std::path::Path;

/// Rows read at a time.
pub(super) const BLOCK: usize = 65_536;

/// A pass over some columns of a table: replaces them by the next rows, up to [`BLOCK`] of them, as many of each; none at the end.
/// Its errors name the place.
pub(super) type Pass<'a> = Box<dyn FnMut(&mut [Vec<f64>]) -> Result<(), CompareError> + 'a>;

/// A file whose columns have names.
pub(super) trait Table: std::fmt::Debug {
    /// The file.
    fn path(&self) -> &Path;
    /// Names of the columns, as people would write them in a mapping.
    fn names(&self) -> Vec<String>;
    /// Whether there is a column of this name, which may be a slice.
    fn has(&self, name: &str) -> bool;
    /// Whether there is a column of this name that can be read as texts.
    fn has_texts(&self, _name: &str) -> bool {
        false
    }
    /// The columns that a name may mean: those of this very name, or if not `exact` those of a name that is nearly the same.
    fn columns_of(&self, name: &str, exact: bool) -> Vec<String> {
        let found = exact && self.has(name);
        found.then(|| name.to_owned()).into_iter().collect()
    }
    /// Whether a column of this name is what the program itself calls so: of a file that names its columns after its own
    /// variables, only the mapping says what they are.
    fn recognises(&self, _name: &str) -> bool {
        true
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
    fn rounding(&self, _name: &str) -> Result<Option<Rounding>, CompareError> {
        Ok(None)
    }
    /// What the file has beside its columns and cannot be read as one.
    fn left_out(&self) -> &[LeftOut] {
        &[]
    }
    /// The paths of which a name is the last part, in a file whose columns have paths.
    fn paths_of(&self, _name: &str) -> Vec<String> {
        Vec::new()
    }
    /// The shape of the array of a name, which may be no column.
    fn shape(&self, _name: &str) -> Option<Vec<usize>> {
        None
    }
    /// The unit that the file itself states for a column.
    fn unit(&self, _name: &str) -> Option<String> {
        None
    }
    /// Starts reading columns, which are of one length, from their first row.
    fn pass(&self, columns: &[String]) -> Result<Pass<'_>, CompareError>;
    /// A column as text, for kinds of events; nothing of a format without texts.
    fn texts(&self, _column: &str) -> Result<Vec<String>, CompareError> {
        Ok(Vec::new())
    }
    /// How messages name a row, counted from 0: "line 12", "row 10".
    fn place(&self, row: u64, column: &str) -> String {
        format!("row {row} of {column}")
    }
}

/// Something in a file that is not read as a column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct LeftOut {
    pub name: String,
    /// What it holds, or is.
    pub why: String,
    pub remedy: String,
}

impl LeftOut {
    /// Whether a name means it: the whole one, or the last part of its path.
    pub fn is(&self, name: &str) -> bool {
        let name = Slice::parse(name).array.trim_start_matches('/');
        let end = self.name.rsplit('/').next().unwrap_or_default();
        [&self.name, end].iter().any(|known| known.eq_ignore_ascii_case(name))
    }

    /// The error where it is needed.
    pub fn error(self, path: &Path) -> CompareError {
        CompareError::content(path, shown(&self.name), self.why, self.remedy)
    }
}

/// Why there is no column of a name although the file has something of this name.
pub(super) fn unread(table: &dyn Table, name: &str) -> Option<LeftOut> {
    let of = |why: String, remedy: &str| LeftOut {
        name: Slice::parse(name).array.to_owned(),
        why,
        remedy: remedy.to_owned(),
    };
    let known = table.left_out().iter().find(|left_out| left_out.is(name));
    known.cloned().or_else(|| {
        let paths = table.paths_of(name);
        if paths.len() > 1 {
            let why = format!("is the last part of several paths, {}", paths.join(", "));
            return Some(of(why, "name one of them in a mapping or with --column"));
        }
        match table.shape(name).as_deref() {
            Some([]) => Some(of("is a single number".to_owned(), "give a value for each row")),
            Some(shape @ ([_] | [_, _])) => {
                let why = format!("is of shape {shape:?}, not a column");
                Some(of(why, "name a slice of it, such as y[2]"))
            }
            Some(shape) => {
                let why = format!("is of shape {shape:?}, not a column");
                Some(of(why, "save one dimension of it"))
            }
            None => table
                .has_texts(name)
                .then(|| of("holds texts".to_owned(), "save numbers")),
        }
    })
}

/// That no two columns of a line of names, counted from 1, have the same name.
pub(super) fn each_once<'a>(
    path: &Path,
    line: u64,
    names: impl Iterator<Item = (usize, &'a str)>,
) -> Result<(), CompareError> {
    let mut places = HashMap::new();
    for (place, name) in names.filter(|(_, name)| !name.is_empty()) {
        if let Some(first) = places.insert(name, place) {
            let what = format!("columns {first} and {place} are both called \"{}\"", shown(name));
            let remedy = "give each column a name of its own";
            return Err(CompareError::content(path, format!("line {line}"), what, remedy));
        }
    }
    Ok(())
}

/// The place of a name in a list: as it is, else in other letters of upper or lower case.
pub(super) fn place_of<'a>(mut names: impl Iterator<Item = &'a str> + Clone, name: &str) -> Option<usize> {
    let exact = names.clone().position(|known| known == name);
    exact.or_else(|| names.position(|known| known.eq_ignore_ascii_case(name)))
}

/// That a column has as many rows as another one before it.
pub(super) fn of_one_length(path: &Path, name: &str, rows: usize, other: (&str, usize)) -> Result<(), CompareError> {
    if rows == other.1 {
        return Ok(());
    }
    let what = format!("has {rows} rows, but {} has {}", other.0, other.1);
    Err(CompareError::content(path, name, what, "columns are of one length"))
}

/// That an array of this shape is no column, nor the slice of it that was named.
pub(super) fn no_column(path: &Path, name: &str, shape: &[usize]) -> CompareError {
    let what = format!("is of shape {shape:?}, not a column");
    CompareError::content(path, name, what, "name a slice of it, such as y[2]")
}

/// The array and the slice that `NAME[2]`, `NAME[2,:]` or `NAME[:,2]` mean.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Slice<'a> {
    /// Name of the array.
    pub array: &'a str,
    /// Which row (`true`) or column (`false`) of two dimensions; `None` for an array of one.
    pub of: Option<(usize, Option<bool>)>,
}

impl<'a> Slice<'a> {
    /// Reads a name.
    pub fn parse(name: &'a str) -> Slice<'a> {
        let inside = name.strip_suffix(']').and_then(|start| start.split_once('['));
        let sliced = inside.and_then(|(array, index)| {
            let number = |text: &str| text.parse::<usize>().ok();
            let parts: Vec<&str> = index.split(',').map(str::trim).collect();
            let of = match parts[..] {
                [k] => (number(k)?, None),
                [k, ":"] => (number(k)?, Some(true)),
                [":", k] => (number(k)?, Some(false)),
                _ => return None,
            };
            Some(Slice { array, of: Some(of) })
        });
        sliced.unwrap_or(Slice { array: name, of: None })
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
