//! The file of a whole study from those of its shards: the bytes that one machine would have written, or an HDF5 file
//! whose datasets refer to the shards.

use std::path::{Path, PathBuf};

use super::partition::{Patch, Stride};
use super::schema::{SweepHeader, SweepPlan};
use super::shard::ShardFile;
use super::storage::{Shards, Source, relative_path};
use super::writer::SweepWriter;
use crate::results::check::check_sound;
use crate::results::disk::same_file;
use crate::results::{Overwrite, Reason, Reservation, ResultError, Status, partial_path};

/// What is merged into what.
#[derive(Debug, Clone, Copy)]
pub struct MergeOptions<'a> {
    /// The files of all shards of one study, in any order.
    pub shards: &'a [PathBuf],
    /// The file to be made.
    pub output: &'a Path,
    /// Replace a file that is there; without it none is, not even a result of this program.
    pub replace: bool,
    /// Leave the points in the shards.
    pub by_reference: bool,
}

/// What a merger came to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MergeReport {
    /// The file that was made.
    pub file: PathBuf,
    /// Of the study.
    pub digest: String,
    /// Number of shards.
    pub shards: usize,
    /// Number of points in them.
    pub points: usize,
    /// Number of points whose run failed.
    pub failed: usize,
}

/// Why shards do not make a whole.
#[derive(Debug, thiserror::Error)]
pub enum MergeError {
    /// One of the files cannot be read, or that of the whole not be written.
    #[error(transparent)]
    File(#[from] ResultError),
    /// The shards do not belong together, or some are missing.
    #[error("{0}")]
    Shards(String),
}

const NOT_UNICODE: &str = "its name is not Unicode, and a virtual dataset can only refer to files whose names are; rename it, or merge \
                           without --virtual";

/// Puts the shards of a study together.
///
/// Without `by_reference` the file has the very bytes that a sweep of the whole study would have written. With it, the
/// variables of the points and of the events are virtual datasets over those of the shards, found relative to the file;
/// events stand there shard by shard, and failures are copied.
///
/// # Errors
/// Shards that do not make one whole: of different studies, builds or divisions, missing, twice, or incomplete; an output
/// that exists; and failures to read and to write.
pub fn merge(options: &MergeOptions) -> Result<MergeReport, MergeError> {
    let output = options.output;
    if options.shards.iter().any(|shard| same_file(shard, output)) {
        return Err(Reason::IsInput.of(output).into());
    }
    if !options.replace && std::fs::symlink_metadata(output).is_ok() && !output.is_dir() {
        let output = output.display();
        return Err(MergeError::Shards(format!(
            "{output}: exists; choose another name with -o, or replace it with --force"
        )));
    }
    let shards = open_all(options)?;
    let plan = shards[0].plan()?;
    let header = shards[0].header()?;
    // After all that names what is wrong with the study as such.
    shards.iter().try_for_each(|shard| check_sound(shard.path()))?;
    let overwrite = if options.replace {
        Overwrite::Force
    } else {
        Overwrite::OwnResults
    };
    let place = Reservation::take(output, overwrite, options.shards)?;
    let write = if options.by_reference { refer } else { copy };
    let (file, failed) = write(place, &shards, &plan, &header)?;
    Ok(MergeReport {
        file,
        digest: header.digest,
        shards: shards.len(),
        points: plan.points,
        failed,
    })
}

/// Opens the shards and puts them in order; they make a whole.
fn open_all(options: &MergeOptions) -> Result<Vec<ShardFile>, MergeError> {
    let wrong = |what: String| Err(MergeError::Shards(what));
    let mut shards: Vec<ShardFile> = Vec::with_capacity(options.shards.len());
    for path in options.shards {
        let partial = partial_path(path);
        if !path.exists() && partial.exists() {
            let (path, partial) = (path.display(), partial.display());
            return wrong(format!(
                "{path}: not there yet, but {partial} is: this shard was interrupted; sweep it again with --resume"
            ));
        }
        shards.push(ShardFile::open(path)?);
    }
    let Some(first) = shards.first() else {
        return wrong(without(&[1], 1));
    };
    let header = first.header()?;
    let count = first.partition().shards();
    for second in &shards[1..] {
        let both = format!("{} and {}", first.path().display(), second.path().display());
        let theirs = second.header()?;
        if theirs.digest != header.digest {
            let short = |digest: &str| digest.chars().take(8).collect::<String>();
            return wrong(format!(
                "{both} are shards of different studies, or of one study before and after it was changed (digests {} and {}); merge \
                 the shards of one study",
                short(&header.digest),
                short(&theirs.digest)
            ));
        }
        if first.partition() != second.partition() {
            return wrong(format!(
                "{} is one of {count} shards and {} one of {}; merge shards of one division of the study",
                first.path().display(),
                second.path().display(),
                second.partition().shards()
            ));
        }
        if let Some((what, [one, other])) = difference(&header, &theirs) {
            return wrong(format!(
                "{both} were written by different builds of the program ({what}: {one} and {other}), whose numbers may differ; sweep \
                 all shards with one build"
            ));
        }
    }
    shards.sort_by_key(ShardFile::shard);
    for pair in shards.windows(2) {
        if pair[0].shard() == pair[1].shard() {
            let [first, second] = [&pair[0], &pair[1]].map(|shard| shard.path().display());
            let shard = pair[0].shard() + 1;
            return wrong(format!(
                "{first} and {second} are both shard {shard} of {count}; give every shard once"
            ));
        }
    }
    let missing: Vec<usize> = (0..count)
        .filter(|&shard| shards.binary_search_by_key(&shard, ShardFile::shard).is_err())
        .map(|shard| shard + 1)
        .collect();
    if !missing.is_empty() {
        return wrong(without(&missing, count));
    }
    for shard in &shards {
        let (done, points) = (shard.done()?, shard.partition().size(shard.shard()));
        if done < points {
            let (path, shard) = (shard.path().display(), shard.shard() + 1);
            return wrong(format!(
                "{path}: shard {shard} of {count} is incomplete: {done} of its {points} points are done; sweep it again with --resume"
            ));
        }
    }
    Ok(shards)
}

/// Says which shards are missing.
fn without(missing: &[usize], count: usize) -> String {
    let (plural, are, them) = match missing {
        [_] => ("", "is", "it"),
        _ => ("s", "are", "them"),
    };
    let missing = in_words(missing);
    format!(
        "shard{plural} {missing} of {count} {are} missing; sweep {them} with --shard, and give the files of all shards"
    )
}

/// As "2, 5 to 9 and 12".
fn in_words(numbers: &[usize]) -> String {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for &number in numbers {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => runs.push((number, number)),
        }
    }
    let parts: Vec<String> = runs
        .into_iter()
        .map(|(first, last)| match last - first {
            0 => first.to_string(),
            1 => format!("{first}, {last}"),
            _ => format!("{first} to {last}"),
        })
        .collect();
    match &parts[..] {
        [before @ .., last] if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => parts.concat(),
    }
}

/// What two shards of a study say differently about their program, if anything.
fn difference(first: &SweepHeader, second: &SweepHeader) -> Option<(String, [String; 2])> {
    if first.source != second.source {
        return Some(("source".to_owned(), [first.source.clone(), second.source.clone()]));
    }
    let named = |header: &SweepHeader, name: &str| {
        let found = header.meta.iter().find(|(other, _)| other == name);
        found.map_or("none".to_owned(), |(_, value)| value.to_string())
    };
    let mut names = first.meta.iter().chain(&second.meta).map(|(name, _)| name);
    names.find_map(|name| {
        let values = [named(first, name), named(second, name)];
        (values[0] != values[1]).then(|| (name.clone(), values))
    })
}

/// Writes every point. Returns the file, and how many points failed.
fn copy(
    place: Reservation,
    shards: &[ShardFile],
    plan: &SweepPlan,
    header: &SweepHeader,
) -> Result<(PathBuf, usize), MergeError> {
    let rows = shards.iter().map(|shard| shard.rows(plan));
    let mut rows = rows.collect::<Result<Vec<_>, _>>()?;
    let mut writer = SweepWriter::create(place, header, plan)?;
    let mut failed = 0;
    for number in 0..plan.points {
        let row = rows[shards[0].partition().owner(number)].next(number as u64)?;
        failed += usize::from(row.failure.is_some());
        writer.push(row)?;
    }
    Ok((writer.finish(&Status::Complete)?, failed))
}

/// Writes where the points are. Returns the file, and how many points failed.
fn refer(
    place: Reservation,
    shards: &[ShardFile],
    plan: &SweepPlan,
    header: &SweepHeader,
) -> Result<(PathBuf, usize), MergeError> {
    let (mut points, mut events) = (Vec::new(), Vec::new());
    let (mut before, mut failures) = (0, Vec::new());
    for shard in shards {
        let path = relative_path(&place.path, shard.path());
        let not_unicode = || MergeError::Shards(format!("{}: {NOT_UNICODE}", path.display()));
        let path = path.to_str().ok_or_else(not_unicode)?.to_owned();
        points.push(Source {
            path: path.clone(),
            rows: shard.partition().size(shard.shard()),
            patches: shard.partition().patches(shard.shard()),
        });
        let rows = shard.event_count()?;
        let patches = vec![Patch {
            rows: Stride::solid(0, rows),
            cells: vec![Stride::solid(before, rows)],
        }];
        events.push(Source { path, rows, patches });
        before += rows;
        failures.extend(shard.failures()?);
    }
    failures.sort_by_key(|failure| failure.0);
    let mut writer = SweepWriter::create_with(place, header, plan, Some(&Shards { points, events }))?;
    let failed = failures.len();
    for (number, message) in failures {
        writer.push_failure(i64::try_from(number).unwrap_or(i64::MAX), message);
    }
    Ok((writer.finish(&Status::Complete)?, failed))
}
