//! Steps of a calibration: sample, local searches, setting targets aside, exploration of the region.

use super::local::{Evaluation, TargetEvaluator, apart, least, least_worst};
use super::region::{Correlation, Interval, correlations, explore, intervals, reach_of};
use super::study::{CalibrationStudy, Role, TargetResult};
use crate::error::{Error, ErrorKind};
use crate::sweep::sobol;
use stickslip_system::watch::Watch;

/// Result of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Whether the calibration was interrupted. It then has the runs so far and the best of them.
    pub interrupted: bool,
    /// Best point, as fractions of the ranges.
    pub shares: Vec<f64>,
    /// Parameters of the best point, in the SI units of their keys.
    pub parameters: Vec<f64>,
    /// Largest residual of the held targets at the best point, in half-widths.
    pub worst: f64,
    /// Best compromise between all targets, if some were set aside.
    pub compromise: Option<Compromise>,
    /// Targets in the order of the study.
    pub targets: Vec<TargetResult>,
    /// Interval of every parameter; empty after an early interruption.
    pub intervals: Vec<Interval>,
    /// Correlation of every pair of parameters; empty after an early interruption.
    pub correlations: Vec<Correlation>,
    /// All runs: parameters as shares of the ranges, and summary or reason of a failure.
    pub runs: Vec<(Vec<f64>, Result<crate::sweep::Values, String>)>,
    /// Number of failed runs in [`Self::runs`].
    pub failed: usize,
}

/// Point that minimises the largest residual of all targets within reach.
#[derive(Debug, Clone, PartialEq)]
pub struct Compromise {
    /// Parameters in the SI units of their keys.
    pub parameters: Vec<f64>,
    /// Factor by which all intervals would have to be wider for all targets to be met; above 1.
    pub worst: f64,
    /// Residuals of all targets, in half-widths; infinite if the run lacks the quantity.
    pub residuals: Vec<f64>,
}

/// Number of local searches for each of many side questions.
const FEWER: usize = 4;

/// Rounds of a local search: main search, side question.
const ROUNDS: [u32; 2] = [3, 2];

/// Distance of starts within the region of valid targets, as a fraction of its extent.
const NEAR: f64 = 0.125;

struct Calibrating<'a> {
    evaluator: TargetEvaluator<'a>,
    pool: Vec<Evaluation>,
}

/// Finds the parameters of a study on `workers` threads, whose number does not change the result. Contradictions and
/// interruptions are part of the result.
///
/// # Errors
/// All runs fail, no target can be met in the ranges, or the calibration was interrupted before the first run.
pub fn calibrate(study: &CalibrationStudy, workers: usize, watch: &dyn Watch) -> Result<Calibration, Error> {
    let mut state = Calibrating {
        evaluator: TargetEvaluator { study, workers, watch },
        pool: Vec::new(),
    };
    let fitted: Vec<usize> = (0..study.targets.len())
        .filter(|&k| study.targets[k].weight > 0.0)
        .collect();
    let mut answer = Answer {
        held: fitted.clone(),
        ..Answer::default()
    };
    let interrupted = state.find(&fitted, &mut answer).is_err();
    let failures = state.pool.iter().filter_map(|point| point.result.as_ref().err());
    let failed = failures.clone().count();
    if failed == state.pool.len() {
        let first = failures.clone().next().ok_or_else(nothing_run)?;
        return Err(Error::computation(format!(
            "all {failed} runs failed, the first with: {first}. Change the ranges of the free parameters"
        )));
    }
    let nearest = |k: usize| least(&state.pool, &[k]).map_or(f64::INFINITY, |point| point.residuals[k]);
    if answer.held.is_empty() {
        let near = fitted.iter().copied();
        let near = near.min_by(|&a, &b| nearest(a).abs().total_cmp(&nearest(b).abs()));
        let near = near.ok_or_else(nothing_run)?;
        return Err(Error::computation(format!(
            "no target holds anywhere in the ranges of the free parameters; the nearest is {}, {:.1} half-widths off. Widen the \
             ranges, or free other parameters",
            study.targets[near].name(),
            nearest(near)
        )));
    }
    let best = least(&state.pool, &answer.held).ok_or_else(nothing_run)?;
    let mut reachable = fitted.clone();
    reachable.retain(|k| !answer.out_of_reach.contains(k));
    let worst = |members: &[usize]| least(&state.pool, members).map_or(f64::INFINITY, |point| point.worst(members));
    let result = |k: usize| {
        let values = best.result.as_ref().ok();
        let mut result = TargetResult {
            role: Role::Compared,
            here: values.map_or(f64::NAN, |values| values[study.targets[k].quantity]),
            residual: values.map_or(f64::NAN, |values| study.targets[k].residual(values)),
            nearest: nearest(k),
            instead: Vec::new(),
            together: f64::NAN,
        };
        if answer.held.contains(&k) {
            result.role = Role::Held;
        } else if answer.out_of_reach.contains(&k) {
            result.role = Role::OutOfReach;
        } else if answer.contradicting.contains(&k) {
            result.role = Role::Contradicts;
            result.together = worst(&[answer.held.as_slice(), &[k]].concat());
            result.instead = answer.held.clone();
            result.instead.retain(|&other| worst(&answer.swapped(k, other)) <= 1.0);
        }
        result
    };
    Ok(Calibration {
        interrupted,
        shares: best.shares.clone(),
        parameters: study.parameters(&best.shares),
        worst: best.worst(&answer.held),
        compromise: least(&state.pool, &reachable)
            .filter(|point| !answer.contradicting.is_empty() && point.worst(&reachable).is_finite())
            .map(|point| Compromise {
                parameters: study.parameters(&point.shares),
                worst: point.worst(&reachable),
                residuals: point.residuals.clone(),
            }),
        targets: (0..study.targets.len()).map(result).collect(),
        intervals: answer.intervals,
        correlations: answer.correlations,
        failed,
        runs: state
            .pool
            .into_iter()
            .map(|point| (point.shares, point.result))
            .collect(),
    })
}

fn nothing_run() -> Error {
    Error::new(ErrorKind::Interrupted, "interrupted before the first run was done")
}

#[derive(Default)]
struct Answer {
    held: Vec<usize>,
    contradicting: Vec<usize>,
    out_of_reach: Vec<usize>,
    intervals: Vec<Interval>,
    correlations: Vec<Correlation>,
}

impl Answer {
    fn swapped(&self, k: usize, other: usize) -> Vec<usize> {
        let rest = self.held.iter().copied().filter(|&held| held != other);
        rest.chain([k]).collect()
    }
}

impl Calibrating<'_> {
    fn find(&mut self, fitted: &[usize], answer: &mut Answer) -> Result<(), Error> {
        let search = self.evaluator.study.search;
        self.sample(search.points)?;
        if self.pool.iter().all(|point| point.result.is_err()) {
            return Ok(());
        }
        // A target that cannot be met alone cannot be met with others.
        for &k in fitted {
            if self.worst(&[k]) > 1.0 {
                let wide = self.spacing();
                self.improve(&[k], FEWER, ROUNDS[1], wide, "reaching for one target")?;
            }
            if self.worst(&[k]) > 1.0 {
                answer.out_of_reach.push(k);
            }
        }
        answer.held.retain(|k| !answer.out_of_reach.contains(k));
        if answer.held.is_empty() {
            return Ok(());
        }
        let wide = self.spacing();
        self.improve(&answer.held, search.starts, ROUNDS[0], wide, "local searches")?;
        while self.worst(&answer.held) > 1.0 && answer.held.len() > 1 {
            let without = answer.held.remove(self.least_missed(&answer.held)?);
            answer.contradicting.push(without);
        }
        if !answer.contradicting.is_empty() {
            self.improve(&answer.held, search.starts, ROUNDS[0], wide, "local searches")?;
        }
        let mut sample = self.explore(&answer.held)?;
        // If targets jump, a corner of the others' region that no search from outside finds may meet them all.
        while let Some(place) = self.holds_after_all(answer)? {
            answer.held.push(answer.contradicting.remove(place));
            answer.held.sort_unstable();
            sample = self.explore(&answer.held)?;
        }
        while let Some((place, later)) = self.does_as_well(answer) {
            let earlier = std::mem::replace(&mut answer.contradicting[place], later);
            answer.held.retain(|&held| held != later);
            answer.held.push(earlier);
            answer.held.sort_unstable();
            sample = self.explore(&answer.held)?;
        }
        let near = self.extent(&answer.held) * NEAR;
        self.improve(&answer.held, FEWER, ROUNDS[0], near, "the optimum")?;
        answer.intervals = intervals(&self.evaluator, &self.pool, &answer.held);
        answer.correlations = correlations(&sample);
        Ok(())
    }

    /// Index of a target that was set aside but is met in the region of the held ones. The last ones are tried first.
    fn holds_after_all(&mut self, answer: &Answer) -> Result<Option<usize>, Error> {
        let starts = self.evaluator.study.search.starts;
        let near = self.extent(&answer.held) * NEAR;
        for place in (0..answer.contradicting.len()).rev() {
            let with = [answer.held.as_slice(), &[answer.contradicting[place]]].concat();
            self.improve(&with, starts, ROUNDS[1], near, "targets set aside")?;
            if self.worst(&with) <= 1.0 {
                return Ok(Some(place));
            }
        }
        Ok(None)
    }

    /// Of two targets with equal weight, the later one in the study is set aside, because rounding must not decide.
    /// Returns the index of a target that could replace a later held one, and the last such held target.
    fn does_as_well(&self, answer: &Answer) -> Option<(usize, usize)> {
        let weight = |k: usize| self.evaluator.study.targets[k].weight;
        answer.contradicting.iter().enumerate().find_map(|(place, &k)| {
            let later = answer.held.iter().copied().filter(|&other| other > k);
            let mut equal = later.filter(|&other| weight(other) == weight(k)).rev();
            equal
                .find(|&other| self.worst(&answer.swapped(k, other)) <= 1.0)
                .map(|other| (place, other))
        })
    }

    fn explore(&mut self, members: &[usize]) -> Result<Vec<Vec<f64>>, Error> {
        let Some(optimum) = least(&self.pool, members).cloned() else {
            return Ok(Vec::new());
        };
        explore(&self.evaluator, &mut self.pool, members, &optimum)
    }

    /// Extent of the region where these targets are met, from the optimum, as a fraction of the ranges.
    fn extent(&self, members: &[usize]) -> f64 {
        least(&self.pool, members).map_or(0.0, |optimum| reach_of(&self.pool, members, 1.0, optimum))
    }

    fn worst(&self, members: &[usize]) -> f64 {
        least(&self.pool, members).map_or(f64::INFINITY, |point| point.worst(members))
    }

    fn sample(&mut self, count: usize) -> Result<(), Error> {
        let (axes, seed) = (self.evaluator.study.runs.axes.len(), self.evaluator.study.search.seed);
        let points = sobol(axes, count, seed);
        let Calibrating { evaluator, pool } = self;
        let run = |shares: &Vec<f64>| evaluator.run(shares).map(Some);
        evaluator
            .each(pool, &points, run, Some("sampling the ranges"))
            .map(drop)
    }

    /// Local searches for the least largest residual, from points `spacing` apart, with first steps of that size.
    fn improve(
        &mut self,
        members: &[usize],
        starts: usize,
        rounds: u32,
        spacing: f64,
        stage: &str,
    ) -> Result<(), Error> {
        let starts = apart(&self.pool, members, starts, spacing);
        let Calibrating { evaluator, pool } = self;
        let search = |start: &Evaluation| least_worst(evaluator, start, members, spacing, rounds);
        evaluator.each(pool, &starts, search, Some(stage)).map(drop)
    }

    /// Target to set aside: among those of least weight, the one without which the others come nearest to being met.
    fn least_missed(&mut self, members: &[usize]) -> Result<usize, Error> {
        let rest = |without: usize| -> Vec<usize> {
            let others = members.iter().enumerate().filter(|(place, _)| *place != without);
            others.map(|(_, &k)| k).collect()
        };
        let weight = |place: usize| self.evaluator.study.targets[members[place]].weight;
        let least = (0..members.len()).map(weight).fold(f64::INFINITY, f64::min);
        let candidates: Vec<usize> = (0..members.len()).filter(|&place| weight(place) == least).collect();
        let mut best = (f64::INFINITY, candidates[0]);
        for without in candidates {
            let rest = rest(without);
            self.improve(&rest, FEWER, ROUNDS[1], self.spacing(), "leaving out one target")?;
            // Each search also helps the other questions. If two are equal, the first counts.
            let worst = self.worst(&rest);
            if worst < best.0 {
                best = (worst, without);
            }
        }
        Ok(best.1)
    }

    fn spacing(&self) -> f64 {
        let search = self.evaluator.study.search;
        0.5 * (search.points as f64).powf(-1.0 / self.evaluator.study.runs.axes.len() as f64)
    }
}
