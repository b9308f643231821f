//! Rounds of points for the trace of a boundary, the crossings between them, and the search along x for the fold of the
//! boundary, its point of largest y.
//!
//! The lattice determines the fold to one of its cells. Columns through those cells are bisected, and the search
//! continues between the neighbours of the highest column.

use super::axis::AxisRange;
use super::criterion::BoundarySpec;
use super::journal::PointOutcome;
use super::runner::Running;
use crate::error::Error;
use stickslip_case::Setting;

#[derive(Debug, Clone)]
pub(super) struct BoundaryCrossing {
    pub(super) plane: usize,
    /// Positions as fractions of the plane, with the criterion met and not met.
    pub(super) met: [f64; 2],
    pub(super) unmet: [f64; 2],
    /// Whether the run at [`Self::unmet`] failed, so that the change of the criterion is uncertain.
    pub(super) unknown: bool,
}

impl BoundaryCrossing {
    pub(super) fn width(&self) -> f64 {
        let [x, y] = [0, 1].map(|k| (self.met[k] - self.unmet[k]).abs());
        x.max(y)
    }

    pub(super) fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|k| 0.5 * (self.met[k] + self.unmet[k]))
    }
}

pub(super) struct Tracer<'a, 'b> {
    pub(super) running: &'a mut Running<'b>,
    pub(super) spec: &'a BoundarySpec,
    pub(super) ranges: [AxisRange; 2],
    pub(super) planes: Vec<Vec<Setting>>,
}

impl Tracer<'_, '_> {
    pub(super) fn round(&mut self, shares: &[(usize, [f64; 2])]) -> Result<Vec<PointOutcome>, Error> {
        let place =
            |&(plane, share): &(usize, [f64; 2])| place_in_plane(&self.planes[plane], self.spec, self.ranges, share);
        self.running.round(shares.iter().map(place).collect())
    }

    pub(super) fn bisect(&mut self, crossings: &mut [BoundaryCrossing]) -> Result<(), Error> {
        loop {
            let wide = crossings
                .iter_mut()
                .filter(|crossing| crossing.width() > self.spec.width);
            let mut wide: Vec<&mut BoundaryCrossing> = wide.collect();
            if wide.is_empty() {
                return Ok(());
            }
            let shares: Vec<_> = wide.iter().map(|one| (one.plane, one.middle())).collect();
            let outcomes = self.round(&shares)?;
            for ((crossing, (_, middle)), outcome) in wide.iter_mut().zip(shares).zip(&outcomes) {
                if self.spec.criterion.is_met(outcome) {
                    crossing.met = middle;
                } else {
                    crossing.unmet = middle;
                    crossing.unknown = outcome.result.is_err();
                }
            }
        }
    }

    /// Keeps the intervals whose ends are on the expected sides of the criterion.
    pub(super) fn confirmed<T>(
        &mut self,
        stretches: Vec<(T, BoundaryCrossing)>,
    ) -> Result<Vec<(T, BoundaryCrossing)>, Error> {
        let ends = stretches.iter().flat_map(|(_, crossing)| {
            let BoundaryCrossing { plane, met, unmet, .. } = *crossing;
            [(plane, met), (plane, unmet)]
        });
        let outcomes = self.round(&ends.collect::<Vec<_>>())?;
        let criterion = self.spec.criterion;
        let sides = outcomes.chunks_exact(2);
        let sides =
            sides.map(|pair| criterion.is_met(&pair[0]) && pair[1].result.is_ok() && !criterion.is_met(&pair[1]));
        let confirmed = stretches.into_iter().zip(sides).filter(|(_, confirmed)| *confirmed);
        Ok(confirmed.map(|(stretch, _)| stretch).collect())
    }
}

pub(super) fn place_in_plane(
    plane: &[Setting],
    spec: &BoundarySpec,
    ranges: [AxisRange; 2],
    share: [f64; 2],
) -> Vec<Setting> {
    let mut coordinates = plane.to_vec();
    for k in 0..2 {
        coordinates[spec.plane[k]] = Setting::Number(ranges[k].at(share[k]));
    }
    coordinates
}

const COLUMNS: usize = 8;

/// Each round shrinks the interval of x to two ninths.
const ROUNDS: usize = 3;

struct FoldSearch {
    line: usize,
    left: f64,
    right: f64,
    /// Values of y at which the criterion is met, and not met, along the whole interval.
    met: f64,
    unmet: f64,
    found: Vec<BoundaryCrossing>,
}

/// Adds columns around the folds of lines. `cell` is the size of a cell of the finest lattice.
pub(super) fn refine_folds(
    tracer: &mut Tracer,
    lines: &mut [Vec<BoundaryCrossing>],
    cell: [f64; 2],
) -> Result<(), Error> {
    let found = lines.iter().enumerate();
    let mut searches: Vec<FoldSearch> = found.filter_map(|(k, line)| search(k, line, cell)).collect();
    for _ in 0..ROUNDS {
        let mut columns = Vec::new();
        for (k, search) in searches.iter().enumerate() {
            let plane = lines[search.line][0].plane;
            for column in 1..=COLUMNS {
                let x = search.left + (search.right - search.left) * column as f64 / (COLUMNS + 1) as f64;
                let crossing = BoundaryCrossing {
                    plane,
                    met: [x, search.met],
                    unmet: [x, search.unmet],
                    unknown: false,
                };
                columns.push((k, crossing));
            }
        }
        let (of, mut columns): (Vec<usize>, Vec<BoundaryCrossing>) = tracer.confirmed(columns)?.into_iter().unzip();
        tracer.bisect(&mut columns)?;
        let mut columns: Vec<(usize, BoundaryCrossing)> = of.into_iter().zip(columns).collect();
        columns.retain(|(_, column)| !column.unknown);
        for (k, search) in searches.iter_mut().enumerate() {
            let own = columns.iter().filter(|(of, _)| *of == k);
            search.narrow(own.map(|(_, column)| column.clone()).collect());
        }
    }
    for search in searches {
        insert(&mut lines[search.line], search.found);
    }
    Ok(())
}

fn search(line: usize, points: &[BoundaryCrossing], cell: [f64; 2]) -> Option<FoldSearch> {
    let top = top_of(points)?;
    let [x, y] = points[top].middle();
    let apart = |point: &&BoundaryCrossing| (point.middle()[0] - x).abs() > 1e-3 * cell[0];
    let before = points[..top].iter().rev().find(apart)?.middle();
    let after = points[top + 1..].iter().find(apart)?.middle();
    let (left, right) = (before[0].min(after[0]), before[0].max(after[0]));
    Some(FoldSearch {
        line,
        left: left.min(x),
        right: right.max(x),
        met: (before[1].min(after[1]) - 0.5 * cell[1]).max(0.0),
        unmet: (y + cell[1]).min(1.0),
        found: Vec::new(),
    })
}

/// `None` if the largest y is at an end of the line.
fn top_of(points: &[BoundaryCrossing]) -> Option<usize> {
    let y = |k: usize| points[k].middle()[1];
    let top = (0..points.len()).max_by(|&a, &b| y(a).total_cmp(&y(b)))?;
    (top > 0 && top + 1 < points.len()).then_some(top)
}

impl FoldSearch {
    /// Narrows the interval to the neighbours of the highest column.
    fn narrow(&mut self, mut columns: Vec<BoundaryCrossing>) {
        columns.sort_by(|a, b| a.met[0].total_cmp(&b.met[0]));
        let y = |column: &BoundaryCrossing| column.middle()[1];
        let Some(best) = (0..columns.len()).max_by(|&a, &b| y(&columns[a]).total_cmp(&y(&columns[b]))) else {
            return;
        };
        let neighbours = [best.checked_sub(1), Some(best + 1)].map(|k| k.and_then(|k| columns.get(k)));
        let [left, right] = neighbours;
        self.left = left.map_or(self.left, |column| column.met[0]);
        self.right = right.map_or(self.right, |column| column.met[0]);
        let lowest = neighbours
            .into_iter()
            .flatten()
            .map(y)
            .fold(y(&columns[best]), f64::min);
        // A line with curvature of one sign exceeds the highest column by less than the column exceeds its neighbours.
        let rise = y(&columns[best]) - lowest;
        let slack = 4.0 * columns[best].width() + rise;
        if left.is_some() && right.is_some() {
            self.unmet = self.unmet.min(y(&columns[best]) + slack);
            self.met = self.met.max(lowest - slack);
        }
        self.found.append(&mut columns);
    }
}

fn insert(line: &mut Vec<BoundaryCrossing>, mut columns: Vec<BoundaryCrossing>) {
    let Some(top) = top_of(line) else { return };
    columns.push(line[top].clone());
    columns.sort_by(|a, b| a.middle()[0].total_cmp(&b.middle()[0]));
    if line[top - 1].middle()[0] > line[top + 1].middle()[0] {
        columns.reverse();
    }
    line.splice(top..=top, columns);
}
