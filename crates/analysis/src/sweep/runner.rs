//! The remaining points of a sweep, and their runs on a pool of threads with one receiver of the outcomes.

use super::executor::{Executor, run_tasks};
use super::journal::{Journal, PointOutcome, event_row, values};
use super::study::{Study, StudyPoint};
use crate::analysis::{Recorded, recorded};
use crate::error::Error;
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use stickslip_case::{Case, CaseError, Setting};
use stickslip_engine::workers::on_threads;
use stickslip_files::ShardPlan;
use stickslip_system::record::NoRecorder;
use stickslip_system::watch::Watch;

/// Integration of one case of a sweep, without a file or into the case's own file. An error of its storage ends the sweep.
pub type Integrate<'a> = dyn Fn(u64, &Case, &dyn Watch) -> Result<Recorded, Error> + Sync + 'a;

/// Integrates a case and keeps only its events.
pub fn without_a_file(_number: u64, case: &Case, watch: &dyn Watch) -> Result<Recorded, Error> {
    Ok(recorded(case, &mut NoRecorder, false, false, watch))
}

const WAITING: usize = 256;

/// Time during which outcomes are grouped to share the cost of a disk sync.
const GATHERING: Duration = Duration::from_millis(20);

/// Runs `points` on `workers` threads and passes their outcomes to `deliver`, in groups and in the order of completion.
///
/// The outcome of a point depends only on the study and the point's coordinates. After a stop or an error, which is
/// returned, current points are abandoned.
pub fn run_points(
    study: &Study,
    points: impl Iterator<Item = StudyPoint> + Send,
    workers: usize,
    watch: &dyn Watch,
    integrate: &Integrate,
    mut deliver: impl FnMut(Vec<PointOutcome>) -> Result<(), Error>,
) -> Result<(), Error> {
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
                    Err(failure) => error = error.take().or(Some(failure)),
                }
                // The other half of the capacity stays free for new outcomes.
                if group.len() < WAITING / 2 {
                    next = receiver.recv_timeout(GATHERING.saturating_sub(gathered.elapsed())).ok();
                }
            }
            gathered = Instant::now();
            // After an error the channel is emptied, so that no worker blocks.
            if error.is_none() {
                error = deliver(group).err();
            }
            if error.is_some() {
                given_up.store(true, Ordering::Relaxed);
            }
        }
    });
    match error {
        Some(error) => Err(error),
        None if watch.stopped() => Err(Error::interrupted()),
        None => Ok(()),
    }
}

/// Runs one point; `None` if abandoned. Only its storage can fail. A failed run is an outcome.
pub fn run_point(
    study: &Study,
    point: &StudyPoint,
    integrate: &Integrate,
    watch: &dyn Watch,
) -> Result<Option<PointOutcome>, Error> {
    let number = point.number;
    let mut events = Vec::new();
    let result = match study.case_at(&point.coordinates) {
        Err(error) => Err(in_words(&error)),
        Ok(case) => {
            let run = || integrate(number, &case, watch).map(|run| (values(&run.summary), run));
            // A defect in one run must not stop the other runs.
            match catch_unwind(AssertUnwindSafe(run)) {
                Err(_) => Err("internal error: the run panicked".to_owned()),
                Ok(run) => {
                    let (values, run) = run?;
                    if run.failure.is_none() && run.report.interrupted {
                        return Ok(None);
                    }
                    if study.keep.events && run.failure.is_none() {
                        events = run.report.events.iter().map(event_row).collect();
                    }
                    run.failure.map_or(Ok(values), |failure| Err(failure.to_string()))
                }
            }
        }
    };
    Ok(Some(PointOutcome { number, result, events }))
}

/// Problems of a point in one line, without their places, which are places in the study.
fn in_words(error: &CaseError) -> String {
    let problems = error.problems.iter();
    let problems = problems.map(|problem| format!("{}: {}", problem.key, problem.message));
    problems.collect::<Vec<_>>().join("; ")
}

pub(super) struct Running<'a> {
    pub study: &'a Study,
    pub workers: usize,
    pub watch: &'a dyn Watch,
    pub integrate: &'a Integrate<'a>,
    pub executor: Option<&'a mut dyn Executor>,
    pub journal: Journal,
    /// Points of a traced boundary. The study itself has all other points.
    pub asked: Vec<Vec<Setting>>,
    pub failed: u64,
}

impl Running<'_> {
    pub fn count(&self) -> u64 {
        self.study.point_count().unwrap_or(self.asked.len() as u64)
    }

    pub fn coordinates(&self, number: u64) -> Vec<Setting> {
        match self.study.point(number) {
            Some(point) => point.coordinates,
            None => self.asked[number as usize].clone(),
        }
    }

    /// Runs the points of the study, or of a shard, that are not in the journal.
    pub fn run_all(&mut self, part: Option<&ShardPlan>) -> Result<(), Error> {
        let (study, count) = (self.study, self.count());
        // Determined before the writer of outcomes borrows the journal.
        let held: HashSet<u64> = self.journal.numbers().collect();
        let total = part.map_or(count, |part| part.points() as u64);
        let points = (0..count)
            .filter(|&number| part.is_none_or(|part| part.holds(number)) && !held.contains(&number))
            .filter_map(|number| study.point(number));
        self.run(points, total, "")
    }

    /// Runs a round of points of a boundary, and returns all their outcomes in order.
    pub fn round(&mut self, coordinates: Vec<Vec<Setting>>) -> Result<Vec<PointOutcome>, Error> {
        let start = self.asked.len() as u64;
        self.asked.extend_from_slice(&coordinates);
        let numbers = start..self.asked.len() as u64;
        let points = numbers.clone().zip(coordinates);
        let points = points.map(|(number, coordinates)| StudyPoint { number, coordinates });
        let missing: Vec<StudyPoint> = points.filter(|point| !self.journal.holds(point.number)).collect();
        self.run(missing.into_iter(), numbers.end, " or more")?;
        numbers
            .map(|number| self.journal.read(number)?.ok_or_else(Error::interrupted))
            .collect()
    }

    fn run(&mut self, points: impl Iterator<Item = StudyPoint> + Send, total: u64, more: &str) -> Result<(), Error> {
        let Running {
            study,
            workers,
            watch,
            journal,
            failed,
            ..
        } = self;
        let show = |done: u64, failed: u64| {
            let failures = Some(failed).filter(|failed| *failed > 0);
            let failures = failures.map_or_else(String::new, |failed| format!(", {failed} failed"));
            let what = format_args!("{total}{more} points{failures}");
            let _ = watch.at(done as f64, total as f64, what);
        };
        show(journal.points(), *failed);
        let deliver = |group: Vec<PointOutcome>| {
            journal.append(&group)?;
            *failed += group.iter().filter(|outcome| outcome.result.is_err()).count() as u64;
            show(journal.points(), *failed);
            Ok(())
        };
        match &mut self.executor {
            Some(executor) => {
                let ended = run_tasks(study, points, &mut **executor, *watch, deliver);
                ended.inspect_err(|_| executor.cancel())
            }
            None => run_points(study, points, *workers, *watch, self.integrate, deliver),
        }
    }
}
