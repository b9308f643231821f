//! The messages between ranks.

use crate::case::Setting;
use crate::sweep::record::Cursor;
use crate::sweep::study::Point;
use mpi::Tag;
use mpi::point_to_point::{Message, Status};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, MatchedReceiveVec, Source};

/// Messages to a rank: begin, a point, stop what is under way, leave.
pub(super) const BEGIN: Tag = 1;
pub(super) const POINT: Tag = 2;
pub(super) const STOP: Tag = 3;
pub(super) const LEAVE: Tag = 4;
/// Messages from a rank: outcomes, its points were abandoned, an error, it has left.
pub(super) const OUTCOMES: Tag = 11;
pub(super) const STOPPED: Tag = 12;
pub(super) const FAILED: Tag = 13;
pub(super) const LEFT: Tag = 14;

/// The next message, if there is one.
pub(super) fn next_message(world: &SimpleCommunicator) -> Option<(Vec<u8>, Status)> {
    let found: Option<(Message, Status)> = world.any_process().immediate_matched_probe();
    found.map(MatchedReceiveVec::matched_receive_vec::<u8>)
}

/// A point as a message: its number, then each value with its kind.
pub(super) fn write_point(point: &Point) -> Vec<u8> {
    let mut bytes = point.number.to_le_bytes().to_vec();
    for setting in &point.coordinates {
        let (kind, value) = match setting {
            Setting::Number(number) => (0, number.to_bits()),
            Setting::Count(count) => (1, *count as u64),
            Setting::Flag(flag) => (2, u64::from(*flag)),
            Setting::Text(text) => (3, text.len() as u64),
        };
        bytes.push(kind);
        bytes.extend_from_slice(&value.to_le_bytes());
        if let Setting::Text(text) = setting {
            bytes.extend_from_slice(text.as_bytes());
        }
    }
    bytes
}

/// What [`write_point`] wrote; `None` for anything else.
pub(super) fn read_point(bytes: &[u8]) -> Option<Point> {
    let mut cursor = Cursor(bytes);
    let number = cursor.whole()?;
    let mut coordinates = Vec::new();
    while !cursor.0.is_empty() {
        let (kind, value) = (cursor.byte()?, cursor.whole()?);
        coordinates.push(match kind {
            0 => Setting::Number(f64::from_bits(value)),
            1 => Setting::Count(usize::try_from(value).ok()?),
            2 => Setting::Flag(value != 0),
            3 => {
                let text = cursor.take(usize::try_from(value).ok()?)?;
                Setting::Text(String::from_utf8(text.to_vec()).ok()?)
            }
            _ => return None,
        });
    }
    Some(Point { number, coordinates })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn setting() -> impl Strategy<Value = Setting> {
        prop_oneof![
            any::<f64>().prop_map(Setting::Number),
            any::<usize>().prop_map(Setting::Count),
            any::<bool>().prop_map(Setting::Flag),
            ".*".prop_map(Setting::Text),
        ]
    }

    proptest! {
        /// To the last bit: a rank must run the very point that rank 0 would have run.
        #[test]
        fn property_a_point_survives_its_message(number: u64, coordinates in proptest::collection::vec(setting(), 0..5)) {
            let point = Point { number, coordinates };
            let bytes = write_point(&point);
            prop_assert_eq!(write_point(&read_point(&bytes).unwrap()), bytes.clone());
            prop_assert_eq!(format!("{:?}", read_point(&bytes).unwrap()), format!("{point:?}"));
            prop_assert!(read_point(&bytes[..bytes.len() - 1]).is_none_or(|cut| cut.coordinates.len() < 5));
        }
    }
}
