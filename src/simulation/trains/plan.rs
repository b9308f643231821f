//! Which solver integrates which location of two trains, and how accurately.

use super::dynamics::{TrainDynamics, TrainLocation};
use super::regime::Regimes;
use crate::friction::Law;
use crate::hybrid::{ChosenSolver, SolverKind};
use crate::model::Mode;
use crate::model::trains::system::{ANGLE, Driving, Engagement, Outside};
use crate::model::trains::{End, Trains};
use crate::simulation::options::{Method, SolverOptions};
use crate::simulation::plan::{
    CVODE_ADAMS, CVODE_TIGHTENING, SERIES_RESOLVED_TIGHTENING, SERIES_SLIDING_TIGHTENING, SETTLING, SLIDING_TIGHTENING,
    SMALLEST_SERIES_RESOLVED, SMALLEST_SERIES_SLIDING, SMALLEST_SLIDING,
};
use crate::sundials::{CvodeOptions, EsdirkTable, Tolerances};
use std::f64::consts::TAU;
use std::sync::Arc;

/// The relative tolerance of a solver of SUNDIALS, as a multiple of `rtol`: the errors of some hundred steps between two
/// events add up.
const TIGHTENING: f64 = 0.01;

/// Below this step control fights with rounding.
const SMALLEST: f64 = 1e-14;

/// The same for CVODE and the implicit Runge-Kutta method, whose iterations end at the level of rounding.
const SMALLEST_IMPLICIT: f64 = 1e-13;

/// The relative tolerance of the series, at which a step errs by less than a rounding.
const SERIES_TOLERANCE: f64 = 1e-17;

/// The size of an angle that sliding turns through, rad.
const SLIP: f64 = 1.0;

/// Absolute tolerances are this share of the size of a quantity, times the relative tolerance.
const ABSOLUTE_SHARE: f64 = 0.1;

/// The same of `cvode`: a multistep method has most of its errors at its restarts, where a motion is still small.
const CVODE_ABSOLUTE_SHARE: f64 = 0.01;

/// Relative tolerance of `cvode` in a contact without stick, as a multiple of `rtol`, and its least value. A contact at rest
/// creeps, and errors of the creep move the next slip.
const ENGAGED_TIGHTENING: f64 = 2e-4;
const SMALLEST_ENGAGED: f64 = 1e-14;

/// A size is no less than this share of that over the whole case: where a segment begins at rest without a force.
const LEAST_SIZE: f64 = 1e-9;

/// Where a mode is damped this much faster than the slowest one moves, explicit steps would be held short by a motion that is
/// over. The costs are equal at 1e4 to 1e5 for a mass on a belt with regularised friction.
const STIFF: f64 = 3e4;

/// Steps in a period of the fastest harmonic that acts: a guard may move with a signal while the state stands still.
const STEPS_PER_PERIOD: f64 = 20.0;

/// See the module.
#[derive(Debug, Clone)]
pub(super) struct TrainPlan {
    dynamics: Arc<TrainDynamics>,
    method: Method,
    rtol: f64,
    /// The size of every component of the state over the whole case, by its largest signals and its start.
    sizes: Vec<f64>,
    /// What the case sets as its absolute tolerance.
    absolute: Vec<Option<f64>>,
    max_step: Option<f64>,
    fixed_step: Option<f64>,
    /// The shortest period of any mode, s.
    period: f64,
    /// Slip is linear.
    linear_slip: bool,
    /// Slip, or an engaged contact, is stiff.
    stiff: bool,
    /// Sliding slows down by itself, to a margin of stability.
    slows_down: bool,
    /// What absolute tolerances of unresolved steps are shares of.
    quiet_sizes: Vec<f64>,
}

/// The method by which `auto` takes what is not linear; it takes nothing by series.
pub(crate) fn method_without_series(trains: &Trains) -> Method {
    match TrainDynamics::new(trains, 0.0).stiffness() > STIFF {
        true => Method::Esdirk,
        false => Method::Erk,
    }
}

/// The largest speeds and torques that the signals of a side come to.
fn largest(trains: &Trains, rotor: bool) -> Driving {
    let train = if rotor { &trains.rotor } else { &trains.stator };
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
fn sizes(dynamics: &TrainDynamics, stretch: usize, outside: &Outside, y: &[f64]) -> Vec<f64> {
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
fn quiet_sizes(dynamics: &TrainDynamics, sizes: &[f64], start: &[f64]) -> Vec<f64> {
    let system = &dynamics.system;
    let mut quiet = sizes.to_vec();
    let sides = [&system.rotor, &system.stator];
    let rates = sides
        .iter()
        .flat_map(|side| (0..side.shafts()).map(|i| side.twists + 2 * i + 1));
    let rate = rates.map(|at| sizes[at]).fold(0.0, f64::max);
    for index in sides.iter().filter_map(|side| side.speed) {
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

impl TrainPlan {
    pub fn new(trains: &Trains, dynamics: &Arc<TrainDynamics>, start: &[f64], options: &SolverOptions) -> TrainPlan {
        let system = &dynamics.system;
        let outside = Outside {
            rotor: largest(trains, true),
            stator: largest(trains, false),
            normal_force: dynamics.excitation.largest_force(),
        };
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
        let slopes = system.law.slope_bounds(0.0, f64::INFINITY);
        let fastest = dynamics.fastest_rate();
        TrainPlan {
            dynamics: dynamics.clone(),
            method: options.method,
            rtol: options.rtol,
            sizes,
            absolute,
            max_step: options.max_step,
            fixed_step: options.fixed_step,
            period: if fastest > 0.0 { TAU / fastest } else { 1.0 },
            linear_slip: !dynamics.is_engaged() && slopes.least == 0.0 && slopes.most == 0.0,
            stiff: dynamics.stiffness() > STIFF,
            slows_down: system.twice_resistance.is_some(),
            quiet_sizes,
        }
    }

    /// Where steps have to resolve the fast modes, of a method that can stride over them.
    pub fn regimes(&self, end_time: f64) -> Option<Regimes> {
        match self.method {
            Method::Series | Method::Auto => Regimes::new(&self.dynamics, end_time, self.method == Method::Series),
            _ => None,
        }
    }

    /// The size of every component of the state over the whole case.
    pub fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// Whether `auto` takes a location by its series: it is linear.
    fn is_linear(&self, location: &TrainLocation) -> bool {
        match location.mode {
            Mode::Stick | Mode::Separated => true,
            Mode::SlipForward | Mode::SlipBackward => self.linear_slip,
            Mode::Engaged => false,
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

    /// For a segment that begins at `t` (s) with the state `y`.
    pub fn solver(&self, location: &TrainLocation, t: f64, y: &[f64]) -> ChosenSolver {
        // Of `cvode`: a contact without stick is stiff at rest, below what counts as stiff for the steps of order 8.
        let implicit = self.stiff || location.mode == Mode::Engaged;
        let esdirk = SolverKind::Esdirk(EsdirkTable::Esdirk547L2sa2_7s45);
        let exact = matches!(self.method, Method::Auto | Method::Series);
        let kind = match self.method {
            _ if exact && self.dynamics.has_closed_form(location, t, y) => SolverKind::ClosedForm,
            Method::Series => SolverKind::Series,
            Method::Auto if self.is_linear(location) => SolverKind::Series,
            Method::Auto if self.stiff || !location.resolved => esdirk,
            Method::Auto | Method::Erk => SolverKind::Erk(Method::BEST_PAIR),
            Method::ErkPair(table) => SolverKind::Erk(table),
            Method::Esdirk => esdirk,
            Method::CvodeAdams => self.multistep(CvodeOptions::ADAMS, location.mode),
            Method::Cvode if !implicit => self.multistep(CVODE_ADAMS, location.mode),
            Method::Cvode | Method::CvodeBdf => self.multistep(CvodeOptions::BDF, location.mode),
            Method::Paper => unreachable!("a case of trains does not have the paper's procedure"),
        };
        let relative = match kind {
            SolverKind::Series if !location.resolved => {
                (SERIES_SLIDING_TIGHTENING * self.rtol).max(SMALLEST_SERIES_SLIDING)
            }
            SolverKind::Series if self.slows_down => {
                (SERIES_RESOLVED_TIGHTENING * self.rtol).max(SMALLEST_SERIES_RESOLVED)
            }
            SolverKind::Series | SolverKind::ClosedForm => SERIES_TOLERANCE,
            _ if !location.resolved => (SLIDING_TIGHTENING * self.rtol).max(SMALLEST_SLIDING),
            SolverKind::Erk(_) => (TIGHTENING * self.rtol).max(SMALLEST),
            _ if self.method == Method::Cvode && location.mode == Mode::Engaged => {
                (ENGAGED_TIGHTENING * self.rtol).max(SMALLEST_ENGAGED)
            }
            _ if self.method == Method::Cvode => {
                (CVODE_TIGHTENING * self.rtol).max(if implicit { SMALLEST_IMPLICIT } else { SMALLEST })
            }
            _ => (TIGHTENING * self.rtol).max(SMALLEST_IMPLICIT),
        };
        let fixed_step = self.fixed_step.filter(|_| matches!(kind, SolverKind::Erk(_)));
        let fastest = self.dynamics.excitation.fastest(location.stretch);
        let of_signals = (fastest > 0.0 && kind != SolverKind::Series).then(|| TAU / fastest / STEPS_PER_PERIOD);
        // As for a brake: errors of resolved steps are amplified until the first stick.
        let follows_modes = self.method == Method::Auto && self.slows_down && location.mode.sense() != 0;
        let period = self
            .dynamics
            .natural_period()
            .filter(|_| follows_modes && location.resolved);
        let of_modes = period.map(|period| period / STEPS_PER_PERIOD);
        let present = sizes(&self.dynamics, location.stretch, &self.dynamics.outside(location, t), y);
        let present = present
            .iter()
            .zip(&self.sizes)
            .map(|(size, most)| size.max(LEAST_SIZE * most));
        let present = present
            .zip(&self.quiet_sizes)
            .map(|(present, quiet)| match location.resolved {
                true => present,
                false => *quiet,
            });
        let share = match self.method {
            Method::Cvode => CVODE_ABSOLUTE_SHARE,
            _ => ABSOLUTE_SHARE,
        };
        let longest = [of_signals, of_modes, self.max_step];
        let longest = longest.into_iter().flatten().reduce(f64::min);
        ChosenSolver {
            kind,
            tolerances: Tolerances {
                relative,
                absolute: present
                    .zip(&self.absolute)
                    .map(|(size, set)| set.unwrap_or(share * relative * size))
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
