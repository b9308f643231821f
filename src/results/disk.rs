//! Files on the disk: their folders and signatures, whether two names are one file, and files that appear in whole.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The folder that holds `path`, "." where it names none.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Whether something is at `path`, or where a link there leads, that is neither a file nor a folder, such as a pipe: a file in its place
/// would take it from whoever uses it.
fn is_pipe_or_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// What keeps a file from being written.
#[derive(Debug)]
pub(crate) enum Obstacle {
    /// The path is that of a folder.
    Folder,
    NoFileName,
    /// The folder is not there.
    NoFolder(PathBuf),
    /// The file is made from what is there.
    Input,
    PipeOrDevice,
    /// What is there is write-protected.
    Protected,
    /// What is there may only be replaced by force.
    NotOwn,
    /// The system does not say what is there.
    NotSeen(io::Error),
}

/// What keeps a file from being made at `path` from `inputs`, whether or not one is there already.
pub(crate) fn misplaced(path: &Path, inputs: &[PathBuf]) -> Option<Obstacle> {
    let folder = folder_of(path);
    if path.is_dir() || path.as_os_str().to_string_lossy().ends_with(std::path::MAIN_SEPARATOR) {
        Some(Obstacle::Folder)
    } else if path.file_name().is_none() {
        Some(Obstacle::NoFileName)
    } else if !folder.is_dir() {
        Some(Obstacle::NoFolder(folder))
    } else if inputs.iter().any(|input| same_file(input, path)) {
        Some(Obstacle::Input)
    } else {
        None
    }
}

/// What keeps that which is at `path`, if anything is, from being replaced: by force any file is, else one that `is_own`.
///
/// # Errors
/// Those of `is_own`.
pub(crate) fn in_the_way<E>(
    path: &Path,
    force: bool,
    is_own: impl FnOnce(&Path) -> Result<bool, E>,
) -> Result<Option<Obstacle>, E> {
    Ok(match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => Some(Obstacle::NotSeen(error)),
        Ok(_) if path.is_dir() => Some(Obstacle::Folder),
        Ok(_) if is_pipe_or_device(path) => Some(Obstacle::PipeOrDevice),
        Ok(_) if force => None,
        Ok(_) => match fs::metadata(path) {
            // A link that leads nowhere: nothing is lost by replacing it, but it was not made by this program.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Some(Obstacle::NotOwn),
            Err(error) => Some(Obstacle::NotSeen(error)),
            Ok(found) if found.permissions().readonly() => Some(Obstacle::Protected),
            Ok(_) => (!is_own(path)?).then_some(Obstacle::NotOwn),
        },
    })
}

/// Writes `parts` one after the other under a temporary name beside `path`, which becomes `path` when all is written: a
/// file is there in whole or not at all.
///
/// # Errors
/// Of the operating system; nothing is left of the file then.
#[cfg(feature = "plot")]
pub(crate) fn write_whole(path: &Path, parts: &[&[u8]]) -> io::Result<()> {
    temporary_with(&folder_of(path), parts)?.persist(path)?;
    Ok(())
}

/// Whether [`write_whole`] can make a file in this folder, by one that is removed again: permissions say too little of network
/// drives, and nothing of a full disk.
///
/// # Errors
/// Of the operating system.
#[cfg(feature = "plot")]
pub(crate) fn try_folder(folder: &Path) -> io::Result<()> {
    temporary_with(folder, &[b"stickslip"]).map(drop)
}

#[cfg(feature = "plot")]
fn temporary_with(folder: &Path, parts: &[&[u8]]) -> io::Result<tempfile::NamedTempFile> {
    use std::io::Write;
    let mut file = temporary_in(folder)?;
    for part in parts {
        file.write_all(part)?;
    }
    Ok(file)
}

/// A file under a temporary name in this folder, which is removed unless it is given its own.
///
/// # Errors
/// Of the operating system.
#[cfg(feature = "plot")]
pub(crate) fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".stickslip-");
    // As for any file that a program makes, and not for its owner alone; the umask takes from it.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

/// Whether a file begins as HDF5 does. (One named so without a signature is a damaged one, not a case.)
pub(crate) fn is_hdf5(path: &Path) -> bool {
    let mut head = [0u8; 8];
    File::open(path).and_then(|mut file| file.read_exact(&mut head)).is_ok() && head == *b"\x89HDF\r\n\x1a\n"
}

/// Whether the file starts as HDF5 files do (after a user block of 0, 512, 1024, ... bytes).
///
/// # Errors
/// Of the operating system.
pub(super) fn has_hdf5_signature(path: &Path) -> io::Result<bool> {
    use std::io::{Seek, SeekFrom};
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut offset = 0;
    while offset + 8 <= length {
        let mut start = [0; 8];
        file.seek(SeekFrom::Start(offset))?;
        file.read_exact(&mut start)?;
        if start == *b"\x89HDF\r\n\x1a\n" {
            return Ok(true);
        }
        offset = if offset == 0 { 512 } else { 2 * offset };
    }
    Ok(false)
}

/// Device and file on it; `None` where the system does not say.
pub(super) fn number_of(found: &fs::Metadata) -> Option<(u64, u64)> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        Some((found.dev(), found.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = found;
        None
    }
}

/// Whether both paths lead to one file, by whatever links.
pub(crate) fn same_file(a: &Path, b: &Path) -> bool {
    let numbers = [a, b].map(|path| fs::metadata(path).ok().and_then(|found| number_of(&found)));
    match (numbers, a.canonicalize(), b.canonicalize()) {
        ([Some(a), Some(b)], ..) => a == b,
        (_, Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}
