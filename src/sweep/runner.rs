//! Runs points on a pool of threads, and hands the outcomes to one place.

use super::quantities::{EventRow, Outcome, Values, values};
use super::study::{Point, Study};
use crate::analysis::{Summary, recorded};
use crate::case::{Case, CaseError};
use crate::record::NoRecorder;
use crate::simulation::ensemble::{Beside, Seat, side_by_side};
use crate::simulation::{Progress, RunFailure, RunReport};
use crate::workers::on_threads_by;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Integrates one case for a sweep: into nothing, or into a file of its own. The seat is that of the run in an ensemble, if it has one;
/// an integration may ignore it.
pub type Integrate<'a> = dyn Fn(
        u64,
        &Case,
        Option<&Arc<Seat>>,
        &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Integrated, IntegrateError>
    + Sync
    + 'a;

/// What a run of a sweep came to.
#[derive(Debug)]
pub struct Integrated {
    /// As it ended.
    pub report: RunReport,
    /// Its quantities; `None` of a run that was stopped.
    pub values: Option<Values>,
}

impl Integrated {
    /// Of a run that comes to `summary`.
    pub(super) fn new(report: RunReport, summary: &Summary) -> Integrated {
        let values = (!report.interrupted).then(|| values(summary));
        Integrated { report, values }
    }
}

/// Why a case of a sweep has no report.
#[derive(Debug, thiserror::Error)]
pub enum IntegrateError {
    /// The run failed: the point is recorded as failed, and the sweep goes on.
    #[error(transparent)]
    Run(Box<RunFailure>),
    /// What it was to be written to failed: the sweep ends.
    #[error("{0}")]
    Storage(String),
}

/// Integrates a case and keeps its events alone.
///
/// # Errors
/// Those of [`Run::start`](crate::Run::start).
pub fn without_a_file(
    _number: u64,
    case: &Case,
    seat: Option<&Arc<Seat>>,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Integrated, IntegrateError> {
    let run = recorded(case, &mut NoRecorder, false, None, seat, control);
    match run.failure {
        Some(failure) => Err(IntegrateError::Run(failure)),
        None => Ok(Integrated::new(run.report, &run.summary)),
    }
}

/// Why a pool stopped before the points were done.
#[derive(Debug)]
pub enum Stopped<E> {
    /// The flag was set.
    Interrupted,
    /// The receiver of the outcomes failed.
    Delivery(E),
    /// The storage of a run failed.
    Storage(String),
}

/// Outcomes that may wait for the one who writes them.
const WAITING: usize = 256;

/// Outcomes are gathered for so long, so that what a group costs is shared by many: the disk syncs each.
const GATHERING: Duration = Duration::from_millis(20);

/// Runs `points` on `workers` threads and hands their outcomes, in groups and in the order of completion, to `deliver`.
///
/// What a point comes to depends on the study and its coordinates alone. Each thread runs several side by side, whose Taylor series are
/// computed together, if `points` says by its [`size_hint`](Iterator::size_hint) that there are enough for all threads. Where it does not
/// know how many will come, as what waits for them does not, a thread runs one at a time. Points under way when `stop` is set, or after
/// an error, are abandoned.
///
/// # Errors
/// Why not all points were run.
pub fn run_points<E>(
    study: &Study,
    points: impl Iterator<Item = Point> + Send,
    workers: usize,
    stop: &AtomicBool,
    integrate: &Integrate,
    mut deliver: impl FnMut(Vec<Outcome>) -> Result<(), E>,
) -> Result<(), Stopped<E>> {
    // Runs that write files wait for the disk.
    let seats = match points.size_hint().1 {
        Some(most) if !study.keep.trajectory => most / workers.max(1),
        _ => 1,
    };
    let given_up = AtomicBool::new(false);
    let halted = || stop.load(Ordering::Relaxed) || given_up.load(Ordering::Relaxed);
    let mut error = None;
    let run = |point: Point, beside: Option<Beside<'_>>| match halted() {
        true => None,
        false => run_point_beside(study, &point, integrate, beside, &halted).transpose(),
    };
    let work = |next: &dyn Fn() -> Option<Point>, send: &dyn Fn(Result<Outcome, String>) -> bool| {
        side_by_side(seats, &|beside| {
            while let Some(result) = next().and_then(|point| run(point, beside))
                && send(result)
            {}
        });
    };
    on_threads_by(workers, WAITING, points, work, |receiver| {
        let mut gathered = Instant::now();
        while let Ok(first) = receiver.recv() {
            let mut group = Vec::new();
            let mut next = Some(first);
            while let Some(result) = next.take() {
                match result {
                    Ok(outcome) => group.push(outcome),
                    Err(message) => error = error.take().or(Some(Stopped::Storage(message))),
                }
                // Half of those that may wait leave room for the others meanwhile.
                if group.len() < WAITING / 2 {
                    next = receiver.recv_timeout(GATHERING.saturating_sub(gathered.elapsed())).ok();
                }
            }
            gathered = Instant::now();
            // After an error the channel is emptied, so that no worker waits for ever.
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
        None if stop.load(Ordering::Relaxed) => Err(Stopped::Interrupted),
        None => Ok(()),
    }
}

/// Runs one point; `None` if it was abandoned.
///
/// # Errors
/// The storage of the run failed. A run that fails is an outcome.
pub fn run_point(
    study: &Study,
    point: &Point,
    integrate: &Integrate,
    halted: &dyn Fn() -> bool,
) -> Result<Option<Outcome>, String> {
    run_point_beside(study, point, integrate, None, halted)
}

/// The same beside others, if it is run in an ensemble.
fn run_point_beside(
    study: &Study,
    point: &Point,
    integrate: &Integrate,
    beside: Option<Beside<'_>>,
    halted: &dyn Fn() -> bool,
) -> Result<Option<Outcome>, String> {
    let outcome = |result, events| {
        Ok(Some(Outcome {
            number: point.number,
            result,
            events,
        }))
    };
    let case = match study.case_at(&point.coordinates) {
        Ok(case) => case,
        Err(error) => return outcome(Err(in_words(&error)), Vec::new()),
    };
    // In an ensemble the time that a run takes is that of the others, too.
    let beside = beside.filter(|_| case.solver.max_wall_time.is_none());
    let mut control = |_: Progress| {
        if let Some(beside) = beside {
            beside.wait();
        }
        if halted() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    // A defect in one run must not take the others along.
    let seat = beside.map(|beside| beside.seat);
    let result = catch_unwind(AssertUnwindSafe(|| integrate(point.number, &case, seat, &mut control)));
    if let Some(beside) = beside {
        beside.leave();
    }
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

/// The problems of a point in one line. Where they were found says nothing: the study put them there.
fn in_words(error: &CaseError) -> String {
    let problems = error
        .problems
        .iter()
        .map(|problem| format!("{}: {}", problem.key, problem.message));
    problems.collect::<Vec<_>>().join("; ")
}
