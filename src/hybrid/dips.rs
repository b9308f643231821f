//! Guards that leave their allowed side and come back within one step, which the signs at its ends do not show.
//!
//! A guard has a dip in a step if it approaches its boundary at the step's beginning and withdraws from it at the end.
//! The two tangents bound from below what a convex guard can fall to; where they reach the boundary, the dip is looked
//! at on the states inside the step.

use super::last_step::LastStep;
use super::{ChosenSolver, Direction, Dynamics, SolverKind};
use crate::sundials::{Multistep, SolverError};

/// Of a step, how far ahead a guard is looked at for its rate: far below any time scale of a resolved solution, far
/// above rounding.
const AHEAD: f64 = 1e-6;

/// Where between step and tangent a dip is given up: a guard that is not convex over the whole step falls below its
/// tangents by less than this share of what they fall by.
const CONVEXITY: f64 = 0.25;

/// A guard that comes as near to its boundary as this multiple of the solver's relative tolerance, as a share of its largest
/// value in the segment, may have reached it: the errors of some hundred steps add up.
const NEAR: f64 = 100.0;

/// The same of BDF, whose steps err alike, and by more.
const NEAR_BY_BDF: f64 = 1e4;

/// Halvings of an interval that end at neighbouring numbers.
const MOST_HALVINGS: usize = 100;

/// Guards, positive on the allowed side, and their rates along the flow.
#[derive(Debug, Clone, Default)]
struct Readings {
    time: f64,
    values: Vec<f64>,
    rates: Vec<f64>,
}

/// Follows the guards of a segment from step to step.
pub(super) struct Dips {
    /// +1 or -1 so that the allowed side is positive; 0 for a guard that has none.
    signs: Vec<f64>,
    before: Readings,
    after: Readings,
    inside: Readings,
    /// The largest values in the segment.
    largest: Vec<f64>,
    /// Of these, the share that is as good as the boundary.
    near: f64,
    /// The last dip that came so near, and turned: when and of which guard.
    grazed: Option<Dip>,
    slope: Vec<f64>,
    moved: Vec<f64>,
    state: Vec<f64>,
}

/// The segment that is looked at: its equations, where it is, and when it starts (s).
pub(super) struct Of<'a, D: Dynamics> {
    pub(super) dynamics: &'a D,
    pub(super) location: &'a D::Location,
    pub(super) origin: f64,
}

/// A dip that reaches the other side, or comes as near as a solver can tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dip {
    pub(super) guard: usize,
    /// When it is there, on the segment's clock (s).
    pub(super) time: f64,
}

impl Dips {
    /// Of a segment at `location`, by a solver as `chosen`.
    pub(super) fn new<D: Dynamics>(dynamics: &D, location: &D::Location, chosen: &ChosenSolver) -> Self {
        let sign = |direction| match direction {
            Direction::Falling => 1.0,
            Direction::Rising => -1.0,
            Direction::Either => 0.0,
        };
        let guards = dynamics.guards(location);
        let readings = || Readings {
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

    /// Looks at the step from `last_step` to `tau`, where the state is `y`. The first dip that reaches the other side, if
    /// there is one.
    pub(super) fn in_step<D: Dynamics>(
        &mut self,
        of: &Of<'_, D>,
        last_step: &mut LastStep<D>,
        (tau, y): (f64, &[f64]),
    ) -> Result<Option<Dip>, SolverError> {
        if self.signs.iter().all(|sign| *sign == 0.0) {
            return Ok(None);
        }
        std::mem::swap(&mut self.before, &mut self.after);
        let first = last_step.start == 0.0;
        let length = tau - last_step.start;
        if first {
            // A guard may stand on its boundary where a segment begins, and leaves it then.
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

    /// The largest value of a guard so far.
    pub(super) fn largest(&self, guard: usize) -> f64 {
        self.largest[guard]
    }

    /// A dip since the last call that came so near to the boundary that it may have reached it.
    pub(super) fn grazed(&mut self) -> Option<Dip> {
        self.grazed.take()
    }

    fn read<D: Dynamics>(&mut self, of: &Of<'_, D>, (tau, y): (f64, &[f64]), length: f64, into: &mut Readings) {
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

    /// A time within the step at which the guard is beyond its boundary, if it has one.
    fn other_side<D: Dynamics>(
        &mut self,
        of: &Of<'_, D>,
        last_step: &mut LastStep<D>,
        guard: usize,
    ) -> Result<Option<f64>, SolverError> {
        let end = |readings: &Readings| (readings.time, readings.values[guard], readings.rates[guard]);
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
            // Where the rate, taken as linear, is zero; the middle where that would hardly shorten the interval.
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

    /// When the guard gets from its allowed side at the beginning of the step to the other, where it is at `beyond`.
    fn crossing<D: Dynamics>(
        &mut self,
        of: &Of<'_, D>,
        last_step: &mut LastStep<D>,
        guard: usize,
        beyond: f64,
    ) -> Result<f64, SolverError> {
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
/// withdraws, and its tangents, and what it may fall below them, get there.
fn may_reach_zero(before: (f64, f64), after: (f64, f64), length: f64) -> bool {
    if !(before.0 > 0.0 && after.0 > 0.0 && before.1 < 0.0 && after.1 > 0.0) {
        return false;
    }
    // Where the tangents meet.
    let tau = (after.0 - before.0 - after.1 * length) / (before.1 - after.1);
    let bound = before.0 + before.1 * tau;
    bound <= CONVEXITY * (before.0.max(after.0) - bound)
}

#[cfg(test)]
mod tests {
    use super::may_reach_zero;

    /// The parabola t^2 - 1 + c over -1.1 to 1.2: its tangents see every dip, and let go of what is far above zero.
    #[test]
    fn analytic_tangents_see_every_dip() {
        let ends = |c: f64| ((1.21 - 1.0 + c, -2.2), (1.44 - 1.0 + c, 2.4));
        for c in [0.0, 0.5, 0.9, 0.999, 1.0] {
            let (before, after) = ends(c);
            assert!(may_reach_zero(before, after, 2.3), "{c}");
        }
        let (before, after) = ends(4.0);
        assert!(!may_reach_zero(before, after, 2.3));
    }
}
