//! The second of two runs on a page, and the difference of the first from it.

use serde::Serialize;

use super::document::{self, Events, Modes};
use super::form::Form;
use super::sparse::Sparse;
use super::trajectory::Trajectory;
use crate::plot::PlotError;
use crate::record::sequence::{Alignment, SequenceEvent};
use crate::record::{CycleStatistics, Event};
use crate::results::{ResultError, ResultFile};

/// Before the name of a channel: that of the first run less that of the second.
pub(super) const DIFFERENCE: &str = "difference_of_";

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

/// Two runs.
#[derive(Debug)]
pub(super) struct Pair<'a> {
    pub(super) second: Second,
    /// Of the second run.
    pub(super) form: Form,
    file: &'a ResultFile,
    events: Vec<Event>,
    /// Channels of the first run that have a difference.
    pub(super) compared: Vec<String>,
}

impl<'a> Pair<'a> {
    /// The second run, `other`, beside the first.
    ///
    /// # Errors
    /// A file cannot be read.
    pub(super) fn of(file: &ResultFile, form: &Form, other: &'a ResultFile, mut own: Form) -> Result<Self, PlotError> {
        own.variables.retain(|variable| form.has(&variable.name));
        let (ours, theirs) = (file.events()?, other.events()?);
        let shown = document::shown(&theirs, &own)?;
        let mut notes = Vec::new();
        let first = document::shown(&ours, form)?;
        let pairs = paired(first, shown, own.natural_period());
        let second = Second {
            title: other.title().to_owned(),
            file: document::file_name(other),
            status: other.status().name(),
            breakaway_arm: own.breakaway_arm,
            torque_unit: own.torque_unit,
            modes: document::modes(other, &mut notes)?,
            events: document::events(other, &own, shown, theirs.len())?,
            sparse: own.sparse()?,
            pairs,
            trajectory: None,
        };
        let panels = form.panels.iter().filter(|panel| panel.shown && !panel.change);
        let shown = panels
            .flat_map(|panel| &panel.curves)
            .map(|curve| curve.channel.clone());
        let mut compared: Vec<String> = shown.filter(|name| own.has(name)).collect();
        compared.sort();
        compared.dedup();
        Ok(Pair {
            second,
            form: own,
            file: other,
            events: theirs,
            compared,
        })
    }

    /// A channel of `file` less that of the second run, at the samples of `file`, block by block; no number outside of the second
    /// run.
    ///
    /// # Errors
    /// A file cannot be read.
    pub(super) fn difference(
        &self,
        file: &ResultFile,
        name: &str,
    ) -> Result<impl Iterator<Item = Result<Vec<f64>, ResultError>>, PlotError> {
        let mut line = self.line(name)?;
        let blocks = file.column_blocks("time")?.zip(file.column_blocks(name)?);
        Ok(blocks.map(move |(times, values)| {
            let mut values = values?;
            for (time, value) in times?.into_iter().zip(&mut values) {
                *value -= line.at(time)?.0;
            }
            Ok(values)
        }))
    }

    /// How many samples of `file` are at a time at which the second run has one as well, in words.
    ///
    /// # Errors
    /// A file cannot be read.
    pub(super) fn note(&self, file: &ResultFile) -> Result<String, PlotError> {
        let mut line = self.line("time")?;
        let mut common = 0;
        for block in file.column_blocks("time")? {
            for time in block? {
                common += usize::from(line.at(time)?.1);
            }
        }
        let samples = file.sample_count()?;
        let words = "Differences are those of the first run less the second, at the samples of the first";
        Ok(if common == samples {
            format!("{words}; the second has a sample at each of these times.")
        } else {
            format!(
                "{words}. At {common} of {samples} of these times the second run has a sample as well; at the others its value \
                 is on the straight line between what it has on both sides, samples and states at events."
            )
        })
    }

    /// The curve of a channel of the second run.
    fn line(&self, name: &str) -> Result<Line<impl Iterator<Item = Block>>, PlotError> {
        let blocks = self.file.column_blocks("time")?.zip(self.file.column_blocks(name)?);
        let blocks = blocks.map(|(times, values)| Ok(times?.into_iter().zip(values?).collect()));
        let mut states = Vec::new();
        if let Some((before, after)) = self.form.sides(self.file, name)? {
            for ((event, before), after) in self.events.iter().zip(before).zip(after) {
                states.push((event.time, before, after));
            }
        }
        Ok(Line {
            blocks,
            block: Vec::new(),
            next: 0,
            left: None,
            states,
            state: 0,
            of_time: name == "time",
        })
    }
}

/// Times and values of consecutive samples.
type Block = Result<Vec<(f64, f64)>, ResultError>;

/// A curve that is followed in order of time.
struct Line<I> {
    blocks: I,
    block: Vec<(f64, f64)>,
    next: usize,
    /// The last sample before the time.
    left: Option<(f64, f64)>,
    /// Time, and the values before and after it, of each event.
    states: Vec<(f64, f64, f64)>,
    /// The first event that is not before the time.
    state: usize,
    of_time: bool,
}

impl<I: Iterator<Item = Block>> Line<I> {
    /// The next sample that has not been passed.
    fn peek(&mut self) -> Result<Option<(f64, f64)>, ResultError> {
        while self.next == self.block.len() {
            let Some(block) = self.blocks.next() else {
                return Ok(None);
            };
            self.block = block?;
            self.next = 0;
        }
        Ok(self.block.get(self.next).copied())
    }

    /// The value at a time that is not before the last one; and whether there is a sample.
    fn at(&mut self, time: f64) -> Result<(f64, bool), ResultError> {
        let right = loop {
            match self.peek()? {
                Some(sample) if sample.0 < time => {
                    self.left = Some(sample);
                    self.next += 1;
                }
                other => break other,
            }
        };
        if let Some((t, value)) = right
            && t == time
        {
            return Ok((value, true));
        }
        if self.of_time {
            return Ok((f64::NAN, false));
        }
        while self.states.get(self.state).is_some_and(|state| state.0 < time) {
            self.state += 1;
        }
        let before = self.state.checked_sub(1).and_then(|k| self.states.get(k));
        let left = match (self.left, before) {
            (Some(sample), Some(&(t, _, after))) if t >= sample.0 => Some((t, after)),
            (sample, _) => sample,
        };
        let right = match (right, self.states.get(self.state)) {
            (Some(sample), Some(&(t, before, _))) if t <= sample.0 => Some((t, before)),
            (sample, _) => sample,
        };
        Ok(match (left, right) {
            (Some((t0, v0)), Some((t1, v1))) if t1 > t0 => (v0 + (v1 - v0) * ((time - t0) / (t1 - t0)), false),
            _ => (f64::NAN, false),
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
    let mut statistics = CycleStatistics::default();
    let cycles = events
        .iter()
        .filter_map(|event| statistics.push(event.time, event.kind));
    cycles.last().map(|cycle| cycle.stick_duration + cycle.slip_duration)
}
