//! Radau steps.

use super::{PreviousStep, STAGES, STEP_NOISE, TaylorEngine, tableau};
use crate::Error;
use crate::hybrid::dynamics::{SystemDynamics, SystemLocation, Watched};
use crate::hybrid::{Advance, Fired};
use nalgebra::{DMatrixViewMut, SMatrix, SVector};
use std::sync::OnceLock;
use stickslip_system::friction::Law;
use stickslip_system::numerics::polynomial_roots::first_falling;
use stickslip_system::numerics::radau::{Attempt, Radau, StiffProblem};
use stickslip_system::numerics::taylor;

const NODES: usize = STAGES + 1;

/// Shortest Radau step, in natural periods: below this length an expansion is cheaper.
const SHORTEST_RADAU: f64 = 0.5;

pub(super) const FIRST_RADAU: f64 = 4.0;

/// Largest ratio of successive Radau steps over which the polynomial is extrapolated.
const LARGEST_GROWTH: f64 = 4.0;

struct Root {
    index: usize,
    tau: f64,
}

type CollocationCrossing = (f64, usize, [f64; NODES]);

/// Matrix from the values at the start and the stages to the coefficients of the polynomial.
fn interpolation() -> &'static SMatrix<f64, NODES, NODES> {
    static INTERPOLATION: OnceLock<SMatrix<f64, NODES, NODES>> = OnceLock::new();
    INTERPOLATION.get_or_init(|| {
        let node = |i: usize| if i == 0 { 0.0 } else { tableau().c[i - 1] };
        let vandermonde = SMatrix::<f64, NODES, NODES>::from_fn(|i, k| node(i).powi(k as i32));
        vandermonde.try_inverse().expect("the nodes differ")
    })
}

pub(in crate::simulation) struct SlipProblem<'a> {
    pub dynamics: &'a SystemDynamics,
    pub location: SystemLocation,
    pub origin: f64,
}

impl StiffProblem for SlipProblem<'_> {
    fn rhs(&self, t: f64, y: &[f64], rates: &mut [f64]) {
        self.dynamics.rhs(&self.location, self.origin + t, y, rates);
    }

    fn jacobian(&self, t: f64, y: &[f64], mut jacobian: DMatrixViewMut<'_, f64>) {
        let outside = self.dynamics.outside(&self.location, self.origin + t);
        let (system, location) = (&self.dynamics.system, &self.location);
        let contact_damping = system.contact_damping(location.sign(), location.piece, &outside, y);
        jacobian.copy_from(&system.sliding_matrix(contact_damping));
    }
}

impl TaylorEngine {
    pub(super) fn restart_collocation(&mut self) {
        self.next = FIRST_RADAU * self.period;
        self.predicted = false;
        self.accepted = (0.0, 0.0);
    }

    pub(super) fn collocation_step(&mut self) -> Result<Option<Advance>, Error> {
        let shortest = SHORTEST_RADAU * self.period;
        self.weigh();
        let dynamics = self.dynamics.clone();
        let slip = SlipProblem {
            dynamics: &dynamics,
            location: self.location,
            origin: self.origin,
        };
        loop {
            let left = self.span - self.tau;
            let bound = self.next.min(self.max_step);
            // Two equal steps are better than a long step and a remainder.
            let reaches = bound >= left;
            let length = if reaches {
                left
            } else if 2.0 * bound > left {
                left / 2.0
            } else {
                bound
            };
            if length < shortest && !reaches {
                return Ok(None);
            }
            let attempt = self
                .radau
                .attempt(&slip, self.tau, &self.y, length, &self.weights, self.predicted);
            let error = match attempt {
                Attempt::Solved { error } if error.is_finite() => error,
                _ => {
                    // The prediction over a step that is too long is useless at other points as well.
                    self.next = 0.4 * length;
                    continue;
                }
            };
            let root = |x: f64| x.powf(1.0 / f64::from(Radau::<STAGES>::ESTIMATE_ORDER));
            let factor = 0.9 / root(error);
            // The polynomial also predicts a shorter step from the same start.
            self.predicted = true;
            if error > 1.0 {
                self.counters.error_test_failures += 1;
                self.next = length * factor.max(0.1);
                continue;
            }
            // Gustafsson's predictive control: as sliding slows down, step ratios continue their trend.
            let (last_length, last_error) = std::mem::replace(&mut self.accepted, (length, error));
            let trend = if last_length > 0.0 {
                length / last_length * root(last_error / error)
            } else {
                1.0
            };
            self.next = length * (factor * trend.min(1.0)).min(LARGEST_GROWTH);
            self.next = self.next.min(self.time_of_change(length));
            self.counters.steps += 1;
            self.counters.last_order = 2 * STAGES as u32 - 1;
            let end = if reaches { self.span } else { self.tau + length };
            let fired = self.root_of_collocation(&slip);
            self.first = false;
            self.last = PreviousStep::Collocation;
            self.counters.last_step = self.radau.step.length;
            return Ok(Some(match fired {
                Some(Root { index, tau }) => {
                    self.tau = tau;
                    self.y.copy_from_slice(&self.stage);
                    Advance::Guards(Fired::one(index))
                }
                None => {
                    self.tau = end;
                    self.radau.stage(STAGES - 1, &mut self.y);
                    if reaches { Advance::Stop } else { Advance::Stepped }
                }
            }));
        }
    }

    fn sliding_speed(&self, tau: f64, y: &[f64]) -> f64 {
        let outside = self.dynamics.outside(&self.location, self.origin + tau);
        self.dynamics.system.relative_velocity(&outside, y).abs()
    }

    /// Time (s) in which the speed, at its rate in the last Radau step, changes by half the lesser speed or by four
    /// times the e-fold scale of the friction law's slope, whichever is more. Longer steps would be rejected.
    fn time_of_change(&mut self, length: f64) -> f64 {
        let start = self.sliding_speed(self.tau, &self.y);
        self.radau.stage(STAGES - 1, &mut self.stage);
        let end = self.sliding_speed(self.tau + length, &self.stage);
        let lesser = start.min(end);
        let change = (0.5 * lesser).max(4.0 / self.dynamics.system.law.steepness_rate(lesser));
        length * change / (start - end).abs()
    }

    /// The guard that fires first in the last Radau step; afterwards `stage` is the state at its root.
    ///
    /// Newton's method on the guard repeats the step up to each iterate, because the end of a step is more accurate
    /// than its interior. Within a few periods of an unstable fast mode R(z) has poles, and a shortened step may be
    /// worse than the polynomial of the whole step: if they disagree, the polynomial counts.
    fn root_of_collocation(&mut self, slip: &SlipProblem<'_>) -> Option<Root> {
        self.whole.copy_from(&self.radau.step);
        let (start, length) = (self.tau, self.whole.length);
        let (share, index, polynomial) = self.earliest_in_collocation(start, length)?;
        let watched = self.dynamics.watched(&self.location)[index];
        let mechanical = self.dynamics.system.mechanical();
        let mut root = share * length;
        let mut again = true;
        self.stage.copy_from_slice(&self.y);
        for _ in 0..8 {
            if root <= f64::EPSILON * (start + length) {
                self.stage.copy_from_slice(&self.y);
                return Some(Root { index, tau: start });
            }
            self.whole.at_share(root / length, &mut self.stage);
            if again {
                let attempt = self.radau.attempt(slip, start, &self.y, root, &self.weights, true);
                self.radau.stage(STAGES - 1, &mut self.end);
                let mut pairs = self.end.iter().zip(&self.stage).zip(&self.weights).take(mechanical);
                again = attempt != Attempt::NotConverged
                    && pairs.all(|((end, whole), weight)| (end - whole).abs() <= STEP_NOISE * weight);
                if again {
                    self.stage.copy_from_slice(&self.end);
                } else {
                    self.radau.step.copy_from(&self.whole);
                }
            }
            let value = self.guard_at(watched, start + root, &self.stage);
            let (_, slope) = taylor::value_and_rate(&polynomial, root / length);
            let next = root - value * length / slope;
            if !(next > 0.0 && next <= length) || (next - root).abs() <= 2.0 * f64::EPSILON * (start + root) {
                break;
            }
            root = next;
        }
        Some(Root {
            index,
            tau: start + root,
        })
    }

    /// A guard of a slip, with the sign with which it falls when it fires.
    fn guard_at(&self, watched: Watched, tau: f64, y: &[f64]) -> f64 {
        let (location, t) = (&self.location, self.origin + tau);
        let outside = self.dynamics.outside(location, t);
        watched.sign() * self.dynamics.watched_value(watched, location, &outside, y)
    }

    fn earliest_in_collocation(&mut self, start: f64, length: f64) -> Option<CollocationCrossing> {
        let mut earliest: Option<CollocationCrossing> = None;
        let dynamics = self.dynamics.clone();
        for (index, &watched) in dynamics.watched(&self.location).iter().enumerate() {
            self.counters.root_evaluations += NODES as u64;
            let mut values = SVector::<f64, NODES>::zeros();
            values[0] = self.guard_at(watched, start, &self.y);
            for i in 0..STAGES {
                self.radau.stage(i, &mut self.stage);
                values[i + 1] = self.guard_at(watched, start + self.radau.node(i) * length, &self.stage);
            }
            let mut polynomial: [f64; NODES] = (interpolation() * values).into();
            if self.first && polynomial[0].abs() <= self.noise(watched) {
                polynomial[0] = 0.0;
            }
            let share = if polynomial[0] < 0.0 {
                Some(0.0)
            } else {
                first_falling(&polynomial)
            };
            if let Some(share) = share
                && earliest.is_none_or(|(before, ..)| share < before)
            {
                earliest = Some((share, index, polynomial));
            }
        }
        earliest
    }
}
