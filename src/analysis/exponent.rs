//! The largest Lyapunov exponent of a motion that has no period.
//!
//! Two neighbouring motions go on from the end of the run by `series`, through all events. After each interval the deviation is
//! brought back to its first size in its own direction (Benettin, Galgani, Giorgilli and Strelcyn, Meccanica 15, 1980, 9). A stick
//! takes the deviation of the relative velocity away. What is left of the deviation there is what survives, since its direction is
//! kept; where nothing is left, the two motions are one, and the deviation is set anew.

use super::forcing::{forcing_period, harmonics};
use crate::model::Mode;
use crate::model::system::System;
use crate::record::{Recorder, RecorderError, Sample};
use crate::simulation::{
    Course, Method, OutputOptions, Problem, RunReport, Section, SolverOptions, deviation_weights, natural_period,
    simulate_from,
};
use serde::Serialize;
use std::f64::consts::TAU;
use std::ops::ControlFlow;

/// Size of the deviation at the begin of each interval, relative to the largest state. Its square is below the error of the
/// motions, which is some 1e-13.
const DEVIATION: f64 = 1e-8;

/// Relative to that: what the errors of the two motions leave of a deviation that is gone.
const GONE: f64 = 1e-5;

/// Intervals that are gone through at most, and at least: of the run as well.
const INTERVALS: (usize, usize) = (1600, 120);

/// The first intervals, in which the deviation turns to where it grows most, do not count: one of so many.
const TURNING: usize = 8;

/// Steps of the two motions together: about a second. Counted in steps, so that the same run always has the same exponent.
const MOST_STEPS: usize = 40_000;

/// A new start of a motion costs as much as so many steps.
const STEPS_OF_START: usize = 4;

/// Numbers of batches, by whose means the exponent is uncertain: the one that says more counts.
const BATCHES: [usize; 2] = [20, 10];

/// e-folds that the deviation may gain or lose in all without an exponent.
const FREE_GROWTH: f64 = 2.0;

/// An exponent is other than zero beyond so many uncertainties.
const CLEAR: f64 = 3.0;

/// The largest Lyapunov exponent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Exponent {
    /// 1/s.
    pub value: f64,
    /// Standard error of `value`, 1/s.
    pub uncertainty: f64,
    /// Over which it was measured, s; `None` if read from a file.
    pub time: Option<f64>,
}

/// What an exponent says of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Neighbours {
    /// Neighbouring motions part: the motion is chaotic.
    Part,
    /// They stay beside each other, as those of a quasi-periodic motion do.
    Stay,
    /// They come together: the motion comes to a period, or follows a forcing that has none.
    Meet,
}

impl Exponent {
    /// What becomes of neighbouring motions.
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

/// A motion at given times, the last first.
#[derive(Default)]
struct States {
    times: Vec<f64>,
    further: Vec<f64>,
    found: Vec<(f64, Mode, Vec<f64>)>,
    /// The values of the last sample.
    last: Vec<f64>,
}

impl Recorder for States {
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

/// Motions of a system.
struct Motions<'a> {
    problem: Problem<'a>,
    course: Course,
    weights: Vec<f64>,
    /// Steps that are left.
    steps: usize,
}

impl Motions<'_> {
    fn state(&self, further: &[f64]) -> Vec<f64> {
        self.course.state_of(further)
    }

    /// The motion from a state at `from` (s) to `end` (s) into `states`; whether it came there.
    fn go(&mut self, from: (f64, &[f64]), end: f64, states: &mut States) -> bool {
        let solver = SolverOptions {
            method: Method::Series,
            max_steps: Some(self.steps),
            ..SolverOptions::default()
        };
        let mut go_on = |_| ControlFlow::Continue(());
        let output = OutputOptions::at_the_ends(end);
        let ended = simulate_from(self.problem, Some(from), &solver, &output, states, &mut go_on);
        let steps = |report: &RunReport| report.work.iter().map(|work| work.steps as usize).sum::<usize>();
        let (taken, arrived) = match &ended {
            Ok(report) => (steps(report), true),
            Err(failure) => (steps(&failure.report), false),
        };
        self.steps = self.steps.saturating_sub(taken + STEPS_OF_START);
        arrived
    }

    /// The size of a deviation: twists count by the frequencies of their inertias, as speeds.
    fn size(&self, deviation: &[f64]) -> f64 {
        let parts = deviation.iter().zip(&self.weights);
        parts.map(|(part, weight)| (part * weight).powi(2)).sum::<f64>().sqrt()
    }

    /// A deviation that has a part in every direction.
    fn general(&self, dimension: usize) -> Vec<f64> {
        let part = |i: usize| (1.0 + 0.37 * (i as f64).sin()) / self.weights.get(i).copied().unwrap_or(f64::INFINITY);
        (0..dimension).map(part).collect()
    }

    /// By how many e-folds the deviation grows in each of the intervals between these states.
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
            let mut there = States::default();
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

/// The exponent of growth (e-folds) in intervals (s), after the first of them.
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

/// The largest exponent of the motion that goes on from the end of a run, whose sections are `section` (s) apart where it has some.
/// `None` where the run is too short for it, or something happens to the system soon after.
pub(super) fn exponent(system: &System, threshold: f64, end: &Section, section: Option<f64>) -> Option<Exponent> {
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
        problem: Problem {
            system,
            threshold,
            further: true,
            seat: None,
        },
        weights: deviation_weights(course.system()),
        course,
        steps: MOST_STEPS,
    };
    let state = motions.state(&end.further);
    let mut states = States {
        times: (1..=intervals).rev().map(there).collect(),
        ..States::default()
    };
    // Half of the steps are those of the neighbour.
    motions.steps = MOST_STEPS / 2;
    motions.go((end.time, &state), there(intervals), &mut states);
    motions.steps += MOST_STEPS / 2;
    // A motion begins in a closed contact.
    let closed = |one: &(f64, Mode, Vec<f64>)| one.1 != Mode::Separated;
    let states: Vec<_> = states.found.into_iter().filter(closed).collect();
    let grown = motions.growth(&states);
    (grown.len() >= INTERVALS.1).then(|| mean(&grown[grown.len() / TURNING..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseSource, Origin};

    /// The exponent of a mass on a belt that never comes to its speed, forced by two harmonics without a common period: that of the
    /// linear oscillator x'' + c x' + x = 0.
    fn of_linear_oscillator(damping: f64) -> Exponent {
        let harmonic = |omega: f64| format!("{{ profile = \"sine\", amplitude = 0.1, angular_frequency = {omega:?} }}");
        let text = format!(
            "motion = \"translation\"\nrotor = {{ end = \"driven\", speed = 5.0 }}\ncontact = {{ normal_force = 1.0 }}\n\
             friction = {{ law = \"coulomb\", breakaway = 0.3, kinetic = 0.3 }}\noutput = {{ end_time = 2000.0 }}\n[stator]\n\
             inertia = 1.0\nstiffness = 1.0\ndamping = {damping:?}\nend = \"fixed\"\n\
             torque = {{ profile = \"sum\", signals = [{}, {}] }}\n",
            harmonic(0.5),
            harmonic(0.5f64.sqrt())
        );
        let origin = Origin::File("case.toml".into());
        let case = Case::read(&CaseSource { text, origin }, &[]).unwrap();
        let end = Section {
            time: 2000.0,
            mode: Mode::SlipForward,
            sense: 1,
            further: vec![0.3, 0.1, 0.1],
        };
        exponent(&case.system, case.threshold, &end, None).unwrap()
    }

    #[test]
    fn analytic_a_damped_oscillator_has_half_its_damping_as_exponent() {
        let found = of_linear_oscillator(0.1);
        assert!((found.value + 0.05).abs() < 1e-4, "{found:?}");
        assert!(found.uncertainty < 1e-3, "{found:?}");
        assert_eq!(found.neighbours(), Neighbours::Meet);
    }

    #[test]
    fn analytic_a_motion_on_a_torus_has_no_exponent() {
        let found = of_linear_oscillator(0.0);
        assert!(found.value.abs() < 1e-4, "{found:?}");
        assert_eq!(found.neighbours(), Neighbours::Stay);
    }
}
