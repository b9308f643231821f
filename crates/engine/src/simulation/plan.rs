//! Solver and tolerances of each location of a system.

use super::expansion::Expansion;
use super::regime::{Regimes, Steps, Stride};
use crate::hybrid::dynamics::{SystemDynamics, SystemLocation, VELOCITY_NOISE};
use crate::hybrid::{ChosenSolver, SolverKind};
use crate::simulation::options::{Method, SolverOptions};
use crate::sundials::{CvodeOptions, ShortSteps, Tolerances};
use std::f64::consts::TAU;
use std::sync::Arc;
use stickslip_system::friction::Law;
use stickslip_system::model::Mode;
use stickslip_system::model::equations::{ANGLE, Driving, Engagement, Outside};
use stickslip_system::model::slow_manifold::has_slow_manifold;
use stickslip_system::model::stability::least_fast_frequency;
use stickslip_system::model::system::{End, System};
use stickslip_system::numerics::polynomial_roots::first_falling;

/// A relative tolerance: a share of `rtol`, and its least value.
#[derive(Clone, Copy)]
struct Tightening(f64, f64);

impl Tightening {
    fn of(self, rtol: f64) -> f64 {
        (self.0 * rtol).max(self.1)
    }
}

/// Below this, step control fails by rounding.
const SMALLEST: f64 = 1e-14;

/// With smaller tolerances steps of smooth sliding multiply, and their rounding adds up.
const SMALLEST_SLIDING: f64 = 1e-12;

/// For SUNDIALS: the errors of some hundred steps between two events add up.
const EXPLICIT: Tightening = Tightening(0.01, SMALLEST);

/// The iterations of implicit methods end at the level of rounding.
const IMPLICIT: Tightening = Tightening(0.01, 1e-13);

/// For smooth sliding that slows down by itself: errors there shift all events alike.
const SLIDING: Tightening = Tightening(0.049, SMALLEST_SLIDING);

/// For series in a slip that slows down by itself, in smooth sliding and with resolved fast modes: digits are cheap.
const SERIES_SLIDING: Tightening = Tightening(0.01, 1e-12);
const SERIES_RESOLVED: Tightening = Tightening(1e-6, 1e-17);

/// Relative tolerance of long steps of series in a slip that does not slow down by itself.
const SERIES_STRIDING: f64 = 1e-14;

/// Relative tolerance of other series.
const SERIES_TOLERANCE: f64 = 1e-17;

/// For `cvode`: a multistep method errs by some hundred tolerances in a hundred restarts; below [`SMALLEST`] the
/// rounding of many short steps takes what the tolerance gives.
const CVODE: Tightening = Tightening(1e-4, SMALLEST);

/// For `cvode` in a system that does not slow down by itself (Adams, BDF): few steps lie between two events, their
/// errors shift the phase of everything later, and rounding does not add up.
const CVODE_ALONE_ADAMS: Tightening = Tightening(1e-5, 1e-15);
const CVODE_ALONE_BDF: Tightening = Tightening(5e-6, 5e-16);

/// For `cvode-bdf` without ringing: at order 2, in slip, two more digits would cost ten times the steps.
const BDF_QUIET: Tightening = Tightening(1.0, 1e-13);

/// For `cvode` with only the slow modes of stick and separation: only far later events follow, and the energies are
/// sums.
const CVODE_SLOW: Tightening = Tightening(1e-2, SMALLEST_SLIDING);

/// Time after the start of a slip, in shortest periods, in which guards of `cvode` count as being on their allowed
/// side. A multistep method begins with steps of 1e-11 s, after which the relative velocity is still below its
/// rounding.
const SETTLING: f64 = 1e-7;

/// A slip from rest within this share of the shortest period ends before a multistep method leaves order 1, at speeds
/// far below the tolerances. `cvode` lets ARKODE take it at order 8.
const BRIEF: f64 = 0.02;

/// An initial acceleration below this share of its change within a brief slip is rounding.
const DEPARTURE_NOISE: f64 = 1e-9;

/// Adams' method of `cvode`. With CVODE's own coefficient, 0.1, the iteration often ends after one round: an explicit
/// method, whose stability limits order and step.
const CVODE_ADAMS: CvodeOptions = CvodeOptions {
    convergence: Some(0.01),
    ..CvodeOptions::ADAMS
};

/// Size of the sliding angle, rad.
const SLIP: f64 = 1.0;

/// Absolute tolerance, in units of the relative tolerance times the size of a quantity.
const ABSOLUTE_SHARE: f64 = 0.1;

/// For `cvode`: a multistep method makes most of its errors at restarts, where a motion is still small.
const CVODE_ABSOLUTE_SHARE: f64 = 0.01;

/// For its twists and twist rates in a slip with a resolved oscillation: a kick may be small against the twist under
/// friction, and errors made while it is small grow with it.
const CVODE_RINGING_SHARE: f64 = 0.001;

/// |h lambda| of the slowest fast mode from which BDF of order 4 is stable near the imaginary axis (4.7, and a margin).
const STRIDE: f64 = 5.0;

/// Absolute tolerance of the slip displacement in strides of `cvode`, rad per `rtol`: nothing depends on it, and at
/// order 2 it alone would keep the step below a stride.
const STRIDING_SLIP: f64 = 20.0;

/// Absolute tolerances of energies and works in strides of `cvode`, per `rtol`; smaller ones would force steps below a
/// stride.
const STRIDING_ENERGY: f64 = 1e-4;

/// Smallest size relative to the whole case, for segments that begin at rest without a force.
const LEAST_SIZE: f64 = 1e-9;

/// Ratio of a mode's damping to the slowest motion at which explicit steps become too short. Costs are equal at 1e4 to
/// 1e5 for a mass on a belt with regularised friction.
const STIFF: f64 = 3e4;

/// Steps in a period of the fastest signal: a guard may move with a signal while the state stands still.
const STEPS_PER_PERIOD: f64 = 20.0;

#[derive(Debug, Clone)]
pub(super) struct SystemPlan {
    dynamics: Arc<SystemDynamics>,
    method: Method,
    rtol: f64,
    /// Size of every component of the state over the whole case, from the largest signals and the start.
    pub sizes: Vec<f64>,
    absolute: Vec<Option<f64>>,
    max_step: Option<f64>,
    fixed_step: Option<f64>,
    /// Period of the fastest motion, s; 1 if nothing moves by itself.
    pub period: f64,
    stiff: bool,
    /// Whether sliding slows down by itself, to a margin of stability.
    slows_down: bool,
    /// Whether steps stride over the fast modes once these have died.
    has_regimes: bool,
    stride: f64,
    quiet_sizes: Vec<f64>,
}

/// ARKODE's single method with which `arkode` follows a system that does not slow down by itself.
pub fn single_method(system: &System) -> Method {
    match SystemDynamics::new(system, 0.0).rates.stiffness > STIFF {
        true => Method::Esdirk,
        false => Method::Erk,
    }
}

fn bdf_of_order_2() -> SolverKind {
    let options = CvodeOptions {
        max_order: Some(2),
        ..CvodeOptions::BDF
    };
    SolverKind::Cvode { options, settling: 0.0 }
}

fn largest(system: &System, rotor: bool) -> Driving {
    let train = if rotor { &system.rotor } else { &system.stator };
    let speed = match &train.end {
        End::Driven(speed) => speed.largest(),
        _ => 0.0,
    };
    Driving {
        speed,
        acceleration: 0.0,
        torque: train.torque.as_ref().map_or(0.0, |torque| torque.signal.largest()),
    }
}

/// Size of every component of the state in the motion at `y` under `outside`: the twist under friction and torques, or
/// the present motion; zero if nothing acts and nothing moves. Later motion and friction beyond the present sliding
/// speed do not count: a size that is too small costs steps, one that is too large costs digits.
pub(super) fn sizes(dynamics: &SystemDynamics, stretch: usize, outside: &Outside, y: &[f64]) -> Vec<f64> {
    let system = &dynamics.system;
    let unit = dynamics.unit(stretch);
    let sliding = system.relative_velocity(outside, y).abs();
    let friction = system.larger_breakaway().1.max(system.law.typical_coefficient(sliding));
    let torque = friction * system.radius * outside.normal_force.max(0.0)
        + outside.rotor.torque.abs()
        + outside.stator.torque.abs();
    let speed = system.relative_velocity_terms(outside, y);
    let mut size = vec![0.0; system.dimension];
    let (mut angle, mut energy) = (speed * unit, torque * speed * unit);
    for side in [&system.rotor, &system.stator] {
        for i in 0..side.shafts() {
            let at = side.twists + 2 * i;
            let natural = (side.stiffness[i] / side.inertia[i]).sqrt();
            let twist = (torque / side.stiffness[i])
                .max(y[at].abs())
                .max(y[at + 1].abs() / natural);
            (size[at], size[at + 1]) = (twist, twist * natural);
            angle = angle.max(twist);
            energy = energy.max(side.stiffness[i] * twist * twist);
        }
        if let Some(index) = side.speed {
            let inertia: f64 = side.inertia.iter().copied().fold(0.0, f64::max);
            size[index] = speed.max(torque / inertia * unit);
        }
    }
    if let Engagement::Bristles(stiffness, .., at) = system.engagement {
        size[at] = friction / stiffness;
    }
    size[system.slip..].fill(energy);
    size[system.slip] = angle;
    if let Some(of_stator) = size.get_mut(system.slip + ANGLE) {
        *of_stator = angle;
    }
    size
}

/// Sizes for steps that stride over the fast modes. Twists grow with the force, so that present ones say nothing;
/// speeds have the size of the twist rates under friction, to which the sliding speed falls in the end.
fn quiet_sizes(dynamics: &SystemDynamics, sizes: &[f64], start: &[f64]) -> Vec<f64> {
    let system = &dynamics.system;
    let mut quiet = sizes.to_vec();
    let rate = system.twist_rates().map(|at| sizes[at]).fold(0.0, f64::max);
    for index in [system.rotor.speed, system.stator.speed].into_iter().flatten() {
        quiet[index] = rate / ABSOLUTE_SHARE;
    }
    let outside = dynamics.excitation.at(dynamics.excitation.stretch(0.0), 0.0);
    let energy = system.kinetic_energy(&outside, start) + system.elastic_energy(sizes);
    quiet[system.slip..].fill(energy / ABSOLUTE_SHARE);
    quiet[system.slip] = SLIP / ABSOLUTE_SHARE;
    if let Some(of_stator) = quiet.get_mut(system.slip + ANGLE) {
        *of_stator = SLIP / ABSOLUTE_SHARE;
    }
    quiet
}

impl SystemPlan {
    pub fn new(system: &System, dynamics: &Arc<SystemDynamics>, start: &[f64], options: &SolverOptions) -> SystemPlan {
        let outside = Outside {
            rotor: largest(system, true),
            stator: largest(system, false),
            normal_force: dynamics.excitation.largest_force(),
        };
        let system = &dynamics.system;
        let mut sizes = sizes(dynamics, dynamics.excitation.stretch(0.0), &outside, start);
        for size in &mut sizes {
            if !(*size > 0.0 && size.is_finite()) {
                *size = 1.0;
            }
        }
        let quiet_sizes = quiet_sizes(dynamics, &sizes, start);
        let mut absolute = vec![None; system.dimension];
        for side in [&system.rotor, &system.stator] {
            for i in 0..side.shafts() {
                let at = side.twists + 2 * i;
                (absolute[at], absolute[at + 1]) = (options.atol_twist, options.atol_rate);
            }
            if let Some(index) = side.speed {
                absolute[index] = options.atol_speed;
            }
        }
        let fastest = dynamics.rates.fastest;
        let stiff = dynamics.rates.stiffness > STIFF;
        let has_regimes = system.twice_resistance.is_some()
            && has_slow_manifold(system)
            && options.method != Method::Rk4
            && !(stiff && matches!(options.method, Method::Cvode | Method::CvodeBdf));
        SystemPlan {
            dynamics: dynamics.clone(),
            method: options.method,
            rtol: options.rtol,
            sizes,
            absolute,
            max_step: options.max_step,
            fixed_step: options.fixed_step,
            period: if fastest > 0.0 { TAU / fastest } else { 1.0 },
            stiff,
            slows_down: system.twice_resistance.is_some(),
            has_regimes,
            stride: match has_regimes && options.method == Method::Cvode {
                true => STRIDE / least_fast_frequency(system),
                false => f64::INFINITY,
            },
            quiet_sizes,
        }
    }

    pub fn regimes(&self, end_time: f64) -> Option<Regimes> {
        let steps = Steps {
            follows_smooth_sliding: self.method == Method::Series,
            integrates_linear_motion: self.method != Method::Series,
            stride: (self.method == Method::Cvode).then(|| Stride {
                step: self.stride,
                relative: CVODE.of(self.rtol),
            }),
        };
        let regimes = self.has_regimes.then(|| Regimes::new(&self.dynamics, end_time, steps));
        regimes.flatten()
    }

    /// Whether `series` looks ahead in a system that does not slow down by itself; useless if steps may not last `long`
    /// periods.
    pub fn looks_ahead(&self, long: f64) -> bool {
        let sprung = self.method == Method::Series && !self.slows_down && has_slow_manifold(&self.dynamics.system);
        sprung && self.max_step.is_none_or(|step| step >= long * self.period)
    }

    /// BDF for smooth sliding: order 2 over the fast modes, higher orders once the steps are long enough to be stable.
    fn striding_bdf(&self) -> SolverKind {
        SolverKind::Cvode {
            options: CvodeOptions {
                max_order: Some(4),
                short_steps: Some(ShortSteps {
                    max_order: 2,
                    until: self.stride,
                }),
                ..CvodeOptions::BDF
            },
            settling: 0.0,
        }
    }

    /// CVODE, which begins a slip with steps too short for a breakaway to rise above rounding. A stick may begin beyond
    /// its limit after a jump of the normal force, and ends at once.
    fn multistep(&self, options: CvodeOptions, mode: Mode) -> SolverKind {
        let settling = match mode {
            Mode::SlipForward | Mode::SlipBackward => SETTLING * self.period,
            _ => 0.0,
        };
        SolverKind::Cvode { options, settling }
    }

    /// Whether a slip from rest ends within [`BRIEF`] of the shortest period, by its expansion, or first goes back, as
    /// after a one-sided breakaway test: short first steps of a multistep method would take that for its end.
    fn wants_a_long_step(&self, location: &SystemLocation, t: f64, y: &[f64]) -> bool {
        let (dynamics, system) = (&self.dynamics, &self.dynamics.system);
        let outside = dynamics.outside(location, t);
        let rest = VELOCITY_NOISE * system.relative_velocity_terms(&outside, y);
        if location.mode.sense() == 0 || system.relative_velocity(&outside, y).abs() > rest {
            return false;
        }
        let mut expansion = Expansion::new(system, &dynamics.excitation);
        expansion.expand((system, &dynamics.excitation), location, t, y, BRIEF * self.period);
        // The root at zero is divided out, and a double one if the acceleration begins at zero.
        let mut speed = expansion.relative_velocity.map(|c| location.sign() * c);
        let change = speed[2..].iter().fold(0.0, |sum, c| sum + c.abs());
        if speed[1] < -DEPARTURE_NOISE * change {
            return true;
        }
        let roots = if speed[1].abs() <= DEPARTURE_NOISE * change {
            2
        } else {
            1
        };
        speed.rotate_left(roots);
        let kept = speed.len() - roots;
        speed[kept..].fill(0.0);
        change.is_finite() && speed[0] > 0.0 && first_falling(&speed).is_some()
    }

    /// The solver for a segment that begins at `t` (s) with the state `y`.
    pub fn solver(&self, location: &SystemLocation, t: f64, y: &[f64]) -> ChosenSolver {
        // `cvode`: a contact without stick is stiff at rest, even below the limit for steps of order 8.
        let implicit = self.stiff || location.mode == Mode::Engaged;
        let slips = location.mode.sense() != 0;
        let strides = slips && !location.resolved;
        let kind = match self.method {
            Method::Series if self.dynamics.has_closed_form(location, t, y) => SolverKind::ClosedForm,
            // Otherwise half of the steps of a run that stops would be in an uneventful stick.
            Method::Cvode | Method::Arkode if self.dynamics.stays_stuck(location, t, y) => SolverKind::ClosedForm,
            Method::Series => SolverKind::Series,
            Method::Arkode if self.stiff || strides => SolverKind::Esdirk,
            Method::Arkode | Method::Erk => SolverKind::Erk(Method::BEST_PAIR),
            Method::ErkPair(table) => SolverKind::Erk(table),
            Method::Esdirk => SolverKind::Esdirk,
            Method::CvodeAdams => self.multistep(CvodeOptions::ADAMS, location.mode),
            Method::Cvode if strides => self.striding_bdf(),
            // Beyond order 2 BDF is unstable near the imaginary axis, where the fast modes are.
            Method::CvodeBdf if strides => bdf_of_order_2(),
            Method::Cvode if self.wants_a_long_step(location, t, y) => match implicit {
                true => SolverKind::Esdirk,
                false => SolverKind::Erk(Method::BEST_PAIR),
            },
            Method::Cvode if !implicit => self.multistep(CVODE_ADAMS, location.mode),
            Method::Cvode | Method::CvodeBdf => self.multistep(CvodeOptions::BDF, location.mode),
            Method::Rk4 => SolverKind::Rk4,
            Method::Paper => unreachable!("the paper's procedure steps by itself"),
        };
        let relative = match kind {
            SolverKind::Series if !location.resolved && self.slows_down => SERIES_SLIDING.of(self.rtol),
            SolverKind::Series if self.slows_down => SERIES_RESOLVED.of(self.rtol),
            SolverKind::Series if !location.resolved => SERIES_STRIDING,
            SolverKind::Series | SolverKind::ClosedForm => SERIES_TOLERANCE,
            _ if strides && self.method == Method::Cvode => CVODE.of(self.rtol),
            _ if !location.resolved => match self.method {
                Method::CvodeBdf => BDF_QUIET.of(self.rtol),
                Method::Cvode => CVODE_SLOW.of(self.rtol),
                _ => SLIDING.of(self.rtol),
            },
            SolverKind::Erk(_) => EXPLICIT.of(self.rtol),
            _ if self.method != Method::Cvode => IMPLICIT.of(self.rtol),
            _ if self.has_regimes => CVODE.of(self.rtol),
            _ if implicit => CVODE_ALONE_BDF.of(self.rtol),
            _ => CVODE_ALONE_ADAMS.of(self.rtol),
        };
        let takes_fixed = matches!(kind, SolverKind::Erk(_) | SolverKind::Rk4);
        let fixed_step = self.fixed_step.filter(|_| takes_fixed);
        let fastest = self.dynamics.excitation.fastest(location.stretch);
        let of_signals = (fastest > 0.0 && kind != SolverKind::Series).then(|| TAU / fastest / STEPS_PER_PERIOD);
        // Errors of resolved steps are amplified until the first stick.
        let follows_modes = match self.method {
            Method::Arkode => self.slows_down && slips,
            _ => self.has_regimes && kind != SolverKind::Series,
        };
        let period = self
            .dynamics
            .natural_period()
            .filter(|_| follows_modes && location.resolved);
        let of_modes = period.map(|period| period / STEPS_PER_PERIOD * share_of_step(self.method));
        // Where a force sets in steeply, tolerances from its present size would be below the rounding of the time.
        let outside = match kind {
            SolverKind::Series | SolverKind::ClosedForm => self.dynamics.outside(location, t),
            _ => self.dynamics.excitation.ahead(location.stretch, t),
        };
        let present = sizes(&self.dynamics, location.stretch, &outside, y);
        let present = present
            .iter()
            .zip(&self.sizes)
            .map(|(size, most)| size.max(LEAST_SIZE * most));
        // If the motion comes to rest by itself, its largest size counts.
        let over_all = self.has_regimes && (!location.resolved || kind != SolverKind::Series);
        let present = present
            .zip(&self.quiet_sizes)
            .map(|(present, quiet)| if over_all { *quiet } else { present });
        let (first, rtol) = (self.dynamics.system.slip, self.rtol.max(SMALLEST_SLIDING));
        let share = |index: usize| match self.method {
            Method::Cvode if strides && index == first => STRIDING_SLIP * rtol * ABSOLUTE_SHARE / SLIP,
            Method::Cvode if strides && index > first => ABSOLUTE_SHARE * (STRIDING_ENERGY * rtol).max(SMALLEST),
            Method::Cvode if strides => ABSOLUTE_SHARE * relative,
            Method::Cvode if self.has_regimes && slips && index < first => CVODE_RINGING_SHARE * relative,
            Method::Cvode if !self.has_regimes => CVODE_ABSOLUTE_SHARE * relative,
            _ => ABSOLUTE_SHARE * relative,
        };
        let longest = [of_signals, of_modes, self.max_step];
        let longest = longest.into_iter().flatten().reduce(f64::min);
        ChosenSolver {
            kind,
            tolerances: Tolerances {
                relative,
                absolute: present
                    .zip(&self.absolute)
                    .enumerate()
                    .map(|(index, (size, set))| set.unwrap_or(share(index) * size))
                    .collect(),
            },
            max_step: longest.filter(|_| fixed_step.is_none()),
            fixed_step,
        }
    }
}

/// Factor near 1 on the longest step, different for each method. Thousands of equal steps change speed and clock by
/// equal amounts, whose sums are rounded in the same direction. With equal steps all methods would share this error,
/// and their distances would not show it.
fn share_of_step(method: Method) -> f64 {
    let number = match method {
        Method::Arkode | Method::Series | Method::Paper | Method::Rk4 => 0.0,
        Method::Erk | Method::ErkPair(_) => 1.0,
        Method::CvodeAdams => 2.0,
        Method::CvodeBdf => 3.0,
        Method::Esdirk => 4.0,
        Method::Cvode => 5.0,
    };
    1.0 - number / f64::from(1 << 20)
}
