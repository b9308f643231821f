//! Points in other processes, which an executor can start anywhere.
//!
//! A task is a group of points. It carries the study as a text without files, so a worker needs only the program. Its
//! outcomes come back as records of the journal, which stays in this process.

use super::axis::ParameterAxis;
use super::journal::{PointOutcome, outcomes_of};
use super::runner::{run_point, without_a_file};
use super::study::{Design, Study, StudyPoint};
use crate::error::{Error, ErrorKind};
use crate::provenance;
use crate::study::{StudyHead, StudySource};
use serde::{Deserialize, Serialize};
use std::fmt::Display;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use stickslip_case::{CaseError, CaseSource, Origin, Override, Words};
use stickslip_system::watch::Watch;

/// Runs tasks in other processes, such as a `concurrent.futures.Executor` of Python.
pub trait Executor: std::fmt::Debug + Send {
    /// Submits a task: a call of [`evaluate`] with these texts. An error says why the executor takes no tasks.
    fn submit(&mut self, study: &str, points: &str) -> Result<(), String>;

    /// Result of the next finished task, in any order; `None` if none finishes within `wait`. Fails if a worker died.
    fn finished(&mut self, wait: Duration) -> Result<Option<Vec<u8>>, String>;

    /// Drops the tasks that have not begun.
    fn cancel(&mut self);
}

/// Computing time of a task, s: long enough to make its transfer cheap, short enough to share points evenly.
const TASK: f64 = 0.2;
/// A task has at most 1/SHARE of the remaining points, so that many workers end at about the same time.
const SHARE: usize = 64;
/// Largest number of submitted tasks: more than any executor has workers.
const MOST_TASKS: usize = 4096;
/// Largest number of tasks while the time of a point is unknown. After [`PATIENCE`], that time is known to be long.
const FIRST_TASKS: usize = 64;
const PATIENCE: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(50);
const GROUP: usize = 128;

/// Runs `points` by an executor and passes outcomes to `deliver`, in groups and in the order of completion. After an
/// error, submitted tasks are left.
pub(super) fn run_tasks(
    study: &Study,
    mut points: impl Iterator<Item = StudyPoint>,
    executor: &mut dyn Executor,
    watch: &dyn Watch,
    mut deliver: impl FnMut(Vec<PointOutcome>) -> Result<(), Error>,
) -> Result<(), Error> {
    let study = text(&Portable::of(study))?;
    let started = Instant::now();
    let (mut tasks, mut done, mut seconds) = (0, 0, 0.0);
    loop {
        let most = match done == 0 && started.elapsed() < PATIENCE {
            true => FIRST_TASKS,
            false => MOST_TASKS,
        };
        let mut failure = None;
        while tasks < most && !watch.stopped() {
            // A single point while the time of a point is unknown.
            let within_time = (TASK * done as f64 / seconds) as usize;
            let left = points.size_hint().1.unwrap_or(0);
            let size = within_time.min(left / SHARE).max(1);
            let task: Vec<StudyPoint> = points.by_ref().take(size).collect();
            if task.is_empty() {
                break;
            }
            if let Err(message) = executor.submit(&study, &text(&task)?) {
                failure = Some(message);
                break;
            }
            tasks += 1;
        }
        if watch.stopped() {
            return Err(Error::interrupted());
        }
        if tasks == 0 && failure.is_none() {
            return Ok(());
        }
        let mut group = Vec::new();
        let mut wait = if failure.is_none() { PAUSE } else { Duration::ZERO };
        // After a failure, all available results are collected.
        for _ in 0..if failure.is_none() { GROUP } else { MOST_TASKS } {
            let result = match executor.finished(wait) {
                Ok(Some(result)) => opened(&result).ok_or("a worker returned something that is no result".to_owned()),
                Ok(None) => break,
                Err(message) => Err(message),
            };
            match result {
                Ok((time, outcomes)) => {
                    seconds += time;
                    group.extend(outcomes);
                }
                Err(message) => {
                    failure = failure.or(Some(message));
                    break;
                }
            }
            tasks -= 1;
            wait = Duration::ZERO;
        }
        done += group.len();
        if !group.is_empty() {
            deliver(group)?;
        }
        if let Some(message) = failure {
            return Err(failed(message));
        }
    }
}

/// Runs a task on this thread; `None` if stopped. Refuses tasks of another build, whose last digits may differ.
pub fn evaluate(study: &str, points: &str, watch: &dyn Watch) -> Result<Option<Vec<u8>>, String> {
    let wrong = |error: serde_json::Error| format!("this is no task of a sweep: {error}");
    let study: Portable = serde_json::from_str(study).map_err(wrong)?;
    let points: Vec<StudyPoint> = serde_json::from_str(points).map_err(wrong)?;
    if study.build != build() {
        return Err("a worker has another build of stickslip than the sweep; install the same one for both".to_owned());
    }
    let study = study.study().map_err(|error| error.to_string())?;
    let started = Instant::now();
    let mut records = Vec::new();
    for point in &points {
        let outcome = run_point(&study, point, &without_a_file, watch).map_err(|error| error.to_string())?;
        let Some(outcome) = outcome else { return Ok(None) };
        outcome.encode(&mut records);
    }
    let seconds = started.elapsed().as_secs_f64().to_le_bytes();
    Ok(Some([&seconds, &records[..]].concat()))
}

/// Computing time (s) and outcomes of a task; `None` if `result` is not from [`evaluate`].
fn opened(result: &[u8]) -> Option<(f64, Vec<PointOutcome>)> {
    let (seconds, records) = result.split_first_chunk()?;
    Some((f64::from_le_bytes(*seconds), outcomes_of(records)?))
}

/// Study data that determine the outcomes, without input files.
#[derive(Serialize, Deserialize)]
struct Portable {
    build: String,
    case: String,
    /// Whether the case is from a result file, where missing keys have other defaults.
    of_a_result: bool,
    /// Settings in the form of `--set`.
    settings: Vec<String>,
    axes: Vec<Vec<String>>,
    keep_events: bool,
    gives_tolerance: bool,
}

fn build() -> String {
    format!("{:?}", provenance::build())
}

impl Portable {
    fn of(study: &Study) -> Self {
        Portable {
            build: build(),
            case: study.head.base.text.clone(),
            of_a_result: matches!(study.head.base.origin, Origin::Result(_)),
            settings: study.head.settings.iter().map(|setting| setting.argument()).collect(),
            axes: study.axes.iter().map(|axis| axis.keys.clone()).collect(),
            keep_events: study.keep.events,
            gives_tolerance: study.gives_tolerance,
        }
    }

    fn study(self) -> Result<Study, CaseError> {
        let base = match self.of_a_result {
            true => CaseSource::result(&PathBuf::new(), self.case),
            false => CaseSource::text(&self.case),
        };
        let settings = self.settings.iter().map(|setting| Override::parse(setting));
        let settings = settings.collect::<Result<Vec<_>, _>>()?;
        let head = StudyHead {
            is_readable: true,
            title: String::new(),
            source: StudySource::text("", ""),
            words: Words::of(&base, &settings),
            base,
            settings,
            changed: Vec::new(),
            files: Vec::new(),
        };
        let axes = self.axes.into_iter().map(|keys| ParameterAxis {
            keys,
            ..ParameterAxis::default()
        });
        let mut study = Study::new(head, axes.collect(), Design::Rows(Vec::new()));
        (study.keep.events, study.gives_tolerance) = (self.keep_events, self.gives_tolerance);
        Ok(study)
    }
}

/// JSON text, which keeps every double exactly.
fn text(value: &impl Serialize) -> Result<String, Error> {
    serde_json::to_string(value).map_err(failed)
}

fn failed(message: impl Display) -> Error {
    Error::new(ErrorKind::Executor, format!("the executor failed: {message}"))
}
