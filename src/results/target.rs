//! Where a result goes: the policy for a file that is already there, and the lock on the partial file.

use std::fs;
use std::path::{Path, PathBuf};

use super::disk::{Obstacle, folder_of, has_hdf5_signature, in_the_way, misplaced};
use super::lock::WriteLock;
use super::source::Source;
use super::{Reason, ResultError, Status};
use super::{schema, seal};

/// What a run may replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overwrite {
    /// Only an earlier result of this program.
    #[default]
    OwnResults,
    /// Any file that is not an input.
    Force,
}

/// The right to write one result, held until it is dropped. A command that computes for long takes it first: what would keep
/// the result from being written is then known before anything is computed.
#[derive(Debug)]
pub struct Reservation {
    pub(super) path: PathBuf,
    pub(super) partial: PathBuf,
    pub(super) overwrite: Overwrite,
    pub(super) lock: WriteLock,
}

impl Reservation {
    /// Reserves `path` and its partial file.
    ///
    /// # Errors
    /// Those of [`check_target`]; another run that writes the same file; a folder or a disk that takes no file.
    pub fn take(path: &Path, overwrite: Overwrite, inputs: &[PathBuf]) -> Result<Self, ResultError> {
        check_target(path, overwrite, inputs)?;
        let partial = partial_path(path);
        let lock = WriteLock::take(&partial)?;
        // Half a file of an earlier writer that failed.
        let _ = fs::remove_file(lock.sibling());
        Ok(Reservation {
            path: path.to_owned(),
            partial,
            overwrite,
            lock,
        })
    }

    /// Stores a file that is written whole: under its name if what it holds is complete, else as the partial file. It is made
    /// under a name of the lock's, so that half of it is never seen. Returns where it is.
    ///
    /// # Errors
    /// Any failure to write; an earlier file is then as it was.
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

/// Seals a file that is whole and closed, and has the system write it to the disk.
pub(super) fn save(path: &Path) -> Result<(), ResultError> {
    let saved = seal::write(path).and_then(|()| fs::File::open(path)?.sync_all());
    saved.map_err(|error| ResultError::io(path, "saving the file", error))
}

/// Gives a file that is saved its own name.
pub(super) fn rename(made: &Path, path: &Path, overwrite: Overwrite) -> Result<(), ResultError> {
    check_replaceable(path, overwrite)?;
    fs::rename(made, path).map_err(|error| ResultError::io(path, "giving the finished file its name", error))?;
    // The folder's entry too; not every system can, and the file itself is safe by now.
    let _ = fs::File::open(folder_of(path)).and_then(|folder| folder.sync_all());
    Ok(())
}

/// `paper.h5` is written as `paper.partial.h5`, next to it.
pub fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(".partial.");
    name.push(path.extension().unwrap_or("h5".as_ref()));
    path.with_file_name(name)
}

/// Whether a run may write its result to `path`: to be asked before anything is computed.
///
/// # Errors
///
/// `path` or its partial file is one of the `inputs`, a folder, in a folder that is missing, or a
/// file that `overwrite` does not let the run replace; or another program holds a lock on it.
pub fn check_target(path: &Path, overwrite: Overwrite, inputs: &[PathBuf]) -> Result<(), ResultError> {
    if path.to_str().is_none() {
        return Err(Reason::NotUtf8.of(path));
    }
    for file in [path, &partial_path(path)] {
        if let Some(obstacle) = misplaced(file, inputs) {
            return Err(refusal(obstacle, file));
        }
        check_replaceable(file, overwrite)?;
    }
    Ok(())
}

/// Whether an existing file at `path`, if there is one, may be replaced.
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

/// Whether `path` holds a result of this program. A partial file that a kill in mid-flush left
/// unreadable still counts, by its name and HDF5's signature.
fn is_own_result(path: &Path) -> Result<bool, ResultError> {
    let begins = has_hdf5_signature(path).map_err(|error| ResultError::io(path, "reading the file", error));
    if !begins? {
        return Ok(false);
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    match Source::open(path).and_then(|source| source.text_attribute("", schema::root::FORMAT)) {
        Ok(format) => Ok(format.is_some_and(|format| schema::FORMATS.contains(&format.as_str()))),
        Err(error) if matches!(error.reason, Reason::InUse | Reason::NoReader(_)) => Err(error),
        Err(_) => Ok(stem.ends_with(".partial")),
    }
}
