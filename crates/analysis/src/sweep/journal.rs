//! Journal of a sweep: outcomes in the order of completion.
//!
//! Records are appended and synced to the disk in groups, each with length and checksum. After a kill or a power cut
//! the journal is valid up to the first torn record, and the later points run again. The sweep file is made from the
//! journal in the order of the points, so it does not depend on the order of completion.

use super::outcome::PointOutcome;
use super::record::{encode, next_record};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use stickslip_files::ResultError;

const MAGIC: &[u8; 8] = b"SSJRNL2\n";

/// Path of a journal: `map.journal` next to `map.h5`.
pub fn journal_path(path: &Path) -> PathBuf {
    path.with_extension("journal")
}

/// Error of a journal.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum JournalError {
    #[error(
        "{path}: holds {points} points of an interrupted study; --resume goes on with it, --force throws it away and starts anew"
    )]
    Unfinished { path: PathBuf, points: u64 },
    #[error(
        "{path}: belongs to another study, or to this one before it was changed (digest {found} instead of {expected}); resume with the study as it was, choose another name with -o, or start anew with --force"
    )]
    OtherStudy {
        path: PathBuf,
        found: String,
        expected: String,
    },
    #[error(
        "{path}: not the journal of a sweep by this version of the program; choose another name with -o, or replace it with --force"
    )]
    Foreign { path: PathBuf },
    #[error("{path}: another sweep is writing there; wait for its end, or choose another name with -o")]
    InUse { path: PathBuf },
    #[error(transparent)]
    File(#[from] ResultError),
}

/// Treatment of an existing journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Refuse a journal with points.
    Refuse,
    /// Resume a journal of the same study.
    Resume,
    /// Discard the journal.
    Discard,
}

/// Journal of one sweep, open and locked.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    end: u64,
    /// Offset of each point's record. Point numbers may have gaps.
    offsets: BTreeMap<u64, u64>,
    buffer: Vec<u8>,
}

impl Journal {
    /// Opens or creates the journal of a study.
    ///
    /// # Errors
    /// The journal is in use, belongs to another study, or exists although `existing` refuses it.
    pub fn open(path: &Path, digest: &str, existing: Existing) -> Result<Journal, JournalError> {
        let failed = |action, error| JournalError::File(ResultError::io(path, action, error));
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path);
        let mut file = file.map_err(|error| JournalError::File(ResultError::not_created(path, error)))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(JournalError::InUse { path: path.to_owned() }),
            // Some network file systems have no locks. Two sweeps into one file then remain unnoticed.
            Err(TryLockError::Error(error)) => log::debug!("{}: no lock: {error}", path.display()),
        }
        let mut journal = Journal {
            path: path.to_owned(),
            end: 0,
            offsets: BTreeMap::new(),
            buffer: Vec::new(),
            file: file.try_clone().map_err(|error| failed("opening the journal", error))?,
        };
        let metadata = file
            .metadata()
            .map_err(|error| failed("looking at the journal", error))?;
        let length = metadata.len();
        let header = header(digest);
        let mut found = Vec::new();
        Read::by_ref(&mut file)
            .take(header.len() as u64)
            .read_to_end(&mut found)
            .map_err(|error| failed("reading the journal", error))?;
        let own = found.len() == header.len() && found.starts_with(MAGIC);
        // A kill may have come before a complete header.
        let torn = header.starts_with(&found)
            || (found.len() < header.len() && MAGIC.starts_with(&found[..found.len().min(8)]));
        match existing {
            _ if length == 0 => journal.begin(&header),
            Existing::Discard => journal.begin(&header),
            _ if own && found == header => {
                journal.end = header.len() as u64;
                journal
                    .scan(length)
                    .map_err(|error| failed("reading the journal", error))?;
                if existing == Existing::Refuse && journal.points() > 0 {
                    let (path, points) = (path.to_owned(), journal.points());
                    return Err(JournalError::Unfinished { path, points });
                }
                let end = journal.end;
                journal.file.set_len(end)
            }
            _ if own => {
                let text = |bytes: &[u8]| String::from_utf8_lossy(&bytes[8..16]).into_owned();
                return Err(JournalError::OtherStudy {
                    path: path.to_owned(),
                    found: text(&found),
                    expected: text(&header),
                });
            }
            _ if torn => journal.begin(&header),
            _ => return Err(JournalError::Foreign { path: path.to_owned() }),
        }
        .map_err(|error| failed("preparing the journal", error))?;
        Ok(journal)
    }

    /// Number of recorded points.
    pub fn points(&self) -> u64 {
        self.offsets.len() as u64
    }

    pub(super) fn numbers(&self) -> impl Iterator<Item = u64> {
        self.offsets.keys().copied()
    }

    /// Whether a point is recorded.
    pub fn holds(&self, number: u64) -> bool {
        self.offsets.contains_key(&number)
    }

    /// Adds outcomes and returns when they are on the disk. After a failure earlier records stay valid.
    pub fn append(&mut self, outcomes: &[PointOutcome]) -> Result<(), JournalError> {
        self.buffer.clear();
        let mut starts = Vec::with_capacity(outcomes.len());
        for outcome in outcomes {
            starts.push((outcome.number, self.end + self.buffer.len() as u64));
            encode(outcome, &mut self.buffer);
        }
        let end = self.end;
        let written = self
            .file
            .seek(SeekFrom::Start(end))
            .and_then(|_| self.file.write_all(&self.buffer))
            .and_then(|()| self.file.sync_data());
        written.map_err(|error| self.failed("writing the journal", error))?;
        self.end += self.buffer.len() as u64;
        self.offsets.extend(starts);
        Ok(())
    }

    /// Outcome of a point; `None` without a record. Fails if the record has changed.
    pub fn read(&mut self, number: u64) -> Result<Option<PointOutcome>, JournalError> {
        let Some(&offset) = self.offsets.get(&number) else {
            return Ok(None);
        };
        let read = self.file.seek(SeekFrom::Start(offset));
        let read = read.and_then(|_| next_record(&mut self.file, u64::MAX));
        match read.map_err(|error| self.failed("reading the journal", error))? {
            Some((outcome, _)) => Ok(Some(outcome)),
            None => {
                let damage = io::Error::new(io::ErrorKind::InvalidData, "a record has changed since it was written");
                Err(self.failed("reading the journal", damage))
            }
        }
    }

    /// Removes the journal after the sweep file is complete.
    pub fn remove(self) -> Result<(), JournalError> {
        std::fs::remove_file(&self.path).map_err(|error| self.failed("removing the journal", error))
    }

    fn failed(&self, action: &'static str, error: io::Error) -> JournalError {
        JournalError::File(ResultError::io(&self.path, action, error))
    }

    fn begin(&mut self, header: &[u8]) -> io::Result<()> {
        self.file.set_len(0)?;
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(header)?;
        self.file.sync_all()?;
        self.end = header.len() as u64;
        // Also syncs the folder's entry on systems that can.
        let _ = File::open(stickslip_files::folder_of(&self.path)).and_then(|folder| folder.sync_all());
        Ok(())
    }

    fn scan(&mut self, length: u64) -> io::Result<()> {
        let mut reader = BufReader::with_capacity(1 << 16, self.file.try_clone()?);
        reader.seek(SeekFrom::Start(self.end))?;
        while let Some((outcome, size)) = next_record(&mut reader, length - self.end)? {
            self.offsets.insert(outcome.number, self.end);
            self.end += size;
        }
        Ok(())
    }
}

fn header(digest: &str) -> Vec<u8> {
    [MAGIC.as_slice(), digest.as_bytes(), b"\n"].concat()
}
