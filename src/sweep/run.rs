//! From a study to its file: what is left to run is run, and the journal becomes the sweep file.

use super::boundary::trace;
use super::earlier::{already_there, gather, ranks_left};
use super::error::{SweepEnd, SweepError};
use super::file::{Written, write};
use super::journal::{Existing, Journal, journal_path};
use super::report::{SweepOptions, SweepProgress, SweepReport};
use super::running::{Points, Running};
use super::shard::Part;
use super::study::{Design, Study};
use super::worker_pool::{Threads, WorkerPool};
use crate::results::{Overwrite, ResultError, check_target};
use std::collections::HashMap;

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

/// The same with the points run by `worker_pool`.
///
/// # Errors
/// Those of [`sweep`], and workers that were lost.
pub fn sweep_with(
    study: &Study,
    options: &SweepOptions,
    worker_pool: &mut dyn WorkerPool,
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
    worker_pool.begin();
    let mut state = Running {
        study,
        options,
        journal,
        worker_pool,
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
    let silent = state.worker_pool.dismiss();
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
