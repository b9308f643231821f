//! Which solver integrates which location, and how accurately: the one home of every tolerance.

use super::brake::Location;
use super::options::{Method, SolverOptions};
use crate::friction::Law;
use crate::hybrid::{ChosenSolver, SolverKind};
use crate::model::state::{MEASURES, Measure};
use crate::model::torsion::TorsionModel;
use crate::model::{Mode, Parameters};
use crate::sundials::{CvodeOptions, EsdirkTable, ShortSteps, Tolerances};
use std::f64::consts::TAU;

/// Absolute tolerance of the slip displacement at relative tolerance 1, rad.
const SLIP_SCALE: f64 = 1.0;

/// Least number of steps in a natural period where the fast mode is resolved. With it the step, not the tolerance,
/// decides the error of the order-8 method: 1e-12 s on the reference cases; 14 steps give 5e-12 s.
const STEPS_PER_PERIOD: f64 = 20.0;

/// The solver's relative tolerance in smooth sliding, as a multiple of `rtol`: its errors shift all events alike.
pub(super) const SLIDING_TIGHTENING: f64 = 0.049;

/// The same where the fast mode is resolved: there an error is amplified until the first stick.
const RESOLVED_TIGHTENING: f64 = 0.01;

/// Below these, step control fights with rounding: steps multiply, their rounding adds up, and nothing is gained.
pub(super) const SMALLEST_SLIDING: f64 = 1e-12;
const SMALLEST_RESOLVED: f64 = 1e-14;

/// The same for BDF in every phase.
const SMALLEST_BDF: f64 = 1e-13;

/// The same for the series, where a few digits more cost next to nothing.
pub(super) const SERIES_SLIDING_TIGHTENING: f64 = 0.01;
pub(super) const SERIES_RESOLVED_TIGHTENING: f64 = 1e-6;
pub(super) const SMALLEST_SERIES_SLIDING: f64 = 1e-12;
pub(super) const SMALLEST_SERIES_RESOLVED: f64 = 1e-17;

/// Of `cvode`, the relative tolerance as a multiple of `rtol`. A multistep method errs by some hundred tolerances in a
/// hundred restarts.
pub(super) const CVODE_TIGHTENING: f64 = 1e-3;

/// The absolute tolerances of `cvode` on twists and their rates in slip where the fast mode is resolved, as a multiple of those
/// of the other methods. A kick may be small against the twist that the friction torque causes, and it is the kick that
/// grows: what a multistep method errs by while it is small grows with it.
const CVODE_ABSOLUTE: f64 = 0.01;

/// |h lambda| of the fast mode from which BDF of order 4 is stable near the imaginary axis (4.7), and a little.
const STRIDE: f64 = 5.0;

/// Of the natural period, for how long after its start a segment of `cvode` counts its guards as being on their allowed side. A
/// multistep method begins with steps of 1e-11 s, after which the relative velocity of a breakaway is not yet
/// above its rounding; a step of a one-step method is long past that.
pub(super) const SETTLING: f64 = 1e-7;

/// Adams' method of `cvode`. With CVODE's own coefficient, 0.1, its iteration often ends after one round: that
/// is an explicit method, whose stability holds order and step down.
pub(super) const CVODE_ADAMS: CvodeOptions = CvodeOptions {
    convergence: Some(0.01),
    ..CvodeOptions::ADAMS
};

/// The solver settings of one run.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
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
    /// The largest coefficient of friction at the speeds of the run.
    friction: f64,
}

impl Plan {
    pub fn new(parameters: &Parameters, largest_force: f64, options: &SolverOptions) -> Self {
        let model = TorsionModel::new(parameters);
        // What the friction torque twists a disk by, and the velocity of an oscillation of that amplitude.
        let friction = parameters
            .friction
            .law
            .typical_coefficient(parameters.initial.speed.abs());
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
            friction,
        }
    }

    /// Whether the location is taken in closed form.
    pub fn closed_form(&self, mode: Mode) -> bool {
        matches!(self.method, Method::Auto | Method::Series) && matches!(mode, Mode::Stick | Mode::Separated)
    }

    /// Whether the method stays on smooth sliding even where that is unstable.
    pub(crate) fn follows_smooth_sliding(&self) -> bool {
        self.method == Method::Series
    }

    /// Whether a stick whose fast oscillation has died is followed by its slower mode alone.
    pub(crate) fn follows_slow_stick(&self) -> bool {
        self.method == Method::Cvode
    }

    /// Whether steps resolve whatever rings, from the start on: BDF of order above 2 strides over a dead oscillation, not
    /// over a live one.
    pub(crate) fn resolves_all_ringing(&self) -> bool {
        self.method == Method::Cvode
    }

    /// BDF for smooth sliding: over the fast mode at order 2, and higher once the steps are long enough to be stable.
    fn striding_bdf(&self) -> CvodeOptions {
        CvodeOptions {
            max_order: Some(4),
            short_steps: Some(ShortSteps {
                max_order: 2,
                until: STRIDE * self.period / TAU,
            }),
            ..CvodeOptions::BDF
        }
    }

    /// The relative velocity (rad/s) below which smooth sliding bends too much for steps that stride over the fast mode.
    ///
    /// The friction law puts a part into the twists by whose fifth derivative BDF of order 4 errs: that of mu times the
    /// fifth power of omega_r'; where a step of STRIDE would err by more than the tolerance, the shorter steps of Adams'
    /// method cost less.
    pub(crate) fn bent_sliding(&self, model: &TorsionModel, largest_force: f64) -> f64 {
        const ORDER: i32 = 5;
        let law = &model.friction.law;
        let inertia = model.torsion.rigid_inertia();
        let largest = self.friction;
        let slowing = largest * model.contact.radius * largest_force / inertia;
        let stride = slowing * STRIDE * self.period / TAU;
        let tolerated = 0.5 * largest * (CVODE_TIGHTENING * self.rtol).max(SMALLEST_RESOLVED);
        law.speed_of_derivative(ORDER, f64::from(ORDER) * tolerated / stride.powi(ORDER))
    }

    /// The relative tolerance.
    fn relative(&self, location: &Location) -> f64 {
        let (tightening, smallest) = match (self.method, location.resolved) {
            (Method::Series, true) => (SERIES_RESOLVED_TIGHTENING, SMALLEST_SERIES_RESOLVED),
            (Method::Series, false) => (SERIES_SLIDING_TIGHTENING, SMALLEST_SERIES_SLIDING),
            // The slower mode alone, which no event follows but far later ones: the tolerance itself.
            (Method::Cvode, false) if location.mode == Mode::Stick => (1.0, SMALLEST_SLIDING),
            (Method::Cvode, _) => (CVODE_TIGHTENING, SMALLEST_RESOLVED),
            (Method::CvodeBdf, true) => (RESOLVED_TIGHTENING, SMALLEST_BDF),
            // Of order 2 it needs ten times the steps for two digits.
            (Method::CvodeBdf, false) => (1.0, SMALLEST_BDF),
            (_, true) => (RESOLVED_TIGHTENING, SMALLEST_RESOLVED),
            (_, false) => (SLIDING_TIGHTENING, SMALLEST_SLIDING),
        };
        (tightening * self.rtol).max(smallest)
    }

    /// What `cvode` has of its own in the absolute tolerances.
    fn adjust_to_cvode(&self, location: &Location, tolerances: &mut Tolerances) {
        let ringing = location.resolved && location.mode.sense() != 0;
        let striding = !location.resolved && location.mode != Mode::Stick;
        // Nothing depends on the quadratures, and of order 2 they alone would hold the step below a stride.
        let rtol = self.rtol.max(SMALLEST_SLIDING);
        for (absolute, measure) in tolerances.absolute.iter_mut().zip(MEASURES) {
            match measure {
                // What the case sets itself stays as it is.
                Measure::Twist if ringing && self.absolute[0].is_none() => *absolute *= CVODE_ABSOLUTE,
                Measure::TwistRate if ringing && self.absolute[1].is_none() => *absolute *= CVODE_ABSOLUTE,
                Measure::Slip if striding => *absolute = rtol * (20.0 * SLIP_SCALE),
                Measure::Loss if striding => *absolute = rtol * self.energy,
                _ => {}
            }
        }
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
                (Method::Cvode, false) if location.mode != Mode::Stick => SolverKind::Cvode {
                    options: self.striding_bdf(),
                    settling: 0.0,
                },
                (Method::Cvode, _) => SolverKind::Cvode {
                    options: CVODE_ADAMS,
                    settling: SETTLING * self.period,
                },
                (Method::Series, _) => SolverKind::Series,
                (Method::Paper, _) => unreachable!("the paper's procedure steps by itself"),
            }
        };
        let mut tolerances = self.tolerances(self.relative(location));
        if self.method == Method::Cvode {
            self.adjust_to_cvode(location, &mut tolerances);
        }
        let longest = self.longest_step(location).filter(|_| self.method != Method::Series);
        let fixed_step = self.fixed_step.filter(|_| self.method.explicit_table().is_some());
        let max_step = longest.into_iter().chain(self.max_step).reduce(f64::min);
        ChosenSolver {
            kind,
            tolerances,
            max_step: max_step.filter(|_| fixed_step.is_none()),
            fixed_step,
        }
    }

    /// Where steps have to resolve the fast mode, the longest of them, s.
    fn longest_step(&self, location: &Location) -> Option<f64> {
        location
            .resolved
            .then_some(self.period / STEPS_PER_PERIOD * self.share_of_step())
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
            Method::Cvode => 5.0,
        };
        1.0 - number / f64::from(1 << 20)
    }

    fn tolerances(&self, rtol: f64) -> Tolerances {
        let [twist, rate, speed] = std::array::from_fn(|k| self.absolute[k].unwrap_or(rtol * self.scale[k]));
        let absolute = MEASURES.iter().map(|measure| match measure {
            Measure::Twist => twist,
            Measure::TwistRate => rate,
            Measure::Speed => speed,
            Measure::Slip => rtol * SLIP_SCALE,
            Measure::Loss => rtol * self.energy,
        });
        Tolerances {
            relative: rtol,
            absolute: absolute.collect(),
        }
    }
}
