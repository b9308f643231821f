//! HDF5 files of other programs: any layout, columns of numbers by their path.

use super::attributes::text_attribute;
use super::contents::is_number;
use super::schema::attribute;
use super::{ResultError, target};
use hdf5::types::{FixedAscii, FixedUnicode, TypeDescriptor, VarLenAscii, VarLenUnicode};
use hdf5::{Dataset, Group};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// An HDF5 file of any origin, open for reading.
#[derive(Debug)]
pub struct ForeignFile {
    path: PathBuf,
    file: hdf5::File,
    names: Vec<String>,
    texts: Vec<String>,
}

/// Bytes kept of each variable: a compressed chunk beyond that is unpacked again for every block of rows. A dozen
/// variables stay below 200 MiB.
const CHUNK_CACHE: usize = 16 << 20;
/// HDF5's own choice.
const CHUNK_SLOTS: usize = 521;
/// Groups within groups that are looked into.
const DEPTH: usize = 16;

impl ForeignFile {
    /// Opens a file and lists its numeric variables of one or two dimensions, and its columns of texts.
    ///
    /// # Errors
    /// No such file, not HDF5, truncated, damaged, or locked by a program that writes it.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let path = path.to_owned();
        if !path.exists() {
            return Err(ResultError::NotFound { path });
        }
        if !target::has_hdf5_signature(&path)? {
            return Err(ResultError::NotHdf5 { path });
        }
        let file = hdf5::File::with_options()
            .with_fapl(|access| access.chunk_cache(CHUNK_SLOTS, CHUNK_CACHE, 1.0))
            .open(&path)
            .map_err(|error| ResultError::read(&path, &error))?;
        let mut listed = Vec::new();
        list(&file, "", DEPTH, &mut listed).map_err(|error| ResultError::read(&path, &error))?;
        listed.sort();
        let (numbers, texts): (Vec<_>, Vec<_>) = listed.into_iter().partition(|(_, holds)| *holds == Holds::Numbers);
        let names = |list: Vec<(String, Holds)>| list.into_iter().map(|(name, _)| name).collect();
        Ok(ForeignFile {
            path,
            file,
            names: names(numbers),
            texts: names(texts),
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Paths of the numeric variables of one or two dimensions, without a leading slash.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Paths of the variables of texts, of one dimension, without a leading slash.
    pub fn text_names(&self) -> &[String] {
        &self.texts
    }

    /// Number of rows, or of rows and columns; `None` if there is no such variable.
    pub fn shape(&self, name: &str) -> Option<Vec<usize>> {
        Some(self.file.dataset(name).ok()?.shape())
    }

    /// The attribute `units` of a variable.
    pub fn units(&self, name: &str) -> Option<String> {
        text_attribute(&*self.file.dataset(name).ok()?, attribute::UNITS)
    }

    /// A column of a variable, to be read in pieces.
    ///
    /// # Errors
    /// If there is no such variable.
    pub fn column(&self, name: &str) -> Result<ForeignColumn, ResultError> {
        let dataset = self.file.dataset(name).map_err(|_| ResultError::Missing {
            path: self.path.clone(),
            what: format!("variable {name}"),
        })?;
        Ok(ForeignColumn {
            path: self.path.clone(),
            dataset,
        })
    }

    /// A one-dimensional variable of texts or whole numbers, as texts.
    ///
    /// # Errors
    /// If there is no such variable, or it is of another type.
    pub fn texts(&self, name: &str) -> Result<Vec<String>, ResultError> {
        let dataset = self.column(name)?.dataset;
        let failed = |error: hdf5::Error| ResultError::read(&self.path, &error);
        let descriptor = dataset.dtype().and_then(|kind| kind.to_descriptor()).map_err(failed)?;
        match descriptor {
            TypeDescriptor::VarLenUnicode => {
                let texts = dataset.read_raw::<VarLenUnicode>().map_err(failed)?;
                Ok(texts.iter().map(|text| text.as_str().to_owned()).collect())
            }
            TypeDescriptor::VarLenAscii => {
                let texts = dataset.read_raw::<VarLenAscii>().map_err(failed)?;
                Ok(texts.iter().map(|text| text.as_str().to_owned()).collect())
            }
            TypeDescriptor::FixedAscii(n) if n <= 32 => {
                let texts = dataset.read_raw::<FixedAscii<32>>().map_err(failed)?;
                Ok(texts.iter().map(|text| text.as_str().to_owned()).collect())
            }
            TypeDescriptor::FixedUnicode(n) if n <= 32 => {
                let texts = dataset.read_raw::<FixedUnicode<32>>().map_err(failed)?;
                Ok(texts.iter().map(|text| text.as_str().to_owned()).collect())
            }
            ref kind if is_number(kind) => {
                let codes = dataset.read_raw::<i64>().map_err(failed)?;
                Ok(codes.iter().map(i64::to_string).collect())
            }
            _ => Err(ResultError::Missing {
                path: self.path.clone(),
                what: format!("texts or whole numbers in {name}"),
            }),
        }
    }
}

fn is_text(kind: &TypeDescriptor) -> bool {
    use TypeDescriptor::{FixedAscii, FixedUnicode, VarLenAscii, VarLenUnicode};
    matches!(kind, VarLenUnicode | VarLenAscii | FixedAscii(_) | FixedUnicode(_))
}

/// A variable of one or two dimensions.
#[derive(Debug)]
pub struct ForeignColumn {
    path: PathBuf,
    dataset: Dataset,
}

impl ForeignColumn {
    /// Elements `range` of a variable of one dimension.
    ///
    /// # Errors
    /// If the file is damaged there.
    pub fn read(&self, range: Range<usize>) -> Result<Vec<f64>, ResultError> {
        self.slice(range)
    }

    /// Elements `range` of row `row` of a variable of two dimensions.
    ///
    /// # Errors
    /// If the file is damaged there.
    pub fn read_row(&self, row: usize, range: Range<usize>) -> Result<Vec<f64>, ResultError> {
        self.slice((row, range))
    }

    /// Elements `range` of column `column` of a variable of two dimensions.
    ///
    /// # Errors
    /// If the file is damaged there.
    pub fn read_column(&self, column: usize, range: Range<usize>) -> Result<Vec<f64>, ResultError> {
        self.slice((range, column))
    }

    fn slice(&self, part: impl Into<hdf5::Hyperslab>) -> Result<Vec<f64>, ResultError> {
        let part: hdf5::Hyperslab = part.into();
        let values = self
            .dataset
            .read_slice_1d::<f64, _>(part)
            .map_err(|error| ResultError::read(&self.path, &error))?;
        Ok(values.into_raw_vec_and_offset().0)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Holds {
    Numbers,
    Texts,
}

fn list(group: &Group, prefix: &str, depth: usize, names: &mut Vec<(String, Holds)>) -> Result<(), hdf5::Error> {
    for name in group.member_names()? {
        let path = format!("{prefix}{name}");
        if let Ok(dataset) = group.dataset(&name) {
            let Ok(kind) = dataset.dtype().and_then(|kind| kind.to_descriptor()) else {
                continue;
            };
            match (dataset.ndim(), is_number(&kind)) {
                (1 | 2, true) => names.push((path, Holds::Numbers)),
                (1, false) if is_text(&kind) => names.push((path, Holds::Texts)),
                _ => {}
            }
        } else if depth > 0
            && let Ok(child) = group.group(&name)
        {
            list(&child, &format!("{path}/"), depth - 1, names)?;
        }
    }
    Ok(())
}
