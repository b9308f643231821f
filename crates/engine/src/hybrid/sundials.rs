//! Segments by the solvers of SUNDIALS.

use super::dips::{Dips, Of};
use super::last_step::{Flow, LastStep};
use super::{
    Advance, ChosenSolver, Direction, Engine, EngineSegment, Fired, SolverKind, SystemDynamics, SystemLocation,
};
use crate::Error;
use crate::sundials::{AdvanceTarget, Advanced, Counters, Solver, SolverMethod, Tolerances};
use std::sync::Arc;

const MOST_REFINEMENTS: usize = 4;

/// A multistep method does not resolve an event whose guard stays within this multiple of its tolerated error.
const UNRESOLVED: f64 = 100.0;

pub(super) struct SundialsEngine {
    dynamics: Arc<SystemDynamics>,
    step: LastStep,
    dips: Dips,
    location: SystemLocation,
    origin: f64,
    span: f64,
    /// Next stop time of the solver on the segment's clock, s: the segment's end, or earlier by [`SystemDynamics::reach`].
    stop: f64,
    fixed_step: bool,
    tolerances: Tolerances,
    unresolved: Option<(f64, usize)>,
    tau: f64,
    state: Vec<f64>,
    values: Vec<f64>,
    ahead: Vec<f64>,
    rates: Vec<f64>,
    moved: Vec<f64>,
}

impl SundialsEngine {
    pub(super) fn new(
        dynamics: Arc<SystemDynamics>,
        chosen: &ChosenSolver,
        segment: &EngineSegment<'_>,
    ) -> Result<Self, Error> {
        let flow = || Flow {
            dynamics: dynamics.clone(),
            location: segment.location,
            origin: segment.start,
            settling: 0.0,
        };
        let one_step = matches!(chosen.kind, SolverKind::Erk(_) | SolverKind::Esdirk);
        let probe = one_step.then(|| create(chosen, flow(), segment.state)).transpose()?;
        let step = LastStep {
            solver: create(chosen, flow(), segment.state)?,
            probe,
            start: 0.0,
            start_state: segment.state.to_vec(),
        };
        let state = segment.state.to_vec();
        Ok(SundialsEngine {
            dips: Dips::new(&dynamics, &segment.location, chosen),
            location: segment.location,
            origin: segment.start,
            span: segment.span(),
            stop: segment.span(),
            fixed_step: chosen.fixed_step.is_some(),
            tolerances: chosen.tolerances.clone(),
            unresolved: None,
            tau: 0.0,
            values: Vec::new(),
            ahead: Vec::new(),
            rates: state.clone(),
            moved: state.clone(),
            state,
            step,
            dynamics,
        })
    }

    /// Whether a firing guard has stayed within its tolerated error. Neither its event nor the segment's length is
    /// then significant. One-step methods follow even such a segment, because their steps are long enough.
    fn is_unresolved(&mut self, guard: usize) -> bool {
        if self.step.probe.is_some() {
            return false;
        }
        let (t, dynamics, location) = (self.origin + self.tau, &self.dynamics, &self.location);
        let guards = dynamics.guards(location).len();
        self.values.resize(guards, 0.0);
        self.ahead.resize(guards, 0.0);
        dynamics.guard_values(location, t, &self.state, &mut self.values);
        let mut tolerated = 0.0;
        for (index, absolute) in self.tolerances.absolute.iter().enumerate() {
            self.moved.copy_from_slice(&self.state);
            self.moved[index] += absolute + self.tolerances.relative * self.state[index].abs();
            dynamics.guard_values(location, t, &self.moved, &mut self.ahead);
            tolerated += (self.ahead[guard] - self.values[guard]).abs();
        }
        self.dips.largest(guard) <= UNRESOLVED * tolerated
    }

    /// Time of the root in the last step, to the accuracy of the method. Leaves the state at the root in `self.state`.
    ///
    /// Without a probe it is the solver's root. With a probe, Newton's method on the repeated step refines the root of
    /// the dense output.
    fn refine_root(&mut self, guard: usize) -> Result<f64, Error> {
        let mut tau = self.step.solver.time();
        self.state.copy_from_slice(self.step.solver.state());
        if self.step.probe.is_none() {
            return Ok(tau);
        }
        let end = self.step.solver.mesh_time()?;
        let guards = self.dynamics.guards(&self.location).len();
        self.values.resize(guards, 0.0);
        self.ahead.resize(guards, 0.0);
        for _ in 0..MOST_REFINEMENTS {
            self.step.state_at(tau, &mut self.state)?;
            let (t, dynamics, location) = (self.origin + tau, &self.dynamics, &self.location);
            dynamics.guard_values(location, t, &self.state, &mut self.values);
            dynamics.rhs(location, t, &self.state, &mut self.rates);
            // Derivative of the guard along the flow, by a step far shorter than any time scale of the solution.
            let probe_step = 1e-6 * (end - self.step.start);
            for (y, (state, rate)) in self.moved.iter_mut().zip(self.state.iter().zip(&self.rates)) {
                *y = state + probe_step * rate;
            }
            dynamics.guard_values(location, t + probe_step, &self.moved, &mut self.ahead);
            let slope = (self.ahead[guard] - self.values[guard]) / probe_step;
            let next = tau - self.values[guard] / slope;
            // With a zero slope, or a correction out of the step, the root is a graze and stays where it is.
            if !(next > self.step.start && next <= end) {
                break;
            }
            let change = (next - tau).abs();
            if change <= 4.0 * f64::EPSILON * end {
                break;
            }
            tau = next;
        }
        Ok(tau)
    }
}

impl Engine for SundialsEngine {
    fn begin(&mut self, segment: &EngineSegment<'_>, chosen: &ChosenSolver) -> Result<(), Error> {
        (self.location, self.origin, self.span) = (segment.location, segment.start, segment.span());
        self.tau = 0.0;
        self.state.copy_from_slice(segment.state);
        let step = &mut self.step;
        step.start = 0.0;
        step.start_state.copy_from_slice(segment.state);
        for solver in std::iter::once(&mut step.solver).chain(step.probe.as_mut()) {
            let flow = solver.system_mut();
            flow.location = segment.location;
            flow.origin = segment.start;
            flow.settling = match chosen.kind {
                SolverKind::Cvode { settling, .. } => settling,
                _ => 0.0,
            };
            solver.set_tolerances(&chosen.tolerances)?;
        }
        let crossings: Vec<Direction> = self
            .dynamics
            .guards(&segment.location)
            .iter()
            .map(|guard| guard.direction)
            .collect();
        step.solver.restart(0.0, segment.state)?;
        step.solver.set_crossings(&crossings)?;
        step.solver.set_max_step(chosen.max_step)?;
        step.solver.set_stop_time(Some(self.span))?;
        (self.stop, self.fixed_step) = (self.span, chosen.fixed_step.is_some());
        self.dips = Dips::new(&self.dynamics, &segment.location, chosen);
        (self.tolerances, self.unresolved) = (chosen.tolerances.clone(), None);
        Ok(())
    }

    fn advance(&mut self) -> Result<Advance, Error> {
        if self.tau > 0.0 {
            self.step.start = self.tau;
            self.step.start_state.copy_from_slice(&self.state);
        }
        if !self.fixed_step {
            let (t, one_step) = (self.origin + self.tau, self.step.probe.is_some());
            let reach = self.dynamics.reach(&self.location, t, &self.state, one_step);
            let stop = self.span.min(self.tau + reach);
            if stop != self.stop {
                self.step.solver.set_stop_time(Some(stop))?;
                self.stop = stop;
            }
        }
        let outcome = self.step.solver.advance(self.span, AdvanceTarget::OneStep)?;
        let mut advance = Advance::Stepped;
        if outcome == Advanced::Roots {
            let fired = Fired::by_index(self.step.solver.crossings_found().iter().map(Option::is_some));
            self.tau = self.refine_root(fired.first())?;
            advance = Advance::Guards(fired);
        } else {
            self.tau = self.step.solver.time();
            self.state.copy_from_slice(self.step.solver.state());
            if self.tau >= self.span {
                advance = Advance::Stop;
            }
        }
        let of = Of {
            dynamics: &self.dynamics,
            location: &self.location,
            origin: self.origin,
        };
        let dip = self.dips.in_step(&of, &mut self.step, (self.tau, &self.state))?;
        if let Some(dip) = dip {
            self.tau = dip.time;
            self.step.state_at(self.tau, &mut self.state)?;
            advance = Advance::Guards(Fired::one(dip.guard));
        }
        if let Advance::Guards(fired) = advance
            && self.is_unresolved(fired.first())
        {
            self.unresolved = Some((self.tau, fired.first()));
        }
        Ok(advance)
    }

    fn time(&self) -> f64 {
        self.tau
    }

    fn state(&self) -> &[f64] {
        &self.state
    }

    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), Error> {
        self.step.state_at(tau.min(self.tau), out)
    }

    fn grazed(&mut self) -> Option<(f64, usize)> {
        let dip = self.dips.grazed().map(|dip| (dip.time, dip.guard));
        dip.or_else(|| self.unresolved.take())
    }

    fn counters(&mut self) -> Result<Counters, Error> {
        self.step.solver.counters()
    }
}

fn create(chosen: &ChosenSolver, flow: Flow, y: &[f64]) -> Result<Solver<Flow>, Error> {
    let method = match chosen.kind {
        SolverKind::Cvode { options, .. } => options.into(),
        SolverKind::Erk(table) => SolverMethod::Erk {
            table,
            fixed_step: chosen.fixed_step,
        },
        SolverKind::Esdirk => SolverMethod::ESDIRK,
        SolverKind::ClosedForm | SolverKind::Series | SolverKind::Rk4 => return Err(Error::no_such_solver()),
    };
    Solver::new(flow, method, 0.0, y, &chosen.tolerances)
}
