//! One step of an embedded explicit Runge-Kutta pair, for the paper's procedure: ARKODE has no step that is taken whatever
//! its error, and would not go on at the discontinuities that the procedure steps over.

use crate::sundials::{Coefficients, ErkTable};

/// An embedded pair with its scratch, for states of `N` components.
#[derive(Debug)]
pub(super) struct EmbeddedPair<const N: usize> {
    coefficients: Coefficients,
    /// Order of the method.
    pub(super) order: u32,
    /// Leading components whose error is estimated.
    judged: usize,
    /// Of each stage: evaluations of the right-hand side in a step.
    pub(super) slopes: Vec<[f64; N]>,
    /// What the last step came to.
    pub(super) solution: [f64; N],
}

impl<const N: usize> EmbeddedPair<N> {
    /// A pair that estimates the error of the first `judged` components.
    pub(super) fn new(table: ErkTable, judged: usize) -> Self {
        let coefficients = table.coefficients();
        EmbeddedPair {
            slopes: vec![[0.0; N]; coefficients.b.len()],
            order: table.order(),
            judged,
            coefficients,
            solution: [0.0; N],
        }
    }

    /// Steps from `y` at `t` by `step` (s) and returns the largest estimate of the error; the solution is kept here.
    pub(super) fn step(&mut self, t: f64, y: &[f64; N], step: f64, rhs: impl Fn(f64, &[f64; N], &mut [f64; N])) -> f64 {
        let Coefficients { a, b, c, d } = &self.coefficients;
        for (stage, row) in a.iter().enumerate() {
            let mut at = *y;
            for (weight, slope) in row.iter().zip(&self.slopes).filter(|(weight, _)| **weight != 0.0) {
                for (value, rate) in at.iter_mut().zip(slope) {
                    *value += step * weight * rate;
                }
            }
            rhs(t + c[stage] * step, &at, &mut self.slopes[stage]);
        }
        self.solution = *y;
        let mut error = [0.0; N];
        for ((weight, embedded), slope) in b.iter().zip(d).zip(&self.slopes) {
            for (k, rate) in slope.iter().enumerate() {
                self.solution[k] += step * weight * rate;
                error[k] += step * (weight - embedded) * rate;
            }
        }
        // NaN must not be lost in a maximum.
        error[..self.judged]
            .iter()
            .fold(0.0, |worst, e| if e.abs() <= worst { worst } else { e.abs() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y' = (y_2, -y_1): halving the step divides the error of a fixed span by 2^order.
    #[test]
    fn analytic_order_of_every_pair() {
        for &table in ErkTable::ALL {
            let mut pair = EmbeddedPair::<2>::new(table, 2);
            let mut error = |steps: usize| {
                let step = 1.0 / steps as f64;
                let mut y = [1.0, 0.0];
                for k in 0..steps {
                    pair.step(k as f64 * step, &y, step, |_, y, dydt| *dydt = [y[1], -y[0]]);
                    y = pair.solution;
                }
                (y[0] - 1f64.cos()).hypot(y[1] + 1f64.sin())
            };
            // Few steps, so that order 9 stays above rounding.
            let (coarse, fine) = (error(2), error(4));
            let order = (coarse / fine).log2();
            let expected = f64::from(table.order());
            // Some have an error constant that vanishes on linear problems.
            assert!(order > expected - 0.5, "{table}: {order}");
        }
    }
}
