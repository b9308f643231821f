//! Local searches by COBYLA: linear models of every target over a shrinking simplex.
//!
//! M. J. D. Powell, A direct search optimization method that models the objective and constraint functions by linear
//! interpolation, 1994. Each target is a separate constraint, so no squares or penalties weigh targets against each
//! other. Derivatives are not needed: quantities jump when a stick appears or vanishes.

use super::evaluate::{Evaluation, Halted, TargetEvaluator};
use cobyla::{RhoBeg, StopTols, minimize};
use std::cell::RefCell;

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
    halted: RefCell<bool>,
}

impl Runs<'_> {
    fn new<'a>(evaluator: &'a TargetEvaluator<'a>) -> Runs<'a> {
        Runs {
            evaluator,
            made: RefCell::new(Vec::new()),
            halted: RefCell::new(false),
        }
    }

    fn residual(&self, shares: &[f64], target: usize) -> f64 {
        // COBYLA may exceed the bounds by rounding.
        let shares: Vec<f64> = shares.iter().map(|share| share.clamp(0.0, 1.0)).collect();
        let mut made = self.made.borrow_mut();
        if let Some(last) = made.last().filter(|last| last.shares == shares) {
            return last.residuals[target];
        }
        if *self.halted.borrow() {
            return f64::NAN;
        }
        match self.evaluator.run(&shares) {
            Ok(evaluation) => {
                let residual = evaluation.residuals[target];
                made.push(evaluation);
                residual
            }
            Err(Halted) => {
                *self.halted.borrow_mut() = true;
                f64::NAN
            }
        }
    }

    fn into_runs(self) -> Result<Vec<Evaluation>, Halted> {
        match self.halted.into_inner() {
            true => Err(Halted),
            false => Ok(self.made.into_inner()),
        }
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

/// Least tau with -tau <= residual <= tau for all `members`, from a point. `reach` is the first size of the simplex as
/// a fraction of the ranges; `rounds` is the number of restarts. Returns all runs.
pub(super) fn least_worst(
    evaluator: &TargetEvaluator,
    start: &Evaluation,
    members: &[usize],
    reach: f64,
    rounds: u32,
) -> Result<Vec<Evaluation>, Halted> {
    let dimensions = start.shares.len();
    let mut made: Vec<Evaluation> = Vec::new();
    let mut best = start.clone();
    for round in 0..rounds {
        let scale = best.worst(members);
        if !scale.is_finite() || scale == 0.0 {
            break;
        }
        let runs = Runs::new(evaluator);
        let mut constraints: Vec<Constraint> = Vec::new();
        for &target in members {
            for sign in [1.0, -1.0] {
                let runs = &runs;
                constraints.push(Box::new(move |x: &[f64], (): &mut ()| {
                    x[dimensions] - sign * scaled(runs.residual(&x[..dimensions], target), scale)
                }));
            }
        }
        // The last variable is tau, relative to the largest residual at the start.
        let mut x = best.shares.clone();
        x.push(1.0);
        let mut bounds = vec![(0.0, 1.0); dimensions];
        bounds.push((0.0, 2.0));
        let reach = reach / SHRINK.powi(round as i32);
        let mut sizes = vec![reach; dimensions];
        sizes.push(0.25);
        let mut ends = vec![reach * ROUND_DEPTH; dimensions];
        ends.push(ROUND_DEPTH);
        let tolerances = StopTols {
            xtol_abs: ends,
            ..StopTols::default()
        };
        // The exit state does not matter: the best of all runs counts.
        let _ = minimize(
            |x: &[f64], (): &mut ()| x[dimensions],
            &x,
            &bounds,
            &constraints,
            (),
            most_runs(dimensions),
            RhoBeg::Set(sizes),
            Some(tolerances),
        );
        drop(constraints);
        let round = runs.into_runs()?;
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
) -> Result<Vec<Evaluation>, Halted> {
    let dimensions = start.shares.len();
    let runs = Runs::new(evaluator);
    let mut constraints: Vec<Constraint> = Vec::new();
    for &target in members {
        for side in [1.0, -1.0] {
            let runs = &runs;
            constraints.push(Box::new(move |x: &[f64], (): &mut ()| {
                1.0 - side * scaled(runs.residual(x, target), 1.0)
            }));
        }
    }
    let tolerances = StopTols {
        xtol_abs: vec![reach * ROUND_DEPTH; dimensions],
        ..StopTols::default()
    };
    let _ = minimize(
        |x: &[f64], (): &mut ()| sign * x[parameter],
        &start.shares,
        &vec![(0.0, 1.0); dimensions],
        &constraints,
        (),
        most_runs(dimensions),
        RhoBeg::All(reach),
        Some(tolerances),
    );
    drop(constraints);
    runs.into_runs()
}

pub(super) fn least<'a>(evaluations: &'a [Evaluation], members: &[usize]) -> Option<&'a Evaluation> {
    evaluations
        .iter()
        .min_by(|a, b| a.worst(members).total_cmp(&b.worst(members)))
}

/// Best points for these targets, at least `distance` apart along some parameter.
pub(super) fn apart(pool: &[Evaluation], members: &[usize], count: usize, distance: f64) -> Vec<Evaluation> {
    let mut order: Vec<(f64, usize)> = pool
        .iter()
        .enumerate()
        .map(|(index, point)| (point.worst(members), index))
        .filter(|(worst, _)| worst.is_finite())
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut chosen: Vec<&Evaluation> = Vec::new();
    for (_, index) in order {
        let point = &pool[index];
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
