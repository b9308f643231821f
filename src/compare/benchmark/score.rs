//! What the rules of the set say of a submission: `scoring.md`, operation by operation.

use super::super::CompareError;
use super::super::candidate::plain::Plain;
use super::super::crossings::Crossings;
use super::super::detect::{DEFAULT_HYSTERESIS, DEFAULT_TOLERANCE, Detection, Detector, Point, TakeOff};
use super::answer::{Answer, AnswerEvent, RELATIVE_VELOCITY, counted};
use super::rows::{Rows, mean_and_size, nearest, relative, rms};
use super::set::SummaryOf;
use crate::record::EventKind;
use crate::record::sequence::{Alignment, Pair, SequenceEvent};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// What the rules say. Numbers are those of the set's own checker, to the last bit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchmarkScore {
    /// The version of the set.
    pub set: String,
    /// The problem.
    pub problem: String,
    /// Largest relative speed that counts as rest. `None` if the candidate states its events.
    pub threshold: Option<f64>,
    /// The two sequences.
    pub sequence: SequenceScore,
    /// Every event with a partner.
    pub events: Vec<EventScore>,
    /// The fewest digits of an event; 0 if the sequence is wrong, `None` without events.
    pub digits: Option<f64>,
    /// s.
    pub largest_event_error: Option<f64>,
    /// Errors at the grid; `None` of a table of events.
    pub samples: Option<SamplesScore>,
    /// Errors without a threshold.
    pub scores: Scores,
    /// Numbers of the motion as a whole.
    pub summary: Vec<SummaryScore>,
}

/// How the sequences of events agree.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SequenceScore {
    /// `None` if the candidate has neither events nor a relative velocity.
    pub agrees: Option<bool>,
    /// Of the answer, in the candidate's span.
    pub reference_events: usize,
    /// Of the candidate.
    pub candidate_events: Option<usize>,
    /// Without a partner, of the answer.
    pub missing: Option<usize>,
    /// Without a partner, of the candidate.
    pub spurious: Option<usize>,
    /// Of the answer, outside the candidate's span.
    pub uncovered: usize,
    /// Of samples: "contradicts" where they slip from the start and the answer sticks, or rest where it slips, else "agrees".
    /// `None` of stated events, and where the problem has a threshold.
    pub start: Option<&'static str>,
    /// The sequences agree, and the candidate covers the motion but for a time scale at either end.
    pub accepted: bool,
}

/// The error of an event.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventScore {
    /// Its number in `events.csv`.
    pub event: usize,
    /// stick, slip or reversal.
    pub kind: String,
    /// s.
    pub time: f64,
    /// s.
    pub candidate_time: f64,
    /// Candidate minus answer, s.
    pub error: f64,
    /// Smallest error that counts, s.
    pub floor: f64,
    /// Digits by the time scale of the problem.
    pub digits: f64,
}

/// Errors at the points of the grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SamplesScore {
    /// Points that the candidate covers.
    pub points: usize,
    /// Points of the grid.
    pub of: usize,
    /// Each column that the candidate has.
    pub columns: Vec<ColumnScore>,
}

/// Errors of a column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnScore {
    /// Which.
    pub name: String,
    /// SI.
    pub unit: String,
    /// Largest absolute error.
    pub largest: f64,
    /// Its time, s.
    pub largest_at: f64,
    /// Root mean square of the error.
    pub rms: f64,
    /// Root mean square of the answer about its mean.
    pub size: f64,
    /// `rms`/`size`; `None` of a column that does not change.
    pub relative: Option<f64>,
    /// By `relative`.
    pub digits: Option<f64>,
}

/// Errors that depend on no threshold.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Scores {
    /// Of the position over time.
    pub position: Option<Deviation>,
    /// Of the mean period.
    pub period: Option<PeriodError>,
    /// Of the position amid the sticks of the answer.
    pub rest: Option<Deviation>,
    /// Of the relative velocity amid the sticks of the answer.
    pub creep: Option<Deviation>,
}

/// A root mean square, and in parts of a size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deviation {
    /// In the unit of its column.
    pub rms: f64,
    /// In the same unit.
    pub size: f64,
    /// `rms`/`size`.
    pub relative: Option<f64>,
}

/// An error of the mean period.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PeriodError {
    /// s.
    pub reference: f64,
    /// s.
    pub candidate: f64,
    /// Candidate minus answer, s.
    pub error: f64,
    /// |`error`|/`reference`.
    pub relative: f64,
}

/// The error of a number of the motion as a whole.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SummaryScore {
    /// Which.
    pub name: String,
    /// SI.
    pub unit: String,
    /// Of the answer.
    pub reference: f64,
    /// Of the candidate, as far as it has what it follows from.
    pub candidate: Option<f64>,
    /// Candidate minus answer.
    pub error: Option<f64>,
    /// In parts of the answer.
    pub relative: Option<f64>,
    /// By `relative`.
    pub digits: Option<f64>,
}

/// What a submission says about itself beside its file.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in super::super) struct Settings<'a> {
    pub events: Option<&'a Path>,
    pub threshold: Option<f64>,
    pub hysteresis: Option<f64>,
}

/// Events that are looked for in samples; more are chatter.
const MOST_EVENTS: usize = 20_000;

/// No relative error counts as smaller.
const ROUNDING: f64 = f64::EPSILON / 2.0;

/// An event of the candidate.
type Seen = (f64, EventKind);

impl BenchmarkScore {
    /// The number that a requirement of digits bounds: infinite where neither motion has an event, 0 unless the sequence is accepted.
    pub fn required_digits(&self) -> Option<f64> {
        let sequence = &self.sequence;
        match sequence.agrees? {
            true if sequence.reference_events == 0 && sequence.uncovered > 0 => None,
            true if !sequence.accepted => Some(0.0),
            true if sequence.reference_events == 0 => Some(f64::INFINITY),
            _ => self.digits,
        }
    }
}

impl Answer {
    /// Scores the candidate at `path`.
    ///
    /// # Errors
    /// If the file cannot be read, or is no table of the problem.
    pub fn score(&self, path: &Path, settings: Settings<'_>) -> Result<BenchmarkScore, CompareError> {
        let statement = &self.statement;
        let mut names: Vec<&str> = statement.columns.iter().map(|column| column.name.as_str()).collect();
        if !names.contains(&RELATIVE_VELOCITY) {
            names.push(RELATIVE_VELOCITY);
        }
        let main = Plain::read(path, &names)?;
        let events = settings.events.map(|path| Plain::read(path, &[])).transpose()?;
        let refuse = |path: &Path, what: &str, remedy: &str| Err(CompareError::whole(path, what, remedy));
        match (settings.events, &events) {
            (Some(_), Some(_)) if main.kinds.is_some() => {
                return refuse(
                    path,
                    "is an events table",
                    "give it alone, or samples first and the events by --events",
                );
            }
            (Some(of), Some(events)) if events.kinds.is_none() => {
                return refuse(
                    of,
                    "has no column kind",
                    "give a table with the columns time and kind by --events",
                );
            }
            _ => {}
        }
        let threshold = statement.threshold.or(settings.threshold).or(main.threshold);
        let threshold = threshold.unwrap_or(DEFAULT_TOLERANCE);
        let stated = if main.kinds.is_some() {
            Some(&main)
        } else {
            events.as_ref()
        };
        let rows = main.kinds.is_none().then(|| self.rows(&main));
        let velocity = rows.as_ref().and_then(|rows| rows.column(RELATIVE_VELOCITY));
        let (found, span): (Option<Vec<Seen>>, _) = match (stated, &rows) {
            (Some(stated), _) => {
                let kinds = stated.kinds.iter().flatten();
                let pairs = stated
                    .time
                    .iter()
                    .zip(kinds)
                    .filter_map(|(time, kind)| Some((*time, counted(kind)?)));
                (Some(pairs.collect()), (0.0, statement.end_time))
            }
            (None, Some(rows)) => (
                velocity.map(|velocity| self.find(rows.time, velocity, threshold, settings.hysteresis)),
                rows.span(),
            ),
            (None, None) => (None, (0.0, statement.end_time)),
        };
        let (mut sequence, events) = self.events(found.as_deref(), span);
        let of_samples = velocity
            .zip(rows.as_ref())
            .filter(|_| stated.is_none() && statement.threshold.is_none());
        if let Some((velocity, rows)) = of_samples {
            let leaves = threshold * settings.hysteresis.unwrap_or(DEFAULT_HYSTERESIS);
            let contradicts = self.start_contradicts(rows.time, velocity, [threshold, leaves]);
            sequence.start = Some(if contradicts { "contradicts" } else { "agrees" });
            if contradicts {
                (sequence.agrees, sequence.accepted) = (Some(false), false);
            }
        }
        let digits = match sequence.agrees {
            Some(false) => Some(0.0),
            _ => events.iter().map(|event| event.digits).reduce(f64::min),
        };
        let (samples, scores) = match &rows {
            Some(rows) => self.samples(rows),
            None => (None, Scores::default()),
        };
        Ok(BenchmarkScore {
            set: statement.set.clone(),
            problem: statement.problem.clone(),
            threshold: stated.is_none().then_some(threshold),
            digits,
            largest_event_error: events.iter().map(|event| event.error.abs()).reduce(f64::max),
            summary: self.summary(rows.as_ref(), &events),
            sequence,
            events,
            samples,
            scores,
        })
    }

    /// The rows of a candidate, with the relative velocity if it follows from them.
    fn rows<'a>(&'a self, main: &'a Plain) -> Rows<'a> {
        let mut rows = Rows::new(&self.times, main);
        let needed = self
            .statement
            .relative_velocity
            .keys()
            .filter(|name| *name != "constant");
        if rows.column(RELATIVE_VELOCITY).is_none() && needed.into_iter().all(|name| rows.column(name).is_some()) {
            let velocity = self.statement.relative(main.time.len(), |name| rows.column(name));
            rows.add(RELATIVE_VELOCITY, velocity);
        }
        rows
    }

    /// The events in samples of the relative velocity.
    fn find(&self, time: &[f64], velocity: &[f64], threshold: f64, hysteresis: Option<f64>) -> Vec<Seen> {
        let pairs = time.iter().zip(velocity);
        let mut found = if self.statement.threshold.is_some() {
            let mut crossings = Crossings::new(threshold, 0.0);
            for (&time, &velocity) in pairs {
                crossings.add(time, velocity);
                if crossings.events.len() >= MOST_EVENTS {
                    break;
                }
            }
            return crossings.events.iter().map(|event| (event.time, event.kind)).collect();
        } else {
            let take_off = if self.statement.leaves_linearly() {
                TakeOff::Linear
            } else {
                TakeOff::Quadratic
            };
            let detection = Detection {
                velocity_tolerance: threshold,
                hysteresis: hysteresis.unwrap_or(DEFAULT_HYSTERESIS),
            };
            let mut detector = Detector::new(detection).with_take_off(take_off);
            for (&time, &velocity) in pairs {
                detector.add(Point {
                    time,
                    velocity,
                    normal_force: f64::INFINITY,
                    torques: None,
                });
                if detector.count() >= MOST_EVENTS {
                    break;
                }
            }
            detector.finish()
        };
        // What slips from rest at once has no relative velocity in its first sample, which is no stick.
        let begins = time.get(1).copied().unwrap_or(f64::NEG_INFINITY);
        let at_once = |event: &super::super::Found| event.kind == EventKind::Slip && event.time <= begins;
        if self.statement.starts_in_slip && found.first().is_some_and(at_once) {
            found.remove(0);
        }
        for event in &mut found {
            // The time of a jump is given; samples on both sides do not show it.
            let (before, after) = event.between;
            let kick = self
                .statement
                .kicks()
                .filter(|kick| (before..=after).contains(kick))
                .last();
            if let Some(kick) = kick.filter(|_| event.kind != EventKind::Stick) {
                event.time = kick;
            }
        }
        found.iter().map(|event| (event.time, event.kind)).collect()
    }

    /// Whether samples slip from the start where the answer sticks, or rest where it slips; by the speeds at which a stick begins and
    /// ends.
    fn start_contradicts(&self, time: &[f64], velocity: &[f64], [begins, ends]: [f64; 2]) -> bool {
        let first = self.events.first().map_or(f64::INFINITY, |event| event.time);
        let before = &velocity[..time.partition_point(|time| *time < first)];
        if before.len() < 2 {
            return false;
        }
        if self.statement.starts_in_slip {
            return first > self.times[1] && before.iter().all(|speed| speed.abs() <= begins);
        }
        self.relative_velocity()[0] == 0.0 && before[1..].iter().all(|speed| speed.abs() > ends)
    }

    /// The relative velocity of the answer at the grid.
    fn relative_velocity(&self) -> &[f64] {
        let index = self.statement.column(RELATIVE_VELOCITY);
        &self.samples[index.unwrap_or(self.samples.len() - 1)]
    }

    fn events(&self, found: Option<&[Seen]>, (from, to): (f64, f64)) -> (SequenceScore, Vec<EventScore>) {
        let within = |time: f64| from <= time && time <= to;
        let reference: Vec<&AnswerEvent> = self.events.iter().filter(|event| within(event.time)).collect();
        let mut sequence = SequenceScore {
            agrees: None,
            reference_events: reference.len(),
            candidate_events: None,
            missing: None,
            spurious: None,
            uncovered: self.events.len() - reference.len(),
            start: None,
            accepted: false,
        };
        let Some(found) = found else {
            return (sequence, Vec::new());
        };
        let ours: Vec<SequenceEvent> = reference
            .iter()
            .filter_map(|event| {
                Some(SequenceEvent {
                    time: event.time,
                    kind: counted(&event.kind)?,
                })
            })
            .collect();
        let inside = found
            .iter()
            .filter(|(time, _)| 0.0 < *time && *time <= self.statement.end_time && within(*time));
        let theirs: Vec<SequenceEvent> = inside.map(|&(time, kind)| SequenceEvent { time, kind }).collect();
        let equal = ours.len() == theirs.len() && ours.iter().zip(&theirs).all(|(a, b)| a.kind == b.kind);
        let pairs: Vec<Pair> = match equal {
            true => (0..ours.len())
                .map(|k| Pair {
                    reference: Some(k),
                    candidate: Some(k),
                })
                .collect(),
            false => Alignment::of(&ours, &theirs, self.statement.time_scale).pairs,
        };
        let missing = pairs.iter().filter(|pair| pair.candidate.is_none()).count();
        let spurious = pairs.iter().filter(|pair| pair.reference.is_none()).count();
        sequence.agrees = Some(missing + spurious == 0);
        sequence.candidate_events = Some(theirs.len());
        (sequence.missing, sequence.spurious) = (Some(missing), Some(spurious));
        let scale = self.statement.time_scale;
        let [first, last] = [self.times.first(), self.times.last()].map(|time| time.copied().unwrap_or(0.0));
        let falls_short = from > first + scale || to < last - scale;
        sequence.accepted = missing + spurious + sequence.uncovered == 0 && !falls_short;
        let scored = pairs.iter().filter_map(Pair::matched).map(|(r, c)| {
            let (event, time) = (reference[r], theirs[c].time);
            let error = time - event.time;
            let floor = event.time_uncertainty.max(event.time.next_up() - event.time);
            EventScore {
                event: event.event,
                kind: event.kind.clone(),
                time: event.time,
                candidate_time: time,
                error,
                floor,
                digits: digits(error.abs().max(floor) / self.statement.time_scale, 0.0),
            }
        });
        (sequence, scored.collect())
    }

    fn samples(&self, rows: &Rows<'_>) -> (Option<SamplesScore>, Scores) {
        let statement = &self.statement;
        let places: Vec<_> = (0..self.times.len()).map(|k| rows.place_of(k)).collect();
        let covered: Vec<usize> = (0..places.len()).filter(|&k| places[k].is_some()).collect();
        let times: Vec<f64> = covered.iter().map(|&k| self.times[k]).collect();
        let sticks = self.sticks();
        let mut columns = Vec::new();
        let mut scores = Scores::default();
        for name in rows.names().filter(|_| !covered.is_empty()) {
            let index = statement.column(name).unwrap_or(self.samples.len() - 1);
            let of_place = |(k, place): (usize, &Option<_>)| place.map(|place| rows.value(name, place, self.times[k]));
            let theirs: Vec<f64> = places.iter().enumerate().filter_map(of_place).collect();
            let ours: Vec<f64> = covered.iter().map(|&k| self.samples[index][k]).collect();
            let errors: Vec<f64> = theirs.iter().zip(&ours).map(|(c, r)| c - r).collect();
            let (size, error) = (mean_and_size(&ours).1, rms(&errors));
            let part = relative(error, size);
            if !rows.is_derived(name) {
                // The first of those that are equal.
                let worst = (1..errors.len()).fold(0, |worst, k| {
                    if errors[k].abs() > errors[worst].abs() {
                        k
                    } else {
                        worst
                    }
                });
                let unit = statement
                    .columns
                    .get(index)
                    .map_or(statement.velocity_unit(), |column| &column.unit);
                columns.push(ColumnScore {
                    name: name.to_owned(),
                    unit: unit.to_owned(),
                    largest: errors[worst].abs(),
                    largest_at: times[worst],
                    rms: error,
                    size,
                    relative: part,
                    digits: part.map(|part| digits(part, ROUNDING)),
                });
            }
            if name == statement.position {
                scores.position = Some(Deviation {
                    rms: error,
                    size,
                    relative: part,
                });
                scores.period = self.period(&times, &ours, &theirs);
                let by_point: BTreeMap<usize, f64> = covered.iter().copied().zip(errors.iter().copied()).collect();
                let amid = sticks.iter().filter_map(|&(start, end)| {
                    let k = nearest(&self.times, 0.5 * (start + end))?;
                    let inside = start <= self.times[k] && self.times[k] <= end;
                    by_point.get(&k).copied().filter(|_| inside)
                });
                let amid: Vec<f64> = amid.collect();
                if !amid.is_empty() {
                    let rms = rms(&amid);
                    scores.rest = Some(Deviation {
                        rms,
                        size,
                        relative: relative(rms, size),
                    });
                }
            }
            if name == RELATIVE_VELOCITY {
                let values = if statement.threshold.is_none() {
                    &theirs
                } else {
                    &errors
                };
                let mut slow = Vec::new();
                for &(start, end) in &sticks {
                    let quarter = 0.25 * (end - start);
                    let first = times.partition_point(|time| *time < start + quarter);
                    let last = times.partition_point(|time| *time <= end - quarter);
                    slow.extend_from_slice(values.get(first..last).unwrap_or_default());
                }
                if !slow.is_empty() {
                    let (rms_of, size) = (rms(&slow), rms(&ours));
                    scores.creep = Some(Deviation {
                        rms: rms_of,
                        size,
                        relative: relative(rms_of, size),
                    });
                }
            }
        }
        let samples = SamplesScore {
            points: covered.len(),
            of: self.times.len(),
            columns,
        };
        (Some(samples), scores)
    }

    /// The error of the mean period, of a problem whose summary has one.
    fn period(&self, times: &[f64], ours: &[f64], theirs: &[f64]) -> Option<PeriodError> {
        let (level, size) = mean_and_size(ours);
        let [reference, candidate] = [ours, theirs].map(|values| mean_period(times, values, level, size));
        let (reference, candidate) = reference.zip(candidate)?;
        self.summary.iter().find(|value| value.name == "period")?;
        let error = candidate - reference;
        Some(PeriodError {
            reference,
            candidate,
            error,
            relative: error.abs() / reference,
        })
    }

    /// Where the answer sticks, also before its first event and after its last one, s.
    fn sticks(&self) -> Vec<(f64, f64)> {
        let first = self.events.first();
        let mut at_rest = !self.statement.starts_in_slip && first.is_none_or(|event| event.kind == "slip");
        if let Some(threshold) = self.statement.threshold {
            let index = self
                .statement
                .column(RELATIVE_VELOCITY)
                .unwrap_or(self.samples.len() - 1);
            at_rest = at_rest && self.samples[index][0].abs() <= threshold;
        }
        let (mut begins, mut found) = (at_rest.then_some(0.0), Vec::new());
        for event in &self.events {
            found.extend(begins.take().map(|begin| (begin, event.time)));
            begins = (event.kind == "stick").then_some(event.time);
        }
        found.extend(begins.map(|begin| (begin, self.statement.end_time)));
        found
    }

    fn summary(&self, rows: Option<&Rows<'_>>, events: &[EventScore]) -> Vec<SummaryScore> {
        let matched: BTreeMap<usize, f64> = events.iter().map(|event| (event.event, event.candidate_time)).collect();
        let time = |number: i64| match usize::try_from(number) {
            Ok(number) => matched.get(&number).copied(),
            // t = 0.
            Err(_) => Some(0.0),
        };
        let score = |value: &super::answer::Valued| {
            let rows = |column: &str| rows.filter(|rows| rows.column(column).is_some());
            let candidate = match &value.of {
                SummaryOf::Events { first, last, count } => time(*first)
                    .zip(time(*last))
                    .map(|(first, last)| (last - first) / f64::from(*count)),
                SummaryOf::Extremum {
                    column, what, between, ..
                } => rows(column).and_then(|rows| rows.extremum(column, *what, *between)),
                SummaryOf::Samples { column, time } => rows(column).and_then(|rows| rows.at(column, *time)),
            };
            let error = candidate.map(|candidate| candidate - value.value);
            let part = error.and_then(|error| relative(error.abs(), value.value.abs()));
            SummaryScore {
                name: value.name.clone(),
                unit: value.unit.clone(),
                reference: value.value,
                candidate,
                error,
                relative: part,
                digits: part.map(|part| digits(part, ROUNDING).min(value.digits.unwrap_or(f64::INFINITY))),
            }
        };
        self.summary.iter().map(score).collect()
    }
}

/// Digits by a relative error, which counts as no smaller than `floor`.
fn digits(error: f64, floor: f64) -> f64 {
    (-error.max(floor).log10()).max(0.0)
}

/// Mean time between upward crossings of a level that are approached from a quarter of the size below it.
fn mean_period(times: &[f64], values: &[f64], level: f64, size: f64) -> Option<f64> {
    let (mut below, mut first, mut last, mut count) = (false, 0.0, 0.0, 0);
    for k in 1..times.len() {
        let (a, b) = (values[k - 1], values[k]);
        below |= a < level - 0.25 * size;
        if below && a < level && level <= b {
            last = times[k - 1] + (times[k] - times[k - 1]) * (level - a) / (b - a);
            if count == 0 {
                first = last;
            }
            (below, count) = (false, count + 1);
        }
    }
    (count > 1).then(|| (last - first) / f64::from(count - 1))
}
