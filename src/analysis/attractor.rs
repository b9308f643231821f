//! Whether a motion repeats itself.
//!
//! Every breakaway and every reversal is a section of the motion. A period is the time between two sections of one kind, at
//! most [`LONGEST_PERIOD`](super::section::LONGEST_PERIOD) sections apart, whose states agree, and by which every harmonic that drives the trains has gone through
//! whole turns. It is looked for anew after a kick and after a corner of a signal. Sliding that slows down by itself repeats nothing.
//!
//! Where these events have no period, the states after whole periods of the forcing are sections, and where nothing forces the
//! trains and the contact has no more events, the least relative velocities are.

use super::forcing::{common_period, harmonics};
use super::section::{Hit, Hits, Repetition, Sizes, larger, sizes_of};
use super::sequence::Sequence;
use super::smooth;
use crate::model::Mode;
use crate::model::margin::twice_resistance;
use crate::model::system::System;
use crate::record::{Cycle, Event, EventKind, Piece, Recorder, RecorderError, Sample, Segment};
use crate::simulation::{PortraitPoint, Section, further, portrait};
use serde::Serialize;

/// Strobes in a period of the forcing. The first of them is a section; the others tell how large the motion is.
const PHASES: u64 = 8;

/// From how much of the end time on a motion without events is gone through again, the shortest stretch last.
const MARKS: [f64; 4] = [1.0 / 2.0, 3.0 / 4.0, 15.0 / 16.0, 63.0 / 64.0];

/// What a motion repeats; times in s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Attractor {
    /// s.
    pub period: f64,
    /// Sticks that begin in a period.
    pub sticks: u64,
    /// Sections in a period: breakaways and reversals, periods of the forcing, or least relative velocities.
    pub sections: usize,
    /// Periods of the forcing in a period, where these are the sections.
    pub forcing_periods: Option<u64>,
    /// By how much the last two cycles differ, relative: of states and of periods the larger.
    pub agreement: f64,
    /// How far the last cycle is from the periodic motion, relative, by the pace at which the last three come together: the
    /// digits of all that is said of that motion.
    pub distance: f64,
    /// When the motion had come so near to itself, s.
    pub since: f64,
    /// Over the last period; `None` where it could not be gone through again.
    pub extremes: Option<Extremes>,
}

/// The extremes over one period.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extremes {
    /// Of what the position is: "stator" or "rotor", the surface beside the far end of its train; "rotor twist" or "stator
    /// twist", shaft 0 of a free train; "slip", the slip displacement.
    pub of: &'static str,
    /// rad (m in translation).
    pub position: (f64, f64),
    /// Half of the difference; `None` of a slip displacement, which goes on from period to period.
    pub amplitude: Option<f64>,
    /// omega_r, rad/s.
    pub relative_velocity: (f64, f64),
}

/// The state at the phases of the forcing.
#[derive(Debug, Clone)]
struct Strobes {
    hits: Hits,
    /// Of the harmonics that act, s.
    period: Option<f64>,
    /// The number of the next strobe.
    next: u64,
    /// Since the last section.
    sizes: Sizes,
}

impl Strobes {
    /// When the next one is, s; infinite without one.
    fn time(&self) -> f64 {
        let time = |period: f64| self.next as f64 * (period / PHASES as f64);
        self.period.map_or(f64::INFINITY, time)
    }

    /// Starts anew at a time (s).
    fn begin(&mut self, time: f64) {
        self.hits.clear();
        self.sizes = Sizes::default();
        self.period = common_period(self.hits.harmonics().iter().filter(|harmonic| harmonic.acts_at(time)));
        self.next = match self.period {
            Some(period) => (time / period * PHASES as f64).ceil() as u64,
            None => 0,
        };
        // Rounded down by a hair.
        if self.time() < time {
            self.next += 1;
        }
    }
}

/// Looks for the attractor in a run, keeps the sequence of its events, and passes the run on.
pub(super) struct Recurrence<'a> {
    inner: &'a mut dyn Recorder,
    /// The report of the run keeps the events whether or not `inner` stores them.
    keeps_events: bool,
    /// What has happened.
    pub sequence: Sequence,
    /// The motion comes to a stop.
    stops: bool,
    further: Vec<f64>,
    /// Breakaways and reversals.
    hits: Hits,
    /// What the contact did last.
    mode: Mode,
    sticks: u64,
    /// When the stick began in which the motion is, s.
    stuck_since: f64,
    strobes: Strobes,
    /// The end of a run of which more than the events is looked at, s.
    end_time: Option<f64>,
    /// When the motion is to be marked, s, the last first.
    next_marks: Vec<f64>,
    /// The state at these times, since the last event.
    marks: Vec<Section>,
    /// The state at the last sample.
    last: Option<Section>,
}

/// The sense of a mode, in which an engaged contact goes on where it rests.
fn sense(mode: Mode, relative_velocity: f64) -> i8 {
    match mode {
        Mode::Engaged if relative_velocity < 0.0 => -1,
        Mode::Engaged => 1,
        mode => mode.sense(),
    }
}

impl<'a> Recurrence<'a> {
    /// Of a run to `end` (s): without one, only its events are looked at.
    pub fn new(trains: &System, inner: &'a mut dyn Recorder, keeps_events: bool, end: Option<f64>) -> Self {
        let stops = twice_resistance(trains).is_some();
        let groups: Vec<usize> = further(trains)
            .iter()
            .map(|one| match one.name.as_str() {
                "bristle_deflection" => 2,
                _ => usize::from(one.is_rate),
            })
            .collect();
        let hits = Hits::new(groups, harmonics(trains));
        let mut strobes = Strobes {
            hits: hits.clone(),
            period: None,
            next: 0,
            sizes: Sizes::default(),
        };
        let end = end.filter(|_| !stops);
        if end.is_some() {
            strobes.begin(0.0);
        }
        Recurrence {
            inner,
            keeps_events,
            sequence: Sequence::default(),
            stops,
            further: Vec::new(),
            hits,
            mode: Mode::Separated,
            sticks: 0,
            stuck_since: 0.0,
            strobes,
            end_time: end,
            next_marks: end.map_or_else(Vec::new, |end| MARKS.iter().rev().map(|share| share * end).collect()),
            marks: Vec::new(),
            last: None,
        }
    }

    fn hit(&mut self, event: &Event) {
        let values = &self.further[self.further.len() / 2..];
        self.hits.push(Hit {
            section: Section {
                time: event.time,
                mode: event.mode_after,
                sense: sense(event.mode_after, event.after.relative_velocity),
                further: values.to_vec(),
            },
            kind: Some(event.kind),
            sticks: self.sticks,
            sizes: sizes_of(values, self.hits.groups()),
        });
    }

    /// When the contact last changed what it did, s, and what it did at the end.
    pub fn end(&self) -> (Option<f64>, Mode) {
        (self.sequence.last().map(|event| event.1), self.mode)
    }

    /// The state at the end of the run; `None` of a run that did not come there, or whose rows do not have all of the state.
    pub fn last_state(&self) -> Option<&Section> {
        let whole = |last: &&Section| last.further.len() == self.hits.groups().len();
        self.last
            .as_ref()
            .filter(|last| self.end_time == Some(last.time))
            .filter(whole)
    }

    /// How often the motion passes a section, as far as it is known: the mean time between breakaways and reversals, s.
    pub fn mean_interval(&self) -> Option<f64> {
        self.hits.mean_interval()
    }

    /// The attractor that the events of the run have come to by its end, if they have.
    pub fn attractor_of_events(&self, trains: &System, threshold: f64) -> Option<Attractor> {
        Some(attractor(&self.hits.repetition()?, trains, threshold))
    }

    /// The attractor that the run has come to by its end, if it has.
    pub fn attractor(&self, trains: &System, threshold: f64) -> Option<Attractor> {
        self.attractor_of_events(trains, threshold)
            .or_else(|| self.attractor_of_forcing(trains, threshold))
            .or_else(|| self.attractor_without_events(trains, threshold))
    }

    fn attractor_of_forcing(&self, trains: &System, threshold: f64) -> Option<Attractor> {
        let repetition = self.strobes.hits.repetition()?;
        let [first, last] = repetition.ends;
        // A contact that has stuck all the time is stuck.
        if last.section.mode == Mode::Stick && self.stuck_since <= first.section.time {
            return None;
        }
        Some(Attractor {
            forcing_periods: Some(repetition.sections as u64),
            period: self.strobes.period? * repetition.sections as f64,
            ..attractor(&repetition, trains, threshold)
        })
    }

    /// Nothing forces the motion at its end, and the contact is closed and does not stick.
    fn end_by_itself(&self) -> Option<&Section> {
        let end = self.last_state()?;
        let slides = end.mode.slides();
        let forced = self.hits.harmonics().iter().any(|harmonic| harmonic.acts_at(end.time));
        (slides && !forced).then_some(end)
    }

    fn attractor_without_events(&self, trains: &System, threshold: f64) -> Option<Attractor> {
        let end = self.end_by_itself()?;
        if self.is_steady(trains, threshold) {
            return None;
        }
        let mut found = None;
        // Steps of the stretch before, which is a part of the next.
        let mut per_second = 0.0;
        for mark in self.marks.iter().rev() {
            let span = end.time - mark.time;
            if per_second * span > smooth::MOST_STEPS as f64 {
                break;
            }
            let mut hits = Hits::new(self.hits.groups().to_vec(), Vec::new());
            let Some(steps) = smooth::sections(trains, threshold, mark, end.time, self.sticks, &mut hits) else {
                break;
            };
            per_second = steps as f64 / span;
            // The longest stretch tells since when.
            if hits.repetition().is_some() {
                found = Some(hits);
            }
        }
        Some(attractor(&found?.repetition()?, trains, threshold))
    }

    /// Whether the contact slides at the end of the run while all states stay as they are.
    pub fn is_steady(&self, trains: &System, threshold: f64) -> bool {
        let ends = self.end_by_itself().zip(self.marks.last());
        ends.is_some_and(|(end, mark)| smooth::is_steady(trains, threshold, [mark, end], self.hits.groups()))
    }
}

/// The attractor of a motion that repeats itself.
fn attractor(repetition: &Repetition<'_>, trains: &System, threshold: f64) -> Attractor {
    let [first, last] = repetition.ends;
    let around = portrait(trains, threshold, &first.section, repetition.period).ok();
    Attractor {
        period: repetition.period,
        sticks: last.sticks - first.sticks,
        sections: repetition.sections,
        forcing_periods: None,
        agreement: repetition.agreement,
        distance: repetition.distance,
        since: repetition.since,
        extremes: around.map(|portrait| Extremes::new(portrait.of, &portrait.points)),
    }
}

/// Least and largest value of a curve through points (time, value, rate), with those between them of cubics.
fn extremes(points: impl Iterator<Item = (f64, f64, f64)> + Clone) -> (f64, f64) {
    let mut bounds = (f64::INFINITY, f64::NEG_INFINITY);
    let mut take = |value: f64| bounds = (bounds.0.min(value), bounds.1.max(value));
    for ((t0, x0, v0), (t1, x1, v1)) in points.clone().zip(points.skip(1)) {
        take(x0);
        take(x1);
        let h = t1 - t0;
        if h <= 0.0 || v0 * v1 >= 0.0 {
            continue;
        }
        // The cubic x0 + h (v0 s + b s^2 + c s^3) and the zero of its rate that lies between.
        let mean = (x1 - x0) / h;
        let (b, c) = (3.0 * mean - 2.0 * v0 - v1, v0 + v1 - 2.0 * mean);
        let discriminant = (b * b - 3.0 * c * v0).max(0.0).sqrt();
        // Without cancellation: v0 + 2 b s + 3 c s^2 = 0.
        let q = -(b + b.signum() * discriminant);
        for s in [q / (3.0 * c), v0 / q] {
            if (0.0..=1.0).contains(&s) {
                take(x0 + h * s * (v0 + s * (b + s * c)));
            }
        }
    }
    bounds
}

impl Extremes {
    fn new(of: &'static str, points: &[PortraitPoint]) -> Extremes {
        let position = extremes(points.iter().map(|p| (p.time, p.position, p.velocity)));
        let relative_velocity = extremes(
            points
                .iter()
                .map(|p| (p.time, p.relative_velocity, p.relative_acceleration)),
        );
        Extremes {
            of,
            position,
            amplitude: (of != "slip").then_some((position.1 - position.0) / 2.0),
            relative_velocity,
        }
    }
}

impl Recorder for Recurrence<'_> {
    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        self.further.clear();
        self.further.extend_from_slice(values);
        self.inner.further(values)
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.mode = sample.mode;
        if self.end_time.is_some() {
            let section = self.last.get_or_insert_with(|| Section {
                time: 0.0,
                mode: sample.mode,
                sense: 0,
                further: Vec::new(),
            });
            section.time = sample.time;
            section.mode = sample.mode;
            section.sense = sense(sample.mode, sample.state.relative_velocity);
            section.further.clone_from(&self.further);
        }
        self.inner.sample(sample)
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.sequence.event(event)?;
        match event.kind {
            EventKind::Slip | EventKind::Reversal if !self.stops => self.hit(event),
            EventKind::Stick => {
                self.sticks += 1;
                self.stuck_since = event.time;
            }
            EventKind::Kick | EventKind::Corner => {
                self.hits.clear();
                if self.end_time.is_some() {
                    self.strobes.begin(event.time);
                }
            }
            _ => {}
        }
        self.marks.clear();
        self.inner.event(event)
    }

    fn next_strobe(&self) -> f64 {
        let mark = self.next_marks.last().copied().unwrap_or(f64::INFINITY);
        self.strobes.time().min(mark)
    }

    fn strobe(&mut self, time: f64, mode: Mode, relative_velocity: f64) -> Result<(), RecorderError> {
        let section = Section {
            time,
            mode,
            sense: sense(mode, relative_velocity),
            further: self.further.clone(),
        };
        if self.next_marks.pop_if(|mark| *mark <= time).is_some() {
            self.marks.push(section.clone());
        }
        let strobes = &mut self.strobes;
        if time < strobes.time() {
            return Ok(());
        }
        strobes.sizes = larger(strobes.sizes, sizes_of(&self.further, strobes.hits.groups()));
        let begins = strobes.next.is_multiple_of(PHASES);
        strobes.next += 1;
        if begins {
            strobes.hits.push(Hit {
                section,
                kind: None,
                sticks: self.sticks,
                sizes: std::mem::take(&mut strobes.sizes),
            });
        }
        Ok(())
    }

    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        self.sequence.segment(segment)?;
        self.inner.segment(segment)
    }

    fn piece(&mut self, piece: &Piece<'_>) -> Result<(), RecorderError> {
        self.inner.piece(piece)
    }

    fn cycle(&mut self, cycle: &Cycle) -> Result<(), RecorderError> {
        self.inner.cycle(cycle)
    }

    fn stores_motion(&self) -> bool {
        self.inner.stores_motion()
    }

    fn stores_events(&self) -> bool {
        !self.keeps_events && self.inner.stores_events()
    }
}
