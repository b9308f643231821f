//! Tracing where a criterion changes in a plane of two axes.
//!
//! The first grid is run, its cells in which the criterion changes are halved, with their neighbours, as often as the
//! study says, every edge of the finest cells across which it changes is bisected, and the nose is looked for along x. All
//! points that are needed at a time are run as one round, so that every thread has work; what is asked for next depends
//! on the outcomes alone, and so the points and their numbers are the same in every run of the study.

use super::axis::Range;
use super::contour::contours;
use super::criterion::BoundarySpec;
use super::lattice::{Edge, Lattice};
use super::limit::linear_limit;
use super::nose;
use super::output::{Points, Running, SweepEnd};
use super::quantities::{Outcome, quantity_index};
use super::study::Study;
use crate::analysis::growth::foreseen_exponent;
use crate::case::Setting;
use std::collections::BTreeSet;

/// Contours of G are looked for on a grid of at most about so many nodes, and so many times finer than the first one.
const CONTOUR_NODES: usize = 4000;
const FINER: usize = 4;

/// Which part of a curve a point belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Branch {
    /// Before the point of largest y, at the smaller x.
    Lower = 0,
    /// Beyond it, at the larger x.
    Upper = 1,
    /// The point of largest y of a curve that turns there.
    Nose = 2,
}

/// A point of a boundary: between two runs, one of which meets the criterion. In the units of the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryPoint {
    /// Of the run that meets the criterion.
    pub met: [f64; 2],
    /// Of the run that does not.
    pub unmet: [f64; 2],
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
    pub plane: usize,
    /// What is constant along it.
    pub level: f64,
    pub points: Vec<[f64; 2]>,
}

/// What tracing a boundary came to.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Boundaries {
    /// The values of the axes outside the plane, for each plane.
    pub planes: Vec<Vec<Setting>>,
    pub curves: Vec<Curve>,
    /// Where steady sliding loses its stability only in the limit of standstill: c_t = -2 r F mu'(0) under
    /// the largest force.
    pub linear_limit: Vec<Line>,
    /// Contours of the growth exponent G.
    pub growth: Vec<Line>,
}

/// An edge of the finest grid, or another stretch, while it is bisected.
#[derive(Debug, Clone)]
pub(super) struct Crossing {
    pub(super) plane: usize,
    pub(super) edge: Edge,
    /// Shares of the plane: where the criterion is met, and where it is not.
    pub(super) met: [f64; 2],
    pub(super) unmet: [f64; 2],
    /// The run at [`Self::unmet`] failed: whether the criterion changes there is not known.
    pub(super) unknown: bool,
}

impl Crossing {
    pub(super) fn width(&self) -> f64 {
        (self.met[0] - self.unmet[0])
            .abs()
            .max((self.met[1] - self.unmet[1]).abs())
    }

    pub(super) fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|k| 0.5 * (self.met[k] + self.unmet[k]))
    }
}

/// Asks for rounds of points, numbering them as they come.
pub(super) struct Tracer<'a, 'b> {
    running: &'a mut Running<'b>,
    asked: &'a mut Vec<Vec<Setting>>,
    spec: &'a BoundarySpec,
    ranges: [Range; 2],
    planes: Vec<Vec<Setting>>,
}

/// Traces the boundaries of a study in every plane.
pub(super) fn trace(spec: &BoundarySpec, running: &mut Running, points: &mut Points) -> Result<Boundaries, SweepEnd> {
    let study = running.study;
    let (Points::Asked(asked), Some(ranges)) = (points, spec.ranges(study)) else {
        return Ok(Boundaries::default());
    };
    let mut tracer = Tracer {
        running,
        asked,
        spec,
        ranges,
        planes: planes(study, spec),
    };
    let mut lattices = vec![Lattice::new(spec.nodes, spec.refinements); tracer.planes.len()];
    // Outcomes of the first grid
    let mut first = Vec::new();
    let mut failed = BTreeSet::new();
    loop {
        let wanted: Vec<_> = lattices
            .iter()
            .enumerate()
            .flat_map(|(plane, lattice)| lattice.unknown().into_iter().map(move |node| (plane, node)))
            .collect();
        let shares: Vec<_> = wanted
            .iter()
            .map(|&(plane, node)| (plane, lattices[plane].share(node)))
            .collect();
        let outcomes = tracer.round(&shares)?;
        for (&(plane, node), outcome) in wanted.iter().zip(&outcomes) {
            lattices[plane].set(node, spec.criterion.is_met(outcome));
            if outcome.result.is_err() {
                failed.insert((plane, node));
            }
        }
        if first.is_empty() {
            first = outcomes;
        }
        // All have the same depth.
        let mut finer = true;
        for lattice in &mut lattices {
            finer &= lattice.refine();
        }
        if !finer {
            break;
        }
    }
    let lines: Vec<(usize, Vec<Edge>)> = lattices
        .iter()
        .enumerate()
        .flat_map(|(plane, lattice)| lattice.lines().into_iter().map(move |line| (plane, line)))
        .collect();
    let mut crossings = Vec::new();
    for (plane, line) in &lines {
        for &edge in line {
            let lattice = &lattices[*plane];
            let [a, b] = edge.ends();
            let (met, unmet) = if lattice.is_met(a) { (a, b) } else { (b, a) };
            crossings.push(Crossing {
                plane: *plane,
                edge,
                met: lattice.share(met),
                unmet: lattice.share(unmet),
                unknown: failed.contains(&(*plane, unmet)),
            });
        }
    }
    // A closed line has its first edge at its end again.
    crossings.sort_by_key(|crossing| (crossing.plane, crossing.edge));
    crossings.dedup_by_key(|crossing| (crossing.plane, crossing.edge));
    tracer.bisect(&mut crossings)?;
    let of_line = |(plane, line): &(usize, Vec<Edge>)| -> Vec<Crossing> {
        let known = line.iter().filter_map(|&edge| {
            let place = crossings.binary_search_by_key(&(*plane, edge), |crossing| (crossing.plane, crossing.edge));
            Some(crossings[place.ok()?].clone())
        });
        known.collect()
    };
    // Where runs fail a line ends: beyond is no case without stick-slip, but no case at all.
    let mut traced: Vec<Vec<Crossing>> = lines
        .iter()
        .map(of_line)
        .flat_map(|line| {
            let known = line.split(|crossing| crossing.unknown).map(<[Crossing]>::to_vec);
            known.filter(|part| !part.is_empty()).collect::<Vec<_>>()
        })
        .collect();
    let cell = lattices[0].size.map(|cells| 1.0 / f64::from(cells));
    nose::refine(&mut tracer, &mut traced, cell)?;
    let place = |share: [f64; 2]| -> [f64; 2] { std::array::from_fn(|k| ranges[k].at(share[k])) };
    let curves = traced.iter().map(|line| {
        let points = line.iter().map(|crossing| BoundaryPoint {
            met: place(crossing.met),
            unmet: place(crossing.unmet),
            branch: Branch::Lower,
        });
        let mut points: Vec<BoundaryPoint> = points.collect();
        name_branches(&mut points);
        Curve {
            plane: line[0].plane,
            points,
        }
    });
    let curves = curves.collect();
    // A kick or a tolerance moves no limit of steady sliding: one line is then all.
    let outside = study.axes.iter().enumerate().filter(|(k, _)| !spec.plane.contains(k));
    let mut outside = outside.flat_map(|(_, axis)| &axis.keys);
    let one_for_all = outside.all(|key| key.starts_with("perturbation.") || key.starts_with("solver."));
    let limits = if one_for_all { 1 } else { tracer.planes.len() };
    let growth = tracer.growth_contours(&first, limits);
    let linear_limit = (0..limits)
        .map(|plane| Line {
            plane,
            level: 0.0,
            points: linear_limit(study, spec, ranges, &tracer.planes[plane]),
        })
        .filter(|line| !line.points.is_empty())
        .collect();
    Ok(Boundaries {
        planes: tracer.planes,
        curves,
        linear_limit,
        growth,
    })
}

/// Every combination of the levels of the axes outside the plane, one value for each axis; in the plane the first.
fn planes(study: &Study, spec: &BoundarySpec) -> Vec<Vec<Setting>> {
    let mut planes = vec![Vec::new()];
    for (k, axis) in study.axes.iter().enumerate() {
        let levels = if spec.plane.contains(&k) {
            &axis.levels[..1]
        } else {
            &axis.levels[..]
        };
        planes = planes
            .into_iter()
            .flat_map(|plane: Vec<Setting>| {
                levels
                    .iter()
                    .map(move |level| [plane.as_slice(), std::slice::from_ref(level)].concat())
            })
            .collect();
    }
    planes
}

impl Tracer<'_, '_> {
    /// Runs points given by their plane and their share of it.
    fn round(&mut self, shares: &[(usize, [f64; 2])]) -> Result<Vec<Outcome>, SweepEnd> {
        let start = self.asked.len();
        for &(plane, share) in shares {
            let coordinates = place_in_plane(&self.planes[plane], self.spec, self.ranges, share);
            self.asked.push(coordinates);
        }
        self.running.round(start as u64, &self.asked[start..])
    }

    /// Halves every crossing until it is as narrow as the study says.
    pub(super) fn bisect(&mut self, crossings: &mut [Crossing]) -> Result<(), SweepEnd> {
        loop {
            let wide: Vec<usize> = (0..crossings.len())
                .filter(|&k| crossings[k].width() > self.spec.width)
                .collect();
            if wide.is_empty() {
                return Ok(());
            }
            let shares: Vec<_> = wide
                .iter()
                .map(|&k| (crossings[k].plane, crossings[k].middle()))
                .collect();
            let outcomes = self.round(&shares)?;
            for (&k, outcome) in wide.iter().zip(&outcomes) {
                let middle = crossings[k].middle();
                if self.spec.criterion.is_met(outcome) {
                    crossings[k].met = middle;
                } else {
                    crossings[k].unmet = middle;
                    crossings[k].unknown = outcome.result.is_err();
                }
            }
        }
    }

    /// Contours of G in the first `planes`. Where it is known without a run the grid is a finer one, and the contours are
    /// exact; else they are from the `outcomes` of the first grid, in which x runs slowest.
    fn growth_contours(&self, outcomes: &[Outcome], planes: usize) -> Vec<Line> {
        let (Some(quantity), study) = (quantity_index("growth_exponent"), self.running.study) else {
            return Vec::new();
        };
        if self.spec.growth_contours.is_empty() {
            return Vec::new();
        }
        let [columns, rows] = self.spec.nodes;
        let finer = ((CONTOUR_NODES as f64 / (columns * rows) as f64).sqrt() as usize).clamp(1, FINER);
        let fine = [columns, rows].map(|count| (count - 1) * finer + 1);
        let mut lines = Vec::new();
        for (plane, outcomes) in outcomes.chunks(columns * rows).take(planes).enumerate() {
            let exact = |share: [f64; 2]| {
                let case = study.case_at(&place_in_plane(&self.planes[plane], self.spec, self.ranges, share));
                let growth = case.map(|case| foreseen_exponent(&case.parameters, case.output.end_time));
                growth.ok().flatten().unwrap_or(f64::NAN)
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
                (self.spec.nodes, (0..columns * rows).map(of_run).collect())
            };
            let exact: Option<&dyn Fn([f64; 2]) -> f64> = if known { Some(&exact) } else { None };
            for &level in &self.spec.growth_contours {
                for line in contours(nodes, &values, level, exact) {
                    let place = |share: &[f64; 2]| std::array::from_fn(|k| self.ranges[k].at(share[k]));
                    lines.push(Line {
                        plane,
                        level,
                        points: line.iter().map(place).collect(),
                    });
                }
            }
        }
        lines
    }

    /// Of the stretches, each with whatever it belongs to, those whose ends are on the sides they are taken for.
    pub(super) fn confirmed<T>(&mut self, stretches: Vec<(T, Crossing)>) -> Result<Vec<(T, Crossing)>, SweepEnd> {
        let ends = stretches.iter().flat_map(|(_, crossing)| {
            let Crossing { plane, met, unmet, .. } = *crossing;
            [(plane, met), (plane, unmet)]
        });
        let outcomes = self.round(&ends.collect::<Vec<_>>())?;
        let criterion = self.spec.criterion;
        let sides = outcomes.chunks_exact(2);
        let sides =
            sides.map(|pair| criterion.is_met(&pair[0]) && pair[1].result.is_ok() && !criterion.is_met(&pair[1]));
        Ok(stretches
            .into_iter()
            .zip(sides)
            .filter(|(_, confirmed)| *confirmed)
            .map(|(stretch, _)| stretch)
            .collect())
    }
}

pub(super) fn place_in_plane(
    plane: &[Setting],
    spec: &BoundarySpec,
    ranges: [Range; 2],
    share: [f64; 2],
) -> Vec<Setting> {
    let mut coordinates = plane.to_vec();
    for k in 0..2 {
        coordinates[spec.plane[k]] = Setting::Number(ranges[k].at(share[k]));
    }
    coordinates
}

/// Splits a curve at its largest y. Where that is an end of it, there is no nose, and the curve is one branch: the lower
/// one if the criterion is met at larger x.
fn name_branches(points: &mut [BoundaryPoint]) {
    let y = |point: &BoundaryPoint| point.middle()[1];
    let Some(top) = (0..points.len()).max_by(|&a, &b| y(&points[a]).total_cmp(&y(&points[b]))) else {
        return;
    };
    let last = points.len() - 1;
    let closed = last > 1 && points[0] == points[last];
    if !closed && (top == 0 || top == last) {
        // By the crossings along x, which say on which side the criterion is met.
        let rising: i32 = points
            .iter()
            .map(|point| i32::from(point.met[0] > point.unmet[0]) - i32::from(point.met[0] < point.unmet[0]))
            .sum();
        let branch = if rising >= 0 { Branch::Lower } else { Branch::Upper };
        points.iter_mut().for_each(|point| point.branch = branch);
        return;
    }
    // Two ways lead from the top: to both ends of an open line, to the bottom of a closed one.
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
            (true, _) => Branch::Nose,
            (false, true) => Branch::Lower,
            (false, false) => Branch::Upper,
        };
    }
}
