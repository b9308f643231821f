//! The engine of `series`: Taylor series in every mode, Radau IIA over the quiet parts of a slip.
//!
//! Stick, separation, and slip under constant friction are linear: their series are those of the matrix exponential and
//! of the signals, and converge over every step. Guards are polynomials with the accuracy of the step; their first root
//! is isolated.
//!
//! If steps need not resolve the fast modes ([`SystemLocation::resolved`]), the expansion at the segment's start shows
//! the amplitude of these modes. Expansions follow the modes until they have decayed below the tolerance, then Radau IIA
//! steps over them. Guards on a Radau step are interpolated between the stages, and the step is repeated up to the root.
//!
//! | module | what it is |
//! |---|---|
//! | `collocation` | Radau steps |

pub(super) mod collocation;

use super::expansion::{Expansion, Series, TERMS};
use super::regime::LARGEST_TIME_SCALE_RATIO;
use crate::Error;
use crate::hybrid::dynamics::{GUARD_STOPPING, SystemDynamics, SystemLocation, VELOCITY_NOISE, Watched};
use crate::hybrid::{Advance, ChosenSolver, Engine, EngineSegment, Fired};
use crate::sundials::Counters;
use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};
use stickslip_system::friction::Law;
use stickslip_system::model::Mode;
use stickslip_system::model::equations::Outside;
use stickslip_system::model::slow_manifold::{Slip, SlowSeries, has_slow_manifold, slow_momenta};
use stickslip_system::numerics::polynomial_roots::first_falling;
use stickslip_system::numerics::radau::{Radau, RadauTableau, Step, Work};
use stickslip_system::numerics::taylor;

/// Radau IIA with these stages has order 13.
pub(super) const STAGES: usize = 7;

/// Share of c_t within which the stability margin counts as zero at the start of a segment: its root was located to
/// 1e-14 s or better.
const MARGIN_NOISE: f64 = 1e-9;

/// Rounding of the contact force, relative to its terms. With a small c_t the margin almost vanishes with the force
/// when the contact closes.
const FORCE_NOISE: f64 = 16.0 * f64::EPSILON;

/// Rounding of omega_r', relative to the accelerations of the torques.
const DEPARTURE_NOISE: f64 = 1e-9;

/// Deviation from the slow manifold after a Radau step, in units of the tolerance. A significant perturbation is
/// larger by the same factor again.
const STEP_NOISE: f64 = 1e3;

const SLOW_ORDER: usize = TERMS - 4;

/// Shortest worthwhile step along the slow manifold, in natural periods.
const SHORTEST_SLOW: f64 = 2.0;

/// Number of coefficients that show the size of a quantity that may start at zero.
const LEADING: usize = 6;

/// Relative error of the energies, on which nothing depends. In a slip that slows down by itself, friction dominates
/// the energies, which needs no shorter steps.
const ENERGY_TOLERANCE: f64 = 1e-14;

/// Number of expansions after a Radau step that would be too short, if sliding does not slow down by itself. A slower
/// mode then oscillates, which no expansion distinguishes from the motion.
const EXPANSIONS: u32 = 16;

#[derive(Debug, Clone, Copy, PartialEq)]
enum PreviousStep {
    Expansion(f64),
    Collocation,
}

/// Engine of `series`.
pub struct TaylorEngine {
    dynamics: Arc<SystemDynamics>,
    expansion: Expansion,
    location: SystemLocation,
    origin: f64,
    span: f64,
    max_step: f64,
    relative: f64,
    absolute: Vec<f64>,
    tau: f64,
    y: Vec<f64>,
    last: PreviousStep,
    /// Whether the last step followed the slow motion alone: along the slow manifold, or by Radau.
    slow: bool,
    first: bool,
    /// Whether the slip has begun against its sense, see [`SystemDynamics::starts_beyond`], and has not turned yet.
    beyond: bool,
    held: Option<f64>,
    counters: Counters,
    radau: Radau<STAGES>,
    radau_before: Work,
    /// Natural period or, if sliding does not slow down by itself, period of the fastest mode, s.
    period: f64,
    /// Whether the fast modes may exceed the tolerance although steps need not resolve them.
    ringing: bool,
    expansions: u32,
    /// Length of the next Radau step (s), and whether the last polynomial predicts its solution.
    next: f64,
    predicted: bool,
    /// Length (s) and error of the last Radau step; zero before the first step.
    accepted: (f64, f64),
    /// Tolerance of each component; a Radau step with a root; a state on this step; the state at its end.
    weights: Vec<f64>,
    whole: Step<STAGES>,
    stage: Vec<f64>,
    end: Vec<f64>,
}

pub(super) fn tableau() -> &'static Arc<RadauTableau<STAGES>> {
    static TABLEAU: OnceLock<Arc<RadauTableau<STAGES>>> = OnceLock::new();
    TABLEAU.get_or_init(|| Arc::new(RadauTableau::new()))
}

fn with_work_of(counters: Counters, work: Work, before: Work) -> Counters {
    let jacobians = work.jacobian_evaluations - before.jacobian_evaluations;
    Counters {
        rhs_evaluations: counters.rhs_evaluations + work.rhs_evaluations - before.rhs_evaluations,
        jacobian_evaluations: jacobians,
        linear_solver_setups: jacobians,
        nonlinear_iterations: work.iterations - before.iterations,
        nonlinear_convergence_failures: work.convergence_failures - before.convergence_failures,
        ..counters
    }
}

impl TaylorEngine {
    /// An engine for one system.
    pub fn new(dynamics: Arc<SystemDynamics>) -> TaylorEngine {
        let dimension = dynamics.system.dimension;
        TaylorEngine {
            expansion: Expansion::new(&dynamics.system, &dynamics.excitation),
            location: SystemLocation::new(Mode::Separated, 0),
            origin: 0.0,
            span: 0.0,
            max_step: f64::INFINITY,
            relative: 0.0,
            absolute: vec![0.0; dimension],
            tau: 0.0,
            y: vec![0.0; dimension],
            last: PreviousStep::Expansion(0.0),
            slow: false,
            first: true,
            beyond: false,
            held: None,
            counters: Counters::default(),
            radau: Radau::new(tableau().clone(), dynamics.system.mechanical(), dimension),
            radau_before: Work::default(),
            period: match dynamics.system.twice_resistance {
                Some(_) => dynamics.natural_period().unwrap_or(f64::INFINITY),
                None => TAU / dynamics.rates.fastest,
            },
            ringing: true,
            expansions: 0,
            next: 0.0,
            predicted: false,
            accepted: (0.0, 0.0),
            weights: vec![0.0; dimension],
            whole: Step::new(dimension),
            stage: vec![0.0; dimension],
            end: vec![0.0; dimension],
            dynamics,
        }
    }

    fn weigh(&mut self) {
        let values = self.absolute.iter().zip(&self.y);
        for (weight, (absolute, y)) in self.weights.iter_mut().zip(values) {
            *weight = absolute + self.relative * y.abs();
        }
    }

    fn expand(&mut self) {
        let unit = self.dynamics.unit(self.location.stretch);
        let t = self.origin + self.tau;
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        self.expansion
            .expand((system, excitation), &self.location, t, &self.y, unit);
        self.counters.rhs_evaluations += 1;
    }

    /// Whether an expansion oscillates above the tolerance. A cos(omega t) has the last coefficient A (omega
    /// unit)^(TERMS - 1) / (TERMS - 1)!, far above the coefficients of slower motions.
    fn rings(&mut self) -> bool {
        self.weigh();
        let angle = TAU * self.expansion.unit / self.period;
        let last = (1..TERMS).fold(1.0, |factor, n| factor * n as f64 / angle);
        let mut rates = self.dynamics.system.twist_rates();
        rates.any(|k| last * self.expansion.state[k][TERMS - 1].abs() > self.weights[k])
    }

    /// A step along the slow manifold, if the slip deviates from it by no more than the error of a step. The motion
    /// without fast modes has a series of its own, even where the manifold is unstable.
    fn slow_step(&mut self) -> Result<Option<Advance>, Error> {
        let dynamics = self.dynamics.clone();
        let (system, t) = (&dynamics.system, self.origin + self.tau);
        // With drives the slow manifold would depend on time.
        if system.twice_resistance.is_none() || !dynamics.excitation.is_silent(t) || !has_slow_manifold(system) {
            return Ok(None);
        }
        self.weigh();
        let sense = self.location.sign();
        let pressing = self.expansion.pressing(&dynamics.excitation, &self.location, t);
        let slip = Slip::undriven(sense, self.location.piece, pressing);
        let slow = SlowSeries::<TERMS>::new(system, &slip, slow_momenta(system, &slip.outside, &self.y));
        let start = slow.start(system);
        let away = start.iter().zip(&self.y).zip(&self.weights);
        if !away
            .into_iter()
            .all(|((slow, y), weight)| (slow - y).abs() <= STEP_NOISE * weight)
        {
            return Ok(None);
        }
        self.expansion.follow(system, &self.location, &slow, &self.y);
        let size = |n: usize| {
            let shares = self.expansion.state.iter().zip(&self.weights).take(system.mechanical());
            shares
                .map(|(series, weight)| series[n].abs() / weight)
                .fold(0.0, |most: f64, share| if share <= most { most } else { share })
        };
        let left = self.span - self.tau;
        let longest = taylor::step(SLOW_ORDER, size).min(left);
        let longest = self.expansion.within_law(system, &self.location, longest);
        let speed = &self.expansion.relative_velocity;
        let contact_damping = slow.contact_damping(system, self.expansion.normal_force())[0];
        let time_scale_ratio =
            -contact_damping * system.compliance() * system.law.steepness_rate(speed[0].abs()) * speed[1].abs();
        let short = longest < left && longest < SHORTEST_SLOW * self.period;
        if longest.is_nan() || short || time_scale_ratio > LARGEST_TIME_SCALE_RATIO {
            return Ok(None);
        }
        self.expansion_step(longest).map(Some)
    }

    fn longest_step(&self) -> f64 {
        let system = &self.dynamics.system;
        let expansion = &self.expansion;
        let mut shares = [0.0f64; 2];
        let mut take = |series: &Series, weight: f64| {
            for (share, n) in shares.iter_mut().zip([TERMS - 1, TERMS - 2]) {
                let size = series[n].abs() / weight;
                *share = if size <= *share { *share } else { size };
            }
        };
        for k in 0..system.mechanical() {
            take(&expansion.state[k], self.absolute[k] + self.relative * self.y[k].abs());
        }
        // Terms of a guard may move while the state does not.
        let size = |series: &Series| series[..LEADING].iter().fold(0.0f64, |most, c| most.max(c.abs()));
        match self.location.mode {
            Mode::Separated => {}
            Mode::Stick => {
                let tested = expansion.tested(system);
                let limit = expansion.limit(system, system.larger_breakaway().0);
                let torque = size(&tested).max(size(&limit));
                if torque > 0.0 {
                    take(&tested, self.relative * torque);
                    take(&limit, self.relative * torque);
                }
            }
            _ => {
                let outside = self.driving();
                let speeds = system.relative_velocity_terms(&outside, &self.y);
                let weight = self.absolute_speed() + self.relative * speeds;
                take(&expansion.relative_velocity, weight);
            }
        }
        if system.twice_resistance.is_none() || self.location.sense == 0 {
            for series in &expansion.state[system.slip..] {
                let size = size(series);
                if size > 0.0 {
                    take(series, ENERGY_TOLERANCE * size);
                }
            }
        }
        let longest = taylor::step(TERMS - 1, |n| shares[TERMS - 1 - n]) * expansion.unit;
        expansion.within_law(system, &self.location, longest.min(self.span - self.tau))
    }

    /// Removes rounding from a stick: the surfaces share one speed, and their relative angle is constant. Both are
    /// known without integration.
    fn hold(&mut self) {
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        let outside = self.driving();
        if let Some(twisted) = self.held {
            let turned = excitation.turned(self.location.stretch, self.origin, self.tau);
            let angle = twisted - turned - system.twisted(&self.y);
            system.turn(angle, &mut self.y);
        }
        system.rejoin(&outside, &mut self.y);
    }

    fn driving(&self) -> Outside {
        let excitation = &self.dynamics.excitation;
        excitation.driving_alone(self.location.stretch, self.origin + self.tau)
    }

    fn absolute_speed(&self) -> f64 {
        let mechanical = self.dynamics.system.mechanical();
        self.absolute[..mechanical].iter().copied().fold(0.0, f64::max)
    }

    fn guard(&self, watched: Watched) -> Option<Series> {
        let expansion = &self.expansion;
        let of_speed = |sign: f64, constant: f64| {
            let mut series = expansion.relative_velocity;
            series.iter_mut().for_each(|c| *c *= sign);
            series[0] += constant;
            series
        };
        let sense = self.location.sign();
        let threshold = self.dynamics.threshold;
        Some(match watched {
            Watched::Stopping => of_speed(sense, 0.0),
            Watched::Destabilised | Watched::Restabilised => {
                let margin = expansion.stability_guard(&self.dynamics.system)?;
                margin.map(|c| watched.sign() * c)
            }
            Watched::Threshold if self.location.slow => of_speed(-sense, threshold),
            Watched::Threshold => of_speed(sense, -threshold),
            Watched::Below => of_speed(sense, -self.dynamics.knot(&self.location, false)?),
            Watched::Above => of_speed(-sense, self.dynamics.knot(&self.location, true)?),
            Watched::Forward | Watched::Backward => {
                let system = &self.dynamics.system;
                let sense = if watched == Watched::Forward { 1.0 } else { -1.0 };
                let (limit, tested) = (expansion.limit(system, sense), expansion.tested(system));
                std::array::from_fn(|n| limit[n] - sense * tested[n])
            }
        })
    }

    /// Rounding of the margin (N m s/rad) and of its rate (N m/rad) at the segment's start, caused by the normal force
    /// and its rate.
    fn noise_of_margin(&self) -> (f64, f64) {
        let SystemDynamics { system, excitation, .. } = &*self.dynamics;
        let (force, unit, t) = (self.expansion.normal_force(), self.expansion.unit, self.origin);
        // The time itself is rounded.
        let of_force = excitation.largest_force() + (force[1] / unit * t).abs();
        let of_rate = excitation.curvature_bound(t) * (t + self.dynamics.natural_period().unwrap_or(0.0));
        let x = self.location.sign() * self.expansion.relative_velocity[0];
        let slope = system
            .law_in(self.location.sign(), self.location.piece)
            .coefficient_and_slope(x)
            .1
            .abs();
        let noise = |of: f64| system.slope_weight(FORCE_NOISE * of) * slope;
        (noise(of_force), noise(of_rate))
    }

    fn noise(&self, watched: Watched) -> f64 {
        let system = &self.dynamics.system;
        if watched.is_margin() {
            return MARGIN_NOISE * system.twice_resistance.unwrap_or(0.0) + self.noise_of_margin().0;
        }
        let outside = self.dynamics.outside(&self.location, self.origin + self.tau);
        let threshold = if watched == Watched::Threshold {
            self.dynamics.threshold
        } else {
            0.0
        };
        VELOCITY_NOISE * (system.relative_velocity_terms(&outside, &self.y) + threshold)
    }

    /// First share of the step of `x` units at which a guard fires.
    fn first_root(&mut self, watched: Watched, x: f64) -> Option<f64> {
        self.counters.root_evaluations += 1;
        let mut guard = self.guard(watched)?;
        let mut power = 1.0;
        for c in &mut guard {
            *c *= power;
            power *= x;
        }
        if matches!(watched, Watched::Forward | Watched::Backward) {
            let noise = self.dynamics.torque_noise();
            let torque = self.expansion.tested(&self.dynamics.system);
            if torque.iter().rev().fold(0.0, |sum, c| sum * x + c.abs()) <= noise {
                // A stick without load does not break, even if its limit falls to zero.
                return None;
            }
            if self.first && guard[0].abs() <= noise {
                // The torque is at the limit within rounding: the later motion decides.
                guard[0] = 0.0;
            }
        } else if self.first && watched.is_margin() && self.dynamics.system.twice_resistance == Some(0.0) {
            // The guard is the slope of friction.
            if guard[0].abs() <= MARGIN_NOISE * guard[1].abs() {
                divide_out(&mut guard, 1);
            }
        } else if self.first && guard[0].abs() <= self.noise(watched) {
            // The simple or double root at the start is divided out.
            let system = &self.dynamics.system;
            let tangential = if watched.is_margin() {
                // With hardly any resistance the zero is that of the normal force, which sets in tangentially at a
                // corner.
                let (force_noise, rate_noise) = self.noise_of_margin();
                let resistance = system.twice_resistance.unwrap_or(0.0);
                resistance < force_noise && guard[1].abs() < rate_noise * self.expansion.unit * x
            } else {
                let lightest = system.rotor.surface_inertia().min(system.stator.surface_inertia());
                let torque = self.expansion.interface[0].abs();
                guard[1].abs() <= DEPARTURE_NOISE * torque / lightest * self.expansion.unit * x
            };
            divide_out(&mut guard, if tangential { 2 } else { 1 });
        }
        if guard[0] < 0.0 && !(self.beyond && watched == Watched::Stopping) {
            Some(0.0)
        } else {
            first_falling(&guard)
        }
    }

    fn expansion_step(&mut self, longest: f64) -> Result<Advance, Error> {
        let (dynamics, unit) = (self.dynamics.clone(), self.expansion.unit);
        if longest.is_nan() {
            return Err(Error::step("a step ended with values that are not finite"));
        }
        let left = self.span - self.tau;
        let bound = longest.min(self.max_step);
        let reaches = bound >= left;
        let length = if reaches { left } else { bound };
        let tau = self.tau + length;
        if tau <= self.tau {
            let message = format!("the error test or Newton's method still fails at a step of {length:.1e} s");
            return Err(Error::step(message));
        }
        let mut earliest: Option<(f64, usize)> = None;
        for (index, &watched) in dynamics.watched(&self.location).iter().enumerate() {
            if let Some(share) = self.first_root(watched, length / unit)
                && earliest.is_none_or(|(before, _)| share < before)
            {
                earliest = Some((share, index));
            }
        }
        self.last = PreviousStep::Expansion(self.tau);
        self.first = false;
        self.counters.steps += 1;
        self.counters.last_order = TERMS as u32 - 1;
        let length = earliest.map_or(length, |(share, _)| share * length);
        self.counters.last_step = length;
        self.expansion.at(length / unit, &mut self.y);
        self.tau = if earliest.is_some() { self.tau + length } else { tau };
        if self.beyond {
            let outside = dynamics.outside(&self.location, self.origin + self.tau);
            self.beyond = self.location.sign() * dynamics.system.relative_velocity(&outside, &self.y) < 0.0;
        }
        Ok(match earliest {
            Some((_, index)) => Advance::Guards(Fired::one(index)),
            None if reaches => Advance::Stop,
            None => Advance::Stepped,
        })
    }
}

fn divide_out(guard: &mut Series, roots: usize) {
    guard.rotate_left(roots);
    guard[TERMS - roots..].fill(0.0);
}

impl Engine for TaylorEngine {
    fn begin(&mut self, segment: &EngineSegment<'_>, chosen: &ChosenSolver) -> Result<(), Error> {
        self.location = segment.location;
        self.origin = segment.start;
        self.span = segment.span();
        self.max_step = chosen.max_step.unwrap_or(f64::INFINITY);
        self.relative = chosen.tolerances.relative;
        self.absolute.copy_from_slice(&chosen.tolerances.absolute);
        self.tau = 0.0;
        self.y.copy_from_slice(segment.state);
        self.last = PreviousStep::Expansion(0.0);
        self.first = true;
        self.beyond = self
            .dynamics
            .starts_beyond(&self.location, segment.start, segment.state, GUARD_STOPPING);
        let system = &self.dynamics.system;
        let tied = system.rotor.speed.is_none() && system.stator.speed.is_none();
        self.held = (tied && self.location.mode == Mode::Stick).then(|| system.twisted(&self.y));
        self.counters = Counters::default();
        self.radau_before = self.radau.work;
        self.ringing = true;
        self.expansions = 0;
        self.restart_collocation();
        Ok(())
    }

    fn advance(&mut self) -> Result<Advance, Error> {
        let strides = !self.location.resolved && self.location.mode.sense() != 0;
        self.slow = true;
        if strides && let Some(advance) = self.slow_step()? {
            self.ringing = true;
            self.predicted = false;
            return Ok(advance);
        }
        if self.location.mode == Mode::Stick {
            self.hold();
        }
        if self.ringing || !strides || self.beyond {
            self.expand();
            self.ringing = strides && (self.expansions > 0 || self.rings());
            self.expansions = self.expansions.saturating_sub(1);
        }
        if !self.ringing && strides && !self.beyond {
            if let Some(advance) = self.collocation_step()? {
                return Ok(advance);
            }
            self.restart_collocation();
            self.ringing = true;
            if self.dynamics.system.twice_resistance.is_none() {
                self.expansions = EXPANSIONS;
            }
            self.expand();
        }
        self.slow = false;
        let longest = self.longest_step();
        self.expansion_step(longest)
    }

    fn time(&self) -> f64 {
        self.tau
    }

    fn state(&self) -> &[f64] {
        &self.y
    }

    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), Error> {
        match self.last {
            PreviousStep::Expansion(about) => self.expansion.at((tau - about) / self.expansion.unit, out),
            PreviousStep::Collocation => self.radau.step.at(tau, out),
        }
        Ok(())
    }

    fn is_slow(&self) -> bool {
        self.slow
    }

    fn counters(&mut self) -> Result<Counters, Error> {
        Ok(with_work_of(self.counters, self.radau.work, self.radau_before))
    }
}
