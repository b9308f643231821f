//! Event sequences as a candidate without a normal force shows them: by its relative velocity alone.

use super::detect::Found;
use stickslip_system::model::Mode;
use stickslip_system::record::sequence::SequenceEvent;
use stickslip_system::record::{Event, EventKind};

fn separates_from_stick(event: &Event) -> bool {
    event.kind == EventKind::Separation && event.before.relative_velocity == 0.0
}

fn closes_into_stick(event: &Event) -> bool {
    event.kind == EventKind::Contact && event.mode_after == Mode::Stick
}

/// The event sequence of a run. Without the normal force a separation from stick is the beginning of a slip, and a
/// contact that begins with a stick is that stick; every other separation and contact is invisible.
pub(super) fn sequence(events: &[Event], shows_contact: bool) -> Vec<SequenceEvent> {
    let all = events.iter().filter(|event| event.kind.in_event_sequence());
    let seen = all.filter_map(|event| {
        let kind = match event.kind {
            EventKind::Separation | EventKind::Contact if shows_contact => event.kind,
            _ if separates_from_stick(event) => EventKind::Slip,
            _ if closes_into_stick(event) => EventKind::Stick,
            EventKind::Separation | EventKind::Contact => return None,
            kind => kind,
        };
        Some(SequenceEvent { time: event.time, kind })
    });
    seen.collect()
}

/// A candidate's events without those of a relative velocity that passes zero while the reference's contact is open. A
/// slip that begins with the separation and a stick that begins with the contact stay.
pub(super) fn without_open_contact(found: &[Found], events: &[Event]) -> Vec<Found> {
    let is_change = |event: &&Event| matches!(event.kind, EventKind::Separation | EventKind::Contact);
    let changes: Vec<&Event> = events.iter().filter(is_change).collect();
    let stays = |(row, event): &(usize, &Found)| {
        let next = changes.partition_point(|change| change.time <= event.time);
        let (opens, closes) = (next.checked_sub(1).map(|k| changes[k]), changes.get(next));
        let is_open = match opens {
            Some(change) => change.kind == EventKind::Separation,
            None => closes.is_some_and(|change| change.kind == EventKind::Contact),
        };
        let is_first = |opens: &Event| row.checked_sub(1).is_none_or(|k| found[k].time <= opens.time);
        let is_last = |closes: &&Event| found.get(row + 1).is_none_or(|next| next.time >= closes.time);
        match event.kind {
            _ if !is_open => true,
            EventKind::Slip => opens.is_some_and(|opens| separates_from_stick(opens) && is_first(opens)),
            EventKind::Stick => closes.is_some_and(|closes| closes_into_stick(closes) && is_last(closes)),
            _ => false,
        }
    };
    found
        .iter()
        .enumerate()
        .filter(stays)
        .map(|(_, event)| *event)
        .collect()
}
