//! Which solver integrates which location of a system, and how accurately.

use super::dynamics::{SystemDynamics, SystemLocation, VELOCITY_NOISE};
use super::expansion::Expansion;
use super::regime::{Regimes, Steps, Stride};
use crate::friction::Law;
use crate::hybrid::{ChosenSolver, SolverKind};
use crate::model::Mode;
use crate::model::equations::{ANGLE, Driving, Engagement, Outside};
use crate::model::slow_manifold::has_slow_manifold;
use crate::model::stability::least_fast_frequency;
use crate::model::system::{End, System};
use crate::numerics::polynomial_roots::first_falling;
use crate::simulation::options::{Method, SolverOptions};
use crate::sundials::{CvodeOptions, EsdirkTable, ShortSteps, Tolerances};
use std::f64::consts::TAU;
use std::sync::Arc;

/// The relative tolerance of a solver of SUNDIALS, as a multiple of `rtol`: the errors of some hundred steps between two
/// events add up.
const TIGHTENING: f64 = 0.01;

/// Below this step control fights with rounding.
const SMALLEST: f64 = 1e-14;

/// The same for CVODE and the implicit Runge-Kutta method, whose iterations end at the level of rounding.
const SMALLEST_IMPLICIT: f64 = 1e-13;

/// The same in smooth sliding that slows down by itself: errors there shift all events alike.
const SLIDING_TIGHTENING: f64 = 0.049;

/// Below this, steps of smooth sliding multiply, their rounding adds up, and nothing is gained.
const SMALLEST_SLIDING: f64 = 1e-12;

/// The same of series in a slip that slows down by itself, where a few digits more cost next to nothing: in smooth sliding, and where
/// the fast modes are resolved.
const SERIES_SLIDING_TIGHTENING: f64 = 0.01;
const SERIES_RESOLVED_TIGHTENING: f64 = 1e-6;
const SMALLEST_SERIES_SLIDING: f64 = 1e-12;
const SMALLEST_SERIES_RESOLVED: f64 = 1e-17;

/// The relative tolerance of long steps of series in a slip that does not slow down by itself.
const SERIES_STRIDING: f64 = 1e-14;

/// Of `cvode`, the relative tolerance as a multiple of `rtol`. A multistep method errs by some hundred tolerances in a
/// hundred restarts; below [`SMALLEST`] the rounding of many short steps takes what the tolerance gives.
const CVODE_TIGHTENING: f64 = 1e-4;

/// The same where a system does not slow down by itself, and its least value: few steps lie between two events, their errors
/// move the phase of all that follows, and rounding does not add up. By Adams' method, and by BDF.
const CVODE_ADAMS_TIGHTENING: f64 = 1e-5;
const SMALLEST_ADAMS: f64 = 1e-15;
const CVODE_BDF_TIGHTENING: f64 = 5e-6;
const SMALLEST_BDF: f64 = 5e-16;

/// Of the shortest period, for how long after its start a slip of `cvode` counts its guards as being on their allowed side. A
/// multistep method begins with steps of 1e-11 s, after which the relative velocity of a breakaway is not yet
/// above its rounding; a step of a one-step method is long past that.
const SETTLING: f64 = 1e-7;

/// A slip from rest that ends within this share of the shortest period is over before a multistep method has left its first
/// order. Its speed is then far below what the tolerances know. By `cvode`, ARKODE takes it at order 8.
const BRIEF: f64 = 0.02;

/// An acceleration that changes by more than its own multiple of this within a brief slip is zero at its start but for rounding.
const DEPARTURE_NOISE: f64 = 1e-9;

/// Adams' method of `cvode`. With CVODE's own coefficient, 0.1, its iteration often ends after one round: that
/// is an explicit method, whose stability holds order and step down.
const CVODE_ADAMS: CvodeOptions = CvodeOptions {
    convergence: Some(0.01),
    ..CvodeOptions::ADAMS
};

/// The relative tolerance of the series, at which a step errs by less than a rounding.
const SERIES_TOLERANCE: f64 = 1e-17;

/// The size of an angle that sliding turns through, rad.
const SLIP: f64 = 1.0;

/// Absolute tolerances are this share of the size of a quantity, times the relative tolerance.
const ABSOLUTE_SHARE: f64 = 0.1;

/// The same of `cvode`: a multistep method has most of its errors at its restarts, where a motion is still small.
const CVODE_ABSOLUTE_SHARE: f64 = 0.01;

/// The same of its twists and their rates in a slip whose oscillation is resolved. A kick may be small against the twist that the
/// friction torque causes, and it is the kick that grows: what a multistep method errs by while it is small grows with it.
const CVODE_RINGING_SHARE: f64 = 0.001;

/// |h lambda| of the slowest of the fast modes from which BDF of order 4 is stable near the imaginary axis (4.7), and a little.
const STRIDE: f64 = 5.0;

/// The absolute tolerance of the slip displacement in strides of `cvode`, rad, as a multiple of `rtol`: nothing depends on it, and of
/// order 2 it alone would hold the step below a stride.
const STRIDING_SLIP: f64 = 20.0;

/// The relative tolerance of `cvode-bdf` where nothing rings, as a multiple of `rtol`. Of order 2, in slip, it needs ten times the
/// steps for two digits.
const BDF_QUIET_TIGHTENING: f64 = 1.0;

/// The same of `cvode` for the slow modes of stick and separation alone, which no event follows but far later ones, and of which the energies are sums.
const CVODE_SLOW_TIGHTENING: f64 = 1e-2;

/// The absolute tolerances of energies and works in strides of `cvode`, as a multiple of `rtol`: with smaller ones the steps would
/// fall below a stride.
const STRIDING_ENERGY: f64 = 1e-4;

/// A size is no less than this share of that over the whole case: where a segment begins at rest without a force.
const LEAST_SIZE: f64 = 1e-9;

/// Where a mode is damped this much faster than the slowest one moves, explicit steps would be held short by a motion that is
/// over. The costs are equal at 1e4 to 1e5 for a mass on a belt with regularised friction.
const STIFF: f64 = 3e4;

/// Steps in a period of the fastest harmonic that acts: a guard may move with a signal while the state stands still.
const STEPS_PER_PERIOD: f64 = 20.0;

/// See the module.
#[derive(Debug, Clone)]
pub(super) struct SystemPlan {
    dynamics: Arc<SystemDynamics>,
    method: Method,
    rtol: f64,
    /// The size of every component of the state over the whole case, by its largest signals and its start.
    pub sizes: Vec<f64>,
    /// What the case sets as its absolute tolerance.
    absolute: Vec<Option<f64>>,
    max_step: Option<f64>,
    fixed_step: Option<f64>,
    /// The shortest period of any mode, s.
    period: f64,
    /// Slip, or an engaged contact, is stiff.
    stiff: bool,
    /// Sliding slows down by itself, to a margin of stability.
    slows_down: bool,
    /// Steps stride over the fast modes where these have died.
    has_regimes: bool,
    /// The shortest stride of `cvode`, s.
    stride: f64,
    /// What absolute tolerances of unresolved steps are shares of.
    quiet_sizes: Vec<f64>,
}

/// The single method of ARKODE by which `arkode` follows a system that does not slow down by itself.
pub(crate) fn single_method(system: &System) -> Method {
    match SystemDynamics::new(system, 0.0).rates.stiffness > STIFF {
        true => Method::Esdirk,
        false => Method::Erk,
    }
}

/// BDF that is stable near the imaginary axis.
fn bdf_of_order_2() -> SolverKind {
    let options = CvodeOptions {
        max_order: Some(2),
        ..CvodeOptions::BDF
    };
    SolverKind::Cvode { options, settling: 0.0 }
}

/// The largest speeds and torques that the signals of a side come to.
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

/// The size of every component of the state in a motion that is at `y` under `outside`: what friction and the torques twist a
/// shaft by, or its present motion; zero where nothing acts and nothing moves. Nothing that comes later enters, nor any
/// bound of the friction law beyond the present sliding speed: a size that is too small costs steps, one that is too large
/// costs digits.
pub(super) fn sizes(dynamics: &SystemDynamics, stretch: usize, outside: &Outside, y: &[f64]) -> Vec<f64> {
    let system = &dynamics.system;
    let unit = dynamics.unit(stretch);
    let sliding = system.relative_velocity(outside, y).abs();
    let friction = system.breakaway.max(system.law.typical_coefficient(sliding));
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

/// The same for steps that stride over the fast modes, from the sizes over the whole case and the start. Twists and their rates
/// grow with the force, so that those of now say nothing; speeds have the size of the twist rates that friction causes, which
/// the sliding speed falls to in the end.
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
        // Of what is stiff by itself BDF follows every mode.
        let has_regimes = system.twice_resistance.is_some()
            && has_slow_manifold(system)
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

    /// Where steps have to resolve the fast modes.
    pub fn regimes(&self, end_time: f64) -> Option<Regimes> {
        let steps = Steps {
            follows_smooth_sliding: self.method == Method::Series,
            integrates_linear_motion: self.method != Method::Series,
            stride: (self.method == Method::Cvode).then(|| Stride {
                step: self.stride,
                relative: (CVODE_TIGHTENING * self.rtol).max(SMALLEST),
            }),
        };
        let regimes = self.has_regimes.then(|| Regimes::new(&self.dynamics, end_time, steps));
        regimes.flatten()
    }

    /// Whether `series` looks ahead in a system that does not slow down by itself: it need not where steps may not last `long`
    /// periods of the fastest mode.
    pub fn looks_ahead(&self, long: f64) -> bool {
        let sprung = self.method == Method::Series && !self.slows_down && has_slow_manifold(&self.dynamics.system);
        sprung && self.max_step.is_none_or(|step| step >= long * self.period)
    }

    /// BDF for smooth sliding: over the fast modes at order 2, and higher once the steps are long enough to be stable.
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

    /// CVODE, which begins a slip with steps far below the time that a breakaway takes to rise above rounding. A stick may begin
    /// beyond its limit, where the normal force has jumped, and ends at once.
    fn multistep(&self, options: CvodeOptions, mode: Mode) -> SolverKind {
        let settling = match mode {
            Mode::SlipForward | Mode::SlipBackward => SETTLING * self.period,
            _ => 0.0,
        };
        SolverKind::Cvode { options, settling }
    }

    /// Whether a slip that begins at rest ends within [`BRIEF`] of the shortest period, by its expansion, or goes back first, as a
    /// one-sided breakaway test lets it: the short first steps of a multistep method would see that as its end.
    fn wants_a_long_step(&self, location: &SystemLocation, t: f64, y: &[f64]) -> bool {
        let (dynamics, system) = (&self.dynamics, &self.dynamics.system);
        let outside = dynamics.outside(location, t);
        let rest = VELOCITY_NOISE * system.relative_velocity_terms(&outside, y);
        if location.mode.sense() == 0 || system.relative_velocity(&outside, y).abs() > rest {
            return false;
        }
        let mut expansion = Expansion::new(system, &dynamics.excitation);
        expansion.expand((system, &dynamics.excitation), location, t, y, BRIEF * self.period);
        // It leaves zero here: the root is divided out, and a double one where the acceleration begins at zero.
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

    /// For a segment that begins at `t` (s) with the state `y`.
    pub fn solver(&self, location: &SystemLocation, t: f64, y: &[f64]) -> ChosenSolver {
        // Of `cvode`: a contact without stick is stiff at rest, below what counts as stiff for the steps of order 8.
        let implicit = self.stiff || location.mode == Mode::Engaged;
        let slips = location.mode.sense() != 0;
        let strides = slips && !location.resolved;
        let esdirk = SolverKind::Esdirk(EsdirkTable::Esdirk547L2sa2_7s45);
        let kind = match self.method {
            Method::Series if self.dynamics.has_closed_form(location, t, y) => SolverKind::ClosedForm,
            // Half of the steps of a run that stops would be in a stick in which nothing happens any more.
            Method::Cvode | Method::Arkode if self.dynamics.stays_stuck(location, t, y) => SolverKind::ClosedForm,
            Method::Series => SolverKind::Series,
            Method::Arkode if self.stiff || strides => esdirk,
            Method::Arkode | Method::Erk => SolverKind::Erk(Method::BEST_PAIR),
            Method::ErkPair(table) => SolverKind::Erk(table),
            Method::Esdirk => esdirk,
            Method::CvodeAdams => self.multistep(CvodeOptions::ADAMS, location.mode),
            Method::Cvode if strides => self.striding_bdf(),
            // Beyond order 2 BDF is unstable near the imaginary axis, where the fast modes are.
            Method::CvodeBdf if strides => bdf_of_order_2(),
            Method::Cvode if self.wants_a_long_step(location, t, y) => match implicit {
                true => esdirk,
                false => SolverKind::Erk(Method::BEST_PAIR),
            },
            Method::Cvode if !implicit => self.multistep(CVODE_ADAMS, location.mode),
            Method::Cvode | Method::CvodeBdf => self.multistep(CvodeOptions::BDF, location.mode),
            Method::Paper => unreachable!("the paper's procedure steps by itself"),
        };
        let relative = match kind {
            SolverKind::Series if !location.resolved && self.slows_down => {
                (SERIES_SLIDING_TIGHTENING * self.rtol).max(SMALLEST_SERIES_SLIDING)
            }
            SolverKind::Series if self.slows_down => {
                (SERIES_RESOLVED_TIGHTENING * self.rtol).max(SMALLEST_SERIES_RESOLVED)
            }
            SolverKind::Series if !location.resolved => SERIES_STRIDING,
            SolverKind::Series | SolverKind::ClosedForm => SERIES_TOLERANCE,
            _ if strides && self.method == Method::Cvode => (CVODE_TIGHTENING * self.rtol).max(SMALLEST),
            _ if !location.resolved && self.method == Method::CvodeBdf => {
                (BDF_QUIET_TIGHTENING * self.rtol).max(SMALLEST_IMPLICIT)
            }
            _ if !location.resolved && self.method == Method::Cvode => {
                (CVODE_SLOW_TIGHTENING * self.rtol).max(SMALLEST_SLIDING)
            }
            _ if !location.resolved => (SLIDING_TIGHTENING * self.rtol).max(SMALLEST_SLIDING),
            SolverKind::Erk(_) => (TIGHTENING * self.rtol).max(SMALLEST),
            _ if self.method == Method::Cvode && self.has_regimes => (CVODE_TIGHTENING * self.rtol).max(SMALLEST),
            _ if self.method == Method::Cvode && implicit => (CVODE_BDF_TIGHTENING * self.rtol).max(SMALLEST_BDF),
            _ if self.method == Method::Cvode => (CVODE_ADAMS_TIGHTENING * self.rtol).max(SMALLEST_ADAMS),
            _ => (TIGHTENING * self.rtol).max(SMALLEST_IMPLICIT),
        };
        let fixed_step = self.fixed_step.filter(|_| matches!(kind, SolverKind::Erk(_)));
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
        let present = sizes(&self.dynamics, location.stretch, &self.dynamics.outside(location, t), y);
        let present = present
            .iter()
            .zip(&self.sizes)
            .map(|(size, most)| size.max(LEAST_SIZE * most));
        // The errors of a motion that comes to rest by itself count against the largest that it has.
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

    /// So many transitions within this time are chattering, s.
    pub fn chatter_window(&self) -> f64 {
        0.05 * self.period
    }
}

/// What the longest step is multiplied by, a number near 1 of each method's own. Thousands of steps of one length change
/// the rotor's speed and the clock by the same amount each, so that their sums are rounded in the same direction over and
/// over. Of methods with the same step the errors would be the same, and no distance between them would tell.
fn share_of_step(method: Method) -> f64 {
    let number = match method {
        Method::Arkode | Method::Series | Method::Paper => 0.0,
        Method::Erk | Method::ErkPair(_) => 1.0,
        Method::CvodeAdams => 2.0,
        Method::CvodeBdf => 3.0,
        Method::Esdirk => 4.0,
        Method::Cvode => 5.0,
    };
    1.0 - number / f64::from(1 << 20)
}
