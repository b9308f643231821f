//! Files on the disk: folders, signatures, identity, and files that appear only when complete.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The folder of `path`; "." if it names none.
pub fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Whether `path`, or the target of a link, is neither a file nor a folder, such as a pipe, which its users would lose.
fn is_pipe_or_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// Obstacle to writing a file.
#[derive(Debug)]
pub enum Obstacle {
    /// The path is a folder.
    Folder,
    /// The path ends in no name, such as `..`.
    NoFileName,
    /// The folder does not exist.
    NoFolder(PathBuf),
    /// The file is an input of the computation.
    Input,
    /// The path is a pipe or a device.
    PipeOrDevice,
    /// The existing file is write-protected.
    Protected,
    /// The existing file may be replaced by force only.
    NotOwn,
    /// The existing file cannot be examined.
    NotSeen(io::Error),
}

/// Obstacle to a new file at `path` made from `inputs`. Existing files are the matter of [`in_the_way`].
pub fn misplaced(path: &Path, inputs: &[PathBuf]) -> Option<Obstacle> {
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

/// Obstacle to replacing an existing file at `path`. Without `force` it must satisfy `is_own`, whose errors are
/// passed on.
pub fn in_the_way<E>(
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
            // A dangling link can be replaced without loss, but this program has not made it.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Some(Obstacle::NotOwn),
            Err(error) => Some(Obstacle::NotSeen(error)),
            Ok(found) if found.permissions().readonly() => Some(Obstacle::Protected),
            Ok(_) => (!is_own(path)?).then_some(Obstacle::NotOwn),
        },
    })
}

/// Writes `parts` in sequence to a temporary file and renames it to `path`, so that the file is complete or absent.
/// Fails with the operating system's error; nothing is left then.
pub fn write_whole(path: &Path, parts: &[&[u8]]) -> io::Result<()> {
    temporary_with(&folder_of(path), parts)?.persist(path)?;
    Ok(())
}

/// Tests whether [`write_whole`] works in a folder, with a file that is removed again. Permissions say too little
/// about network drives, and nothing about a full disk. Fails with the operating system's error.
pub fn try_folder(folder: &Path) -> io::Result<()> {
    temporary_with(folder, &[b"stickslip"]).map(drop)
}

fn temporary_with(folder: &Path, parts: &[&[u8]]) -> io::Result<Temporary> {
    use std::io::Write;
    let file = Temporary::create(folder)?;
    for part in parts {
        file.file().write_all(part)?;
    }
    Ok(file)
}

/// A file that gets its name when it is complete. On Linux it has no name until then, so that a killed program leaves
/// nothing. Elsewhere, and on file systems without nameless files, it has a hidden name, and is removed unless
/// persisted.
#[derive(Debug)]
pub struct Temporary(MadeFolder);

#[derive(Debug)]
enum MadeFolder {
    #[cfg(target_os = "linux")]
    Nameless(File),
    Named(tempfile::NamedTempFile),
}

const PREFIX: &str = ".stickslip-";
/// The usual permissions instead of the owner's alone; the umask applies.
#[cfg(unix)]
const PERMISSIONS: u32 = 0o666;

impl Temporary {
    /// Creates the file in `folder`. Fails with the operating system's error.
    pub fn create(folder: &Path) -> io::Result<Temporary> {
        #[cfg(target_os = "linux")]
        {
            use rustix::fs::{Mode, OFlags, open};
            let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
            if Path::new("/proc/self/fd").is_dir()
                && let Ok(file) = open(folder, flags, Mode::from_raw_mode(PERMISSIONS))
            {
                return Ok(Temporary(MadeFolder::Nameless(file.into())));
            }
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(PERMISSIONS));
        builder.tempfile_in(folder).map(MadeFolder::Named).map(Temporary)
    }

    /// The open file.
    pub fn file(&self) -> &File {
        match &self.0 {
            #[cfg(target_os = "linux")]
            MadeFolder::Nameless(file) => file,
            MadeFolder::Named(file) => file.as_file(),
        }
    }

    /// Gives the file its name in its folder, and replaces an existing file. Fails with the operating system's error.
    pub fn persist(self, path: &Path) -> io::Result<()> {
        match self.0 {
            #[cfg(target_os = "linux")]
            MadeFolder::Nameless(file) => name(&file, path),
            MadeFolder::Named(file) => file.persist(path).map(drop).map_err(|error| error.error),
        }
    }
}

/// A hard link cannot replace a file; renaming can.
#[cfg(target_os = "linux")]
fn name(file: &File, path: &Path) -> io::Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    use std::os::fd::AsRawFd;
    let open = format!("/proc/self/fd/{}", file.as_raw_fd());
    let link = |to: &Path| linkat(CWD, &open, CWD, to, AtFlags::SYMLINK_FOLLOW).map_err(io::Error::from);
    match link(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
        linked => return linked,
    }
    let hidden = path.with_file_name(format!("{PREFIX}{}-{}", std::process::id(), file.as_raw_fd()));
    // A killed process with the same number may have left this file.
    let _ = fs::remove_file(&hidden);
    link(&hidden)?;
    fs::rename(&hidden, path).inspect_err(|_| {
        let _ = fs::remove_file(&hidden);
    })
}

/// Whether the file begins with HDF5's signature.
pub fn is_hdf5(path: &Path) -> bool {
    let mut head = [0u8; 8];
    File::open(path).and_then(|mut file| file.read_exact(&mut head)).is_ok() && head == *b"\x89HDF\r\n\x1a\n"
}

/// Whether the file has an HDF5 signature, possibly after a user block of 512, 1024, ... bytes.
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

/// Whether both paths lead to the same file, possibly through links.
pub fn same_file(a: &Path, b: &Path) -> bool {
    let numbers = [a, b].map(|path| fs::metadata(path).ok().and_then(|found| number_of(&found)));
    match (numbers, a.canonicalize(), b.canonicalize()) {
        ([Some(a), Some(b)], ..) => a == b,
        (_, Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}
