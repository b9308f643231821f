//! Record of an outcome, in a journal or from another process.

use super::outcome::{EventRow, PointOutcome};
use std::io::{self, Read};
use stickslip_system::record::EventKind;

/// Bytes of length and checksum before each record.
const FRAME: usize = 8;

/// Length of the longest valid record: a run of 100,000 events takes 3 MB.
const LONGEST_RECORD: u32 = 1 << 30;

/// Outcome and length of the next record within `room` bytes; `None` if it is torn or has changed.
pub(super) fn next_record(reader: &mut impl Read, room: u64) -> io::Result<Option<(PointOutcome, u64)>> {
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
    let outcome = Some(record).filter(|record| crc32fast::hash(record) == sum);
    Ok(outcome.and_then(|record| Some((decode(&record)?, length))))
}

/// Appends a framed record: number; count and values, or length and text of an error; events.
pub(super) fn encode(outcome: &PointOutcome, bytes: &mut Vec<u8>) {
    let start = bytes.len();
    bytes.extend_from_slice(&[0; FRAME]);
    bytes.extend_from_slice(&outcome.number.to_le_bytes());
    match &outcome.result {
        Ok(values) => {
            bytes.push(0);
            bytes.extend_from_slice(&(values.len() as u64).to_le_bytes());
            for value in values {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
        }
        Err(message) => {
            bytes.push(1);
            bytes.extend_from_slice(&(message.len() as u64).to_le_bytes());
            bytes.extend_from_slice(message.as_bytes());
        }
    }
    bytes.extend_from_slice(&(outcome.events.len() as u64).to_le_bytes());
    for event in &outcome.events {
        bytes.extend_from_slice(&event.time.to_le_bytes());
        bytes.push(event.kind.code() as u8);
        bytes.push(event.mode_after as u8);
        bytes.extend_from_slice(&event.relative_velocity.to_le_bytes());
        bytes.extend_from_slice(&event.internal_force.to_le_bytes());
    }
    let (frame, record) = bytes[start..].split_at_mut(FRAME);
    frame[..4].copy_from_slice(&(record.len() as u32).to_le_bytes());
    frame[4..].copy_from_slice(&crc32fast::hash(record).to_le_bytes());
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

struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(head)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|bytes| bytes[0])
    }

    fn whole(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    fn float(&mut self) -> Option<f64> {
        self.whole().map(f64::from_bits)
    }
}

/// Decodes an unframed record of [`encode`]; `None` if malformed.
fn decode(record: &[u8]) -> Option<PointOutcome> {
    let mut cursor = Cursor(record);
    let number = cursor.whole()?;
    let result = match cursor.byte()? {
        0 => {
            let count = usize::try_from(cursor.whole()?).ok()?;
            // Each value takes eight bytes, which bounds the count.
            if count > cursor.0.len() / 8 {
                return None;
            }
            Ok((0..count).map(|_| cursor.float()).collect::<Option<Vec<f64>>>()?)
        }
        _ => {
            let length = usize::try_from(cursor.whole()?).ok()?;
            Err(String::from_utf8(cursor.take(length)?.to_vec()).ok()?)
        }
    };
    let count = cursor.whole()?;
    let mut events = Vec::new();
    for _ in 0..count {
        let time = cursor.float()?;
        let kind = cursor.byte()? as i8;
        events.push(EventRow {
            time,
            kind: EventKind::ALL.into_iter().find(|known| known.code() == kind)?,
            mode_after: cursor.byte()? as i8,
            relative_velocity: cursor.float()?,
            internal_force: cursor.float()?,
        });
    }
    cursor.0.is_empty().then_some(PointOutcome { number, result, events })
}
