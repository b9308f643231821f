//! The event automaton: modes, guards and transitions, generic over the model.
//!
//! A hybrid system is in one *location* at a time, where its equations are smooth. A location ends when a *guard*, a
//! function of the state, changes sign, or at a *time event*, known beforehand. The model defines their effect on
//! location and state ([`Dynamics`] and [`Rules`]); [`run`] hands each segment to an [`Engine`], restarts at every
//! transition, and streams samples, events and segments to an [`Observer`].
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
//! | `engine`, `solver` | engines that advance a segment; solvers and their settings |
//! | `sundials`, `last_step` | segments by SUNDIALS |
//! | `dips` | guards that cross their boundary and come back within one step |
//! | `budget`, `error` | limits on a run without progress; reasons for failure |

mod budget;
pub mod dips;
mod engine;
mod error;
mod last_step;
mod run;
mod solver;
mod sundials;

pub use budget::Limits;
pub use engine::{Advance, Engine, EngineError, EngineSegment, Fired};
pub(crate) use error::Overflow;
pub use error::RunError;
pub use run::{Finish, Start, run};
pub use solver::{ChosenSolver, SolverKind};

use nalgebra::DMatrixViewMut;
use std::fmt::Debug;
use std::ops::ControlFlow;
use stickslip_system::numerics::band::BandMut;

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

/// The smooth equations and guards of each location. Immutable: solvers share it.
pub trait Dynamics: Send + Sync + 'static {
    /// Everything that is constant within a segment: the contact's mode and its data.
    type Location: Copy + PartialEq + Debug + Send + 'static;

    /// Number of components of the state.
    fn dimension(&self) -> usize;

    /// dy/dt, smooth within a location and a little beyond its guards.
    fn rhs(&self, location: &Self::Location, t: f64, y: &[f64], dydt: &mut [f64]);

    /// Writes the dense Jacobian into a zeroed matrix.
    fn jacobian(&self, location: &Self::Location, t: f64, y: &[f64], jacobian: DMatrixViewMut<'_, f64>);

    /// Half-bandwidth of the Jacobian in the model's band coordinates; `None` if it is dense.
    fn half_width(&self) -> Option<usize> {
        None
    }

    /// Writes the Jacobian in band coordinates into zeros.
    fn band_jacobian(&self, _location: &Self::Location, _t: f64, _y: &[f64], _jacobian: &mut BandMut<'_>) {}

    /// Transforms a change of the state into band coordinates.
    fn enter_band(&self, _x: &[f64], _z: &mut [f64]) {}

    /// Transforms `z`, the solution of (I - gamma J) z = b in band coordinates, back to the coordinates of the state.
    /// `b` is given in the coordinates of the state.
    fn leave_band(&self, _location: &Self::Location, _z: &[f64], _b: &[f64], _x: &mut [f64]) {}

    /// Guards in the order of [`Self::guard_values`].
    fn guards(&self, location: &Self::Location) -> &'static [Guard];

    /// Writes the value of each of [`Self::guards`].
    fn guard_values(&self, location: &Self::Location, t: f64, y: &[f64], values: &mut [f64]);

    /// Writes the derivative of each guard in the direction `change`, a change of time and state. A change of 1 and
    /// the rates of the state gives the guards' rates along the motion.
    fn guard_slopes(&self, location: &Self::Location, t: f64, y: &[f64], change: (f64, &[f64]), slopes: &mut [f64]);

    /// Whether a guard that is zero at the start of a segment moves to its forbidden side. It is then watched only
    /// after it has come back. For models in which a location may be entered against its own guard.
    fn starts_beyond(&self, _location: &Self::Location, _t: f64, _y: &[f64], _guard: usize) -> bool {
        false
    }

    /// Longest step (s) from a state with which a solver sees all changes of the equations; infinite if the equations
    /// change no faster than the solution. Step control alone misses changes between the stages of a step. `one_step`:
    /// the solver has stages, so it is no multistep method.
    fn reach(&self, _location: &Self::Location, _t: f64, _y: &[f64], _one_step: bool) -> f64 {
        f64::INFINITY
    }

    /// The location in words, for messages.
    fn describe(&self, location: &Self::Location) -> String {
        format!("{location:?}")
    }
}

/// One change of location and state at an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition<K, L> {
    /// Kind of the recorded event; `None` for an internal transition, which is not recorded.
    pub kind: Option<K>,
    /// Next location.
    pub location: L,
    /// Next state.
    pub state: Vec<f64>,
}

impl<K, L> Transition<K, L> {
    /// A transition to a location and a state.
    pub fn new(kind: impl Into<Option<K>>, location: L, state: Vec<f64>) -> Self {
        Transition {
            kind: kind.into(),
            location,
            state,
        }
    }
}

/// Effects of guards and time events. The rules may keep a memory (next kick, first stick seen).
pub trait Rules<D: Dynamics> {
    /// Kind of an event.
    type Kind: Copy + Debug;

    /// Next time event, not before `t`.
    fn next_time_event(&mut self, location: &D::Location, t: f64) -> Option<f64>;

    /// Transitions at that instant. Called exactly at the announced time; the transitions must make progress. Empty if
    /// a long search for the next instant has found none so far and has to continue.
    fn at_time_event(&mut self, location: &D::Location, t: f64, y: &[f64]) -> Vec<Transition<Self::Kind, D::Location>>;

    /// Transitions after guards fire; simultaneous guards come together.
    fn at_guards(
        &mut self,
        location: &D::Location,
        t: f64,
        y: &[f64],
        fired: Fired,
    ) -> Vec<Transition<Self::Kind, D::Location>>;

    /// Why the state after a transition lies outside the model's domain, if it does.
    fn outside(&self, _location: &D::Location, _t: f64, _y: &[f64]) -> Option<String> {
        None
    }

    /// Solver, tolerances and step bound for a segment that begins at `t` (s) with the state `y`.
    fn solver(&self, location: &D::Location, t: f64, y: &[f64]) -> ChosenSolver;

    /// The model's own engine for [`Self::solver`]; `None` for the solvers of SUNDIALS.
    fn engine(&self, _kind: &SolverKind) -> Option<Box<dyn Engine<D::Location>>> {
        None
    }

    /// Whether a transition counts against the budget and for the chattering test.
    fn counts(&self, kind: &Self::Kind) -> bool;

    /// Time (s) within which [`Limits::chatter_count`] transitions are chattering.
    fn chatter_window(&self) -> f64;
}

/// A segment that has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentReport<L> {
    /// Start time, s.
    pub start: f64,
    /// End time, s.
    pub end: f64,
    /// Location, constant from start to end.
    pub location: L,
    /// Solver.
    pub solver: SolverKind,
    /// Work of the solver.
    pub counters: crate::sundials::Counters,
}

/// An error from an observer.
pub type ObserverError = Box<dyn std::error::Error + Send + Sync>;

/// Writes the state at a time (s) inside a step.
pub type StateAt<'a> = dyn FnMut(f64, &mut [f64]) -> Result<(), EngineError> + 'a;

/// Receives the run as it is computed.
pub trait Observer<L, K> {
    /// The next time at which a sample is wanted; infinite if none.
    fn next_sample_time(&self) -> f64;

    /// Receives the state at [`Self::next_sample_time`], which must then advance.
    fn sample(&mut self, t: f64, location: &L, y: &[f64]) -> Result<(), ObserverError>;

    /// Whether [`Self::step`] is wanted.
    fn wants_steps(&self) -> bool {
        false
    }

    /// Receives the state at the end of a solver's step.
    fn step(&mut self, _t: f64, _location: &L, _y: &[f64]) -> Result<(), ObserverError> {
        Ok(())
    }

    /// Whether [`Self::inside`] is wanted.
    fn wants_inside(&self) -> bool {
        false
    }

    /// Receives a step from `from` to `to` (s); `at` gives the state at any time inside. Called before the step's
    /// samples.
    fn inside(&mut self, _from: f64, _to: f64, _location: &L, _at: &mut StateAt<'_>) -> Result<(), ObserverError> {
        Ok(())
    }

    /// Receives an event at time `t` (s), with the states on its two sides.
    fn event(&mut self, t: f64, kind: K, before: (&L, &[f64]), after: (&L, &[f64])) -> Result<(), ObserverError>;

    /// Receives a near miss at `t` (s): a guard came as near to its boundary as the solver can tell and turned, or had
    /// just left it.
    fn grazed(&mut self, _t: f64, _location: &L, _guard: &Guard) {}

    /// Receives a finished segment.
    fn segment(&mut self, report: &SegmentReport<L>) -> Result<(), ObserverError>;

    /// Called now and then with the present time (s); `Break` ends the run.
    fn progress(&mut self, _t: f64, _location: &L) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
