//! The event automaton: modes, guards and transitions, generic over the model.
//!
//! A hybrid system is in one *location* at a time. In it the equations are smooth; *guards* are functions whose sign
//! change ends it; *time events* end it at times known beforehand. The model says what each of them does to location
//! and state ([`Dynamics`] and [`Rules`]); [`run`] hands each segment to an [`Engine`], restarts at every transition, and
//! streams samples, events and segments to an [`Observer`].
//!
//! Three conventions carry the weight:
//!
//! * Each segment has its own clock that starts at zero. A root is located relative to the clock, so that its resolution
//!   is that of the segment's length and not of seconds since the start.
//! * A guard counts as being on its allowed side at the very start of a segment, whatever rounding says. A guard that
//!   just fired therefore cannot fire again by itself, a tangential departure (zero value, zero slope) is no root, and
//!   neither time nor state is nudged. A guard that truly stands beyond its boundary fires within the first step.
//! * Time events are stop times of the solver: no step crosses one.
//!
//! | module | what it is |
//! |---|---|
//! | `run` | the loop: segment after segment |
//! | `engine`, `solver` | what advances a segment, and which solver with which settings that is |
//! | `sundials`, `last_step`, `closed_form` | segments by SUNDIALS and in closed form |
//! | `dips` | guards that cross their boundary and come back within one step |
//! | `budget`, `error` | what ends a run without progress; why a run fails |
//! | `rounding` | what rounding does to the times of events |
//! | `variation` | derivatives by numbers of the case |

mod budget;
mod closed_form;
mod dips;
mod engine;
mod error;
mod last_step;
mod rounding;
mod run;
mod solver;
mod sundials;
mod variation;

pub use budget::Limits;
pub use closed_form::{ClosedEnd, ClosedForm, ClosedFormEngine};
pub use engine::{Advance, Engine, EngineError, Fired, Segment};
pub(crate) use error::Overflow;
pub use error::RunError;
pub use run::{Finish, Start, run};
pub use solver::{ChosenSolver, SolverKind};
pub(crate) use variation::{Carried, CarryingRules, Measures, MovedCopy, MovedNumber, Passage, Replaced};

use crate::numerics::band::BandMut;
use nalgebra::DMatrixViewMut;
use std::fmt::Debug;
use std::ops::ControlFlow;

pub use crate::sundials::Direction;

/// A function whose zero ends a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Guard {
    /// For messages.
    pub name: &'static str,
    /// The crossing that fires it.
    pub direction: Direction,
    /// It ends a mode of the contact: to come near its boundary is worth telling.
    pub ends_mode: bool,
}

/// The smooth equations and guards of each location. Immutable: solvers share it.
pub trait Dynamics: Send + Sync + 'static {
    /// What is constant within a segment: the mode, and what goes with it.
    type Location: Copy + PartialEq + Debug + Send + 'static;

    /// Number of components of the state.
    fn dimension(&self) -> usize;

    /// dy/dt, smooth within a location and a little beyond its guards.
    fn rhs(&self, location: &Self::Location, t: f64, y: &[f64], dydt: &mut [f64]);

    /// Writes the dense Jacobian into a zeroed matrix.
    fn jacobian(&self, location: &Self::Location, t: f64, y: &[f64], jacobian: DMatrixViewMut<'_, f64>);

    /// How far from its diagonal the Jacobian has entries in coordinates of its own; `None` where it is dense.
    fn half_width(&self) -> Option<usize> {
        None
    }

    /// Writes the Jacobian in those coordinates into zeros.
    fn band_jacobian(&self, _location: &Self::Location, _t: f64, _y: &[f64], _jacobian: &mut BandMut<'_>) {}

    /// Takes a change of the state into those coordinates.
    fn enter_band(&self, _x: &[f64], _z: &mut [f64]) {}

    /// Takes `z`, the solution of (I - gamma J) z = b in those coordinates, back to the state's, in which `b` is given.
    fn leave_band(&self, _location: &Self::Location, _z: &[f64], _b: &[f64], _x: &mut [f64]) {}

    /// In the order of the values that [`Self::guard_values`] gives.
    fn guards(&self, location: &Self::Location) -> &'static [Guard];

    /// One value for each of [`Self::guards`].
    fn guard_values(&self, location: &Self::Location, t: f64, y: &[f64], values: &mut [f64]);

    /// Whether a guard that is zero at the start of a segment leaves zero to its forbidden side and is to be watched only
    /// once it has come back: for models in which a location may be entered against its own guard.
    fn starts_beyond(&self, _location: &Self::Location, _t: f64, _y: &[f64], _guard: usize) -> bool {
        false
    }

    /// How long (s) a step from a state may be for a solver to see what the equations do on the way. Step control alone does
    /// not know of what happens between the stages of a step; `one_step` says that the solver has stages, and is not a
    /// multistep method. Infinite where the equations change no faster than the solution.
    fn reach(&self, _location: &Self::Location, _t: f64, _y: &[f64], _one_step: bool) -> f64 {
        f64::INFINITY
    }

    /// The location in words, for messages.
    fn describe(&self, location: &Self::Location) -> String {
        format!("{location:?}")
    }
}

/// One step of what happens at an instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition<K, L> {
    /// What to record; `None` for an internal transition, which is not recorded.
    pub kind: Option<K>,
    /// Where the run goes on.
    pub location: L,
    /// State after it.
    pub state: Vec<f64>,
}

impl<K, L> Transition<K, L> {
    /// To a location and a state; `None` as its kind is not recorded.
    pub fn new(kind: impl Into<Option<K>>, location: L, state: Vec<f64>) -> Self {
        Transition {
            kind: kind.into(),
            location,
            state,
        }
    }
}

/// What guards and time events do. It may remember (which kick is next, whether the first stick has been).
pub trait Rules<D: Dynamics> {
    /// What an event is called.
    type Kind: Copy + Debug;

    /// The next instant, not before `t`, at which something happens by the clock.
    fn next_time_event(&mut self, location: &D::Location, t: f64) -> Option<f64>;

    /// What happens at that instant; called exactly at the time that was named, and must make progress. Nothing, if the
    /// search for the next instant has found none so far, with the work of very many steps, and goes on from there.
    fn at_time_event(&mut self, location: &D::Location, t: f64, y: &[f64]) -> Vec<Transition<Self::Kind, D::Location>>;

    /// What happens when guards fire, simultaneous ones together.
    fn at_guards(
        &mut self,
        location: &D::Location,
        t: f64,
        y: &[f64],
        fired: Fired,
    ) -> Vec<Transition<Self::Kind, D::Location>>;

    /// Why the model is not given in a location with a state that a transition has led to; `None` where it is.
    fn outside(&self, _location: &D::Location, _t: f64, _y: &[f64]) -> Option<String> {
        None
    }

    /// Which solver integrates a segment at a location that begins at `t` (s) with the state `y`, with which tolerances and step
    /// bound.
    fn solver(&self, location: &D::Location, t: f64, y: &[f64]) -> ChosenSolver;

    /// The model's own engine for [`Self::solver`]; `None` where it has none, and for the solvers of SUNDIALS.
    fn engine(&self, _kind: &SolverKind) -> Option<Box<dyn Engine<D::Location>>> {
        None
    }

    /// Whether a transition counts against the budget and for the chattering test.
    fn counts(&self, kind: &Self::Kind) -> bool;

    /// So many transitions as [`Limits::chatter_count`] within this time (s) are chattering.
    fn chatter_window(&self) -> f64;
}

/// A segment that has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentReport<L> {
    /// s.
    pub start: f64,
    /// s.
    pub end: f64,
    /// Constant from start to end.
    pub location: L,
    /// Which solver.
    pub solver: SolverKind,
    /// Its work.
    pub counters: crate::sundials::Counters,
}

/// An error from an observer.
pub type ObserverError = Box<dyn std::error::Error + Send + Sync>;

/// Writes the state at a time (s) inside of a step.
pub type StateAt<'a> = dyn FnMut(f64, &mut [f64]) -> Result<(), EngineError> + 'a;

/// Takes the run as it is computed.
pub trait Observer<L, K> {
    /// The next time at which a sample is wanted; infinite if none.
    fn next_sample_time(&self) -> f64;

    /// The state at [`Self::next_sample_time`] (which must then move on).
    fn sample(&mut self, t: f64, location: &L, y: &[f64]) -> Result<(), ObserverError>;

    /// Whether [`Self::step`] is wanted.
    fn wants_steps(&self) -> bool {
        false
    }

    /// The state at the end of a solver's step.
    fn step(&mut self, _t: f64, _location: &L, _y: &[f64]) -> Result<(), ObserverError> {
        Ok(())
    }

    /// Whether [`Self::inside`] is wanted.
    fn wants_inside(&self) -> bool {
        false
    }

    /// A step from `from` to `to` (s) has been made; `at` gives the state at any time inside it. Before the samples that are due
    /// there.
    fn inside(&mut self, _from: f64, _to: f64, _location: &L, _at: &mut StateAt<'_>) -> Result<(), ObserverError> {
        Ok(())
    }

    /// An event at time `t` (s), with the states on its two sides.
    fn event(&mut self, t: f64, kind: K, before: (&L, &[f64]), after: (&L, &[f64])) -> Result<(), ObserverError>;

    /// At `t` (s) a guard was as near to its boundary as the solver can tell, and turned, or had just left it.
    fn grazed(&mut self, _t: f64, _location: &L, _guard: &Guard) {}

    /// A segment has ended.
    fn segment(&mut self, report: &SegmentReport<L>) -> Result<(), ObserverError>;

    /// Called now and then with how far the run is; `Break` ends it.
    fn progress(&mut self, _t: f64, _location: &L) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
