//! Linear limit of a plane: the loss of stability of steady sliding.

use super::axis::AxisRange;
use super::criterion::BoundarySpec;
use super::study::Study;
use super::tracer::place_in_plane;
use crate::analysis::stability::steady_stability;
use stickslip_case::Setting;
use stickslip_system::friction::Law;
use stickslip_system::model::margin::twice_resistance;
use stickslip_system::model::system::{Pressing, System};

const LIMIT_POINTS: usize = 61;

/// Bisections of the range of x, down to the rounding of a double.
const LIMIT_HALVINGS: usize = 50;

/// Zeros of the margin of steady sliding at equally spaced values of y: every change of sign on the first grid, in
/// order of x. For sliding that slows down by itself, the margin is its least value under the largest force.
pub(super) fn linear_limit(
    study: &Study,
    spec: &BoundarySpec,
    ranges: [AxisRange; 2],
    plane: &[Setting],
) -> Vec<[f64; 2]> {
    let is_stable = |x: f64, y: f64| {
        let case = study.case_at(&place_in_plane(plane, spec, ranges, [x, y])).ok()?;
        let system = &case.system;
        match twice_resistance(system) {
            Some(resistance) => Some(least_margin(system, resistance) > 0.0),
            None => steady_stability(system).map(|found| !found.is_unstable()),
        }
    };
    let intervals = spec.nodes[0].max(2) - 1;
    let mut points = Vec::new();
    for k in 0..LIMIT_POINTS {
        let y = k as f64 / (LIMIT_POINTS - 1) as f64;
        let node = |interval: usize| interval as f64 / intervals as f64;
        let mut before = is_stable(node(0), y);
        for interval in 0..intervals {
            let after = is_stable(node(interval + 1), y);
            if let (Some(at_low), Some(at_high)) = (before, after)
                && at_low != at_high
                && let Some(x) = change(node(interval), node(interval + 1), |x| Some(is_stable(x, y)? == at_low))
            {
                points.push([ranges[0].at(x), ranges[1].at(y)]);
            }
            before = after;
        }
    }
    points
}

/// End of a condition that holds at `low` but not at `high`; `None` if it is unknown in between.
fn change(mut low: f64, mut high: f64, holds: impl Fn(f64) -> Option<bool>) -> Option<f64> {
    for _ in 0..LIMIT_HALVINGS {
        let middle = 0.5 * (low + high);
        match holds(middle)? {
            true => low = middle,
            false => high = middle,
        }
    }
    Some(0.5 * (low + high))
}

/// Least 2 (R + r F mu') over all speeds, N m s/rad, under the largest force F.
fn least_margin(system: &System, twice_resistance: f64) -> f64 {
    let force = match &system.pressing {
        Pressing::Axial { actuation, .. } => actuation.pieces().largest(),
        Pressing::Force(force) => force.largest(),
    };
    let (_, at_rest) = system.law.coefficient_and_slope(0.0);
    let steepest = system.law.slope_bounds(0.0, f64::INFINITY).least;
    let least = if steepest < 0.0 { at_rest.min(steepest) } else { at_rest };
    twice_resistance + 2.0 * system.radius * force * least
}
