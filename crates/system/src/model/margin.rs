//! The resistance R, which decides when steady sliding becomes unstable.
//!
//! Each surface swings on its own shaft, whose other end is held. With s = i omega its impedance is Z_i = s J_i +
//! a_i + k_i/s, a_i = c_i + d_i, and both surfaces together have Z = (1/Z_1 + 1/Z_2)^-1. With the contact's damping
//! kappa = r F_n mu' a swing neither grows nor decays if Z = -kappa: Im Z = 0 and Re Z = R = -kappa. The margin is 2
//! (R + kappa) with the least such R. For two equal surfaces it is c_t + 2 r F_n mu', as in the paper.

use super::system::{ContactLaw, End, System, Train};
use crate::numerics::polynomial_roots::first_falling;

/// A surface on its own shaft.
#[derive(Debug, Clone, Copy)]
pub struct MarginSurface {
    /// J, kg m^2.
    pub inertia: f64,
    /// a: damping of the shaft plus damping to the ground, N m s/rad.
    pub damping: f64,
    /// k, N m/rad.
    pub stiffness: f64,
}

impl MarginSurface {
    fn of(train: &Train) -> Option<MarginSurface> {
        let first = |values: &[f64]| values.first().copied().unwrap_or(0.0);
        train.inertia.first().map(|&inertia| MarginSurface {
            inertia,
            damping: first(&train.damping) + first(&train.viscous),
            stiffness: first(&train.stiffness),
        })
    }

    fn frequency_squared(&self) -> f64 {
        self.stiffness / self.inertia
    }

    fn undamped(&self) -> bool {
        self.damping == 0.0 && self.stiffness > 0.0
    }
}

/// 2 R, N m s/rad; `None` without a margin (see [`resistance`]).
pub fn twice_resistance(system: &System) -> Option<f64> {
    resistance(system).ok()
}

/// 2 R, N m s/rad.
///
/// # Errors
/// The reason why there is no margin. Sliding does not slow down by itself, which requires one free train and no
/// drive; or no swing of the surfaces can become unstable; or the contact has no stick, which would end the
/// monitoring of the margin.
pub fn resistance(system: &System) -> Result<f64, &'static str> {
    if system.contact != ContactLaw::StickSlip {
        return Err("a contact without stick is not watched for it");
    }
    slowing(system)?;
    let twice = match [&system.rotor, &system.stator].map(MarginSurface::of) {
        [Some(rotor), Some(stator)] => of_both(&rotor, &stator),
        [Some(one), None] | [None, Some(one)] => (one.stiffness > 0.0).then_some(2.0 * one.damping),
        [None, None] => None,
    };
    twice.ok_or("no surface swings on a shaft of its own")
}

/// Checks whether sliding slows down by itself: one train is free, the other is fixed, and nothing drives them.
///
/// # Errors
/// The reason why it does not.
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

/// Minimum of 2 Re Z over the frequencies at which the surfaces swing against each other, N m s/rad; `None` without a
/// swing.
pub fn of_both(one: &MarginSurface, other: &MarginSurface) -> Option<f64> {
    if one.undamped() || other.undamped() {
        return Some(0.0);
    }
    // The comparison by products is exact for equal surfaces.
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
    // The zeros of Im Z lie between the two squared frequencies, at start + width t. The least resistance is at the
    // first zero from one of the ends.
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

/// Coefficients in t of Im Z = 0, multiplied by its denominators and divided by width. With B_1 = J_1 width t and B_2
/// = -J_2 width (1 - t) the left side is (start + width t) (a_2^2 J_1 t - a_1^2 J_2 (1 - t)) - J_1 J_2 width^2 t (1 -
/// t) (J_1 t - J_2 (1 - t)).
///
/// A slow surface without a shaft has start = 0 and a zero at t = 0. This zero is no swing, and is divided out.
fn reactance(slow: &MarginSurface, fast: &MarginSurface, start: f64, width: f64) -> [f64; 4] {
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

fn mirrored(f: &[f64; 4]) -> [f64; 4] {
    [
        f[0] + f[1] + f[2] + f[3],
        -(f[1] + 2.0 * f[2] + 3.0 * f[3]),
        f[2] + 3.0 * f[3],
        -f[3],
    ]
}

fn first_zero(f: [f64; 4]) -> Option<f64> {
    let size = f.iter().fold(0.0f64, |most, c| most.max(c.abs()));
    let sign = if f[0] < 0.0 { -1.0 } else { 1.0 };
    first_falling(&f.map(|c| sign * c / size))
}

fn real_part(slow: &MarginSurface, fast: &MarginSurface, start: f64, width: f64, share: f64) -> f64 {
    let x = start + width * share;
    let (a1, b1) = (slow.damping, slow.inertia * width * share);
    let (a2, b2) = (fast.damping, -fast.inertia * width * (1.0 - share));
    // |Z|^2 times x.
    let squared = |a: f64, b: f64| a * a * x + b * b;
    (squared(a1, b1) * a2 + squared(a2, b2) * a1) / squared(a1 + a2, b1 + b2)
}
