//! Coefficients of Radau IIA with S stages, S odd. The method has order 2S - 1, and is L-stable and stiffly accurate.
//!
//! The coefficients follow from the roots of the Radau polynomial. They are computed in the basis of Legendre
//! polynomials, which is well conditioned (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5 and
//! IV.8). With W_ik = P_k(c_i), P_k orthonormal on [0, 1], the quadrature weights are b_i = 1 / sum_k W_ik^2, W^-1 =
//! W^T diag(b), and A = W X W^-1 with a tridiagonal X.

use nalgebra::{Complex, DMatrix, DVector, SMatrix, SVector};

/// Radau IIA with S stages.
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
pub(crate) fn xi(k: usize) -> f64 {
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
