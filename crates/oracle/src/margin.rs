//! The resistance that decides when steady sliding becomes unstable.
//!
//! Each surface swings on its own shaft, whose other end is held. With s = i omega its impedance is
//! Z_i = s J_i + a_i + k_i/s, where a_i = c_i + d_i. Both surfaces together have Z = (1/Z_1 + 1/Z_2)^-1. With the
//! contact's damping kappa = r F_n mu' an oscillation neither grows nor decays if Z = -kappa: Im Z = 0 and
//! Re Z = R = -kappa. The margin is 2 (R + kappa), with the least such R. With x = omega^2 and B_i = J_i x - k_i,
//! Im Z = 0 where
//!
//! ```text
//! f(x) = x (a_1^2 B_2 + a_2^2 B_1) + B_1 B_2 (B_1 + B_2) = 0.
//! ```
//!
//! f is negative below both natural frequencies and positive above: its zeros lie between.

use super::float::Float;
use super::roots::{Crossing, first_zero};
use num_rational::BigRational;
use num_traits::{Signed, Zero};
use stickslip_system::model::system::{End, ExactSystem, Train};

/// A surface on its own shaft.
pub struct ExactSurface {
    /// J, kg m^2.
    pub inertia: BigRational,
    /// Damping a of the shaft and to the ground, N m s/rad.
    pub damping: BigRational,
    /// k, N m/rad.
    pub stiffness: BigRational,
}

impl ExactSurface {
    fn of(train: &Train<BigRational>) -> Option<ExactSurface> {
        let first = |values: &[BigRational]| values.first().cloned().unwrap_or_default();
        train.inertia.first().map(|inertia| ExactSurface {
            inertia: inertia.clone(),
            damping: first(&train.damping) + first(&train.viscous),
            stiffness: first(&train.stiffness),
        })
    }

    fn frequency_squared(&self) -> BigRational {
        &self.stiffness / &self.inertia
    }
}

/// 2 R, N m s/rad. `None` if sliding does not slow down by itself (this needs one free train and no drive), or if no
/// oscillation of the surfaces can become unstable.
pub(super) fn twice_resistance<const N: usize>(exact: &ExactSystem) -> Option<Float<N>> {
    let chains = [&exact.rotor, &exact.stator];
    let free = chains
        .iter()
        .filter(|train| train.end == End::Free && !train.is_rigid());
    let driven = |train: &&Train<BigRational>| matches!(train.end, End::Driven(_)) || train.torque.is_some();
    if free.count() != 1 || chains.iter().any(driven) {
        return None;
    }
    match chains.map(ExactSurface::of) {
        [Some(rotor), Some(stator)] => of_both(&rotor, &stator),
        [Some(one), None] | [None, Some(one)] => {
            let swings = one.stiffness.is_positive();
            swings.then(|| Float::from_rational(&(&one.damping + &one.damping)))
        }
        [None, None] => None,
    }
}

/// Minimum of 2 Re Z over the frequencies at which the surfaces swing against each other, N m s/rad; `None` if they do
/// not swing.
pub fn of_both<const N: usize>(one: &ExactSurface, other: &ExactSurface) -> Option<Float<N>> {
    let undamped = |surface: &ExactSurface| surface.damping.is_zero() && surface.stiffness.is_positive();
    if undamped(one) || undamped(other) {
        return Some(Float::zero());
    }
    let [first, second] = [one, other].map(ExactSurface::frequency_squared);
    if first == second {
        let product = &one.damping * &other.damping;
        let twice = (&product + &product) / (&one.damping + &other.damping);
        return first.is_positive().then(|| Float::from_rational(&twice));
    }
    // The least resistance is at the zero next to one of the ends.
    let f = reactance(one, other);
    let zeros = [(&first, &second), (&second, &first)]
        .into_iter()
        .filter_map(|(start, end)| {
            let width = end - start;
            let mut local = shifted(&f, start, &width)
                .map(|c| Float::<N>::from_rational(&c))
                .to_vec();
            // The zero x = 0 of a surface without a shaft is no oscillation.
            while local.first().is_some_and(Float::is_zero) {
                local.remove(0);
            }
            if local.first().is_some_and(|c| c.signum() < 0) {
                local = local.iter().map(|c| -c).collect();
            }
            match first_zero(&local, 0, &Float::from_f64(1.0)) {
                Crossing::At(share) => Some(&Float::from_rational(start) + &(&Float::from_rational(&width) * &share)),
                Crossing::None | Crossing::Beyond => None,
            }
        });
    let least = zeros
        .map(|x| resistance(one, other, &x))
        .reduce(|a, b| if b < a { b } else { a })?;
    Some(&least + &least)
}

fn reactance(one: &ExactSurface, other: &ExactSurface) -> [BigRational; 4] {
    let [j1, k1] = [&one.inertia, &one.stiffness];
    let [j2, k2] = [&other.inertia, &other.stiffness];
    let [a1, a2] = [one, other].map(|surface| &surface.damping * &surface.damping);
    let (j, k) = (j1 + j2, k1 + k2);
    let product = [k1 * k2, -(j1 * k2 + j2 * k1), j1 * j2];
    [
        -(&product[0] * &k),
        &product[0] * &j - &product[1] * &k - (&a1 * k2 + &a2 * k1),
        &product[1] * &j - &product[2] * &k + (&a1 * j2 + &a2 * j1),
        &product[2] * &j,
    ]
}

/// Coefficients of f(start + width t).
fn shifted(f: &[BigRational; 4], start: &BigRational, width: &BigRational) -> [BigRational; 4] {
    let mut g = f.clone();
    for first in 0..3 {
        for k in (first..3).rev() {
            let carried = &g[k + 1] * start;
            g[k] += carried;
        }
    }
    let mut power = BigRational::from_integer(1.into());
    for c in &mut g {
        *c *= &power;
        power *= width;
    }
    g
}

/// Re Z at x = omega^2.
fn resistance<const N: usize>(one: &ExactSurface, other: &ExactSurface, x: &Float<N>) -> Float<N> {
    let of = |surface: &ExactSurface| {
        let [inertia, a, stiffness] =
            [&surface.inertia, &surface.damping, &surface.stiffness].map(Float::<N>::from_rational);
        (a, &(&inertia * x) - &stiffness)
    };
    let [(a1, b1), (a2, b2)] = [of(one), of(other)];
    // |Z|^2 times x.
    let squared = |a: &Float<N>, b: &Float<N>| &(&(a * a) * x) + &(b * b);
    let resistance = &(&squared(&a1, &b1) * &a2) + &(&squared(&a2, &b2) * &a1);
    resistance.over(&squared(&(&a1 + &a2), &(&b1 + &b2)))
}
