//! Report of a run: its end, its events, and the work of its solvers.

use crate::Error;
use stickslip_system::record::{Event, EventDigest, EventKind};

/// Near misses: guards that came as near to their boundaries as the solver can tell and turned, or had just left them.
/// Whether the contact changes there, and for how long, is undecided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grazing {
    /// Number of near misses.
    pub count: usize,
    /// Time of the first one, s.
    pub time: f64,
    /// Guard of the first one.
    pub guard: &'static str,
}

/// Summary of a run; samples and segments went to the recorder.
#[derive(Debug, Clone, Default)]
pub struct RunReport {
    /// End time, s.
    pub end: f64,
    /// Whether the control ended the run early.
    pub interrupted: bool,
    /// All events; none if the recorder stores them ([`Recorder::stores_events`](stickslip_system::record::Recorder::stores_events)).
    pub events: Vec<Event>,
    /// Digest of the events, always kept.
    pub digest: EventDigest,
    /// Solver work, one row for each solver used.
    pub work: Vec<SolverWork>,
    /// Largest |residual| of the energy balance at samples and events, J.
    pub energy_residual: f64,
    /// Largest energy turnover at samples and events, J: held plus dissipated energy, or the drives' work.
    pub energy_turnover: f64,
    /// Energy that friction has turned into heat up to the last sample or event, J.
    pub dissipated_energy: f64,
    /// Total energy at the start, J.
    pub initial_energy: f64,
    /// Near misses whose outcome is undecided, if there are any.
    pub grazing: Option<Grazing>,
    /// Number of kicks of the case that the run did not reach.
    pub kicks_never_given: usize,
    /// Number of those kicks that wait for an instability that did not come.
    pub kicks_without_instability: usize,
    /// Whether one surface's torque alone is compared with the breakaway torque.
    pub one_sided_test: bool,
    /// Whether sliding ended on its slow manifold at the first stop, so that no rounding had grown.
    pub stopped_smoothly: bool,
}

impl RunReport {
    pub(super) fn ended(self, result: Result<(), Error>) -> Result<RunReport, Box<RunFailure>> {
        match result {
            Ok(()) => Ok(self),
            Err(error) => Err(Box::new(RunFailure { error, report: self })),
        }
    }

    pub(super) fn count_kicks(&mut self, all: usize, waiting: usize) {
        self.kicks_never_given = all.saturating_sub(self.digest.cycles.count(&[EventKind::Kick]));
        self.kicks_without_instability = waiting;
    }
}

/// Work of one solver in a run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SolverWork {
    /// Name, as in [`Segment::solver`](stickslip_system::record::Segment::solver).
    pub solver: &'static str,
    /// Number of integrated segments.
    pub segments: u64,
    /// Simulated time, s.
    pub simulated_time: f64,
    /// Accepted steps.
    pub steps: u64,
    /// Evaluations of the right-hand side.
    pub rhs_evaluations: u64,
    /// Evaluations of the Jacobian.
    pub jacobian_evaluations: u64,
}

/// A failed run with its results so far. The message ends with a remedy, in the words of the case file.
#[derive(Debug, thiserror::Error)]
#[error("{error}{}", error.remedy(report.one_sided_test))]
pub struct RunFailure {
    #[source]
    /// Error that ended the run.
    pub error: Error,
    /// Results until then.
    pub report: RunReport,
}
