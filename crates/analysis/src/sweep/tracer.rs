//! Rounds of points for the trace of a boundary, and the crossings between them.

use super::axis::AxisRange;
use super::criterion::BoundarySpec;
use super::error::SweepEnd;
use super::outcome::PointOutcome;
use super::running::Running;
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
        (self.met[0] - self.unmet[0])
            .abs()
            .max((self.met[1] - self.unmet[1]).abs())
    }

    pub(super) fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|k| 0.5 * (self.met[k] + self.unmet[k]))
    }
}

pub(super) struct Tracer<'a, 'b> {
    pub(super) running: &'a mut Running<'b>,
    pub(super) asked: &'a mut Vec<Vec<Setting>>,
    pub(super) spec: &'a BoundarySpec,
    pub(super) ranges: [AxisRange; 2],
    pub(super) planes: Vec<Vec<Setting>>,
}

impl Tracer<'_, '_> {
    pub(super) fn round(&mut self, shares: &[(usize, [f64; 2])]) -> Result<Vec<PointOutcome>, SweepEnd> {
        let start = self.asked.len();
        for &(plane, share) in shares {
            let coordinates = place_in_plane(&self.planes[plane], self.spec, self.ranges, share);
            self.asked.push(coordinates);
        }
        self.running.round(start as u64, &self.asked[start..])
    }

    pub(super) fn bisect(&mut self, crossings: &mut [BoundaryCrossing]) -> Result<(), SweepEnd> {
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

    /// Keeps the intervals whose ends are on the expected sides of the criterion.
    pub(super) fn confirmed<T>(
        &mut self,
        stretches: Vec<(T, BoundaryCrossing)>,
    ) -> Result<Vec<(T, BoundaryCrossing)>, SweepEnd> {
        let ends = stretches.iter().flat_map(|(_, crossing)| {
            let BoundaryCrossing { plane, met, unmet, .. } = *crossing;
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
    ranges: [AxisRange; 2],
    share: [f64; 2],
) -> Vec<Setting> {
    let mut coordinates = plane.to_vec();
    for k in 0..2 {
        coordinates[spec.plane[k]] = Setting::Number(ranges[k].at(share[k]));
    }
    coordinates
}
