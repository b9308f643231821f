//! The spread that the data leave: all parameters with which the held targets hold, as far as they are found.

use super::evaluate::{Evaluation, Evaluator, Halted};
use super::local::{apart, farthest, least_worst};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// What the data say of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Determined {
    /// The data bound it from both sides within its range.
    Both = 0,
    /// They let it go down to the lower end of the range.
    FromAboveOnly = 1,
    /// They let it go up to the upper end.
    FromBelowOnly = 2,
    /// They let it take any value of the range, or both ends of it.
    Not = 3,
}

impl Determined {
    /// All, in the order of their codes.
    pub const ALL: [Determined; 4] = [
        Determined::Both,
        Determined::FromAboveOnly,
        Determined::FromBelowOnly,
        Determined::Not,
    ];

    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Determined::Both => "determined",
            Determined::FromAboveOnly => "bounded-above",
            Determined::FromBelowOnly => "bounded-below",
            Determined::Not => "undetermined",
        }
    }
}

/// The values of one parameter for which the held targets hold together, with some values of the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// In the key's SI unit; the ends are points at which the targets hold.
    pub least: f64,
    /// In the same unit.
    pub largest: f64,
    /// The same as shares of the range, in the order of the range.
    pub shares: [f64; 2],
    /// On which sides the measured numbers bound it.
    pub determined: Determined,
}

/// How two parameters go together where the targets hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correlation {
    /// Places among the free parameters.
    pub parameters: [usize; 2],
    /// Pearson's coefficient of their places in the ranges (of the logarithm on a log scale), -1 to 1; NaN if one of the
    /// two does not vary.
    pub coefficient: f64,
}

/// Within this of an end, as a share of the range, an interval counts as reaching it.
const AT_THE_END: f64 = 0.01;

/// Chains that walk through the region, for each parameter and beside, and their steps.
const CHAINS: [usize; 2] = [8, 16];
/// The first half of the steps spreads the chains over the region, the second counts for the correlations.
const STEPS: usize = 24;

/// Residuals up to which chains walk before they are held to 1, and their steps at each.
const WIDENINGS: [f64; 4] = [16.0, 8.0, 4.0, 2.0];
const WIDE_STEPS: usize = 6;

/// Searches for further parts of the region begin apart by this share of the extent of where residuals are up to
/// [`NEARBY`].
const PARTS_APART: f64 = 1.0 / 16.0;
const NEARBY: f64 = 4.0;

/// Explores the region around the points of `pool` at which `members` hold, and adds all that it runs to the pool.
/// Returns the points of the chains in the second half of their steps: an even sample of the region.
pub(super) fn explore(
    evaluator: &Evaluator,
    pool: &mut Vec<Evaluation>,
    members: &[usize],
    optimum: &Evaluation,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Vec<Vec<f64>>, Halted> {
    let dimensions = optimum.shares.len();
    let total = WIDENINGS.len() * WIDE_STEPS + STEPS + 5;
    let mut done = 0;
    let mut step_done = || {
        done += 1;
        progress(done, total);
    };
    // From the optimum, with steps of the size that a half-width allows along each parameter by itself.
    for _ in 0..2 {
        let reach = reach_of(pool, members, 1.0, optimum);
        extremes(evaluator, pool, members, reach)?;
        step_done();
    }
    let mut random = ChaCha8Rng::seed_from_u64(u64::from(evaluator.study.search.seed));
    // The region may be in several parts, since the quantities jump; between intervals that are wider it is in one.
    for widening in WIDENINGS {
        let mut chains = chains_within(pool, members, widening, dimensions);
        for step in 0..WIDE_STEPS {
            walk(evaluator, pool, members, widening, &mut chains, step, &mut random)?;
            step_done();
        }
    }
    let near = reach_of(pool, members, NEARBY, optimum) * PARTS_APART;
    let outside: Vec<Evaluation> = pool
        .iter()
        .filter(|point| point.worst(members) > 1.0)
        .cloned()
        .collect();
    let starts = apart(&outside, members, evaluator.study.search.starts, near);
    let search = |start: &Evaluation| least_worst(evaluator, start, members, near, 1);
    evaluator.each(pool, &starts, search, &mut |_| {})?;
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

/// Chains at points whose residuals are up to `widening`, evenly among those found so far, so that every part of the
/// region has its share.
fn chains_within(pool: &[Evaluation], members: &[usize], widening: f64, dimensions: usize) -> Vec<Vec<f64>> {
    let inside: Vec<&Evaluation> = pool.iter().filter(|point| point.worst(members) <= widening).collect();
    let count = CHAINS[0] * dimensions + CHAINS[1];
    (0..count)
        .map(|chain| inside[chain * inside.len() / count].shares.clone())
        .collect()
}

/// One step of every chain, to where the residuals are up to `widening`.
fn walk(
    evaluator: &Evaluator,
    pool: &mut Vec<Evaluation>,
    members: &[usize],
    widening: f64,
    chains: &mut [Vec<f64>],
    step: usize,
    random: &mut ChaCha8Rng,
) -> Result<(), Halted> {
    let proposals: Vec<Vec<f64>> = (0..chains.len())
        .map(|chain| propose(chains, chain, step, random))
        .collect();
    // A point outside the ranges has no run.
    let run = |shares: &Vec<f64>| match shares.iter().all(|share| (0.0..=1.0).contains(share)) {
        true => evaluator.run(shares).map(Some),
        false => Ok(None),
    };
    let places = evaluator.each(pool, &proposals, run, &mut |_| {})?;
    for (chain, place) in chains.iter_mut().zip(places.windows(2)) {
        if let Some(found) = pool[place[0]..place[1]].first()
            && found.worst(members) <= widening
        {
            chain.clone_from(&found.shares);
        }
    }
    Ok(())
}

/// A step of differential evolution (C. J. F. ter Braak, 2006): along the difference of two other chains, which have the
/// shape and the size of the region by themselves; every fifth as long as the difference, from island to island.
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
    let length = if step % 5 == 4 {
        1.0
    } else {
        2.38 / (2.0 * dimensions as f64).sqrt()
    };
    (0..dimensions)
        .map(|k| {
            // Chains that began at one point part by this.
            let jitter = 1e-6 * (random.next_u64() as f64 / u64::MAX as f64 - 0.5);
            chains[chain][k] + length * (chains[a][k] - chains[b][k]) + jitter
        })
        .collect()
}

/// Pushes out from the points that are farthest along each parameter, both ways.
fn extremes(evaluator: &Evaluator, pool: &mut Vec<Evaluation>, members: &[usize], reach: f64) -> Result<(), Halted> {
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
    evaluator.each(pool, &searches, search, &mut |_| {}).map(drop)
}

/// How far the points with residuals up to `widening` lie from the optimum, as a share of the ranges; at least 1e-5, as a
/// search has to begin with some step.
pub(super) fn reach_of(pool: &[Evaluation], members: &[usize], widening: f64, optimum: &Evaluation) -> f64 {
    let distance = |point: &Evaluation| {
        let pairs = point.shares.iter().zip(&optimum.shares);
        pairs.fold(0.0_f64, |far, (a, b)| far.max((a - b).abs()))
    };
    let inside = pool.iter().filter(|point| point.worst(members) <= widening);
    inside.map(distance).fold(1e-5, f64::max).min(0.25)
}

/// The extent of the region along every parameter.
pub(super) fn intervals(evaluator: &Evaluator, pool: &[Evaluation], members: &[usize]) -> Vec<Interval> {
    let axes = evaluator.study.runs.axes.iter().enumerate();
    let interval = |(k, axis): (usize, &crate::sweep::Axis)| {
        let inside = pool.iter().filter(|point| point.worst(members) <= 1.0);
        let shares = inside.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
            [low.min(point.shares[k]), high.max(point.shares[k])]
        });
        let [a, b] = shares.map(|share| axis.at(share).as_number().unwrap_or(f64::NAN));
        // A range may be given from its larger end.
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
            shares,
            determined,
        }
    };
    axes.map(interval).collect()
}

/// Of every pair of parameters, over a sample of the region.
pub(super) fn correlations(sample: &[Vec<f64>]) -> Vec<Correlation> {
    let dimensions = sample.first().map_or(0, Vec::len);
    let count = sample.len() as f64;
    let mean = |k: usize| sample.iter().map(|point| point[k]).sum::<f64>() / count;
    let means: Vec<f64> = (0..dimensions).map(mean).collect();
    let covariance = |a: usize, b: usize| {
        let products = sample.iter().map(|point| (point[a] - means[a]) * (point[b] - means[b]));
        products.sum::<f64>() / count
    };
    let pairs = (0..dimensions).flat_map(|a| (a + 1..dimensions).map(move |b| [a, b]));
    pairs
        .map(|[a, b]| Correlation {
            parameters: [a, b],
            coefficient: covariance(a, b) / (covariance(a, a) * covariance(b, b)).sqrt(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_correlations_of_lines_and_of_a_square() {
        let points = |f: fn(f64, f64) -> [f64; 2]| -> Vec<Vec<f64>> {
            let square = (0..25).map(|k| (f64::from(k % 5), f64::from(k / 5)));
            square.map(|(x, y)| f(x, y).to_vec()).collect()
        };
        let coefficient = |sample: &[Vec<f64>]| correlations(sample)[0].coefficient;
        assert!((coefficient(&points(|x, _| [x, 3.0 - 2.0 * x])) + 1.0).abs() < 1e-12);
        assert!((coefficient(&points(|x, _| [x, 1.0 + x])) - 1.0).abs() < 1e-12);
        assert!(coefficient(&points(|x, y| [x, y])).abs() < 1e-12);
        assert!(coefficient(&points(|x, _| [x, 1.0])).is_nan());
    }
}
