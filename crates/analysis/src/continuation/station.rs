//! A point of a branch, and a trial for the next point.

use super::manifold::{Local, Measured};
use super::special::Tests;
use crate::cycle::NewtonSolution;
use nalgebra::{DMatrix, DVector};

/// Point with the direction of the branch, in physical units.
#[derive(Debug, Clone)]
pub(crate) struct Station {
    pub measured: Measured,
    pub direction: DVector<f64>,
    pub tests: Tests,
}

/// Solution on the plane across a direction, at a distance along this direction.
pub(super) struct Trial {
    pub solution: NewtonSolution,
    pub station: Station,
}

pub(super) fn scaled(local: &Local<'_>, direction: &DVector<f64>) -> DVector<f64> {
    direction.component_div(local.scale()).normalize()
}

pub(super) fn row(direction: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_row_slice(1, direction.len(), direction.as_slice())
}
