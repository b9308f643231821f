//! The solvers of a run: created when first needed, restarted for every segment.

use super::Dynamics;
use crate::sundials::{
    Cvode, CvodeOptions, Direction, Erk, ErkOptions, ErkTable, Esdirk, EsdirkTable, Integrator, Multistep, OdeSystem,
    Outcome, SolverError, Stepping, Task, Tolerances,
};
use nalgebra::DMatrixViewMut;
use std::sync::Arc;

/// Which solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolverKind {
    /// CVODE BDF, of at most this order.
    CvodeBdf {
        max_order: u32,
    },
    CvodeAdams,
    /// CVODE with these options. For `settling` (s) after a segment's start its guards count as being on their allowed side.
    Cvode {
        options: CvodeOptions,
        settling: f64,
    },
    Erk(ErkTable),
    Esdirk(EsdirkTable),
    /// [`Dynamics::closed_state`].
    ClosedForm,
    /// [`Dynamics::stepper`].
    Series,
}

impl SolverKind {
    /// The name in result files.
    pub fn name(&self) -> &'static str {
        match self {
            SolverKind::CvodeBdf { .. } => "cvode-bdf",
            SolverKind::CvodeAdams => "cvode-adams",
            SolverKind::Cvode { options, .. } => match options.method {
                Multistep::Adams => "cvode-adams",
                Multistep::Bdf => "cvode-bdf",
            },
            SolverKind::Erk(_) => "erk",
            SolverKind::Esdirk(_) => "esdirk",
            SolverKind::ClosedForm => "closed-form",
            SolverKind::Series => "series",
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
    /// Steps of this length (s) without control of the error; the last before an event or a stop time is shorter. Only
    /// [`SolverKind::Erk`] takes them.
    pub fixed_step: Option<f64>,
}

/// A location's equations on the segment's own clock, as the solver sees them.
pub(super) struct Flow<D: Dynamics> {
    dynamics: Arc<D>,
    pub(super) location: D::Location,
    /// Time of the segment's start.
    pub(super) origin: f64,
    /// How long guards count as being on their allowed side, s.
    settling: f64,
}

impl<D: Dynamics> OdeSystem for Flow<D> {
    fn dimension(&self) -> usize {
        self.dynamics.dimension()
    }

    fn rhs(&mut self, tau: f64, y: &[f64], dydt: &mut [f64]) {
        self.dynamics.rhs(&self.location, self.origin + tau, y, dydt);
    }

    fn has_jacobian(&self) -> bool {
        true
    }

    fn jacobian(&mut self, tau: f64, y: &[f64], _dydt: &[f64], jacobian: DMatrixViewMut<'_, f64>) {
        self.dynamics.jacobian(&self.location, self.origin + tau, y, jacobian);
    }

    fn roots(&mut self, tau: f64, y: &[f64], values: &mut [f64]) {
        self.dynamics.guard_values(&self.location, self.origin + tau, y, values);
        if tau <= self.settling {
            for (index, (value, guard)) in values.iter_mut().zip(self.dynamics.guards(&self.location)).enumerate() {
                let beyond = self.dynamics.starts_beyond(&self.location, self.origin, y, index);
                match guard.direction {
                    Direction::Falling if beyond => *value = value.min(-f64::MIN_POSITIVE),
                    Direction::Rising if beyond => *value = value.max(f64::MIN_POSITIVE),
                    Direction::Falling => *value = value.max(f64::MIN_POSITIVE),
                    Direction::Rising => *value = value.min(-f64::MIN_POSITIVE),
                    Direction::Either => {}
                }
            }
        }
    }
}

pub(super) type DynIntegrator<D> = dyn Integrator<System = Flow<D>>;

/// A solver, and for one-step methods a second one of its kind that repeats part of a step.
pub(super) struct Pair<'a, D: Dynamics> {
    pub(super) solver: &'a mut DynIntegrator<D>,
    pub(super) probe: Option<&'a mut DynIntegrator<D>>,
}

struct Entry<D: Dynamics> {
    kind: SolverKind,
    fixed_step: Option<f64>,
    solver: Box<DynIntegrator<D>>,
    probe: Option<Box<DynIntegrator<D>>>,
}

/// The solvers in use, by kind.
pub(super) struct Pool<D: Dynamics> {
    dynamics: Arc<D>,
    entries: Vec<Entry<D>>,
    crossings: Vec<Direction>,
}

impl<D: Dynamics> Pool<D> {
    pub(super) fn new(dynamics: Arc<D>) -> Self {
        Pool {
            dynamics,
            entries: Vec::new(),
            crossings: Vec::new(),
        }
    }

    /// A solver set up for a segment that starts at `t` with `y` and may run `span` (s).
    pub(super) fn prepare(
        &mut self,
        chosen: &ChosenSolver,
        location: D::Location,
        t: f64,
        y: &[f64],
        span: f64,
    ) -> Result<Pair<'_, D>, SolverError> {
        let known = |entry: &Entry<D>| entry.kind == chosen.kind && entry.fixed_step == chosen.fixed_step;
        let position = match self.entries.iter().position(known) {
            Some(position) => position,
            None => {
                let flow = || Flow {
                    dynamics: self.dynamics.clone(),
                    location,
                    origin: t,
                    settling: 0.0,
                };
                let one_step = matches!(chosen.kind, SolverKind::Erk(_) | SolverKind::Esdirk(_));
                let probe = if one_step {
                    Some(create(chosen, flow(), y)?)
                } else {
                    None
                };
                self.entries.push(Entry {
                    kind: chosen.kind,
                    fixed_step: chosen.fixed_step,
                    solver: create(chosen, flow(), y)?,
                    probe,
                });
                self.entries.len() - 1
            }
        };
        let Entry { solver, probe, .. } = &mut self.entries[position];
        for solver in std::iter::once(&mut *solver).chain(probe.as_mut()) {
            let flow = solver.system_mut();
            flow.location = location;
            flow.origin = t;
            flow.settling = match chosen.kind {
                SolverKind::Cvode { settling, .. } => settling,
                _ => 0.0,
            };
            solver.set_tolerances(&chosen.tolerances)?;
        }
        solver.restart(0.0, y)?;
        self.crossings.clear();
        self.crossings
            .extend(self.dynamics.guards(&location).iter().map(|g| g.direction));
        solver.set_crossings(&self.crossings)?;
        solver.set_max_step(chosen.max_step)?;
        solver.set_stop_time(Some(span))?;
        Ok(Pair {
            solver: &mut **solver,
            probe: probe.as_deref_mut(),
        })
    }
}

/// The last step of a segment's solver, from which states inside it are taken.
///
/// A multistep method carries a polynomial of its own order. The dense output of ARKODE's one-step methods is of degree
/// 5 at most, far below a method of order 8; there the step is taken again, up to the time that is wanted.
pub(super) struct LastStep {
    start: f64,
    state: Vec<f64>,
}

impl LastStep {
    pub(super) fn new(y: &[f64]) -> Self {
        LastStep {
            start: 0.0,
            state: y.to_vec(),
        }
    }

    /// Where the step starts, on the segment's clock.
    pub(super) fn start(&self) -> f64 {
        self.start
    }

    /// The state there.
    pub(super) fn state(&self) -> &[f64] {
        &self.state
    }

    /// The next step will start where the solver stands.
    pub(super) fn advance(&mut self, tau: f64, y: &[f64]) {
        self.start = tau;
        self.state.copy_from_slice(y);
    }

    /// The state at `tau` within the step.
    pub(super) fn state_at<D: Dynamics>(
        &self,
        pair: &mut Pair<'_, D>,
        tau: f64,
        out: &mut [f64],
    ) -> Result<(), SolverError> {
        let Some(probe) = &mut pair.probe else {
            return pair.solver.interpolate(tau.min(pair.solver.time()), 0, out);
        };
        let span = tau - self.start;
        if span <= 8.0 * f64::EPSILON * tau {
            out.copy_from_slice(&self.state);
            return Ok(());
        }
        probe.restart(self.start, &self.state)?;
        probe.set_initial_step(Some(span))?;
        probe.set_stop_time(Some(tau))?;
        while probe.advance(tau, Task::OneStep)? != Outcome::StopTime {}
        out.copy_from_slice(probe.state());
        Ok(())
    }
}

fn create<D: Dynamics>(chosen: &ChosenSolver, flow: Flow<D>, y: &[f64]) -> Result<Box<DynIntegrator<D>>, SolverError> {
    let tolerances = &chosen.tolerances;
    Ok(match chosen.kind {
        SolverKind::CvodeBdf { max_order } => {
            let options = CvodeOptions {
                max_order: Some(max_order),
                ..CvodeOptions::BDF
            };
            Box::new(Cvode::new(flow, options, 0.0, y, tolerances)?)
        }
        SolverKind::CvodeAdams => Box::new(Cvode::new(flow, CvodeOptions::ADAMS, 0.0, y, tolerances)?),
        SolverKind::Cvode { options, .. } => Box::new(Cvode::new(flow, options, 0.0, y, tolerances)?),
        SolverKind::Erk(table) => {
            let stepping = chosen.fixed_step.map_or_else(Stepping::default, Stepping::fixed);
            Box::new(Erk::new(flow, ErkOptions { table, stepping }, 0.0, y, tolerances)?)
        }
        SolverKind::Esdirk(table) => Box::new(Esdirk::new(flow, table, 0.0, y, tolerances)?),
        SolverKind::ClosedForm | SolverKind::Series => unreachable!("not a solver of SUNDIALS"),
    })
}
