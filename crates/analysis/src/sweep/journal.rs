//! Outcomes of points, and their journal: outcomes in the order of completion.
//!
//! Records are appended and synced to the disk in groups, each with length and checksum. After a kill or a power cut
//! the journal is valid up to the first torn record, and the later points run again. The sweep file is made from the
//! journal in the order of the points, so it does not depend on the order of completion.

use crate::analysis::Summary;
use crate::analysis::quantity::{NOT_PERIODIC, QUANTITIES, STUCK, quantity_index};
use crate::error::Error;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use stickslip_files::{ResultError, SweepEvent};
use stickslip_system::record::{Event, EventKind};

pub(super) const NO_COUNT: i64 = -1;

/// Duration of a lasting final stick, relative to the longest earlier one.
const LASTING_STICK: f64 = 2.0;

/// Whether a longer run might determine the motion. A stop: no lasting stick yet. Another motion without a period: the
/// contact still changes in the second half, or the final stick, too short, may belong to a cycle.
pub(super) fn is_open(values: &Values) -> bool {
    let value = |name: &str| quantity_index(name).map_or(f64::NAN, |place| values[place]);
    if !value("natural_period").is_nan() {
        return value("final_stick_time").is_nan();
    }
    match value("motion") {
        // False if no stick has ended.
        STUCK => value("end_time") - value("final_stick_time") < LASTING_STICK * value("longest_stick_duration"),
        motion => motion == NOT_PERIODIC && value("last_event_time") > 0.5 * value("end_time"),
    }
}

/// One value for each of the quantities of a study; NaN where the run has none.
pub type Values = Vec<f64>;

pub(super) fn values(summary: &Summary) -> Values {
    let values = QUANTITIES.iter().map(|quantity| quantity.value(summary));
    values.map(|value| value.unwrap_or(f64::NAN)).collect()
}

/// Numbers of an event in a sweep file: time, codes of kind and mode after it, relative velocity omega_r and internal
/// force T_f / r before it.
pub(super) fn event_row(event: &Event) -> SweepEvent {
    let codes = [event.kind.code(), event.mode_after.code()].map(f64::from);
    let force = event.internal_force;
    [event.time, codes[0], codes[1], event.before.relative_velocity, force]
}

/// Outcome of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct PointOutcome {
    /// Number of the point in its study.
    pub number: u64,
    /// Summary, or reason of a failure.
    pub result: Result<Values, String>,
    /// Events in order of time; empty unless the study keeps them.
    pub events: Vec<SweepEvent>,
}

impl PointOutcome {
    /// Value of a quantity by its index; NaN if missing, as in the journal of a version that did not have it.
    pub fn value(&self, index: usize) -> f64 {
        let values = self.result.as_ref().map_or(&[][..], Vec::as_slice);
        values.get(index).copied().unwrap_or(f64::NAN)
    }

    /// Appends a framed record: number; count and values, or length and text of an error; events.
    pub(super) fn encode(&self, bytes: &mut Vec<u8>) {
        let start = bytes.len();
        bytes.extend_from_slice(&[0; FRAME]);
        bytes.extend_from_slice(&self.number.to_le_bytes());
        match &self.result {
            Ok(values) => {
                bytes.push(0);
                bytes.extend_from_slice(&(values.len() as u64).to_le_bytes());
                bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            Err(message) => {
                bytes.push(1);
                bytes.extend_from_slice(&(message.len() as u64).to_le_bytes());
                bytes.extend_from_slice(message.as_bytes());
            }
        }
        bytes.extend_from_slice(&(self.events.len() as u64).to_le_bytes());
        for &[time, kind, mode, velocity, force] in &self.events {
            bytes.extend_from_slice(&time.to_le_bytes());
            bytes.extend_from_slice(&[kind as i8 as u8, mode as i8 as u8]);
            bytes.extend([velocity, force].iter().flat_map(|number| number.to_le_bytes()));
        }
        let (frame, record) = bytes[start..].split_at_mut(FRAME);
        frame[..4].copy_from_slice(&(record.len() as u32).to_le_bytes());
        frame[4..].copy_from_slice(&crc32fast::hash(record).to_le_bytes());
    }

    /// Outcome of a record without its frame; `None` if malformed.
    fn decode(mut record: &[u8]) -> Option<PointOutcome> {
        let rest = &mut record;
        let number = whole(rest)?;
        let result = match taken::<1>(rest)? {
            [0] => {
                let count = usize::try_from(whole(rest)?).ok()?;
                // Each value takes eight bytes, which bounds the count.
                if count > rest.len() / 8 {
                    return None;
                }
                Ok((0..count).map(|_| float(rest)).collect::<Option<Values>>()?)
            }
            _ => {
                let length = usize::try_from(whole(rest)?).ok()?;
                let (text, after) = rest.split_at_checked(length)?;
                *rest = after;
                Err(String::from_utf8(text.to_vec()).ok()?)
            }
        };
        let mut events = Vec::new();
        for _ in 0..whole(rest)? {
            let time = float(rest)?;
            let [kind, mode] = taken::<2>(rest)?.map(|code| code as i8);
            // A journal with an unknown event is of another version.
            EventKind::ALL.into_iter().find(|known| known.code() == kind)?;
            events.push([time, kind.into(), mode.into(), float(rest)?, float(rest)?]);
        }
        rest.is_empty().then_some(PointOutcome { number, result, events })
    }
}

fn taken<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
    let (head, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(*head)
}

fn whole(bytes: &mut &[u8]) -> Option<u64> {
    taken(bytes).map(u64::from_le_bytes)
}

fn float(bytes: &mut &[u8]) -> Option<f64> {
    taken(bytes).map(f64::from_le_bytes)
}

/// Bytes of length and checksum before each record.
const FRAME: usize = 8;

/// Length of the longest valid record: a run of 100,000 events takes 3 MB.
const LONGEST_RECORD: u32 = 1 << 30;

/// Outcome and length of the next record within `room` bytes; `None` if it is torn or has changed.
fn next_record(reader: &mut impl Read, room: u64) -> io::Result<Option<(PointOutcome, u64)>> {
    let mut frame = [0u8; FRAME];
    if room < FRAME as u64 {
        return Ok(None);
    }
    reader.read_exact(&mut frame)?;
    let [size, sum] = [0, 4].map(|k| u32::from_le_bytes([frame[k], frame[k + 1], frame[k + 2], frame[k + 3]]));
    let length = FRAME as u64 + u64::from(size);
    if size > LONGEST_RECORD || length > room {
        return Ok(None);
    }
    let mut record = vec![0; size as usize];
    reader.read_exact(&mut record)?;
    let record = Some(record).filter(|record| crc32fast::hash(record) == sum);
    Ok(record.and_then(|record| Some((PointOutcome::decode(&record)?, length))))
}

/// Outcomes of consecutive records; `None` if one is torn or has changed.
pub(super) fn outcomes_of(mut bytes: &[u8]) -> Option<Vec<PointOutcome>> {
    let mut outcomes = Vec::new();
    while !bytes.is_empty() {
        let room = bytes.len() as u64;
        outcomes.push(next_record(&mut bytes, room).ok()??.0);
    }
    Some(outcomes)
}

const MAGIC: &[u8; 8] = b"SSJRNL2\n";

/// Path of a journal: `map.journal` next to `map.h5`.
pub fn journal_path(path: &Path) -> PathBuf {
    path.with_extension("journal")
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

fn failed(path: &Path, action: &'static str) -> impl Fn(io::Error) -> Error {
    move |error| ResultError::io(path, action, error).into()
}

impl Journal {
    /// Opens or creates the journal of a study.
    ///
    /// # Errors
    /// The journal is in use, belongs to another study, or exists although `existing` refuses it.
    pub fn open(path: &Path, digest: &str, existing: Existing) -> Result<Journal, Error> {
        let reading = failed(path, "reading the journal");
        let refused = |why: &str| Err(Error::input(format!("{}: {why}", path.display())));
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path);
        let mut file = file.map_err(|error| ResultError::not_created(path, error))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return refused("another sweep is writing there; wait for its end, or choose another name with -o");
            }
            // Some network file systems have no locks. Two sweeps into one file then remain unnoticed.
            Err(TryLockError::Error(error)) => log::debug!("{}: no lock: {error}", path.display()),
        }
        let mut journal = Journal {
            path: path.to_owned(),
            end: 0,
            offsets: BTreeMap::new(),
            buffer: Vec::new(),
            file: file.try_clone().map_err(failed(path, "opening the journal"))?,
        };
        let length = file.metadata().map_err(failed(path, "looking at the journal"))?.len();
        let header = [MAGIC.as_slice(), digest.as_bytes(), b"\n"].concat();
        let mut found = Vec::new();
        let head = Read::by_ref(&mut file)
            .take(header.len() as u64)
            .read_to_end(&mut found);
        head.map_err(&reading)?;
        let own = found.len() == header.len() && found.starts_with(MAGIC);
        // A kill may have come before a complete header.
        let torn = header.starts_with(&found)
            || (found.len() < header.len() && MAGIC.starts_with(&found[..found.len().min(8)]));
        let prepared = match existing {
            _ if length == 0 => journal.begin(&header),
            Existing::Discard => journal.begin(&header),
            _ if own && found == header => {
                journal.end = header.len() as u64;
                journal.scan(length).map_err(&reading)?;
                if existing == Existing::Refuse && journal.points() > 0 {
                    return refused(&format!(
                        "holds {} points of an interrupted study; --resume goes on with it, --force throws it away and starts anew",
                        journal.points()
                    ));
                }
                journal.file.set_len(journal.end)
            }
            _ if own => {
                let text = |bytes: &[u8]| String::from_utf8_lossy(&bytes[8..16]).into_owned();
                return refused(&format!(
                    "belongs to another study, or to this one before it was changed (digest {} instead of {}); resume with the study \
                     as it was, choose another name with -o, or start anew with --force",
                    text(&found),
                    text(&header)
                ));
            }
            _ if torn => journal.begin(&header),
            _ => {
                return refused(
                    "not the journal of a sweep by this version of the program; choose another name with -o, or replace it with --force",
                );
            }
        };
        prepared.map_err(failed(path, "preparing the journal"))?;
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
    pub fn append(&mut self, outcomes: &[PointOutcome]) -> Result<(), Error> {
        self.buffer.clear();
        let mut starts = Vec::with_capacity(outcomes.len());
        for outcome in outcomes {
            starts.push((outcome.number, self.end + self.buffer.len() as u64));
            outcome.encode(&mut self.buffer);
        }
        let written = self
            .file
            .seek(SeekFrom::Start(self.end))
            .and_then(|_| self.file.write_all(&self.buffer))
            .and_then(|()| self.file.sync_data());
        written.map_err(failed(&self.path, "writing the journal"))?;
        self.end += self.buffer.len() as u64;
        self.offsets.extend(starts);
        Ok(())
    }

    /// Outcome of a point; `None` without a record. Fails if the record has changed.
    pub fn read(&mut self, number: u64) -> Result<Option<PointOutcome>, Error> {
        let Some(&offset) = self.offsets.get(&number) else {
            return Ok(None);
        };
        let read = self.file.seek(SeekFrom::Start(offset));
        let read = read.and_then(|_| next_record(&mut self.file, u64::MAX));
        let damage = || io::Error::new(io::ErrorKind::InvalidData, "a record has changed since it was written");
        let record = read.and_then(|record| record.ok_or_else(damage));
        Ok(Some(record.map_err(failed(&self.path, "reading the journal"))?.0))
    }

    /// Removes the journal after the sweep file is complete.
    pub fn remove(self) -> Result<(), Error> {
        std::fs::remove_file(&self.path).map_err(failed(&self.path, "removing the journal"))
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
