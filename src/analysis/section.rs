//! Sections of a motion, and the least number of them after which it repeats itself.

use super::forcing::{Harmonic, SAME_RATIO};
use crate::record::EventKind;
use crate::simulation::Section;
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

/// The largest angle, speed and deflection.
pub(super) type Sizes = [f64; 3];

/// The larger of each.
pub(super) fn larger(a: Sizes, b: Sizes) -> Sizes {
    std::array::from_fn(|group| a[group].max(b[group]))
}

/// The largest of these values in each of their groups.
pub(super) fn sizes_of(values: &[f64], groups: &[usize]) -> Sizes {
    let mut sizes = Sizes::default();
    for (value, &group) in values.iter().zip(groups) {
        sizes[group] = sizes[group].max(value.abs());
    }
    sizes
}

/// One section.
#[derive(Debug, Clone)]
pub(super) struct Hit {
    pub section: Section,
    /// The event that it is; `None` of a section at a phase of the forcing, or where a quantity passes zero.
    pub kind: Option<EventKind>,
    /// Sticks before it.
    pub sticks: u64,
    /// The sizes that it has seen.
    pub sizes: Sizes,
}

/// The last sections of one sort.
#[derive(Debug, Clone)]
pub(super) struct Hits {
    hits: VecDeque<Hit>,
    /// Of each component, what it is measured with: the angles, the speeds, or the bristles.
    groups: Vec<usize>,
    harmonics: Vec<Harmonic>,
    /// Sections in a period as known so far, and since when (s).
    known: Option<(usize, f64)>,
}

/// A motion that repeats itself.
pub(super) struct Repetition<'h> {
    /// Sections in a period.
    pub sections: usize,
    /// s.
    pub period: f64,
    /// Relative difference of the last two cycles: of states and of periods the larger.
    pub agreement: f64,
    /// Relative distance of the last cycle from the periodic motion.
    pub distance: f64,
    /// When the motion had come so near to itself, s.
    pub since: f64,
    /// The sections at the begin and at the end of the last period.
    pub ends: [&'h Hit; 2],
}

impl Hits {
    /// Of states whose components have these groups, under these harmonics.
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

    /// The search starts anew.
    pub fn clear(&mut self) {
        self.hits.clear();
        self.known = None;
    }

    /// Mean time between two sections of those kept, s.
    pub fn mean_interval(&self) -> Option<f64> {
        let (first, last) = (self.hits.front()?, self.hits.back()?);
        let interval = (last.section.time - first.section.time) / (self.hits.len() - 1) as f64;
        (self.hits.len() > 2).then_some(interval)
    }

    /// The largest angle, speed and deflection of the last sections.
    fn sizes(&self, sections: usize) -> Sizes {
        let last = self.hits.iter().rev().take(2 * sections + 1);
        last.fold(Sizes::default(), |sizes, hit| larger(sizes, hit.sizes))
    }

    /// Relative distance of two sections.
    fn distance(&self, a: &Section, b: &Section, sizes: &Sizes) -> f64 {
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

    /// Takes the next section.
    pub fn push(&mut self, hit: Hit) {
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

    /// The repetition that ends at the last section, if the motion repeats itself.
    pub fn repetition(&self) -> Option<Repetition<'_>> {
        let (known, since) = self.known?;
        // Several periods may come near to themselves before one does.
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
