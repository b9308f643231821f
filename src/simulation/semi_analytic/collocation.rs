//! Radau steps.

use super::super::brake::Brake;
use super::{Last, STAGES, STEP_NOISE, SemiAnalyticEngine, tableau};
use crate::friction::Law;
use crate::hybrid::{Advance, EngineError, Fired};
use crate::model::Mode;
use crate::model::state::{DIMENSION, DYNAMIC, TorsionState, state_of};
use crate::model::torsion::TorsionModel;
use crate::numerics::polynomial_roots::first_falling;
use crate::numerics::radau::{Attempt, Radau, StiffProblem};
use crate::numerics::taylor;
use nalgebra::{DMatrixViewMut, SMatrix, SVector};
use std::sync::OnceLock;

/// Values of a guard on a Radau step: at its start and its stages.
const NODES: usize = STAGES + 1;

/// Shortest Radau step, in natural periods: below it an expansion is cheaper.
const SHORTEST_RADAU: f64 = 0.5;

/// Largest growth from one Radau step to the next. Its polynomial is extrapolated over the next step.
const LARGEST_GROWTH: f64 = 4.0;

/// Where a guard fires.
struct Root {
    index: usize,
    tau: f64,
    y: TorsionState,
}

/// From values at the start and the stages to the coefficients of the polynomial through them.
fn interpolation() -> &'static SMatrix<f64, NODES, NODES> {
    static INTERPOLATION: OnceLock<SMatrix<f64, NODES, NODES>> = OnceLock::new();
    INTERPOLATION.get_or_init(|| {
        let node = |i: usize| if i == 0 { 0.0 } else { tableau().c[i - 1] };
        let vandermonde = SMatrix::<f64, NODES, NODES>::from_fn(|i, k| node(i).powi(k as i32));
        vandermonde.try_inverse().expect("the nodes differ")
    })
}

/// A slip on a segment's clock.
struct Slip<'a> {
    brake: &'a Brake,
    torsion: &'a TorsionModel,
    mode: Mode,
    origin: f64,
}

impl StiffProblem for Slip<'_> {
    fn rhs(&self, t: f64, y: &[f64], rates: &mut [f64]) {
        let force = || self.brake.axial.pressing_force(self.origin + t);
        self.torsion.rates(self.mode, force, y, rates);
    }

    fn jacobian(&self, t: f64, y: &[f64], mut jacobian: DMatrixViewMut<'_, f64>) {
        let force = || self.brake.axial.pressing_force(self.origin + t);
        jacobian.copy_from(&self.torsion.dynamic_jacobian(self.mode, force, &state_of(y)));
    }
}

impl SemiAnalyticEngine {
    /// A Radau step; `None` where an expansion would be cheaper.
    pub(super) fn collocation_step(&mut self) -> Result<Option<Advance>, EngineError> {
        let shortest = SHORTEST_RADAU * self.brake.torsion.natural_period();
        let weights = self.weights();
        let brake = self.brake.clone();
        let slip = Slip {
            brake: &brake,
            torsion: brake.torsion_in(&self.location),
            mode: self.location.mode,
            origin: self.origin,
        };
        loop {
            let left = self.span - self.tau;
            let bound = self.next.min(self.max_step);
            // Rather two equal steps than a long one and a scrap.
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
                .attempt(&slip, self.tau, &self.y, length, &weights, self.predicted);
            let error = match attempt {
                Attempt::Solved { error } if error.is_finite() => error,
                _ => {
                    // Shorter at once: what was predicted over a step too long is of no use from anywhere else either.
                    self.next = 0.4 * length;
                    continue;
                }
            };
            let order = Radau::<STAGES>::ESTIMATE_ORDER;
            let root = |x: f64| x.powf(1.0 / f64::from(order));
            let factor = 0.9 / root(error);
            // Its polynomial serves a shorter step from the same start, too.
            self.predicted = true;
            if error > 1.0 {
                self.counters.error_test_failures += 1;
                self.next = length * factor.max(0.1);
                continue;
            }
            // Gustafsson's predictive control: as the rotor slows, the next step is to this one what this one is to the
            // last.
            let (last_length, last_error) = std::mem::replace(&mut self.accepted, (length, error));
            let trend = if last_length > 0.0 {
                length / last_length * root(last_error / error)
            } else {
                1.0
            };
            self.next = length * (factor * trend.min(1.0)).min(LARGEST_GROWTH);
            self.next = self.next.min(self.time_to_slow(length));
            self.counters.steps += 1;
            self.counters.last_order = 2 * STAGES as u32 - 1;
            let end = if reaches { self.span } else { self.tau + length };
            let fired = self.root_of_collocation(&slip, &weights);
            self.first = false;
            self.last = Last::Collocation;
            self.counters.last_step = self.radau.step().length;
            return Ok(Some(match fired {
                Some(Root { index, tau, y }) => {
                    (self.tau, self.y) = (tau, y);
                    Advance::Guards(Fired::one(index))
                }
                None => {
                    (self.tau, self.y) = (end, self.stage(STAGES - 1));
                    if reaches { Advance::Stop } else { Advance::Stepped }
                }
            }));
        }
    }

    /// The state at a stage of the Radau step just solved.
    fn stage(&self, i: usize) -> TorsionState {
        let mut y = [0.0; DIMENSION];
        self.radau.stage(i, &mut y);
        y
    }

    /// How long the speed takes, at the rate of the Radau step just solved, to fall by a half or by four times what the
    /// friction law's slope takes to change e-fold, whichever is more. Longer steps would only be refused: their
    /// polynomial, and Newton's method, would meet a law out of all bounds.
    fn time_to_slow(&self, length: f64) -> f64 {
        let torsion = &self.brake.torsion;
        let start = torsion.relative_velocity(&self.y).abs();
        let end = torsion.relative_velocity(&self.stage(STAGES - 1)).abs();
        let drop = (0.5 * end).max(4.0 / torsion.friction.law.steepness_rate(end));
        if start > end {
            length * drop / (start - end)
        } else {
            f64::INFINITY
        }
    }

    /// The guard that fires first in the Radau step just solved, if one does.
    ///
    /// Newton's method on the guard; the step is taken again for each iterate, exactly to it, as its end is more accurate
    /// than its middle. But within a few periods of an unstable fast mode R(z) has its poles, and a step cut to such a
    /// length may be worse than the polynomial of the whole: where they disagree the polynomial holds.
    fn root_of_collocation(&mut self, slip: &Slip<'_>, weights: &TorsionState) -> Option<Root> {
        self.whole.copy_from(self.radau.step());
        let (start, length) = (self.tau, self.whole.length);
        let (share, index, polynomial) = self.earliest_in_collocation(start, length)?;
        let sign = self.guards().find(|g| g.0 == index).map_or(1.0, |g| g.1);
        let mut root = share * length;
        let (mut y, mut again) = (self.y, true);
        for _ in 0..8 {
            if root <= f64::EPSILON * (start + length) {
                // It fires where the step begins.
                return Some(Root {
                    index,
                    tau: start,
                    y: self.y,
                });
            }
            self.whole.at_share(root / length, &mut y);
            if again {
                let attempt = self.radau.attempt(slip, start, &self.y, root, weights, true);
                let end = self.stage(STAGES - 1);
                again = attempt != Attempt::NotConverged
                    && (0..DYNAMIC).all(|k| (end[k] - y[k]).abs() <= STEP_NOISE * weights[k]);
                if again {
                    y = end;
                } else {
                    self.radau.restore(&self.whole);
                }
            }
            let value = sign * self.guard(index, start + root, &y);
            let (_, slope) = taylor::value_and_rate(&polynomial, &(root / length));
            let next = root - value * length / slope;
            if !(next > 0.0 && next <= length) || (next - root).abs() <= 2.0 * f64::EPSILON * (start + root) {
                break;
            }
            root = next;
        }
        Some(Root {
            index,
            tau: start + root,
            y,
        })
    }

    /// The guard that fires first by the polynomials through its values at the stages: the share of the step, the guard
    /// and its polynomial.
    fn earliest_in_collocation(&mut self, start: f64, length: f64) -> Option<(f64, usize, [f64; NODES])> {
        let mut earliest: Option<(f64, usize, [f64; NODES])> = None;
        for (index, sign) in self.guards() {
            self.counters.root_evaluations += NODES as u64;
            let values = SVector::<f64, NODES>::from_fn(|i, _| {
                if i == 0 {
                    sign * self.guard(index, start, &self.y)
                } else {
                    let tau = start + self.radau.node(i - 1) * length;
                    sign * self.guard(index, tau, &self.stage(i - 1))
                }
            });
            let mut polynomial: [f64; NODES] = (interpolation() * values).into();
            if self.first && polynomial[0].abs() <= self.noise(index) {
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
