//! Steps of Radau IIA for a small system with quadratures.
//!
//! The stages come from a simplified Newton iteration in the eigenbasis of A, which takes one real and (S - 1)/2
//! complex systems of the problem's dimension. Within a step the solution is the collocation polynomial of degree S,
//! stored as the Legendre coefficients of its derivative. The decay of these coefficients estimates the error of the
//! polynomial, to order S. For the end of the step this estimate is cautious, because its order is 2S - 1 for
//! problems that are not stiff. The polynomial also predicts the next stages.

use super::radau_tableau::{RadauTableau, legendre_integrals, xi};
use nalgebra::{Complex, ComplexField, DMatrix, DMatrixViewMut, SVector};
use std::sync::Arc;

/// A problem y' = f(t, y), where f depends on the first components only. The others are quadratures.
pub trait StiffProblem {
    /// f(t, y).
    fn rhs(&self, t: f64, y: &[f64], rates: &mut [f64]);

    /// df_i/dy_j for the components on which f depends.
    fn jacobian(&self, t: f64, y: &[f64], jacobian: DMatrixViewMut<'_, f64>);
}

/// Newton's method has converged when its error is below this share of the tolerance.
const NEWTON_SHARE: f64 = 1e-2;

const NEWTON_ITERATIONS: usize = 12;

/// A solved step, with its collocation polynomial.
#[derive(Debug, Clone)]
pub struct Step<const S: usize> {
    /// Start of the step, in the problem's unit of time.
    pub start: f64,
    /// Length, in the same unit.
    pub length: f64,
    y: Vec<f64>,
    /// Legendre coefficients of each component's y' times the length.
    coefficients: Vec<SVector<f64, S>>,
}

impl<const S: usize> Step<S> {
    /// Memory for a step with `dimension` components.
    pub fn new(dimension: usize) -> Self {
        Step {
            start: 0.0,
            length: 0.0,
            y: vec![0.0; dimension],
            coefficients: vec![SVector::zeros(); dimension],
        }
    }

    /// The solution at `t`, within the step or slightly beyond it.
    pub fn at(&self, t: f64, y: &mut [f64]) {
        self.at_share((t - self.start) / self.length, y);
    }

    /// The solution at a share of the step, 0 to 1.
    pub fn at_share(&self, share: f64, y: &mut [f64]) {
        let integrals = legendre_integrals::<S>(share);
        for (y, (start, coefficients)) in y.iter_mut().zip(self.y.iter().zip(&self.coefficients)) {
            *y = start + coefficients.dot(&integrals);
        }
    }

    /// Copies `other`, which must have the same number of components.
    pub fn copy_from(&mut self, other: &Step<S>) {
        (self.start, self.length) = (other.start, other.length);
        self.y.copy_from_slice(&other.y);
        self.coefficients.copy_from_slice(&other.coefficients);
    }
}

/// Result of an attempted step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Attempt {
    /// The stages were found.
    Solved {
        /// Estimated error divided by the tolerance.
        error: f64,
    },
    /// Newton's method diverges, is too slow, or meets values that are not finite.
    NotConverged,
}

/// Counters of the work since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Work {
    /// Evaluations of f.
    pub rhs_evaluations: u64,
    /// Evaluations of the Jacobian, each with its factorisations.
    pub jacobian_evaluations: u64,
    /// Newton iterations.
    pub iterations: u64,
    /// Attempts without convergence.
    pub convergence_failures: u64,
}

/// The method, with memory for one step.
#[derive(Debug, Clone)]
pub struct Radau<const S: usize> {
    tableau: Arc<RadauTableau<S>>,
    z: Vec<SVector<f64, S>>,
    f: Vec<SVector<f64, S>>,
    residual: Vec<SVector<f64, S>>,
    jacobian: DMatrix<f64>,
    real: DMatrix<f64>,
    complex: Vec<DMatrix<Complex<f64>>>,
    /// The last solved step.
    pub step: Step<S>,
    /// Work so far.
    pub work: Work,
    /// Buffers: a state and its rates, right-hand sides of the Newton systems, exchanged rows of an inversion.
    stage: Vec<f64>,
    rates: Vec<f64>,
    real_side: Vec<f64>,
    complex_side: Vec<Complex<f64>>,
    places: Vec<usize>,
}

impl<const S: usize> Radau<S> {
    /// The method for a problem with `dimension` components, of which the first `dynamic` determine the rates.
    pub fn new(tableau: Arc<RadauTableau<S>>, dynamic: usize, dimension: usize) -> Self {
        let square = DMatrix::zeros(dynamic, dynamic);
        Radau {
            complex: vec![DMatrix::zeros(dynamic, dynamic); tableau.complex.len()],
            tableau,
            z: vec![SVector::zeros(); dimension],
            f: vec![SVector::zeros(); dimension],
            residual: vec![SVector::zeros(); dynamic],
            real: square.clone(),
            jacobian: square,
            step: Step::new(dimension),
            work: Work::default(),
            stage: vec![0.0; dimension],
            rates: vec![0.0; dimension],
            real_side: vec![0.0; dynamic],
            complex_side: vec![Complex::new(0.0, 0.0); dynamic],
            places: vec![0; dynamic],
        }
    }

    /// Share of a step at stage `i`.
    pub fn node(&self, i: usize) -> f64 {
        self.tableau.c[i]
    }

    /// The solution at stage `i` (from 0) of the last step. The last stage is the end of the step.
    pub fn stage(&self, i: usize, y: &mut [f64]) {
        for (y, (start, z)) in y.iter_mut().zip(self.step.y.iter().zip(&self.z)) {
            *y = start + z[i];
        }
    }

    /// Order of the error estimate in the step length.
    pub const ESTIMATE_ORDER: i32 = S as i32 + 1;

    /// Attempts a step of `length` from `y` at `t`. `weights` are the error tolerances of the components. With
    /// `predict` the stages start from the polynomial of the last step, otherwise from `y`.
    pub fn attempt(
        &mut self,
        problem: &impl StiffProblem,
        t: f64,
        y: &[f64],
        length: f64,
        weights: &[f64],
        predict: bool,
    ) -> Attempt {
        let tableau = self.tableau.clone();
        let mut middle = std::mem::take(&mut self.stage);
        if predict {
            let share = |c: f64| (t + c * length - self.step.start) / self.step.length;
            for i in 0..S {
                self.step.at_share(share(tableau.c[i]), &mut middle);
                for (z, (ahead, y)) in self.z.iter_mut().zip(middle.iter().zip(y)) {
                    z[i] = ahead - y;
                }
            }
            self.step.at_share(share(0.5), &mut middle);
        } else {
            self.z.fill(SVector::zeros());
            middle.copy_from_slice(y);
        }
        let factored = self.factor(problem, t + 0.5 * length, &middle, length);
        self.stage = middle;
        if !(factored && self.iterate(problem, t, y, length, weights)) {
            self.work.convergence_failures += 1;
            return Attempt::NotConverged;
        }
        // The quadratures use the same coefficients. f still belongs to the second last iterate, so that it is
        // evaluated again.
        self.evaluate(problem, t, y, length);
        for (z, f) in self.z.iter_mut().zip(&self.f).skip(self.residual.len()) {
            *z = tableau.a * f * length;
        }
        (self.step.start, self.step.length) = (t, length);
        self.step.y.copy_from_slice(y);
        for (coefficients, z) in self.step.coefficients.iter_mut().zip(&self.z) {
            *coefficients = tableau.to_legendre * z;
        }
        Attempt::Solved {
            error: self.error(weights),
        }
    }

    fn factor(&mut self, problem: &impl StiffProblem, t: f64, y: &[f64], length: f64) -> bool {
        problem.jacobian(t, y, self.jacobian.as_view_mut());
        self.work.jacobian_evaluations += 1;
        if !self.jacobian.iter().all(|v| v.is_finite()) {
            return false;
        }
        let diagonal = self.tableau.real.inverse / length;
        shift(&mut self.real, &self.jacobian, diagonal);
        let mut found = invert(&mut self.real, &mut self.places);
        for (inverse, eigenvalue) in self.complex.iter_mut().zip(&self.tableau.complex) {
            shift(inverse, &self.jacobian, eigenvalue.inverse / length);
            found = found && invert(inverse, &mut self.places);
        }
        found
    }

    fn evaluate(&mut self, problem: &impl StiffProblem, t: f64, y: &[f64], length: f64) {
        for i in 0..S {
            for (stage, (y, z)) in self.stage.iter_mut().zip(y.iter().zip(&self.z)) {
                *stage = y + z[i];
            }
            problem.rhs(t + self.tableau.c[i] * length, &self.stage, &mut self.rates);
            for (f, rate) in self.f.iter_mut().zip(&self.rates) {
                f[i] = *rate;
            }
        }
        self.work.rhs_evaluations += S as u64;
    }

    fn iterate(&mut self, problem: &impl StiffProblem, t: f64, y: &[f64], length: f64, weights: &[f64]) -> bool {
        let tableau = self.tableau.clone();
        let mut last = f64::INFINITY;
        for round in 0..NEWTON_ITERATIONS {
            self.evaluate(problem, t, y, length);
            self.work.iterations += 1;
            let scale = tableau.real.inverse / length;
            for (k, residual) in self.residual.iter_mut().enumerate() {
                *residual = tableau.a * self.f[k] * length - self.z[k];
                self.real_side[k] = residual.dot(&tableau.real.left) * scale;
            }
            for (k, row) in self.real.row_iter().enumerate() {
                let solved: f64 = row.iter().zip(&self.real_side).map(|(a, b)| a * b).sum();
                self.f[k] = tableau.real.right * solved;
            }
            for (inverse, eigenvalue) in self.complex.iter().zip(&tableau.complex) {
                let scale = eigenvalue.inverse / length;
                for (side, residual) in self.complex_side.iter_mut().zip(&self.residual) {
                    let terms = eigenvalue.left.iter().zip(residual);
                    *side = terms.map(|(left, residual)| left * residual).sum::<Complex<f64>>() * scale;
                }
                for (k, row) in inverse.row_iter().enumerate() {
                    let a: Complex<f64> = row.iter().zip(&self.complex_side).map(|(a, b)| a * b).sum();
                    for (change, b) in self.f[k].iter_mut().zip(&eigenvalue.right) {
                        *change += 2.0 * (a.re * b.re - a.im * b.im);
                    }
                }
            }
            let mut size: f64 = 0.0;
            for (k, weight) in weights.iter().enumerate().take(self.residual.len()) {
                self.z[k] += self.f[k];
                // Unlike f64::max, this comparison fails for NaN.
                for share in self.f[k].iter().map(|change| change.abs() / weight) {
                    size = if share <= size { size } else { share };
                }
            }
            if !size.is_finite() {
                return false;
            }
            let rate = size / last;
            // The first change has no rate yet. Below a hundredth of the required accuracy it needs none.
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

    /// The first missing coefficient of the polynomial, extrapolated from the decay of the others.
    fn error(&self, weights: &[f64]) -> f64 {
        let size = |n: usize| {
            let coefficients = self.step.coefficients.iter().zip(weights);
            coefficients.map(|(c, weight)| c[n].abs() / weight).fold(0.0, f64::max)
        };
        let (last, before, two_before) = (size(S - 1), size(S - 2), size(S - 3));
        if last == 0.0 {
            return 0.0;
        }
        let decay = (last / before).max((last / two_before).sqrt()).min(1.0);
        last * decay * 2.0 * xi(S)
    }
}

fn shift<T: ComplexField<RealField = f64>>(matrix: &mut DMatrix<T>, jacobian: &DMatrix<f64>, diagonal: T) {
    for (shifted, entry) in matrix.iter_mut().zip(jacobian) {
        *shifted = T::from_real(-entry);
    }
    for k in 0..jacobian.nrows() {
        matrix[(k, k)] += diagonal.clone();
    }
}

/// Inverts a matrix in place by elimination, with row exchanges in `places`. Returns false if the matrix is singular.
pub fn invert<T: ComplexField<RealField = f64> + Copy>(matrix: &mut DMatrix<T>, places: &mut [usize]) -> bool {
    let n = matrix.nrows();
    for (c, exchanged) in places.iter_mut().enumerate() {
        let (mut place, mut most) = (c, 0.0);
        for r in c..n {
            let size = matrix[(r, c)].norm1();
            if size > most {
                (place, most) = (r, size);
            }
        }
        if most == 0.0 {
            return false;
        }
        *exchanged = place;
        matrix.swap_rows(c, place);
        let pivot = T::one() / matrix[(c, c)];
        for j in 0..n {
            matrix[(c, j)] = if j == c { pivot } else { matrix[(c, j)] * pivot };
        }
        for r in (0..n).filter(|r| *r != c) {
            let factor = matrix[(r, c)];
            matrix[(r, c)] = T::zero();
            for j in 0..n {
                let above = matrix[(c, j)];
                matrix[(r, j)] -= factor * above;
            }
        }
    }
    for (c, place) in places.iter().enumerate().rev() {
        matrix.swap_columns(c, *place);
    }
    true
}
