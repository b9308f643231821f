//! Eigenvalues.

use nalgebra::linalg::Schur;
use nalgebra::{Complex, DMatrix, DVector};

/// Most sweeps of the QR iteration in one attempt, for each row. An eigenvalue takes two or three.
const SWEEPS: usize = 40;

/// By how much the tolerance grows from one attempt to the next, and how large it may become.
const LOOSENING: f64 = 4.0;
const LOOSEST: f64 = 1e-6;

/// All eigenvalues of a square matrix, in the unit of its entries; NaN for each if entries are not finite.
///
/// `DMatrix::complex_eigenvalues` iterates without a bound: for ever where an entry is NaN, and where its shifts leave the
/// matrix as it is, as they leave a cyclic permutation. Here an attempt that does not settle is followed by one on a mirror
/// image of the matrix, which has the same eigenvalues and other shifts, at a wider tolerance.
pub(crate) fn eigenvalues(matrix: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let rows = matrix.nrows();
    let (mut image, mut tolerance, mut round) = (matrix.clone(), f64::EPSILON, 1.0);
    while tolerance < LOOSEST && image.iter().all(|entry| entry.is_finite()) {
        if let Some(schur) = Schur::try_new(image.clone(), tolerance, SWEEPS * rows.max(5)) {
            return schur.complex_eigenvalues().iter().copied().collect();
        }
        // Any direction that is not special to a matrix.
        let normal = DVector::from_fn(rows, |i, _| (round * (i as f64 + 1.0)).cos()).normalize();
        let mirror = DMatrix::identity(rows, rows) - &normal * normal.transpose() * 2.0;
        image = &mirror * image * &mirror;
        tolerance *= LOOSENING;
        round += 1.0;
    }
    vec![Complex::new(f64::NAN, f64::NAN); rows]
}

/// An eigenvector of a square matrix to an eigenvalue, of length 1; `None` if entries are not finite.
pub(crate) fn null_vector(matrix: &DMatrix<f64>, value: Complex<f64>) -> Option<DVector<Complex<f64>>> {
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let n = matrix.nrows();
    let shifted = DMatrix::from_fn(n, n, |i, j| {
        let own = if i == j { value } else { Complex::new(0.0, 0.0) };
        Complex::new(matrix[(i, j)], 0.0) - own
    });
    let svd = shifted.svd(false, true);
    let (index, _) = svd.singular_values.argmin();
    Some(svd.v_t?.row(index).adjoint())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// The eigenvalues of a cyclic permutation are the roots of unity, all well-conditioned, as it is orthogonal: rounding
    /// and the tolerance of a second attempt leave 1e-13.
    #[test]
    fn analytic_eigenvalues_of_what_the_shifts_leave_alone() {
        for rows in [3, 4, 5, 6] {
            let cycle = DMatrix::from_fn(rows, rows, |i, j| f64::from(u8::from(i == (j + 1) % rows)));
            let found = eigenvalues(&cycle);
            for k in 0..rows {
                let expected = Complex::from_polar(1.0, TAU * k as f64 / rows as f64);
                let nearest = found
                    .iter()
                    .map(|l| (l - expected).norm())
                    .fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-13, "{rows} rows, {expected}: {nearest:e}");
            }
        }
    }

    /// A chain of equal inertias and shafts, one end of which is held: closed form. A long one takes more sweeps than a short one.
    #[test]
    fn analytic_eigenvalues_of_chains() {
        for inertias in [1, 2, 10, 60] {
            let rows = 2 * inertias;
            let chain = DMatrix::from_fn(rows, rows, |i, j| match (i % 2, i / 2, j % 2, j / 2) {
                (0, i, 1, j) => f64::from(u8::from(i == j)),
                (1, i, 0, j) if i == j => {
                    if i + 1 == inertias {
                        -1.0
                    } else {
                        -2.0
                    }
                }
                (1, i, 0, j) => f64::from(u8::from(i.abs_diff(j) == 1)),
                _ => 0.0,
            });
            let mut found = eigenvalues(&chain);
            found.retain(|l| l.im > 0.0);
            found.sort_by(|a, b| a.im.total_cmp(&b.im));
            assert_eq!(found.len(), inertias);
            for (k, found) in found.iter().enumerate() {
                let angle = (2 * k + 1) as f64 * TAU / (4 * (2 * inertias + 1)) as f64;
                let expected = Complex::new(0.0, 2.0 * angle.sin());
                assert!((found - expected).norm() < 1e-12, "{inertias}, {k}: {found}");
            }
        }
    }

    #[test]
    fn property_what_is_no_number_has_no_eigenvalues() {
        for entry in [f64::NAN, f64::INFINITY] {
            let mut matrix = DMatrix::identity(5, 5);
            matrix[(1, 3)] = entry;
            assert!(eigenvalues(&matrix).iter().all(|l| l.re.is_nan()));
        }
    }
}
