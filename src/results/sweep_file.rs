//! Reads the file of a sweep.

use std::path::{Path, PathBuf};

use super::attributes::text_attribute;
use super::schema;
use super::sweep_writer::{DIGEST, FAILURES, POINT};
use super::{ResultError, raw, target};

/// A sweep file, open for reading.
#[derive(Debug)]
pub struct SweepFile {
    path: PathBuf,
    pub(super) file: hdf5::File,
}

/// Opens an HDF5 file of this or an earlier version of the program, whatever its format.
pub(super) fn open_checked(path: &Path) -> Result<SweepFile, ResultError> {
    if !path.exists() {
        return Err(ResultError::NotFound { path: path.to_owned() });
    }
    if path.is_dir() {
        return Err(ResultError::FolderIsNoResult { path: path.to_owned() });
    }
    if !target::has_hdf5_signature(path)? {
        return Err(ResultError::NotHdf5 { path: path.to_owned() });
    }
    let file = hdf5::File::with_options()
        .with_fapl(|access| access.file_locking(false))
        .open(path)
        .map_err(|error| ResultError::read(path, &error))?;
    let version = file
        .attr(schema::root::FORMAT_VERSION)
        .and_then(|attribute| attribute.read_scalar::<i64>());
    match version {
        Ok(found) if found > i64::from(schema::FORMAT_VERSION) => Err(ResultError::Newer {
            path: path.to_owned(),
            found,
            known: i64::from(schema::FORMAT_VERSION),
        }),
        _ => Ok(SweepFile {
            path: path.to_owned(),
            file,
        }),
    }
}

impl SweepFile {
    /// Opens the file of a sweep.
    ///
    /// # Errors
    /// A file that is not there, is no sweep file, is damaged, or is of a newer version of the program.
    pub fn open(path: &Path) -> Result<Self, ResultError> {
        let file = open_checked(path)?;
        match file.text(schema::root::FORMAT).as_deref() {
            Some(schema::SWEEP_FORMAT) => Ok(file),
            Some(schema::SWEEP_SHARD_FORMAT) => Err(ResultError::OnlyAShard { path: path.to_owned() }),
            _ => Err(ResultError::NotASweep { path: path.to_owned() }),
        }
    }

    /// Whether the file at `path` is one of a sweep.
    pub fn is_one(path: &Path) -> bool {
        SweepFile::open(path).is_ok()
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A text attribute of the file, such as `title`, `status` or `study_digest`, or of a group, as in
    /// `boundary/criterion`.
    pub fn text(&self, name: &str) -> Option<String> {
        match name.rsplit_once('/') {
            Some((group, name)) => text_attribute(&*self.file.group(group).ok()?, name),
            None => text_attribute(&self.file, name),
        }
    }

    /// The digest of its study.
    pub fn digest(&self) -> Option<String> {
        self.text(DIGEST)
    }

    /// A text attribute of a variable.
    pub fn attribute(&self, variable: &str, name: &str) -> Option<String> {
        text_attribute(&*self.file.dataset(variable).ok()?, name)
    }

    /// The names of the variables in a group, `/` for the points themselves; none if there is no such group.
    pub fn variables(&self, group: &str) -> Vec<String> {
        let group = self.file.group(group);
        group.and_then(|group| group.member_names()).map_or_else(
            |_| Vec::new(),
            |names| {
                names
                    .into_iter()
                    .filter(|name| self.file.group(name).is_err())
                    .collect()
            },
        )
    }

    /// The dimensions of a variable.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn shape(&self, variable: &str) -> Result<Vec<usize>, ResultError> {
        self.file
            .dataset(variable)
            .map(|dataset| dataset.shape())
            .map_err(|_| self.missing(variable))
    }

    /// A whole variable as numbers, the last dimension fastest; whole numbers are converted.
    ///
    /// # Errors
    /// If there is none of that name, or it cannot be read.
    pub fn numbers(&self, variable: &str) -> Result<Vec<f64>, ResultError> {
        let dataset = self.file.dataset(variable).map_err(|_| self.missing(variable))?;
        dataset
            .read_raw::<f64>()
            .map_err(|error| ResultError::read(&self.path, &error))
    }

    /// The points that failed, each with its message.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn failures(&self) -> Result<Vec<(u64, String)>, ResultError> {
        let group = FAILURES.0;
        if self.file.group(group).is_err() {
            return Ok(Vec::new());
        }
        let numbers = self.numbers(&format!("{group}/{POINT}"))?;
        let name = format!("{group}/message");
        let dataset = self.file.dataset(&name).map_err(|_| self.missing(&name))?;
        let texts = raw::read_texts(&dataset).map_err(|error| ResultError::read(&self.path, &error))?;
        Ok(numbers.into_iter().map(|number| number as u64).zip(texts).collect())
    }

    pub(super) fn missing(&self, what: &str) -> ResultError {
        ResultError::Missing {
            path: self.path.clone(),
            what: format!("variable {what}"),
        }
    }
}
