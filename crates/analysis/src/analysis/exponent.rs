//! Largest Lyapunov exponent of a motion without a period.
//!
//! Two neighbouring motions continue from the end of the run by `series`, through all events. After each interval the
//! deviation is scaled back to its first size in its own direction (Benettin, Galgani, Giorgilli and Strelcyn,
//! Meccanica 15, 1980, 9). A stick removes the deviation of the relative velocity; the other components survive
//! because the direction is kept. If nothing is left, the motions coincide, and a new deviation is set.

use super::forcing::{forcing_period, harmonics};
use serde::Serialize;
use std::f64::consts::TAU;
use stickslip_engine::simulation::{
    Course, Method, OutputOptions, RunReport, Section, Simulation, SolverOptions, deviation_weights, natural_period,
    simulate_from,
};
use stickslip_system::model::Mode;
use stickslip_system::model::system::System;
use stickslip_system::record::{Recorder, RecorderError, Sample};

/// Initial deviation relative to the largest state. Its square is below the motions' errors of about 1e-13.
const DEVIATION: f64 = 1e-8;

/// Fraction of the deviation below which only the motions' errors are left.
const GONE: f64 = 1e-5;

/// Largest and least number of intervals. The run itself must also contain the least number.
const INTERVALS: (usize, usize) = (1600, 120);

/// The first 1/TURNING of the intervals is skipped: the deviation turns into the growing direction.
const TURNING: usize = 8;

/// Limit for both motions together, about one second. A limit in steps keeps the exponent reproducible.
const MOST_STEPS: usize = 40_000;

/// Cost of restarting a motion, in steps.
const STEPS_OF_START: usize = 4;

/// Numbers of batches for the standard error. The larger error counts.
const BATCHES: [usize; 2] = [20, 10];

/// Total gain or loss, in e-folds, that is compatible with a zero exponent.
const FREE_GROWTH: f64 = 2.0;

/// An exponent differs from zero beyond this many standard errors.
const CLEAR: f64 = 3.0;

/// Largest Lyapunov exponent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Exponent {
    /// Value, 1/s.
    pub value: f64,
    /// Standard error of `value`, 1/s.
    pub uncertainty: f64,
    /// Measured time, s; `None` if read from a file.
    pub time: Option<f64>,
}

/// Behaviour of neighbouring motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Neighbours {
    /// They separate: the motion is chaotic.
    Part,
    /// They keep their distance, as in a quasi-periodic motion.
    Stay,
    /// They converge: the motion approaches a period, or follows an aperiodic forcing.
    Meet,
}

impl Exponent {
    /// Behaviour of neighbouring motions, by the sign of the exponent.
    pub fn neighbours(&self) -> Neighbours {
        let clear = CLEAR * self.uncertainty;
        if self.value > clear {
            Neighbours::Part
        } else if self.value < -clear {
            Neighbours::Meet
        } else {
            Neighbours::Stay
        }
    }
}

#[derive(Default)]
struct ExponentStates {
    times: Vec<f64>,
    further: Vec<f64>,
    found: Vec<(f64, Mode, Vec<f64>)>,
    last: Vec<f64>,
}

impl Recorder for ExponentStates {
    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        self.further.clear();
        self.further.extend_from_slice(values);
        Ok(())
    }

    fn sample(&mut self, _: &Sample) -> Result<(), RecorderError> {
        self.last.clone_from(&self.further);
        Ok(())
    }

    fn next_strobe(&self) -> f64 {
        self.times.last().copied().unwrap_or(f64::INFINITY)
    }

    fn strobe(&mut self, time: f64, mode: Mode, _: f64) -> Result<(), RecorderError> {
        self.times.pop();
        self.found.push((time, mode, self.further.clone()));
        Ok(())
    }

    fn stores_events(&self) -> bool {
        true
    }

    fn stores_motion(&self) -> bool {
        false
    }
}

struct Motions<'a> {
    problem: Simulation<'a>,
    course: Course,
    weights: Vec<f64>,
    steps: usize,
}

impl Motions<'_> {
    fn state(&self, further: &[f64]) -> Vec<f64> {
        self.course.state_of(further)
    }

    /// Integrates from a state at `from` (s) into `states`. Returns whether `end` (s) was reached.
    fn go(&mut self, from: (f64, &[f64]), end: f64, states: &mut ExponentStates) -> bool {
        let solver = SolverOptions {
            method: Method::Series,
            max_steps: Some(self.steps),
            ..SolverOptions::default()
        };
        let output = OutputOptions::at_the_ends(end);
        let ended = simulate_from(self.problem, Some(from), &solver, &output, states, &());
        let steps = |report: &RunReport| report.work.iter().map(|work| work.steps as usize).sum::<usize>();
        let (taken, arrived) = match &ended {
            Ok(report) => (steps(report), true),
            Err(failure) => (steps(&failure.report), false),
        };
        self.steps = self.steps.saturating_sub(taken + STEPS_OF_START);
        arrived
    }

    /// Weighted norm of a deviation. Twists times the frequencies of their inertias count as speeds.
    fn size(&self, deviation: &[f64]) -> f64 {
        let parts = deviation.iter().zip(&self.weights);
        parts.map(|(part, weight)| (part * weight).powi(2)).sum::<f64>().sqrt()
    }

    fn general(&self, dimension: usize) -> Vec<f64> {
        let part = |i: usize| (1.0 + 0.37 * (i as f64).sin()) / self.weights.get(i).copied().unwrap_or(f64::INFINITY);
        (0..dimension).map(part).collect()
    }

    /// Growth of the deviation (e-folds) and length (s) of each interval between these states.
    fn growth(&mut self, states: &[(f64, Mode, Vec<f64>)]) -> Vec<(f64, f64)> {
        let points: Vec<(f64, Vec<f64>)> = states.iter().map(|one| (one.0, self.state(&one.2))).collect();
        let largest = points.iter().map(|point| self.size(&point.1)).fold(0.0, f64::max);
        let first = DEVIATION * largest;
        let mut grown = Vec::with_capacity(points.len());
        let Some((_, state)) = points.first() else {
            return grown;
        };
        let mut deviation = self.general(state.len());
        for pair in points.windows(2) {
            let [(from, state), (to, after)] = pair else { break };
            let scale = first / self.size(&deviation);
            let beside: Vec<f64> = state.iter().zip(&deviation).map(|(y, d)| y + scale * d).collect();
            let mut there = ExponentStates::default();
            if !self.go((*from, &beside), *to, &mut there) {
                break;
            }
            let neighbour = self.state(&there.last);
            let mechanical = self.weights.len();
            deviation = neighbour.iter().zip(after).map(|(a, b)| a - b).collect();
            deviation[mechanical..].fill(0.0);
            let share = self.size(&deviation) / first;
            if !share.is_finite() {
                break;
            }
            if share < GONE {
                deviation = self.general(state.len());
            }
            grown.push((share.max(GONE).ln(), to - from));
        }
        grown
    }
}

fn mean(grown: &[(f64, f64)]) -> Exponent {
    let rate = |part: &[(f64, f64)]| {
        let sum = part.iter().fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        (sum.0 / sum.1, sum.1)
    };
    let (value, time) = rate(grown);
    let spread = |batches: usize| {
        let means = grown.chunks_exact(grown.len() / batches).take(batches);
        let squares: f64 = means.map(|batch| (rate(batch).0 - value).powi(2)).sum();
        (squares / ((batches - 1) * batches) as f64).sqrt()
    };
    let uncertainty = BATCHES.map(spread).into_iter().fold(FREE_GROWTH / time, f64::max);
    Exponent {
        value,
        uncertainty,
        time: Some(time),
    }
}

/// Largest exponent of the motion that continues from the end of a run. `section` is the mean time between sections
/// (s), if there are any. `None` if the run is too short, or if the system changes soon after its end.
pub fn exponent(system: &System, threshold: f64, end: &Section, section: Option<f64>) -> Option<Exponent> {
    let forced = harmonics(system)
        .iter()
        .map(|harmonic| TAU / harmonic.angular_frequency.abs())
        .fold(0.0, f64::max);
    let forced = forcing_period(system).map_or(forced, |period| period.min(forced));
    let interval = match section.map_or(forced, |section| section.max(forced)) {
        0.0 => natural_period(system)?,
        interval => interval,
    };
    let course = Course::new(system, threshold, &SolverOptions::default());
    let corner = course.next_corner(end.time).unwrap_or(f64::INFINITY);
    let kicks = system.kicks.iter().filter_map(|kick| kick.time.at().copied());
    let undisturbed = kicks.filter(|kick| *kick > end.time).fold(corner, f64::min);
    let there = |interval_count: usize| end.time + interval_count as f64 * interval;
    let intervals = (0..=INTERVALS.0).rev().find(|&count| there(count) < undisturbed)?;
    if end.mode == Mode::Separated || end.time < INTERVALS.1 as f64 * interval || intervals < INTERVALS.1 {
        return None;
    }
    let mut motions = Motions {
        problem: Simulation {
            system,
            threshold,
            further: true,
        },
        weights: deviation_weights(course.system()),
        course,
        steps: MOST_STEPS,
    };
    let state = motions.state(&end.further);
    let mut states = ExponentStates {
        times: (1..=intervals).rev().map(there).collect(),
        ..ExponentStates::default()
    };
    // The neighbour gets the other half of the steps.
    motions.steps = MOST_STEPS / 2;
    motions.go((end.time, &state), there(intervals), &mut states);
    motions.steps += MOST_STEPS / 2;
    // A motion must begin with a closed contact.
    let closed = |one: &(f64, Mode, Vec<f64>)| one.1 != Mode::Separated;
    let states: Vec<_> = states.found.into_iter().filter(closed).collect();
    let grown = motions.growth(&states);
    (grown.len() >= INTERVALS.1).then(|| mean(&grown[grown.len() / TURNING..]))
}
