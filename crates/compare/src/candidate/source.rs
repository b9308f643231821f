//! The file of a candidate, which is read several times.

use super::super::CompareError;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Largest input through a pipe, bytes. It is kept in a temporary file.
const MOST_PIPED: u64 = 1 << 30;

#[derive(Debug)]
pub(super) struct CandidateSource {
    path: PathBuf,
    /// Temporary file without a name, so that nothing is left if a signal ends the program.
    piped: Option<Arc<File>>,
}

impl CandidateSource {
    /// Opens a file; a pipe is read to its end. Fails for a missing file, a folder, a device, or an unreadable file.
    pub fn open(path: &Path) -> Result<CandidateSource, CompareError> {
        let failed = CompareError::io(path);
        let refused = |what: &str, remedy: &str| Err(CompareError::whole(path, what, remedy));
        let kind = std::fs::metadata(path).map_err(&failed)?.file_type();
        if kind.is_dir() {
            return refused("this is a folder", "name a file in it");
        }
        let mut source = CandidateSource {
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
        let mut kept = temporary()?;
        let mut pipe = File::open(path).map_err(&failed)?.take(MOST_PIPED + 1);
        let count = io::copy(&mut pipe, &mut kept).map_err(failed)?;
        if count > MOST_PIPED {
            let what = format!("more than {} MB came through the pipe", MOST_PIPED >> 20);
            return refused(&what, "save it in a file, and name that");
        }
        source.piped = Some(Arc::new(kept));
        Ok(source)
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn is_piped(&self) -> bool {
        self.piped.is_some()
    }

    pub fn file(&self) -> Result<CandidatePlace, CompareError> {
        let file = match &self.piped {
            Some(kept) => Arc::clone(kept),
            None => Arc::new(File::open(&self.path).map_err(CompareError::io(&self.path))?),
        };
        Ok(CandidatePlace { file, at: 0 })
    }

    pub fn head(&self, bytes: u64) -> Result<Vec<u8>, CompareError> {
        let mut head = Vec::new();
        let read = self.file()?.take(bytes).read_to_end(&mut head);
        read.map_err(CompareError::io(&self.path))?;
        Ok(head)
    }
}

pub(super) fn temporary() -> Result<File, CompareError> {
    tempfile::tempfile().map_err(CompareError::temporary)
}

#[derive(Debug, Clone)]
pub(super) struct CandidatePlace {
    file: Arc<File>,
    at: u64,
}

impl From<File> for CandidatePlace {
    fn from(file: File) -> Self {
        let file = Arc::new(file);
        CandidatePlace { file, at: 0 }
    }
}

impl CandidatePlace {
    pub fn length(&self) -> io::Result<u64> {
        Ok(self.file.metadata()?.len())
    }

    /// Fills `bytes` from the byte `at` of the file.
    pub fn read_at(&self, at: u64, bytes: &mut [u8]) -> io::Result<()> {
        let file = Arc::clone(&self.file);
        CandidatePlace { file, at }.read_exact(bytes)
    }
}

impl Read for CandidatePlace {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        #[cfg(unix)]
        let count = std::os::unix::fs::FileExt::read_at(&*self.file, buffer, self.at)?;
        #[cfg(windows)]
        let count = std::os::windows::fs::FileExt::seek_read(&*self.file, buffer, self.at)?;
        self.at += count as u64;
        Ok(count)
    }
}

impl Seek for CandidatePlace {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
            SeekFrom::End(by) => self.length()?.checked_add_signed(by),
        };
        self.at = at.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "a place before the beginning"))?;
        Ok(self.at)
    }
}
