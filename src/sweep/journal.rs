//! The journal of a sweep: every outcome as soon as it is there, in the order of completion.
//!
//! Records are appended and synced to the disk in groups, each with its length and checksum: after a kill or a power cut
//! the journal is good up to the first record that is torn, and the points from there on are run again. The sweep file is
//! made from it in the order of the points, so that it does not depend on who finished when.

use super::quantities::Outcome;
use super::record::{encode, next_record};
use crate::results::ResultError;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"SSJRNL2\n";

/// `map.h5` has its journal in `map.journal`, next to it.
pub fn journal_path(path: &Path) -> PathBuf {
    path.with_extension("journal")
}

/// The journal that a rank of an MPI job keeps of the points it ran for the sweep into `map.h5`: `map.rank-3.journal`.
#[cfg(feature = "mpi")]
pub(crate) fn rank_journal_path(path: &Path, rank: usize) -> PathBuf {
    path.with_extension(format!("rank-{rank}.journal"))
}

/// The journals of ranks beside `map.h5`: while an MPI job runs, or after one that was killed.
pub(super) fn rank_journals(path: &Path) -> io::Result<Vec<PathBuf>> {
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
    let start = name(&path.with_extension("rank-")).unwrap_or_default();
    let mut found = Vec::new();
    for entry in std::fs::read_dir(crate::results::folder_of(path))? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let rank = name.strip_prefix(&start).and_then(|rest| rest.strip_suffix(".journal"));
        if rank.is_some_and(|rank| rank.parse::<usize>().is_ok()) {
            found.push(path.with_file_name(entry.file_name()));
        }
    }
    found.sort();
    Ok(found)
}

/// What can go wrong with a journal.
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

/// What to do with a journal that is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Refuse it if it holds a point.
    Refuse,
    /// Go on with it if it is of the same study.
    Resume,
    /// Throw it away.
    Discard,
}

/// The journal of one sweep, open and locked.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Where the next record goes.
    end: u64,
    /// Where the record of each point is: by what is there, as a number may be any.
    offsets: BTreeMap<u64, u64>,
    /// The bytes of a group under way.
    buffer: Vec<u8>,
}

impl Journal {
    /// Opens or creates the journal of a study with this digest.
    ///
    /// # Errors
    /// A journal of another study, one that is in use, one that `existing` refuses, or a failure of the disk.
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
            // Some network file systems have no locks: there, two sweeps into one file go unnoticed.
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
        // A kill may have come before the header was whole.
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

    /// How many points it holds.
    pub fn points(&self) -> u64 {
        self.offsets.len() as u64
    }

    /// Whether it holds the point of this number.
    pub fn holds(&self, number: u64) -> bool {
        self.offsets.contains_key(&number)
    }

    /// Adds outcomes and returns when they are on the disk.
    ///
    /// # Errors
    /// A full disk, or another failure of it; what was there before stays good.
    pub fn append(&mut self, outcomes: &[Outcome]) -> Result<(), JournalError> {
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

    /// The outcome of a point; `None` where there is no record.
    ///
    /// # Errors
    /// A failure to read, or a record that has changed since it was written.
    pub fn read(&mut self, number: u64) -> Result<Option<Outcome>, JournalError> {
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

    /// Takes over the points of another journal of the study that this one does not hold.
    ///
    /// # Errors
    /// A failure of the disk.
    pub fn absorb(&mut self, other: &mut Journal) -> Result<(), JournalError> {
        const GROUP: usize = 256;
        let mut group = Vec::new();
        let numbers: Vec<u64> = other.offsets.keys().copied().collect();
        for number in numbers {
            if !self.holds(number)
                && let Some(outcome) = other.read(number)?
            {
                group.push(outcome);
            }
            if group.len() == GROUP {
                self.append(&group)?;
                group.clear();
            }
        }
        if group.is_empty() { Ok(()) } else { self.append(&group) }
    }

    /// Removes the journal: the sweep file is whole.
    ///
    /// # Errors
    /// If it cannot be removed.
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
        // The folder's entry too; not every system can.
        let _ = File::open(crate::results::folder_of(&self.path)).and_then(|folder| folder.sync_all());
        Ok(())
    }

    /// Notes where the records are, up to the first that is torn.
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

#[cfg(test)]
mod tests {
    use super::super::quantities::EventRow;
    use super::*;
    use crate::record::EventKind;
    use proptest::prelude::*;

    fn outcome(number: u64) -> Outcome {
        let result = if number % 3 == 1 {
            Err(format!("point {number} failed: ä"))
        } else {
            // As many values as the study has quantities.
            Ok((0..20 + number).map(|k| number as f64 + k as f64 / 7.0).collect())
        };
        let events = (0..number % 4)
            .map(|k| EventRow {
                time: k as f64,
                kind: EventKind::Stick,
                mode_after: 1,
                relative_velocity: -0.5,
                internal_force: 2.0,
            })
            .collect();
        Outcome { number, result, events }
    }

    const DIGEST: &str = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Cut anywhere, or with any byte changed, a journal gives the records before the damage and no other.
        #[test]
        fn property_a_damaged_journal_is_good_up_to_the_damage(cut in 0.0..1.0f64, flip in any::<bool>()) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("x.journal");
            let mut journal = Journal::open(&path, DIGEST, Existing::Refuse).unwrap();
            let mut ends = vec![journal.end];
            for number in 0..12 {
                journal.append(&[outcome(11 - number)]).unwrap();
                ends.push(journal.end);
            }
            drop(journal);
            let mut bytes = std::fs::read(&path).unwrap();
            let first = ends[0] as usize;
            let at = first + (cut * (bytes.len() - first) as f64) as usize;
            if flip { bytes[at] ^= 0x10 } else { bytes.truncate(at) }
            std::fs::write(&path, &bytes).unwrap();
            let whole = ends.iter().filter(|&&end| end <= at as u64).count() as u64 - 1;
            let mut journal = Journal::open(&path, DIGEST, Existing::Resume).unwrap();
            prop_assert_eq!(journal.points(), whole);
            for number in 0..12 {
                let found = journal.read(number).unwrap();
                prop_assert_eq!(found, (11 - number < whole).then(|| outcome(number)));
            }
        }
    }

    #[test]
    fn property_a_journal_of_another_study_or_in_use_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.journal");
        let mut journal = Journal::open(&path, DIGEST, Existing::Refuse).unwrap();
        journal.append(&[outcome(3)]).unwrap();
        let open = |digest: &str, existing| Journal::open(&path, digest, existing);
        assert!(matches!(
            open(DIGEST, Existing::Resume),
            Err(JournalError::InUse { .. })
        ));
        drop(journal);
        let other = DIGEST.replace('0', "f");
        assert!(matches!(
            open(&other, Existing::Resume),
            Err(JournalError::OtherStudy { .. })
        ));
        assert!(matches!(
            open(DIGEST, Existing::Refuse),
            Err(JournalError::Unfinished { points: 1, .. })
        ));
        assert_eq!(open(&other, Existing::Discard).unwrap().points(), 0);
        std::fs::write(
            &path,
            "something else that is long enough to be somebody's text, and is not ours at all.",
        )
        .unwrap();
        assert!(matches!(
            open(DIGEST, Existing::Resume),
            Err(JournalError::Foreign { .. })
        ));
    }
}
