//! Stick and separation whose fast oscillations have died: the motion of the slow modes alone, which is not stiff.
//!
//! Both are linear, y' = A y. The projector P on the space of the slow modes commutes with A, so that once the fast modes are
//! gone y' = P A y is the same motion without any fast mode.

use super::OfLinearModes;
use super::equations::SystemEquations;
use crate::model::Mode;
use crate::numerics::eigenvalues::eigenvalues;
use nalgebra::{DMatrix, DMatrixViewMut, DVector};

/// The fast modes are at least this much faster than the slow ones.
const GAP: f64 = 3.0;

/// Eigenvalues below this share of the largest count as zero: a double zero comes out as the root of a rounding.
const STANDING: f64 = 1e-6;

/// Most steps of Newton's iteration for the sign of a matrix; ten are usual.
const ROUNDS: usize = 60;

/// The slow motions of a system in stick and in separation; each is made when it is first asked for.
pub(crate) type SlowMotions = OfLinearModes<SlowMotion>;

impl SlowMotions {
    /// The slow motion of a mode that is linear; `None` of another, and where no mode is slow against the others.
    pub fn of(&self, system: &SystemEquations, mode: Mode) -> Option<&SlowMotion> {
        self.get(mode, || SlowMotion::new(system, mode))
    }
}

/// The slow modes of a linear mode of the contact.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SlowMotion {
    /// P, on what the motion depends on.
    projector: DMatrix<f64>,
    /// Least rate at which a fast mode dies, 1/s.
    pub fast_decay: f64,
}

impl SlowMotion {
    fn new(system: &SystemEquations, mode: Mode) -> Option<SlowMotion> {
        let matrix = system.balanced(system.linear_matrix(mode));
        let mut modes = eigenvalues(&matrix);
        modes.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        let fastest = modes.last()?.norm();
        let standing = modes.iter().filter(|mode| mode.norm() <= STANDING * fastest).count();
        // What stands still is slow, and so is what moves below the widest gap.
        let gap = |i: usize| modes[i].norm() / modes[i - 1].norm();
        let widest = (standing + 1..modes.len()).max_by(|a, b| gap(*a).total_cmp(&gap(*b)));
        let first = widest.filter(|widest| gap(*widest) >= GAP).unwrap_or(standing);
        if first == 0 {
            return None;
        }
        let slowest = modes[first - 1].norm().max(STANDING * fastest);
        let between = (modes[first].norm() * slowest).sqrt();
        // (s - b)/(s + b) has a positive real part where |s| > b, and a negative one where |s| < b.
        let n = matrix.nrows();
        let circle = DMatrix::identity(n, n) * between;
        let mut sign = (&matrix + &circle).try_inverse()? * (&matrix - &circle);
        for _ in 0..ROUNDS {
            let next = (&sign + sign.clone().try_inverse()?) * 0.5;
            let change = (&next - &sign).norm();
            sign = next;
            if change <= 1e-14 * sign.norm() {
                break;
            }
        }
        let fast = modes[first..].iter().map(|mode| -mode.re);
        let projector = (DMatrix::identity(n, n) - sign) * 0.5;
        Some(SlowMotion {
            projector: system.unbalanced(projector),
            fast_decay: fast.fold(f64::INFINITY, f64::min),
        })
    }

    /// Takes what the fast modes contribute out of `rates`.
    pub fn project(&self, rates: &mut [f64]) {
        let n = self.projector.nrows();
        let slow = &self.projector * DVector::from_column_slice(&rates[..n]);
        rates[..n].copy_from_slice(slow.as_slice());
    }

    /// The same in each column of the Jacobian of the rates.
    pub fn project_columns(&self, jacobian: &mut DMatrixViewMut<'_, f64>) {
        let n = self.projector.nrows();
        let mut rows = jacobian.rows_mut(0, n);
        let slow = &self.projector * &rows;
        rows.copy_from(&slow);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::samples;
    use crate::model::system::System;

    /// P is a projector that commutes with A, and keeps a rotor that swings on both shafts while the disks' own mode goes.
    #[test]
    fn analytic_what_is_kept_of_a_stick_is_its_slow_mode() {
        for number in 0..20 {
            let system = SystemEquations::new(&System::from(&samples::brake(number)));
            for mode in [Mode::Stick, Mode::Separated] {
                let slow = SlowMotion::new(&system, mode).expect("a rotor is heavier than its disk");
                let (p, a) = (
                    system.balanced(slow.projector.clone()),
                    system.balanced(system.linear_matrix(mode)),
                );
                assert!((&p * &p - &p).norm() < 1e-11, "{number}, {mode:?}");
                assert!((&p * &a - &a * &p).norm() < 1e-11 * a.norm(), "{number}, {mode:?}");
                let kept = p.trace().round();
                assert_eq!(kept, if mode == Mode::Stick { 3.0 } else { 1.0 }, "{number}");
                let largest =
                    |modes: Vec<nalgebra::Complex<f64>>| modes.iter().map(|mode| mode.norm()).fold(0.0, f64::max);
                assert!(largest(eigenvalues(&(&p * &a))) * GAP <= largest(eigenvalues(&a)));
                assert!(slow.fast_decay > 0.0, "{number}");
            }
        }
    }
}
