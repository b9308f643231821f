//! Where a figure goes: its earlier version is replaced, any other file only by force.

use super::error::PlotError;
use super::{raster, svg};
use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;

/// Bytes at the start of a file in which a figure's signature stands.
const HEAD: u64 = 4096;

/// Whether a figure may be written to `path`.
///
/// # Errors
/// A folder, a file in a folder that is missing, or a file that is no figure of this program and is not to be replaced
/// by `force`.
pub fn check(path: &Path, force: bool) -> Result<(), PlotError> {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
        return Err(PlotError::MissingFolder {
            path: path.to_owned(),
            folder: folder.to_owned(),
        });
    }
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        Err(source) => Err(io(path, "looking at the file", source)),
        Ok(_) if path.is_dir() => Err(PlotError::IsFolder { path: path.to_owned() }),
        Ok(_) if force => Ok(()),
        // Not opened unless it is a plain file: a pipe, for one, would block.
        Ok(data) if data.is_file() && is_own_figure(path)? => Ok(()),
        Ok(_) => Err(PlotError::Foreign { path: path.to_owned() }),
    }
}

/// Writes the whole file beside its name and renames it: a figure is there in whole or not at all.
///
/// # Errors
/// Of the operating system.
pub fn write(path: &Path, contents: &[u8]) -> Result<(), PlotError> {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".new");
    let beside = path.with_file_name(name);
    let written = fs::File::create(&beside)
        .and_then(|mut file| file.write_all(contents))
        .and_then(|()| fs::rename(&beside, path));
    written.map_err(|source| {
        let _ = fs::remove_file(&beside);
        io(path, "writing", source)
    })
}

fn io(path: &Path, action: &'static str, source: std::io::Error) -> PlotError {
    PlotError::Io {
        path: path.to_owned(),
        action,
        source,
    }
}

fn is_own_figure(path: &Path) -> Result<bool, PlotError> {
    let mut head = Vec::new();
    fs::File::open(path)
        .and_then(|file| file.take(HEAD).read_to_end(&mut head))
        .map_err(|source| io(path, "reading", source))?;
    let contains = |text: &str| head.windows(text.len()).any(|window| window == text.as_bytes());
    let (keyword, value) = raster::SIGNATURE;
    Ok(if head.starts_with(b"\x89PNG") {
        contains(&format!("{keyword}\0{value}"))
    } else {
        contains(&format!("<desc>{}", svg::SIGNATURE))
    })
}
