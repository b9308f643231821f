//! Stick and separation after the fast oscillations. The remaining motion of the slow modes is not stiff.
//!
//! Both motions are linear, y' = A y. The projector P on the space of the slow modes commutes with A. Without fast
//! modes y' = P A y is therefore the same motion.

use super::OfLinearModes;
use super::equations::SystemEquations;
use crate::model::Mode;
use crate::numerics::eigenvalues::eigenvalues;
use nalgebra::{DMatrix, DMatrixViewMut, DVector};

/// Smallest ratio between fast and slow eigenvalues.
pub const GAP: f64 = 3.0;

/// Eigenvalues below this share of the largest count as zero. Rounding splits a double zero by its square root.
const STANDING: f64 = 1e-6;

/// Most Newton steps for the sign of a matrix. Ten are usual.
const ROUNDS: usize = 60;

/// The slow motions in stick and in separation, each made on first use.
pub type SlowMotions = OfLinearModes<SlowMotion>;

impl SlowMotions {
    /// The slow motion in a linear mode; `None` in other modes, or if no mode is slow relative to the others.
    pub fn of(&self, system: &SystemEquations, mode: Mode) -> Option<&SlowMotion> {
        self.get(mode, || SlowMotion::new(system, mode))
    }
}

/// The slow modes in stick or separation.
#[derive(Debug, Clone, PartialEq)]
pub struct SlowMotion {
    /// P, which acts on the mechanical states.
    pub projector: DMatrix<f64>,
    /// Least decay of a fast mode, 1/s.
    pub fast_decay: f64,
}

impl SlowMotion {
    /// The slow motion in a mode; `None` if no mode is slow relative to the others.
    pub fn new(system: &SystemEquations, mode: Mode) -> Option<SlowMotion> {
        let matrix = system.balanced(system.linear_matrix(mode));
        let mut modes = eigenvalues(&matrix);
        modes.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        let fastest = modes.last()?.norm();
        let standing = modes.iter().filter(|mode| mode.norm() <= STANDING * fastest).count();
        // Standing modes are slow, and so are the modes below the widest gap.
        let gap = |i: usize| modes[i].norm() / modes[i - 1].norm();
        let widest = (standing + 1..modes.len()).max_by(|a, b| gap(*a).total_cmp(&gap(*b)));
        let first = widest.filter(|widest| gap(*widest) >= GAP).unwrap_or(standing);
        if first == 0 {
            return None;
        }
        let slowest = modes[first - 1].norm().max(STANDING * fastest);
        let between = (modes[first].norm() * slowest).sqrt();
        // (s - b)/(s + b) has a positive real part for |s| > b, and a negative one for |s| < b.
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

    /// Removes the fast modes from `rates`.
    pub fn project(&self, rates: &mut [f64]) {
        let n = self.projector.nrows();
        let slow = &self.projector * DVector::from_column_slice(&rates[..n]);
        rates[..n].copy_from_slice(slow.as_slice());
    }

    /// Removes the fast modes from each column of the Jacobian of the rates.
    pub fn project_columns(&self, jacobian: &mut DMatrixViewMut<'_, f64>) {
        let n = self.projector.nrows();
        let mut rows = jacobian.rows_mut(0, n);
        let slow = &self.projector * &rows;
        rows.copy_from(&slow);
    }
}
