//! CVODE and ARKODE of SUNDIALS, made safe. All hand-written `unsafe` of the solvers is here; no physics is.
//!
//! | integrator | C solver | for |
//! |---|---|---|
//! | [`Cvode`] | CVODE | multistep methods of variable order, Adams or BDF |
//! | [`Erk`] | ARKODE's ERKStep | explicit Runge-Kutta methods, up to order 9 |
//! | [`Esdirk`] | ARKODE's ARKStep | implicit Runge-Kutta methods for stiff systems |
//!
//! They share the trait [`Integrator`]. One implements [`OdeSystem`], sets crossings, and calls
//! [`advance`](Integrator::advance) until its [`Outcome`], a value, says that something was reached. A failure is a
//! [`SolverError`]: the C function, the flag by name, the time, SUNDIALS' own words, and the callback's value if
//! that is to blame.
//!
//! - A callback that panics does not unwind through C: the panic goes on in Rust, out of `advance`.
//! - A right-hand side that is not finite makes the solver try a shorter step; only if that does not help it fails.
//! - After a failed step the time and state are those handed out last, and the integrator wants a
//!   [`restart`](Integrator::restart).
//! - Each integrator has a SUNDIALS context of its own: it may move between threads, and any number of them may run
//!   at once.
//!
//! ```
//! use stickslip::sundials::{Direction, Erk, ErkTable, Integrator, OdeSystem, Outcome, Task, Tolerances};
//!
//! /// x'' = -x, watched for x = 0.
//! struct Oscillator;
//!
//! impl OdeSystem for Oscillator {
//!     fn dimension(&self) -> usize {
//!         2
//!     }
//!     fn rhs(&mut self, _t: f64, y: &[f64], ydot: &mut [f64]) {
//!         ydot[0] = y[1];
//!         ydot[1] = -y[0];
//!     }
//!     fn roots(&mut self, _t: f64, y: &[f64], g: &mut [f64]) {
//!         g[0] = y[0];
//!     }
//! }
//!
//! # fn main() -> Result<(), stickslip::sundials::SolverError> {
//! let tolerances = Tolerances::uniform(1e-12, 1e-12, 2);
//! let mut solver = Erk::new(Oscillator, ErkTable::DormandPrince7s45, 0.0, &[1.0, 0.0], &tolerances)?;
//! solver.set_crossings(&[Direction::Falling])?;
//! assert_eq!(solver.advance(10.0, Task::Normal)?, Outcome::Roots);
//! assert!((solver.time() - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
//! # Ok(())
//! # }
//! ```
#![allow(unsafe_code)]

mod ark;
mod callbacks;
mod context;
mod core;
mod cvode;
mod erk;
mod error;
mod esdirk;
mod ffi;
mod flags;
mod stepping;
mod tables;

pub use cvode::{Cvode, CvodeOptions, Multistep, Nonlinear, ShortSteps};
pub use erk::{Erk, ErkOptions};
pub use error::{Callback, Failure, NonFinite, SolverError};
pub use esdirk::{Esdirk, EsdirkOptions, Predictor};
pub use flags::{ArkodeFlag, ArkodeLinearFlag, CvodeFlag, CvodeLinearFlag, Flag};
pub use stepping::{Interpolant, StepController, Stepping};
pub use tables::{Coefficients, ErkTable, EsdirkTable};

/// Version of the SUNDIALS library that is linked, such as `7.1.1` (`SUNDIALS_VERSION`).
pub const SUNDIALS_VERSION: &str = env!("STICKSLIP_SUNDIALS_VERSION");

/// An initial value problem y' = f(t, y), and functions g(t, y) whose zeros are looked for.
///
/// The functions are called from C. They may panic: the panic goes on in Rust when C has returned. A value that is
/// infinite or not a number is refused, see [`rhs`](Self::rhs).
pub trait OdeSystem {
    /// Number of components of y; at least 1, and always the same: another answer while an integrator runs is a panic.
    /// Where it is a constant, the compiler knows the lengths of the slices below.
    fn dimension(&self) -> usize;

    /// The right-hand side: writes f(t, y) to `ydot`. Both slices have [`dimension`](Self::dimension) values; what is
    /// in `ydot` before is arbitrary. (`CVRhsFn`, `ARKRhsFn`)
    ///
    /// If a value is not finite, the solver tries a shorter step, and fails if that does not help.
    fn rhs(&mut self, t: f64, y: &[f64], ydot: &mut [f64]);

    /// Whether [`jacobian`](Self::jacobian) is to be called. If not, implicit methods difference the right-hand side.
    /// Asked once, when an integrator is made.
    fn has_jacobian(&self) -> bool {
        false
    }

    /// Writes the Jacobian, df_i/dy_j in row i and column j of `j`, which arrives zeroed. `ydot` is f(t, y).
    /// (`CVLsJacFn`, `ARKLsJacFn`)
    fn jacobian(&mut self, t: f64, y: &[f64], ydot: &[f64], j: nalgebra::DMatrixViewMut<'_, f64>) {
        let _ = (t, y, ydot, j);
    }

    /// Writes g(t, y): as many values as crossings are set with [`Integrator::set_crossings`]. `g` arrives zeroed.
    /// (`CVRootFn`, `ARKRootFn`)
    ///
    /// A value that is not finite is an error at once: a search for its zeros would not end.
    fn roots(&mut self, t: f64, y: &[f64], g: &mut [f64]) {
        let _ = (t, y, g);
    }
}

/// Which zeros of a function of time are looked for, or which one was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
    /// Both; a found one is never this.
    Either,
}

/// How far [`Integrator::advance`] goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Task {
    /// To the output time: past it in steps, then back to it by dense output. (`CV_NORMAL`, `ARK_NORMAL`)
    Normal,
    /// One step; the output time says only which way. (`CV_ONE_STEP`, `ARK_ONE_STEP`)
    OneStep,
}

/// Why [`Integrator::advance`] came back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outcome {
    /// It is at the output time. (`CV_SUCCESS` of `CV_NORMAL`)
    Reached,
    /// It has taken a step. (`CV_SUCCESS` of `CV_ONE_STEP`)
    Stepped,
    /// It is at the stop time, which is spent with that. (`CV_TSTOP_RETURN`)
    StopTime,
    /// It is at a crossing: see [`Integrator::crossings_found`]. (`CV_ROOT_RETURN`)
    Roots,
}

/// A step is accepted if the weighted root mean square of its error is below 1, with the weights
/// 1 / (relative |y_i| + absolute_i). (`CVodeSVtolerances`, `ARKodeSVtolerances`)
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerances {
    /// Relative tolerance of all components, not negative.
    pub relative: f64,
    /// Absolute tolerance of each component, in its unit, not negative.
    pub absolute: Vec<f64>,
}

impl Tolerances {
    /// The same absolute tolerance for all `dimension` components.
    pub fn uniform(relative: f64, absolute: f64, dimension: usize) -> Self {
        Self {
            relative,
            absolute: vec![absolute; dimension],
        }
    }
}

/// What the solver has done since the start or the last restart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counters {
    /// Accepted steps. (`CVodeGetNumSteps`)
    pub steps: u64,
    /// Calls of [`OdeSystem::rhs`], those for differences instead of a Jacobian included.
    /// (`CVodeGetNumRhsEvals` + `CVodeGetNumLinRhsEvals`)
    pub rhs_evaluations: u64,
    /// New Jacobians, by [`OdeSystem::jacobian`] or by differences. (`CVodeGetNumJacEvals`)
    pub jacobian_evaluations: u64,
    /// Factorisations of the Newton matrix. (`CVodeGetNumLinSolvSetups`)
    pub linear_solver_setups: u64,
    /// Steps refused for their error. (`CVodeGetNumErrTestFails`)
    pub error_test_failures: u64,
    /// Newton or fixed-point iterations. (`CVodeGetNumNonlinSolvIters`)
    pub nonlinear_iterations: u64,
    /// Iterations that did not converge. (`CVodeGetNumNonlinSolvConvFails`)
    pub nonlinear_convergence_failures: u64,
    /// Calls of [`OdeSystem::roots`]. (`CVodeGetNumGEvals`)
    pub root_evaluations: u64,
    /// Order of the last step; 0 before the first. (`CVodeGetLastOrder`; of a Runge-Kutta method its own)
    pub last_order: u32,
    /// Length of the last step; 0 before the first. (`CVodeGetLastStep`)
    pub last_step: f64,
    /// Length of the step to come. (`CVodeGetCurrentStep`)
    pub current_step: f64,
}

/// A solver of an initial value problem, which it owns.
///
/// Where CVODE and ARKODE have a function each, the one of CVODE is named; ARKODE's is the same with `ARKode`.
///
/// Arguments that are not finite or slices of a wrong length are a [`SolverError`]; so is any flag of a C function
/// that is not a success.
pub trait Integrator {
    /// The problem.
    type System: OdeSystem;

    /// The problem that is solved.
    fn system(&self) -> &Self::System;

    /// The problem that is solved. A change of its right-hand side wants a [`restart`](Self::restart).
    fn system_mut(&mut self) -> &mut Self::System;

    /// Where the solution handed out last stands.
    fn time(&self) -> f64;

    /// The solution handed out last, at [`time`](Self::time): all components of y.
    fn state(&self) -> &[f64];

    /// Starts anew at `t0` with the values `y0`, of the same dimension. Counters start at zero, the stop time is
    /// cleared, everything else that was set stays. (`CVodeReInit`, `ERKStepReInit`, `ARKStepReInit`)
    fn restart(&mut self, t0: f64, y0: &[f64]) -> Result<(), SolverError>;

    /// (`CVodeSVtolerances`)
    fn set_tolerances(&mut self, tolerances: &Tolerances) -> Result<(), SolverError>;

    /// Says for which zeros of [`OdeSystem::roots`] to look from here on, one direction for each function; an empty
    /// slice for none. A function that is exactly zero at the start is not a crossing, and is watched once it has
    /// left zero. (`CVodeRootInit`, `CVodeSetRootDirection`, `CVodeSetNoInactiveRootWarn`)
    fn set_crossings(&mut self, crossings: &[Direction]) -> Result<(), SolverError>;

    /// A time that no step passes and where `advance` returns [`Outcome::StopTime`], once; None for none.
    /// It must lie beyond the internal mesh, not only beyond [`time`](Self::time).
    /// (`CVodeSetStopTime`, `CVodeClearStopTime`)
    fn set_stop_time(&mut self, time: Option<f64>) -> Result<(), SolverError>;

    /// Longest step, positive; None for no bound. (`CVodeSetMaxStep`)
    fn set_max_step(&mut self, step: Option<f64>) -> Result<(), SolverError>;

    /// Shortest step, positive; None for no bound. (`CVodeSetMinStep`)
    fn set_min_step(&mut self, step: Option<f64>) -> Result<(), SolverError>;

    /// First step after a start or restart, with the sign of the direction of integration; None to let the solver
    /// estimate it. (`CVodeSetInitStep`)
    fn set_initial_step(&mut self, step: Option<f64>) -> Result<(), SolverError>;

    /// Most steps in one call of `advance`, 500 unless set; None for no bound. After the error that tells of too many
    /// steps one may just go on. (`CVodeSetMaxNumSteps`)
    fn set_max_steps(&mut self, steps: Option<u64>) -> Result<(), SolverError>;

    /// Goes on towards `t_out`, until the first thing that makes up an [`Outcome`].
    /// (`CVode`, `ARKodeEvolve`)
    ///
    /// # Panics
    /// Goes on with the panic of a callback.
    fn advance(&mut self, t_out: f64, task: Task) -> Result<Outcome, SolverError>;

    /// After [`Outcome::Roots`]: for each crossing that was set, whether and which way its function crosses zero at
    /// [`time`](Self::time). Otherwise what the last `Roots` left, or None after a restart. (`CVodeGetRootInfo`)
    fn crossings_found(&self) -> &[Option<Direction>];

    /// The k-th derivative of the dense output at a time within the last step, [`mesh_time`](Self::mesh_time) and
    /// [`last_step_size`](Self::last_step_size) before it; k = 0 is the solution. Writes all components to `out`.
    /// (`CVodeGetDky`)
    fn interpolate(&mut self, t: f64, k: u32, out: &mut [f64]) -> Result<(), SolverError>;

    /// Where the last internal step ended; at or beyond [`time`](Self::time). (`CVodeGetCurrentTime`)
    fn mesh_time(&mut self) -> Result<f64, SolverError>;

    /// Length of the last internal step; 0 before the first. (`CVodeGetLastStep`)
    fn last_step_size(&mut self) -> Result<f64, SolverError>;

    /// What has been done since the start or the last restart.
    fn counters(&mut self) -> Result<Counters, SolverError>;
}
