//! Traced boundaries: curves, their points and branches, and contours.

use crate::case::Setting;

/// Which part of a curve a point belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Branch {
    /// Before the point of largest y, at the smaller x.
    Lower = 0,
    /// Beyond it, at the larger x.
    Upper = 1,
    /// The point of largest y of a curve that turns there.
    Fold = 2,
}

/// A point of a boundary: between two runs, one of which meets the criterion. In the units of the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryPoint {
    /// Of the run that meets the criterion.
    pub met: [f64; 2],
    /// Of the run that does not.
    pub unmet: [f64; 2],
    /// Which part of the boundary it is on.
    pub branch: Branch,
}

impl BoundaryPoint {
    /// The middle of the two.
    pub fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|k| 0.5 * (self.met[k] + self.unmet[k]))
    }
}

/// One connected line of a boundary.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Which plane: the values of the other axes.
    pub plane: usize,
    /// In order along the line; the first again at the end of a closed one.
    pub points: Vec<BoundaryPoint>,
}

/// A line beside the boundary, such as a contour.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Place in [`Boundaries::planes`].
    pub plane: usize,
    /// What is constant along it.
    pub level: f64,
    /// (first axis, second axis), in the keys' units.
    pub points: Vec<[f64; 2]>,
}

/// What tracing a boundary came to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Boundaries {
    /// The values of the axes outside the plane, for each plane.
    pub planes: Vec<Vec<Setting>>,
    /// In the order of the planes.
    pub curves: Vec<Curve>,
    /// Of a brake, where steady sliding loses its stability only in the limit of standstill: c_t = -2 r F mu'(0) under the
    /// largest force. Of trains, where that under their drives changes its stability.
    pub linear_limit: Vec<Line>,
    /// Contours of the growth exponent G.
    pub growth: Vec<Line>,
}
