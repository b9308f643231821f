//! The error of this crate.

use crate::sundials::{Flag, NonFinite};
use stickslip_system::model::Mode;

/// Why a solver or a run failed.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Error {
    /// Kind of failure.
    pub kind: ErrorKind,
    /// Time of the run, or of a solver on its own clock, s; NaN if there is none.
    pub time: f64,
    /// Place and reason.
    pub message: String,
    /// Callback value that was not finite, if it caused the failure of a solver.
    pub cause: Option<NonFinite>,
}

/// Kind of failure.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A C function of SUNDIALS returned this failure flag.
    Flag(Flag),
    /// The steps are too short to advance the time, as before a singularity.
    Stalled,
    /// A C constructor returned no object: out of memory.
    Allocation,
    /// A slice has the wrong length.
    Length {
        /// Required length.
        expected: usize,
        /// Given length.
        found: usize,
    },
    /// An argument is out of range, or not finite.
    Argument,
    /// A step failed, and the solver has not been restarted.
    NotRestarted,
    /// No step to interpolate since the start, the last restart or a failure.
    NoStep,
    /// A step of an engine without SUNDIALS failed.
    Step,
    /// Transitions follow one another without end.
    Chattering,
    /// The budget of events is used up.
    TooManyEvents,
    /// The budget of steps is used up.
    TooManySteps,
    /// The budget of wall time is used up.
    OutOfTime,
    /// A component of the state is not finite.
    NotFinite,
    /// A recorded value is not finite.
    Overflow,
    /// The motion has left the domain of the model.
    Outside,
    /// The time does not move.
    Standstill,
    /// The pace predicts too many steps.
    NoProgress,
    /// The method cannot run the system.
    Refused,
    /// The recorder failed.
    Recorder,
    /// The observer ended the computation.
    Interrupted,
}

impl Error {
    pub(crate) fn new(kind: ErrorKind, time: f64, message: impl ToString) -> Error {
        Error {
            kind,
            time,
            message: message.to_string(),
            cause: None,
        }
    }

    /// The failure of a solver, with the callback value that caused it.
    pub(crate) fn caused_by(mut self, cause: Option<NonFinite>) -> Error {
        if let Some(cause) = &cause {
            self.message += &format!("; {cause}");
        }
        self.cause = cause;
        self
    }

    pub(crate) fn step(message: impl ToString) -> Error {
        Error::new(ErrorKind::Step, f64::NAN, message)
    }

    pub(crate) fn no_such_solver() -> Error {
        Error::step("the model has no such solver")
    }

    pub(crate) fn refused(message: &'static str) -> Error {
        Error::new(ErrorKind::Refused, f64::NAN, message)
    }

    /// The failure of a recorder.
    pub(crate) fn recorder(error: impl ToString) -> Error {
        Error::new(ErrorKind::Recorder, f64::NAN, error)
    }

    /// Remedy in the words of a case file. `one_sided_test`: one surface's torque alone is compared with the breakaway
    /// torque.
    pub(crate) fn remedy(&self, one_sided_test: bool) -> &'static str {
        match self.kind {
            ErrorKind::Flag(_)
            | ErrorKind::Stalled
            | ErrorKind::Allocation
            | ErrorKind::Length { .. }
            | ErrorKind::Argument
            | ErrorKind::NotRestarted
            | ErrorKind::NoStep
            | ErrorKind::NotFinite => "; another solver.method, solver.rtol or solver.max_step may get over it",
            ErrorKind::Step => ". Try another solver.method",
            ErrorKind::Chattering if one_sided_test => {
                ". Each transition is undone at once; with a one-sided breakaway test that is a property of the test, and \
                 contact.breakaway_test = \"transmitted\" is free of it"
            }
            ErrorKind::Chattering => {
                ". Each transition is undone at once: look for a drive or a normal force that changes as fast as that, or \
                 try another solver.method or a smaller solver.rtol"
            }
            ErrorKind::TooManyEvents => ". Raise solver.max_events if so many are expected",
            ErrorKind::Overflow => {
                ". The case is beyond what double precision can hold: check its numbers and their units"
            }
            ErrorKind::TooManySteps => ". Raise solver.max_steps if so many are expected, or try another solver.method",
            ErrorKind::Outside => {
                ". Raise friction.valid_below if the law holds there, or take one that is given at every speed"
            }
            ErrorKind::OutOfTime => ". Raise --max-wall-time (solver.max_wall_time), or try another solver.method",
            ErrorKind::Standstill => ". Check the parameters of the case and their units, or try another solver.method",
            ErrorKind::NoProgress => {
                ". Check the parameters of the case and their units, or try another solver.method or a larger solver.rtol; \
                 if many steps are meant, say how many with solver.max_steps"
            }
            ErrorKind::Refused | ErrorKind::Recorder | ErrorKind::Interrupted => "",
        }
    }
}

/// Place of a failure in a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ErrorPlace {
    pub time: f64,
    pub mode: Mode,
}

impl ErrorPlace {
    /// An error whose message is `what`, the place, and `why`.
    pub fn error(self, kind: ErrorKind, what: &str, why: impl std::fmt::Display) -> Error {
        let ErrorPlace { time, mode } = self;
        Error::new(
            kind,
            time,
            format!("{what} at t = {time:.12} s in mode {}{why}", mode.name()),
        )
    }

    /// The failure `source` of a solver, with the place in the run.
    pub fn failed(self, solver: &str, source: Error) -> Error {
        let error = self.error(source.kind, &format!("{solver} failed"), format!(": {source}"));
        Error {
            cause: source.cause,
            ..error
        }
    }

    /// Guards fire too often: `what` says how often. The last transition left the mode of the place by `guard`.
    pub fn fired(self, kind: ErrorKind, what: &str, why: &str, guard: &str) -> Error {
        let ErrorPlace { time, mode } = self;
        let mode = mode.name();
        let last = format!("the last from mode {mode} by the guard \"{guard}\"");
        Error::new(kind, time, format!("{what} at t = {time:.12} s{why}, {last}"))
    }

    pub fn too_many_events(self, budget: usize, guard: &str) -> Error {
        let what = format!("the event budget of {budget} transitions is used up");
        self.fired(ErrorKind::TooManyEvents, &what, "", guard)
    }

    pub fn too_many_steps(self, budget: u64) -> Error {
        self.error(
            ErrorKind::TooManySteps,
            &format!("the budget of {budget} steps is used up"),
            "",
        )
    }

    pub fn outside(self, what: &str) -> Error {
        self.error(ErrorKind::Outside, "the model ends", format!(": {what}"))
    }

    pub fn standstill(self, why: &str) -> Error {
        self.error(ErrorKind::Standstill, "the run stands still", format!(": {why}"))
    }

    /// # Errors
    /// If a component of the state is not finite.
    pub fn check_finite(self, state: &[f64]) -> Result<(), Error> {
        match state.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            None => Ok(()),
            Some((component, value)) => {
                let why = format!(": component {component} is {value}");
                Err(self.error(ErrorKind::NotFinite, "the state is not finite", why))
            }
        }
    }
}
