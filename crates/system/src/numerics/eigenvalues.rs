//! Eigenvalues and eigenvectors.

use nalgebra::linalg::Schur;
use nalgebra::{Complex, DMatrix, DVector};

/// Most QR sweeps per row in one attempt. An eigenvalue usually takes two or three.
const SWEEPS: usize = 40;

/// Factor by which the tolerance grows from attempt to attempt, and its limit.
const LOOSENING: f64 = 4.0;
const LOOSEST: f64 = 1e-6;

/// All eigenvalues of a square matrix, in the unit of its entries; NaN if an entry is not finite.
///
/// `DMatrix::complex_eigenvalues` iterates without a bound. It never ends if an entry is NaN, or if its shifts do not
/// change the matrix, as with a cyclic permutation. Here a failed attempt is repeated with a larger tolerance on a
/// mirror image of the matrix, which has the same eigenvalues but other shifts.
pub fn eigenvalues(matrix: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let rows = matrix.nrows();
    let (mut image, mut tolerance, mut round) = (matrix.clone(), f64::EPSILON, 1.0);
    while tolerance < LOOSEST && image.iter().all(|entry| entry.is_finite()) {
        if let Some(schur) = Schur::try_new(image.clone(), tolerance, SWEEPS * rows.max(5)) {
            return schur.complex_eigenvalues().iter().copied().collect();
        }
        let normal = DVector::from_fn(rows, |i, _| (round * (i as f64 + 1.0)).cos()).normalize();
        let mirror = DMatrix::identity(rows, rows) - &normal * normal.transpose() * 2.0;
        image = &mirror * image * &mirror;
        tolerance *= LOOSENING;
        round += 1.0;
    }
    vec![Complex::new(f64::NAN, f64::NAN); rows]
}

/// An eigenvector of length 1 for an eigenvalue of a square matrix; `None` if an entry is not finite.
pub fn null_vector(matrix: &DMatrix<f64>, value: Complex<f64>) -> Option<DVector<Complex<f64>>> {
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
