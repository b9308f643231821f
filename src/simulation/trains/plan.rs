//! Which solver integrates which location of two trains, and how accurately.

use super::dynamics::{TrainDynamics, TrainLocation};
use crate::friction::Law;
use crate::hybrid::{ChosenSolver, SolverKind};
use crate::model::Mode;
use crate::model::trains::system::{Driving, Engagement, Outside, Side};
use crate::model::trains::{End, Trains};
use crate::simulation::options::{Method, SolverOptions};
use crate::sundials::{EsdirkTable, Tolerances};
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

/// Absolute tolerances are this share of the size of a quantity.
const ABSOLUTE_SHARE: f64 = 0.1;

/// Where a mode is damped this much faster than the slowest one moves, explicit steps would be held short by a motion that is
/// over.
const STIFF: f64 = 1e5;

/// Steps in a period of the fastest harmonic that acts: a guard may move with a signal while the state stands still.
const STEPS_PER_PERIOD: f64 = 20.0;

/// See the module.
#[derive(Debug, Clone)]
pub(super) struct TrainPlan {
    dynamics: Arc<TrainDynamics>,
    method: Method,
    rtol: f64,
    /// The size of every component of the state.
    scale: Vec<f64>,
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

impl TrainPlan {
    pub fn new(trains: &Trains, dynamics: &Arc<TrainDynamics>, start: &[f64], options: &SolverOptions) -> TrainPlan {
        let system = &dynamics.system;
        let law = &system.law;
        let force = dynamics.excitation.largest_force();
        let outside = Outside {
            rotor: largest(trains, true),
            stator: largest(trains, false),
            normal_force: force,
        };
        let friction = system.breakaway.max(law.typical_coefficient()) * system.radius * force;
        let torque = friction + outside.rotor.torque + outside.stator.torque;
        let initial = system.kinetic_energy(&Outside::default(), start) + system.elastic_energy(start);
        let mut scale = vec![0.0; system.dimension];
        let mut absolute = vec![None; system.dimension];
        let mut energy: f64 = initial;
        let speed = outside.rotor.speed.max(outside.stator.speed);
        let sides: [(&Side, f64); 2] = [
            (&system.rotor, outside.rotor.speed),
            (&system.stator, outside.stator.speed),
        ];
        for (side, speed) in sides {
            let inertia: f64 = side.inertia.iter().copied().fold(0.0, f64::max);
            for i in 0..side.shafts() {
                let at = side.twists + 2 * i;
                let natural = (side.stiffness[i] / side.inertia[i]).sqrt();
                let twist = (torque / side.stiffness[i])
                    .max(start[at].abs())
                    .max(start[at + 1].abs() / natural);
                scale[at] = twist;
                scale[at + 1] = twist * natural;
                (absolute[at], absolute[at + 1]) = (options.atol_twist, options.atol_rate);
                energy = energy.max(side.stiffness[i] * twist * twist);
            }
            if let Some(index) = side.speed {
                absolute[index] = options.atol_speed;
                let own = dynamics.slowest_rate();
                scale[index] = start[index].abs().max(speed).max(torque / (inertia * own));
                energy = energy.max(inertia * scale[index].powi(2));
            }
        }
        energy = energy.max(torque * speed / dynamics.slowest_rate());
        let fallback = |value: f64| if value > 0.0 && value.is_finite() { value } else { 1.0 };
        for value in &mut scale {
            *value = fallback(*value);
        }
        if let Engagement::Bristles(stiffness, .., at) = system.engagement {
            scale[at] = law.typical_coefficient() / stiffness;
        }
        for (k, value) in scale[system.slip..].iter_mut().enumerate() {
            *value = if k == 0 { 1.0 } else { fallback(energy) };
        }
        let slopes = law.slope_bounds(0.0, f64::INFINITY);
        let fastest = dynamics.fastest_rate();
        TrainPlan {
            dynamics: dynamics.clone(),
            method: options.method,
            rtol: options.rtol,
            scale,
            absolute,
            max_step: options.max_step,
            fixed_step: options.fixed_step,
            period: if fastest > 0.0 { TAU / fastest } else { 1.0 },
            linear_slip: !dynamics.is_engaged() && slopes.least == 0.0 && slopes.most == 0.0,
            stiff: dynamics.stiffness() > STIFF,
        }
    }

    /// The size of every component of the state.
    pub fn sizes(&self) -> &[f64] {
        &self.scale
    }

    /// Whether `auto` takes a location by its series: it is linear.
    fn is_linear(&self, location: &TrainLocation) -> bool {
        match location.mode {
            Mode::Stick | Mode::Separated => true,
            Mode::SlipForward | Mode::SlipBackward => self.linear_slip,
            Mode::Engaged => false,
        }
    }

    pub fn solver(&self, location: &TrainLocation) -> ChosenSolver {
        let esdirk = SolverKind::Esdirk(EsdirkTable::Esdirk547L2sa2_7s45);
        let kind = match self.method {
            Method::Series => SolverKind::Series,
            Method::Auto if self.is_linear(location) => SolverKind::Series,
            Method::Auto if self.stiff => esdirk,
            Method::Auto | Method::Erk => SolverKind::Erk(Method::BEST_PAIR),
            Method::ErkPair(table) => SolverKind::Erk(table),
            Method::Esdirk => esdirk,
            Method::CvodeAdams => SolverKind::CvodeAdams,
            Method::Cvode | Method::CvodeBdf => SolverKind::CvodeBdf { max_order: 5 },
            Method::Paper => unreachable!("a case of trains does not have the paper's procedure"),
        };
        let relative = match kind {
            SolverKind::Series => SERIES_TOLERANCE,
            SolverKind::Erk(_) => (TIGHTENING * self.rtol).max(SMALLEST),
            _ => (TIGHTENING * self.rtol).max(SMALLEST_IMPLICIT),
        };
        let fixed_step = self.fixed_step.filter(|_| matches!(kind, SolverKind::Erk(_)));
        let fastest = self.dynamics.excitation.fastest(location.stretch);
        let of_signals = (fastest > 0.0 && kind != SolverKind::Series).then(|| TAU / fastest / STEPS_PER_PERIOD);
        let longest = of_signals.into_iter().chain(self.max_step).reduce(f64::min);
        ChosenSolver {
            kind,
            tolerances: Tolerances {
                relative,
                absolute: self
                    .scale
                    .iter()
                    .zip(&self.absolute)
                    .map(|(size, set)| set.unwrap_or(ABSOLUTE_SHARE * relative * size))
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
