//! CVODE and ARKODE of SUNDIALS, made safe. All hand-written `unsafe` of the solvers is here.
//!
//! | [`SolverMethod`] | C solver | for |
//! |---|---|---|
//! | `Cvode` | CVODE | multistep methods of variable order, Adams or BDF |
//! | `Erk` | ARKODE's ERKStep | explicit Runge-Kutta methods, up to order 9 |
//! | `Esdirk` | ARKODE's ARKStep | an implicit Runge-Kutta method for stiff systems |
//!
//! A user implements [`OdeSystem`], makes a [`Solver`] with a method, sets crossings, and calls
//! [`advance`](Solver::advance) until its [`Advanced`] reports an end. An [`Error`](crate::Error) has the C function,
//! the flag's name, the time, SUNDIALS' message, and the callback value that caused it.
//!
//! - A panic in a callback does not unwind through C: it is resumed in Rust, out of `advance`.
//! - If a right-hand side is not finite, the solver tries a shorter step before it fails.
//! - After a failed step, time and state are the last that were returned, and the solver needs a
//!   [`restart`](Solver::restart).
//! - Each solver has its own SUNDIALS context: it may move between threads, and solvers may run in parallel.
//!
//! The page of the [crate](crate#other-equations) has an example.
#![allow(unsafe_code)]

mod callbacks;
mod context;
mod core;
mod ffi;
mod flags;
mod method;
mod newton;
mod non_finite;
mod solver;
mod tables;

pub use flags::{Flag, FlagFamily};
pub use method::{CvodeOptions, Multistep, Nonlinear, ShortSteps, SolverMethod};
pub use non_finite::{Callback, NonFinite};
pub use solver::Solver;
pub use tables::{Coefficients, ErkTable};

pub use stickslip_system::record::Counters;

use stickslip_system::numerics::band::BandMut;

/// Version of the linked SUNDIALS library, such as `7.1.1` (`SUNDIALS_VERSION`).
pub const SUNDIALS_VERSION: &str = env!("STICKSLIP_SUNDIALS_VERSION");

/// Version of the Rust compiler of the build, as `rustc --version` prints it.
pub const RUSTC_VERSION: &str = env!("STICKSLIP_RUSTC");

/// An initial value problem y' = f(t, y), with functions g(t, y) whose zeros are searched.
///
/// C calls these functions. A panic is resumed in Rust after C has returned. Values that are infinite or NaN are
/// refused, see [`rhs`](Self::rhs).
pub trait OdeSystem {
    /// Number of components of y, at least 1. It must not change while a solver runs: that is a panic. If it is a
    /// constant, the compiler knows the lengths of the slices below.
    fn dimension(&self) -> usize;

    /// Writes f(t, y) to `ydot`. Both slices have [`dimension`](Self::dimension) values; those of `ydot` are arbitrary
    /// before. If a written value is not finite, the solver tries a shorter step, and fails if that does not help.
    /// (`CVRhsFn`, `ARKRhsFn`)
    fn rhs(&mut self, t: f64, y: &[f64], ydot: &mut [f64]);

    /// Whether [`jacobian`](Self::jacobian) exists; otherwise implicit methods take differences of the right-hand
    /// side. Called once, when a solver is made for a system without [`half_width`](Self::half_width).
    fn has_jacobian(&self) -> bool {
        false
    }

    /// Writes the Jacobian: df_i/dy_j in row i and column j of `j`, which is zeroed before. `ydot` is f(t, y).
    /// (`CVLsJacFn`, `ARKLsJacFn`)
    fn jacobian(&mut self, t: f64, y: &[f64], ydot: &[f64], j: nalgebra::DMatrixViewMut<'_, f64>) {
        let _ = (t, y, ydot, j);
    }

    /// Half-bandwidth of the Jacobian in the system's band coordinates z = T y, if implicit methods are to use them:
    /// [`band_jacobian`](Self::band_jacobian) then replaces [`jacobian`](Self::jacobian). Called once, when a solver
    /// is made.
    fn half_width(&self) -> Option<usize> {
        None
    }

    /// Adds the Jacobian T J T^-1 to `j`, which is zeroed before. (`CVLsJacFn`, `ARKLsJacFn` with a `SUNBandMatrix`)
    fn band_jacobian(&mut self, t: f64, y: &[f64], ydot: &[f64], j: &mut BandMut<'_>) {
        let _ = (t, y, ydot, j);
    }

    /// Writes `z` = T `x` for a change `x` of the state.
    fn enter_band(&self, x: &[f64], z: &mut [f64]) {
        z.copy_from_slice(x);
    }

    /// Writes `x` = T^-1 `z` for the solution `z` of a linear system whose right-hand side `b` is in the state's
    /// coordinates.
    fn leave_band(&self, z: &[f64], b: &[f64], x: &mut [f64]) {
        let _ = b;
        x.copy_from_slice(z);
    }

    /// Writes g(t, y), one value for each crossing of [`Solver::set_crossings`]; `g` is zeroed before. A value that is
    /// not finite is an error at once, because the search for its zeros would not end. (`CVRootFn`, `ARKRootFn`)
    fn roots(&mut self, t: f64, y: &[f64], g: &mut [f64]) {
        let _ = (t, y, g);
    }
}

/// Direction of a crossing, wanted or found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
    /// Both; never the direction of a found crossing.
    Either,
}

/// Target of [`Solver::advance`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AdvanceTarget {
    /// Integrates past the output time, and returns the solution at that time by dense output. (`CV_NORMAL`,
    /// `ARK_NORMAL`)
    Normal,
    /// Takes one step; the output time only gives the direction. (`CV_ONE_STEP`, `ARK_ONE_STEP`)
    OneStep,
}

/// Why [`Solver::advance`] returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Advanced {
    /// The output time is reached. (`CV_SUCCESS` of `CV_NORMAL`)
    Reached,
    /// A step is taken. (`CV_SUCCESS` of `CV_ONE_STEP`)
    Stepped,
    /// The stop time is reached, and is removed. (`CV_TSTOP_RETURN`)
    StopTime,
    /// A crossing is reached: see [`Solver::crossings_found`]. (`CV_ROOT_RETURN`)
    Roots,
}

/// Tolerances: a step is accepted if the root mean square of its errors, weighted by 1 / (relative |y_i| + absolute_i),
/// is below 1. (`CVodeSVtolerances`, `ARKodeSVtolerances`)
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
