//! The second run on a page, and its difference from the first.

use std::iter::Peekable;
use std::rc::Rc;

use super::form::PageForm;
use crate::Error;
use crate::plot::run::Sides;
use crate::plot::thinning::Blocks;
use stickslip_files::{ResultError, ResultFile};
use stickslip_system::record::sequence::{Alignment, SequenceEvent};
use stickslip_system::record::{CycleStatistics, Event};

/// Prefix of the channels of differences (first minus second run).
pub(super) const DIFFERENCE: &str = "difference_of_";

#[derive(Debug)]
pub(super) struct PagePair<'a> {
    pub(super) form: PageForm,
    pub(super) file: &'a ResultFile,
    pub(super) events: Vec<Event>,
    pub(super) compared: Vec<String>,
}

impl<'a> PagePair<'a> {
    /// `form` belongs to the first run, `own` to the second, `other`.
    pub(super) fn of(form: &PageForm, other: &'a ResultFile, mut own: PageForm) -> Result<Self, Error> {
        own.variables.retain(|variable| form.has(&variable.name));
        own.sides.retain(|(name, _)| form.has(name));
        let panels = form.panels.iter().filter(|panel| panel.shown && !panel.change);
        let shown = panels.flat_map(|panel| &panel.curves).map(|curve| curve.name.clone());
        let mut compared: Vec<String> = shown.filter(|name| own.has(name)).collect();
        compared.sort();
        compared.dedup();
        Ok(PagePair {
            form: own,
            file: other,
            events: other.events()?,
            compared,
        })
    }

    /// A channel of `file` minus the second run's at the same times, block by block; NaN outside the second run.
    pub(super) fn difference<'b>(&'b self, file: &'b ResultFile, name: &'b str) -> Result<Blocks<'b>, Error> {
        let mut line = self.line(name)?;
        let blocks = file.column_blocks("time")?.zip(file.column_blocks(name)?);
        Ok(Box::new(blocks.map(move |(times, values)| {
            let mut values = values?;
            for (time, value) in times?.into_iter().zip(&mut values) {
                *value -= line.at(time)?.0;
            }
            Ok(values)
        })))
    }

    /// Number of samples of `file` at times of samples of the second run, in words.
    pub(super) fn note(&self, file: &ResultFile) -> Result<String, Error> {
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

    fn line(&self, name: &str) -> Result<Line<'_, impl Iterator<Item = PageSample>>, Error> {
        let blocks = self.file.column_blocks("time")?.zip(self.file.column_blocks(name)?);
        let samples = blocks.flat_map(|(times, values)| {
            let both = times.and_then(|times| Ok(times.into_iter().zip(values?)));
            let (samples, error) = both.map_or_else(|error| (None, Some(Err(error))), |both| (Some(both), None));
            samples.into_iter().flatten().map(Ok).chain(error)
        });
        let sides = self.form.sides.iter().find(|sides| sides.0 == name);
        Ok(Line {
            samples: samples.peekable(),
            left: None,
            events: &self.events,
            sides: sides.map(|sides| sides.1.clone()),
        })
    }
}

type PageSample = Result<(f64, f64), ResultError>;

/// A curve, evaluated in order of time.
struct Line<'a, I: Iterator> {
    samples: Peekable<I>,
    left: Option<(f64, f64)>,
    events: &'a [Event],
    sides: Option<Rc<Sides>>,
}

impl<I: Iterator<Item = PageSample>> Line<'_, I> {
    /// The value at a time not before the previous one, and whether a sample is there.
    fn at(&mut self, time: f64) -> Result<(f64, bool), ResultError> {
        let is_passed = |sample: &PageSample| sample.as_ref().map_or(true, |sample| sample.0 < time);
        while let Some(sample) = self.samples.next_if(is_passed) {
            self.left = Some(sample?);
        }
        let mut left = self.left;
        let mut right = self.samples.peek().and_then(|sample| sample.as_ref().ok().copied());
        if let Some((_, value)) = right.filter(|sample| sample.0 == time) {
            return Ok((value, true));
        }
        if let Some(sides) = &self.sides {
            let next = self.events.partition_point(|event| event.time < time);
            if let Some(event) = next.checked_sub(1).map(|before| &self.events[before]) {
                left = left.map(|sample| match event.time >= sample.0 {
                    true => (event.time, sides.after[next - 1]),
                    false => sample,
                });
            }
            if let Some(event) = self.events.get(next) {
                right = right.map(|sample| match event.time <= sample.0 {
                    true => (event.time, sides.before[next]),
                    false => sample,
                });
            }
        }
        Ok(match (left, right) {
            (Some((t0, v0)), Some((t1, v1))) if t1 > t0 => (v0 + (v1 - v0) * ((time - t0) / (t1 - t0)), false),
            _ => (f64::NAN, false),
        })
    }
}

/// Indices of matching events of two runs: contact events by alignment, other events by their number within a kind.
pub(super) fn paired(ours: &[Event], theirs: &[Event], natural_period: Option<f64>) -> Vec<(usize, usize)> {
    // Contact events with their indices.
    let contact = |events: &[Event]| -> (Vec<usize>, Vec<SequenceEvent>) {
        let events = events.iter().enumerate();
        let events = events.filter(|(_, event)| event.kind.in_event_sequence());
        events
            .map(|(k, &Event { time, kind, .. })| (k, SequenceEvent { time, kind }))
            .unzip()
    };
    let ((first, ours_word), (second, theirs_word)) = (contact(ours), contact(theirs));
    let last_cycle = || {
        let events = ours.iter().map(|event| (event.time, event.kind));
        CycleStatistics::of_events(events).0.last_period()
    };
    let period = natural_period.or_else(last_cycle).unwrap_or(1.0);
    let by_time = Alignment::of(&ours_word, &theirs_word, period);
    let alignment = Alignment::drifting(&ours_word, &theirs_word, period, by_time);
    let mut pairs: Vec<(usize, usize)> = alignment.matched().map(|(k, m)| (first[k], second[m])).collect();
    let others = |events: &[Event]| -> Vec<usize> {
        let all = 0..events.len();
        all.filter(|&k| !events[k].kind.in_event_sequence()).collect()
    };
    let mut free = others(theirs);
    for k in others(ours) {
        if let Some(at) = free.iter().position(|&other| theirs[other].kind == ours[k].kind) {
            pairs.push((k, free.remove(at)));
        }
    }
    pairs.sort_unstable();
    pairs
}
