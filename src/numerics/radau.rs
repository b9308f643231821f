//! Steps of Radau IIA for a small system with quadratures beside it.
//!
//! The stages come from a simplified Newton iteration in the eigenbasis of A: one real and (S - 1)/2 complex systems of
//! the dimension of the problem. Within a step the solution is the collocation polynomial of degree S, kept by the
//! Legendre coefficients of its derivative. Their decay is the error estimate: of the polynomial, to order S, and so a
//! cautious one of the step's end, whose order is 2S - 1 where the problem is not stiff. The polynomial also predicts
//! the next step's stages.

use super::radau_tableau::{RadauTableau, legendre_integrals, xi};
use nalgebra::{Complex, SMatrix, SVector};
use std::sync::Arc;

/// y' = f(t, y) of M components, of which f needs only the first N; the others are quadratures.
pub(crate) trait StiffProblem<const N: usize, const M: usize> {
    /// f(t, y).
    fn rhs(&self, t: f64, y: &[f64; M]) -> [f64; M];

    /// df_i/dy_j of the first N components.
    fn jacobian(&self, t: f64, y: &[f64; M]) -> SMatrix<f64, N, N>;
}

/// Newton's method has converged when its error is below this share of what is tolerated.
const NEWTON_SHARE: f64 = 1e-2;

/// Most iterations of a step.
const NEWTON_ITERATIONS: usize = 12;

/// A step that has been solved.
#[derive(Debug, Clone)]
pub struct Step<const M: usize, const S: usize> {
    /// Where it starts, and how long it is.
    pub start: f64,
    /// In the problem's unit of time.
    pub length: f64,
    y: [f64; M],
    /// Legendre coefficients of y' times the length.
    coefficients: SMatrix<f64, M, S>,
}

impl<const M: usize, const S: usize> Step<M, S> {
    /// The solution at `t`, within the step or a little beyond it.
    pub fn at(&self, t: f64) -> [f64; M] {
        self.at_share((t - self.start) / self.length)
    }

    /// The same at a share of the length, 0 to 1.
    pub(crate) fn at_share(&self, share: f64) -> [f64; M] {
        let change = self.coefficients * legendre_integrals::<S>(share);
        std::array::from_fn(|i| self.y[i] + change[i])
    }
}

/// What an attempted step came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Attempt {
    /// The stages are found.
    Solved {
        /// The estimated error over what is tolerated.
        error: f64,
    },
    /// Newton's method diverges, is too slow, or meets values that are not finite.
    NotConverged,
}

/// Work since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Work {
    /// Evaluations of f.
    pub rhs_evaluations: u64,
    /// Evaluations of the Jacobian, each with its factorisations.
    pub jacobian_evaluations: u64,
    /// Newton iterations.
    pub iterations: u64,
    /// Attempts in which they did not converge.
    pub convergence_failures: u64,
}

/// The method, with room for one step.
#[derive(Debug, Clone)]
pub struct Radau<const N: usize, const M: usize, const S: usize> {
    tableau: Arc<RadauTableau<S>>,
    /// Increments of the stages.
    z: SMatrix<f64, M, S>,
    f: SMatrix<f64, M, S>,
    /// Inverses of the Newton matrices.
    real: SMatrix<f64, N, N>,
    complex: Vec<SMatrix<Complex<f64>, N, N>>,
    step: Step<M, S>,
    work: Work,
}

impl<const N: usize, const M: usize, const S: usize> Radau<N, M, S> {
    /// With a tableau.
    pub fn new(tableau: Arc<RadauTableau<S>>) -> Self {
        let complex = vec![SMatrix::zeros(); tableau.complex.len()];
        Radau {
            tableau,
            z: SMatrix::zeros(),
            f: SMatrix::zeros(),
            real: SMatrix::zeros(),
            complex,
            step: Step {
                start: 0.0,
                length: 0.0,
                y: [0.0; M],
                coefficients: SMatrix::zeros(),
            },
            work: Work::default(),
        }
    }

    /// The step last solved.
    pub fn step(&self) -> &Step<M, S> {
        &self.step
    }

    /// Takes `step` for the last one again.
    pub fn restore(&mut self, step: Step<M, S>) {
        self.step = step;
    }

    /// What has been done so far.
    pub fn work(&self) -> Work {
        self.work
    }

    /// The share of the last step at which stage `i` stands.
    pub fn node(&self, i: usize) -> f64 {
        self.tableau.c[i]
    }

    /// The solution at stage `i` of the last step, counted from 0; the last is its end.
    pub fn stage(&self, i: usize) -> [f64; M] {
        std::array::from_fn(|k| self.step.y[k] + self.z[(k, i)])
    }

    /// Order of the error estimate in the length of a step.
    pub(crate) const ESTIMATE_ORDER: i32 = S as i32 + 1;

    /// Tries a step of `length` from `y` at `t`. `weights` is what is tolerated as error of each component. With
    /// `predict` the last step's polynomial goes on; else the stages are looked for from `y`.
    pub(crate) fn attempt(
        &mut self,
        problem: &impl StiffProblem<N, M>,
        t: f64,
        y: &[f64; M],
        length: f64,
        weights: &[f64; M],
        predict: bool,
    ) -> Attempt {
        let tableau = self.tableau.clone();
        let middle = if predict {
            let share = |c: f64| (t + c * length - self.step.start) / self.step.length;
            for i in 0..S {
                let ahead = self.step.at_share(share(tableau.c[i]));
                for k in 0..M {
                    self.z[(k, i)] = ahead[k] - y[k];
                }
            }
            self.step.at_share(share(0.5))
        } else {
            self.z.fill(0.0);
            *y
        };
        if !(self.factor(problem, t + 0.5 * length, &middle, length) && self.iterate(problem, t, y, length, weights)) {
            self.work.convergence_failures += 1;
            return Attempt::NotConverged;
        }
        // The quadratures, by the same coefficients; f is that of the last iterate but one, so once more.
        self.evaluate(problem, t, y, length);
        for k in N..M {
            for i in 0..S {
                let mut sum = 0.0;
                for j in 0..S {
                    sum += tableau.a[(i, j)] * self.f[(k, j)];
                }
                self.z[(k, i)] = length * sum;
            }
        }
        self.step = Step {
            start: t,
            length,
            y: *y,
            coefficients: self.z * tableau.to_legendre.transpose(),
        };
        Attempt::Solved {
            error: self.error(weights),
        }
    }

    /// Newton matrices 1/(h lambda) - J, inverted.
    fn factor(&mut self, problem: &impl StiffProblem<N, M>, t: f64, y: &[f64; M], length: f64) -> bool {
        let jacobian = problem.jacobian(t, y);
        self.work.jacobian_evaluations += 1;
        if !jacobian.iter().all(|v| v.is_finite()) {
            return false;
        }
        let shifted = SMatrix::<f64, N, N>::identity() * (self.tableau.real.inverse / length) - jacobian;
        match shifted.try_inverse() {
            Some(inverse) => self.real = inverse,
            None => return false,
        }
        let jacobian = jacobian.map(|v| Complex::new(v, 0.0));
        for (inverse, eigenvalue) in self.complex.iter_mut().zip(&self.tableau.complex) {
            let shifted = SMatrix::<Complex<f64>, N, N>::identity() * (eigenvalue.inverse / length) - jacobian;
            match shifted.try_inverse() {
                Some(found) => *inverse = found,
                None => return false,
            }
        }
        true
    }

    fn evaluate(&mut self, problem: &impl StiffProblem<N, M>, t: f64, y: &[f64; M], length: f64) {
        for i in 0..S {
            let stage = std::array::from_fn(|k| y[k] + self.z[(k, i)]);
            self.f
                .set_column(i, &SVector::from(problem.rhs(t + self.tableau.c[i] * length, &stage)));
        }
        self.work.rhs_evaluations += S as u64;
    }

    fn iterate(
        &mut self,
        problem: &impl StiffProblem<N, M>,
        t: f64,
        y: &[f64; M],
        length: f64,
        weights: &[f64; M],
    ) -> bool {
        let tableau = self.tableau.clone();
        let mut last = f64::INFINITY;
        for round in 0..NEWTON_ITERATIONS {
            self.evaluate(problem, t, y, length);
            self.work.iterations += 1;
            let f = self.f.fixed_view::<N, S>(0, 0);
            let residual: SMatrix<f64, N, S> = f * tableau.a.transpose() * length - self.z.fixed_view::<N, S>(0, 0);
            let real: SVector<f64, N> = self.real * (residual * tableau.real.left * (tableau.real.inverse / length));
            let mut change: SMatrix<f64, N, S> = real * tableau.real.right.transpose();
            for (inverse, eigenvalue) in self.complex.iter().zip(&tableau.complex) {
                let mut projected = SVector::<Complex<f64>, N>::zeros();
                for i in 0..S {
                    for k in 0..N {
                        projected[k] += eigenvalue.left[i] * residual[(k, i)];
                    }
                }
                let solved = inverse * (projected * (eigenvalue.inverse / length));
                for i in 0..S {
                    for k in 0..N {
                        let (a, b) = (solved[k], eigenvalue.right[i]);
                        change[(k, i)] += 2.0 * (a.re * b.re - a.im * b.im);
                    }
                }
            }
            let mut size: f64 = 0.0;
            for i in 0..S {
                for k in 0..N {
                    self.z[(k, i)] += change[(k, i)];
                    let share = change[(k, i)].abs() / weights[k];
                    // A comparison that a value that is not a number fails, unlike f64::max.
                    size = if share <= size { size } else { share };
                }
            }
            if !size.is_finite() {
                return false;
            }
            let rate = size / last;
            // The first change has no rate yet; below a hundredth of the wanted accuracy none is needed.
            if size <= NEWTON_SHARE * NEWTON_SHARE
                || (round > 0 && rate < 1.0 && size * rate / (1.0 - rate) <= NEWTON_SHARE)
            {
                return true;
            }
            let left = (NEWTON_ITERATIONS - 1 - round) as i32;
            if round > 0 && (rate >= 1.0 || size * rate.powi(left) / (1.0 - rate) > NEWTON_SHARE) {
                return false;
            }
            last = size;
        }
        false
    }

    /// The first coefficient that the polynomial lacks, estimated from the decay of those that it has.
    fn error(&self, weights: &[f64; M]) -> f64 {
        let size = |n: usize| {
            (0..M)
                .map(|k| self.step.coefficients[(k, n)].abs() / weights[k])
                .fold(0.0, f64::max)
        };
        let (last, before, two_before) = (size(S - 1), size(S - 2), size(S - 3));
        if last == 0.0 {
            return 0.0;
        }
        let decay = (last / before).max((last / two_before).sqrt()).min(1.0);
        last * decay * 2.0 * xi(S)
    }
}
