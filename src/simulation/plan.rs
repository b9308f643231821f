//! Which solver integrates which location, and how accurately: the one home of every tolerance.

use super::brake::Location;
use super::options::{Method, SolverOptions};
use crate::hybrid::{ChosenSolver, SolverKind};
use crate::model::torsion::{DIMENSION, TorsionModel, index};
use crate::model::{Mode, Parameters};
use crate::sundials::{EsdirkTable, Tolerances};

/// Absolute tolerance of the slip displacement at relative tolerance 1, rad.
const SLIP_SCALE: f64 = 1.0;

/// Least number of steps in a natural period where the fast mode is resolved. With it the step, not the tolerance,
/// decides the error of the order-8 method: 1e-12 s on the reference cases; 14 steps give 5e-12 s.
const STEPS_PER_PERIOD: f64 = 20.0;

/// The solver's relative tolerance in smooth sliding, as a multiple of `rtol`: its errors shift all events alike.
const SLIDING_TIGHTENING: f64 = 0.05;

/// The same where the fast mode is resolved: there an error is amplified until the first stick.
const RESOLVED_TIGHTENING: f64 = 0.01;

/// Below these, step control fights with rounding: steps multiply, their rounding adds up, and nothing is gained.
const SMALLEST_SLIDING: f64 = 1e-12;
const SMALLEST_RESOLVED: f64 = 1e-14;

/// The same for BDF in every phase.
const SMALLEST_BDF: f64 = 1e-13;

/// The same for the series, where a few digits more cost next to nothing.
const SERIES_SLIDING_TIGHTENING: f64 = 0.01;
const SERIES_RESOLVED_TIGHTENING: f64 = 1e-6;
const SMALLEST_SERIES_SLIDING: f64 = 1e-12;
const SMALLEST_SERIES_RESOLVED: f64 = 1e-17;

/// The solver settings of one run.
#[derive(Debug, Clone)]
pub struct Plan {
    method: Method,
    rtol: f64,
    /// Absolute tolerances at relative tolerance 1 of twist, rate and speed.
    scale: [f64; 3],
    /// Absolute tolerance of the dissipated energies at relative tolerance 1, J.
    energy: f64,
    /// As the user set them.
    absolute: [Option<f64>; 3],
    max_step: Option<f64>,
    fixed_step: Option<f64>,
    /// T_n, s.
    period: f64,
}

impl Plan {
    pub fn new(parameters: &Parameters, largest_force: f64, options: &SolverOptions) -> Self {
        let model = TorsionModel::new(parameters);
        // What the friction torque twists a disk by, and the velocity of an oscillation of that amplitude.
        let friction = parameters.friction.low_speed.max(parameters.friction.high_speed);
        let twist = friction * parameters.contact.radius * largest_force / parameters.torsion.stiffness;
        let twist = if twist > 0.0 { twist } else { 1e-6 };
        let speed = twist * model.natural_angular_frequency();
        Plan {
            method: options.method,
            rtol: options.rtol,
            scale: [0.1 * twist, 0.1 * speed, speed],
            energy: 0.5 * parameters.torsion.rotor_inertia * (parameters.initial.speed.powi(2) + speed.powi(2)),
            absolute: [options.atol_twist, options.atol_rate, options.atol_speed],
            max_step: options.max_step,
            fixed_step: options.fixed_step,
            period: model.natural_period(),
        }
    }

    /// Whether the location is taken in closed form.
    pub fn closed_form(&self, mode: Mode) -> bool {
        matches!(self.method, Method::Auto | Method::Series) && matches!(mode, Mode::Stick | Mode::Separated)
    }

    /// Whether the method stays on smooth sliding even where that is unstable.
    pub fn follows_smooth_sliding(&self) -> bool {
        self.method == Method::Series
    }

    pub fn solver(&self, location: &Location) -> ChosenSolver {
        let kind = if self.closed_form(location.mode) {
            SolverKind::ClosedForm
        } else {
            match (self.method, location.resolved) {
                (Method::Auto, true) | (Method::Erk, _) => SolverKind::Erk(Method::BEST_PAIR),
                (Method::ErkPair(table), _) => SolverKind::Erk(table),
                (Method::Auto, false) | (Method::Esdirk, _) => SolverKind::Esdirk(EsdirkTable::Esdirk547L2sa2_7s45),
                // Beyond order 2 BDF is unstable near the imaginary axis, where the fast mode is, if it is not resolved.
                (Method::CvodeBdf, false) if location.mode != Mode::Stick => SolverKind::CvodeBdf { max_order: 2 },
                (Method::CvodeBdf, _) => SolverKind::CvodeBdf { max_order: 5 },
                (Method::CvodeAdams, _) => SolverKind::CvodeAdams,
                (Method::Series, _) => SolverKind::Series,
                (Method::Paper, _) => unreachable!("the paper's procedure steps by itself"),
            }
        };
        if self.method == Method::Series {
            let rtol = if location.resolved {
                (SERIES_RESOLVED_TIGHTENING * self.rtol).max(SMALLEST_SERIES_RESOLVED)
            } else {
                (SERIES_SLIDING_TIGHTENING * self.rtol).max(SMALLEST_SERIES_SLIDING)
            };
            return ChosenSolver {
                kind,
                tolerances: self.tolerances(rtol),
                max_step: self.max_step,
                fixed_step: None,
            };
        }
        let bdf = self.method == Method::CvodeBdf;
        let rtol = match (location.resolved, bdf) {
            (true, true) => (RESOLVED_TIGHTENING * self.rtol).max(SMALLEST_BDF),
            (true, false) => (RESOLVED_TIGHTENING * self.rtol).max(SMALLEST_RESOLVED),
            // Of order 2 it needs ten times the steps for two digits.
            (false, true) => self.rtol.max(SMALLEST_BDF),
            (false, false) => (SLIDING_TIGHTENING * self.rtol).max(SMALLEST_SLIDING),
        };
        let bound = location
            .resolved
            .then_some(self.period / STEPS_PER_PERIOD * self.share_of_step());
        let max_step = match (bound, self.max_step) {
            _ if self.fixed_step.is_some() => None,
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        ChosenSolver {
            kind,
            tolerances: self.tolerances(rtol),
            max_step,
            fixed_step: self.fixed_step,
        }
    }

    /// What the longest step is multiplied by, a number near 1 of each method's own. Thousands of steps of one length change
    /// the rotor's speed and the clock by the same amount each, so that their sums are rounded in the same direction over and
    /// over. Of methods with the same step the errors would be the same, and no distance between them would tell.
    fn share_of_step(&self) -> f64 {
        let number = match self.method {
            Method::Auto | Method::Series | Method::Paper => 0.0,
            Method::Erk | Method::ErkPair(_) => 1.0,
            Method::CvodeAdams => 2.0,
            Method::CvodeBdf => 3.0,
            Method::Esdirk => 4.0,
        };
        1.0 - number / f64::from(1 << 20)
    }

    fn tolerances(&self, rtol: f64) -> Tolerances {
        let [twist, rate, speed] = std::array::from_fn(|k| self.absolute[k].unwrap_or(rtol * self.scale[k]));
        let mut absolute = vec![rtol * self.energy; DIMENSION];
        absolute[index::SLIP] = rtol * SLIP_SCALE;
        absolute[index::ROTOR_TWIST] = twist;
        absolute[index::STATOR_TWIST] = twist;
        absolute[index::ROTOR_TWIST_RATE] = rate;
        absolute[index::STATOR_TWIST_RATE] = rate;
        absolute[index::ROTOR_SPEED] = speed;
        Tolerances {
            relative: rtol,
            absolute,
        }
    }
}
