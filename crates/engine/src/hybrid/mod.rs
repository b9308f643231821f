//! The event automaton: modes, guards and transitions of a system.
//!
//! A hybrid system is in one *location* at a time, where its equations are smooth. A location ends when a *guard*, a
//! function of the state, changes sign, or at a *time event*, known beforehand. [`SystemDynamics`] has the
//! equations and guards of each location, and [`Rules`] the effects; [`run`] hands each segment to an [`Engine`],
//! restarts at every transition, and streams samples, events and segments to an [`Observer`].
//!
//! Three conventions matter:
//!
//! * Each segment has its own clock that starts at zero, so that the resolution of a root depends on the segment's
//!   length and not on the time since the start.
//! * A guard counts as being on its allowed side at the very start of a segment, whatever rounding says. A guard that
//!   just fired cannot fire again by itself, a tangential departure (zero value, zero slope) is no root, and neither
//!   time nor state is nudged. A guard that is truly beyond its boundary fires within the first step.
//! * Time events are stop times of the solver: no step crosses one.
//!
//! | module | what it is |
//! |---|---|
//! | `run` | the loop: segment after segment |
//! | `dynamics` | locations, guards and equations of a system |
//! | `excitation` | signals and normal force as functions of time |
//! | `engine`, `solver` | engines that advance a segment; solvers and their settings |
//! | `sundials`, `last_step` | segments by SUNDIALS |
//! | `dips` | guards that cross their boundary and come back within one step |
//! | `budget` | limits on a run without progress |

mod budget;
pub mod dips;
pub(crate) mod dynamics;
mod engine;
pub(crate) mod excitation;
mod last_step;
mod run;
mod solver;
mod sundials;

pub use budget::Limits;
pub use dynamics::{MarginWatch, SystemDynamics, SystemLocation};
pub use engine::{Advance, Engine, EngineSegment, Fired};
pub use excitation::Excitation;
pub use run::{Finish, Start, run};
pub use solver::{ChosenSolver, SolverKind};

use crate::Error;
use std::ops::ControlFlow;
use stickslip_system::record::EventKind;

pub use crate::sundials::Direction;

/// A function whose zero ends a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guard {
    /// Name in messages.
    pub name: &'static str,
    /// Crossing direction that fires it.
    pub direction: Direction,
    /// Whether the guard ends a mode of the contact: a near miss is then reported.
    pub ends_mode: bool,
}

/// One change of location and state at an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Kind of the recorded event; `None` for an internal transition, which is not recorded.
    pub kind: Option<EventKind>,
    /// Next location.
    pub location: SystemLocation,
    /// Next state.
    pub state: Vec<f64>,
}

impl Transition {
    /// A transition to a location and a state.
    pub fn new(kind: impl Into<Option<EventKind>>, location: SystemLocation, state: Vec<f64>) -> Self {
        Transition {
            kind: kind.into(),
            location,
            state,
        }
    }
}

/// Effects of guards and time events. The rules may keep a memory (next kick, first stick seen).
pub trait Rules {
    /// Next time event, not before `t`.
    fn next_time_event(&mut self, location: &SystemLocation, t: f64) -> Option<f64>;

    /// Transitions at that instant. Called exactly at the announced time; the transitions must make progress. Empty if
    /// a long search for the next instant has found none so far and has to continue.
    fn at_time_event(&mut self, location: &SystemLocation, t: f64, y: &[f64]) -> Vec<Transition>;

    /// Transitions after guards fire; simultaneous guards come together.
    fn at_guards(&mut self, location: &SystemLocation, t: f64, y: &[f64], fired: Fired) -> Vec<Transition>;

    /// Why the state after a transition lies outside the model's domain, if it does.
    fn outside(&self, _location: &SystemLocation, _t: f64, _y: &[f64]) -> Option<String> {
        None
    }

    /// Solver, tolerances and step bound for a segment that begins at `t` (s) with the state `y`.
    fn solver(&self, location: &SystemLocation, t: f64, y: &[f64]) -> ChosenSolver;

    /// The model's own engine for [`Self::solver`]; `None` for the solvers of SUNDIALS.
    fn engine(&self, _kind: &SolverKind) -> Option<Box<dyn Engine>> {
        None
    }
}

/// A segment that has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentReport {
    /// Start time, s.
    pub start: f64,
    /// End time, s.
    pub end: f64,
    /// Location, constant from start to end.
    pub location: SystemLocation,
    /// Solver.
    pub solver: SolverKind,
    /// Work of the solver.
    pub counters: crate::sundials::Counters,
}

/// Writes the state at a time (s) inside a step.
pub type StateAt<'a> = dyn FnMut(f64, &mut [f64]) -> Result<(), Error> + 'a;

/// Receives the run as it is computed.
pub trait Observer {
    /// The next time at which a sample is wanted; infinite if none.
    fn next_sample_time(&self) -> f64;

    /// Receives the state at [`Self::next_sample_time`], which must then advance.
    fn sample(&mut self, t: f64, location: &SystemLocation, y: &[f64]) -> Result<(), Error>;

    /// Whether [`Self::step`] is wanted.
    fn wants_steps(&self) -> bool {
        false
    }

    /// Receives the state at the end of a solver's step.
    fn step(&mut self, _t: f64, _location: &SystemLocation, _y: &[f64]) -> Result<(), Error> {
        Ok(())
    }

    /// Whether [`Self::inside`] is wanted.
    fn wants_inside(&self) -> bool {
        false
    }

    /// Receives a step from `from` to `to` (s); `at` gives the state at any time inside. Called before the step's
    /// samples.
    fn inside(&mut self, _from: f64, _to: f64, _location: &SystemLocation, _at: &mut StateAt<'_>) -> Result<(), Error> {
        Ok(())
    }

    /// Receives an event at time `t` (s), with the states on its two sides.
    fn event(
        &mut self,
        t: f64,
        kind: EventKind,
        before: (&SystemLocation, &[f64]),
        after: (&SystemLocation, &[f64]),
    ) -> Result<(), Error>;

    /// Receives a near miss at `t` (s): a guard came as near to its boundary as the solver can tell and turned, or had
    /// just left it.
    fn grazed(&mut self, _t: f64, _location: &SystemLocation, _guard: &Guard) {}

    /// Receives a finished segment.
    fn segment(&mut self, report: &SegmentReport) -> Result<(), Error>;

    /// Called now and then with the present time (s); `Break` ends the run.
    fn progress(&mut self, _t: f64, _location: &SystemLocation) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
