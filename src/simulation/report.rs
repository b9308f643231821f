//! The report of a run: how it ended, its events, and the work of its solvers.

use crate::hybrid::{EngineError, RunError};
use crate::model::Mode;
use crate::record::{Event, EventDigest, EventKind};

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// s.
    pub time: f64,
    /// Mode in force at this time.
    pub mode: Mode,
    /// Events of the sequence so far.
    pub events: usize,
}

/// Guards that were as near to their boundaries as the solver can tell, and turned, or had just left them: whether the contact
/// changes there, and for how long, is not decided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grazing {
    /// How often.
    pub count: usize,
    /// The first time, s.
    pub time: f64,
    /// What came so near.
    pub guard: &'static str,
}

/// What is left of a run in memory: everything else went to the recorder.
#[derive(Debug, Clone, Default)]
pub struct RunReport {
    /// Where it ended, s.
    pub end: f64,
    /// Ended early by the control.
    pub interrupted: bool,
    /// All events; none if the recorder stores them ([`Recorder::stores_events`](crate::record::Recorder::stores_events)).
    pub events: Vec<Event>,
    /// What is kept of the events in any case.
    pub digest: EventDigest,
    /// Solver work, one row for each solver used.
    pub work: Vec<SolverWork>,
    /// Largest |residual| of the energy balance at samples and events, J.
    pub energy_residual: f64,
    /// The energy turned over: the largest of what the system holds and has dissipated together, and of the drives' work, at
    /// samples and events, J.
    pub energy_turnover: f64,
    /// Total energy at the start, J.
    pub initial_energy: f64,
    /// Grazing that was not decided.
    pub grazing: Option<Grazing>,
    /// Kicks of the case that the run did not come to.
    pub kicks_never_given: usize,
    /// Of these, kicks set at an instability that did not come.
    pub kicks_without_instability: usize,
    /// One surface's torque alone is held against the breakaway torque.
    pub one_sided_test: bool,
    /// The first stop came at the end of sliding that was followed on its slow manifold: no rounding had grown.
    pub stopped_smoothly: bool,
}

impl RunReport {
    /// What a run returns that has ended so.
    pub(super) fn ended(self, result: Result<(), RunError>) -> Result<RunReport, Box<RunFailure>> {
        match result {
            Ok(()) => Ok(self),
            Err(error) => Err(Box::new(RunFailure { error, report: self })),
        }
    }

    /// Counts the kicks that the run did not come to, of `all` of the case; `waiting` are those that wait for an instability.
    pub(super) fn count_kicks(&mut self, all: usize, waiting: usize) {
        self.kicks_never_given = all.saturating_sub(self.digest.cycles.count(&[EventKind::Kick]));
        self.kicks_without_instability = waiting;
    }
}

/// What one solver did in a run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SolverWork {
    /// Its name, as in [`Segment::solver`](crate::record::Segment::solver).
    pub solver: &'static str,
    /// Segments that it integrated.
    pub segments: u64,
    /// s.
    pub simulated_time: f64,
    /// Accepted steps.
    pub steps: u64,
    /// Evaluations of the right-hand side.
    pub rhs_evaluations: u64,
    /// Evaluations of the Jacobian.
    pub jacobian_evaluations: u64,
}

/// A run that failed, with what it had computed. Its message ends with what to do, in the words of the case file.
#[derive(Debug, thiserror::Error)]
#[error("{error}{}", remedy(error, report.one_sided_test))]
pub struct RunFailure {
    #[source]
    /// What ended the run.
    pub error: RunError,
    /// What had been computed until then.
    pub report: RunReport,
}

fn remedy(error: &RunError, one_sided_test: bool) -> &'static str {
    match error {
        RunError::Engine {
            source: EngineError::Sundials(_),
            ..
        }
        | RunError::NotFinite { .. } => "; another solver.method, solver.rtol or solver.max_step may get over it",
        RunError::Engine { .. } => ". Try another solver.method",
        RunError::Chattering { .. } if one_sided_test => {
            ". Each transition is undone at once; with a one-sided breakaway test that is a property of the test, and \
             contact.breakaway_test = \"transmitted\" is free of it"
        }
        RunError::Chattering { .. } => {
            ". Each transition is undone at once: look for a drive or a normal force that changes as fast as that, or try \
             another solver.method or a smaller solver.rtol"
        }
        RunError::TooManyEvents { .. } => ". Raise solver.max_events if so many are expected",
        RunError::Overflow { .. } => {
            ". The case is beyond what double precision can hold: check its numbers and their units"
        }
        RunError::TooManySteps { .. } => {
            ". Raise solver.max_steps if so many are expected, or try another solver.method"
        }
        RunError::Outside { .. } => {
            ". Raise friction.valid_below if the law holds there, or take one that is given at every speed"
        }
        RunError::OutOfTime { .. } => ". Raise --max-wall-time (solver.max_wall_time), or try another solver.method",
        RunError::Standstill { .. } => ". Check the numbers of the case and their units, or try another solver.method",
        RunError::NoProgress { .. } => {
            ". Check the numbers of the case and their units, or try another solver.method or a larger solver.rtol; if so \
             many steps are meant, say how many with solver.max_steps"
        }
        RunError::Refused(_) | RunError::Observer(_) => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The breakaway test is blamed where it can be.
    #[test]
    fn property_a_remedy_is_of_the_breakaway_test_that_chatters() {
        let said = |one_sided_test: bool| {
            let error = RunError::Chattering {
                time: 1.0,
                count: 100,
                window: 1e-6,
                location: "mode stick".to_owned(),
                guard: "breakaway".to_owned(),
            };
            let report = RunReport {
                one_sided_test,
                ..RunReport::default()
            };
            RunFailure { error, report }.to_string()
        };
        assert!(said(true).contains("contact.breakaway_test"));
        assert!(
            !said(false).contains("contact.") && said(false).contains("solver.method"),
            "{}",
            said(false)
        );
    }
}
