//! Sections of a motion, and the least number of them in a period; sections of a motion without forcing and events.

use super::forcing::{Harmonic, SAME_RATIO};
use std::collections::VecDeque;
use std::f64::consts::TAU;
use stickslip_engine::simulation::{Course, CourseQuantity, Section, SolverOptions};
use stickslip_system::model::Mode;
use stickslip_system::model::system::System;
use stickslip_system::numerics::bisection::bisect;
use stickslip_system::record::EventKind;

/// Two successive cycles agree if twists, twist rates and speeds at their start differ by less than this fraction of
/// the largest ones in the sections, and their periods by less than this fraction.
pub const RECURRENCE_TOLERANCE: f64 = 1e-6;

/// Largest distance to the periodic motion, extrapolated from the convergence of the cycles, that counts as periodic.
const LARGEST_DISTANCE: f64 = 1e-4;

/// Ratio of successive differences above which cycles do not count as converging.
const SLOWEST_PACE: f64 = 0.9999;

/// Relative rounding of states between two equal cycles.
const ROUNDING: f64 = 1e-14;

/// Largest number of sections in a period.
pub const LONGEST_PERIOD: usize = 64;

/// Turns by which a harmonic may miss a whole number in a period, in addition to the period's uncertainty.
const WHOLE_TURNS: f64 = 1e-9;

/// Sign of the relative velocity (rad/s): known from the mode of a sliding contact, but not of an engaged one.
pub(super) fn sense(mode: Mode, relative_velocity: f64) -> i8 {
    match mode {
        Mode::Engaged if relative_velocity < 0.0 => -1,
        Mode::Engaged => 1,
        mode => mode.sense(),
    }
}

/// Largest angle, speed and deflection.
pub(super) type Sizes = [f64; 3];

pub(super) fn larger(a: Sizes, b: Sizes) -> Sizes {
    std::array::from_fn(|group| a[group].max(b[group]))
}

pub(super) fn sizes_of(values: &[f64], groups: &[usize]) -> Sizes {
    let mut sizes = Sizes::default();
    for (value, &group) in values.iter().zip(groups) {
        sizes[group] = sizes[group].max(value.abs());
    }
    sizes
}

#[derive(Debug, Clone)]
pub(super) struct SectionHit {
    pub section: Section,
    /// Event of the section; `None` for a phase of the forcing or a zero of a quantity.
    pub kind: Option<EventKind>,
    pub sticks: u64,
    /// Sizes since the previous section.
    pub sizes: Sizes,
}

#[derive(Debug, Clone)]
pub(super) struct Hits {
    hits: VecDeque<SectionHit>,
    /// Group of each component: angles, speeds, or bristles.
    groups: Vec<usize>,
    harmonics: Vec<Harmonic>,
    /// Sections in the current period, and the time since which it holds (s).
    known: Option<(usize, f64)>,
}

pub(super) struct Repetition<'h> {
    pub sections: usize,
    pub period: f64,
    pub agreement: f64,
    pub distance: f64,
    pub since: f64,
    pub ends: [&'h SectionHit; 2],
}

impl Hits {
    pub fn new(groups: Vec<usize>, harmonics: Vec<Harmonic>) -> Hits {
        Hits {
            hits: VecDeque::new(),
            groups,
            harmonics,
            known: None,
        }
    }

    pub fn groups(&self) -> &[usize] {
        &self.groups
    }

    pub fn harmonics(&self) -> &[Harmonic] {
        &self.harmonics
    }

    pub fn clear(&mut self) {
        self.hits.clear();
        self.known = None;
    }

    pub fn mean_interval(&self) -> Option<f64> {
        let (first, last) = (self.hits.front()?, self.hits.back()?);
        let interval = (last.section.time - first.section.time) / (self.hits.len() - 1) as f64;
        (self.hits.len() > 2).then_some(interval)
    }

    fn sizes(&self, sections: usize) -> Sizes {
        let last = self.hits.iter().rev().take(2 * sections + 1);
        last.fold(Sizes::default(), |sizes, hit| larger(sizes, hit.sizes))
    }

    fn distance(&self, a: &Section, b: &Section, sizes: &Sizes) -> f64 {
        let pairs = a.further.iter().zip(&b.further).zip(&self.groups);
        let distances = pairs.map(|((a, b), &group)| match sizes[group] {
            size if size > 0.0 => (a - b).abs() / size,
            _ => 0.0,
        });
        distances.fold(0.0, f64::max)
    }

    /// Period of `sections` sections at the end (s), agreement with the previous period, distance to the periodic
    /// motion.
    fn repeats(&self, sections: usize) -> Option<(f64, f64, f64)> {
        let from_last = |back: usize| self.hits.len().checked_sub(1 + back).map(|index| &self.hits[index]);
        let (last, one, two) = (from_last(0)?, from_last(sections)?, from_last(2 * sections)?);
        let same = |a: &SectionHit| {
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
        // The remaining error of converging cycles is the rest of a geometric series.
        let pace = if now <= ROUNDING {
            0.0
        } else {
            (now / earlier).min(SLOWEST_PACE)
        };
        let distance = agreement.max(ROUNDING) / (1.0 - pace);
        // Each harmonic completes whole turns, and all have a common period, to the rounding of their ratios.
        let acting: Vec<(f64, f64)> = self
            .harmonics
            .iter()
            .filter(|harmonic| harmonic.acts_at(last.section.time))
            .map(|harmonic| harmonic.angular_frequency)
            .map(|omega| (omega, (omega * period / TAU).round()))
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

    pub fn push(&mut self, hit: SectionHit) {
        let time = hit.section.time;
        self.hits.push_back(hit);
        if self.hits.len() > 2 * LONGEST_PERIOD + 1 {
            self.hits.pop_front();
        }
        self.known = match self.known {
            Some((sections, since)) if self.repeats(sections).is_some() => Some((sections, since)),
            _ => (1..=LONGEST_PERIOD)
                .find(|&sections| self.repeats(sections).is_some())
                .map(|sections| (sections, time)),
        };
    }

    pub fn repetition(&self) -> Option<Repetition<'_>> {
        let (known, since) = self.known?;
        // Multiples of the least period can match before the least period does.
        let sections = (1..=known).find(|&sections| self.repeats(sections).is_some())?;
        let (period, agreement, distance) = self.repeats(sections)?;
        let last = self.hits.back()?;
        let first = &self.hits[self.hits.len() - 1 - sections];
        Some(Repetition {
            sections,
            period,
            agreement,
            distance,
            since,
            ends: [first, last],
        })
    }
}

pub(super) const MOST_STEPS: usize = 5_000;

/// Intervals per step in the search for zeros. A step lasts about a radian of the fastest motion.
const INTERVALS: u32 = 16;

const BISECTIONS: usize = 50;

/// Fraction of the largest speed below which states are constant to the errors of the run.
const AT_REST: f64 = 1e-9;

fn rate(series: &[f64], x: f64) -> f64 {
    let powers = series.iter().enumerate().skip(1).rev();
    powers.fold(0.0, |sum, (n, c)| sum * x + n as f64 * c)
}

/// Adds the minima of the relative velocity up to `end` (s) to `hits`. Returns the steps if `end` was reached.
pub(super) fn sections(
    trains: &System,
    threshold: f64,
    from: &Section,
    end: f64,
    sticks: u64,
    hits: &mut Hits,
) -> Option<usize> {
    let mut course = Course::new(trains, threshold, &SolverOptions::default());
    let mut y = course.state_of(&from.further);
    let (mode, mut time) = (from.mode, from.time);
    let mut before = f64::NAN;
    let mut sizes = Sizes::default();
    for step in 0..MOST_STEPS {
        if time >= end {
            return Some(step);
        }
        let length = course.expand(mode, time, &y, end - time);
        if length.is_nan() || time + length <= time {
            return None;
        }
        sizes = larger(sizes, sizes_of(&course.further_of(mode, time, &y), hits.groups()));
        let (series, terms) = course.series(CourseQuantity::RelativeVelocity, length);
        let acceleration = |share: f64| rate(&series[..terms], share) / length;
        let mut low = 0.0;
        for interval in 0..=INTERVALS {
            let high = f64::from(interval) / f64::from(INTERVALS);
            let now = acceleration(high);
            if before < 0.0 && now >= 0.0 {
                let (_, share) = bisect(low, high, BISECTIONS, |share| acceleration(share) < 0.0);
                let mut state = y.clone();
                course.after(share * length, &mut state);
                let further = course.further_of(mode, time + share * length, &state);
                hits.push(SectionHit {
                    sizes: larger(sizes, sizes_of(&further, hits.groups())),
                    section: Section {
                        time: time + share * length,
                        mode,
                        sense: sense(mode, course.relative_velocity(share * length)),
                        further,
                    },
                    kind: None,
                    sticks,
                });
                sizes = Sizes::default();
            }
            (before, low) = (now, high);
        }
        course.after(length, &mut y);
        time += length;
    }
    None
}

/// Whether the states are constant at `end`, and no less constant than at the earlier `mark`.
pub(super) fn is_steady(trains: &System, threshold: f64, [mark, end]: [&Section; 2], groups: &[usize]) -> bool {
    let mut course = Course::new(trains, threshold, &SolverOptions::default());
    let mut unrest = |section: &Section| {
        let y = course.state_of(&section.further);
        let unrest = course.unrest(section.mode, section.time, &y);
        (unrest, course.relative_velocity(0.0).abs())
    };
    let ((before, _), (now, sliding)) = (unrest(mark), unrest(end));
    // The inertias may rest while a belt moves.
    let mut sizes = sizes_of(&end.further, groups);
    sizes[1] = sizes[1].max(sliding);
    let pairs = mark.further.iter().zip(&end.further).zip(groups);
    let mut same = pairs.map(|((a, b), &group)| (a - b).abs() <= RECURRENCE_TOLERANCE * sizes[group]);
    let rests = now <= RECURRENCE_TOLERANCE * sizes[1] && (now <= before || now <= AT_REST * sizes[1]);
    mark.mode == end.mode && rests && same.all(|same| same)
}
