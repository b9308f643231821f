//! Columns of HDF5 files: our own results, and files of other programs.

use super::super::CompareError;
use super::table::{BLOCK, Pass, Slice, Table, of_one_length};
use crate::results::{ForeignColumn, ForeignFile, ResultError, ResultFile};
use std::path::Path;

/// The trajectory of one of this program's results.
#[derive(Debug)]
pub(crate) struct OwnTable {
    /// The result.
    pub file: ResultFile,
}

impl Table for OwnTable {
    fn path(&self) -> &Path {
        self.file.path()
    }

    fn names(&self) -> Vec<String> {
        crate::results::schema::trajectory()
            .variables
            .into_iter()
            .map(|v| v.name)
            .collect()
    }

    fn has(&self, name: &str) -> bool {
        self.names().iter().any(|known| known == name)
    }

    fn pass(&self, columns: &[String]) -> Result<Box<dyn Pass>, CompareError> {
        // A second handle, so that the pass can outlive this borrow.
        let file = ResultFile::open(self.path())?;
        let rows = file.sample_count()?;
        Ok(Box::new(OwnPass {
            file,
            columns: columns.to_vec(),
            row: 0,
            rows,
        }))
    }

    fn place(&self, row: u64, column: &str) -> String {
        format!("row {row} of /trajectory/{column}")
    }
}

struct OwnPass {
    file: ResultFile,
    columns: Vec<String>,
    row: usize,
    rows: usize,
}

impl Pass for OwnPass {
    fn next(&mut self, columns: &mut [Vec<f64>]) -> Result<(), CompareError> {
        let range = self.row..self.rows.min(self.row + BLOCK);
        self.row = range.end;
        for (name, column) in self.columns.iter().zip(columns) {
            *column = self.file.column(name, range.clone())?;
        }
        Ok(())
    }
}

/// An HDF5 file of another program.
#[derive(Debug)]
pub(crate) struct ForeignTable {
    /// The file.
    pub file: ForeignFile,
}

impl ForeignTable {
    /// The path of the variable that is meant: as it is, or the only one whose last part is `name`.
    fn resolve<'a>(&'a self, array: &'a str) -> Option<&'a str> {
        Self::resolve_in(self.file.names(), array)
    }

    fn resolve_in<'a>(names: &'a [String], array: &str) -> Option<&'a str> {
        let array = array.trim_start_matches('/');
        if let Some(name) = names.iter().find(|name| *name == array) {
            return Some(name);
        }
        let mut by_end = names.iter().filter(|name| {
            name.rsplit('/')
                .next()
                .is_some_and(|end| end.eq_ignore_ascii_case(array))
        });
        let first = by_end.next()?;
        by_end.next().is_none().then_some(first.as_str())
    }
}

impl Table for ForeignTable {
    fn path(&self) -> &Path {
        self.file.path()
    }

    fn names(&self) -> Vec<String> {
        self.file.names().to_vec()
    }

    fn has(&self, name: &str) -> bool {
        let slice = Slice::parse(name);
        let shape = self.resolve(slice.array).and_then(|array| self.file.shape(array));
        shape.is_some_and(|shape| slice.elements(&shape).is_some())
    }

    fn left_out(&self) -> Option<&str> {
        self.file.left_out()
    }

    fn has_texts(&self, name: &str) -> bool {
        self.has(name) || Self::resolve_in(self.file.text_names(), name).is_some()
    }

    fn unit(&self, name: &str) -> Option<String> {
        self.file.units(self.resolve(Slice::parse(name).array)?)
    }

    fn pass(&self, columns: &[String]) -> Result<Box<dyn Pass>, CompareError> {
        let mut pass = ForeignPass {
            columns: Vec::new(),
            row: 0,
            rows: 0,
        };
        let mut last: Option<(&str, usize)> = None;
        for name in columns {
            let slice = Slice::parse(name);
            let array = self.resolve(slice.array).unwrap_or(slice.array);
            let column = self.file.column(array)?;
            let shape = self.file.shape(array).unwrap_or_default();
            let Some((start, stride, rows)) = slice.elements(&shape) else {
                let what = format!("is of shape {shape:?}, not a column");
                return Err(CompareError::content(
                    self.path(),
                    name.as_str(),
                    what,
                    "name a slice of it, such as y[2]",
                ));
            };
            last.map_or(Ok(()), |last| of_one_length(self.path(), name, rows, last))?;
            last = Some((name, rows));
            pass.rows = rows;
            let row = slice.of.is_some() && stride == 1 && shape.len() == 2;
            pass.columns.push((column, Part::of(&shape, start, stride, row)));
        }
        Ok(Box::new(pass))
    }

    fn texts(&self, column: &str) -> Result<Vec<String>, CompareError> {
        let texts = Self::resolve_in(self.file.text_names(), column);
        let array = texts.or_else(|| self.resolve(column)).unwrap_or(column);
        Ok(self.file.texts(array)?)
    }

    fn place(&self, row: u64, column: &str) -> String {
        format!("row {row} of {}", self.resolve(column).unwrap_or(column))
    }
}

/// Which part of a variable is the column.
#[derive(Clone, Copy)]
enum Part {
    Whole,
    Row(usize),
    Column(usize),
}

impl Part {
    fn of(shape: &[usize], start: usize, stride: usize, row: bool) -> Part {
        match shape {
            [_] => Part::Whole,
            // An unsliced 1 x n or n x 1.
            [1, _] if start == 0 => Part::Row(0),
            [_, 1] if start == 0 => Part::Column(0),
            &[_, columns] if row => Part::Row(start / columns.max(1)),
            _ => Part::Column(start % stride.max(1)),
        }
    }
}

struct ForeignPass {
    columns: Vec<(ForeignColumn, Part)>,
    row: usize,
    rows: usize,
}

impl Pass for ForeignPass {
    fn next(&mut self, columns: &mut [Vec<f64>]) -> Result<(), CompareError> {
        let range = self.row..self.rows.min(self.row + BLOCK);
        self.row = range.end;
        for ((source, part), column) in self.columns.iter().zip(columns) {
            let read: Result<Vec<f64>, ResultError> = match *part {
                _ if range.is_empty() => Ok(Vec::new()),
                Part::Whole => source.read(std::slice::from_ref(&range)),
                Part::Row(row) => source.read(&[row..row + 1, range.clone()]),
                Part::Column(k) => source.read(&[range.clone(), k..k + 1]),
            };
            *column = read?;
        }
        Ok(())
    }
}
