//! Runs at points of the parameter space on several threads, in an order that does not depend on the threads, and local
//! searches by COBYLA: linear models of every target over a shrinking simplex.
//!
//! M. J. D. Powell, A direct search optimization method that models the objective and constraint functions by linear
//! interpolation, 1994. Each target is a separate constraint, so no squares or penalties weigh targets against each
//! other. Derivatives are not needed: quantities jump when a stick appears or vanishes.

use super::study::{CalibrationStudy, Target};
use crate::error::Error;
use crate::sweep::{StudyPoint, Values, run_point, without_a_file};
use cobyla::{RhoBeg, StopTols, minimize};
use std::cell::{Cell, RefCell};
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

pub(super) struct TargetEvaluator<'a> {
    pub study: &'a CalibrationStudy,
    pub workers: usize,
    pub watch: &'a dyn Watch,
}

impl TargetEvaluator<'_> {
    pub fn run(&self, shares: &[f64]) -> Result<Evaluation, Error> {
        let point = StudyPoint {
            number: 0,
            coordinates: self.study.coordinates(shares),
        };
        let outcome = match self.watch.stopped() {
            true => None,
            false => run_point(&self.study.runs, &point, &without_a_file, self.watch)?,
        };
        let result = outcome.ok_or_else(Error::interrupted)?.result;
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
        f: impl Fn(&T) -> Result<R, Error> + Sync,
        stage: Option<&str>,
    ) -> Result<Vec<usize>, Error> {
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
        if halted { Err(Error::interrupted()) } else { Ok(places) }
    }
}

/// Residual of a missing quantity over the largest at the start: worse, but small enough for linear models.
const MISSING: f64 = 2.0;

/// Shrinkage of the simplex between rounds. Each round also rescales the residuals.
const SHRINK: f64 = 16.0;

/// Final size of a round's simplex, relative to its first size.
const ROUND_DEPTH: f64 = 1e-3;

fn most_runs(dimensions: usize) -> usize {
    30 + 15 * dimensions
}

/// Runs of COBYLA. Each is made once, although every constraint asks for it.
struct Runs<'a> {
    evaluator: &'a TargetEvaluator<'a>,
    made: RefCell<Vec<Evaluation>>,
    halted: Cell<bool>,
}

impl Runs<'_> {
    fn residual(&self, shares: &[f64], target: usize) -> f64 {
        // COBYLA may exceed the bounds by rounding.
        let shares: Vec<f64> = shares.iter().map(|share| share.clamp(0.0, 1.0)).collect();
        let mut made = self.made.borrow_mut();
        if made.last().is_none_or(|last| last.shares != shares) {
            match self.evaluator.run(&shares) {
                Ok(evaluation) if !self.halted.get() => made.push(evaluation),
                _ => {
                    self.halted.set(true);
                    return f64::NAN;
                }
            }
        }
        made.last().map_or(f64::NAN, |last| last.residuals[target])
    }
}

/// Constraint that must become positive.
type Constraint<'a> = Box<dyn Fn(&[f64], &mut ()) -> f64 + 'a>;

fn scaled(residual: f64, scale: f64) -> f64 {
    if residual.is_finite() {
        residual / scale
    } else {
        MISSING
    }
}

/// Minimises the objective from `x`, with the first and last sizes of the simplex. The residuals of `members` over
/// `scale` stay within the variable beyond the parameters, or within 1 if there is none. Returns all runs.
fn search(
    evaluator: &TargetEvaluator,
    (x, bounds): (&[f64], &[(f64, f64)]),
    (members, scale): (&[usize], f64),
    objective: impl Fn(&[f64]) -> f64,
    (first, last): (Vec<f64>, Vec<f64>),
) -> Result<Vec<Evaluation>, Error> {
    let dimensions = evaluator.study.runs.axes.len();
    let runs = Runs {
        evaluator,
        made: RefCell::new(Vec::new()),
        halted: Cell::new(false),
    };
    let mut constraints: Vec<Constraint> = Vec::new();
    for &target in members {
        for sign in [1.0, -1.0] {
            let runs = &runs;
            constraints.push(Box::new(move |x: &[f64], (): &mut ()| {
                let limit = x.get(dimensions).copied().unwrap_or(1.0);
                limit - sign * scaled(runs.residual(&x[..dimensions], target), scale)
            }));
        }
    }
    let tolerances = StopTols {
        xtol_abs: last,
        ..StopTols::default()
    };
    // The exit state does not matter: the best of all runs counts.
    let _ = minimize(
        |x: &[f64], (): &mut ()| objective(x),
        x,
        bounds,
        &constraints,
        (),
        most_runs(dimensions),
        RhoBeg::Set(first),
        Some(tolerances),
    );
    drop(constraints);
    match runs.halted.get() {
        true => Err(Error::interrupted()),
        false => Ok(runs.made.into_inner()),
    }
}

/// Least tau with -tau <= residual <= tau for all `members`, from a point. `reach` is the first size of the simplex as
/// a fraction of the ranges; `rounds` is the number of restarts. Returns all runs.
pub(super) fn least_worst(
    evaluator: &TargetEvaluator,
    start: &Evaluation,
    members: &[usize],
    reach: f64,
    rounds: u32,
) -> Result<Vec<Evaluation>, Error> {
    let dimensions = start.shares.len();
    let mut made: Vec<Evaluation> = Vec::new();
    let mut best = start.clone();
    for round in 0..rounds {
        let scale = best.worst(members);
        if !scale.is_finite() || scale == 0.0 {
            break;
        }
        let reach = reach / SHRINK.powi(round as i32);
        // The last variable is tau, relative to the largest residual at the start.
        let with_tau = |share: f64, tau: f64| [vec![share; dimensions], vec![tau]].concat();
        let x = [best.shares.as_slice(), &[1.0]].concat();
        let bounds: Vec<(f64, f64)> = with_tau(1.0, 2.0).into_iter().map(|most| (0.0, most)).collect();
        let sizes = (with_tau(reach, 0.25), with_tau(reach * ROUND_DEPTH, ROUND_DEPTH));
        let round = search(evaluator, (&x, &bounds), (members, scale), |x| x[dimensions], sizes)?;
        if let Some(found) = least(&round, members)
            && found.worst(members) < best.worst(members)
        {
            best = found.clone();
        }
        made.extend(round);
    }
    Ok(made)
}

/// Finds the least (`sign` 1) or largest (-1) valid value of a parameter from a valid point. Returns all runs.
pub(super) fn farthest(
    evaluator: &TargetEvaluator,
    start: &Evaluation,
    members: &[usize],
    parameter: usize,
    sign: f64,
    reach: f64,
) -> Result<Vec<Evaluation>, Error> {
    let dimensions = start.shares.len();
    let bounds = vec![(0.0, 1.0); dimensions];
    let sizes = (vec![reach; dimensions], vec![reach * ROUND_DEPTH; dimensions]);
    let from = (&start.shares[..], &bounds[..]);
    search(evaluator, from, (members, 1.0), |x| sign * x[parameter], sizes)
}

pub(super) fn least<'a>(evaluations: &'a [Evaluation], members: &[usize]) -> Option<&'a Evaluation> {
    evaluations
        .iter()
        .min_by(|a, b| a.worst(members).total_cmp(&b.worst(members)))
}

/// Best points for these targets, at least `distance` apart along some parameter.
pub(super) fn apart(pool: &[Evaluation], members: &[usize], count: usize, distance: f64) -> Vec<Evaluation> {
    let order = pool.iter().map(|point| (point.worst(members), point));
    let mut order: Vec<(f64, &Evaluation)> = order.filter(|(worst, _)| worst.is_finite()).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut chosen: Vec<&Evaluation> = Vec::new();
    for (_, point) in order {
        let near = |other: &&Evaluation| {
            let mut pairs = point.shares.iter().zip(&other.shares);
            pairs.all(|(a, b)| (a - b).abs() < distance)
        };
        if !chosen.iter().any(near) {
            chosen.push(point);
        }
        if chosen.len() == count {
            break;
        }
    }
    chosen.into_iter().cloned().collect()
}
