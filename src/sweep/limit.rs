//! The linear limit: of a brake, where steady sliding loses its stability at a single speed, which is standstill with a law that
//! is steepest there; of trains, where that under their drives does.

use super::axis::Range;
use super::criterion::BoundarySpec;
use super::study::Study;
use super::tracer::place_in_plane;
use crate::analysis::trains::steady_stability;
use crate::case::{AnyCase, Case, Setting};
use crate::friction::Law;
use crate::model::torsion::TorsionModel;

/// Values of y at which the linear limit is given.
const LIMIT_POINTS: usize = 61;

/// Halvings of the range of x: to the rounding of a double.
const LIMIT_HALVINGS: usize = 50;

/// Where the margin of steady sliding is zero, for even values of y: of a brake the least one, under the largest force.
pub(super) fn linear_limit(study: &Study, spec: &BoundarySpec, ranges: [Range; 2], plane: &[Setting]) -> Vec<[f64; 2]> {
    let margin = |x: f64, y: f64| {
        let case = study.case_at(&place_in_plane(plane, spec, ranges, [x, y])).ok()?;
        match &case {
            AnyCase::Brake(case) => Some(least_margin(case)),
            // Of trains the sign is all that is asked for.
            AnyCase::Trains(case) => {
                steady_stability(&case.parameters).map(|found| if found.is_unstable() { -1.0 } else { 1.0 })
            }
        }
    };
    let mut points = Vec::new();
    for k in 0..LIMIT_POINTS {
        let y = k as f64 / (LIMIT_POINTS - 1) as f64;
        let (mut low, mut high) = (0.0, 1.0);
        let (Some(at_low), Some(at_high)) = (margin(low, y), margin(high, y)) else {
            continue;
        };
        if (at_low > 0.0) == (at_high > 0.0) {
            continue;
        }
        for _ in 0..LIMIT_HALVINGS {
            let middle = 0.5 * (low + high);
            match margin(middle, y) {
                Some(value) if (value > 0.0) == (at_low > 0.0) => low = middle,
                Some(_) => high = middle,
                None => break,
            }
        }
        points.push([ranges[0].at(0.5 * (low + high)), ranges[1].at(y)]);
    }
    points
}

/// c_t + 2 r F mu', N m s/rad, F the largest force, at the speed where that is least: at standstill, unless the friction law
/// falls fastest at another speed.
fn least_margin(case: &Case) -> f64 {
    let parameters = &case.parameters;
    let force = parameters.largest_force();
    let torsion = TorsionModel::new(parameters);
    let steepest = torsion.friction.law.slope_bounds(0.0, f64::INFINITY).least;
    let at_rest = torsion.stability_margin(1.0, 0.0, force);
    if steepest < 0.0 {
        at_rest.min(torsion.torsion.damping + torsion.slope_weight(force) * steepest)
    } else {
        at_rest
    }
}
