//! End of a motion without forcing and contact events: sections of a cycle, or steady sliding.

use super::attractor::sense;
use super::section::{Hits, RECURRENCE_TOLERANCE, SectionHit, Sizes, larger, sizes_of};
use stickslip_engine::simulation::{Course, CourseQuantity, Section, SolverOptions};
use stickslip_system::model::system::System;
use stickslip_system::numerics::bisection::bisect;

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
