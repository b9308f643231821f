//! Columns of HDF5 files: result files, and files of other programs.

use super::super::CompareError;
use super::table::{BLOCK, CandidateTable, LeftOut, Pass, Slice, no_column, of_one_length};
use std::path::Path;
use stickslip_files::{ForeignFile, ResultFile};
use stickslip_system::quote::shown;

#[derive(Debug)]
pub(super) struct OwnTable {
    pub file: ResultFile,
}

impl CandidateTable for OwnTable {
    fn path(&self) -> &Path {
        self.file.path()
    }

    fn names(&self) -> Vec<String> {
        let variables = stickslip_files::schema::trajectory().variables;
        variables.into_iter().map(|v| v.name).collect()
    }

    fn has(&self, name: &str) -> bool {
        self.names().iter().any(|known| known == name)
    }

    fn pass(&self, columns: &[String]) -> Result<Pass<'_>, CompareError> {
        let (names, rows, mut row) = (columns.to_vec(), self.file.sample_count()?, 0);
        Ok(Box::new(move |columns| {
            let range = row..rows.min(row + BLOCK);
            row = range.end;
            for (name, column) in names.iter().zip(columns) {
                *column = self.file.column(name, range.clone())?;
            }
            Ok(())
        }))
    }
}

#[derive(Debug)]
pub(super) struct ForeignTable {
    file: ForeignFile,
    left_out: Vec<LeftOut>,
}

impl ForeignTable {
    pub fn of(file: ForeignFile) -> ForeignTable {
        let left_out = file.left_out().iter().map(|(path, why)| LeftOut {
            name: path.clone(),
            why: why.clone(),
            remedy: "write it as an array of floats".to_owned(),
        });
        let left_out = left_out.collect();
        ForeignTable { file, left_out }
    }

    fn resolve<'a>(&'a self, array: &str) -> Option<&'a str> {
        resolve_in(self.file.names(), array)
    }
}

/// The path that equals `name`, or else the only path that ends in `name`.
fn resolve_in<'a>(paths: &'a [String], name: &str) -> Option<&'a str> {
    let name = name.trim_start_matches('/');
    let exact = paths.iter().find(|path| *path == name);
    let mut by_end = paths.iter().filter(|path| is_end_of(path, name));
    let only = || by_end.next().filter(|_| by_end.next().is_none());
    exact.or_else(only).map(String::as_str)
}

fn is_end_of(path: &str, name: &str) -> bool {
    path.rsplit('/')
        .next()
        .is_some_and(|end| end.eq_ignore_ascii_case(name))
}

impl CandidateTable for ForeignTable {
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

    fn columns_of(&self, name: &str, exact: bool) -> Vec<String> {
        let (array, slice) = name.split_at(Slice::parse(name).array.len());
        let path = self.resolve(array).filter(|_| self.has(name));
        let path = path.filter(|path| (*path == array.trim_start_matches('/')) == exact);
        path.map(|path| format!("{path}{slice}")).into_iter().collect()
    }

    fn paths_of(&self, name: &str) -> Vec<String> {
        let end = Slice::parse(name).array;
        let paths = self.file.names().iter().filter(|path| is_end_of(path, end));
        paths.map(|path| shown(path)).collect()
    }

    fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    fn shape(&self, name: &str) -> Option<Vec<usize>> {
        let array = Slice::parse(name).array;
        let path = self.resolve(array).or_else(|| resolve_in(self.file.unshaped(), array));
        self.file.shape(path?)
    }

    fn has_texts(&self, name: &str) -> bool {
        self.has(name) || resolve_in(self.file.text_names(), name).is_some()
    }

    fn unit(&self, name: &str) -> Option<String> {
        self.file.units(self.resolve(Slice::parse(name).array)?)
    }

    fn pass(&self, columns: &[String]) -> Result<Pass<'_>, CompareError> {
        let mut parts = Vec::new();
        let mut last: Option<(&str, usize)> = None;
        for name in columns {
            let slice = Slice::parse(name);
            let array = self.resolve(slice.array).unwrap_or(slice.array);
            let column = self.file.column(array)?;
            let shape = self.file.shape(array).unwrap_or_default();
            let Some((start, stride, rows)) = slice.elements(&shape) else {
                return Err(no_column(self.path(), name, &shape));
            };
            last.map_or(Ok(()), |last| of_one_length(self.path(), name, rows, last))?;
            last = Some((name, rows));
            let is_row = slice.of.is_some() && stride == 1 && shape.len() == 2;
            parts.push((column, Hdf5Part::of(&shape, start, stride, is_row)));
        }
        let (rows, mut row) = (last.map_or(0, |last| last.1), 0);
        Ok(Box::new(move |columns| {
            let range = row..rows.min(row + BLOCK);
            row = range.end;
            for ((source, part), column) in parts.iter().zip(columns) {
                *column = match *part {
                    _ if range.is_empty() => Vec::new(),
                    Hdf5Part::Whole => source.read(std::slice::from_ref(&range))?,
                    Hdf5Part::Row(row) => source.read(&[row..row + 1, range.clone()])?,
                    Hdf5Part::Column(k) => source.read(&[range.clone(), k..k + 1])?,
                };
            }
            Ok(())
        }))
    }

    fn texts(&self, column: &str) -> Result<Vec<String>, CompareError> {
        let texts = resolve_in(self.file.text_names(), column);
        let array = texts.or_else(|| self.resolve(column)).unwrap_or(column);
        Ok(self.file.texts(array)?)
    }
}

enum Hdf5Part {
    Whole,
    Row(usize),
    Column(usize),
}

impl Hdf5Part {
    fn of(shape: &[usize], start: usize, stride: usize, is_row: bool) -> Hdf5Part {
        match shape {
            [_] => Hdf5Part::Whole,
            [1, _] if start == 0 => Hdf5Part::Row(0),
            [_, 1] if start == 0 => Hdf5Part::Column(0),
            &[_, columns] if is_row => Hdf5Part::Row(start / columns.max(1)),
            _ => Hdf5Part::Column(start % stride.max(1)),
        }
    }
}
