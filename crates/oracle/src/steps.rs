//! Order and length of a step for a precision.

use super::float::Float;

/// Orders to try in turn. The cost of a step grows with the square of the order; the best length depends on the slow
/// part of the motion.
const ORDERS: [usize; 25] = [
    12, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192, 224, 256, 320, 384, 448, 512, 640, 768, 1024,
];

/// Highest order of an expansion for this precision; the cheapest order is about 0.4 per bit.
pub(super) const fn largest_order(bits: usize) -> usize {
    if bits < 128 { 64 } else { bits / 2 }
}

/// Cost of a coefficient besides its convolutions, in units of one order.
const FIXED_COST: f64 = 25.0;

/// Ratio of a step to the length at which the last terms reach the tolerance.
const SAFETY: f64 = 0.88;

/// Bits between the tolerance of a step and the precision.
const MARGIN_BITS: f64 = 6.0;

/// The longest step with these series for a precision of `bits`, log2 of s. At this length the last two terms of each
/// series reach the tolerance, relative to its first term or its least size (log2).
///
/// The series of the friction law's shape, such as the exponential, count relative to themselves, however small they
/// are. The terms of exp(x) grow up to index x, so that a step over which alpha omega_r changes by more than the order
/// would miss the larger terms of higher index.
pub(super) fn log_step<'a, const N: usize>(series: impl Iterator<Item = (&'a [Float<N>], f64)>, bits: usize) -> f64 {
    let of_series = |(coefficients, least): (&[Float<N>], f64)| {
        let size = coefficients[0].log2().max(least);
        let tolerance = size - bits as f64 + MARGIN_BITS;
        let last = coefficients.len() - 1;
        let steps = [last - 1, last].map(|k| (tolerance - coefficients[k].log2()) / k as f64);
        steps[0].min(steps[1])
    };
    series.map(of_series).fold(f64::INFINITY, f64::min)
}

/// The length of the step, s, at most `limit`, with the cheapest order for a precision of `bits`. `extended` extends
/// an expansion to an order, and returns the longest step (log2 of s).
pub(super) fn longest<const N: usize>(
    limit: &Float<N>,
    bits: usize,
    mut extended: impl FnMut(usize) -> f64,
) -> Float<N> {
    let log_limit = limit.log2();
    let mut best: Option<(f64, f64)> = None;
    let largest = largest_order(bits);
    for order in ORDERS.into_iter().filter(|order| *order <= largest) {
        let log_step = extended(order) + SAFETY.log2();
        let cost = (order as f64 * (order as f64 + FIXED_COST)).log2() - log_step.min(log_limit);
        // A higher order only makes the same step more accurate.
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
