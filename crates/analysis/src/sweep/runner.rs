//! Runs of points on a pool of threads, with one receiver of the outcomes.

use super::outcome::{EventRow, PointOutcome, Values, values};
use super::study::{Study, StudyPoint};
use crate::analysis::{Summary, recorded};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use stickslip_case::{Case, CaseError};
use stickslip_engine::simulation::{RunFailure, RunReport};
use stickslip_engine::workers::on_threads;
use stickslip_system::record::NoRecorder;
use stickslip_system::watch::Watch;

/// Integration of one case of a sweep, without a file or into the case's own file.
pub type Integrate<'a> = dyn Fn(u64, &Case, &dyn Watch) -> Result<Integrated, IntegrateError> + Sync + 'a;

/// Result of a run in a sweep.
#[derive(Debug)]
pub struct Integrated {
    /// Report of the run.
    pub report: RunReport,
    /// Quantities; `None` for an interrupted run.
    pub values: Option<Values>,
}

impl Integrated {
    pub(super) fn new(report: RunReport, summary: &Summary) -> Integrated {
        let values = (!report.interrupted).then(|| values(summary));
        Integrated { report, values }
    }
}

/// Error of a case in a sweep.
#[derive(Debug, thiserror::Error)]
pub enum IntegrateError {
    /// The run failed: the point is recorded as failed, and the sweep continues.
    #[error(transparent)]
    Run(Box<RunFailure>),
    /// The storage failed: the sweep ends.
    #[error("{0}")]
    Storage(String),
}

/// Integrates a case and keeps only its events.
pub fn without_a_file(_number: u64, case: &Case, watch: &dyn Watch) -> Result<Integrated, IntegrateError> {
    let run = recorded(case, &mut NoRecorder, false, false, watch);
    match run.failure {
        Some(failure) => Err(IntegrateError::Run(failure)),
        None => Ok(Integrated::new(run.report, &run.summary)),
    }
}

/// Reason why a pool stopped early.
#[derive(Debug)]
pub enum Stopped<E> {
    /// The observer stopped it.
    Interrupted,
    /// The receiver of the outcomes failed.
    Delivery(E),
    /// The storage of a run failed.
    Storage(String),
}

const WAITING: usize = 256;

/// Time during which outcomes are grouped to share the cost of a disk sync.
const GATHERING: Duration = Duration::from_millis(20);

/// Runs `points` on `workers` threads and passes their outcomes to `deliver`, in groups and in the order of completion.
///
/// The outcome of a point depends only on the study and the point's coordinates. After a stop or an error, which is
/// returned, current points are abandoned.
pub fn run_points<E>(
    study: &Study,
    points: impl Iterator<Item = StudyPoint> + Send,
    workers: usize,
    watch: &dyn Watch,
    integrate: &Integrate,
    mut deliver: impl FnMut(Vec<PointOutcome>) -> Result<(), E>,
) -> Result<(), Stopped<E>> {
    let given_up = AtomicBool::new(false);
    let halted = || watch.stopped() || given_up.load(Ordering::Relaxed);
    let mut error = None;
    let job = |point: StudyPoint| match halted() {
        true => None,
        false => run_point(study, &point, integrate, &halted).transpose(),
    };
    on_threads(workers, WAITING, points, job, |receiver| {
        let mut gathered = Instant::now();
        while let Ok(first) = receiver.recv() {
            let mut group = Vec::new();
            let mut next = Some(first);
            while let Some(result) = next.take() {
                match result {
                    Ok(outcome) => group.push(outcome),
                    Err(message) => error = error.take().or(Some(Stopped::Storage(message))),
                }
                // The other half of the capacity stays free for new outcomes.
                if group.len() < WAITING / 2 {
                    next = receiver.recv_timeout(GATHERING.saturating_sub(gathered.elapsed())).ok();
                }
            }
            gathered = Instant::now();
            // After an error the channel is emptied, so that no worker blocks.
            if error.is_none()
                && let Err(failure) = deliver(group)
            {
                error = Some(Stopped::Delivery(failure));
            }
            if error.is_some() {
                given_up.store(true, Ordering::Relaxed);
            }
        }
    });
    match error {
        Some(error) => Err(error),
        None if watch.stopped() => Err(Stopped::Interrupted),
        None => Ok(()),
    }
}

/// Runs one point; `None` if abandoned. Only its storage can fail. A failed run is an outcome.
pub fn run_point(
    study: &Study,
    point: &StudyPoint,
    integrate: &Integrate,
    watch: &dyn Watch,
) -> Result<Option<PointOutcome>, String> {
    let outcome = |result, events| {
        Ok(Some(PointOutcome {
            number: point.number,
            result,
            events,
        }))
    };
    let case = match study.case_at(&point.coordinates) {
        Ok(case) => case,
        Err(error) => return outcome(Err(in_words(&error)), Vec::new()),
    };
    // A defect in one run must not stop the other runs.
    let result = catch_unwind(AssertUnwindSafe(|| integrate(point.number, &case, watch)));
    match result {
        Ok(Ok(Integrated { values: None, .. })) => Ok(None),
        Ok(Ok(Integrated {
            report,
            values: Some(values),
        })) => {
            let events = if study.keep.events {
                report.events.iter().map(EventRow::from).collect()
            } else {
                Vec::new()
            };
            outcome(Ok(values), events)
        }
        Ok(Err(IntegrateError::Run(failure))) => outcome(Err(failure.to_string()), Vec::new()),
        Ok(Err(IntegrateError::Storage(message))) => Err(message),
        Err(_) => outcome(Err("internal error: the run panicked".to_owned()), Vec::new()),
    }
}

/// Problems of a point in one line, without their places, which are places in the study.
fn in_words(error: &CaseError) -> String {
    let problems = error
        .problems
        .iter()
        .map(|problem| format!("{}: {}", problem.key, problem.message));
    problems.collect::<Vec<_>>().join("; ")
}
