//! Place of a result: rules for existing files, and the lock on the partial file.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

use super::disk::{Obstacle, folder_of, has_hdf5_signature, in_the_way, misplaced, number_of, try_folder};
use super::source::FileSource;
use super::{Reason, ResultError, Status};
use super::{schema, seal};
use stickslip_system::quote::in_shell;

/// Files that a run may replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Overwrite {
    /// Only an earlier result of this program.
    #[default]
    OwnResults,
    /// Any file that is not an input.
    Force,
}

impl Overwrite {
    /// [`Overwrite::Force`] if `force`.
    pub fn by_force(force: bool) -> Overwrite {
        match force {
            true => Overwrite::Force,
            false => Overwrite::OwnResults,
        }
    }
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
    let saved = seal::write(path).and_then(|()| File::open(path)?.sync_all());
    saved.map_err(|error| ResultError::io(path, "saving the file", error))
}

pub(super) fn rename(made: &Path, path: &Path, overwrite: Overwrite) -> Result<(), ResultError> {
    check_replaceable(path, overwrite)?;
    fs::rename(made, path).map_err(|error| ResultError::io(path, "giving the finished file its name", error))?;
    // The folder's entry is flushed, too. Not every system can do this, and the file itself is safe already.
    let _ = File::open(folder_of(path)).and_then(|folder| folder.sync_all());
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
/// program, named like another format, has too long a name, or is in a folder without permission.
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
        return Err(other_format(path, &extension.to_ascii_lowercase()).of(path));
    }
    // The lock has the longest name of the three files.
    if fs::symlink_metadata(lock_path(files[1])).is_err_and(|error| error.kind() == ErrorKind::InvalidFilename) {
        return Err(Reason::NameTooLong.of(path));
    }
    files.iter().try_for_each(|file| check_replaceable(file, overwrite))?;
    // Asked here, so that the error has the name of the file and not that of one beside it.
    match try_folder(&folder_of(path)) {
        Err(error)
            if matches!(
                error.kind(),
                ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem
            ) =>
        {
            Err(ResultError::not_created(path, error))
        }
        _ => Ok(()),
    }
}

/// The reason against a name like that of another format, with the command that writes the format.
fn other_format(path: &Path, extension: &str) -> Reason {
    let instead = path.with_extension("h5").display().to_string();
    let (result, name) = (in_shell(&instead), in_shell(&path.display().to_string()));
    let further = match extension {
        "csv" | "npz" | "mat" => format!("`stickslip export {result} -o {name}` writes this table"),
        _ => format!("`stickslip export {result}` writes tables of it, `stickslip plot {result}` draws it"),
    };
    Reason::OtherFormat { instead, further }
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

/// Number of beginnings and ends of flushes of the file at `path`; odd during a flush. `None` if nobody writes it.
pub(super) fn flushes(path: &Path) -> Option<u64> {
    let mut lock = open_plain(&lock_path(path), OpenOptions::new().read(true)).ok()?;
    match lock.try_lock_shared() {
        Err(TryLockError::WouldBlock) => {
            let mut bytes = [0; 8];
            Some(lock.read_exact(&mut bytes).map_or(0, |()| u64::from_le_bytes(bytes)))
        }
        _ => None,
    }
}

/// Opens a plain file. Links are not followed, and a pipe, whose other end may never open, does not block.
fn open_plain(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    let refused = || io::Error::new(ErrorKind::InvalidInput, "it is not a plain file");
    // Checked first, because opening acts on some devices.
    if fs::symlink_metadata(path).is_ok_and(|found| !found.is_file()) {
        return Err(refused());
    }
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        use std::os::unix::fs::OpenOptionsExt;
        options.custom_flags((OFlags::NOFOLLOW | OFlags::NONBLOCK).bits().cast_signed());
    }
    let file = options.open(path)?;
    if file.metadata()?.is_file() {
        Ok(file)
    } else {
        Err(refused())
    }
}

pub(super) fn lock_path(path: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".lock");
    path.with_file_name(name)
}

/// The exclusive right to write one partial file, held until it is dropped.
///
/// The lock is on a hidden file next to the partial file: HDF5 readers lock the file that they open, and would be
/// refused. The operating system releases the lock of a killed run, and the next run takes over its lock file.
#[derive(Debug)]
pub(super) struct WriteLock {
    path: PathBuf,
    file: File,
    count: u64,
}

impl WriteLock {
    pub(super) fn take(partial: &Path) -> Result<Self, ResultError> {
        let path = lock_path(partial);
        // A link, a pipe or a folder is not this program's. The target of a link is neither created nor locked.
        if fs::symlink_metadata(&path).is_ok_and(|found| !found.is_file()) {
            return Err(Reason::Foreign.of(&path));
        }
        // A reader that checks for a writer holds the lock for a moment.
        let mut patience = 5;
        loop {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).truncate(false);
            let file = open_plain(&path, &mut options).map_err(|error| ResultError::not_created(partial, error))?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) if patience > 0 => {
                    patience -= 1;
                    std::thread::sleep(std::time::Duration::from_millis(5));
                    continue;
                }
                Err(TryLockError::WouldBlock) => {
                    return Err(Reason::AnotherRun.of(partial));
                }
                // Some network file systems have no locks. Two runs that write one file go unnoticed there.
                Err(TryLockError::Error(error)) => log::debug!("{}: no lock: {error}", path.display()),
            }
            // The previous run may have removed the file before it was locked here.
            if is_at(&file, &path) {
                let mut lock = WriteLock { path, file, count: 0 };
                // The count of a killed run is reset. A full disk fails here.
                let zero = lock.file.set_len(0).and_then(|()| lock.write_count());
                return match zero {
                    Ok(()) => Ok(lock),
                    Err(error) => Err(ResultError::not_created(partial, error)),
                };
            }
        }
    }

    /// Counts the beginning or the end of a flush, during which the file is inconsistent ([`flushes`]).
    pub(super) fn count_flush(&mut self) {
        self.count += 1;
        // On a full disk readers are not warned.
        let _ = self.write_count();
    }

    fn write_count(&mut self) -> io::Result<()> {
        use std::io::{Seek, Write};
        self.file.rewind()?;
        self.file.write_all(&self.count.to_le_bytes())
    }

    pub(super) fn sibling(&self) -> PathBuf {
        self.path.with_extension("new")
    }
}

impl Drop for WriteLock {
    fn drop(&mut self) {
        // Under the lock, so that no other writer's file is removed. The sibling exists only after a failed write.
        let _ = fs::remove_file(self.sibling());
        let _ = fs::remove_file(&self.path);
    }
}

fn is_at(file: &File, path: &Path) -> bool {
    let numbers = [file.metadata(), fs::metadata(path)].map(|found| found.ok().and_then(|found| number_of(&found)));
    match numbers {
        [Some(a), Some(b)] => a == b,
        // Without file numbers the paths are assumed to agree. With them, the file has just been removed.
        _ => cfg!(not(unix)) && path.exists(),
    }
}
