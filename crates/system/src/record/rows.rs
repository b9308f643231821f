//! The rows of a run: samples, events and segments, in SI units.

use super::channel::{Channels, State};
use crate::model::Mode;

/// One row of the trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Time, s; strictly increasing.
    pub time: f64,
    /// Mode at this time.
    pub mode: Mode,
    /// Index of its segment.
    pub segment: u32,
    /// Positions and speeds, SI.
    pub state: State,
    /// Forces, torques and energies, SI.
    pub channels: Channels,
}

/// A stretch of a motion between two events, with a polynomial for every quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DensePiece<'a> {
    /// Start, s.
    pub start: f64,
    /// End, s.
    pub end: f64,
    /// Mode of the piece.
    pub mode: Mode,
    /// Index of its segment.
    pub segment: u32,
    /// Chebyshev coefficients of each quantity, [`COEFFICIENTS`](crate::numerics::chebyshev::COEFFICIENTS) in a row:
    /// [`State`] and [`Channels`] without products, then further values of the run.
    pub coefficients: &'a [f64],
}

/// Kind of an event; the discriminants are the codes of the result file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EventKind {
    /// The surfaces come to relative rest and stay.
    Stick = 0,
    /// The interface breaks away.
    Slip = 1,
    /// The relative velocity changes its sign without a stick.
    Reversal = 2,
    /// The normal force falls to zero and the contact opens.
    Separation = 3,
    /// The contact closes again.
    Contact = 4,
    /// A perturbation of the case acts.
    Kick = 5,
    /// The slope or the value of the actuating force changes.
    Corner = 6,
    /// Steady sliding loses its stability.
    Destabilised = 7,
    /// Steady sliding regains its stability.
    Restabilised = 8,
}

impl EventKind {
    /// Every kind, in the order of the codes.
    pub const ALL: [EventKind; 9] = [
        EventKind::Stick,
        EventKind::Slip,
        EventKind::Reversal,
        EventKind::Separation,
        EventKind::Contact,
        EventKind::Kick,
        EventKind::Corner,
        EventKind::Destabilised,
        EventKind::Restabilised,
    ];

    /// The code in result files.
    pub fn code(self) -> i8 {
        self as i8
    }

    /// The name in result files and reports.
    pub fn name(self) -> &'static str {
        [
            "stick",
            "slip",
            "reversal",
            "separation",
            "contact",
            "kick",
            "corner",
            "destabilised",
            "restabilised",
        ][self as usize]
    }

    /// Whether it belongs to the event sequence; other kinds are information.
    pub fn in_event_sequence(self) -> bool {
        matches!(
            self,
            EventKind::Stick | EventKind::Slip | EventKind::Reversal | EventKind::Separation | EventKind::Contact
        )
    }
}

/// An event, with the state on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Time, s; events may be simultaneous.
    pub time: f64,
    /// Kind of event.
    pub kind: EventKind,
    /// Mode after the event; its sense is the sign of the relative velocity in slip, 0 otherwise.
    pub mode_after: Mode,
    /// Index of the segment that the event ends, or in which it lies.
    pub segment: u32,
    /// State just before the event.
    pub before: State,
    /// State just after the event; different if the event is a jump.
    pub after: State,
    /// T_f / r just before the event, N.
    pub internal_force: f64,
}

/// A stretch integrated without a restart, with its costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Start, s.
    pub start: f64,
    /// End, s.
    pub end: f64,
    /// Mode, constant in the segment.
    pub mode: Mode,
    /// Solver: "cvode-bdf", "cvode-adams", "erk", "esdirk", "closed-form", "series" or "paper".
    pub solver: &'static str,
    /// Whether steps had to resolve the fast torsional mode; `None` from a file that does not say.
    pub resolved: Option<bool>,
    /// Work of the solver.
    pub counters: Counters,
}

/// Work of a solver, since its start or last restart.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Counters {
    /// Accepted steps. (`CVodeGetNumSteps`)
    pub steps: u64,
    /// Evaluations of the right-hand side, including differences for Jacobians. (`CVodeGetNumRhsEvals` +
    /// `CVodeGetNumLinRhsEvals`)
    pub rhs_evaluations: u64,
    /// Evaluations of the Jacobian, or differences in its place. (`CVodeGetNumJacEvals`)
    pub jacobian_evaluations: u64,
    /// Factorisations of the Newton matrix. (`CVodeGetNumLinSolvSetups`)
    pub linear_solver_setups: u64,
    /// Steps rejected by the test of the local error. (`CVodeGetNumErrTestFails`)
    pub error_test_failures: u64,
    /// Newton or fixed-point iterations. (`CVodeGetNumNonlinSolvIters`)
    pub nonlinear_iterations: u64,
    /// Iterations that did not converge. (`CVodeGetNumNonlinSolvConvFails`)
    pub nonlinear_convergence_failures: u64,
    /// Evaluations of the guards. (`CVodeGetNumGEvals`)
    pub root_evaluations: u64,
    /// Order of the last step; 0 before the first step, or if the solver has none. (`CVodeGetLastOrder`)
    pub last_order: u32,
    /// Length of the last step, s; 0 before the first. (`CVodeGetLastStep`)
    pub last_step: f64,
}
