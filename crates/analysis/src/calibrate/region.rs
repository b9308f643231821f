//! Exploration of all parameters with which the held targets are met.

use super::local::{Evaluation, TargetEvaluator, apart, farthest, least_worst};
use crate::error::Error;
use chacha20::ChaCha8Rng;
use chacha20::rand_core::{Rng, SeedableRng};
use stickslip_system::named;

named! {
    /// Bounds that the data set on a parameter.
    pub enum Determined {
        /// Bounded on both sides within the range.
        Both: "determined",
        /// Open to the lower end of the range.
        FromAboveOnly: "bounded-above",
        /// Open to the upper end of the range.
        FromBelowOnly: "bounded-below",
        /// Open to both ends of the range.
        Not: "undetermined",
    }
}

/// Values of one parameter for which the held targets are met together, for some values of the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Least value, in the key's SI unit. The targets are met at both ends.
    pub least: f64,
    /// Largest value, in the same unit.
    pub largest: f64,
    /// Sides that the measured numbers bound.
    pub determined: Determined,
}

/// Correlation of two parameters where the targets are met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correlation {
    /// Indices of the free parameters.
    pub parameters: [usize; 2],
    /// Pearson's coefficient of the positions in the ranges, -1 to 1; NaN if a parameter does not vary.
    pub coefficient: f64,
}

/// Fraction of the range. An interval within this distance of an end reaches it.
const AT_THE_END: f64 = 0.01;

/// Number of chains that walk through the region: per parameter, and in addition.
const CHAINS: [usize; 2] = [8, 16];
/// Steps of the chains. The first half spreads them over the region; the second half counts for the correlations.
const STEPS: usize = 24;

/// Bounds on the residuals of the chains before the final bound 1. Each bound has `WIDE_STEPS` steps.
const WIDENINGS: [f64; 4] = [16.0, 8.0, 4.0, 2.0];
const WIDE_STEPS: usize = 6;

/// Distance between starts for further parts, as a fraction of the extent of residuals up to [`NEARBY`].
const PARTS_APART: f64 = 1.0 / 16.0;
const NEARBY: f64 = 4.0;

/// Explores the region where `members` are met, into `pool`. Returns an even sample from the second half of the steps.
pub(super) fn explore(
    evaluator: &TargetEvaluator,
    pool: &mut Vec<Evaluation>,
    members: &[usize],
    optimum: &Evaluation,
) -> Result<Vec<Vec<f64>>, Error> {
    let dimensions = optimum.shares.len();
    let total = WIDENINGS.len() * WIDE_STEPS + STEPS + 5;
    let mut done = 0;
    let mut step_done = || {
        done += 1;
        evaluator.tell("the spread", done, total);
    };
    // The search starts at the optimum, with the steps that a half-width allows along each parameter.
    for _ in 0..2 {
        let reach = reach_of(pool, members, 1.0, optimum);
        extremes(evaluator, pool, members, reach)?;
        step_done();
    }
    let mut random = ChaCha8Rng::seed_from_u64(u64::from(evaluator.study.search.seed));
    // Quantities jump, so the region may have several parts. Wider intervals connect them.
    for widening in WIDENINGS {
        let mut chains = chains_within(pool, members, widening, dimensions);
        for step in 0..WIDE_STEPS {
            walk(evaluator, pool, members, widening, &mut chains, step, &mut random)?;
            step_done();
        }
    }
    let near = reach_of(pool, members, NEARBY, optimum) * PARTS_APART;
    let outside = pool.iter().filter(|point| point.worst(members) > 1.0);
    let outside: Vec<Evaluation> = outside.cloned().collect();
    let starts = apart(&outside, members, evaluator.study.search.starts, near);
    let search = |start: &Evaluation| least_worst(evaluator, start, members, near, 1);
    evaluator.each(pool, &starts, search, None)?;
    step_done();
    let mut chains = chains_within(pool, members, 1.0, dimensions);
    let mut sample = Vec::new();
    for step in 0..STEPS {
        walk(evaluator, pool, members, 1.0, &mut chains, step, &mut random)?;
        if step >= STEPS / 2 {
            sample.extend(chains.iter().cloned());
        }
        step_done();
    }
    for _ in 0..2 {
        let reach = reach_of(pool, members, 1.0, optimum) / 4.0;
        extremes(evaluator, pool, members, reach)?;
        step_done();
    }
    Ok(sample)
}

/// Chains at points with residuals up to `widening`, evenly over the known points, so that no part is missed.
fn chains_within(pool: &[Evaluation], members: &[usize], widening: f64, dimensions: usize) -> Vec<Vec<f64>> {
    let inside: Vec<&Evaluation> = pool.iter().filter(|point| point.worst(members) <= widening).collect();
    let count = CHAINS[0] * dimensions + CHAINS[1];
    let start = |chain: usize| inside[chain * inside.len() / count].shares.clone();
    (0..count).map(start).collect()
}

fn walk(
    evaluator: &TargetEvaluator,
    pool: &mut Vec<Evaluation>,
    members: &[usize],
    widening: f64,
    chains: &mut [Vec<f64>],
    step: usize,
    random: &mut ChaCha8Rng,
) -> Result<(), Error> {
    let proposals = (0..chains.len()).map(|chain| propose(chains, chain, step, random));
    let proposals: Vec<Vec<f64>> = proposals.collect();
    let run = |shares: &Vec<f64>| match shares.iter().all(|share| (0.0..=1.0).contains(share)) {
        true => evaluator.run(shares).map(Some),
        false => Ok(None),
    };
    let places = evaluator.each(pool, &proposals, run, None)?;
    for (chain, place) in chains.iter_mut().zip(places.windows(2)) {
        if let Some(found) = pool[place[0]..place[1]].first()
            && found.worst(members) <= widening
        {
            chain.clone_from(&found.shares);
        }
    }
    Ok(())
}

/// Step of differential evolution (C. J. F. ter Braak, 2006) along the difference of two other chains, so it adapts to
/// the region. Every fifth step has the full difference, to jump between islands.
fn propose(chains: &[Vec<f64>], chain: usize, step: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut other = |not: &[usize]| {
        loop {
            let pick = (random.next_u64() % chains.len() as u64) as usize;
            if !not.contains(&pick) {
                return pick;
            }
        }
    };
    let a = other(&[chain]);
    let b = other(&[chain, a]);
    let dimensions = chains[chain].len();
    let usual = 2.38 / (2.0 * dimensions as f64).sqrt();
    let length = if step % 5 == 4 { 1.0 } else { usual };
    let moved = |k: usize| {
        // Separates chains that began at the same point.
        let jitter = 1e-6 * (random.next_u64() as f64 / u64::MAX as f64 - 0.5);
        chains[chain][k] + length * (chains[a][k] - chains[b][k]) + jitter
    };
    (0..dimensions).map(moved).collect()
}

fn extremes(
    evaluator: &TargetEvaluator,
    pool: &mut Vec<Evaluation>,
    members: &[usize],
    reach: f64,
) -> Result<(), Error> {
    let feasible = || pool.iter().filter(|point| point.worst(members) <= 1.0);
    let mut searches: Vec<(usize, f64, Evaluation)> = Vec::new();
    for parameter in 0..evaluator.study.runs.axes.len() {
        for sign in [1.0, -1.0] {
            let place = |point: &Evaluation| sign * point.shares[parameter];
            let start = feasible().min_by(|a, b| place(a).total_cmp(&place(b)));
            searches.extend(start.map(|start| (parameter, sign, start.clone())));
        }
    }
    let search = |(parameter, sign, start): &(usize, f64, Evaluation)| {
        farthest(evaluator, start, members, *parameter, *sign, reach)
    };
    evaluator.each(pool, &searches, search, None).map(drop)
}

/// Extent of the points with residuals up to `widening` from the optimum, as a fraction of the ranges; at least 1e-5.
pub(super) fn reach_of(pool: &[Evaluation], members: &[usize], widening: f64, optimum: &Evaluation) -> f64 {
    let distance = |point: &Evaluation| {
        let pairs = point.shares.iter().zip(&optimum.shares);
        pairs.fold(0.0_f64, |far, (a, b)| far.max((a - b).abs()))
    };
    let inside = pool.iter().filter(|point| point.worst(members) <= widening);
    inside.map(distance).fold(1e-5, f64::max).min(0.25)
}

pub(super) fn intervals(evaluator: &TargetEvaluator, pool: &[Evaluation], members: &[usize]) -> Vec<Interval> {
    let axes = evaluator.study.runs.axes.iter().enumerate();
    let interval = |(k, axis): (usize, &crate::sweep::ParameterAxis)| {
        let inside = pool.iter().filter(|point| point.worst(members) <= 1.0);
        let shares = inside.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
            [low.min(point.shares[k]), high.max(point.shares[k])]
        });
        let [a, b] = shares.map(|share| axis.at(share).as_number().unwrap_or(f64::NAN));
        // A range may start at its larger end.
        let falling = axis.range.is_some_and(|range| range.from > range.to);
        let ends = [shares[0] < AT_THE_END, shares[1] > 1.0 - AT_THE_END];
        let [at_least, at_largest] = if falling { [ends[1], ends[0]] } else { ends };
        let determined = match (at_least, at_largest) {
            (false, false) => Determined::Both,
            (true, false) => Determined::FromAboveOnly,
            (false, true) => Determined::FromBelowOnly,
            (true, true) => Determined::Not,
        };
        Interval {
            least: a.min(b),
            largest: a.max(b),
            determined,
        }
    };
    axes.map(interval).collect()
}

/// Correlations of all pairs of parameters in a sample of the region.
pub fn correlations(sample: &[Vec<f64>]) -> Vec<Correlation> {
    let dimensions = sample.first().map_or(0, Vec::len);
    let count = sample.len() as f64;
    let mean = |k: usize| sample.iter().map(|point| point[k]).sum::<f64>() / count;
    let means: Vec<f64> = (0..dimensions).map(mean).collect();
    let covariance = |a: usize, b: usize| {
        let products = sample.iter().map(|point| (point[a] - means[a]) * (point[b] - means[b]));
        products.sum::<f64>() / count
    };
    let pairs = (0..dimensions).flat_map(|a| (a + 1..dimensions).map(move |b| [a, b]));
    let correlation = |[a, b]: [usize; 2]| Correlation {
        parameters: [a, b],
        coefficient: covariance(a, b) / (covariance(a, a) * covariance(b, b)).sqrt(),
    };
    pairs.map(correlation).collect()
}
