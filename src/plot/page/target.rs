//! Where a page goes, and what it may replace.

use std::fs;
use std::io::{Read, Write};
use std::path::Path;

use super::PageError;
use crate::results::Overwrite;
use crate::results::target::{folder_of, same_file};

/// By this, near its beginning, the program knows a page of its own.
pub(super) const GENERATOR: &str = "<meta name=\"generator\" content=\"stickslip";
/// The mark stands in the first bytes of a page, whatever its title.
const HEAD: u64 = 512;

/// Whether a page of the result file `input` may be written to `path`.
///
/// # Errors
/// `path` is the input, a folder, in a folder that is missing, or a file that `overwrite` does not let
/// the page replace.
pub(super) fn check(path: &Path, overwrite: Overwrite, input: &Path) -> Result<(), PageError> {
    let owned = || path.to_owned();
    if path.is_dir() || path.as_os_str().to_string_lossy().ends_with(std::path::MAIN_SEPARATOR) {
        return Err(PageError::IsFolder { path: owned() });
    }
    if path.file_name().is_none() {
        return Err(PageError::NoFileName { path: owned() });
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(PageError::NoFolder { path: owned(), folder });
    }
    if same_file(input, path) {
        return Err(PageError::IsInput { path: owned() });
    }
    let Ok(metadata) = fs::symlink_metadata(path) else {
        return Ok(());
    };
    if overwrite == Overwrite::Force {
        return Ok(());
    }
    if metadata.permissions().readonly() {
        return Err(PageError::Protected { path: owned() });
    }
    // Not opened unless it is a plain file: a pipe, for one, would block.
    if path.is_file() && is_own_page(path)? {
        Ok(())
    } else {
        Err(PageError::Foreign { path: owned() })
    }
}

fn is_own_page(path: &Path) -> Result<bool, PageError> {
    let mut head = Vec::new();
    fs::File::open(path)
        .and_then(|file| file.take(HEAD).read_to_end(&mut head))
        .map_err(|error| PageError::io(path, "reading the file", error))?;
    Ok(String::from_utf8_lossy(&head).contains(GENERATOR))
}

/// Writes `parts` one after the other under a temporary name, which becomes `path` when all is written.
pub(super) fn write(path: &Path, parts: &[&str]) -> Result<u64, PageError> {
    let failed = |error| PageError::io(path, "writing the page", error);
    let mut builder = tempfile::Builder::new();
    builder.prefix(".stickslip-").suffix(".html");
    // As for any file that a program makes, and not for its owner alone; the umask takes from it.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder_of(path)).map_err(failed)?;
    for part in parts {
        file.write_all(part.as_bytes()).map_err(failed)?;
    }
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(parts.iter().map(|part| part.len() as u64).sum())
}
