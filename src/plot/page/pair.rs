//! The difference of the first of two runs on a page from the second.

use super::form::Form;
use crate::plot::PlotError;
use crate::record::Event;
use crate::results::{ResultError, ResultFile};

/// Before the name of a channel: that of the first run less that of the second.
pub(super) const DIFFERENCE: &str = "difference_of_";

/// Two runs.
#[derive(Debug)]
pub(super) struct Pair<'a> {
    /// Of the second run.
    pub(super) form: Form,
    pub(super) file: &'a ResultFile,
    pub(super) events: Vec<Event>,
    /// Channels of the first run that have a difference.
    pub(super) compared: Vec<String>,
}

impl<'a> Pair<'a> {
    /// The second run, `other`, beside the first, which has this form.
    ///
    /// # Errors
    /// A file cannot be read.
    pub(super) fn of(form: &Form, other: &'a ResultFile, mut own: Form) -> Result<Self, PlotError> {
        own.variables.retain(|variable| form.has(&variable.name));
        let panels = form.panels.iter().filter(|panel| panel.shown && !panel.change);
        let shown = panels
            .flat_map(|panel| &panel.curves)
            .map(|curve| curve.channel.clone());
        let mut compared: Vec<String> = shown.filter(|name| own.has(name)).collect();
        compared.sort();
        compared.dedup();
        Ok(Pair {
            form: own,
            file: other,
            events: other.events()?,
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
