//! Eigenvalues of the small matrices of a state's equations.

use crate::model::state::DYNAMIC;
use crate::model::torsion::TorsionModel;
use nalgebra::linalg::Schur;
use nalgebra::{Complex, DMatrix, DVector, SMatrix};

/// Most sweeps of the QR iteration in one attempt. A matrix of five rows takes a dozen.
const SWEEPS: usize = 200;

/// By how much the tolerance grows from one attempt to the next, and how large it may become.
const LOOSENING: f64 = 4.0;
const LOOSEST: f64 = 1e-6;

/// The leading block of a Jacobian, of `size` rows, with the twists scaled to the size of their rates: the eigenvalues stay,
/// their rounding shrinks.
pub(super) fn leading_block(
    jacobian: &SMatrix<f64, DYNAMIC, DYNAMIC>,
    size: usize,
    torsion: &TorsionModel,
) -> DMatrix<f64> {
    let weight = |k: usize| torsion.rate_weight(k);
    DMatrix::from_fn(size, size, |i, j| jacobian[(i, j)] * weight(i) / weight(j))
}

/// All eigenvalues of a square matrix, in the unit of its entries; NaN for each if entries are not finite.
///
/// `DMatrix::complex_eigenvalues` iterates without a bound: for ever where an entry is NaN, and where its shifts leave the
/// matrix as it is, as they leave a cyclic permutation. Here an attempt that does not settle is followed by one on a mirror
/// image of the matrix, which has the same eigenvalues and other shifts, at a wider tolerance.
pub(crate) fn eigenvalues(matrix: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let rows = matrix.nrows();
    let (mut image, mut tolerance, mut round) = (matrix.clone(), f64::EPSILON, 1.0);
    while tolerance < LOOSEST && image.iter().all(|entry| entry.is_finite()) {
        if let Some(schur) = Schur::try_new(image.clone(), tolerance, SWEEPS) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::Growth;
    use crate::case::{Case, CaseSource, Override};
    use crate::record::MemoryRecorder;
    use crate::run::Run;
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

    #[test]
    fn property_what_is_no_number_has_no_eigenvalues() {
        for entry in [f64::NAN, f64::INFINITY] {
            let mut matrix = DMatrix::identity(5, 5);
            matrix[(1, 3)] = entry;
            assert!(eigenvalues(&matrix).iter().all(|l| l.re.is_nan()));
        }
    }

    /// A kick turns the slip against its rotor, and there it loses its stability. Smooth sliding with that sense does not
    /// exist, and its path has no length; followed all the same, it was one of NaN.
    #[test]
    fn regression_growth_where_a_kick_turns_the_slip() {
        let changes = [
            "axial.mass=5.540203543435869",
            "axial.stiffness=441101935.4355345",
            "axial.damping=49242.97470294818",
            "torsion.surface_inertia=0.7436364960809474",
            "torsion.rotor_inertia=81.78984040117506",
            "torsion.stiffness=986609.1472740709",
            "torsion.damping=69.54924980074699",
            "friction.breakaway=0.8181204716362555",
            "friction.low_speed=0.8181204716362555",
            "friction.high_speed=0.7296425720203465",
            "friction.decay=134.9667145864564",
            "initial.speed=90.82619909031959",
            "actuation={profile=\"ramp\",force=156.84880099552018,rise_time=12.059132431217796}",
            "perturbation=[{kind=\"kick\",time=19.904894134713516,relative_velocity=64.36110248123921},\
             {kind=\"kick\",time=17.188076480014825,relative_velocity=-114.30165801443698},\
             {kind=\"kick\",time=2.1635393315026006,relative_velocity=-5.333492895183853}]",
            "output.window=[]",
            "output.around=none",
            "output.interval=10",
            "output.end_time=21.81964290642463",
            "solver.method=series",
        ];
        let overrides = changes.map(|change| Override::parse(change).unwrap());
        let case = Case::parse(&CaseSource::built_in("paper-si").unwrap(), &overrides).unwrap();
        let mut recorder = MemoryRecorder::default();
        Run::new(&case).record(&mut recorder).start().unwrap();
        let growth = Growth::of_run(&case.parameters, &recorder.events, case.output.end_time);
        let growth = growth.expect("stability is lost");
        assert_eq!((growth.exponent, growth.smooth_end), (0.0, growth.instability));
    }
}
