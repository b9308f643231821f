//! Detection of periodic motion.
//!
//! Every breakaway and every reversal is a section of the motion. A period is the time between two sections of the
//! same kind, at most [`LONGEST_PERIOD`](super::section::LONGEST_PERIOD) sections apart, whose states agree. Every
//! harmonic that drives the trains must complete whole turns in it. The search starts anew after a kick and after a
//! corner of a signal. Sliding that slows down by itself has no period.
//!
//! If these events show no period, the states after whole periods of the forcing are the sections. Without forcing and
//! without further contact events, the minima of the relative velocity are the sections.

use super::forcing::{common_period, harmonics};
use super::section::{self, Hits, Repetition, SectionHit, Sizes, larger, sense, sizes_of};
use super::sequence::Sequence;
use serde::Serialize;
use stickslip_engine::simulation::{PortraitPoint, Section, further, portrait};
use stickslip_system::model::Mode;
use stickslip_system::model::margin::twice_resistance;
use stickslip_system::model::system::System;
use stickslip_system::record::{Cycle, DensePiece, Event, EventKind, Recorder, RecorderError, Sample, Segment};

/// Strobes per period of the forcing. The first is a section; the others measure the size of the motion.
const PHASES: u64 = 8;

/// Fractions of the end time. A motion without events is integrated again from each of them.
const MARKS: [f64; 4] = [1.0 / 2.0, 3.0 / 4.0, 15.0 / 16.0, 63.0 / 64.0];

/// Periodic motion at the end of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Attractor {
    /// Period, s.
    pub period: f64,
    /// Sticks that begin in a period.
    pub sticks: u64,
    /// Sections in a period: breakaways and reversals, periods of the forcing, or minima of the relative velocity.
    pub sections: usize,
    /// Periods of the forcing in a period, if these are the sections.
    pub forcing_periods: Option<u64>,
    /// Relative difference between the last two cycles: the larger of states and periods.
    pub agreement: f64,
    /// Relative distance to the periodic motion, from the convergence of the last three cycles: a bound on its digits.
    pub distance: f64,
    /// Time from which the cycles agree this well, s.
    pub since: f64,
    /// Extremes over the last period; `None` if that period could not be integrated again.
    pub extremes: Option<Extremes>,
}

/// Extremes over one period.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Extremes {
    /// Position: "stator" or "rotor" surface beside the far end of its train, "rotor twist" or "stator twist" (shaft
    /// 0), or "slip".
    pub of: &'static str,
    /// Least and largest position, rad (m in translation).
    pub position: (f64, f64),
    /// Half of the difference; `None` for a slip displacement, which drifts from period to period.
    pub amplitude: Option<f64>,
    /// Least and largest relative velocity omega_r, rad/s.
    pub relative_velocity: (f64, f64),
}

#[derive(Debug, Clone)]
struct Strobes {
    hits: Hits,
    period: Option<f64>,
    next: u64,
    sizes: Sizes,
}

impl Strobes {
    fn time(&self) -> f64 {
        let time = |period: f64| self.next as f64 * (period / PHASES as f64);
        self.period.map_or(f64::INFINITY, time)
    }

    fn begin(&mut self, time: f64) {
        self.hits.clear();
        self.sizes = Sizes::default();
        self.period = common_period(self.hits.harmonics().iter().filter(|harmonic| harmonic.acts_at(time)));
        self.next = match self.period {
            Some(period) => (time / period * PHASES as f64).ceil() as u64,
            None => 0,
        };
        // The division may round down.
        if self.time() < time {
            self.next += 1;
        }
    }
}

pub(super) struct Recurrence<'a> {
    inner: &'a mut dyn Recorder,
    /// The report keeps the events even if `inner` does not store them.
    keeps_events: bool,
    pub sequence: Sequence,
    stops: bool,
    further: Vec<f64>,
    hits: Hits,
    mode: Mode,
    sticks: u64,
    stuck_since: f64,
    strobes: Strobes,
    /// End of the run, s; `None` if only its events are examined.
    end_time: Option<f64>,
    /// Mark times in descending order, s.
    next_marks: Vec<f64>,
    marks: Vec<Section>,
    last: Option<Section>,
}

impl<'a> Recurrence<'a> {
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
        self.hits.push(SectionHit {
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

    pub fn end(&self) -> (Option<f64>, Mode) {
        (self.sequence.last().map(|event| event.1), self.mode)
    }

    pub fn last_state(&self) -> Option<&Section> {
        let whole = |last: &&Section| last.further.len() == self.hits.groups().len();
        self.last
            .as_ref()
            .filter(|last| self.end_time == Some(last.time))
            .filter(whole)
    }

    pub fn mean_interval(&self) -> Option<f64> {
        self.hits.mean_interval()
    }

    pub fn attractor_of_events(&self, trains: &System, threshold: f64) -> Option<Attractor> {
        Some(attractor(&self.hits.repetition()?, trains, threshold))
    }

    pub fn attractor(&self, trains: &System, threshold: f64) -> Option<Attractor> {
        self.attractor_of_events(trains, threshold)
            .or_else(|| self.attractor_of_forcing(trains, threshold))
            .or_else(|| self.attractor_without_events(trains, threshold))
    }

    fn attractor_of_forcing(&self, trains: &System, threshold: f64) -> Option<Attractor> {
        let repetition = self.strobes.hits.repetition()?;
        let [first, last] = repetition.ends;
        // A contact that sticks over the whole period has no cycle.
        if last.section.mode == Mode::Stick && self.stuck_since <= first.section.time {
            return None;
        }
        Some(Attractor {
            forcing_periods: Some(repetition.sections as u64),
            period: self.strobes.period? * repetition.sections as f64,
            ..attractor(&repetition, trains, threshold)
        })
    }

    /// State at the end if no force drives the motion and the closed contact slides.
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
        // Steps per second of the previous stretch, which is part of the next.
        let mut per_second = 0.0;
        for mark in self.marks.iter().rev() {
            let span = end.time - mark.time;
            if per_second * span > section::MOST_STEPS as f64 {
                break;
            }
            let mut hits = Hits::new(self.hits.groups().to_vec(), Vec::new());
            let Some(steps) = section::sections(trains, threshold, mark, end.time, self.sticks, &mut hits) else {
                break;
            };
            per_second = steps as f64 / span;
            // The longest stretch determines `since`.
            if hits.repetition().is_some() {
                found = Some(hits);
            }
        }
        Some(attractor(&found?.repetition()?, trains, threshold))
    }

    pub fn is_steady(&self, trains: &System, threshold: f64) -> bool {
        let ends = self.end_by_itself().zip(self.marks.last());
        ends.is_some_and(|(end, mark)| section::is_steady(trains, threshold, [mark, end], self.hits.groups()))
    }
}

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

/// Least and largest value of the cubics through points (time, value, rate).
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
        // The cubic x0 + h (v0 s + b s^2 + c s^3) and the zeros of its rate in between.
        let mean = (x1 - x0) / h;
        let (b, c) = (3.0 * mean - 2.0 * v0 - v1, v0 + v1 - 2.0 * mean);
        let discriminant = (b * b - 3.0 * c * v0).max(0.0).sqrt();
        // Roots of v0 + 2 b s + 3 c s^2 = 0 without cancellation.
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
            strobes.hits.push(SectionHit {
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

    fn piece(&mut self, piece: &DensePiece<'_>) -> Result<(), RecorderError> {
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
