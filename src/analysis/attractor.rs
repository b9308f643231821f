//! Whether a motion repeats itself.
//!
//! Every breakaway and every reversal is a section of the motion. A period is the time between two sections of one kind, at
//! most [`LONGEST_PERIOD`] sections apart, whose states agree, and by which every harmonic that drives the trains has gone through
//! whole turns. It is looked for anew after a kick and after a corner of a signal. Sliding that slows down by itself repeats nothing.

use super::sequence::Sequence;
use crate::model::Mode;
use crate::model::margin::twice_resistance;
use crate::model::system::System;
use crate::record::{Cycle, Event, EventKind, Piece, Recorder, RecorderError, Sample, Segment};
use crate::signal::{Drive, Frequency};
use crate::simulation::{PortraitPoint, Section, further, portrait};
use serde::Serialize;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Two successive cycles are the same if all twists, twist rates and speeds at their begin differ by less than this share of
/// the largest that the sections have seen, and the two periods by this share.
pub const RECURRENCE_TOLERANCE: f64 = 1e-6;

/// How far from the periodic motion a run may be, by the pace at which its cycles come together, to count as periodic.
const LARGEST_DISTANCE: f64 = 1e-4;

/// A pace beyond which cycles are not seen to come together.
const SLOWEST_PACE: f64 = 0.9999;

/// Of states, what rounding leaves between two cycles that are the same.
const ROUNDING: f64 = 1e-14;

/// The most sections in a period that are looked for.
pub const LONGEST_PERIOD: usize = 64;

/// Turns that a harmonic may miss in a period, beyond what the period itself is uncertain by.
const WHOLE_TURNS: f64 = 1e-9;

/// Frequencies have a ratio of whole numbers if they have it to this share: the rounding of a few digits.
const SAME_RATIO: f64 = 1e-12;

/// What a motion repeats; times in s.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Attractor {
    /// s.
    pub period: f64,
    /// Sticks that begin in a period.
    pub sticks: u64,
    /// Sections (breakaways and reversals) in a period.
    pub sections: usize,
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

/// One section.
#[derive(Debug, Clone)]
struct Hit {
    section: Section,
    kind: EventKind,
    /// Sticks before it.
    sticks: u64,
}

/// Looks for the attractor in the events of a run, keeps their sequence, and passes the run on.
pub(super) struct Recurrence<'a> {
    inner: &'a mut dyn Recorder,
    /// The report of the run keeps the events whether or not `inner` stores them.
    keeps_events: bool,
    /// What has happened.
    pub sequence: Sequence,
    /// The motion comes to a stop.
    stops: bool,
    further: Vec<f64>,
    hits: VecDeque<Hit>,
    /// Of each component, what it is measured with: the angles, the speeds, or the bristles.
    groups: Vec<usize>,
    /// What the contact did last.
    mode: Mode,
    sticks: u64,
    /// Of the harmonics that drive the trains: angular frequency (rad/s), and from when to when they act (s).
    frequencies: Vec<(f64, f64, f64)>,
    /// Sections in a period as known so far, and since when.
    known: Option<(usize, f64)>,
}

fn frequencies<'d>(drives: impl IntoIterator<Item = &'d Drive>) -> Vec<(f64, f64, f64)> {
    fn of(drive: &Drive, found: &mut Vec<(f64, f64, f64)>) {
        match drive {
            Drive::Wave(wave) if wave.amplitude != 0.0 => {
                let omega = match wave.frequency {
                    Frequency::Cycles(f) => TAU * f,
                    Frequency::Angular(omega) => omega,
                };
                let (from, to) = (wave.from.unwrap_or(0.0), wave.to.unwrap_or(f64::INFINITY));
                found.push((omega, from, to));
            }
            Drive::Sum(parts) => parts.iter().for_each(|part| of(part, found)),
            Drive::Wave(_) | Drive::Value(_) | Drive::Linear(_) => {}
        }
    }
    let mut found = Vec::new();
    drives.into_iter().for_each(|drive| of(drive, &mut found));
    found
}

impl<'a> Recurrence<'a> {
    pub fn new(trains: &System, inner: &'a mut dyn Recorder, keeps_events: bool) -> Self {
        Recurrence {
            inner,
            keeps_events,
            sequence: Sequence::default(),
            stops: twice_resistance(trains).is_some(),
            further: Vec::new(),
            hits: VecDeque::new(),
            groups: further(trains)
                .iter()
                .map(|one| match one.name.as_str() {
                    "bristle_deflection" => 2,
                    _ => usize::from(one.is_rate),
                })
                .collect(),
            mode: Mode::Separated,
            sticks: 0,
            frequencies: frequencies(trains.drives()),
            known: None,
        }
    }

    /// The largest angle, speed and deflection of the last sections.
    fn sizes(&self, sections: usize) -> [f64; 3] {
        let mut sizes = [0.0f64; 3];
        for hit in self.hits.iter().rev().take(2 * sections + 1) {
            for (value, &group) in hit.section.further.iter().zip(&self.groups) {
                sizes[group] = sizes[group].max(value.abs());
            }
        }
        sizes
    }

    /// How far the sections `a` and `b` are from each other, relative.
    fn distance(&self, a: &Section, b: &Section, sizes: &[f64; 3]) -> f64 {
        let pairs = a.further.iter().zip(&b.further).zip(&self.groups);
        let distances = pairs.map(|((a, b), &group)| match sizes[group] {
            size if size > 0.0 => (a - b).abs() / size,
            _ => 0.0,
        });
        distances.fold(0.0, f64::max)
    }

    /// The period of `sections` sections that ends at the last, how well it agrees with the one before, and how far from the
    /// periodic motion it is.
    fn repeats(&self, sections: usize) -> Option<(f64, f64, f64)> {
        let from_last = |back: usize| self.hits.len().checked_sub(1 + back).map(|index| &self.hits[index]);
        let (last, one, two) = (from_last(0)?, from_last(sections)?, from_last(2 * sections)?);
        let same = |a: &Hit| {
            a.kind == last.kind && a.section.mode == last.section.mode && a.section.sense == last.section.sense
        };
        if !same(one) || !same(two) {
            return None;
        }
        let period = last.section.time - one.section.time;
        let before = one.section.time - two.section.time;
        if period <= 0.0 {
            return None;
        }
        let sizes = self.sizes(sections);
        let (now, earlier) = (
            self.distance(&last.section, &one.section, &sizes),
            self.distance(&one.section, &two.section, &sizes),
        );
        let agreement = now.max((period - before).abs() / period);
        // Cycles that come together by a factor are off by the rest of the geometric series.
        let pace = if now <= ROUNDING {
            0.0
        } else {
            (now / earlier).min(SLOWEST_PACE)
        };
        let distance = agreement.max(ROUNDING) / (1.0 - pace);
        // Whole turns of each, as near as the periods agree; and of all of them by one period, to the rounding of their ratios.
        let acting: Vec<(f64, f64)> = self
            .frequencies
            .iter()
            .filter(|wave| wave.1 <= last.section.time && last.section.time < wave.2)
            .map(|&(omega, ..)| (omega, (omega * period / TAU).round()))
            .collect();
        let near = |&(omega, turns): &(f64, f64)| {
            (omega * period / TAU - turns).abs() <= WHOLE_TURNS + 3.0 * turns * agreement && turns > 0.0
        };
        let (reference, of_reference) = acting.first().copied().unwrap_or((1.0, 1.0));
        let alike = |&(omega, turns): &(f64, f64)| {
            (omega * of_reference - turns * reference).abs() <= SAME_RATIO * omega * of_reference
        };
        let whole = acting.iter().all(near) && acting.iter().all(alike);
        let repeats = whole && agreement <= RECURRENCE_TOLERANCE && distance <= LARGEST_DISTANCE;
        repeats.then_some((period, agreement, distance))
    }

    fn hit(&mut self, event: &Event) {
        let values = &self.further[self.further.len() / 2..];
        let sense = match event.mode_after {
            Mode::Engaged if event.after.relative_velocity < 0.0 => -1,
            Mode::Engaged => 1,
            mode => mode.sense(),
        };
        self.hits.push_back(Hit {
            section: Section {
                time: event.time,
                mode: event.mode_after,
                sense,
                further: values.to_vec(),
            },
            kind: event.kind,
            sticks: self.sticks,
        });
        if self.hits.len() > 2 * LONGEST_PERIOD + 1 {
            self.hits.pop_front();
        }
        self.known = match self.known {
            Some((sections, since)) if self.repeats(sections).is_some() => Some((sections, since)),
            _ => (1..=LONGEST_PERIOD)
                .find(|&sections| self.repeats(sections).is_some())
                .map(|sections| (sections, event.time)),
        };
    }

    /// When the contact last changed what it did, s, and what it did at the end.
    pub fn end(&self) -> (Option<f64>, Mode) {
        (self.sequence.last().map(|event| event.1), self.mode)
    }

    /// The attractor that the run has come to by its end, if it has.
    pub fn attractor(&self, trains: &System, threshold: f64) -> Option<Attractor> {
        let (known, since) = self.known?;
        // Several periods may come near to themselves before one does.
        let sections = (1..=known).find(|&sections| self.repeats(sections).is_some())?;
        let (period, agreement, distance) = self.repeats(sections)?;
        let last = self.hits.back()?;
        let first = &self.hits[self.hits.len() - 1 - sections];
        let around = portrait(trains, threshold, &first.section, period).ok();
        Some(Attractor {
            period,
            sticks: last.sticks - first.sticks,
            sections,
            agreement,
            distance,
            since,
            extremes: around.map(|portrait| Extremes::new(portrait.of, &portrait.points)),
        })
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
        self.inner.sample(sample)
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.sequence.event(event)?;
        match event.kind {
            EventKind::Slip | EventKind::Reversal if !self.stops => self.hit(event),
            EventKind::Stick => self.sticks += 1,
            EventKind::Kick | EventKind::Corner => {
                self.hits.clear();
                self.known = None;
            }
            _ => {}
        }
        self.inner.event(event)
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
