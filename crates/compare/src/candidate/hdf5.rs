//! Columns of HDF5 files: result files, and files of other programs.

use super::super::CompareError;
use super::table::{ArrayReader, ArrayValues, BLOCK, CandidateColumn, CandidateTable, LeftOut, Pass, TableArray};
use stickslip_files::{ForeignFile, ResultFile};

#[derive(Debug)]
struct OwnReader {
    file: ResultFile,
}

/// Columns of /trajectory of a result file.
pub(super) fn own_table(file: ResultFile, columns: &[String]) -> CandidateTable {
    let array = |name: &String| TableArray::of_rows(name, ArrayValues::Numbers);
    CandidateTable {
        path: file.path().to_owned(),
        arrays: columns.iter().map(array).collect(),
        left_out: Vec::new(),
        by_path: false,
        reader: Box::new(OwnReader { file }),
    }
}

impl ArrayReader for OwnReader {
    fn pass(&self, of: Vec<CandidateColumn>) -> Result<Pass<'_>, CompareError> {
        let (rows, mut row) = (self.file.sample_count()?, 0);
        Ok(Box::new(move |columns| {
            let range = row..rows.min(row + BLOCK);
            row = range.end;
            for (of, column) in of.iter().zip(columns) {
                *column = self.file.column(&of.name, range.clone())?;
            }
            Ok(())
        }))
    }
}

/// Each variable with its path and shape.
#[derive(Debug)]
struct ForeignReader {
    file: ForeignFile,
    variables: Vec<(String, Vec<usize>)>,
}

/// The arrays of another program's file.
pub(super) fn foreign_table(file: ForeignFile) -> CandidateTable {
    let left_out = file.left_out().iter().map(|(path, why)| LeftOut {
        name: path.clone(),
        why: why.clone(),
        remedy: "write it as an array of floats".to_owned(),
    });
    let numbers = file.names().iter().chain(file.unshaped());
    let numbers = numbers.map(|name| (name, ArrayValues::Numbers));
    let all = numbers.chain(file.text_names().iter().map(|name| (name, ArrayValues::Texts)));
    let array = |(name, values): (&String, ArrayValues)| TableArray {
        shape: Some(file.shape(name).unwrap_or_default()),
        ..TableArray::of_rows(name, values)
    };
    let arrays: Vec<TableArray> = all.map(array).collect();
    let variable = |array: &TableArray| (array.name.clone(), array.shape.clone().unwrap_or_default());
    CandidateTable {
        path: file.path().to_owned(),
        left_out: left_out.collect(),
        by_path: true,
        reader: Box::new(ForeignReader {
            variables: arrays.iter().map(variable).collect(),
            file,
        }),
        arrays,
    }
}

impl ArrayReader for ForeignReader {
    fn pass(&self, of: Vec<CandidateColumn>) -> Result<Pass<'_>, CompareError> {
        let sources = of.iter().map(|of| Ok(self.file.column(&self.variables[of.array].0)?));
        let sources = sources.collect::<Result<Vec<_>, CompareError>>()?;
        let (rows, mut row) = (of.first().map_or(0, |of| of.elements.2), 0);
        Ok(Box::new(move |columns| {
            let range = row..rows.min(row + BLOCK);
            row = range.end;
            for ((of, source), column) in of.iter().zip(&sources).zip(columns) {
                let (start, stride, _) = of.elements;
                let part = match self.variables[of.array].1[..] {
                    [_] => vec![range.clone()],
                    [1, _] if start == 0 => vec![0..1, range.clone()],
                    [_, 1] if start == 0 => vec![range.clone(), 0..1],
                    [_, columns] if stride == 1 => {
                        let k = start / columns.max(1);
                        vec![k..k + 1, range.clone()]
                    }
                    _ => vec![range.clone(), start % stride.max(1)..start % stride.max(1) + 1],
                };
                *column = if range.is_empty() {
                    Vec::new()
                } else {
                    source.read(&part)?
                };
            }
            Ok(())
        }))
    }

    fn unit(&self, array: usize) -> Option<String> {
        self.file.units(&self.variables[array].0)
    }

    fn texts(&self, array: usize) -> Result<Option<Vec<String>>, CompareError> {
        Ok(Some(self.file.texts(&self.variables[array].0)?))
    }
}
