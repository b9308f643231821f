//! Runs at points of the parameter space on several threads. Their order does not depend on the threads.

use super::study::CalibrationStudy;
use super::target::Target;
use crate::sweep::{StudyPoint, Values, run_point, without_a_file};
use stickslip_engine::workers::in_order;
use stickslip_system::watch::Watch;

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Evaluation {
    pub shares: Vec<f64>,
    pub result: Result<Values, String>,
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
    pub watch: &'a dyn Watch,
}

impl TargetEvaluator<'_> {
    pub fn run(&self, shares: &[f64]) -> Result<Evaluation, Halted> {
        if self.watch.stopped() {
            return Err(Halted);
        }
        let point = StudyPoint {
            number: 0,
            coordinates: self.study.coordinates(shares),
        };
        // Nothing is stored, so only the run itself can fail.
        let outcome = run_point(&self.study.runs, &point, &without_a_file, self.watch);
        let result = match outcome {
            Ok(Some(outcome)) => outcome.result,
            Ok(None) => return Err(Halted),
            Err(error) => Err(error.to_string()),
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

    /// Reports the progress of a stage. A stop is seen by the next run.
    pub fn tell(&self, stage: &str, done: usize, total: usize) {
        let _ = self.watch.at(
            done as f64,
            total as f64,
            format_args!("{done} of {total} done, {stage}"),
        );
    }

    /// Runs `f` for every item on the threads and appends the results to `pool` in the order of the items. `stage`, if
    /// there is one, is reported with the number of finished items. Returns the pool index at which each item's runs begin, and the end of the last.
    pub fn each<T: Sync, R: IntoIterator<Item = Evaluation> + Send>(
        &self,
        pool: &mut Vec<Evaluation>,
        items: &[T],
        f: impl Fn(&T) -> Result<R, Halted> + Sync,
        stage: Option<&str>,
    ) -> Result<Vec<usize>, Halted> {
        let mut done = |done| {
            if let Some(stage) = stage {
                self.tell(stage, done, items.len());
            }
        };
        let results = in_order(self.workers, items.len(), |index| f(&items[index]).ok(), &mut done);
        let halted = results.iter().any(Option::is_none);
        let mut places = vec![pool.len()];
        for runs in results.into_iter().flatten() {
            pool.extend(runs);
            places.push(pool.len());
        }
        if halted { Err(Halted) } else { Ok(places) }
    }
}
