//! Runs at points of the parameter space on several threads. Their order does not depend on the threads.

use super::study::CalibrationStudy;
use super::target::Target;
use crate::sweep::{Integrate, QuantityValues, StudyPoint, run_point, without_a_file};
use std::sync::atomic::{AtomicBool, Ordering};
use stickslip_engine::workers::in_order;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Evaluation {
    pub shares: Vec<f64>,
    pub result: Result<QuantityValues, String>,
    /// Residual of each target, in half-widths; infinite if the run lacks the quantity.
    pub residuals: Vec<f64>,
}

impl Evaluation {
    /// Largest magnitude of these residuals; 0 if there are none.
    pub fn worst(&self, members: &[usize]) -> f64 {
        members.iter().fold(0.0, |worst, &k| self.residuals[k].abs().max(worst))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Halted;

pub(super) struct TargetEvaluator<'a> {
    pub study: &'a CalibrationStudy,
    pub workers: usize,
    pub stop: &'a AtomicBool,
}

impl TargetEvaluator<'_> {
    pub fn run(&self, shares: &[f64]) -> Result<Evaluation, Halted> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Halted);
        }
        let point = StudyPoint {
            number: 0,
            coordinates: self.study.coordinates(shares),
        };
        let integrate: &Integrate = &without_a_file;
        let halted = || self.stop.load(Ordering::Relaxed);
        // Nothing is stored, so only the run itself can fail.
        let outcome = run_point(&self.study.runs, &point, integrate, &halted);
        let result = match outcome {
            Ok(Some(outcome)) => outcome.result,
            Ok(None) => return Err(Halted),
            Err(message) => Err(message),
        };
        let residual = |target: &Target| {
            let residual = result.as_ref().map_or(f64::NAN, |values| target.residual(values));
            if residual.is_nan() { f64::INFINITY } else { residual }
        };
        Ok(Evaluation {
            shares: shares.to_vec(),
            residuals: self.study.targets.iter().map(residual).collect(),
            result,
        })
    }

    /// Runs `f` for every item on the threads and appends the results to `pool` in the order of the items. `done` gets
    /// the number of finished items. Returns the pool index at which each item's runs begin, and the end of the last.
    pub fn each<T: Sync, R: IntoIterator<Item = Evaluation> + Send>(
        &self,
        pool: &mut Vec<Evaluation>,
        items: &[T],
        f: impl Fn(&T) -> Result<R, Halted> + Sync,
        done: &mut dyn FnMut(usize),
    ) -> Result<Vec<usize>, Halted> {
        let results = in_order(self.workers, items.len(), |index| f(&items[index]).ok(), done);
        let halted = results.iter().any(Option::is_none);
        let mut places = vec![pool.len()];
        for runs in results.into_iter().flatten() {
            pool.extend(runs);
            places.push(pool.len());
        }
        if halted { Err(Halted) } else { Ok(places) }
    }
}
