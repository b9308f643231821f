//! Check that a candidate follows the reference's equations between its events.

use super::candidate::Candidate;
use super::causes::Observation;
use super::reference::Physics;
use serde::Serialize;
use stickslip_system::model::Mode;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::SequenceEvent;

/// Result of continuing each sample of a candidate by the reference's equations to the next sample.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Follows {
    /// The continued samples agree, except for a small part of the difference.
    pub holds: bool,
    /// Channels of the state that miss the next sample, the farthest first.
    pub channels: Vec<String>,
    /// Start of the misses, s.
    pub from: Option<f64>,
    /// Examined pairs of samples, which have no event in between.
    pub pairs: usize,
}

/// Number of examined pairs, up to the first visible difference.
const MOST_PAIRS: usize = 4096;
const FEWEST_PAIRS: usize = 16;
const MOST_EXPANSIONS: usize = 400;
/// Accumulated miss of a channel, in parts of its size, above which the equations fail. The difference becomes visible
/// at a thousandth.
const MISSED: f64 = 1e-4;
/// First part of the miss that counts, and part of the farthest channel's miss above which others are named.
const FIRST: f64 = 1e-2;
const NAMED: f64 = 0.3;
/// Most intervals left out on each side of an event; relative tolerance of event times; and factor of the rounding of
/// samples.
const BESIDE: f64 = 4.0;
const NEAR: f64 = 1e-9;
const ROUNDINGS: f64 = 4.0;
/// Speeds up to this part of slip speeds may be rest, and this part is rest.
const SLOW: f64 = 1e-6;
const REST: f64 = 1e-12;
/// A pair misses if it exceeds this part of the mean miss. Wrong equations miss in at least this part of the pairs.
const MUCH: f64 = 0.1;
const MANY: f64 = 0.1;

/// Continues each sample up to `row` by the equations. `events` are the candidate's, with uncertainty `bound` (s);
/// `breaks` (s) are changes of the equations. `None` without the whole state, with too few samples between events, or
/// if the result is uncertain: an instability amplifies invisible differences, or the samples are too coarse.
pub(super) fn follows(
    (physics, candidate, seen): (&Physics, &Candidate, &Observation),
    (events, bound): (&[SequenceEvent], f64),
    breaks: &[f64],
    row: usize,
) -> Option<Follows> {
    let columns = physics.columns(&seen.channels)?;
    let system = physics.system();
    let (mut course, period) = (physics.course(), physics.natural_period());
    let state = |row: usize| {
        let mut y = vec![0.0; system.dimension];
        physics.set(&mut y, |k| seen.values[columns[k]][row]);
        y
    };
    let last = (row + FEWEST_PAIRS).min(seen.time.len().checked_sub(1)?);
    let mut missed: Vec<Vec<(f64, f64)>> = vec![Vec::new(); columns.len()];
    let (mut pairs, mut forgiven) = (0, 0.0);
    let first = last.saturating_sub(MOST_PAIRS);
    let slow = SLOW * physics.speed();
    for row in first..last {
        let (from, to) = (seen.time[row], seen.time[row + 1]);
        // An event that the samples show may be in the next interval.
        let near = NEAR * to.abs() + bound.clamp(to - from, BESIDE * (to - from));
        let inside = |time: f64| (from - near..=to + near).contains(&time);
        if to - from > period || breaks.iter().any(|time| inside(*time)) || events.iter().any(|e| inside(e.time)) {
            continue;
        }
        let mut y = state(row);
        let outside = course.outside(from);
        let mode = match events.iter().rfind(|event| event.time < from) {
            _ if !physics.sticks() => Mode::Engaged,
            Some(event) if event.kind == EventKind::Stick => Mode::Stick,
            Some(event) if event.kind == EventKind::Separation => Mode::Separated,
            None if events.first().is_some_and(|event| event.kind == EventKind::Slip) => Mode::Stick,
            _ => match system.relative_velocity(&outside, &y) {
                velocity if velocity.abs() <= slow => continue,
                velocity => Mode::sliding(velocity),
            },
        };
        if mode == Mode::Stick {
            // Creep in stick, or a stick that keeps its initial speed, has another law at rest.
            if system.relative_velocity(&outside, &y).abs() > REST * physics.speed() {
                continue;
            }
            system.join(&outside, &mut y);
        }
        if !course.go(mode, (from, to), &mut y, MOST_EXPANSIONS, &mut |_, _| {}) {
            continue;
        }
        pairs += 1;
        // Rounding of a position appears in a speed with the rate of the fastest motion.
        let rounding = columns.iter().enumerate().map(|(k, &column)| {
            let of = |row: usize| candidate.rounding_of(physics.state[k], seen.values[column][row]);
            of(row).max(of(row + 1)) / seen.sizes[column]
        });
        let rounding = rounding.fold(0.0, f64::max) * (1.0 + (to - from) * course.fastest_rate());
        let clock = &candidate.clock;
        let of_time = clock.rounding.map_or(0.0, |rounding| clock.quantum(rounding, to));
        let rounding = rounding + of_time * course.fastest_rate();
        forgiven += ROUNDINGS * rounding;
        for (k, &column) in columns.iter().enumerate() {
            let off = (seen.values[column][row + 1] - y[physics.places[k]]).abs() / seen.sizes[column];
            missed[k].push((to, (off - ROUNDINGS * rounding).max(0.0)));
        }
    }
    if pairs < FEWEST_PAIRS {
        return None;
    }
    let sums = missed.iter().map(|of| of.iter().map(|(_, part)| part).sum::<f64>());
    let mut sums: Vec<(usize, f64)> = sums.enumerate().collect();
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (farthest, largest) = *sums.first()?;
    let holds = largest < MISSED;
    // A late event makes a few pairs miss, a wrong equation many.
    let much = MUCH * largest / pairs as f64;
    let missing = missed[farthest].iter().filter(|(_, part)| *part > much).count();
    let is_known = if holds {
        !physics.coasts() && forgiven < MISSED && first == 0
    } else {
        missing as f64 >= MANY * pairs as f64
    };
    if !is_known {
        return None;
    }
    let named = sums.iter().take_while(|(_, sum)| !holds && *sum >= NAMED * largest);
    let from = missed[farthest].iter().scan(0.0, |sum, (time, part)| {
        *sum += part;
        Some((*time, *sum))
    });
    let from = from
        .filter(|(_, sum)| *sum >= FIRST * largest)
        .map(|(time, _)| time)
        .next();
    Some(Follows {
        holds,
        channels: named.map(|(k, _)| physics.state[*k].name().to_string()).collect(),
        from: from.filter(|_| !holds),
        pairs,
    })
}
