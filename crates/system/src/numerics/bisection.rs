//! Bisection.

/// Halves the interval between `inside`, where `holds` is true, and `outside`, where it is false, at most `rounds` times
/// or down to neighbouring doubles. Returns its two ends in this order.
pub fn bisect(mut inside: f64, mut outside: f64, rounds: usize, mut holds: impl FnMut(f64) -> bool) -> (f64, f64) {
    for _ in 0..rounds {
        let middle = 0.5 * (inside + outside);
        if middle.is_nan() || middle == inside || middle == outside {
            break;
        }
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    (inside, outside)
}
