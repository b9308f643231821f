//! The methods of a [`Solver`](super::Solver), with their options.

use super::{ErkTable, EsdirkTable};

/// Which method integrates. A table, or options of CVODE, turn into one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// CVODE: multistep methods of variable order and step.
    Cvode(CvodeOptions),
    /// ERKStep: an explicit Runge-Kutta method.
    Erk {
        /// The method. (`ERKStepSetTableNum`)
        table: ErkTable,
        /// Steps of this length, without control of the error; negative to go back in time. (`ARKodeSetFixedStep`)
        fixed_step: Option<f64>,
    },
    /// ARKStep: a singly diagonally implicit Runge-Kutta method with an explicit first stage; Newton iteration as in
    /// [`Nonlinear::Newton`].
    Esdirk {
        /// The method. (`ARKStepSetTableNum`)
        table: EsdirkTable,
        /// As that of an explicit method.
        fixed_step: Option<f64>,
        /// Whether an iteration may count as converged because earlier stages converged fast, as in SUNDIALS' default.
        ///
        /// ARKStep remembers the rate over stages and steps, up to the next factorisation. With a trivial first guess it
        /// soon is so small that each stage passes after one iteration, however far its matrix is from the step. Of the
        /// harmonic oscillator at tolerances of 1e-10 the step that was cut for a stop time then had an error of 2e-3.
        /// Without it a stage takes two iterations where it took one. (`ARKodeSetNonlinCRDown`: 1 if false, 0.3 if true)
        trust_convergence_rate: bool,
    },
}

impl From<CvodeOptions> for Method {
    fn from(options: CvodeOptions) -> Self {
        Method::Cvode(options)
    }
}

impl From<ErkTable> for Method {
    fn from(table: ErkTable) -> Self {
        Method::Erk {
            table,
            fixed_step: None,
        }
    }
}

impl From<EsdirkTable> for Method {
    fn from(table: EsdirkTable) -> Self {
        Method::Esdirk {
            table,
            fixed_step: None,
            trust_convergence_rate: false,
        }
    }
}

/// Family of linear multistep methods. (`lmm` of `CVodeCreate`)
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Multistep {
    /// Adams-Moulton, orders 1 to 12, for systems that are not stiff. (`CV_ADAMS`)
    Adams,
    /// Backward differentiation, orders 1 to 5, for stiff systems. (`CV_BDF`)
    Bdf,
}

/// How the implicit equation of each step is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Nonlinear {
    /// Newton iteration with a dense Jacobian, the system's own if it has one, or with a band in the system's coordinates.
    /// (`CVodeSetLinearSolver` with `SUNLinSol_Dense` or `SUNLinSol_Band`, `CVodeSetJacFn`)
    Newton,
    /// Fixed-point iteration. (`SUNNonlinSol_FixedPoint`)
    FixedPoint,
}

/// Options of CVODE.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CvodeOptions {
    /// Which methods.
    pub method: Multistep,
    /// How their equations are solved.
    pub nonlinear: Nonlinear,
    /// Highest order; None for that of the method. (`CVodeSetMaxOrd`)
    pub max_order: Option<u32>,
    /// How far below the local error the iteration of a step has to converge; None for CVODE's own 0.1. An explicit method
    /// is made of an implicit one by too few iterations, and loses its stability. (`CVodeSetNonlinConvCoef`)
    pub convergence: Option<f64>,
    /// A lower order as long as steps are short; None for none.
    pub short_steps: Option<ShortSteps>,
}

/// Orders of BDF above 2 are unstable near the imaginary axis, but there only where the step is short against the
/// oscillation: of order 3, 4 and 5 up to |h lambda| of 1.9, 4.7 and 9.7. After a start the order therefore stays low until
/// a step has got past that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortSteps {
    /// Highest order until a step is longer than `until`. (`CVodeSetMaxOrd`)
    pub max_order: u32,
    /// s.
    pub until: f64,
}

impl CvodeOptions {
    /// Adams with fixed-point iteration: for systems that are not stiff.
    pub const ADAMS: Self = Self {
        method: Multistep::Adams,
        nonlinear: Nonlinear::FixedPoint,
        max_order: None,
        convergence: None,
        short_steps: None,
    };

    /// BDF with Newton iteration: for stiff systems.
    pub const BDF: Self = Self {
        method: Multistep::Bdf,
        nonlinear: Nonlinear::Newton,
        max_order: None,
        convergence: None,
        short_steps: None,
    };
}
