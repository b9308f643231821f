//! Dips: guards that cross their boundary and come back within one step, so that the signs at its ends show nothing.
//!
//! A dip is possible if a guard approaches its boundary at the step's beginning and withdraws at its end. The two
//! tangents are a lower bound of a convex guard; if they reach the boundary, states inside the step are examined.

use super::last_step::LastStep;
use super::{ChosenSolver, Direction, SolverKind, SystemDynamics, SystemLocation};
use crate::Error;
use crate::sundials::Multistep;

/// Share of a step over which a guard's rate is a difference: far below any resolved time scale, far above rounding.
const AHEAD: f64 = 1e-6;

/// Allowance for a guard that is not convex over the whole step: it falls below its tangents by less than this share
/// of its fall from the larger end value to the tangents' intersection.
const CONVEXITY: f64 = 0.25;

/// A guard within this multiple of the relative tolerance (times its largest value in the segment) may have reached
/// its boundary, because the errors of some hundred steps add up.
const NEAR: f64 = 100.0;

/// [`NEAR`] for BDF, whose errors are larger and have the same sign from step to step.
const NEAR_BY_BDF: f64 = 1e4;

const MOST_HALVINGS: usize = 100;

/// Guards, positive on the allowed side, and their rates along the flow.
#[derive(Debug, Clone, Default)]
struct DipReadings {
    time: f64,
    values: Vec<f64>,
    rates: Vec<f64>,
}

pub(super) struct Dips {
    /// +1 or -1, which makes the allowed side positive; 0 for a guard that fires in both directions.
    signs: Vec<f64>,
    before: DipReadings,
    after: DipReadings,
    inside: DipReadings,
    largest: Vec<f64>,
    /// Share of `largest` within which a value cannot be distinguished from the boundary.
    near: f64,
    grazed: Option<Dip>,
    slope: Vec<f64>,
    moved: Vec<f64>,
    state: Vec<f64>,
}

pub(super) struct Of<'a> {
    pub(super) dynamics: &'a SystemDynamics,
    pub(super) location: &'a SystemLocation,
    pub(super) origin: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dip {
    pub(super) guard: usize,
    /// On the segment's clock, s.
    pub(super) time: f64,
}

impl Dips {
    pub(super) fn new(dynamics: &SystemDynamics, location: &SystemLocation, chosen: &ChosenSolver) -> Self {
        let sign = |direction| match direction {
            Direction::Falling => 1.0,
            Direction::Rising => -1.0,
            Direction::Either => 0.0,
        };
        let guards = dynamics.guards(location);
        let readings = || DipReadings {
            time: 0.0,
            values: vec![0.0; guards.len()],
            rates: vec![0.0; guards.len()],
        };
        let state = || vec![0.0; dynamics.dimension()];
        Dips {
            signs: guards.iter().map(|guard| sign(guard.direction)).collect(),
            largest: vec![0.0; guards.len()],
            near: chosen.tolerances.relative
                * match chosen.kind {
                    SolverKind::Cvode { options, .. } if options.method == Multistep::Bdf => NEAR_BY_BDF,
                    _ => NEAR,
                },
            grazed: None,
            before: readings(),
            after: readings(),
            inside: readings(),
            slope: state(),
            moved: state(),
            state: state(),
        }
    }

    pub(super) fn in_step(
        &mut self,
        of: &Of<'_>,
        last_step: &mut LastStep,
        (tau, y): (f64, &[f64]),
    ) -> Result<Option<Dip>, Error> {
        if self.signs.iter().all(|sign| *sign == 0.0) {
            return Ok(None);
        }
        std::mem::swap(&mut self.before, &mut self.after);
        let first = last_step.start == 0.0;
        let length = tau - last_step.start;
        if first {
            // At the segment's start a guard may be on its boundary, which it then leaves.
            let mut before = std::mem::take(&mut self.before);
            self.read(of, (0.0, &last_step.start_state), length, &mut before);
            self.before = before;
        }
        let mut after = std::mem::take(&mut self.after);
        self.read(of, (tau, y), length, &mut after);
        self.after = after;
        let mut earliest: Option<Dip> = None;
        for guard in 0..self.signs.len() {
            let (a, b) = (
                (self.before.values[guard], self.before.rates[guard]),
                (self.after.values[guard], self.after.rates[guard]),
            );
            self.largest[guard] = self.largest[guard].max(a.0).max(b.0);
            if self.signs[guard] == 0.0 || (first && a.0 <= b.0 * AHEAD) || !may_reach_zero(a, b, length) {
                continue;
            }
            if let Some(beyond) = self.other_side(of, last_step, guard)? {
                let time = self.crossing(of, last_step, guard, beyond)?;
                if earliest.is_none_or(|dip| time < dip.time) {
                    earliest = Some(Dip { guard, time });
                }
            }
        }
        Ok(earliest)
    }

    pub(super) fn largest(&self, guard: usize) -> f64 {
        self.largest[guard]
    }

    pub(super) fn grazed(&mut self) -> Option<Dip> {
        self.grazed.take()
    }

    fn read(&mut self, of: &Of<'_>, (tau, y): (f64, &[f64]), length: f64, into: &mut DipReadings) {
        let Of {
            dynamics,
            location,
            origin,
        } = *of;
        let (t, ahead) = (origin + tau, AHEAD * length);
        into.time = tau;
        dynamics.rhs(location, t, y, &mut self.slope);
        for (moved, (y, slope)) in self.moved.iter_mut().zip(y.iter().zip(&self.slope)) {
            *moved = y + ahead * slope;
        }
        dynamics.guard_values(location, t, y, &mut into.values);
        dynamics.guard_values(location, t + ahead, &self.moved, &mut into.rates);
        for ((value, rate), sign) in into.values.iter_mut().zip(&mut into.rates).zip(&self.signs) {
            *rate = sign * (*rate - *value) / ahead;
            *value *= sign;
        }
    }

    fn other_side(&mut self, of: &Of<'_>, last_step: &mut LastStep, guard: usize) -> Result<Option<f64>, Error> {
        let end = |readings: &DipReadings| (readings.time, readings.values[guard], readings.rates[guard]);
        let (mut a, mut b) = (end(&self.before), end(&self.after));
        for _ in 0..MOST_HALVINGS {
            let length = b.0 - a.0;
            if !may_reach_zero((a.1, a.2), (b.1, b.2), length) {
                let (time, least) = if a.1 < b.1 { (a.0, a.1) } else { (b.0, b.1) };
                if least <= self.near * self.largest[guard] {
                    self.grazed = Some(Dip { guard, time });
                }
                return Ok(None);
            }
            // Zero of the rate, taken as linear; kept away from the ends so that the interval shrinks.
            let share = (a.2 / (a.2 - b.2)).clamp(0.1, 0.9);
            let tau = a.0 + share * length;
            if !(a.0 < tau && tau < b.0) {
                self.grazed = Some(Dip { guard, time: a.0 });
                return Ok(None);
            }
            let mut state = std::mem::take(&mut self.state);
            last_step.state_at(tau, &mut state)?;
            let mut inside = std::mem::take(&mut self.inside);
            self.read(of, (tau, &state), length, &mut inside);
            let middle = end(&inside);
            (self.state, self.inside) = (state, inside);
            if middle.1 < 0.0 {
                return Ok(Some(tau));
            }
            if middle.2 < 0.0 {
                a = middle;
            } else {
                b = middle;
            }
        }
        Ok(None)
    }

    fn crossing(&mut self, of: &Of<'_>, last_step: &mut LastStep, guard: usize, beyond: f64) -> Result<f64, Error> {
        let (mut low, mut high) = (self.before.time, beyond);
        for _ in 0..MOST_HALVINGS {
            let middle = f64::midpoint(low, high);
            if !(low < middle && middle < high) {
                break;
            }
            last_step.state_at(middle, &mut self.state)?;
            of.dynamics
                .guard_values(of.location, of.origin + middle, &self.state, &mut self.inside.values);
            if self.signs[guard] * self.inside.values[guard] < 0.0 {
                high = middle;
            } else {
                low = middle;
            }
        }
        Ok(high)
    }
}

/// Whether a guard with these values and rates at the ends of an interval can reach zero inside: it approaches and
/// withdraws, and its tangents (with an allowance for non-convexity) reach zero.
pub fn may_reach_zero(before: (f64, f64), after: (f64, f64), length: f64) -> bool {
    if !(before.0 > 0.0 && after.0 > 0.0 && before.1 < 0.0 && after.1 > 0.0) {
        return false;
    }
    let tau = (after.0 - before.0 - after.1 * length) / (before.1 - after.1);
    let bound = before.0 + before.1 * tau;
    bound <= CONVEXITY * (before.0.max(after.0) - bound)
}
