//! Order and length of a step from the precision.

use super::float::Float;
use super::friction;
use super::pieces::pieces;
use super::series::{Expansion, Model, State, component::*, largest_order};
use crate::model::{ExactParameters, nearest_double};

/// Orders that are tried, each against the last: the cost of a step is about the order's square, and the best length for
/// it depends on how much of the motion is slow.
const ORDERS: [usize; 25] = [
    12, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192, 224, 256, 320, 384, 448, 512, 640, 768, 1024,
];

/// What a coefficient of any order costs beside its convolutions, in terms of them.
const FIXED_COST: f64 = 25.0;

/// A step is this part of the length at which the last terms reach the tolerance.
const SAFETY: f64 = 0.88;

/// Bits between the tolerance of a step and the precision.
const MARGIN_BITS: f64 = 6.0;

/// Components that decide about the length; the rotor's angle is a quadrature of one of them.
const DECIDING: [usize; 7] = [
    Z,
    Z_DOT,
    ROTOR_TWIST,
    ROTOR_TWIST_RATE,
    STATOR_TWIST,
    STATOR_TWIST_RATE,
    ROTOR_SPEED,
];

/// What a component is worth at least, log2: below that its error counts in terms of this size.
#[derive(Debug)]
pub(super) struct Scales {
    least: [f64; COUNT],
}

impl Scales {
    /// The twist of a disk under the friction torque of the largest force, the speed of an oscillation of that size, and
    /// the same of the axial motion.
    pub fn new(exact: &ExactParameters) -> Scales {
        let p = exact.rounded();
        let force = pieces(&exact.actuation)
            .iter()
            .map(|piece| nearest_double(&piece.force).abs())
            .fold(0.0, f64::max);
        let force = if force > 0.0 { force } else { 1.0 };
        let twist = friction::size(&exact.law).max(1e-3) * p.contact.radius * force / p.torsion.stiffness;
        let speed = twist * (p.torsion.stiffness / p.torsion.surface_inertia).sqrt();
        let depth = force / p.axial.stiffness;
        let velocity = depth * (p.axial.stiffness / p.axial.mass).sqrt();
        let least = [depth, velocity, twist, speed, twist, speed, speed, 1.0].map(f64::log2);
        Scales { least }
    }
}

/// The longest step with those series, log2 of s: where the last two terms of each reach the tolerance, in terms of the size of
/// the first, or of the least that it is worth, log2.
///
/// So do those of the friction law's shape, such as the exponential, relative to itself, however small it is: the terms of exp(x) grow up to
/// index x, and a step over which alpha omega_r changes by more than the order would pass over what they come to beyond it.
pub(super) fn log_step<'a, const N: usize>(series: impl Iterator<Item = (&'a [Float<N>], f64)>) -> f64 {
    let of_series = |(coefficients, least): (&[Float<N>], f64)| {
        let size = coefficients[0].log2().max(least);
        let tolerance = size - Float::<N>::BITS as f64 + MARGIN_BITS;
        let last = coefficients.len() - 1;
        let steps = [last - 1, last].map(|k| (tolerance - coefficients[k].log2()) / k as f64);
        steps[0].min(steps[1])
    };
    series.map(of_series).fold(f64::INFINITY, f64::min)
}

/// All series of an expansion that decide.
fn deciding<'a, const N: usize>(
    expansion: &'a Expansion<N>,
    scales: &Scales,
) -> impl Iterator<Item = (&'a [Float<N>], f64)> {
    let law = Some((expansion.law(), f64::NEG_INFINITY)).filter(|(shape, _)| !shape.is_empty());
    let states = DECIDING.map(|c| (expansion.component(c), scales.least[c]));
    law.into_iter().chain(states)
}

/// Extends the expansion to the order that costs least, and returns the length of the step, s; no longer than `limit`.
pub(super) fn choose<const N: usize>(
    expansion: &mut Expansion<N>,
    model: &Model<N>,
    scales: &Scales,
    limit: &Float<N>,
) -> Float<N> {
    longest(limit, |order| {
        expansion.extend(model, order);
        log_step(deciding(expansion, scales))
    })
}

/// The same of any expansion, by a function that extends it to an order and gives the longest step with it, log2 of s.
pub(super) fn longest<const N: usize>(limit: &Float<N>, mut extended: impl FnMut(usize) -> f64) -> Float<N> {
    let log_limit = limit.log2();
    let mut best: Option<(f64, f64)> = None;
    let largest = largest_order(Float::<N>::BITS);
    for order in ORDERS.into_iter().filter(|order| *order <= largest) {
        let log_step = extended(order) + SAFETY.log2();
        let cost = (order as f64 * (order as f64 + FIXED_COST)).log2() - log_step.min(log_limit);
        // Coefficients of a higher order only make the same step more accurate.
        let length = best.map_or(log_step, |(_, best)| best.max(log_step));
        let worse = best.is_some_and(|(least, _)| cost >= least);
        best = Some((best.map_or(cost, |(least, _)| least.min(cost)), length));
        if worse || log_step >= log_limit {
            break;
        }
    }
    let length = best.map_or(log_limit, |(_, length)| length);
    if length >= log_limit {
        *limit
    } else {
        Float::from_f64(length.exp2())
    }
}

/// A state with a component that is not finite.
pub(super) fn is_lost<const N: usize>(state: &State<N>) -> bool {
    state.iter().any(|value| !value.is_finite())
}
