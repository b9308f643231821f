//! Fit of a smooth function that replaces the sign, and of its speed.

use super::fit::Fit;
use super::{Bench, Change};
use crate::creep::SHAPES;
use stickslip_engine::workers::over_processors;

/// Initial speeds, in parts of slip speeds.
const SPEEDS: [f64; 3] = [1e-5, 1e-3, 3e-2];

impl Bench<'_> {
    /// Functions that a case can have, each with the speed that brings the motion closest to the candidate.
    pub(super) fn smooth(&self) -> Vec<Change> {
        if !self.physics.sticks() || self.evidence.observation.is_none() {
            return Vec::new();
        }
        let speed = self.physics.speed();
        let shapes: Vec<usize> = (0..SHAPES.len())
            .filter(|&shape| SHAPES[shape].smoothing.is_some())
            .collect();
        let starts: Vec<usize> = (0..self.starts.len()).collect();
        let begin: Vec<(usize, usize, f64)> = shapes
            .into_iter()
            .flat_map(|shape| starts.iter().map(move |&start| (shape, start)))
            .flat_map(|(shape, start)| SPEEDS.map(|part| (shape, start, part * speed)))
            .collect();
        let found = over_processors(begin.len(), &|| false, |k| {
            let (shape, start, begin) = begin[k];
            let at = &self.starts[start];
            let play = |values: &[f64]| self.smoothed((shape, values[0].abs()), at, self.most_steps);
            let near = self.evidence.projected(begin, 1, &|speed| play(&[speed]))?;
            let fit = Fit {
                evidence: &self.evidence,
                play: &play,
                units: &[near],
            };
            let point = fit.refined(vec![near])?;
            Some(Change::Smooth(shape, point.values[0].abs()))
        });
        found.into_iter().flatten().collect()
    }
}
