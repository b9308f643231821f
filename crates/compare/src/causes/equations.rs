//! Parameters with which the equations of the case, integrated over the candidate's own samples between its events, lead
//! from sample to sample. They are proposals, and need no run.

use super::fit::{Fit, FitPoint, Unknown, closest, square};
use super::motion::Played;
use super::number::ChangedNumber;
use super::observation::Observation;
use super::parameters::of_normal_force;
use super::search::Search;
use crate::reference::Physics;
use nalgebra::{DMatrix, DVector};
use stickslip_engine::simulation::Excitation;
use stickslip_system::model::Mode;
use stickslip_system::model::equations::{Outside, SystemEquations};
use stickslip_system::model::system::{System, Train};

/// Samples of a stretch: the quadrature through five errs by at most 8/945 (omega h)^7.
pub const POINTS: usize = 5;
/// Fewest samples in a natural period: five then integrate an oscillation to 1e-6 of itself.
const PER_PERIOD: f64 = 20.0;
const MOST_STRETCHES: usize = 1024;
const FEWEST_STRETCHES: usize = 10;
/// An equation holds if its root mean square residual is below this part of its terms, which covers quadrature and
/// rounding, or below this part of the change by a quadrature through fewer samples.
const MISSED: f64 = 1e-7;
const QUADRATURE: f64 = 0.01;
/// Difference of the quadratures, as a part of the largest change, from which the samples do not resolve the motion.
const UNRESOLVED: f64 = 0.03;
/// Largest remaining part of the root mean square residual for a parameter that explains it.
const LEFT: f64 = 0.05;
/// Two parameters explain equally if their remaining squares differ by less than this factor. Below the floor, a part
/// of the terms, they cannot be distinguished.
const AS_MUCH: f64 = 2.0;
const FLOOR: f64 = 3e-9;
/// Smallest change of a known parameter, in standard deviations.
const KNOWN: f64 = 20.0;

/// Samples of a candidate in one mode, in which the equations are smooth.
struct Stretch {
    first: usize,
    mode: Mode,
    /// Weights of the integral by all samples, and by the first, the middle and the last, s.
    weights: [[f64; POINTS]; 2],
}

/// The stretches of a candidate that shows the whole state.
struct Stretches<'a> {
    physics: &'a Physics,
    time: &'a [f64],
    /// State, and actions of the unchanged case, in each sample.
    states: Vec<Vec<f64>>,
    outside: Vec<Outside>,
    each: Vec<Stretch>,
}

/// Weights of the integral from the first to the last sample by the polynomial through the samples `of`; 0 for the
/// others.
pub fn weights(time: &[f64; POINTS], of: &[usize]) -> Option<[f64; POINTS]> {
    let (from, width) = (time[0], time[POINTS - 1] - time[0]);
    let part = |point: usize| (time[point] - from) / width;
    let powers = DMatrix::from_fn(of.len(), of.len(), |row, column| part(of[column]).powi(row as i32));
    let integrals = DVector::from_fn(of.len(), |row, _| 1.0 / (row + 1) as f64);
    let solved = powers.lu().solve(&integrals)?;
    let mut weights = [0.0; POINTS];
    for (&point, weight) in of.iter().zip(solved.iter()) {
        weights[point] = width * weight;
    }
    Some(weights)
}

fn acts_alike(a: &System, b: &System) -> bool {
    let alike = |a: &Train, b: &Train| a.end == b.end && a.torque == b.torque;
    a.pressing == b.pressing && alike(&a.rotor, &b.rotor) && alike(&a.stator, &b.stator)
}

impl<'a> Stretches<'a> {
    fn of(search: &Search<'a>) -> Option<Stretches<'a>> {
        let (physics, seen) = (search.evidence.physics, search.evidence.observation?);
        let columns = physics.columns(&seen.channels)?;
        let time = &seen.time[..];
        let state = |row: usize| physics.y(|k| seen.values[columns[k]][row]);
        let states: Vec<Vec<f64>> = (0..time.len()).map(state).collect();
        let outside: Vec<Outside> = time.iter().map(|time| physics.course.outside(*time)).collect();
        let others = search.reference.events.iter().filter(|e| !e.kind.in_event_sequence());
        let mut breaks: Vec<f64> = others.map(|e| e.time).collect();
        breaks.extend(search.shown.found.iter().map(|found| found.time));
        breaks.sort_by(f64::total_cmp);
        let system = physics.system();
        let velocity = |row: usize| system.relative_velocity(&outside[row], &states[row]);
        let (mut each, mut first) = (Vec::new(), 0);
        while first + POINTS <= time.len() {
            let time: [f64; POINTS] = std::array::from_fn(|k| time[first + k]);
            let speeds: [f64; POINTS] = std::array::from_fn(|k| velocity(first + k));
            let mode = physics.mode(speeds[0], search.shown.tolerance);
            let is_in_mode = |w: &f64| {
                physics.mode(*w, search.shown.tolerance) == mode && (mode == Mode::Stick || w * speeds[0] > 0.0)
            };
            let is_dense = time
                .windows(2)
                .all(|two| two[1] - two[0] <= physics.natural_period() / PER_PERIOD);
            let margin = time[1] - time[0];
            let next = breaks.partition_point(|at| *at < time[0] - margin);
            let is_whole = breaks.get(next).is_none_or(|at| *at > time[POINTS - 1] + margin);
            let is_closed = outside[first..first + POINTS]
                .iter()
                .all(|outside| outside.normal_force > 0.0);
            if is_dense && is_whole && is_closed && speeds.iter().all(is_in_mode) {
                let weights = [weights(&time, &[0, 1, 2, 3, 4])?, weights(&time, &[0, 2, 4])?];
                each.push(Stretch { first, mode, weights });
                first += POINTS - 1;
            } else {
                first += 1;
            }
        }
        let every = each.len().div_ceil(MOST_STRETCHES).max(1);
        Some(Stretches {
            each: each.into_iter().step_by(every).collect(),
            physics,
            time,
            states,
            outside,
        })
    }

    /// Changes of the states over the stretches by the candidate.
    fn changes(&self) -> Vec<Vec<f64>> {
        let change = |place: usize, first: usize| self.states[first + POINTS - 1][place] - self.states[first][place];
        let of_state = |&place: &usize| self.each.iter().map(|stretch| change(place, stretch.first)).collect();
        self.physics.places.iter().map(of_state).collect()
    }

    /// Leaves out stretches in which the samples do not resolve a motion, such as that of bristles at a breakaway: there
    /// the quadratures differ.
    fn keep_resolved(&mut self, own: &System) {
        let [fine, coarse] = [0, 1].map(|number| self.integrals(own, number).values);
        let mut resolved = vec![true; self.each.len()];
        for ((fine, coarse), changes) in fine.iter().zip(&coarse).zip(self.changes()) {
            let largest = changes.iter().fold(0.0f64, |largest, change| largest.max(change.abs()));
            for (resolved, (fine, coarse)) in resolved.iter_mut().zip(fine.iter().zip(coarse)) {
                *resolved &= (fine - coarse).abs() <= UNRESOLVED * largest;
            }
        }
        let mut resolved = resolved.into_iter();
        self.each.retain(|_| resolved.next() != Some(false));
    }

    /// Changes of the states by the equations of a system, with weights of this number.
    fn integrals(&self, system: &System, number: usize) -> Played {
        let equations = SystemEquations::new(system);
        let excitation = (!acts_alike(system, &self.physics.trains)).then(|| Excitation::new(system));
        let mut rates = vec![0.0; equations.dimension];
        let mut values = vec![vec![0.0; self.each.len()]; self.physics.places.len()];
        for (at, Stretch { first, mode, weights }) in self.each.iter().enumerate() {
            for (row, weight) in (*first..).zip(weights[number]).filter(|(_, weight)| *weight != 0.0) {
                let (time, y) = (self.time[row], &self.states[row]);
                let other = excitation.as_ref().map(|of| of.at(of.stretch(time), time));
                let mut outside = other.unwrap_or(self.outside[row]);
                outside.normal_force = outside.normal_force.max(0.0);
                let w = equations.relative_velocity(&outside, y);
                let sense = if mode.slides() { w.signum() } else { 0.0 };
                equations.rates(*mode, sense, equations.piece_of(w), &outside, y, &mut rates);
                for (column, &place) in values.iter_mut().zip(&self.physics.places) {
                    column[at] += weight * rates[place];
                }
            }
        }
        Played {
            values,
            ..Played::default()
        }
    }
}

/// Parameters, one or two at once, with which the equations of the case hold for the candidate's samples, and others
/// that do as well. There are none if the equations hold as they are, or if the samples do not show them.
pub(super) fn fitted(search: &Search<'_>) -> Vec<ChangedNumber> {
    let case = search.evidence.case;
    let own = &case.case().system;
    let Some(mut stretches) = Stretches::of(search) else {
        return Vec::new();
    };
    stretches.keep_resolved(own);
    if stretches.each.len() < FEWEST_STRETCHES {
        return Vec::new();
    }
    let [fine, coarse] = [0, 1].map(|number| stretches.integrals(own, number));
    let changes = stretches.changes();
    let count = stretches.each.len();
    let rms = |a: &[f64], b: &[f64]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        (squares.sum::<f64>() / count as f64).sqrt()
    };
    let sizes: Vec<f64> = changes
        .iter()
        .map(|changes| rms(changes, &vec![0.0; count]).max(f64::MIN_POSITIVE))
        .collect();
    let holds = |k: usize| {
        let [missed, uncertain] = [&changes[k], &coarse.values[k]].map(|other| rms(&fine.values[k], other) / sizes[k]);
        missed <= MISSED.max(QUADRATURE * uncertain)
    };
    if (0..sizes.len()).all(holds) {
        return Vec::new();
    }
    let end = |stretch: &Stretch| stretches.time[stretch.first + POINTS - 1];
    let observed = Observation {
        channels: stretches.physics.state.clone(),
        time: stretches.each.iter().map(end).collect(),
        reference: vec![vec![f64::NAN; count]; sizes.len()],
        values: changes,
        sizes,
        ..Observation::default()
    };
    let evidence = &search.evidence.observed_as(Some(&observed));
    let mut unknown = evidence.unknown();
    unknown.retain(Unknown::is_alone);
    let play = |number: usize| {
        let stretches = &stretches;
        move |numbers: &[(String, f64)], _| Some(stretches.integrals(&case.moved_all(numbers)?.0, number))
    };
    let left = |point: &FitPoint| square(&evidence.residual(&point.played, point.window));
    let total = square(&evidence.residual(&fine, count));
    let floor = FLOOR * FLOOR * (count * observed.channels.len()) as f64;
    let as_much = |one: f64, best: f64| one + floor <= AS_MUCH * (best + floor);
    // The values with their errors, if they explain the residual. The quadrature through fewer samples bounds the error.
    let explained = |(which, point): &(Vec<usize>, FitPoint)| -> Option<ChangedNumber> {
        let units: Vec<f64> = which.iter().map(|&k| unknown[k].unit).collect();
        let [fine, coarse] = [0, 1].map(|number| {
            let (play, unknown) = (play(number), &unknown);
            move |values: &[f64], until| play(&Unknown::changes_of(unknown, which, values), until)
        });
        let fit = Fit {
            evidence,
            play: &fine,
            units: &units,
        };
        let scatter = fit.errors(point)?;
        let fit = Fit { play: &coarse, ..fit };
        let other = fit.refined(point.values.clone());
        let mut errors = Vec::new();
        for (k, value) in point.values.iter().enumerate() {
            if (value - unknown[which[k]].value).abs() <= KNOWN / 3.0 * scatter[k] {
                return None;
            }
            let quadrature = other.as_ref().map_or(0.0, |other| (other.values[k] - value).abs());
            errors.push(scatter[k].max(0.1 * quadrature));
        }
        let numbers = Unknown::changes_of(&unknown, which, &point.values);
        (left(point) <= LEFT * LEFT * total).then(|| ChangedNumber::told(numbers, errors))
    };
    for pairs in [false, true] {
        let mut found = closest(evidence, &play(0), &fine, &unknown, pairs, &[]);
        found.sort_by(|a, b| left(&a.1).total_cmp(&left(&b.1)));
        let Some(best) = found.first().map(|best| left(&best.1)) else {
            continue;
        };
        found.retain(|other| as_much(left(&other.1), best));
        // Among parameters that explain as much, the force comes last.
        found.sort_by_key(|(which, _)| of_normal_force(&unknown[which[0]].path));
        let all: Vec<ChangedNumber> = found.iter().filter_map(explained).collect();
        // If two pairs explain as much, neither is shown.
        if !all.is_empty() && (!pairs || found.len() == 1) {
            return all;
        }
    }
    Vec::new()
}
