//! The solvers of a run: created when first needed, restarted for every segment.

use super::Dynamics;
use crate::sundials::{
    Cvode, CvodeOptions, Direction, Erk, ErkOptions, ErkTable, Esdirk, EsdirkOptions, EsdirkTable, Integrator, Multistep, OdeSystem,
    SolverError, Tolerances,
};
use nalgebra::DMatrixViewMut;
use std::sync::Arc;

/// Which solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolverKind {
    /// CVODE BDF, of at most this order.
    CvodeBdf { max_order: u32 },
    CvodeAdams,
    Erk(ErkTable),
    Esdirk(EsdirkTable),
    /// [`Dynamics::closed_state`].
    ClosedForm,
}

impl SolverKind {
    /// The name in result files.
    pub fn name(&self) -> &'static str {
        match self {
            SolverKind::CvodeBdf { .. } => "cvode-bdf",
            SolverKind::CvodeAdams => "cvode-adams",
            SolverKind::Erk(_) => "erk",
            SolverKind::Esdirk(_) => "esdirk",
            SolverKind::ClosedForm => "closed-form",
        }
    }
}

/// A solver with its settings for one segment.
#[derive(Debug, Clone, PartialEq)]
pub struct ChosenSolver {
    pub kind: SolverKind,
    pub tolerances: Tolerances,
    /// s.
    pub max_step: Option<f64>,
}

/// A location's equations on the segment's own clock, as the solver sees them.
pub(super) struct Flow<D: Dynamics> {
    dynamics: Arc<D>,
    pub(super) location: D::Location,
    /// Time of the segment's start.
    pub(super) origin: f64,
}

impl<D: Dynamics> OdeSystem for Flow<D> {
    fn dimension(&self) -> usize {
        self.dynamics.dimension()
    }

    fn rhs(&mut self, tau: f64, y: &[f64], dydt: &mut [f64]) {
        self.dynamics.rhs(&self.location, self.origin + tau, y, dydt);
    }

    fn jacobian(&mut self, tau: f64, y: &[f64], _dydt: &[f64], jacobian: DMatrixViewMut<'_, f64>) -> bool {
        self.dynamics.jacobian(&self.location, self.origin + tau, y, jacobian);
        true
    }

    fn roots(&mut self, tau: f64, y: &[f64], values: &mut [f64]) {
        self.dynamics.guard_values(&self.location, self.origin + tau, y, values);
        if tau == 0.0 {
            for (value, guard) in values.iter_mut().zip(self.dynamics.guards(&self.location)) {
                match guard.direction {
                    Direction::Falling => *value = value.max(f64::MIN_POSITIVE),
                    Direction::Rising => *value = value.min(-f64::MIN_POSITIVE),
                    Direction::Either => {}
                }
            }
        }
    }
}

pub(super) type DynIntegrator<D> = dyn Integrator<System = Flow<D>>;

/// The solvers in use, by kind.
pub(super) struct Pool<D: Dynamics> {
    dynamics: Arc<D>,
    solvers: Vec<(SolverKind, Box<DynIntegrator<D>>)>,
    crossings: Vec<Direction>,
}

impl<D: Dynamics> Pool<D> {
    pub(super) fn new(dynamics: Arc<D>) -> Self {
        Pool { dynamics, solvers: Vec::new(), crossings: Vec::new() }
    }

    /// A solver set up for a segment that starts at `t` with `y` and may run `span` (s).
    pub(super) fn prepare(
        &mut self,
        chosen: &ChosenSolver,
        location: D::Location,
        t: f64,
        y: &[f64],
        span: f64,
    ) -> Result<&mut DynIntegrator<D>, SolverError> {
        let position = match self.solvers.iter().position(|(kind, _)| *kind == chosen.kind) {
            Some(position) => position,
            None => {
                let flow = Flow { dynamics: self.dynamics.clone(), location, origin: t };
                self.solvers.push((chosen.kind, create(chosen, flow, y)?));
                self.solvers.len() - 1
            }
        };
        let solver = &mut *self.solvers[position].1;
        let flow = solver.system_mut();
        flow.location = location;
        flow.origin = t;
        solver.restart(0.0, y)?;
        solver.set_tolerances(&chosen.tolerances)?;
        self.crossings.clear();
        self.crossings.extend(self.dynamics.guards(&location).iter().map(|g| g.direction));
        solver.set_crossings(&self.crossings)?;
        solver.set_max_step(chosen.max_step)?;
        solver.set_stop_time(Some(span))?;
        Ok(solver)
    }
}

fn create<D: Dynamics>(
    chosen: &ChosenSolver,
    flow: Flow<D>,
    y: &[f64],
) -> Result<Box<DynIntegrator<D>>, SolverError> {
    let tolerances = &chosen.tolerances;
    Ok(match chosen.kind {
        SolverKind::CvodeBdf { max_order } => {
            let options =
                CvodeOptions { method: Multistep::Bdf, max_order: Some(max_order), ..CvodeOptions::default() };
            Box::new(Cvode::new(flow, options, 0.0, y, tolerances)?)
        }
        SolverKind::CvodeAdams => {
            let options = CvodeOptions { method: Multistep::Adams, ..CvodeOptions::default() };
            Box::new(Cvode::new(flow, options, 0.0, y, tolerances)?)
        }
        SolverKind::Erk(table) => Box::new(Erk::new(flow, ErkOptions::new(table), 0.0, y, tolerances)?),
        SolverKind::Esdirk(table) => Box::new(Esdirk::new(flow, EsdirkOptions::new(table), 0.0, y, tolerances)?),
        SolverKind::ClosedForm => unreachable!("a closed form needs no solver"),
    })
}
