//! The file of a candidate, which is read several times.

use super::super::CompareError;
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// What comes through a pipe is kept in a temporary file, up to so many bytes.
const MOST_PIPED: u64 = 1 << 30;

/// A file, or what came through a pipe.
#[derive(Debug)]
pub(super) struct Source {
    path: PathBuf,
    piped: Option<tempfile::NamedTempFile>,
}

impl Source {
    /// Opens a file; a pipe is read to its end.
    ///
    /// # Errors
    /// No such file, a folder or a device, or one that cannot be read.
    pub fn open(path: &Path) -> Result<Source, CompareError> {
        let failed = |error| CompareError::io(path, &error);
        let refused = |what: &str, remedy: &str| Err(CompareError::content(path, "", what, remedy));
        let kind = std::fs::metadata(path).map_err(failed)?.file_type();
        if kind.is_dir() {
            return refused("this is a folder", "name a file in it");
        }
        let mut source = Source {
            path: path.to_owned(),
            piped: None,
        };
        if kind.is_file() {
            return Ok(source);
        }
        #[cfg(unix)]
        if !std::os::unix::fs::FileTypeExt::is_fifo(&kind) && !std::os::unix::fs::FileTypeExt::is_socket(&kind) {
            return refused("this is a device", "name a file");
        }
        let temporary = |error| CompareError::io(&std::env::temp_dir(), &error);
        let mut kept = tempfile::NamedTempFile::new().map_err(temporary)?;
        let mut pipe = File::open(path).map_err(failed)?.take(MOST_PIPED + 1);
        let count = std::io::copy(&mut pipe, &mut kept).map_err(failed)?;
        if count > MOST_PIPED {
            let what = format!("more than {} MB came through the pipe", MOST_PIPED >> 20);
            return refused(&what, "save it in a file, and name that");
        }
        kept.flush().map_err(temporary)?;
        source.piped = Some(kept);
        Ok(source)
    }

    /// As it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn is_piped(&self) -> bool {
        self.piped.is_some()
    }

    /// From its beginning.
    pub fn file(&self) -> Result<File, CompareError> {
        let path = self.piped.as_ref().map_or(self.path.as_path(), |kept| kept.path());
        File::open(path).map_err(|error| CompareError::io(&self.path, &error))
    }

    /// Its first bytes, by which its format is known.
    pub fn head(&self) -> Result<Vec<u8>, CompareError> {
        let mut head = Vec::new();
        let read = self.file()?.take(8).read_to_end(&mut head);
        read.map_err(|error| CompareError::io(&self.path, &error))?;
        Ok(head)
    }
}
