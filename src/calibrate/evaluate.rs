//! Runs at points of the parameter space, on threads, with every outcome kept in an order that threads do not decide.

use super::study::CalibrationStudy;
use super::target::Target;
use crate::sweep::{Integrate, Point, Values, run_point, without_a_file};
use crate::workers::in_order;
use std::sync::atomic::{AtomicBool, Ordering};

/// One run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Evaluation {
    /// Place of each parameter in its range, 0 to 1.
    pub shares: Vec<f64>,
    /// The summary, or why there is none.
    pub result: Result<Values, String>,
    /// Of every target, in half-widths; infinite where the run has no such quantity.
    pub residuals: Vec<f64>,
}

impl Evaluation {
    /// The largest residual of these targets, either way; 0 for none.
    pub fn worst(&self, members: &[usize]) -> f64 {
        members.iter().fold(0.0, |worst, &k| self.residuals[k].abs().max(worst))
    }
}

/// Stopped from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Halted;

/// Runs points of a study.
pub(super) struct Evaluator<'a> {
    pub study: &'a CalibrationStudy,
    pub workers: usize,
    pub stop: &'a AtomicBool,
}

impl Evaluator<'_> {
    /// Runs one point; nothing if it was stopped on the way.
    pub fn run(&self, shares: &[f64]) -> Result<Evaluation, Halted> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(Halted);
        }
        let point = Point {
            number: 0,
            coordinates: self.study.coordinates(shares),
        };
        let integrate: &Integrate = &without_a_file;
        let halted = || self.stop.load(Ordering::Relaxed);
        // Nothing is stored, so that a run that fails is all that can fail.
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

    /// The runs that `f` makes for every item, on the threads, added to `pool` in the order of the items; `done` is told for
    /// how many it has. Returns the places in the pool where the runs for each item begin, and where the last ones end.
    ///
    /// # Errors
    /// If it was stopped; what was done until then is in the pool.
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
