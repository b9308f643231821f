//! The brake's own solver: Radau IIA over the quiet stretches of a slip, Taylor series where the fast mode moves.
//!
//! Where steps have to resolve the fast mode ([`Location::resolved`]), each is a Taylor expansion of the slip. Where they
//! have not, the expansion at the segment's start says how much of the fast mode is there: as long as it is more than
//! what is tolerated, expansions follow it down, and from then on Radau IIA strides over it.
//!
//! On a Taylor step the guards are polynomials, of the step's own accuracy, and their first root is isolated, not
//! searched for. A slip that begins tangentially starts at a double root of its own guard, which is divided out. On a
//! Radau step the guards' values at the stages are interpolated, and the root's step is taken again, exactly to the
//! root.

use super::brake::{Brake, GUARD_STABILITY, GUARD_STOPPING, Location, Watch};
use super::rules::LARGEST_HASTE;
use crate::hybrid::{Advance, ChosenSolver, Dynamics, Stepper, StepperError};
use crate::model::slip_series::{SlipConstants, SlipSeries};
use crate::model::slow_manifold::{SlowSeries, slow_momentum};
use crate::model::torsion::{DIMENSION, TorsionState, index::*};
use crate::series::polynomial_roots::first_falling;
use crate::series::radau::{Attempt, Radau, StiffProblem};
use crate::series::radau_tableau::RadauTableau;
use crate::series::taylor;
use crate::sundials::Counters;
use nalgebra::{DMatrixViewMut, SMatrix, SVector};
use std::sync::{Arc, OnceLock};

/// Coefficients of a Taylor expansion: order 27, as products are summed in groups of four coefficients. From 24 to 32 a
/// run takes the same time.
const TERMS: usize = 28;

/// The last coefficient of a series along the slow manifold that is to be trusted.
const SLOW_ORDER: usize = TERMS - 4;

/// By how many e-folds the friction law's exponential may change over an expansion's step, while it matters: the terms of
/// an exponential grow up to that index, and only beyond it do the last ones say what is left out.
const E_FOLDS: f64 = 6.0;

/// An exponential below this does not matter.
const NO_WEAKENING: f64 = 1e-18;

/// Shortest step along the slow manifold, in natural periods: below it there is none to speak of.
const SHORTEST_SLOW: f64 = 2.0;

/// Stages of Radau IIA: order 13.
const STAGES: usize = 7;

/// Components that the right-hand side needs; those after them are quadratures.
const DYNAMIC: usize = 5;

/// Values of a guard on a Radau step: at its start and its stages.
const NODES: usize = STAGES + 1;

/// Shortest Radau step, in natural periods: below it an expansion is cheaper.
const SHORTEST_RADAU: f64 = 0.5;

/// Largest growth from one Radau step to the next. Its polynomial is extrapolated over the next step.
const LARGEST_GROWTH: f64 = 4.0;

/// Share of c_t within which the stability margin counts as zero where a segment begins. The root that began it was
/// located to 1e-14 s or better.
const MARGIN_NOISE: f64 = 1e-9;

/// Share of the torques within which their sum counts as zero at a tangential departure: mu_0 r F_n against mu_s r F_n,
/// at a breakaway located to the last place.
const DEPARTURE_NOISE: f64 = 1e-10;

/// The same for the relative velocity, of the speeds that it is the difference of.
const VELOCITY_NOISE: f64 = 16.0 * f64::EPSILON;

/// What a Radau step may leave beside the slow manifold, over what is tolerated of its error; a perturbation that means
/// anything is larger by as much again.
const STEP_NOISE: f64 = 1e3;

/// What the last step was.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Last {
    /// An expansion about this time.
    Expansion(f64),
    /// Held by [`Radau::step`].
    Collocation,
}

/// Where a guard fires.
struct Root {
    index: usize,
    tau: f64,
    y: TorsionState,
}

/// See the module.
pub struct BrakeStepper {
    brake: Arc<Brake>,
    constants: SlipConstants<f64>,
    /// 1 / omega_n, s.
    unit: f64,
    series: SlipSeries<f64, TERMS>,
    force: [f64; TERMS],
    radau: Radau<DYNAMIC, DIMENSION, STAGES>,
    location: Location,
    origin: f64,
    span: f64,
    max_step: f64,
    relative: f64,
    absolute: TorsionState,
    tau: f64,
    y: TorsionState,
    last: Last,
    /// Nothing has been stepped over in this segment.
    first: bool,
    /// The slip has begun against its sense, see [`Dynamics::starts_beyond`], and has not turned yet.
    beyond: bool,
    /// The fast mode may be above what is tolerated, though it need not be resolved for its own sake.
    lively: bool,
    /// The next Radau step, and whether the last one's polynomial foretells it.
    next: f64,
    foretold: bool,
    /// Length and error of the last Radau step; zero before the first.
    accepted: (f64, f64),
    counters: Counters,
    radau_before: crate::series::radau::Work,
}

fn tableau() -> &'static Arc<RadauTableau<STAGES>> {
    static TABLEAU: OnceLock<Arc<RadauTableau<STAGES>>> = OnceLock::new();
    TABLEAU.get_or_init(|| Arc::new(RadauTableau::new()))
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
    sense: f64,
    origin: f64,
}

impl StiffProblem<DYNAMIC, DIMENSION> for Slip<'_> {
    fn rhs(&self, t: f64, y: &TorsionState) -> TorsionState {
        let mut rates = [0.0; DIMENSION];
        let force = self.brake.axial.pressing_force(self.origin + t);
        self.brake.torsion.slip_rhs(self.sense, force, y, &mut rates);
        rates
    }

    fn jacobian(&self, t: f64, y: &TorsionState) -> SMatrix<f64, DYNAMIC, DYNAMIC> {
        let mut entries = [0.0; DIMENSION * DIMENSION];
        let mut view = DMatrixViewMut::from_slice(&mut entries, DIMENSION, DIMENSION);
        let force = self.brake.axial.pressing_force(self.origin + t);
        self.brake.torsion.slip_jacobian(self.sense, force, y, &mut view);
        view.fixed_view::<DYNAMIC, DYNAMIC>(0, 0).into_owned()
    }
}

impl BrakeStepper {
    pub fn new(brake: Arc<Brake>) -> Self {
        let unit = 1.0 / brake.torsion.natural_angular_frequency();
        BrakeStepper {
            constants: SlipConstants::new(&brake.torsion),
            unit,
            series: SlipSeries::new(unit),
            force: [0.0; TERMS],
            radau: Radau::new(tableau().clone()),
            location: Location {
                mode: crate::model::Mode::SlipForward,
                resolved: true,
                watch: Watch::Off,
            },
            origin: 0.0,
            span: 0.0,
            max_step: f64::INFINITY,
            relative: 0.0,
            absolute: [0.0; DIMENSION],
            tau: 0.0,
            y: [0.0; DIMENSION],
            last: Last::Expansion(0.0),
            first: true,
            beyond: false,
            lively: true,
            next: 0.0,
            foretold: false,
            accepted: (0.0, 0.0),
            counters: Counters::default(),
            radau_before: Default::default(),
            brake,
        }
    }

    fn sense(&self) -> f64 {
        f64::from(self.location.mode.sense())
    }

    /// The guards' indices, each with the sign that makes it fire when it falls.
    fn guards(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let stability = match self.location.watch {
            Watch::Off => None,
            Watch::Stable => Some((GUARD_STABILITY, 1.0)),
            Watch::Unstable => Some((GUARD_STABILITY, -1.0)),
        };
        std::iter::once((GUARD_STOPPING, 1.0)).chain(stability)
    }

    fn guard(&self, index: usize, tau: f64, y: &TorsionState) -> f64 {
        if index == GUARD_STOPPING {
            self.sense() * self.brake.torsion.relative_velocity(y)
        } else {
            self.brake.stability_margin(self.sense(), self.origin + tau, y)
        }
    }

    /// What counts as zero of a guard where the segment begins.
    fn noise(&self, index: usize) -> f64 {
        if index == GUARD_STOPPING {
            let speeds = self.y[ROTOR_SPEED].abs() + self.y[ROTOR_TWIST_RATE].abs() + self.y[STATOR_TWIST_RATE].abs();
            VELOCITY_NOISE * speeds
        } else {
            MARGIN_NOISE * self.brake.torsion.torsion.damping
        }
    }

    fn weights(&self) -> TorsionState {
        std::array::from_fn(|k| self.absolute[k] + self.relative * self.y[k].abs())
    }

    /// Expands the slip about where it stands.
    fn expand(&mut self) {
        let t = self.origin + self.tau;
        let degree = self.brake.axial.pressing_series(t, self.unit, &mut self.force);
        // Steps along the slow manifold leave another one.
        self.series.unit = self.unit;
        self.series
            .expand(&self.constants, self.sense(), &self.y, &self.force, degree);
        self.counters.rhs_evaluations += 1;
    }

    /// How fast the fast mode moves (rad/s), from an expansion: an oscillation A cos(omega_n t) has the last coefficient
    /// A / (TERMS - 1)! in the series' unit, and nothing slower comes near that.
    fn liveliness(&self) -> f64 {
        let factorial: f64 = (1..TERMS).map(|n| n as f64).product();
        let last = |component: usize| self.series.state[component][TERMS - 1].abs();
        factorial * last(ROTOR_TWIST_RATE).max(last(STATOR_TWIST_RATE))
    }

    /// A step along the slow manifold, if the slip is on it, to what a step may leave beside it: the motion without the
    /// fast mode is a series of its own, and stays where it is even where the manifold is unstable. What is too large for
    /// the error of a step is left alone.
    fn slow_step(&mut self) -> Result<Option<Advance>, StepperError> {
        let t = self.origin + self.tau;
        let brake = self.brake.clone();
        if !brake.axial.is_silent(t) {
            return Ok(None);
        }
        let (torsion, sense) = (&brake.torsion, self.sense());
        let axial = brake.axial.at(t);
        let pressing = (axial.pressing_force, axial.pressing_rate);
        let slow = SlowSeries::<TERMS>::new(torsion, sense, pressing, slow_momentum(torsion, &self.y));
        let (start, weights) = (slow.start(), self.weights());
        if !(0..DYNAMIC).all(|k| (start[k] - self.y[k]).abs() <= STEP_NOISE * weights[k]) {
            return Ok(None);
        }
        slow.write(torsion, sense, pressing, &self.y, &mut self.series);
        let longest = self.longest_expansion(SLOW_ORDER, &weights);
        let left = self.span - self.tau;
        let rate = self.series.relative_velocity[1];
        let slope = torsion.torsion.damping - self.series.stability_margin[0];
        let haste = slope / torsion.torsion.stiffness * torsion.friction.decay * rate.abs();
        let short = longest < left && longest < SHORTEST_SLOW * torsion.natural_period();
        if longest.is_nan() || short || haste > LARGEST_HASTE {
            return Ok(None);
        }
        self.expansion_step(longest).map(Some)
    }

    /// The longest step of at most `longest` (s) over which the friction law's exponential changes by [`E_FOLDS`] or stays
    /// below what matters. The exponent's terms, all taken as positive, bound its change, and grow faster than the step.
    fn within_weakening(&self, longest: f64) -> f64 {
        let decay = self.brake.torsion.friction.decay;
        let speed = &self.series.relative_velocity;
        let allowed = (decay * speed[0].abs() + NO_WEAKENING.ln()).max(E_FOLDS);
        let longest = longest.min(self.span - self.tau);
        let x = longest / self.series.unit;
        let change = speed[1..=SLOW_ORDER]
            .iter()
            .rev()
            .fold(0.0, |sum, c| (sum + c.abs()) * x);
        if decay * change <= allowed {
            longest
        } else {
            longest * (allowed / (decay * change))
        }
    }

    /// The longest step of the expansion whose terms fall below what is tolerated by this order (s), no longer than to the
    /// end of the segment.
    fn longest_expansion(&self, order: usize, weights: &TorsionState) -> f64 {
        let size = |n: usize| {
            (0..DYNAMIC)
                .map(|k| self.series.state[k][n].abs() / weights[k])
                .fold(0.0, |a: f64, b| if b <= a { a } else { b })
        };
        self.within_weakening(taylor::step(order, size) * self.series.unit)
    }

    /// A step of at most `longest` (s) by the expansion about where it stands.
    fn expansion_step(&mut self, longest: f64) -> Result<Advance, StepperError> {
        let unit = self.series.unit;
        if longest.is_nan() {
            return Err(StepperError::NotFinite);
        }
        let left = self.span - self.tau;
        let bound = longest.min(self.max_step);
        let reaches = bound >= left;
        let length = if reaches { left } else { bound };
        let tau = self.tau + length;
        if tau <= self.tau {
            return Err(StepperError::StepTooShort { step: length });
        }
        let mut earliest: Option<(f64, usize)> = None;
        for (index, sign) in self.guards() {
            if let Some(share) = self.first_root(index, sign, length / unit)
                && earliest.is_none_or(|(before, _)| share < before)
            {
                earliest = Some((share, index));
            }
        }
        self.last = Last::Expansion(self.tau);
        self.first = false;
        self.counters.steps += 1;
        self.counters.last_order = TERMS as u32 - 1;
        let length = earliest.map_or(length, |(share, _)| share * length);
        self.counters.last_step = length;
        self.y = self.series.at(&(length / unit));
        self.tau = if earliest.is_some() { self.tau + length } else { tau };
        self.beyond = self.beyond && self.guard(GUARD_STOPPING, self.tau, &self.y) < 0.0;
        Ok(match earliest {
            Some((_, index)) => Advance::Guard(index),
            None if reaches => Advance::Stop,
            None => Advance::Stepped,
        })
    }

    /// The first share of the expansion's first `x` units at which a guard fires.
    fn first_root(&mut self, index: usize, sign: f64, x: f64) -> Option<f64> {
        self.counters.root_evaluations += 1;
        let series = if index == GUARD_STOPPING {
            &self.series.relative_velocity
        } else {
            &self.series.stability_margin
        };
        let sign = if index == GUARD_STOPPING {
            sign * self.sense()
        } else {
            sign
        };
        let mut power = sign;
        let mut guard = series.map(|c| {
            let scaled = c * power;
            power *= x;
            scaled
        });
        if self.first && guard[0].abs() <= self.noise(index) {
            // It leaves zero here: the root, simple or double, is divided out.
            let torsion = &self.brake.torsion;
            let torques = torsion.rotor_torque(&self.y).abs() + torsion.stator_torque(&self.y).abs();
            let slope_noise = DEPARTURE_NOISE * torques / torsion.torsion.surface_inertia * self.series.unit * x;
            let double = index == GUARD_STOPPING && guard[1].abs() <= slope_noise;
            let roots = if double { 2 } else { 1 };
            guard.rotate_left(roots);
            guard[TERMS - roots..].fill(0.0);
        }
        if guard[0] < 0.0 && !(self.beyond && index == GUARD_STOPPING) {
            Some(0.0)
        } else {
            first_falling(&guard)
        }
    }

    /// A Radau step; `None` where an expansion would be cheaper.
    fn collocation_step(&mut self) -> Result<Option<Advance>, StepperError> {
        let shortest = SHORTEST_RADAU * self.brake.torsion.natural_period();
        let weights = self.weights();
        let brake = self.brake.clone();
        let slip = Slip {
            brake: &brake,
            sense: self.sense(),
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
                .attempt(&slip, self.tau, &self.y, length, &weights, self.foretold);
            let error = match attempt {
                Attempt::Solved { error } if error.is_finite() => error,
                _ => {
                    // Shorter at once: what was foretold over a step too long is of no use from anywhere else either.
                    self.next = 0.4 * length;
                    continue;
                }
            };
            let order = Radau::<DYNAMIC, DIMENSION, STAGES>::ESTIMATE_ORDER;
            let root = |x: f64| x.powf(1.0 / f64::from(order));
            let factor = 0.9 / root(error);
            // Its polynomial serves a shorter step from the same start, too.
            self.foretold = true;
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
                    Advance::Guard(index)
                }
                None => {
                    (self.tau, self.y) = (end, self.radau.stage(STAGES - 1));
                    if reaches { Advance::Stop } else { Advance::Stepped }
                }
            }));
        }
    }

    /// How long the speed takes, at the rate of the Radau step just solved, to fall by a half or by four times what the
    /// friction law takes to change e-fold, whichever is more. Longer steps would only be refused: their polynomial, and
    /// Newton's method, would meet an exponential out of all bounds.
    fn time_to_slow(&self, length: f64) -> f64 {
        let torsion = &self.brake.torsion;
        let start = torsion.relative_velocity(&self.y).abs();
        let end = torsion.relative_velocity(&self.radau.stage(STAGES - 1)).abs();
        let drop = (0.5 * end).max(4.0 / torsion.friction.decay);
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
        let whole = self.radau.step().clone();
        let (start, length) = (self.tau, whole.length);
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
            y = whole.at_share(root / length);
            if again {
                let attempt = self.radau.attempt(slip, start, &self.y, root, weights, true);
                let end = self.radau.stage(STAGES - 1);
                again = attempt != Attempt::NotConverged
                    && (0..DYNAMIC).all(|k| (end[k] - y[k]).abs() <= STEP_NOISE * weights[k]);
                if again {
                    y = end;
                } else {
                    self.radau.restore(whole.clone());
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
                    sign * self.guard(index, tau, &self.radau.stage(i - 1))
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

impl Stepper<Location> for BrakeStepper {
    fn begin(&mut self, location: &Location, t: f64, y: &[f64], span: f64, chosen: &ChosenSolver) {
        self.location = *location;
        self.origin = t;
        self.span = span;
        self.max_step = chosen.max_step.unwrap_or(f64::INFINITY);
        self.relative = chosen.tolerances.relative;
        self.absolute.copy_from_slice(&chosen.tolerances.absolute);
        self.tau = 0.0;
        self.y.copy_from_slice(y);
        self.last = Last::Expansion(0.0);
        self.first = true;
        self.beyond = self.brake.starts_beyond(location, t, y, GUARD_STOPPING);
        self.lively = true;
        self.next = 4.0 * self.brake.torsion.natural_period();
        self.foretold = false;
        self.accepted = (0.0, 0.0);
        self.counters = Counters::default();
        self.radau_before = self.radau.work();
    }

    fn advance(&mut self) -> Result<Advance, StepperError> {
        if !self.location.resolved
            && let Some(advance) = self.slow_step()?
        {
            self.lively = true;
            self.foretold = false;
            return Ok(advance);
        }
        if self.lively || self.location.resolved || self.beyond {
            self.expand();
            self.lively = self.liveliness() > self.weights()[ROTOR_TWIST_RATE];
        }
        if !self.lively && !self.location.resolved && !self.beyond {
            if let Some(advance) = self.collocation_step()? {
                return Ok(advance);
            }
            self.next = 4.0 * self.brake.torsion.natural_period();
            self.foretold = false;
            self.accepted = (0.0, 0.0);
            self.lively = true;
            self.expand();
        }
        let longest = self.longest_expansion(TERMS - 1, &self.weights());
        self.expansion_step(longest)
    }

    fn time(&self) -> f64 {
        self.tau
    }

    fn state(&self) -> &[f64] {
        &self.y
    }

    fn state_at(&self, tau: f64, out: &mut [f64]) {
        let state = match self.last {
            Last::Expansion(about) => self.series.at(&((tau - about) / self.series.unit)),
            Last::Collocation => self.radau.step().at(tau),
        };
        out.copy_from_slice(&state);
    }

    fn counters(&self) -> Counters {
        let (work, before) = (self.radau.work(), self.radau_before);
        let jacobians = work.jacobian_evaluations - before.jacobian_evaluations;
        Counters {
            rhs_evaluations: self.counters.rhs_evaluations + work.rhs_evaluations - before.rhs_evaluations,
            jacobian_evaluations: jacobians,
            linear_solver_setups: jacobians,
            nonlinear_iterations: work.iterations - before.iterations,
            nonlinear_convergence_failures: work.convergence_failures - before.convergence_failures,
            ..self.counters
        }
    }
}
