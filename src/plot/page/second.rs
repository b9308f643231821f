//! What a page has of the second of two runs.

use serde::Serialize;

use super::document::{self, Events, Modes};
use super::form::Form;
use super::pair::Pair;
use super::sparse::Sparse;
use super::trajectory::Trajectory;
use crate::plot::PlotError;
use crate::record::sequence::{Alignment, SequenceEvent};
use crate::record::{CycleStatistics, Event};
use crate::results::ResultFile;

/// What a page needs of the second run.
#[derive(Debug, Serialize)]
pub(super) struct Second {
    title: String,
    file: String,
    status: &'static str,
    breakaway_arm: Option<f64>,
    torque_unit: &'static str,
    modes: Modes,
    events: Events,
    sparse: Sparse,
    /// Indices of events that stand for each other, in the first and in the second run.
    pairs: Vec<(usize, usize)>,
    pub(super) trajectory: Option<Trajectory>,
}

impl Second {
    /// Of two runs of which the first, `file`, has this form; without its trajectory.
    ///
    /// # Errors
    /// A file cannot be read.
    pub(super) fn of(file: &ResultFile, form: &Form, pair: &Pair) -> Result<Second, PlotError> {
        let (own, other) = (&pair.form, pair.file);
        let ours = file.events()?;
        let shown = document::shown(&pair.events, own)?;
        let first = document::shown(&ours, form)?;
        let mut notes = Vec::new();
        Ok(Second {
            title: other.title().to_owned(),
            file: document::file_name(other),
            status: other.status().name(),
            breakaway_arm: own.breakaway_arm,
            torque_unit: own.torque_unit,
            modes: document::modes(other, &mut notes)?,
            events: document::events(other, own, shown, pair.events.len())?,
            sparse: own.sparse()?,
            pairs: paired(first, shown, own.natural_period()),
            trajectory: None,
        })
    }
}

/// Events of the contact by their alignment, and of each other kind the first by the first, the second by the second.
fn paired(ours: &[Event], theirs: &[Event], natural_period: Option<f64>) -> Vec<(usize, usize)> {
    let contact = |events: &[Event]| -> Vec<usize> {
        let all = events.iter().enumerate();
        all.filter(|(_, event)| event.kind.in_event_sequence())
            .map(|(k, _)| k)
            .collect()
    };
    let (first, second) = (contact(ours), contact(theirs));
    let word = |events: &[Event], indices: &[usize]| -> Vec<SequenceEvent> {
        let of = |&k: &usize| SequenceEvent {
            time: events[k].time,
            kind: events[k].kind,
        };
        indices.iter().map(of).collect()
    };
    let (ours_word, theirs_word) = (word(ours, &first), word(theirs, &second));
    let period = natural_period.or_else(|| cycle(ours)).unwrap_or(1.0);
    let by_time = Alignment::of(&ours_word, &theirs_word, period);
    let alignment = Alignment::drifting(&ours_word, &theirs_word, period, by_time);
    let mut pairs: Vec<(usize, usize)> = alignment.matched().map(|(k, m)| (first[k], second[m])).collect();
    let others = |events: &'_ [Event]| -> Vec<(usize, crate::record::EventKind)> {
        let all = events.iter().enumerate();
        all.filter(|(_, event)| !event.kind.in_event_sequence())
            .map(|(k, event)| (k, event.kind))
            .collect()
    };
    let mut free = others(theirs);
    for (k, kind) in others(ours) {
        if let Some(at) = free.iter().position(|other| other.1 == kind) {
            pairs.push((k, free.remove(at).0));
        }
    }
    pairs.sort_unstable();
    pairs
}

/// The length of the last cycle, s.
fn cycle(events: &[Event]) -> Option<f64> {
    let (statistics, _) = CycleStatistics::of_events(events.iter().map(|event| (event.time, event.kind)));
    statistics.last_period()
}
