//! The lock on a partial file: who writes it, and when it is being flushed.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::disk::number_of;
use super::{Reason, ResultError};

/// How often a flush of the file at `path` has begun or ended: an odd number during one. `None` if nobody writes it.
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

/// Opens the plain file at `path`: no link is followed, and a pipe, whose other end nobody may ever open, is not waited for.
fn open_plain(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    let refused = || io::Error::new(io::ErrorKind::InvalidInput, "it is not a plain file");
    // Asked first where it is there, as opening some devices is an act.
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

/// Of the file at `path`: `.paper.partial.h5.lock`.
fn lock_path(path: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".lock");
    path.with_file_name(name)
}

/// The right to write one partial file, held until it is dropped.
///
/// The lock is on a hidden file next to it (`.paper.partial.h5.lock`) and not on the partial file:
/// HDF5 readers take a lock on what they open, and would be refused. The operating system drops
/// the lock of a run that is killed; the lock file it leaves is taken over by the next run.
#[derive(Debug)]
pub(super) struct WriteLock {
    path: PathBuf,
    file: File,
    /// Of beginnings and ends of flushes.
    count: u64,
}

impl WriteLock {
    /// Takes the lock, without waiting.
    pub(super) fn take(partial: &Path) -> Result<Self, ResultError> {
        let path = lock_path(partial);
        // A link there, a pipe or a folder was not made by this program: what a link leads to is neither created nor locked.
        if fs::symlink_metadata(&path).is_ok_and(|found| !found.is_file()) {
            return Err(Reason::Foreign.of(&path));
        }
        // Whoever asks whether the file is being written holds the lock for a moment.
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
                // Some network file systems have no locks: there, two runs into one file go unnoticed.
                Err(TryLockError::Error(error)) => log::debug!("{}: no lock: {error}", path.display()),
            }
            // Between opening and locking, the run before may have removed the file: then this lock
            // is on nothing.
            if is_at(&file, &path) {
                let mut lock = WriteLock { path, file, count: 0 };
                // A count of an earlier run, which was killed, is not ours. A full disk has no room for one.
                let zero = lock.file.set_len(0).and_then(|()| lock.write_count());
                return match zero {
                    Ok(()) => Ok(lock),
                    Err(error) => Err(ResultError::not_created(partial, error)),
                };
            }
        }
    }
}

impl WriteLock {
    /// Says that a flush begins, or ends: until then what is in the file does not fit together ([`flushes`]).
    pub(super) fn count_flush(&mut self) {
        self.count += 1;
        // On a full disk readers are left to try their luck.
        let _ = self.write_count();
    }

    fn write_count(&mut self) -> io::Result<()> {
        use std::io::{Seek, Write};
        self.file.rewind()?;
        self.file.write_all(&self.count.to_le_bytes())
    }

    /// A hidden name in the same folder that belongs to whoever holds the lock.
    pub(super) fn sibling(&self) -> PathBuf {
        self.path.with_extension("new")
    }
}

impl Drop for WriteLock {
    fn drop(&mut self) {
        // Removed while the lock is held, so that nobody else's file is removed; the sibling is there only where what was
        // to be written failed half-way.
        let _ = fs::remove_file(self.sibling());
        let _ = fs::remove_file(&self.path);
    }
}

/// Whether the open file is (still) the one at `path`.
fn is_at(file: &File, path: &Path) -> bool {
    let numbers = [file.metadata(), fs::metadata(path)].map(|found| found.ok().and_then(|found| number_of(&found)));
    match numbers {
        [Some(a), Some(b)] => a == b,
        // Without numbers of files; where there are some, the file at the path has just gone.
        _ => cfg!(not(unix)) && path.exists(),
    }
}
