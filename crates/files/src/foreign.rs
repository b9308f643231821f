//! HDF5 files of other programs: numeric columns by path, whatever the layout.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use super::ResultError;
use super::schema::attribute;
use super::source::{DatasetInfo, FileSource, Holds, Object};

/// An HDF5 file of any origin, open for reading.
#[derive(Debug)]
pub struct ForeignFile {
    source: Arc<FileSource>,
    infos: Vec<(String, DatasetInfo)>,
    left_out: Vec<(String, String)>,
    names: Vec<String>,
    unshaped: Vec<String>,
    texts: Vec<String>,
}

/// Bytes cached for each variable. A larger compressed chunk is unpacked again for every block of rows. A dozen
/// variables stay below 200 MiB.
const CHUNK_CACHE: usize = 16 << 20;
const CODES: usize = 1 << 20;

impl ForeignFile {
    /// Opens a file and lists its text columns and its numeric variables of one or two dimensions. Variables beyond
    /// this program's limits or stored in other files are left out.
    ///
    /// # Errors
    /// The file is missing, not HDF5, truncated, damaged, locked by its writer, or without a readable variable.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let source = FileSource::open_with(path, Some(CHUNK_CACHE))?;
        let (mut infos, mut left_out, mut first) = (Vec::new(), Vec::new(), None);
        source.walk(&mut |path, member| {
            match member.is {
                Object::Dataset(info) => infos.push((path.to_owned(), info)),
                Object::Not(reason) => {
                    let error = reason.of(source.path());
                    left_out.push((path.to_owned(), format!("cannot be read ({error})")));
                    first = first.take().or(Some(error));
                }
                Object::Group(_) | Object::Other => {}
            }
            Ok(())
        })?;
        if infos.is_empty()
            && let Some(error) = first
        {
            return Err(error);
        }
        left_out.extend(infos.iter().filter_map(|(path, info)| match &info.holds {
            Holds::Other(kind) => Some((
                path.clone(),
                format!("holds values of a type that is not read ({kind})"),
            )),
            _ => None,
        }));
        infos.sort_by(|a, b| a.0.cmp(&b.0));
        let list = |fits: &dyn Fn(&DatasetInfo) -> bool| {
            let fitting = infos.iter().filter(|(_, info)| fits(info));
            fitting.map(|(path, _)| path.clone()).collect::<Vec<_>>()
        };
        Ok(ForeignFile {
            names: list(&|info| matches!(info.shape.len(), 1 | 2) && info.holds.is_number()),
            unshaped: list(&|info| !matches!(info.shape.len(), 1 | 2) && info.holds.is_number()),
            texts: list(&|info| info.shape.len() == 1 && info.holds == Holds::Texts),
            left_out,
            source: Arc::new(source),
            infos,
        })
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.source.path()
    }

    /// Paths of the numeric variables of one or two dimensions, without a leading slash.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Paths of the one-dimensional text variables, without a leading slash.
    pub fn text_names(&self) -> &[String] {
        &self.texts
    }

    /// Paths of numeric variables with no dimension or more than two.
    pub fn unshaped(&self) -> &[String] {
        &self.unshaped
    }

    /// Paths of unreadable variables, each with its reason: "holds ...", "cannot be read ...".
    pub fn left_out(&self) -> &[(String, String)] {
        &self.left_out
    }

    fn info(&self, name: &str) -> Option<&DatasetInfo> {
        let found = self.infos.binary_search_by(|(path, _)| path.as_str().cmp(name)).ok()?;
        Some(&self.infos[found].1)
    }

    /// Number of rows, or of rows and columns, of a variable.
    pub fn shape(&self, name: &str) -> Option<Vec<usize>> {
        Some(self.info(name)?.shape.clone())
    }

    /// The attribute `units` of a variable.
    pub fn units(&self, name: &str) -> Option<String> {
        self.source.text_attribute(name, attribute::UNITS).ok()?
    }

    /// A variable, to be read in parts. Fails if there is no such variable.
    pub fn column(&self, name: &str) -> Result<ForeignColumn, ResultError> {
        if self.info(name).is_none() {
            return Err(self.source.missing(format!("variable {name}")));
        }
        Ok(ForeignColumn {
            source: Arc::clone(&self.source),
            name: name.to_owned(),
        })
    }

    /// Values of a one-dimensional variable of texts or integers, as texts. Invalid UTF-8 is replaced. Fails if there
    /// is no such variable, or if it has another type.
    pub fn texts(&self, name: &str) -> Result<Vec<String>, ResultError> {
        let Some(info) = self.info(name) else {
            return Err(self.source.missing(format!("variable {name}")));
        };
        match &info.holds {
            Holds::Texts => self.source.texts(name),
            holds if holds.is_number() && info.shape.len() == 1 => {
                if info.size() > CODES {
                    return Err(self.source.refused(format!("/{name} has {} codes", info.size())));
                }
                let codes = self.source.read_rows::<i64>(name, 0..info.size())?;
                Ok(codes.iter().map(i64::to_string).collect())
            }
            _ => Err(self.source.missing(format!("texts or whole numbers in {name}"))),
        }
    }
}

/// A variable of one or two dimensions.
#[derive(Debug)]
pub struct ForeignColumn {
    source: Arc<FileSource>,
    name: String,
}

impl ForeignColumn {
    /// Reads a part of the variable: a range of each dimension, the last one fastest. Fails if it is damaged there.
    pub fn read(&self, part: &[Range<usize>]) -> Result<Vec<f64>, ResultError> {
        self.source.read(&self.name, part)
    }
}
