//! Files on the disk: their folders and signatures, whether two names are one file, files that appear in whole, and the lock on
//! a partial file.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::ResultError;

/// The folder that holds `path`, "." where it names none.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Writes `parts` one after the other under a temporary name beside `path`, which becomes `path` when all is written: a
/// file is there in whole or not at all.
///
/// # Errors
/// Of the operating system; nothing is left of the file then.
#[cfg(feature = "plot")]
pub(crate) fn write_whole(path: &Path, parts: &[&[u8]]) -> io::Result<()> {
    temporary_in(&folder_of(path), parts)?.persist(path)?;
    Ok(())
}

/// Whether [`write_whole`] can make a file in this folder, by one that is removed again: permissions say too little of network
/// drives, and nothing of a full disk.
///
/// # Errors
/// Of the operating system.
#[cfg(feature = "plot")]
pub(crate) fn try_folder(folder: &Path) -> io::Result<()> {
    temporary_in(folder, &[b"stickslip"]).map(drop)
}

#[cfg(feature = "plot")]
fn temporary_in(folder: &Path, parts: &[&[u8]]) -> io::Result<tempfile::NamedTempFile> {
    use std::io::Write;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".stickslip-");
    // As for any file that a program makes, and not for its owner alone; the umask takes from it.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder)?;
    for part in parts {
        file.write_all(part)?;
    }
    Ok(file)
}

/// Whether a file begins as HDF5 does. (One named so without a signature is a damaged one, not a case.)
pub(crate) fn is_hdf5(path: &Path) -> bool {
    let mut head = [0u8; 8];
    File::open(path).and_then(|mut file| file.read_exact(&mut head)).is_ok() && head == *b"\x89HDF\r\n\x1a\n"
}

/// Whether the file starts as HDF5 files do (after a user block of 0, 512, 1024, ... bytes).
pub(super) fn has_hdf5_signature(path: &Path) -> Result<bool, ResultError> {
    use std::io::{Seek, SeekFrom};
    let failed = |error| ResultError::io(path, "reading the file", error);
    let mut file = File::open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    let mut offset = 0;
    while offset + 8 <= length {
        let mut start = [0; 8];
        file.seek(SeekFrom::Start(offset))
            .and_then(|_| file.read_exact(&mut start))
            .map_err(failed)?;
        if start == *b"\x89HDF\r\n\x1a\n" {
            return Ok(true);
        }
        offset = if offset == 0 { 512 } else { 2 * offset };
    }
    Ok(false)
}

/// Whether both paths lead to one file, by whatever links.
pub(crate) fn same_file(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        if let (Ok(a), Ok(b)) = (fs::metadata(a), fs::metadata(b)) {
            return (a.dev(), a.ino()) == (b.dev(), b.ino());
        }
    }
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

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
            return Err(ResultError::Foreign { path });
        }
        // Whoever asks whether the file is being written holds the lock for a moment.
        let mut patience = 5;
        loop {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).truncate(false);
            let file = open_plain(&path, &mut options)
                .map_err(|error| ResultError::io(partial, "creating the file", error))?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) if patience > 0 => {
                    patience -= 1;
                    std::thread::sleep(std::time::Duration::from_millis(5));
                    continue;
                }
                Err(TryLockError::WouldBlock) => {
                    return Err(ResultError::AnotherRun {
                        path: partial.to_owned(),
                    });
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
                    Err(error) => Err(ResultError::io(partial, "creating the file", error)),
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
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        match (file.metadata(), fs::metadata(path)) {
            (Ok(a), Ok(b)) => (a.dev(), a.ino()) == (b.dev(), b.ino()),
            _ => false,
        }
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        path.exists()
    }
}
