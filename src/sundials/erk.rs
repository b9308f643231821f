//! ERKStep: explicit Runge-Kutta methods.

use super::ark::{Ark, Interpolant, StepController, Stepper, Stepping, ark, integrator_by_ark};
use super::error::SolverError;
use super::{Counters, Direction, ErkTable, Integrator, OdeSystem, Outcome, Task, Tolerances};

/// What an [`Erk`] is made with; a table alone will do.
#[derive(Clone, Debug, PartialEq)]
pub struct ErkOptions {
    /// The method. (`ERKStepSetTableNum`)
    pub table: ErkTable,
    /// The dense output.
    pub interpolant: Interpolant,
    /// Steps of this length, without control of the error; negative to go back in time. (`ARKodeSetFixedStep`)
    pub fixed_step: Option<f64>,
    /// None for ERKStep's own choice.
    pub controller: Option<StepController>,
    /// Factor on the step that would just be accepted, below 1; None for 0.96. (`ARKodeSetSafetyFactor`)
    pub safety: Option<f64>,
}

impl From<ErkTable> for ErkOptions {
    fn from(table: ErkTable) -> Self {
        Self {
            table,
            interpolant: Interpolant::default(),
            fixed_step: None,
            controller: None,
            safety: None,
        }
    }
}

/// ERKStep with a system.
pub struct Erk<S: OdeSystem> {
    ark: Ark<S>,
}

impl<S: OdeSystem> Erk<S> {
    /// Makes the solver for `system` from y(t0) = `y0`.
    /// (`ERKStepCreate`, `ARKodeSVtolerances` and the functions named at the options)
    pub fn new(
        system: S,
        options: impl Into<ErkOptions>,
        t0: f64,
        y0: &[f64],
        tolerances: &Tolerances,
    ) -> Result<Self, SolverError> {
        let ErkOptions {
            table,
            interpolant,
            fixed_step,
            controller,
            safety,
        } = options.into();
        let stepping = Stepping {
            interpolant,
            fixed_step,
            controller,
            safety,
        };
        let ark = Ark::new(Stepper::Explicit, system, table.order(), stepping, t0, y0, tolerances)?;
        ark!(ark, ERKStepSetTableNum(table.id()))?;
        Ok(Self { ark })
    }
}

integrator_by_ark!(Erk);
