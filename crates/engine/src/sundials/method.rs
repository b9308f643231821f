//! Methods of a [`Solver`](super::Solver), with their options.

use super::ErkTable;

/// Integration method. An explicit table and the options of CVODE convert into one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SolverMethod {
    /// CVODE: multistep methods of variable order and step.
    Cvode(CvodeOptions),
    /// ERKStep: an explicit Runge-Kutta method.
    Erk {
        /// Butcher table. (`ERKStepSetTableNum`)
        table: ErkTable,
        /// Constant step without error control; negative to go back in time. (`ARKodeSetFixedStep`)
        fixed_step: Option<f64>,
    },
    /// ARKStep: the L-stable singly diagonally implicit Runge-Kutta method of order 5 with an explicit first stage and
    /// an embedded order 4; Newton iteration as in [`Nonlinear::Newton`]. (`ARKODE_ESDIRK547L2SA2_7_4_5`)
    Esdirk {
        /// Constant step without error control, as in `Erk`.
        fixed_step: Option<f64>,
        /// Whether fast convergence in earlier stages may replace an iteration, as is SUNDIALS' default.
        ///
        /// ARKStep keeps the convergence rate up to the next factorisation. With a trivial first guess the rate soon
        /// is so small that each stage passes after one iteration, however wrong the matrix: the harmonic oscillator
        /// at tolerances of 1e-10 had an error of 2e-3 in a step cut for a stop time. `false` costs one more iteration
        /// per stage. (`ARKodeSetNonlinCRDown`: 1 if false, 0.3 if true)
        trust_convergence_rate: bool,
    },
}

impl SolverMethod {
    /// [`SolverMethod::Esdirk`] with error control; each stage is judged by its own iterations.
    pub const ESDIRK: SolverMethod = SolverMethod::Esdirk {
        fixed_step: None,
        trust_convergence_rate: false,
    };
}

impl From<CvodeOptions> for SolverMethod {
    fn from(options: CvodeOptions) -> Self {
        SolverMethod::Cvode(options)
    }
}

impl From<ErkTable> for SolverMethod {
    fn from(table: ErkTable) -> Self {
        SolverMethod::Erk {
            table,
            fixed_step: None,
        }
    }
}

/// Family of linear multistep methods. (`lmm` of `CVodeCreate`)
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Multistep {
    /// Adams-Moulton, orders 1 to 12, for nonstiff systems. (`CV_ADAMS`)
    Adams,
    /// Backward differentiation, orders 1 to 5, for stiff systems. (`CV_BDF`)
    Bdf,
}

/// Solver of the implicit equation of each step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Nonlinear {
    /// Newton iteration with a dense Jacobian (the system's own if it has one), or with a band in the system's
    /// coordinates. (`CVodeSetLinearSolver` with `SUNLinSol_Dense` or `SUNLinSol_Band`, `CVodeSetJacFn`)
    Newton,
    /// Fixed-point iteration. (`SUNNonlinSol_FixedPoint`)
    FixedPoint,
}

/// Options of CVODE.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CvodeOptions {
    /// Family of methods.
    pub method: Multistep,
    /// Solver of the implicit equations.
    pub nonlinear: Nonlinear,
    /// Highest order; None for the method's own. (`CVodeSetMaxOrd`)
    pub max_order: Option<u32>,
    /// Convergence criterion of the iteration, relative to the local error; None for CVODE's own 0.1. Too few
    /// iterations turn an implicit method into an explicit one, without its stability. (`CVodeSetNonlinConvCoef`)
    pub convergence: Option<f64>,
    /// Lower order while steps are short.
    pub short_steps: Option<ShortSteps>,
}

/// Lower order of BDF while steps are short. Orders above 2 are unstable near the imaginary axis if the step is short
/// compared with the oscillation: orders 3, 4 and 5 up to |h lambda| of 1.9, 4.7 and 9.7. The order stays low until a
/// step is longer than `until`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortSteps {
    /// Highest order until a step is longer than `until`. (`CVodeSetMaxOrd`)
    pub max_order: u32,
    /// Step length, s.
    pub until: f64,
}

impl CvodeOptions {
    /// Adams with fixed-point iteration, for nonstiff systems.
    pub const ADAMS: Self = Self {
        method: Multistep::Adams,
        nonlinear: Nonlinear::FixedPoint,
        max_order: None,
        convergence: None,
        short_steps: None,
    };

    /// BDF with Newton iteration, for stiff systems.
    pub const BDF: Self = Self {
        method: Multistep::Bdf,
        nonlinear: Nonlinear::Newton,
        max_order: None,
        convergence: None,
        short_steps: None,
    };
}
