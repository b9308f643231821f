//! ERKStep: explicit Runge-Kutta methods.

use super::ark::{Ark, Stepper, ark, integrator_by_ark};
use super::error::SolverError;
use super::stepping::Stepping;
use super::{Counters, Direction, ErkTable, Integrator, OdeSystem, Outcome, Task, Tolerances};

/// What an [`Erk`] is made with; a table alone will do.
#[derive(Clone, Debug, PartialEq)]
pub struct ErkOptions {
    /// The method. (`ERKStepSetTableNum`)
    pub table: ErkTable,
    /// Step sizes and dense output.
    pub stepping: Stepping,
}

impl From<ErkTable> for ErkOptions {
    fn from(table: ErkTable) -> Self {
        Self {
            table,
            stepping: Stepping::default(),
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
        let ErkOptions { table, stepping } = options.into();
        let ark = Ark::new(Stepper::Explicit, system, table.order(), stepping, t0, y0, tolerances)?;
        ark!(ark, ERKStepSetTableNum(table.id()))?;
        Ok(Self { ark })
    }
}

integrator_by_ark!(Erk);
