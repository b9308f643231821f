//! Sweeps and continuations, by the library.

use crate::errors::Raised;
use crate::executor::Tasks;
use crate::waiting::interruptible;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use stickslip::case::builtin::BuiltIn;
use stickslip::case::{CaseError, Override};
use stickslip::continuation::{CONTINUATIONS, Continuation, ContinuationStudy};
use stickslip::results::Overwrite;
use stickslip::sweep::{STUDIES, Study, StudySource, Sweep, journal_path};
use stickslip::{Error, overrides};

/// Finds and parses a study, the name of one of `built_in` or a path, with overrides of its base case.
fn study_of<T>(
    (name, built_in): (&str, &[BuiltIn]),
    settings: &[String],
    parse: fn(StudySource, &[Override]) -> Result<T, CaseError>,
) -> Result<T, Raised> {
    let parsed = overrides(settings).and_then(|changes| parse(StudySource::find(name, built_in)?, &changes));
    parsed.map_err(|error| Error::from(error).into())
}

/// An error of a study. After a failed computation with a journal it says how to go on.
fn failed(error: impl Into<Raised>, path: &Path) -> Raised {
    let Raised(class, text) = error.into();
    let journal = journal_path(path);
    Raised(
        class,
        match class == "RunError" && journal.exists() {
            true => format!(
                "{}. What was computed is in {}; resume=True goes on from there",
                text.trim_end_matches('.'),
                journal.display()
            ),
            false => text,
        },
    )
}

/// Runs the points of a study, the name of a built-in one or a path, into a file. Returns how many points end before their
/// attractor is certain.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the keywords of a function of Python")]
pub fn sweep(
    py: Python<'_>,
    study: &str,
    settings: Vec<String>,
    path: PathBuf,
    replace: bool,
    resume: bool,
    jobs: Option<usize>,
    progress: Option<Py<PyAny>>,
    tasks: Option<Py<PyAny>>,
) -> PyResult<u64> {
    let study = study_of((study, STUDIES), &settings, Study::parse)?;
    let mut tasks = tasks.map(Tasks);
    let report = interruptible(py, progress, |watch| {
        let mut sweep = Sweep::new(&study, &path)
            .overwrite(Overwrite::by_force(replace))
            .resume(resume)
            .watch(&*watch);
        if let Some(jobs) = jobs {
            sweep = sweep.workers(jobs);
        }
        if let Some(tasks) = &mut tasks {
            sweep = sweep.executor(tasks);
        }
        sweep.start().map_err(Error::from)
    })?;
    let report = report.map_err(|error| failed(error, &path))?;
    match report.failures.first() {
        Some((point, message)) if report.failed == report.points => {
            let (points, file) = (report.points, report.file.display());
            let text = format!(
                "all {points} points failed, point {point} with: {message}. The messages are in /failures of {file}"
            );
            Err(Raised("RunError", text).into())
        }
        _ => Ok(report.unfinished.unwrap_or(0)),
    }
}

/// Follows the branches of a study into a file. Returns remarks about them.
#[pyfunction]
pub fn follow(
    py: Python<'_>,
    study: &str,
    settings: Vec<String>,
    path: PathBuf,
    replace: bool,
    resume: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<String>> {
    let study = study_of((study, CONTINUATIONS), &settings, ContinuationStudy::parse)?;
    let (report, stopped) = interruptible(py, progress, |watch| {
        let run = Continuation::new(&study, &path).overwrite(Overwrite::by_force(replace));
        let report = run.resume(resume).watch(&*watch).start().map_err(Error::from);
        (report, watch.stop.load(Ordering::Relaxed))
    })?;
    let explored = report.map_err(|error| failed(error, &path))?.explored;
    if explored.interrupted && !stopped {
        let text = "the time of solver.max_wall_time is over; allow more with overrides={\"solver.max_wall_time\": T}";
        return Err(failed(Raised("RunError", text.to_owned()), &path).into());
    }
    Ok(explored.remarks)
}
