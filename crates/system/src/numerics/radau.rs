//! Steps of Radau IIA for a small system with quadratures.
//!
//! The stages come from a simplified Newton iteration in the eigenbasis of A, which takes one real and (S - 1)/2
//! complex systems of the problem's dimension. Within a step the solution is the collocation polynomial of degree S,
//! stored as the Legendre coefficients of its derivative. The decay of these coefficients estimates the error of the
//! polynomial, to order S. For the end of the step this estimate is cautious, because its order is 2S - 1 for
//! problems that are not stiff. The polynomial also predicts the next stages.

use nalgebra::{Complex, ComplexField, DMatrix, DMatrixViewMut, DVector, SMatrix, SVector};
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

/// Coefficients of Radau IIA with S stages, S odd. The method has order 2S - 1, and is L-stable and stiffly accurate.
///
/// The coefficients follow from the roots of the Radau polynomial. They are computed in the basis of Legendre
/// polynomials, which is well conditioned (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5 and
/// IV.8). With W_ik = P_k(c_i), P_k orthonormal on [0, 1], the quadrature weights are b_i = 1 / sum_k W_ik^2, W^-1 =
/// W^T diag(b), and A = W X W^-1 with a tridiagonal X.
#[derive(Debug, Clone)]
pub struct RadauTableau<const S: usize> {
    /// Nodes, increasing. The last one is 1.
    pub c: SVector<f64, S>,
    /// Weights.
    pub b: SVector<f64, S>,
    /// Coefficients. The last row is `b`.
    pub a: SMatrix<f64, S, S>,
    /// The real eigenvalue of A.
    pub real: Eigenvalue<f64, S>,
    /// One eigenvalue of each complex pair, (S - 1)/2 in total.
    pub complex: Vec<Eigenvalue<Complex<f64>, S>>,
    /// X^-1 W^-1: maps increments of the stages to Legendre coefficients of the derivative times the step.
    pub to_legendre: SMatrix<f64, S, S>,
}

/// An eigenvalue of A with its part of the transformation: A is the sum of right lambda left over all eigenvalues.
#[derive(Debug, Clone)]
pub struct Eigenvalue<F, const S: usize> {
    /// Eigenvalue of A^-1.
    pub inverse: F,
    /// Column of T.
    pub right: SVector<F, S>,
    /// Row of T^-1.
    pub left: SVector<F, S>,
}

/// The orthonormal Legendre polynomials P_0 to P_(N-1) on [0, 1] at `x`.
pub fn legendre<const N: usize>(x: f64) -> SVector<f64, N> {
    let mut p = SVector::zeros();
    let z = 2.0 * x - 1.0;
    let (mut last, mut this) = (0.0, 1.0);
    for k in 0..N {
        p[k] = this * ((2 * k + 1) as f64).sqrt();
        let next = ((2 * k + 1) as f64 * z * this - k as f64 * last) / (k + 1) as f64;
        (last, this) = (this, next);
    }
    p
}

/// The integrals from 0 to `x` of P_0 to P_(N-1).
pub fn legendre_integrals<const N: usize>(x: f64) -> SVector<f64, N> {
    let p: SVector<f64, N> = legendre(x);
    let z = 2.0 * x - 1.0;
    let plain = |k: usize| p[k] / ((2 * k + 1) as f64).sqrt();
    let beyond = ((2 * N - 1) as f64 * z * plain(N - 1) - (N - 1) as f64 * plain(N - 2)) / N as f64;
    let beyond = beyond * ((2 * N + 1) as f64).sqrt();
    SVector::from_fn(|k, _| {
        let upper = xi(k + 1) * if k + 1 < N { p[k + 1] } else { beyond };
        let lower = if k == 0 { -0.5 * p[0] } else { xi(k) * p[k - 1] };
        upper - lower
    })
}

/// xi_k = 1 / (2 sqrt(4 k^2 - 1)), for the integrals of the orthonormal polynomials.
fn xi(k: usize) -> f64 {
    0.5 / ((4 * k * k - 1) as f64).sqrt()
}

impl<const S: usize> RadauTableau<S> {
    /// Computes the coefficients. S must be odd and at least 3.
    pub fn new() -> Self {
        const { assert!(S % 2 == 1 && S >= 3, "an even number of stages has no real eigenvalue") };
        let c = nodes::<S>();
        let mut w = SMatrix::<f64, S, S>::zeros();
        for i in 0..S {
            w.set_row(i, &legendre::<S>(c[i]).transpose());
        }
        let b = SVector::from_fn(|i, _| 1.0 / w.row(i).norm_squared());
        let w_inverse = w.transpose() * SMatrix::from_diagonal(&b);
        let x = integration::<S>();
        let a = w * x * w_inverse;
        let x_inverse = x.try_inverse().expect("X has no eigenvalue zero");
        let (real, complex) = eigenvalues(&x, &w, &w_inverse);
        RadauTableau {
            c,
            b,
            a,
            real,
            complex,
            to_legendre: x_inverse * w_inverse,
        }
    }

    /// The stability function R(z) = 1 + z b^T (1 - z A)^-1 1, for the tests.
    pub fn stability(&self, z: Complex<f64>) -> Complex<f64> {
        let one = DVector::from_element(S, Complex::new(1.0, 0.0));
        let matrix = DMatrix::from_fn(S, S, |i, j| {
            Complex::new(f64::from(u8::from(i == j)), 0.0) - z * self.a[(i, j)]
        });
        // The stages of y' = lambda y are (1 - z A)^-1 1, and the last one is the result.
        matrix
            .lu()
            .solve(&one)
            .map_or(Complex::new(f64::NAN, 0.0), |stages| stages[S - 1])
    }
}

impl<const S: usize> Default for RadauTableau<S> {
    fn default() -> Self {
        Self::new()
    }
}

/// Zeros of P_(S-1)(z) - P_S(z), plain Legendre polynomials, mapped to (0, 1]. Newton's method first runs with the
/// known zeros divided out, then without.
fn nodes<const S: usize>() -> SVector<f64, S> {
    // Value and derivative of (P_(S-1) - P_S) / (1 - z), by differentiated recurrences.
    let radau = |z: f64| {
        let (mut last, mut this, mut last_rate, mut rate) = (0.0, 1.0, 0.0, 0.0);
        for k in 0..S {
            let next = ((2 * k + 1) as f64 * z * this - k as f64 * last) / (k + 1) as f64;
            let next_rate = ((2 * k + 1) as f64 * (this + z * rate) - k as f64 * last_rate) / (k + 1) as f64;
            (last, this, last_rate, rate) = (this, next, rate, next_rate);
        }
        let (value, slope) = (last - this, last_rate - rate);
        (value / (1.0 - z), (slope + value / (1.0 - z)) / (1.0 - z))
    };
    let mut found = Vec::with_capacity(S);
    for j in 0..S - 1 {
        // The start lies between neighbouring zeros. It only matters that each search finds a new zero.
        let mut z = -(std::f64::consts::PI * (j as f64 + 0.75) / S as f64).cos();
        for round in 0..100 {
            let (value, slope) = radau(z);
            let divided: f64 = found.iter().map(|root| 1.0 / (z - root)).sum();
            let deflated = if round < 50 { divided } else { 0.0 };
            let step = value / (slope - value * deflated);
            z -= step;
            if step.abs() <= f64::EPSILON {
                break;
            }
        }
        found.push(z);
    }
    found.sort_by(f64::total_cmp);
    SVector::from_fn(|i, _| found.get(i).map_or(1.0, |z| (1.0 + z) / 2.0))
}

/// X: integrates the Legendre polynomials, with the last element of Radau IIA.
fn integration<const S: usize>() -> SMatrix<f64, S, S> {
    let mut x = SMatrix::zeros();
    x[(0, 0)] = 0.5;
    for k in 1..S {
        x[(k, k - 1)] = xi(k);
        x[(k - 1, k)] = -xi(k);
    }
    x[(S - 1, S - 1)] = 1.0 / (4 * S - 2) as f64;
    x
}

/// Eigenvalues of X, from the QR algorithm. Newton's method on the last row of the eigenvector's recurrence refines
/// them.
#[allow(clippy::type_complexity)]
fn eigenvalues<const S: usize>(
    x: &SMatrix<f64, S, S>,
    w: &SMatrix<f64, S, S>,
    w_inverse: &SMatrix<f64, S, S>,
) -> (Eigenvalue<f64, S>, Vec<Eigenvalue<Complex<f64>, S>>) {
    let number = |v: f64| Complex::new(v, 0.0);
    // (X - lambda) v = 0 with v_0 = 1, and its derivative with respect to lambda. The last element is the residual of
    // the last row.
    let vector = |lambda: Complex<f64>| {
        let (mut v, mut dv) = (vec![number(1.0)], vec![number(0.0)]);
        for k in 0..S {
            let diagonal = number(x[(k, k)]) - lambda;
            let (mut row, mut row_rate) = (diagonal * v[k], diagonal * dv[k] - v[k]);
            if k > 0 {
                row += v[k - 1] * x[(k, k - 1)];
                row_rate += dv[k - 1] * x[(k, k - 1)];
            }
            let scale = if k + 1 < S { x[(k, k + 1)] } else { -1.0 };
            v.push(-row / scale);
            dv.push(-row_rate / scale);
        }
        (v, dv)
    };
    let rough = DMatrix::from_fn(S, S, |i, j| x[(i, j)]).complex_eigenvalues();
    let mut sharp: Vec<Complex<f64>> = rough
        .iter()
        .filter(|l| l.im >= 0.0 || l.im.abs() < 1e-6)
        .map(|&start| {
            let mut lambda = start;
            for _ in 0..20 {
                let (v, dv) = vector(lambda);
                lambda -= v[S] / dv[S];
            }
            lambda
        })
        .collect();
    sharp.sort_by(|p, q| p.im.abs().total_cmp(&q.im.abs()));
    // Columns: the real eigenvector, then each pair.
    let mut all = Vec::with_capacity(S);
    for (k, lambda) in sharp.iter().enumerate() {
        all.push(if k == 0 { number(lambda.re) } else { *lambda });
        if k > 0 {
            all.push(lambda.conj());
        }
    }
    let v = DMatrix::from_fn(S, S, |i, j| vector(all[j]).0[i]);
    let v_inverse = v.clone().try_inverse().expect("the eigenvalues differ");
    let right = DMatrix::from_fn(S, S, |i, j| number(w[(i, j)])) * v;
    let left = v_inverse * DMatrix::from_fn(S, S, |i, j| number(w_inverse[(i, j)]));
    let real = Eigenvalue {
        inverse: 1.0 / all[0].re,
        right: SVector::from_fn(|i, _| right[(i, 0)].re),
        left: SVector::from_fn(|i, _| left[(0, i)].re),
    };
    let complex = (1..S)
        .step_by(2)
        .map(|k| Eigenvalue {
            inverse: all[k].inv(),
            right: SVector::from_fn(|i, _| right[(i, k)]),
            left: SVector::from_fn(|i, _| left[(k, i)]),
        })
        .collect();
    (real, complex)
}
