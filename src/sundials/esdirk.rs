//! ARKStep with implicit methods: singly diagonally implicit Runge-Kutta with an explicit first stage.

use std::ffi::c_int;

use super::ark::{Ark, Stepper, ark, arkls, integrator_by_ark};
use super::context::DenseNewton;
use super::core::positive;
use super::error::SolverError;
use super::stepping::Stepping;
use super::{Counters, Direction, EsdirkTable, Integrator, OdeSystem, Outcome, Task, Tolerances, callbacks, ffi};

/// How the first guess of each stage's iteration is made. (`ARKodeSetPredictorMethod`)
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Predictor {
    /// The state at the start of the step. (0)
    Trivial,
    /// The dense output of the last step, of its highest degree. (1)
    MaximumOrder,
    /// Of a degree that falls with the distance. (2)
    VariableOrder,
    /// Of the highest degree nearby, of degree 1 farther off. (3)
    CutoffOrder,
}

/// What an [`Esdirk`] is made with; a table alone will do.
#[derive(Clone, Debug, PartialEq)]
pub struct EsdirkOptions {
    /// The method. (`ARKStepSetTableNum`)
    pub table: EsdirkTable,
    /// Step sizes and dense output.
    pub stepping: Stepping,
    /// Whether a stage's slope is taken from its solved equation instead of another call of the right-hand side.
    /// (`ARKodeSetDeduceImplicitRhs`)
    pub deduce_implicit_rhs: bool,
    /// The first guess of a stage.
    pub predictor: Predictor,
    /// How much smaller than the tolerance the iteration's error has to be; None for 0.1.
    /// (`ARKodeSetNonlinConvCoef`)
    pub nonlinear_tolerance: Option<f64>,
    /// Whether an iteration may count as converged because earlier stages converged fast, as in SUNDIALS' default.
    ///
    /// ARKStep remembers the rate over stages and steps, up to the next factorisation. With a trivial first guess it
    /// soon is so small that each stage passes after one iteration, however far its matrix is from the step. Of the
    /// harmonic oscillator at tolerances of 1e-10 the step that was cut for a stop time then had an error of 2e-3.
    /// Without it a stage takes two iterations where it took one. (`ARKodeSetNonlinCRDown`: 1 if false, 0.3 if true)
    pub trust_convergence_rate: bool,
    /// Most Newton iterations in a stage; None for 3. (`ARKodeSetMaxNonlinIters`)
    pub max_nonlinear_iterations: Option<u32>,
}

impl From<EsdirkTable> for EsdirkOptions {
    fn from(table: EsdirkTable) -> Self {
        Self {
            table,
            stepping: Stepping::default(),
            deduce_implicit_rhs: false,
            predictor: Predictor::Trivial,
            nonlinear_tolerance: None,
            trust_convergence_rate: false,
            max_nonlinear_iterations: None,
        }
    }
}

/// ARKStep, implicit, with a system; dense Newton iteration, with the system's Jacobian if it has one.
pub struct Esdirk<S: OdeSystem> {
    ark: Ark<S>,
}

impl<S: OdeSystem> Esdirk<S> {
    /// Makes the solver for `system` from y(t0) = `y0`.
    /// (`ARKStepCreate`, `ARKodeSVtolerances`, `ARKodeSetLinearSolver`, `ARKodeSetJacFn` and the functions named at
    /// the options)
    pub fn new(
        system: S,
        options: impl Into<EsdirkOptions>,
        t0: f64,
        y0: &[f64],
        tolerances: &Tolerances,
    ) -> Result<Self, SolverError> {
        let options = options.into();
        let EsdirkOptions { table, stepping, .. } = options;
        let mut ark = Ark::new(Stepper::Implicit, system, table.order(), stepping, t0, y0, tolerances)?;
        ark!(ark, ARKStepSetTableNum(table.id(), ffi::ARKODE_ERK_NONE))?;

        let newton = DenseNewton::new(&ark.core.context, &ark.core.state)?;
        let (solver, matrix) = (newton.solver(), newton.matrix());
        ark.newton = Some(newton);
        arkls!(ark, ARKodeSetLinearSolver(solver, matrix))?;
        if ark.core.shared().system.has_jacobian() {
            arkls!(ark, ARKodeSetJacFn(Some(callbacks::jacobian::<S>)))?;
        }

        if options.deduce_implicit_rhs {
            ark!(ark, ARKodeSetDeduceImplicitRhs(1))?;
        }
        let predictor = match options.predictor {
            Predictor::Trivial => 0,
            Predictor::MaximumOrder => 1,
            Predictor::VariableOrder => 2,
            Predictor::CutoffOrder => 3,
        };
        ark!(ark, ARKodeSetPredictorMethod(predictor))?;
        if !options.trust_convergence_rate {
            ark!(ark, ARKodeSetNonlinCRDown(1.0))?;
        }
        if let Some(coefficient) = options.nonlinear_tolerance {
            positive("nonlinear tolerance", coefficient)?;
            ark!(ark, ARKodeSetNonlinConvCoef(coefficient))?;
        }
        if let Some(iterations) = options.max_nonlinear_iterations {
            ark!(
                ark,
                ARKodeSetMaxNonlinIters(c_int::try_from(iterations).unwrap_or(c_int::MAX))
            )?;
        }
        Ok(Self { ark })
    }
}

integrator_by_ark!(Esdirk);
