//! Polynomials through a smooth motion, by their Chebyshev coefficients.
//!
//! On a stretch from a to b, with x = (2 t - a - b)/(b - a), a motion is the sum of c_j T_j(x), j = 0 to 15. It is known at the
//! 16 extrema of T_15, both ends among them, as nearly as times are numbers: the coefficients are those through the values
//! at the rounded times.

use nalgebra::{DMatrix, SMatrix};

/// Coefficients of a polynomial, and the nodes that determine them.
pub const COEFFICIENTS: usize = 16;

/// A stretch shorter than so many spacings of its times has a straight line.
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

/// Where `t` is in the stretch: -1 at its start, 1 at its end.
#[inline]
pub fn place(t: f64, start: f64, end: f64) -> f64 {
    let half = 0.5 * (end - start);
    if half > 0.0 {
        (((t - start) - half) / half).clamp(-1.0, 1.0)
    } else {
        0.0
    }
}

/// The times at which a motion from `start` to `end` is wanted, in order.
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

/// Turns `columns`, one for each quantity with its values at the [`nodes`], into their coefficients.
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
    // The nodes are distinct, so that there is a solution.
    let solved = matrix.lu().solve_mut(columns);
    debug_assert!(solved, "the nodes are distinct");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(start: f64, end: f64, motion: impl Fn(f64) -> f64) -> Vec<f64> {
        let times = nodes(start, end);
        let mut column = DMatrix::from_fn(COEFFICIENTS, 1, |k, _| motion(times[k]));
        fit(&times, &mut column);
        column.as_slice().to_vec()
    }

    /// An oscillation of which a quarter of a period is in the stretch, at a time where neighbouring numbers are 9e-16 s apart:
    /// its phase is known to 2e-11 of a radian only if the nodes count as where they are.
    #[test]
    fn analytic_an_oscillation_late_in_a_run_is_met_to_the_rounding_of_its_argument() {
        let omega = 25_000.0;
        let (start, end) = (7.0, 7.0 + 0.25 * std::f64::consts::TAU / omega);
        let motion = |t: f64| (omega * (t - 7.0)).sin();
        let c = fitted(start, end, motion);
        for k in 0..=1000 {
            let t = start + (end - start) * f64::from(k) / 1000.0;
            let error = value(&c, place(t, start, end)) - motion(t);
            assert!(error.abs() < 5e-14, "{t}: {error:e}");
        }
        assert!(c[14].abs().max(c[15].abs()) < 1e-14, "{c:?}");
    }

    #[test]
    fn analytic_a_polynomial_has_its_coefficients() {
        // T_3 + 2 on [1, 3]
        let c = fitted(1.0, 3.0, |t| {
            let x = t - 2.0;
            4.0 * x * x * x - 3.0 * x + 2.0
        });
        for (j, c) in c.iter().enumerate() {
            let expected = [2.0, 0.0, 0.0, 1.0].get(j).copied().unwrap_or(0.0);
            assert!((c - expected).abs() < 1e-14, "{j}: {c}");
        }
    }

    #[test]
    fn analytic_a_stretch_of_a_few_roundings_is_a_line() {
        let end = 7.0 + 100.0 * f64::EPSILON;
        let c = fitted(7.0, end, |t| if t == 7.0 { 1.0 } else { 2.0 });
        assert_eq!((value(&c, -1.0), value(&c, 1.0)), (1.0, 2.0));
    }
}
