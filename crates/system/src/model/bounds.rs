//! Root isolation by bounds on the curvature.

/// Distance over which a function with value `g > 0`, slope `rate` and |second derivative| <= `curvature` provably
/// stays positive: the positive zero of g + rate x - curvature x^2 / 2; infinite without one.
///
/// Repeated steps converge to the first root from the left and pass over none. Near a simple root each is Newton's
/// step.
pub fn positive_for(g: f64, rate: f64, curvature: f64) -> f64 {
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
