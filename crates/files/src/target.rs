//! Place of a result: rules for existing files, and the lock on the partial file.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::disk::{Obstacle, folder_of, has_hdf5_signature, in_the_way, misplaced};
use super::lock::{WriteLock, lock_path};
use super::source::FileSource;
use super::{Reason, ResultError, Status};
use super::{schema, seal};

/// Files that a run may replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overwrite {
    /// Only an earlier result of this program.
    #[default]
    OwnResults,
    /// Any file that is not an input.
    Force,
}

/// The exclusive right to write one result, held until it is dropped. A long computation takes it first, so that an
/// obstacle to writing is known early.
#[derive(Debug)]
pub struct Reservation {
    pub(super) path: PathBuf,
    pub(super) partial: PathBuf,
    pub(super) overwrite: Overwrite,
    pub(super) lock: WriteLock,
}

impl Reservation {
    /// Reserves `path` and its partial file for one writer.
    ///
    /// # Errors
    /// Errors of [`check_target`]; another run that writes the same file; a folder or a disk that accepts no file.
    pub fn take(path: &Path, overwrite: Overwrite, inputs: &[PathBuf]) -> Result<Self, ResultError> {
        check_target(path, overwrite, inputs)?;
        let partial = partial_path(path);
        let lock = WriteLock::take(&partial)?;
        // A failed writer may have left this file.
        let _ = fs::remove_file(lock.sibling());
        Ok(Reservation {
            path: path.to_owned(),
            partial,
            overwrite,
            lock,
        })
    }

    /// Writes a whole file and returns its path: its own name if `status` is complete, otherwise the partial file.
    /// The file is made under the lock's name, so that half a file is never seen. After a failure an earlier file
    /// remains.
    pub(super) fn put(
        &self,
        status: &Status,
        store: impl FnOnce(&Path) -> hdf5::Result<()>,
    ) -> Result<PathBuf, ResultError> {
        let made = self.lock.sibling();
        let target = match status {
            Status::Complete => &self.path,
            _ => &self.partial,
        };
        check_replaceable(target, self.overwrite)?;
        let written = store(&made)
            .map_err(|error| ResultError::write(target, false, &error))
            .and_then(|()| save(&made))
            .and_then(|()| rename(&made, target, self.overwrite));
        if written.is_err() {
            let _ = fs::remove_file(&made);
        }
        written.map(|()| target.to_owned())
    }
}

pub(super) fn save(path: &Path) -> Result<(), ResultError> {
    let saved = seal::write(path).and_then(|()| fs::File::open(path)?.sync_all());
    saved.map_err(|error| ResultError::io(path, "saving the file", error))
}

pub(super) fn rename(made: &Path, path: &Path, overwrite: Overwrite) -> Result<(), ResultError> {
    check_replaceable(path, overwrite)?;
    fs::rename(made, path).map_err(|error| ResultError::io(path, "giving the finished file its name", error))?;
    // The folder's entry is flushed, too. Not every system can do this, and the file itself is safe already.
    let _ = fs::File::open(folder_of(path)).and_then(|folder| folder.sync_all());
    Ok(())
}

/// Path of the partial file, in the same folder: `paper.partial.h5` for `paper.h5`.
pub fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(".partial.");
    name.push(path.extension().unwrap_or("h5".as_ref()));
    path.with_file_name(name)
}

/// Extensions of other file formats, which no result may have.
const OTHER_FORMATS: [&str; 24] = [
    "csv", "tsv", "txt", "dat", "json", "toml", "npz", "npy", "mat", "m", "py", "parquet", "feather", "arrow", "xlsx",
    "xls", "ods", "html", "md", "svg", "png", "pdf", "zip", "gz",
];

/// Checks, before a computation, whether a run may write its result to `path`.
///
/// # Errors
/// `path` or its partial file is an input, a folder, in a missing folder, protected by `overwrite`, locked by another
/// program, named like another format, or has too long a name.
pub fn check_target(path: &Path, overwrite: Overwrite, inputs: &[PathBuf]) -> Result<(), ResultError> {
    if path.to_str().is_none() {
        return Err(Reason::NotUtf8.of(path));
    }
    let partial = partial_path(path);
    let files = [path, &partial];
    if let Some((obstacle, file)) = files.iter().find_map(|file| Some((misplaced(file, inputs)?, file))) {
        return Err(refusal(obstacle, file));
    }
    let extension = path
        .extension()
        .and_then(|extension| extension.to_str())
        .unwrap_or_default();
    if OTHER_FORMATS.iter().any(|other| extension.eq_ignore_ascii_case(other)) {
        return Err(Reason::OtherFormat(path.with_extension("h5")).of(path));
    }
    // The lock has the longest name of the three files.
    if fs::symlink_metadata(lock_path(files[1])).is_err_and(|error| error.kind() == ErrorKind::InvalidFilename) {
        return Err(Reason::NameTooLong.of(path));
    }
    files.iter().try_for_each(|file| check_replaceable(file, overwrite))
}

pub(super) fn check_replaceable(path: &Path, overwrite: Overwrite) -> Result<(), ResultError> {
    let obstacle = in_the_way(path, overwrite == Overwrite::Force, is_own_result)?;
    obstacle.map_or(Ok(()), |obstacle| Err(refusal(obstacle, path)))
}

fn refusal(obstacle: Obstacle, path: &Path) -> ResultError {
    let reason = match obstacle {
        Obstacle::Folder => Reason::IsFolder(path.join("result.h5")),
        Obstacle::NoFileName => Reason::NoFileName,
        Obstacle::NoFolder(folder) => Reason::NoFolder(folder),
        Obstacle::Input => Reason::IsInput,
        Obstacle::PipeOrDevice => Reason::PipeOrDevice,
        Obstacle::Protected => Reason::Protected,
        Obstacle::NotOwn => Reason::Foreign,
        Obstacle::NotSeen(error) => return ResultError::io(path, "looking at the file", error),
    };
    reason.of(path)
}

/// Whether `path` holds a result of this program. A partial file that a kill during a flush left unreadable is
/// recognised by its name and HDF5's signature.
fn is_own_result(path: &Path) -> Result<bool, ResultError> {
    let begins = has_hdf5_signature(path).map_err(|error| ResultError::io(path, "reading the file", error));
    if !begins? {
        return Ok(false);
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    match FileSource::open(path).and_then(|source| source.text_attribute("", schema::root::FORMAT)) {
        Ok(format) => Ok(schema::own_format(format.as_deref()).is_some()),
        Err(error) if matches!(error.reason, Reason::InUse | Reason::NoReader(_)) => Err(error),
        Err(_) => Ok(stem.ends_with(".partial")),
    }
}
