//! The record of an outcome, in a journal and between the processes of a pool.

use super::quantities::{EventRow, Outcome};
use crate::record::EventKind;

/// Length and checksum before each record.
pub(super) const FRAME: usize = 8;

/// The record itself, if its checksum is that of the frame.
pub(super) fn checked<'a>(frame: &[u8; FRAME], record: &'a [u8]) -> Option<&'a [u8]> {
    let sum = u32::from_le_bytes([frame[4], frame[5], frame[6], frame[7]]);
    (crc32fast::hash(record) == sum).then_some(record)
}

/// Appends a record with its frame: the number; how many values and the values, or the length and text of an error; the
/// events.
pub(super) fn encode(outcome: &Outcome, bytes: &mut Vec<u8>) {
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

/// Outcomes as the bytes of a message between processes of a pool: the records of a journal.
#[cfg(feature = "mpi")]
pub(super) fn to_message(outcomes: &[Outcome]) -> Vec<u8> {
    let mut bytes = Vec::new();
    outcomes.iter().for_each(|outcome| encode(outcome, &mut bytes));
    bytes
}

/// What [`to_message`] made; `None` for anything else.
#[cfg(feature = "mpi")]
pub(super) fn from_message(bytes: &[u8]) -> Option<Vec<Outcome>> {
    let mut cursor = Cursor(bytes);
    let mut outcomes = Vec::new();
    while !cursor.0.is_empty() {
        let frame: &[u8; FRAME] = cursor.take(FRAME)?.try_into().ok()?;
        let length = u32::from_le_bytes([frame[0], frame[1], frame[2], frame[3]]);
        let record = cursor.take(length as usize)?;
        outcomes.push(checked(frame, record).and_then(decode)?);
    }
    Some(outcomes)
}

/// Takes a record apart from its front.
pub(super) struct Cursor<'a>(pub(super) &'a [u8]);

impl<'a> Cursor<'a> {
    pub(super) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(head)
    }

    pub(super) fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|bytes| bytes[0])
    }

    pub(super) fn whole(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.take(8)?.try_into().ok()?))
    }

    pub(super) fn float(&mut self) -> Option<f64> {
        self.whole().map(f64::from_bits)
    }
}

/// What [`encode`] wrote, without its frame; `None` for anything else.
pub(super) fn decode(record: &[u8]) -> Option<Outcome> {
    let mut cursor = Cursor(record);
    let number = cursor.whole()?;
    let result = match cursor.byte()? {
        0 => {
            let count = usize::try_from(cursor.whole()?).ok()?;
            // Each takes eight bytes of what is there.
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
    cursor.0.is_empty().then_some(Outcome { number, result, events })
}
