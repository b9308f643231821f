//! Root isolation by bounds on the curvature.

/// How far a function with value `g > 0`, slope `rate` and |second derivative| <= `curvature` provably stays positive:
/// the positive zero of g + rate x - curvature x^2 / 2; infinite if there is none.
///
/// Repeated, it converges to the first root from the left and passes over none; near a simple root it is Newton's step.
pub(crate) fn positive_for(g: f64, rate: f64, curvature: f64) -> f64 {
    let root = (rate * rate + 2.0 * curvature * g).sqrt();
    if rate < 0.0 {
        // the form that does not cancel
        2.0 * g / (root - rate)
    } else if curvature > 0.0 {
        (rate + root) / curvature
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::positive_for;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn property_the_bound_is_the_parabolas_zero(g in 1e-9..1e3f64, rate in -1e6..1e6f64, curvature in 1e-9..1e9f64) {
            let x = positive_for(g, rate, curvature);
            let size = g + (rate * x).abs() + curvature * x * x / 2.0;
            prop_assert!(x > 0.0);
            prop_assert!((g + rate * x - curvature * x * x / 2.0).abs() < 1e-12 * size);
        }
    }
}
