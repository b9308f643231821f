//! Traced boundaries: curves, their points and branches, and contours.

use stickslip_case::Setting;

/// Part of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveBranch {
    /// Before the largest y, at smaller x.
    Lower = 0,
    /// After the largest y, at larger x.
    Upper = 1,
    /// Largest y of a curve that turns.
    Fold = 2,
}

/// Point of a boundary between two runs, one of which meets the criterion. Coordinates are in the units of the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryPoint {
    /// Run that meets the criterion.
    pub met: [f64; 2],
    /// Run that does not meet the criterion.
    pub unmet: [f64; 2],
    /// Part of the boundary.
    pub branch: CurveBranch,
}

impl BoundaryPoint {
    /// Middle of both runs.
    pub fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|k| 0.5 * (self.met[k] + self.unmet[k]))
    }
}

/// Connected line of a boundary.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundaryCurve {
    /// Plane, as an index in [`Boundaries::planes`].
    pub plane: usize,
    /// Points along the line. A closed line repeats its first point.
    pub points: Vec<BoundaryPoint>,
}

/// Additional line, such as a contour.
#[derive(Debug, Clone, PartialEq)]
pub struct ContourLine {
    /// Index in [`Boundaries::planes`].
    pub plane: usize,
    /// Constant value along the line.
    pub level: f64,
    /// Points (first axis, second axis) in the keys' units.
    pub points: Vec<[f64; 2]>,
}

/// Boundaries of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Boundaries {
    /// Values of the axes outside each plane.
    pub planes: Vec<Vec<Setting>>,
    /// Curves in the order of the planes.
    pub curves: Vec<BoundaryCurve>,
    /// For a brake: limit at which steady sliding loses its stability only at standstill, c_t = -2 r F mu'(0) under
    /// the largest force. For other systems: change of stability of steady sliding under their drives.
    pub linear_limit: Vec<ContourLine>,
    /// Contours of the growth exponent G.
    pub growth: Vec<ContourLine>,
}
