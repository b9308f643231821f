//! One step of an embedded explicit Runge-Kutta pair, for the paper's procedure: ARKODE cannot accept a step whatever
//! its error, and would fail at the discontinuities that the procedure steps over.

use crate::sundials::{Coefficients, ErkTable};

/// An embedded pair with its scratch, for states of `N` components.
#[derive(Debug)]
pub struct EmbeddedPair<const N: usize> {
    coefficients: Coefficients,
    pub(super) order: u32,
    /// Number of leading components whose error is estimated.
    judged: usize,
    /// Evaluations of the right-hand side in the last step.
    pub(super) slopes: Vec<[f64; N]>,
    /// Solution of the last step.
    pub solution: [f64; N],
}

impl<const N: usize> EmbeddedPair<N> {
    /// A pair that estimates the error of the first `judged` components.
    pub fn new(table: ErkTable, judged: usize) -> Self {
        let coefficients = table.coefficients();
        EmbeddedPair {
            slopes: vec![[0.0; N]; coefficients.b.len()],
            order: table.order(),
            judged,
            coefficients,
            solution: [0.0; N],
        }
    }

    /// Steps from `y` at `t` by `step` (s), stores the solution, and returns the largest error estimate.
    pub fn step(&mut self, t: f64, y: &[f64; N], step: f64, rhs: impl Fn(f64, &[f64; N], &mut [f64; N])) -> f64 {
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
        // A maximum must not lose NaN.
        error[..self.judged]
            .iter()
            .fold(0.0, |worst, e| if e.abs() <= worst { worst } else { e.abs() })
    }
}
