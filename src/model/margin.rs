//! The resistance that decides when steady sliding becomes unstable.
//!
//! Each surface swings on its own shaft, whose other end is held. With s = i omega its impedance is
//! Z_i = s J_i + a_i + k_i/s, a_i = c_i + d_i, and both together have Z = (1/Z_1 + 1/Z_2)^-1. Under the damping kappa = r F_n mu'
//! of the contact a swing neither grows nor decays where Z = -kappa: Im Z = 0 and Re Z = R = -kappa. The margin is
//! 2 (R + kappa), with the least such R; for two equal surfaces it is c_t + 2 r F_n mu', that of the paper's brake.

use super::system::{ContactLaw, End, System, Train};
use crate::numerics::polynomial_roots::first_falling;

/// A surface on its own shaft.
#[derive(Debug, Clone, Copy)]
struct Surface {
    /// J, kg m^2.
    inertia: f64,
    /// a, of the shaft and to the ground, N m s/rad.
    damping: f64,
    /// k, N m/rad.
    stiffness: f64,
}

impl Surface {
    /// `None` of a rigid one.
    fn of(train: &Train) -> Option<Surface> {
        let first = |values: &[f64]| values.first().copied().unwrap_or(0.0);
        train.inertia.first().map(|&inertia| Surface {
            inertia,
            damping: first(&train.damping) + first(&train.viscous),
            stiffness: first(&train.stiffness),
        })
    }

    /// Of its own swing, (rad/s)^2.
    fn frequency_squared(&self) -> f64 {
        self.stiffness / self.inertia
    }

    /// The swing of this surface decides alone: nothing damps it.
    fn undamped(&self) -> bool {
        self.damping == 0.0 && self.stiffness > 0.0
    }
}

/// 2 R, N m s/rad; `None` where there is no margin, which [`resistance`] says the reason of.
pub fn twice_resistance(system: &System) -> Option<f64> {
    resistance(system).ok()
}

/// 2 R, N m s/rad.
///
/// # Errors
/// Why there is no margin: sliding does not slow down by itself, which takes one free train and no drive; no swing of the surfaces
/// can become unstable; or the contact has no stick, at which the watch over the margin could end.
pub fn resistance(system: &System) -> Result<f64, &'static str> {
    if system.contact != ContactLaw::StickSlip {
        return Err("a contact without stick is not watched for it");
    }
    slowing(system)?;
    let twice = match [&system.rotor, &system.stator].map(Surface::of) {
        [Some(rotor), Some(stator)] => of_both(&rotor, &stator),
        [Some(one), None] | [None, Some(one)] => (one.stiffness > 0.0).then_some(2.0 * one.damping),
        [None, None] => None,
    };
    twice.ok_or("no surface swings on a shaft of its own")
}

/// Whether sliding slows down by itself: one train is free, the other fixed, and nothing drives them.
///
/// # Errors
/// Why it does not.
pub fn slowing(system: &System) -> Result<(), &'static str> {
    let sides = [&system.rotor, &system.stator];
    let free = sides.iter().filter(|train| train.end == End::Free && !train.is_rigid());
    if sides.iter().any(|train| matches!(train.end, End::Driven(_))) {
        return Err("an end is driven, and sliding that is watched slows down by itself");
    }
    if sides.iter().any(|train| train.torque.is_some()) {
        return Err("an external torque acts, and sliding that is watched slows down by itself");
    }
    if free.count() != 1 {
        return Err(
            "sliding that is watched slows down by itself, which takes one train with a free end and one with a fixed end",
        );
    }
    Ok(())
}

fn of_both(one: &Surface, other: &Surface) -> Option<f64> {
    if one.undamped() || other.undamped() {
        return Some(0.0);
    }
    // Of equal frequencies by products, which are exact for equal surfaces.
    if one.stiffness * other.inertia == other.stiffness * one.inertia {
        let twice = if one.damping == other.damping {
            one.damping
        } else {
            2.0 * one.damping * other.damping / (one.damping + other.damping)
        };
        return (one.stiffness > 0.0).then_some(twice);
    }
    let (slow, fast) = if one.frequency_squared() < other.frequency_squared() {
        (one, other)
    } else {
        (other, one)
    };
    let start = slow.frequency_squared();
    let width = fast.frequency_squared() - start;
    // The zeros of Im Z lie between the two frequencies squared, at start + width t. The least resistance belongs to a zero next to
    // one of the ends.
    let from_slow = reactance(slow, fast, start, width);
    let from_fast = mirrored(&from_slow);
    let zeros = [first_zero(from_slow), first_zero(from_fast).map(|share| 1.0 - share)];
    let least = zeros
        .into_iter()
        .flatten()
        .map(|share| real_part(slow, fast, start, width, share))
        .reduce(f64::min)?;
    Some(2.0 * least)
}

/// Coefficients in t of Im Z = 0 cleared of fractions, over width: with B_1 = J_1 width t and B_2 = -J_2 width (1 - t) it is
/// (start + width t) (a_2^2 J_1 t - a_1^2 J_2 (1 - t)) - J_1 J_2 width^2 t (1 - t) (J_1 t - J_2 (1 - t)).
///
/// A slow surface without a shaft has start = 0, and a zero at t = 0, which is no swing: it is divided out.
fn reactance(slow: &Surface, fast: &Surface, start: f64, width: f64) -> [f64; 4] {
    let (j1, j2) = (slow.inertia, fast.inertia);
    let (d1, d2) = (slow.damping * slow.damping * j2, fast.damping * fast.damping * j1);
    let (j, product) = (j1 + j2, j1 * j2 * width * width);
    // a_2^2 J_1 t - a_1^2 J_2 (1 - t) = (d1 + d2) t - d1; t (1 - t) (j t - j2) = -j2 t + (j + j2) t^2 - j t^3.
    let f = [
        -start * d1,
        start * (d1 + d2) - width * d1 + product * j2,
        width * (d1 + d2) - product * (j + j2),
        product * j,
    ];
    if start == 0.0 { [f[1], f[2], f[3], 0.0] } else { f }
}

/// Coefficients in 1 - t.
fn mirrored(f: &[f64; 4]) -> [f64; 4] {
    [
        f[0] + f[1] + f[2] + f[3],
        -(f[1] + 2.0 * f[2] + 3.0 * f[3]),
        f[2] + 3.0 * f[3],
        -f[3],
    ]
}

/// The first zero in (0, 1].
fn first_zero(f: [f64; 4]) -> Option<f64> {
    let size = f.iter().fold(0.0f64, |most, c| most.max(c.abs()));
    let sign = if f[0] < 0.0 { -1.0 } else { 1.0 };
    first_falling(&f.map(|c| sign * c / size))
}

/// Re Z at start + width t.
fn real_part(slow: &Surface, fast: &Surface, start: f64, width: f64, share: f64) -> f64 {
    let x = start + width * share;
    let (a1, b1) = (slow.damping, slow.inertia * width * share);
    let (a2, b2) = (fast.damping, -fast.inertia * width * (1.0 - share));
    // |Z|^2 times x.
    let squared = |a: f64, b: f64| a * a * x + b * b;
    (squared(a1, b1) * a2 + squared(a2, b2) * a1) / squared(a1 + a2, b1 + b2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface([inertia, damping, stiffness]: [f64; 3]) -> Surface {
        Surface {
            inertia,
            damping,
            stiffness,
        }
    }

    /// Re and Im of Z by complex division.
    fn impedance(surfaces: [[f64; 3]; 2], omega: f64) -> [f64; 2] {
        let of = |[j, a, k]: [f64; 3]| nalgebra::Complex::new(a, omega * j - k / omega);
        let [one, other] = surfaces.map(of);
        let both = one * other / (one + other);
        [both.re, both.im]
    }

    /// Against a scan of the zeros of Im Z; its step of 1e-5 of omega leaves 1e-4 of R.
    #[test]
    fn analytic_the_least_resistance_is_that_of_a_scan() {
        for surfaces in [
            [[1.0, 3.0, 100.0], [2.0, 1.0, 900.0]],
            [[1.0, 1.0, 100.0], [2.0, 3.0, 900.0]],
            [[5.0, 2.0, 400.0], [1.0, 1.0, 81.0]],
            [[3.0, 40.0, 100.0], [2.0, 1.0, 900.0]],
            [[2.0, 0.0, 0.0], [1.0, 1.0, 100.0]],
            [[2.0, 0.5, 0.0], [1.0, 1.0, 100.0]],
        ] {
            let at = |k: i32| impedance(surfaces, 0.5 * (1.0 + 1e-5f64).powi(k));
            let zeros = (0..500_000).filter(|k| at(*k)[1] * at(k + 1)[1] <= 0.0);
            let least = zeros.map(|k| 2.0 * at(k)[0]).fold(f64::INFINITY, f64::min);
            for [one, other] in [surfaces, [surfaces[1], surfaces[0]]] {
                let found = of_both(&surface(one), &surface(other)).expect("a swing");
                assert!(
                    (found - least).abs() < 1e-3 * least,
                    "{surfaces:?}: {found} and {least}"
                );
            }
        }
    }

    /// Next to equal frequencies the resistance is that of equal ones.
    #[test]
    fn analytic_nearly_equal_frequencies_are_no_special_case() {
        let (one, other) = (surface([1.0, 3.0, 100.0]), surface([2.0, 1.0, 200.0]));
        let equal = of_both(&one, &other).expect("a swing");
        assert_eq!(equal, 1.5);
        for change in [f64::EPSILON, 1e-12, 1e-8] {
            let near = surface([2.0, 1.0, 200.0 * (1.0 + change)]);
            let found = of_both(&one, &near).expect("a swing");
            assert!((found - equal).abs() < 1e-14 + change, "{change:e}: {found}");
        }
    }

    /// Two surfaces without springs do not swing; an undamped swing has no resistance.
    #[test]
    fn analytic_a_swing_needs_a_spring() {
        let loose = surface([1.0, 2.0, 0.0]);
        assert_eq!(of_both(&loose, &surface([3.0, 1.0, 0.0])), None);
        assert_eq!(of_both(&loose, &surface([3.0, 0.0, 1.0])), Some(0.0));
    }
}
