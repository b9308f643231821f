//! From a study to its file: what is left to run is run, and the journal becomes the sweep file.

use super::boundary::{Boundaries, trace};
use super::crew::{Crew, Delivery, Threads, Work};
use super::earlier::{already_there, gather, ranks_left};
use super::journal::{Existing, Journal, JournalError, journal_path};
use super::quantities::{NO_COUNT, Outcome, QUANTITIES, quantity_index};
use super::runner::{Integrate, Stopped};
use super::shard::{Part, Shard};
use super::study::{Design, Point, Study};
use crate::case::Setting;
use crate::results::{
    Overwrite, ResultError, ShardPlan, Status, SweepAxis, SweepHeader, SweepLayout, SweepPlan, SweepRow, SweepVariable,
    SweepWriter, check_target,
};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// How a sweep is run.
pub struct SweepOptions<'a> {
    /// The sweep file.
    pub path: &'a Path,
    pub overwrite: Overwrite,
    /// Go on with what an interrupted sweep of the same study has left.
    pub resume: bool,
    /// Only this part of the points, into the file of a shard.
    pub shard: Option<Shard>,
    /// Threads.
    pub workers: usize,
    pub header: SweepHeader,
    pub integrate: &'a Integrate<'a>,
    /// Set from outside to end the sweep in good order.
    pub stop: &'a AtomicBool,
}

/// How far a sweep is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SweepProgress {
    /// Points that are done, with those of an earlier start.
    pub done: u64,
    /// Points of the study, or as many as are known of so far.
    pub total: u64,
    /// Whether there may be more than [`Self::total`].
    pub open: bool,
    pub failed: u64,
}

/// What a sweep came to.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepReport {
    /// The sweep file, or the partial file of an interrupted sweep.
    pub file: PathBuf,
    pub interrupted: bool,
    /// Points in the file that are done.
    pub points: u64,
    /// Points that were run now, not before.
    pub run_now: u64,
    /// Points that failed, by number, and why; the first of them only, if there are many.
    pub failures: Vec<(u64, String)>,
    pub failed: u64,
    /// Points whose runs end before a stick that lasts, so that their sticks may not be all; not counted again for a
    /// sweep that had been complete before.
    pub unfinished: Option<u64>,
    /// Of a study of a boundary.
    pub boundaries: Option<Boundaries>,
}

/// Why a sweep ended without its file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    File(#[from] ResultError),
    #[error("{0}")]
    Storage(String),
    #[error(
        "{path}: is the file of another study, or of this one before it was changed, so there is nothing to resume; choose another name with -o, or start anew without --resume"
    )]
    OtherStudy { path: PathBuf },
    #[error(
        "{path}: holds another shard ({found}, not {expected}), so there is nothing to resume; choose another name with -o, or start anew without --resume"
    )]
    OtherShard {
        path: PathBuf,
        found: String,
        expected: Shard,
    },
    #[error("the study has {points} points, too few for {count} shards; use at most {points}")]
    TooManyShards { points: u64, count: usize },
    #[error(
        "the study traces a boundary: which points it needs depends on what the others come to, so it cannot be split into shards; sweep it as one job on many threads (-j), on many machines under MPI, or as one study for each value of its other axes"
    )]
    BoundaryInShards,
    #[error("{} no longer answers; what was computed is in the journals, and --resume goes on from there", ranks(.silent))]
    Lost { silent: Vec<usize> },
}

fn ranks(silent: &[usize]) -> String {
    let numbers: Vec<String> = silent.iter().map(usize::to_string).collect();
    match &numbers[..] {
        [one] => format!("rank {one}"),
        _ => format!("each of the ranks {}", numbers.join(", ")),
    }
}

impl From<Stopped<JournalError>> for SweepEnd {
    fn from(stopped: Stopped<JournalError>) -> Self {
        match stopped {
            Stopped::Interrupted => SweepEnd::Interrupted,
            Stopped::Delivery(error) => SweepEnd::Error(error.into()),
            Stopped::Storage(message) => SweepEnd::Error(SweepError::Storage(message)),
        }
    }
}

/// Why the points were not all run.
pub(super) enum SweepEnd {
    Interrupted,
    Error(SweepError),
}

impl From<JournalError> for SweepEnd {
    fn from(error: JournalError) -> Self {
        SweepEnd::Error(error.into())
    }
}

/// This many failures are named in a report.
pub(super) const NAMED_FAILURES: usize = 5;

/// Runs a study into its file.
///
/// Every outcome goes to the journal beside the file first; the file is made from it when all points are done, or when
/// the sweep is interrupted, and the journal goes when the file is whole. The same study gives the same bytes, however
/// many threads ran it and however often it was interrupted, on one machine and with one version of the program.
///
/// # Errors
/// A file or a journal that is not to be touched, and failures of the disk. Runs that fail are part of the result.
pub fn sweep(
    study: &Study,
    options: &SweepOptions,
    progress: &mut dyn FnMut(SweepProgress),
) -> Result<SweepReport, SweepError> {
    sweep_with(study, options, &mut Threads, progress)
}

/// The same with the points run by `crew`.
///
/// # Errors
/// Those of [`sweep`], and members of the crew that were lost.
pub fn sweep_with(
    study: &Study,
    options: &SweepOptions,
    crew: &mut dyn Crew,
    progress: &mut dyn FnMut(SweepProgress),
) -> Result<SweepReport, SweepError> {
    let path = options.path;
    let digest = study.digest();
    let part = options.shard.map(|shard| Part::of(study, shard)).transpose()?;
    check_target(path, options.overwrite, &study.files)?;
    let journal_file = journal_path(path);
    if journal_file == path {
        let what = "the outcomes of its points";
        return Err(ResultError::Reserved {
            path: path.to_owned(),
            what,
        }
        .into());
    }
    if study.files.contains(&journal_file) {
        return Err(ResultError::IsInput { path: journal_file }.into());
    }
    let nothing_left = || Ok::<_, SweepError>(!journal_file.exists() && ranks_left(path)?.is_empty());
    if options.resume && path.exists() && nothing_left()? {
        return already_there(path, &digest, options.shard);
    }
    let existing = match (options.resume, options.overwrite) {
        (true, _) => Existing::Resume,
        (false, Overwrite::Force) => Existing::Discard,
        (false, _) => Existing::Refuse,
    };
    let mut journal = Journal::open(&journal_file, &digest, existing)?;
    gather(&mut journal, path, &digest, existing)?;
    let before = journal.points();
    crew.begin();
    let mut state = Running {
        study,
        options,
        journal,
        crew,
        progress,
        failed: 0,
        stored: 0,
        outcomes: HashMap::new(),
    };
    let mut points = Points::of(study);
    let mut boundaries = None;
    let ended = match &study.design {
        Design::Boundary(spec) => trace(spec, &mut state, &mut points).map(|found| boundaries = Some(found)),
        _ => state.run_numbers(study.point_count().unwrap_or(0), part.as_ref()),
    };
    let silent = state.crew.dismiss();
    let interrupted = match ended {
        Ok(()) => false,
        Err(SweepEnd::Interrupted) => true,
        Err(SweepEnd::Error(error)) => return Err(error),
    };
    let Running { mut journal, .. } = state;
    if !silent.is_empty() {
        return Err(SweepError::Lost { silent });
    }
    gather(&mut journal, path, &digest, Existing::Resume)?;
    let run_now = journal.points() - before;
    let written = write(
        study,
        options,
        &mut journal,
        &points,
        part.as_ref(),
        boundaries.as_ref(),
        interrupted,
    )?;
    let Written {
        file,
        done,
        failed,
        failures,
        unfinished,
    } = written;
    if !interrupted {
        journal.remove()?;
    }
    Ok(SweepReport {
        file,
        interrupted,
        points: done,
        run_now,
        failures,
        failed,
        unfinished: Some(unfinished),
        boundaries,
    })
}

/// The points of a study by their numbers.
pub(super) enum Points<'a> {
    /// As the study has them.
    Given(&'a Study),
    /// As they were asked for.
    Asked(Vec<Vec<Setting>>),
}

impl<'a> Points<'a> {
    fn of(study: &'a Study) -> Self {
        match study.design {
            Design::Boundary(_) => Points::Asked(Vec::new()),
            _ => Points::Given(study),
        }
    }

    fn count(&self) -> u64 {
        match self {
            Points::Given(study) => study.point_count().unwrap_or(0),
            Points::Asked(points) => points.len() as u64,
        }
    }

    fn coordinates(&self, number: u64) -> Vec<Setting> {
        match self {
            Points::Given(study) => study.point(number).map_or_else(Vec::new, |point| point.coordinates),
            Points::Asked(points) => points[number as usize].clone(),
        }
    }
}

/// A sweep under way.
pub(super) struct Running<'a> {
    pub(super) study: &'a Study,
    options: &'a SweepOptions<'a>,
    journal: Journal,
    crew: &'a mut dyn Crew,
    progress: &'a mut dyn FnMut(SweepProgress),
    failed: u64,
    /// Points that others have stored, and what they came to where a boundary is traced.
    stored: u64,
    outcomes: HashMap<u64, Outcome>,
}

impl Running<'_> {
    /// Runs the points below `count`, of a shard if there is one, that the journal does not hold.
    fn run_numbers(&mut self, count: u64, part: Option<&Part>) -> Result<(), SweepEnd> {
        let study = self.study;
        // Asked before the journal is lent to the writer of outcomes; a bit for each point.
        let wanted = |number: u64| part.is_none_or(|part| part.holds(number));
        let left: Vec<bool> = (0..count)
            .map(|number| wanted(number) && !self.journal.holds(number))
            .collect();
        let total = part.map_or(count, |part| part.partition.size(part.shard) as u64);
        let points = (0..count)
            .filter(|&number| left[number as usize])
            .filter_map(|number| study.point(number));
        self.run(points, total, false)
    }

    /// Runs a round of points that come after the first `start`, and returns the outcomes of all of them in their order.
    pub(super) fn round(&mut self, start: u64, coordinates: &[Vec<Setting>]) -> Result<Vec<Outcome>, SweepEnd> {
        let numbered = |k: usize| start + k as u64;
        let held: Vec<bool> = (0..coordinates.len())
            .map(|k| self.journal.holds(numbered(k)))
            .collect();
        let points = coordinates
            .iter()
            .enumerate()
            .filter(|(k, _)| !held[*k])
            .map(|(k, coordinates)| Point {
                number: numbered(k),
                coordinates: coordinates.clone(),
            });
        self.run(points, start + coordinates.len() as u64, true)?;
        let mut outcomes = Vec::with_capacity(coordinates.len());
        for k in 0..coordinates.len() {
            let outcome = match self.outcomes.remove(&numbered(k)) {
                Some(outcome) => Some(outcome),
                None => self.journal.read(numbered(k))?,
            };
            outcomes.push(outcome.ok_or(SweepEnd::Interrupted)?);
        }
        Ok(outcomes)
    }

    fn run(&mut self, mut points: impl Iterator<Item = Point> + Send, total: u64, open: bool) -> Result<(), SweepEnd> {
        let Running {
            study,
            options,
            journal,
            crew,
            progress,
            failed,
            stored,
            outcomes,
        } = self;
        let mut show = |done: u64, failed: u64| {
            progress(SweepProgress {
                done,
                total,
                open,
                failed,
            });
        };
        show(journal.points() + *stored, *failed);
        let work = Work {
            study,
            workers: options.workers,
            integrate: options.integrate,
            stop: options.stop,
        };
        let mut deliver = |delivery: Delivery| {
            let (Delivery::Unstored(group) | Delivery::Stored(group)) = &delivery;
            let failures = group.iter().filter(|outcome| outcome.result.is_err()).count() as u64;
            match delivery {
                Delivery::Unstored(group) => journal.append(&group)?,
                Delivery::Stored(group) => {
                    *stored += group.len() as u64;
                    if open {
                        outcomes.extend(group.into_iter().map(|outcome| (outcome.number, outcome)));
                    }
                }
            }
            *failed += failures;
            show(journal.points() + *stored, *failed);
            Ok(())
        };
        crew.run(&work, &mut points, &mut deliver).map_err(SweepEnd::from)
    }
}

/// A sweep file, how many of its points are done and how many of them failed, and the first of those.
struct Written {
    file: PathBuf,
    done: u64,
    failed: u64,
    failures: Vec<(u64, String)>,
    unfinished: u64,
}

/// Makes the sweep file from the journal, in the order of the points.
fn write(
    study: &Study,
    options: &SweepOptions,
    journal: &mut Journal,
    points: &Points,
    part: Option<&Part>,
    boundaries: Option<&Boundaries>,
    interrupted: bool,
) -> Result<Written, SweepError> {
    let count = points.count();
    let layout = match study.design {
        Design::Grid => SweepLayout::Grid,
        _ => SweepLayout::Table,
    };
    let words: Vec<Vec<String>> = (0..study.axes.len())
        .map(|axis| words_of(study, points, axis))
        .collect();
    let code = |axis: usize, value: &Setting| match value.as_number() {
        Some(number) if words[axis].is_empty() => number,
        _ => words[axis].iter().position(|word| *word == value.word()).unwrap_or(0) as f64,
    };
    let axes = study.axes.iter().enumerate().map(|(k, axis)| SweepAxis {
        name: axis.name.clone(),
        keys: axis.keys.join(" "),
        units: axis.unit.unwrap_or("1").to_owned(),
        long_name: axis.description.to_owned(),
        words: words[k].clone(),
        values: axis.levels.iter().map(|level| code(k, level)).collect(),
    });
    let whole = layout;
    // The points of a shard are no grid.
    let layout = part.map_or(whole, |_| SweepLayout::Table);
    let plan = SweepPlan {
        layout,
        axes: axes.collect(),
        variables: sweep_variables(),
        points: part.map_or(count as usize, |part| part.partition.size(part.shard)),
        keep_events: study.keep.events,
        shard: part.map(|part| ShardPlan {
            shard: part.shard,
            partition: part.partition.clone(),
            layout: whole,
            shape: part.shape.clone(),
        }),
    };
    let mut writer = SweepWriter::create(options.path, options.overwrite, &study.files, &options.header, &plan)?;
    let (mut done, mut failed, mut unfinished) = (0, 0, 0);
    let mut failures = Vec::new();
    let final_stick = quantity_index("final_stick_time");
    for number in (0..count).filter(|&number| part.is_none_or(|part| part.holds(number))) {
        let coordinates = match layout {
            SweepLayout::Grid => Vec::new(),
            SweepLayout::Table => {
                let values = points.coordinates(number);
                values
                    .iter()
                    .enumerate()
                    .map(|(axis, value)| code(axis, value))
                    .collect()
            }
        };
        let mut row = SweepRow {
            number,
            coordinates,
            ..SweepRow::default()
        };
        if let Some(outcome) = journal.read(number)? {
            done += 1;
            row.events = outcome
                .events
                .iter()
                .map(|e| {
                    (
                        e.time,
                        e.kind.code(),
                        e.mode_after,
                        e.relative_velocity,
                        e.internal_force,
                    )
                })
                .collect();
            match outcome.result {
                Ok(values) => {
                    unfinished += u64::from(final_stick.is_some_and(|k| values[k].is_nan()));
                    row.values = Some(values.to_vec());
                }
                Err(message) => {
                    failed += 1;
                    if failures.len() < NAMED_FAILURES {
                        failures.push((number, message.clone()));
                    }
                    row.failure = Some(message);
                }
            }
        }
        writer.push(row)?;
    }
    if let Some(boundaries) = boundaries {
        boundaries.write(study, &mut writer)?;
    }
    let status = if interrupted {
        Status::Interrupted
    } else {
        Status::Complete
    };
    Ok(Written {
        file: writer.finish(&status)?,
        done,
        failed,
        failures,
        unfinished,
    })
}

/// The variables of a sweep file: one for each of [`QUANTITIES`].
pub(crate) fn sweep_variables() -> Vec<SweepVariable> {
    let variables = QUANTITIES.iter().map(|quantity| SweepVariable {
        name: quantity.name.to_owned(),
        units: quantity.unit.to_owned(),
        long_name: quantity.description.to_owned(),
        count_fill: quantity.count.then_some(NO_COUNT),
    });
    variables.collect()
}

/// The words on an axis, each once, in the order of their first point; none where all values are numbers.
fn words_of(study: &Study, points: &Points, axis: usize) -> Vec<String> {
    let levels = &study.axes[axis].levels;
    if study.axes[axis].range.is_some() {
        return Vec::new();
    }
    let values: Vec<Setting> = if levels.is_empty() {
        (0..points.count())
            .map(|number| points.coordinates(number)[axis].clone())
            .collect()
    } else {
        levels.clone()
    };
    if values.iter().all(|value| value.as_number().is_some()) {
        return Vec::new();
    }
    let mut words: Vec<String> = Vec::new();
    for value in values {
        let word = value.word();
        if !words.contains(&word) {
            words.push(word);
        }
    }
    words
}
