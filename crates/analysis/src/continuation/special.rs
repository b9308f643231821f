//! Points of a branch, and special points: turning points, changes of stability, changes of the sequence of events.

use super::manifold::Measured;
use crate::cycle::{Border, Local, NewtonSolution, What};
use nalgebra::{Complex, DMatrix, DVector};

/// Kind of a special point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "each kind is described by its words")]
pub enum Special {
    Hopf,
    Fold,
    Flip,
    Torus,
    BranchPoint,
    /// The sequence of events changes.
    Border(Border),
}

/// Kinds without a change of events, with names in studies, files and figures, and words.
const SMOOTH: [(Special, &str, &str); 5] = [
    (
        Special::Hopf,
        "hopf",
        "Hopf: steady sliding changes its stability, cycles are born",
    ),
    (Special::Fold, "fold", "fold: the branch turns back"),
    (Special::Flip, "flip", "flip: a cycle of twice the period is born"),
    (Special::Torus, "torus", "torus: motion with a second frequency is born"),
    (
        Special::BranchPoint,
        "branch-point",
        "branch point: another branch crosses",
    ),
];

impl Special {
    /// All kinds, in the order of their codes in files.
    pub const ALL: [Special; 13] = {
        let mut all = [Special::Hopf; 13];
        let mut code = 0;
        while code < all.len() {
            all[code] = match code < SMOOTH.len() {
                true => SMOOTH[code].0,
                false => Special::Border(Border::ALL[code - SMOOTH.len()]),
            };
            code += 1;
        }
        all
    };

    /// Name in studies, files and figures.
    pub fn name(self) -> &'static str {
        match self {
            Special::Border(border) => border.name(),
            smooth => SMOOTH[smooth.code() as usize].1,
        }
    }

    /// Description in words.
    pub fn words(self) -> &'static str {
        match self {
            Special::Border(border) => border.words(),
            smooth => SMOOTH[smooth.code() as usize].2,
        }
    }

    /// Kind with this name.
    pub fn from_name(name: &str) -> Option<Special> {
        Special::ALL.into_iter().find(|special| special.name() == name)
    }

    /// Code in files.
    pub fn code(self) -> i8 {
        Special::ALL.iter().position(|special| *special == self).unwrap_or(0) as i8
    }
}

/// Test functions of special points between two points of a branch with the same sequence of events.
pub(crate) fn tests(what: What, measured: &Measured, direction: &DVector<f64>, jacobian: &DMatrix<f64>) -> Tests {
    let spectrum = &measured.spectrum;
    let (flip, crossing) = match what {
        What::Cycles(_) => {
            let mut product = 1.0;
            for one in spectrum.iter().filter(|one| one.im == 0.0) {
                product *= (one.re + 1.0) / (1.0 + one.re.abs());
            }
            let growing = spectrum.iter().filter(|one| one.im != 0.0 && one.norm() > 1.0);
            (product, growing.count())
        }
        What::Steady(_) => (1.0, spectrum.iter().filter(|one| one.im != 0.0 && one.re > 0.0).count()),
    };
    Tests {
        fold: direction[direction.len() - 1],
        flip,
        crossing,
        branch: bordered(jacobian, direction),
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tests {
    /// Component of the direction along the varied parameter.
    fold: f64,
    /// Product of (multiplier + 1) over the real multipliers.
    flip: f64,
    /// Number of growing complex multipliers or eigenvalues.
    crossing: usize,
    /// Determinant of equations and direction.
    branch: f64,
}

fn bordered(jacobian: &DMatrix<f64>, direction: &DVector<f64>) -> f64 {
    let columns = jacobian.ncols();
    let mut square = DMatrix::zeros(columns, columns);
    square.rows_mut(0, columns - 1).copy_from(jacobian);
    square.row_mut(columns - 1).copy_from(&direction.transpose());
    square.determinant()
}

impl Tests {
    pub fn turned(self) -> Tests {
        Tests {
            fold: -self.fold,
            branch: -self.branch,
            ..self
        }
    }

    pub fn passed(&self, there: &Tests, what: What) -> Vec<Special> {
        let pair = match what {
            What::Cycles(_) => Special::Torus,
            What::Steady(_) => Special::Hopf,
        };
        let all = [
            (Special::Fold, self.fold * there.fold < 0.0),
            (Special::Flip, self.flip * there.flip < 0.0),
            (pair, self.crossing != there.crossing),
            (Special::BranchPoint, self.branch * there.branch < 0.0),
        ];
        all.into_iter().filter(|one| one.1).map(|one| one.0).collect()
    }

    /// Zero at the special point, with opposite signs on both sides.
    pub fn value(&self, of: Special, measured: &Measured) -> f64 {
        match of {
            Special::Fold => self.fold,
            Special::Flip => self.flip,
            Special::BranchPoint => self.branch,
            Special::Hopf | Special::Torus => critical_pair(of, &measured.spectrum).map_or(f64::NAN, |pair| match of {
                Special::Hopf => pair.re,
                _ => pair.norm() - 1.0,
            }),
            Special::Border(_) => measured.orbit.nearest.map_or(f64::NAN, |nearest| nearest.distance),
        }
    }
}

/// The complex pair nearest to neutral.
pub(crate) fn critical_pair(of: Special, spectrum: &[Complex<f64>]) -> Option<Complex<f64>> {
    let off = |one: &Complex<f64>| match of {
        Special::Hopf => one.re.abs(),
        _ => (one.norm() - 1.0).abs(),
    };
    let complex = spectrum.iter().filter(|one| one.im > 0.0);
    complex.min_by(|a, b| off(a).total_cmp(&off(b))).copied()
}

/// Point with the direction of the branch, in physical units.
#[derive(Debug, Clone)]
pub(crate) struct Station {
    pub measured: Measured,
    pub direction: DVector<f64>,
    pub tests: Tests,
}

impl Station {
    /// Point with a direction in scaled unknowns and the Jacobian there.
    pub fn new(
        what: What,
        local: &Local<'_>,
        measured: Measured,
        direction: &DVector<f64>,
        jacobian: &DMatrix<f64>,
    ) -> Station {
        Station {
            tests: tests(what, &measured, direction, jacobian),
            direction: direction.component_mul(local.scale()),
            measured,
        }
    }
}

/// Solution on the plane across a direction, at a distance along this direction.
pub(super) struct Trial {
    pub solution: NewtonSolution,
    pub station: Station,
}

pub(super) fn scaled(local: &Local<'_>, direction: &DVector<f64>) -> DVector<f64> {
    direction.component_div(local.scale()).normalize()
}

/// Unit vector along a component.
pub(super) fn unit(length: usize, component: usize) -> DVector<f64> {
    DVector::from_fn(length, |k, _| f64::from(k == component))
}

pub(super) fn row(direction: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_row_slice(1, direction.len(), direction.as_slice())
}
