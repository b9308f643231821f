//! Event tables of candidates.

use super::super::resolution::Rounding;
use super::super::{CompareError, Found};
use super::csv::CsvTable;
use super::mapping::{MappedColumn, Mapping, known_kind};
use super::table::{CandidateSource, CandidateTable, place, unread};
use super::{hdf5_or_npz, only, unit_factor};
use std::path::Path;
use stickslip_case::quantity::Dimension;
use stickslip_system::record::{Event, EventKind};

const TIMES: [&str; 4] = ["events/time", "event_time", "time", "t"];
const KINDS: [&str; 4] = ["events/kind", "event_kind", "kind", "event"];

/// Time of the last event of a result file (s); negative infinity without events. Fails if a time is not finite or
/// precedes the event before it.
pub(in super::super) fn last_in_order(path: &Path, events: &[Event]) -> Result<f64, CompareError> {
    let mut last = f64::NEG_INFINITY;
    for (row, event) in events.iter().enumerate() {
        if !event.time.is_finite() || event.time < last {
            let what = format!("the time {:?} s comes after {last:?} s", event.time);
            let (place, remedy) = (
                format!("row {row} of /events/time"),
                "the file was changed since it was written: repeat the run",
            );
            return Err(CompareError::content(path, place, what, remedy));
        }
        last = event.time;
    }
    Ok(last)
}

/// Events of a result file, with T_f before them; `radius` is r, m.
pub(super) fn own(path: &Path, events: &[Event], radius: f64) -> Result<Vec<Found>, CompareError> {
    last_in_order(path, events)?;
    let events = events.iter().filter(|event| event.kind.in_event_sequence());
    Ok(events
        .map(|event| {
            let torque = event.internal_force * radius;
            Found {
                torques: Some((torque, torque)),
                dropped: Some(event.before.relative_velocity.abs()),
                ..Found::new(event.time, event.kind)
            }
        })
        .collect())
}

pub(super) type Read = (Vec<Found>, Option<Rounding>);

/// The events of another program's file, next to its channels or in a separate file; `None` if there are none.
pub(super) fn find(table: &dyn CandidateTable, mapping: &Mapping, alone: bool) -> Result<Option<Read>, CompareError> {
    if let Some(path) = &mapping.event_file {
        let table = open(path)?;
        return read(&*table, mapping, true).map(Some);
    }
    let named = mapping.event_time.is_some() || mapping.event_kind.is_some();
    // Next to channels, a column "time" holds the times of the samples.
    let grouped = table.has(TIMES[0]) && table.has_texts(KINDS[0]) || table.has(TIMES[1]) && table.has_texts(KINDS[1]);
    if named || grouped || (alone && KINDS.iter().any(|name| table.has_texts(name))) {
        read(table, mapping, alone).map(Some)
    } else {
        Ok(None)
    }
}

fn open(path: &Path) -> Result<Box<dyn CandidateTable>, CompareError> {
    let source = CandidateSource::open(path)?;
    match hdf5_or_npz(&source, &source.head(8)?)? {
        Some((_, table)) => Ok(table),
        None => Ok(Box::new(CsvTable::open(source)?)),
    }
}

fn read(table: &dyn CandidateTable, mapping: &Mapping, alone: bool) -> Result<Read, CompareError> {
    let path = table.path();
    let choices = if alone { 4 } else { 2 };
    let mapped = |column: &Option<MappedColumn>| column.as_ref().map(|column| column.name.clone());
    let lacks = |what: &str| {
        let remedy = format!("name it with --column events.{what}=NAME or in a mapping");
        CompareError::whole(path, format!("has no column with the {what}s of events"), remedy)
    };
    let mut time = mapped(&mapping.event_time);
    for names in [&TIMES[..2], &TIMES[2..choices]] {
        if time.is_none() {
            time = only(table, "events.time", names, &|_| false)?;
        }
    }
    let unread = || TIMES.iter().find_map(|name| unread(table, name));
    let time = time.ok_or_else(|| unread().map_or_else(|| lacks("time"), |left_out| left_out.error(path)))?;
    let kinds = || KINDS[..choices].iter().find(|name| table.has_texts(name));
    let kind = mapped(&mapping.event_kind).or_else(|| kinds().map(|name| (*name).to_owned()));
    let kind = kind.ok_or_else(|| lacks("kind"))?;
    let of_samples = mapping.time.as_ref().filter(|_| alone);
    let factor = unit_factor(
        table,
        &time,
        mapping.event_time.as_ref().or(of_samples),
        Dimension::Time,
    )?;
    let mut rounding = table.roundings(std::slice::from_ref(&time))?.pop().flatten();
    let mut times = Vec::new();
    let mut pass = table.pass(std::slice::from_ref(&time))?;
    let mut block = [Vec::new()];
    loop {
        pass(&mut block)?;
        if block[0].is_empty() {
            break;
        }
        times.extend_from_slice(&block[0]);
    }
    if rounding.is_none() && times.len() > 1 {
        rounding = Some(Rounding::Single).filter(|single| single.hold(&times));
    }
    let kinds = table.texts(&kind)?;
    if kinds.len() != times.len() {
        let what = format!("there are {} times, but {} kinds", times.len(), kinds.len());
        return Err(CompareError::whole(path, what, "each event has a time and a kind"));
    }
    let mut events = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for (row, (raw, text)) in times.iter().zip(&kinds).enumerate() {
        let at = raw * factor;
        let fault = |column: &str, what: String, remedy: &str| {
            Err(CompareError::content(path, place(row as u64, column), what, remedy))
        };
        if !at.is_finite() {
            return fault(&time, format!("{at} is not a finite number"), "leave out the row");
        }
        if at < last {
            let what = format!("the time {at:?} s comes after {last:?} s");
            return fault(&time, what, "sort the events by time");
        }
        last = at;
        match kind_of(text, mapping) {
            Ok(kind) if kind.in_event_sequence() => events.push(Found::new(at, kind)),
            Ok(_) => {}
            Err(what) => {
                let remedy = "say in [events.kinds] of a mapping what the candidate calls them";
                return fault(&kind, what, remedy);
            }
        }
    }
    Ok((events, rounding))
}

fn kind_of(text: &str, mapping: &Mapping) -> Result<EventKind, String> {
    let text = text.trim();
    if let Some((_, kind)) = mapping.kinds.iter().find(|(theirs, _)| theirs == text) {
        return Ok(*kind);
    }
    let of_code = |code| EventKind::ALL.into_iter().find(|kind| f64::from(kind.code()) == code);
    let known = text.parse::<f64>().ok().and_then(of_code);
    known.map_or_else(|| known_kind(text), Ok)
}
