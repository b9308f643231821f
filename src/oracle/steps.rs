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

/// The longest step with that expansion, log2 of s: where its last two terms reach the tolerance.
///
/// So do those of the friction law's shape, such as the exponential, relative to itself, however small it is: the terms of exp(x) grow up to
/// index x, and a step over which alpha omega_r changes by more than the order would pass over what they come to beyond it.
fn log_step<const N: usize>(expansion: &Expansion<N>, scales: &Scales) -> f64 {
    let of_series = |coefficients: &[Float<N>], least: f64| {
        let size = coefficients[0].log2().max(least);
        let tolerance = size - Float::<N>::BITS as f64 + MARGIN_BITS;
        let last = coefficients.len() - 1;
        let steps = [last - 1, last].map(|k| (tolerance - coefficients[k].log2()) / k as f64);
        steps[0].min(steps[1])
    };
    let states = DECIDING.map(|c| of_series(expansion.component(c), scales.least[c]));
    let law = match expansion.law() {
        [] => f64::INFINITY,
        shape => of_series(shape, f64::NEG_INFINITY),
    };
    states.into_iter().fold(law, f64::min)
}

/// Extends the expansion to the order that costs least, and returns the length of the step, s; no longer than `limit`.
pub(super) fn choose<const N: usize>(
    expansion: &mut Expansion<N>,
    model: &Model<N>,
    scales: &Scales,
    limit: &Float<N>,
) -> Float<N> {
    let log_limit = limit.log2();
    let mut best: Option<(f64, f64)> = None;
    let largest = largest_order(Float::<N>::BITS);
    for order in ORDERS.into_iter().filter(|order| *order <= largest) {
        expansion.extend(model, order);
        let log_step = log_step(expansion, scales) + SAFETY.log2();
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
