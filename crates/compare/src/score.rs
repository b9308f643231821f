//! Errors that depend on no threshold: position, period, rest positions and creep in stick.
//!
//! Both runs are compared at the candidate's times. Events of the candidate are not used; the sticks are the
//! reference's.

use super::candidate::Block;
use super::trajectory::Evaluator;
use super::{Channel, CompareError, Reference, Span};
use serde::Serialize;
use std::borrow::Cow;
use stickslip_system::record::EventKind;

/// Errors at the same times, without a threshold, from ten natural periods before the reference's first event to its
/// last one, as far as the candidate has samples. A candidate with the reference's values at its times has rounding
/// errors only.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Time of the first sample, s.
    pub from: f64,
    /// Time of the last sample, s.
    pub to: f64,
    /// Number of samples used: beyond 131,072 every second one, every fourth one, ...
    pub samples: usize,
    /// Score of the position; `None` if the candidate does not have it.
    pub position: Option<PositionScore>,
    /// Score of the period; `None` for less than one cycle.
    pub period: Option<PeriodScore>,
    /// Score of the positions in the middle of the sticks; `None` without a stick or a position.
    pub rest: Option<RestScore>,
    /// Score of the relative velocity in the sticks; `None` without a stick.
    pub creep: Option<CreepScore>,
}

/// The error of the position of the surface next to the contact.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PositionScore {
    /// Name of the channel.
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
    /// Crossing channel: the position, or else the relative velocity.
    pub channel: Cow<'static, str>,
    /// The level, in the channel's SI unit: the reference's mean over time, for the relative velocity plus half its
    /// size.
    pub level: f64,
    /// Number of periods in reference and candidate.
    pub cycles: [usize; 2],
    /// Period of the reference, s.
    pub reference: f64,
    /// Period of the candidate, s.
    pub candidate: f64,
    /// Candidate minus reference, s.
    pub error: f64,
    /// |`error`| / `reference`.
    pub relative: f64,
}

/// The error of the position in the middle of each stick of the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestScore {
    /// Name of the channel.
    pub channel: Cow<'static, str>,
    /// Its SI unit.
    pub unit: &'static str,
    /// Number of the reference's sticks whose middle lies between two samples in it.
    pub sticks: usize,
    /// Root mean square of the errors, in `unit`.
    pub rms: f64,
    /// Largest absolute error, in `unit`.
    pub max: f64,
    /// Time of the largest error, s.
    pub max_at: f64,
    /// `rms` / size of the position.
    pub relative: f64,
}

/// The relative velocity in the middle halves of the reference's sticks that end, or else in the one that lasts to the
/// end of the run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CreepScore {
    /// "rad/s", or "m/s" in translation.
    pub unit: &'static str,
    /// Number of sticks with at least two samples there.
    pub sticks: usize,
    /// Root mean square of the candidate's relative velocity over time, in `unit`.
    pub candidate: f64,
    /// Root mean square of the reference's relative velocity, in `unit`; zero for a contact with stick.
    pub reference: f64,
    /// Root mean square of the difference, in `unit`.
    pub rms: f64,
    /// Root mean square of the reference's relative velocity over the whole time, in `unit`; of a reference that never
    /// slips, the size of the channel.
    pub size: f64,
    /// `rms` / `size`.
    pub relative: f64,
    /// Largest distance that the candidate slides in one of these sticks, rad, or m in translation.
    pub slid: f64,
    /// Duration of that stick as far as the samples show it, s.
    pub slid_in: f64,
}

impl CreepScore {
    pub(super) fn words(&self) -> String {
        let (speed, unit, slid, slid_in) = (self.candidate, self.unit, self.slid, self.slid_in);
        let length = unit.trim_end_matches("/s");
        format!("creeps at {speed:.3e} {unit}, {slid:.2e} {length} in {slid_in:.3} s")
    }
}

const MOST_SAMPLES: usize = 1 << 17;

/// Smallest approach between two crossings, in parts of the size; less is noise.
const APPROACH: f64 = 0.25;

#[derive(Debug)]
struct Signal {
    channel: Channel,
    column: usize,
    values: Vec<[f64; 2]>,
}

#[derive(Debug)]
pub(super) struct ScorePass<'a> {
    reference: Evaluator<'a>,
    window: (f64, f64),
    position: Option<Signal>,
    velocity: Option<Signal>,
    time: Vec<f64>,
    /// Every `stride`-th sample is used; number of samples seen.
    stride: usize,
    seen: usize,
}

impl Reference {
    pub(super) fn score_pass(&self, channels: &[Channel]) -> Result<Option<ScorePass<'_>>, CompareError> {
        let signal = |channel: Channel| {
            let column = channels.iter().position(|known| *known == channel)?;
            Some(Signal {
                channel,
                column,
                values: Vec::new(),
            })
        };
        let positions = self.physics.position().into_iter().chain([Channel::ROTOR_TWIST]);
        let position = positions.into_iter().find_map(signal);
        let velocity = signal(Channel::RELATIVE_VELOCITY);
        let signals = [&position, &velocity].into_iter().flatten();
        let of: Vec<Channel> = signals.map(|signal| signal.channel).collect();
        if of.is_empty() {
            return Ok(None);
        }
        Ok(Some(ScorePass {
            reference: self.evaluator(&of)?,
            // A stick that lasts to the end counts for its creep alone.
            window: match self.last_stick() {
                Some((_, end)) => (self.stretch().0, end),
                None => self.stretch(),
            },
            position,
            velocity,
            time: Vec::new(),
            stride: 1,
            seen: 0,
        }))
    }

    fn sticks(&self, span: Span) -> Vec<(f64, f64)> {
        let all = self.ended_sticks().into_iter().chain(self.last_stick());
        all.filter(|&(from, to)| to > span.from && from < span.to).collect()
    }

    fn ended_sticks(&self) -> Vec<(f64, f64)> {
        let ends = self.word.windows(2).map(|pair| (pair[0], pair[1].time));
        let sticks = ends.filter(|(event, _)| event.kind == EventKind::Stick);
        let first = self.word.first().filter(|event| event.kind == EventKind::Slip);
        let first = first.filter(|_| !self.starts_in_slip);
        let first = first.map(|event| (self.start, event.time)).into_iter();
        first.chain(sticks.map(|(event, end)| (event.time, end))).collect()
    }

    /// The reference's stick that lasts to its end, if it has no other.
    pub(super) fn last_stick(&self) -> Option<(f64, f64)> {
        let from = match self.word.last() {
            Some(event) => Some(event.time).filter(|_| event.kind == EventKind::Stick),
            None => Some(self.start).filter(|_| self.starts_in_stick),
        };
        let stick = from.map(|from| (from, self.end)).filter(|(from, end)| end > from);
        stick.filter(|_| self.ended_sticks().is_empty())
    }

    pub(super) fn score(&self, pass: &ScorePass<'_>, span: Span) -> Option<Score> {
        let unit = |channel: Channel| self.physics.vocabulary().unit(channel);
        let (all, sticks) = (&pass.time, self.sticks(span));
        let end = self.stretch().1;
        let time = &all[..all.partition_point(|t| *t <= end)];
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
        let of_position = pass.position.as_ref().zip(position.as_ref());
        let rest = of_position.and_then(|(signal, position)| {
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
            let &(max_at, worst) = middles.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
            let scale = if worst == 0.0 { 1.0 } else { worst.abs() };
            let squares: f64 = middles.iter().map(|(_, error)| (error / scale).powi(2)).sum();
            let rms = scale * (squares / middles.len() as f64).sqrt();
            Some(RestScore {
                channel: position.channel.clone(),
                unit: position.unit,
                sticks: middles.len(),
                rms,
                max: worst.abs(),
                max_at,
                relative: part(rms, position.size),
            })
        });
        let velocity = pass.velocity.as_ref();
        let repeating = pass.position.as_ref().or(velocity);
        Some(Score {
            from,
            to,
            samples: time.len(),
            position,
            period: repeating.and_then(|signal| period(time, signal)),
            rest,
            creep: velocity.and_then(|signal| self.creep((time, all), signal, &sticks)),
        })
    }

    /// Creep in the sticks, from `all` times; those of `time` determine the size of the relative velocity.
    fn creep(&self, (time, all): (&[f64], &[f64]), signal: &Signal, sticks: &[(f64, f64)]) -> Option<CreepScore> {
        let (mut seconds, mut squares, mut seen) = (0.0, [0.0; 3], 0);
        let scales = OF_CREEP.map(|of| largest(&signal.values, of));
        let mut slid = (0.0, 0.0);
        for &(from, to) in sticks {
            let up_to = |end: f64| all.partition_point(|t| *t <= end);
            let after = |start: f64| all.partition_point(|t| *t < start);
            let inside = after(from)..up_to(to);
            if inside.len() > 1 {
                let (time, values) = (&all[inside.clone()], &signal.values[inside]);
                let way = integral(time, |k| difference(values[k])).abs();
                if way > slid.0 {
                    slid = (way, time[time.len() - 1] - time[0]);
                }
            }
            let quarter = 0.25 * (to - from);
            let (first, end) = (after(from + quarter), up_to(to - quarter));
            if end <= first + 1 {
                continue;
            }
            seen += 1;
            seconds += all[end - 1] - all[first];
            let (time, values) = (&all[first..end], &signal.values[first..end]);
            for (sum, (of, scale)) in squares.iter_mut().zip(OF_CREEP.into_iter().zip(scales)) {
                *sum += integral(time, |k| (of(values[k]) / scale).powi(2));
            }
        }
        let [candidate, reference, rms_of] = [0, 1, 2].map(|k| scales[k] * (squares[k] / seconds).sqrt());
        let size = match rms(time, &signal.values, |v| v[1]) {
            0.0 => self.physics.size(signal.channel, false),
            size => size,
        };
        (seconds > 0.0).then(|| CreepScore {
            unit: self.physics.vocabulary().unit(signal.channel),
            sticks: seen,
            candidate,
            reference,
            rms: rms_of,
            size,
            relative: part(rms_of, size),
            slid: slid.0,
            slid_in: slid.1,
        })
    }
}

impl ScorePass<'_> {
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

/// Relative velocities of the creep: of the candidate, of the reference, and their difference.
const OF_CREEP: [fn([f64; 2]) -> f64; 3] = [|[candidate, _]| candidate, |[_, reference]| reference, difference];

/// Relative error; 0 if the error is 0, whatever the size.
fn part(error: f64, size: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / size }
}

fn integral(time: &[f64], value: impl Fn(usize) -> f64) -> f64 {
    let each = (1..time.len()).map(|k| 0.5 * (time[k] - time[k - 1]) * (value(k - 1) + value(k)));
    each.sum()
}

/// Largest magnitude, a divisor that prevents an overflow of squares; 1 if all values are zero.
fn largest(values: &[[f64; 2]], of: impl Fn([f64; 2]) -> f64) -> f64 {
    let largest = values.iter().map(|&value| of(value).abs()).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

fn rms(time: &[f64], values: &[[f64; 2]], of: impl Fn([f64; 2]) -> f64) -> f64 {
    let span = time[time.len() - 1] - time[0];
    let scale = largest(values, &of);
    scale * (integral(time, |k| (of(values[k]) / scale).powi(2)) / span).sqrt()
}

/// Mean of the reference over time, and the root mean square about it.
fn size(time: &[f64], values: &[[f64; 2]]) -> (f64, f64) {
    let mean = integral(time, |k| values[k][1]) / (time[time.len() - 1] - time[0]);
    (mean, rms(time, values, |v| v[1] - mean))
}

fn period(time: &[f64], signal: &Signal) -> Option<PeriodScore> {
    let (mean, size) = size(time, &signal.values);
    let level = match signal.channel {
        Channel::RELATIVE_VELOCITY => mean + 0.5 * size,
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
