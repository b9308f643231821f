//! The harmonics that force a system, and their common period.

use crate::model::system::System;
use crate::signal::{Drive, Wave};
use std::f64::consts::TAU;

/// A harmonic of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Harmonic {
    /// rad/s.
    pub angular_frequency: f64,
    /// When it acts: from (s) until (s).
    pub acts: (f64, f64),
}

impl Harmonic {
    fn of(wave: &Wave) -> Harmonic {
        Harmonic {
            angular_frequency: wave.angular_frequency(),
            acts: (wave.from.unwrap_or(0.0), wave.to.unwrap_or(f64::INFINITY)),
        }
    }

    /// Whether it acts at a time (s).
    pub fn acts_at(&self, time: f64) -> bool {
        self.acts.0 <= time && time < self.acts.1
    }
}

/// Two frequencies have a ratio of whole numbers if they have it to this relative difference: the rounding of a few digits.
pub(crate) const SAME_RATIO: f64 = 1e-12;

/// Largest whole number in the ratio of two frequencies that is looked for.
const LARGEST_WHOLE: f64 = 1000.0;

/// The harmonics of all drives of a system, but for those without an amplitude.
pub(crate) fn harmonics(system: &System) -> Vec<Harmonic> {
    fn of(drive: &Drive, found: &mut Vec<Harmonic>) {
        match drive {
            Drive::Wave(wave) if wave.amplitude != 0.0 => found.push(Harmonic::of(wave)),
            Drive::Sum(parts) => parts.iter().for_each(|part| of(part, found)),
            Drive::Wave(_) | Drive::Value(_) | Drive::Linear(_) => {}
        }
    }
    let mut found = Vec::new();
    system.drives().into_iter().for_each(|drive| of(drive, &mut found));
    found
}

/// The least period (s) of the forcing that lasts: of all harmonics that never end. `None` without one, or where no two whole
/// numbers of at most 1000 are the ratio of two frequencies.
pub(crate) fn forcing_period(system: &System) -> Option<f64> {
    let lasting = harmonics(system);
    common_period(lasting.iter().filter(|harmonic| harmonic.acts.1 == f64::INFINITY))
}

/// The least time (s) in which each of these harmonics goes through whole turns; `None` as for [`forcing_period`].
pub(crate) fn common_period<'h>(acting: impl IntoIterator<Item = &'h Harmonic> + Clone) -> Option<f64> {
    let first = acting.clone().into_iter().next()?.angular_frequency.abs();
    let period = TAU * common_turns(acting)? as f64 / first;
    period.is_finite().then_some(period)
}

/// Turns of the first of these harmonics in the least time in which each goes through whole turns; `None` as for [`forcing_period`].
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

/// The whole numbers whose ratio `x` is to rounding, without a common divisor, by its continued fraction.
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

/// The greatest common divisor.
fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn harmonic(angular_frequency: f64) -> Harmonic {
        Harmonic {
            angular_frequency,
            acts: (0.0, f64::INFINITY),
        }
    }

    #[test]
    fn analytic_the_common_period_holds_whole_turns_of_each() {
        let period = |frequencies: &[f64]| {
            let harmonics: Vec<Harmonic> = frequencies.iter().copied().map(harmonic).collect();
            common_period(&harmonics)
        };
        let is = |frequencies: &[f64], expected: f64| {
            let found = period(frequencies).unwrap();
            assert!((found - expected).abs() <= 1e-14 * expected, "{frequencies:?}: {found}");
        };
        is(&[1.709], TAU / 1.709);
        is(&[2.0, 3.0], TAU);
        is(&[0.7, 0.5], TAU / 0.1);
        is(&[0.3, 0.2, 0.7], TAU / 0.1);
        is(&[1.0, 1.0], TAU);
        is(&[0.1, 3.0], TAU / 0.1);
        // In Hz.
        is(&[TAU * 440.0, TAU * 60.0], 0.05);
        assert_eq!(period(&[]), None);
        assert_eq!(period(&[1.0, 2.0f64.sqrt()]), None);
        assert_eq!(period(&[0.5, 0.5000002]), None);
        assert_eq!(period(&[1.0, 0.0]), None);
        assert_eq!(period(&[0.0]), None);
    }
}
