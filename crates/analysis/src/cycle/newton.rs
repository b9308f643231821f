//! Newton's method for underdetermined equations: to the nearest solution on a plane.

use super::error::CycleError;
use nalgebra::{DMatrix, DVector};

/// Equations in scaled unknowns of order 1.
pub(crate) trait NewtonEquations {
    /// Scaled residuals, and their derivatives with respect to the unknowns.
    fn evaluate(&mut self, x: &DVector<f64>) -> Result<(DVector<f64>, DMatrix<f64>), CycleError>;
}

#[derive(Debug, Clone)]
pub(crate) struct NewtonSolution {
    pub x: DVector<f64>,
    pub jacobian: DMatrix<f64>,
    /// Length of the last step, an error bound.
    pub error: f64,
    pub iterations: usize,
}

#[derive(Debug)]
pub(crate) enum NoSolution {
    /// The iterations are exhausted; the residuals are those of the best and the first point.
    Diverged {
        iterations: usize,
        residual: f64,
        first: f64,
    },
    /// The first point cannot be evaluated.
    Failed(CycleError),
}

impl NoSolution {
    /// Error of a search that started with this period (s).
    pub fn into_error(self, period: f64) -> CycleError {
        match self {
            NoSolution::Failed(error) => error,
            NoSolution::Diverged {
                iterations,
                residual,
                first,
            } => CycleError::Diverged {
                period,
                iterations,
                residual,
                first,
            },
        }
    }
}

const MOST_ITERATIONS: usize = 25;

const MOST_HALVINGS: usize = 15;

/// Step below which convergence is quadratic.
const NEAR: f64 = 1e-6;

/// A step below `EXACT` is rounding. A step below `SOLVED` suffices if steps have not shrunk `STUCK` times.
const EXACT: f64 = 1e-14;
const SOLVED: f64 = 1e-9;
const STUCK: u32 = 2;

/// Fraction of the largest singular value below which a direction is neutral and is not corrected.
const NEUTRAL: f64 = 1e-13;

/// Solution with `plane` (x - start) = 0. The plane has one row for each surplus unknown.
pub(crate) fn solve(
    equations: &mut dyn NewtonEquations,
    start: &DVector<f64>,
    plane: &DMatrix<f64>,
) -> Result<NewtonSolution, NoSolution> {
    let mut x = start.clone();
    let (mut residual, mut jacobian) = equations.evaluate(&x).map_err(NoSolution::Failed)?;
    let first = residual.amax();
    let (mut shortest, mut stuck) = (f64::INFINITY, 0);
    let mut halvings = 0;
    for iterations in 1..=MOST_ITERATIONS {
        let diverged = |residual: &DVector<f64>| NoSolution::Diverged {
            iterations,
            residual: residual.amax(),
            first,
        };
        let Some(step) = step(&jacobian, &residual, plane, &(&x - start)) else {
            return Err(diverged(&residual));
        };
        let length = step.amax();
        // Steps that no longer shrink are rounding.
        stuck = if length > 0.5 * shortest { stuck + 1 } else { 0 };
        shortest = shortest.min(length);
        if length <= EXACT || length <= SOLVED && stuck >= STUCK {
            return Ok(NewtonSolution {
                x: &x + &step,
                jacobian,
                error: length,
                iterations,
            });
        }
        let mut share = 1.0;
        loop {
            let next = &x + &step * share;
            match equations.evaluate(&next) {
                Ok((found, slopes)) if length < NEAR || found.amax() < (1.0 - 1e-3 * share) * residual.amax() => {
                    (x, residual, jacobian) = (next, found, slopes);
                    break;
                }
                Err(CycleError::Interrupted) => return Err(NoSolution::Failed(CycleError::Interrupted)),
                _ if halvings >= MOST_HALVINGS => return Err(diverged(&residual)),
                _ => {
                    share /= 2.0;
                    halvings += 1;
                }
            }
        }
    }
    Err(NoSolution::Diverged {
        iterations: MOST_ITERATIONS,
        residual: residual.amax(),
        first,
    })
}

fn step(
    jacobian: &DMatrix<f64>,
    residual: &DVector<f64>,
    plane: &DMatrix<f64>,
    moved: &DVector<f64>,
) -> Option<DVector<f64>> {
    let (rows, more) = (jacobian.nrows(), plane.nrows());
    let mut matrix = DMatrix::zeros(rows + more, jacobian.ncols());
    matrix.rows_mut(0, rows).copy_from(jacobian);
    matrix.rows_mut(rows, more).copy_from(plane);
    let mut right = DVector::zeros(rows + more);
    right.rows_mut(0, rows).copy_from(&-residual);
    right.rows_mut(rows, more).copy_from(&-(plane * moved));
    if !matrix.iter().chain(right.iter()).all(|x| x.is_finite()) {
        return None;
    }
    let svd = matrix.svd(true, true);
    let largest = svd.singular_values.max();
    svd.solve(&right, NEUTRAL * largest).ok()
}

/// Unit direction along which equations with one surplus unknown stay solved, on the side of `before`.
pub(crate) fn tangent(jacobian: &DMatrix<f64>, before: &DVector<f64>) -> Option<DVector<f64>> {
    if !jacobian.iter().all(|x| x.is_finite()) {
        return None;
    }
    // Only a square matrix gives a whole basis.
    let columns = jacobian.ncols();
    let mut square = DMatrix::zeros(columns, columns);
    square.rows_mut(0, jacobian.nrows()).copy_from(jacobian);
    let svd = square.svd(false, true);
    let (index, _) = svd.singular_values.argmin();
    let direction = svd.v_t?.row(index).transpose();
    Some(if direction.dot(before) < 0.0 {
        -direction
    } else {
        direction
    })
}
