//! Harmonics that force a system, and their common period.

use std::f64::consts::TAU;
use stickslip_system::model::system::System;
use stickslip_system::signal::{Drive, Frequency, Wave};

/// Harmonic of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// Angular frequency, rad/s.
    pub angular_frequency: f64,
    /// Start and end of its action, s.
    pub acts: (f64, f64),
}

impl Harmonic {
    fn of(wave: &Wave) -> Harmonic {
        let from = wave.from.unwrap_or(0.0);
        // A chirp repeats after its sweep.
        let from = match wave.frequency {
            Frequency::Sweep { duration, .. } => from.max(duration),
            _ => from,
        };
        Harmonic {
            angular_frequency: wave.angular_frequency(),
            acts: (from, wave.to.unwrap_or(f64::INFINITY)),
        }
    }

    /// Whether the harmonic acts at a time (s).
    pub fn acts_at(&self, time: f64) -> bool {
        self.acts.0 <= time && time < self.acts.1
    }
}

/// Relative tolerance of a ratio of whole numbers: the rounding of a few digits.
pub(crate) const SAME_RATIO: f64 = 1e-12;

const LARGEST_WHOLE: f64 = 1000.0;

pub(crate) fn harmonics(system: &System) -> Vec<Harmonic> {
    let waves = system.drives().into_iter().flat_map(Drive::waves);
    waves.filter(|wave| wave.amplitude != 0.0).map(Harmonic::of).collect()
}

/// Least common period (s) of all lasting harmonics. `None` without one, or if a ratio needs whole numbers above 1000.
pub(crate) fn forcing_period(system: &System) -> Option<f64> {
    let lasting = harmonics(system);
    common_period(lasting.iter().filter(|harmonic| harmonic.acts.1 == f64::INFINITY))
}

/// Least time (s) in which each harmonic completes whole turns; `None` as in `forcing_period`.
pub fn common_period<'h>(acting: impl IntoIterator<Item = &'h Harmonic> + Clone) -> Option<f64> {
    let first = acting.clone().into_iter().next()?.angular_frequency.abs();
    let period = TAU * common_turns(acting)? as f64 / first;
    period.is_finite().then_some(period)
}

/// Turns of the first harmonic in [`common_period`]; `None` as in [`forcing_period`].
pub(crate) fn common_turns<'h>(acting: impl IntoIterator<Item = &'h Harmonic>) -> Option<u64> {
    let mut frequencies = acting.into_iter().map(|harmonic| harmonic.angular_frequency.abs());
    let first = frequencies.next()?;
    let mut turns = 1u64;
    for other in frequencies {
        let (_, denominator) = ratio(other / first)?;
        turns = turns / divisor(turns, denominator) * denominator;
    }
    (turns as f64 <= LARGEST_WHOLE).then_some(turns)
}

/// Coprime whole numbers with ratio `x`, to rounding, by its continued fraction.
fn ratio(x: f64) -> Option<(u64, u64)> {
    let (mut before, mut now) = ((0.0, 1.0), (1.0, 0.0));
    let mut rest = x;
    loop {
        let whole = rest.floor();
        (before, now) = (now, (whole * now.0 + before.0, whole * now.1 + before.1));
        let (numerator, denominator): (f64, f64) = now;
        let largest = numerator.max(denominator);
        if largest.is_nan() || largest > LARGEST_WHOLE {
            return None;
        }
        if numerator > 0.0 && (x * denominator - numerator).abs() <= SAME_RATIO * numerator {
            return Some((numerator as u64, denominator as u64));
        }
        rest = 1.0 / (rest - whole);
    }
}

fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}
