//! Lock of a partial file: who writes it, and when it is flushed.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::disk::number_of;
use super::{Reason, ResultError};

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
    let refused = || io::Error::new(io::ErrorKind::InvalidInput, "it is not a plain file");
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
}

impl WriteLock {
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
