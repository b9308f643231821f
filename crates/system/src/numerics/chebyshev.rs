//! Polynomials that approximate a smooth motion, given by their Chebyshev coefficients.
//!
//! On a stretch from a to b, with x = (2 t - a - b)/(b - a), a motion is the sum of c_j T_j(x), j = 0 to 15. The
//! motion is known at the 16 extrema of T_15, which include both ends, at times rounded to doubles. The coefficients
//! fit the values at the rounded times.

use nalgebra::{DMatrix, SMatrix};

/// Number of coefficients of a polynomial, and of the nodes that determine them.
pub const COEFFICIENTS: usize = 16;

/// A stretch shorter than this, in spacings of doubles at its times, is approximated by a straight line.
const FEWEST_TIMES: f64 = 4096.0;

/// The sum of `c[j] T_j(x)`, by Clenshaw's recurrence.
#[inline]
pub fn value(c: &[f64], x: f64) -> f64 {
    let (mut b1, mut b2) = (0.0, 0.0);
    for c in c.iter().skip(1).rev() {
        (b1, b2) = (2.0 * x * b1 - b2 + c, b1);
    }
    x * b1 - b2 + c.first().copied().unwrap_or(0.0)
}

/// Position of `t` in the stretch: -1 at its start, 1 at its end.
#[inline]
pub fn place(t: f64, start: f64, end: f64) -> f64 {
    let half = 0.5 * (end - start);
    if half > 0.0 {
        (((t - start) - half) / half).clamp(-1.0, 1.0)
    } else {
        0.0
    }
}

/// Increasing times from `start` to `end` at which the values of a motion are required.
pub fn nodes(start: f64, end: f64) -> [f64; COEFFICIENTS] {
    let last = COEFFICIENTS - 1;
    std::array::from_fn(|k| match k {
        0 => start,
        k if k == last => end,
        k => {
            let x = (std::f64::consts::PI * k as f64 / last as f64).cos();
            (start + 0.5 * (end - start) * (1.0 - x)).clamp(start, end)
        }
    })
}

/// Replaces each column, which contains the values of a quantity at the [`nodes`], by its coefficients.
pub fn fit(times: &[f64; COEFFICIENTS], columns: &mut DMatrix<f64>) {
    let (start, end) = (times[0], times[COEFFICIENTS - 1]);
    let spacing = f64::EPSILON * start.abs().max(end.abs());
    if end - start < FEWEST_TIMES * spacing {
        for mut column in columns.column_iter_mut() {
            let (first, last) = (column[0], column[COEFFICIENTS - 1]);
            column.fill(0.0);
            (column[0], column[1]) = (0.5 * (first + last), 0.5 * (last - first));
        }
        return;
    }
    let mut matrix = SMatrix::<f64, COEFFICIENTS, COEFFICIENTS>::zeros();
    for (k, &t) in times.iter().enumerate() {
        let x = place(t, start, end);
        matrix[(k, 0)] = 1.0;
        matrix[(k, 1)] = x;
        for j in 2..COEFFICIENTS {
            matrix[(k, j)] = 2.0 * x * matrix[(k, j - 1)] - matrix[(k, j - 2)];
        }
    }
    let solved = matrix.lu().solve_mut(columns);
    debug_assert!(solved, "the nodes are distinct");
}
