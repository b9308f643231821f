//! Errors that depend on no threshold: position, period, rest positions and creep in stick.
//!
//! Both runs are taken at the candidate's times, and no event of the candidate is looked for. The sticks are those of the reference.

use super::candidate::Block;
use super::{Channel, CompareError, Evaluator, Reference, Span};
use crate::record::EventKind;
use serde::Serialize;
use std::borrow::Cow;

/// Errors at the same times, without a threshold, from ten natural periods before the reference's first event to its last one, as
/// far as the candidate has samples. A candidate that has the reference's values at its times has none but rounding.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// The first sample, s.
    pub from: f64,
    /// The last sample, s.
    pub to: f64,
    /// Samples that were taken: of more than 131,072 each second one, each fourth one, ...
    pub samples: usize,
    /// Of the position; `None` if the candidate does not have it.
    pub position: Option<PositionScore>,
    /// Of the period; `None` of less than one cycle.
    pub period: Option<PeriodScore>,
    /// Of the positions in the middle of the sticks; `None` without one, or without a position.
    pub rest: Option<RestScore>,
    /// Of the relative velocity in the sticks; `None` without one.
    pub creep: Option<CreepScore>,
}

/// The error of the position of the surface next to the contact.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PositionScore {
    /// The channel.
    pub channel: Cow<'static, str>,
    /// Its SI unit.
    pub unit: &'static str,
    /// Root mean square of the error over time, in `unit`.
    pub rms: f64,
    /// Root mean square of the reference about its mean over time, in `unit`.
    pub size: f64,
    /// `rms` / `size`.
    pub relative: f64,
}

/// Mean time between two upward crossings of one level in both runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PeriodScore {
    /// What crosses: the position, or without it the relative velocity.
    pub channel: Cow<'static, str>,
    /// The level, in the channel's SI unit: the reference's mean over time, of the relative velocity half of its size more.
    pub level: f64,
    /// Periods in reference and candidate.
    pub cycles: [usize; 2],
    /// Of the reference, s.
    pub reference: f64,
    /// Of the candidate, s.
    pub candidate: f64,
    /// Candidate minus reference, s.
    pub error: f64,
    /// |`error`| / `reference`.
    pub relative: f64,
}

/// The error of the position in the middle of each stick of the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestScore {
    /// The channel.
    pub channel: Cow<'static, str>,
    /// Its SI unit.
    pub unit: &'static str,
    /// Sticks of the reference whose middle lies between two samples in it.
    pub sticks: usize,
    /// Root mean square of the errors, in `unit`.
    pub rms: f64,
    /// Largest absolute error, in `unit`.
    pub max: f64,
    /// Its time, s.
    pub max_at: f64,
    /// `rms` in parts of the size of the position.
    pub relative: f64,
}

/// The relative velocity in the middle halves of the reference's sticks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CreepScore {
    /// "rad/s", or "m/s" in translation.
    pub unit: &'static str,
    /// Sticks with two samples or more there.
    pub sticks: usize,
    /// Root mean square of the candidate's over time, in `unit`.
    pub candidate: f64,
    /// The same of the reference, which is zero of a contact with stick.
    pub reference: f64,
    /// Root mean square of the difference, in `unit`.
    pub rms: f64,
    /// Root mean square of the reference's relative velocity over all of the time, in `unit`.
    pub size: f64,
    /// `rms` / `size`.
    pub relative: f64,
}

/// Samples that are kept.
const MOST_SAMPLES: usize = 1 << 17;

/// Part of the size by which a crossing has to be approached: less is noise on the same crossing.
const APPROACH: f64 = 0.25;

/// One channel of both runs: candidate and reference, at each time.
#[derive(Debug)]
struct Signal {
    channel: Channel,
    /// In the blocks.
    column: usize,
    values: Vec<[f64; 2]>,
}

/// Collects both runs at the candidate's times.
#[derive(Debug)]
pub(super) struct ScorePass<'a> {
    reference: Evaluator<'a>,
    window: (f64, f64),
    position: Option<Signal>,
    velocity: Option<Signal>,
    time: Vec<f64>,
    /// Each so many samples one is taken; and how many were seen.
    stride: usize,
    seen: usize,
}

impl Reference {
    /// A pass over blocks with these channels; `None` without a position and a relative velocity.
    ///
    /// # Errors
    /// Of the file.
    pub(super) fn score_pass(&self, channels: &[Channel]) -> Result<Option<ScorePass<'_>>, CompareError> {
        let signal = |channel: Channel| {
            let column = channels.iter().position(|known| *known == channel)?;
            Some(Signal {
                channel,
                column,
                values: Vec::new(),
            })
        };
        let positions = self.physics.position().into_iter().chain([Channel::RotorTwist]);
        let position = positions.into_iter().find_map(signal);
        let velocity = signal(Channel::RelativeVelocity);
        let of: Vec<Channel> = [&position, &velocity]
            .into_iter()
            .flatten()
            .map(|s| s.channel)
            .collect();
        if of.is_empty() {
            return Ok(None);
        }
        Ok(Some(ScorePass {
            reference: self.evaluator(&of)?,
            window: self.stretch(),
            position,
            velocity,
            time: Vec::new(),
            stride: 1,
            seen: 0,
        }))
    }

    /// Where the reference sticks, s. `span` is the candidate's.
    fn sticks(&self, span: Span) -> Vec<(f64, f64)> {
        let ends = self.word.windows(2).map(|pair| (pair[0], pair[1].time));
        let sticks = ends.filter(|(event, _)| event.kind == EventKind::Stick);
        let first = self.word.first().filter(|event| event.kind == EventKind::Slip);
        let first = first
            .filter(|_| !self.starts_in_slip)
            .map(|event| (self.start, event.time));
        let all = first.into_iter().chain(sticks.map(|(event, end)| (event.time, end)));
        all.filter(|&(from, to)| to > span.from && from < span.to).collect()
    }

    /// The outcome of a pass over a candidate that covers `span`; `None` of fewer than two samples.
    pub(super) fn score(&self, pass: &ScorePass<'_>, span: Span) -> Option<Score> {
        let unit = |channel: Channel| self.physics.vocabulary().unit(channel);
        let (time, sticks) = (&pass.time, self.sticks(span));
        let (&from, &to) = (time.first()?, time.last()?);
        if to <= from {
            return None;
        }
        let position = pass.position.as_ref().map(|signal| {
            let (size, rms) = (size(time, &signal.values).1, rms(time, &signal.values, difference));
            PositionScore {
                channel: signal.channel.name(),
                unit: unit(signal.channel),
                rms,
                size,
                relative: part(rms, size),
            }
        });
        let rest = pass.position.as_ref().zip(position.as_ref());
        let rest = rest.and_then(|(signal, position)| {
            let middles = sticks.iter().filter_map(|&(from, to)| {
                let middle = 0.5 * (from + to);
                let after = time.partition_point(|t| *t < middle);
                let before = after.checked_sub(1)?;
                let (a, b) = (time[before], *time.get(after)?);
                let [x, y] = [before, after].map(|k| difference(signal.values[k]));
                let error = x + (y - x) * (middle - a) / (b - a);
                (a >= from && b <= to).then_some((middle, error))
            });
            let middles: Vec<(f64, f64)> = middles.collect();
            let worst = middles.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
            let scale = if worst.1 == 0.0 { 1.0 } else { worst.1.abs() };
            let squares: f64 = middles.iter().map(|(_, error)| (error / scale).powi(2)).sum();
            let rms = scale * (squares / middles.len() as f64).sqrt();
            Some(RestScore {
                channel: position.channel.clone(),
                unit: position.unit,
                sticks: middles.len(),
                rms,
                max: worst.1.abs(),
                max_at: worst.0,
                relative: part(rms, position.size),
            })
        });
        Some(Score {
            from,
            to,
            samples: time.len(),
            position,
            period: pass
                .position
                .as_ref()
                .or(pass.velocity.as_ref())
                .and_then(|s| period(time, s)),
            rest,
            creep: pass.velocity.as_ref().and_then(|signal| {
                let (mut seconds, mut squares, mut seen) = (0.0, [0.0; 3], 0);
                let scales = OF_CREEP.map(|of| largest(&signal.values, of));
                for (from, to) in sticks {
                    let quarter = 0.25 * (to - from);
                    let first = time.partition_point(|t| *t < from + quarter);
                    let end = time.partition_point(|t| *t <= to - quarter);
                    if end <= first + 1 {
                        continue;
                    }
                    seen += 1;
                    seconds += time[end - 1] - time[first];
                    let (time, values) = (&time[first..end], &signal.values[first..end]);
                    for (sum, (of, scale)) in squares.iter_mut().zip(OF_CREEP.into_iter().zip(scales)) {
                        *sum += integral(time, |k| (of(values[k]) / scale).powi(2));
                    }
                }
                let each = |k: usize| scales[k] * (squares[k] / seconds).sqrt();
                let [candidate, reference, rms_of] = [0, 1, 2].map(each);
                let size = rms(time, &signal.values, |v| v[1]);
                (seconds > 0.0).then(|| CreepScore {
                    unit: unit(signal.channel),
                    sticks: seen,
                    candidate,
                    reference,
                    rms: rms_of,
                    size,
                    relative: part(rms_of, size),
                })
            }),
        })
    }
}

impl ScorePass<'_> {
    /// Takes the next samples.
    ///
    /// # Errors
    /// Of the reference's file.
    pub fn add(&mut self, block: &Block) -> Result<(), CompareError> {
        let first = block.time.partition_point(|t| *t < self.window.0);
        let end = block.time.partition_point(|t| *t <= self.window.1);
        let mut values = [0.0; 2];
        for row in first..end.max(first) {
            self.seen += 1;
            if !(self.seen - 1).is_multiple_of(self.stride) {
                continue;
            }
            let time = block.time[row];
            // The evaluator writes as many values as there are signals.
            if !self.reference.known_at(time, &mut values)? {
                continue;
            }
            let signals = [&mut self.position, &mut self.velocity].into_iter().flatten();
            for (signal, &value) in signals.zip(&values) {
                signal.values.push([block.columns[signal.column][row], value]);
            }
            self.time.push(time);
            if self.time.len() == MOST_SAMPLES {
                self.thin();
            }
        }
        Ok(())
    }

    /// Keeps each second sample.
    fn thin(&mut self) {
        self.stride *= 2;
        self.time = self.time.iter().step_by(2).copied().collect();
        for signal in [&mut self.position, &mut self.velocity].into_iter().flatten() {
            signal.values = signal.values.iter().step_by(2).copied().collect();
        }
    }
}

fn difference([candidate, reference]: [f64; 2]) -> f64 {
    candidate - reference
}

/// The relative velocities whose root mean squares are the creep: of the candidate, of the reference, and their difference.
const OF_CREEP: [fn([f64; 2]) -> f64; 3] = [|[candidate, _]| candidate, |[_, reference]| reference, difference];

/// A part of a size; an error of what has no size is none of it.
fn part(error: f64, size: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / size }
}

/// By the trapezoidal rule.
fn integral(time: &[f64], value: impl Fn(usize) -> f64) -> f64 {
    let each = (1..time.len()).map(|k| 0.5 * (time[k] - time[k - 1]) * (value(k - 1) + value(k)));
    each.sum()
}

/// The largest magnitude, by which values are divided whose squares may be beyond the largest number; 1 if all are zero.
fn largest(values: &[[f64; 2]], of: impl Fn([f64; 2]) -> f64) -> f64 {
    let largest = values.iter().map(|&value| of(value).abs()).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

fn rms(time: &[f64], values: &[[f64; 2]], of: impl Fn([f64; 2]) -> f64) -> f64 {
    let span = time[time.len() - 1] - time[0];
    let scale = largest(values, &of);
    scale * (integral(time, |k| (of(values[k]) / scale).powi(2)) / span).sqrt()
}

/// Mean of the reference over time, and its root mean square about that.
fn size(time: &[f64], values: &[[f64; 2]]) -> (f64, f64) {
    let mean = integral(time, |k| values[k][1]) / (time[time.len() - 1] - time[0]);
    (mean, rms(time, values, |v| v[1] - mean))
}

fn period(time: &[f64], signal: &Signal) -> Option<PeriodScore> {
    let (mean, size) = size(time, &signal.values);
    // The relative velocity may rest at its mean.
    let level = match signal.channel {
        Channel::RelativeVelocity => mean + 0.5 * size,
        _ => mean,
    };
    let of = |run: usize| {
        let (mut below, mut first, mut last, mut count) = (false, 0.0, 0.0, 0);
        for k in 1..time.len() {
            let (a, b) = (signal.values[k - 1][run], signal.values[k][run]);
            below |= a < level - APPROACH * size;
            if below && a < level && b >= level {
                last = time[k - 1] + (time[k] - time[k - 1]) * (level - a) / (b - a);
                if count == 0 {
                    first = last;
                }
                (below, count) = (false, count + 1);
            }
        }
        (count > 1).then(|| ((last - first) / (count - 1) as f64, count - 1))
    };
    let ((candidate, theirs), (reference, ours)) = (of(0)?, of(1)?);
    Some(PeriodScore {
        channel: signal.channel.name(),
        level,
        cycles: [ours, theirs],
        reference,
        candidate,
        error: candidate - reference,
        relative: (candidate - reference).abs() / reference,
    })
}
