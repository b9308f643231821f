//! Isolation of roots with bounds of the curvature.

/// Distance over which a function with value `g` > 0, slope `rate` and |second derivative| <= `curvature` provably
/// stays positive. It is the positive zero of g + rate x - curvature x^2 / 2, or infinite if there is none.
///
/// Repeated steps converge to the first root from the left, and never pass a root. Near a simple root they are
/// Newton's.
pub fn positive_for(g: f64, rate: f64, curvature: f64) -> f64 {
    let root = (rate * rate + 2.0 * curvature * g).sqrt();
    if rate < 0.0 {
        // This form does not cancel.
        2.0 * g / (root - rate)
    } else if curvature > 0.0 {
        (rate + root) / curvature
    } else {
        f64::INFINITY
    }
}
