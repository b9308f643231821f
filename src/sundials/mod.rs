//! CVODE and ARKODE of SUNDIALS, made safe. All hand-written `unsafe` of the solvers is here; no physics is.
//!
//! | [`Method`] | C solver | for |
//! |---|---|---|
//! | `Cvode` | CVODE | multistep methods of variable order, Adams or BDF |
//! | `Erk` | ARKODE's ERKStep | explicit Runge-Kutta methods, up to order 9 |
//! | `Esdirk` | ARKODE's ARKStep | implicit Runge-Kutta methods for stiff systems |
//!
//! One implements [`OdeSystem`], makes a [`Solver`] with a method, sets crossings, and calls [`advance`](Solver::advance)
//! until its [`Outcome`], a value, says that something was reached. A failure is a [`SolverError`]: the C function, the flag
//! by name, the time, SUNDIALS' own words, and the callback's value if that is to blame.
//!
//! - A callback that panics does not unwind through C: the panic goes on in Rust, out of `advance`.
//! - A right-hand side that is not finite makes the solver try a shorter step; only if that does not help it fails.
//! - After a failed step the time and state are those handed out last, and the solver wants a
//!   [`restart`](Solver::restart).
//! - Each solver has a SUNDIALS context of its own: it may move between threads, and any number of them may run
//!   at once.
//!
//! ```
//! use stickslip::sundials::{Direction, ErkTable, OdeSystem, Outcome, Solver, Task, Tolerances};
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
//! let mut solver = Solver::new(Oscillator, ErkTable::DormandPrince7s45, 0.0, &[1.0, 0.0], &tolerances)?;
//! solver.set_crossings(&[Direction::Falling])?;
//! assert_eq!(solver.advance(10.0, Task::Normal)?, Outcome::Roots);
//! assert!((solver.time() - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
//! # Ok(())
//! # }
//! ```
#![allow(unsafe_code)]

mod callbacks;
mod context;
mod core;
mod error;
mod ffi;
mod flags;
mod method;
mod newton;
mod solver;
mod tables;

pub use error::{Callback, Failure, NonFinite, SolverError};
pub use flags::Flag;
pub use method::{CvodeOptions, Method, Multistep, Nonlinear, ShortSteps};
pub use solver::Solver;
pub use tables::{Coefficients, ErkTable, EsdirkTable};

use crate::numerics::band::BandMut;

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
    /// Asked once, when an integrator is made, of a system without [`half_width`](Self::half_width).
    fn has_jacobian(&self) -> bool {
        false
    }

    /// Writes the Jacobian, df_i/dy_j in row i and column j of `j`, which arrives zeroed. `ydot` is f(t, y).
    /// (`CVLsJacFn`, `ARKLsJacFn`)
    fn jacobian(&mut self, t: f64, y: &[f64], ydot: &[f64], j: nalgebra::DMatrixViewMut<'_, f64>) {
        let _ = (t, y, ydot, j);
    }

    /// How far from the diagonal the Jacobian has entries in coordinates z = T y of the system's own, if that is so little
    /// that implicit methods are to solve their linear systems there; then [`band_jacobian`](Self::band_jacobian) is called
    /// instead of [`jacobian`](Self::jacobian). Asked once, when an integrator is made.
    fn half_width(&self) -> Option<usize> {
        None
    }

    /// Adds the Jacobian in those coordinates, T J T^-1, to `j`, which arrives zeroed. (`CVLsJacFn`, `ARKLsJacFn` of a
    /// `SUNBandMatrix`)
    fn band_jacobian(&mut self, t: f64, y: &[f64], ydot: &[f64], j: &mut BandMut<'_>) {
        let _ = (t, y, ydot, j);
    }

    /// Writes `z` = T `x` of a change `x` of the state.
    fn enter_band(&self, x: &[f64], z: &mut [f64]) {
        z.copy_from_slice(x);
    }

    /// Writes `x` = T^-1 `z`, where `z` is the solution of a linear system whose right-hand side is `b` in the coordinates of
    /// the state.
    fn leave_band(&self, z: &[f64], b: &[f64], x: &mut [f64]) {
        let _ = b;
        x.copy_from_slice(z);
    }

    /// Writes g(t, y): as many values as crossings are set with [`Solver::set_crossings`]. `g` arrives zeroed.
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

/// How far [`Solver::advance`] goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Task {
    /// To the output time: past it in steps, then back to it by dense output. (`CV_NORMAL`, `ARK_NORMAL`)
    Normal,
    /// One step; the output time says only which way. (`CV_ONE_STEP`, `ARK_ONE_STEP`)
    OneStep,
}

/// Why [`Solver::advance`] came back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outcome {
    /// It is at the output time. (`CV_SUCCESS` of `CV_NORMAL`)
    Reached,
    /// It has taken a step. (`CV_SUCCESS` of `CV_ONE_STEP`)
    Stepped,
    /// It is at the stop time, which is spent with that. (`CV_TSTOP_RETURN`)
    StopTime,
    /// It is at a crossing: see [`Solver::crossings_found`]. (`CV_ROOT_RETURN`)
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
    /// New Jacobians, by [`OdeSystem::jacobian`], [`OdeSystem::band_jacobian`] or differences. (`CVodeGetNumJacEvals`)
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
