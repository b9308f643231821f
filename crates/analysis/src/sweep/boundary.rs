//! Tracing of a criterion's boundary in a plane of two axes.
//!
//! The first grid is run. Cells in which the criterion changes are halved together with their neighbours, as often as
//! the study says. Then every edge of the finest cells with a change is bisected, and the fold of the curve is sought
//! along x. All points of a round run together, to occupy every thread. The next round depends only on the results, so
//! points and their numbers are reproducible.

use super::axis::AxisRange;
use super::criterion::BoundarySpec;
use super::curves::{Boundaries, BoundaryCurve, BoundaryPoint, ContourLine, CurveBranch};
use super::lattice::{Edge, Lattice, LatticeNode, contours};
use super::runner::Running;
use super::study::Study;
use super::tracer::{BoundaryCrossing, Tracer, place_in_plane, refine_folds};
use super::{PointOutcome, quantity_index};
use crate::analysis::stability::growth::foreseen_exponent;
use crate::analysis::stability::steady_stability;
use crate::error::Error;
use std::collections::{BTreeMap, BTreeSet};
use stickslip_case::Setting;
use stickslip_system::friction::Law;
use stickslip_system::model::margin::twice_resistance;
use stickslip_system::model::system::{Pressing, System};

/// Largest number of nodes of the grid for contours of G, and its largest refinement of the first grid.
const CONTOUR_NODES: usize = 4000;
const FINER: usize = 4;

pub(super) fn trace(spec: &BoundarySpec, running: &mut Running) -> Result<Boundaries, Error> {
    let study = running.study;
    let Some(ranges) = spec.ranges(&study.axes) else {
        return Ok(Boundaries::default());
    };
    let mut tracer = Tracer {
        running,
        spec,
        ranges,
        planes: planes(study, spec),
    };
    let mut lattices = vec![Lattice::new(spec.nodes, spec.refinements); tracer.planes.len()];
    let mut first = Vec::new();
    let mut failed = BTreeSet::new();
    loop {
        let unknown = lattices.iter().map(Lattice::unknown).enumerate();
        let wanted: Vec<_> = unknown
            .flat_map(|(plane, nodes)| nodes.into_iter().map(move |node| (plane, node)))
            .collect();
        let share = |&(plane, node): &(usize, LatticeNode)| (plane, lattices[plane].share(node));
        let outcomes = tracer.round(&wanted.iter().map(share).collect::<Vec<_>>())?;
        for (&(plane, node), outcome) in wanted.iter().zip(&outcomes) {
            lattices[plane].set(node, spec.criterion.is_met(outcome));
            if outcome.result.is_err() {
                failed.insert((plane, node));
            }
        }
        if first.is_empty() {
            first = outcomes;
        }
        let mut finer = true;
        for lattice in &mut lattices {
            finer &= lattice.refine();
        }
        if !finer {
            break;
        }
    }
    let lines = lattices.iter().map(Lattice::lines).enumerate();
    let lines: Vec<(usize, Vec<Edge>)> = lines
        .flat_map(|(plane, lines)| lines.into_iter().map(move |line| (plane, line)))
        .collect();
    // Each edge is taken once: a closed line repeats its first edge.
    let edges = lines.iter();
    let edges = edges.flat_map(|(plane, line)| line.iter().map(|&edge| (*plane, edge)));
    let edges: Vec<(usize, Edge)> = edges.collect::<BTreeSet<_>>().into_iter().collect();
    let crossing = |&(plane, edge): &(usize, Edge)| {
        let lattice = &lattices[plane];
        let [a, b] = edge.ends();
        let (met, unmet) = if lattice.is_met(a) { (a, b) } else { (b, a) };
        BoundaryCrossing {
            plane,
            met: lattice.share(met),
            unmet: lattice.share(unmet),
            unknown: failed.contains(&(plane, unmet)),
        }
    };
    let mut crossings: Vec<BoundaryCrossing> = edges.iter().map(crossing).collect();
    tracer.bisect(&mut crossings)?;
    let crossings: BTreeMap<(usize, Edge), BoundaryCrossing> = edges.into_iter().zip(crossings).collect();
    let of_line = |(plane, line): &(usize, Vec<Edge>)| -> Vec<BoundaryCrossing> {
        line.iter().map(|&edge| crossings[&(*plane, edge)].clone()).collect()
    };
    // A line ends where runs fail: there is no case beyond.
    let mut traced: Vec<Vec<BoundaryCrossing>> = Vec::new();
    for line in lines.iter().map(of_line) {
        let parts = line.split(|crossing| crossing.unknown);
        traced.extend(parts.filter(|part| !part.is_empty()).map(<[BoundaryCrossing]>::to_vec));
    }
    let cell = lattices[0].size.map(|cells| 1.0 / f64::from(cells));
    refine_folds(&mut tracer, &mut traced, cell)?;
    let place = |share: [f64; 2]| -> [f64; 2] { std::array::from_fn(|k| ranges[k].at(share[k])) };
    let point = |crossing: &BoundaryCrossing| BoundaryPoint {
        met: place(crossing.met),
        unmet: place(crossing.unmet),
        branch: CurveBranch::Lower,
    };
    let curve = |line: &Vec<BoundaryCrossing>| {
        let (plane, mut points) = (line[0].plane, line.iter().map(point).collect::<Vec<_>>());
        name_branches(&mut points);
        BoundaryCurve { plane, points }
    };
    let curves = traced.iter().map(curve).collect();
    // Kicks and tolerances do not move the limit of steady sliding, so one line suffices.
    let outside = study.axes.iter().enumerate().filter(|(k, _)| !spec.plane.contains(k));
    let mut outside = outside.flat_map(|(_, axis)| &axis.keys);
    let one_for_all = outside.all(|key| key.starts_with("perturbation.") || key.starts_with("solver."));
    let limits = if one_for_all { 1 } else { tracer.planes.len() };
    let growth = growth_contours(&tracer, &first, limits);
    let limit = |plane: usize| ContourLine {
        plane,
        level: 0.0,
        points: linear_limit(study, spec, ranges, &tracer.planes[plane]),
    };
    let linear_limit = (0..limits).map(limit).filter(|line| !line.points.is_empty()).collect();
    Ok(Boundaries {
        planes: tracer.planes,
        curves,
        linear_limit,
        growth,
    })
}

/// All combinations of levels outside the plane, one value for each axis. Axes in the plane have their first value.
fn planes(study: &Study, spec: &BoundarySpec) -> Vec<Vec<Setting>> {
    let mut planes: Vec<Vec<Setting>> = vec![Vec::new()];
    for (k, axis) in study.axes.iter().enumerate() {
        let count = if spec.plane.contains(&k) { 1 } else { axis.levels.len() };
        let with = |plane: &Vec<Setting>, level: &Setting| [plane.as_slice(), std::slice::from_ref(level)].concat();
        let levels = &axis.levels[..count];
        planes = planes
            .iter()
            .flat_map(|plane| levels.iter().map(move |level| with(plane, level)))
            .collect();
    }
    planes
}

/// Contours of G in the first `planes`: exact if G needs no run, else from the `outcomes` of the first grid.
fn growth_contours(tracer: &Tracer, outcomes: &[PointOutcome], planes: usize) -> Vec<ContourLine> {
    let Some(quantity) = quantity_index("growth_exponent").filter(|_| !tracer.spec.growth_contours.is_empty()) else {
        return Vec::new();
    };
    let [columns, rows] = tracer.spec.nodes;
    let finer = ((CONTOUR_NODES as f64 / (columns * rows) as f64).sqrt() as usize).clamp(1, FINER);
    let fine = [columns, rows].map(|count| (count - 1) * finer + 1);
    let mut lines = Vec::new();
    for (plane, outcomes) in outcomes.chunks(columns * rows).take(planes).enumerate() {
        let exact = |share: [f64; 2]| {
            let place = place_in_plane(&tracer.planes[plane], tracer.spec, tracer.ranges, share);
            let case = tracer.running.study.case_at(&place).ok();
            let growth = case.and_then(|case| foreseen_exponent(&case.system, case.output.end_time));
            growth.unwrap_or(f64::NAN)
        };
        let node = |k: usize| {
            let [i, j] = [k % fine[0], k / fine[0]];
            exact([i as f64 / (fine[0] - 1) as f64, j as f64 / (fine[1] - 1) as f64])
        };
        let values: Vec<f64> = (0..fine[0] * fine[1]).map(node).collect();
        let known = values.iter().all(|value| value.is_finite());
        let of_run = |k: usize| outcomes[(k % columns) * rows + k / columns].value(quantity);
        let (nodes, values) = if known {
            (fine, values)
        } else {
            (tracer.spec.nodes, (0..columns * rows).map(of_run).collect())
        };
        let exact: Option<&dyn Fn([f64; 2]) -> f64> = if known { Some(&exact) } else { None };
        for &level in &tracer.spec.growth_contours {
            for line in contours(nodes, &values, level, exact) {
                let place = |share: &[f64; 2]| std::array::from_fn(|k| tracer.ranges[k].at(share[k]));
                lines.push(ContourLine {
                    plane,
                    level,
                    points: line.iter().map(place).collect(),
                });
            }
        }
    }
    lines
}

/// Splits a curve at its largest y. Without a fold it is one branch: the lower one if the criterion is met at larger
/// x.
fn name_branches(points: &mut [BoundaryPoint]) {
    let y = |point: &BoundaryPoint| point.middle()[1];
    let Some(top) = (0..points.len()).max_by(|&a, &b| y(&points[a]).total_cmp(&y(&points[b]))) else {
        return;
    };
    let last = points.len() - 1;
    let closed = last > 1 && points[0] == points[last];
    if !closed && (top == 0 || top == last) {
        // The crossings along x tell the side on which the criterion is met.
        let sense =
            |point: &BoundaryPoint| i32::from(point.met[0] > point.unmet[0]) - i32::from(point.met[0] < point.unmet[0]);
        let branch = match points.iter().map(sense).sum::<i32>() {
            0.. => CurveBranch::Lower,
            _ => CurveBranch::Upper,
        };
        points.iter_mut().for_each(|point| point.branch = branch);
        return;
    }
    // Two ways lead from the top: to both ends of an open line, or to the bottom of a closed one.
    let bottom = (0..points.len()).min_by(|&a, &b| y(&points[a]).total_cmp(&y(&points[b])));
    let cut = if closed { bottom.unwrap_or(0) } else { 0 };
    let one_way = |k: usize| (top.min(cut)..top.max(cut)).contains(&k);
    let mean = |way: bool| {
        let x: Vec<f64> = (0..points.len())
            .filter(|&k| one_way(k) == way)
            .map(|k| points[k].middle()[0])
            .collect();
        x.iter().sum::<f64>() / x.len().max(1) as f64
    };
    let lower = mean(true) < mean(false);
    let one_way: Vec<bool> = (0..points.len()).map(one_way).collect();
    for (k, point) in points.iter_mut().enumerate() {
        point.branch = match (k == top, one_way[k] == lower) {
            (true, _) => CurveBranch::Fold,
            (false, true) => CurveBranch::Lower,
            (false, false) => CurveBranch::Upper,
        };
    }
}

const LIMIT_POINTS: usize = 61;

/// Bisections of the range of x, down to the rounding of a double.
const LIMIT_HALVINGS: usize = 50;

/// Zeros of the margin of steady sliding at equally spaced values of y: every change of sign on the first grid, in
/// order of x. For sliding that slows down by itself, the margin is its least value under the largest force.
fn linear_limit(study: &Study, spec: &BoundarySpec, ranges: [AxisRange; 2], plane: &[Setting]) -> Vec<[f64; 2]> {
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
