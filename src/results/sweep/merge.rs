//! The file of a whole study from those of its shards: the bytes that one machine would have written, or an HDF5 file
//! whose datasets refer to the shards.

use std::path::{Path, PathBuf};

use super::partition::Partition;
use super::schema::{SweepHeader, SweepPlan};
use super::shard::ShardFile;
use super::storage::{Rows, Shards, Source, Storage, relative_path};
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
#[non_exhaustive]
#[expect(missing_docs, reason = "each variant is described by its message")]
pub enum MergeError {
    #[error(transparent)]
    File(#[from] ResultError),
    #[error("{path}: exists; choose another name with -o, or replace it with --force")]
    Exists { path: PathBuf },
    #[error("{path}: not there yet, but {partial} is: this shard was interrupted; sweep it again with --resume")]
    Interrupted { path: PathBuf, partial: PathBuf },
    #[error(
        "{path}: shard {shard} of {count} is incomplete: {done} of its {points} points are done; sweep it again with --resume"
    )]
    Incomplete {
        path: PathBuf,
        shard: usize,
        count: usize,
        done: usize,
        points: usize,
    },
    #[error(
        "{first} and {second} are shards of different studies, or of one study before and after it was changed (digests {first_digest} and {second_digest}); merge the shards of one study"
    )]
    OtherStudy {
        first: PathBuf,
        second: PathBuf,
        first_digest: String,
        second_digest: String,
    },
    #[error(
        "{first} is one of {first_count} shards and {second} one of {second_count}; merge shards of one division of the study"
    )]
    OtherDivision {
        first: PathBuf,
        second: PathBuf,
        first_count: usize,
        second_count: usize,
    },
    #[error(
        "{first} and {second} were written by different builds of the program ({what}: {first_value} and {second_value}), whose numbers may differ; sweep all shards with one build"
    )]
    OtherBuild {
        first: PathBuf,
        second: PathBuf,
        what: String,
        first_value: String,
        second_value: String,
    },
    #[error("{first} and {second} are both shard {shard} of {count}; give every shard once")]
    Twice {
        first: PathBuf,
        second: PathBuf,
        shard: usize,
        count: usize,
    },
    #[error("shard{} {missing} of {count} {} missing; sweep {} with --shard, and give the files of all shards", plural(.several), if *.several { "are" } else { "is" }, if *.several { "them" } else { "it" })]
    Missing {
        missing: String,
        count: usize,
        several: bool,
    },
    #[error(
        "{path}: its name is not Unicode, and a virtual dataset can only refer to files whose names are; rename it, or merge without --virtual"
    )]
    NotUnicode { path: PathBuf },
}

fn plural(several: &bool) -> &'static str {
    if *several { "s" } else { "" }
}

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
        return Err(MergeError::Exists {
            path: output.to_owned(),
        });
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
    let whole = Whole {
        options,
        shards: &shards,
        plan: &plan,
        header: &header,
        overwrite,
    };
    let (file, failed) = if options.by_reference {
        whole.refer()?
    } else {
        whole.copy()?
    };
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
    let mut shards: Vec<ShardFile> = Vec::with_capacity(options.shards.len());
    for path in options.shards {
        let partial = partial_path(path);
        if !path.exists() && partial.exists() {
            let path = path.clone();
            return Err(MergeError::Interrupted { path, partial });
        }
        shards.push(ShardFile::open(path)?);
    }
    let Some(first) = shards.first() else {
        return Err(MergeError::Missing {
            missing: "1".to_owned(),
            count: 1,
            several: false,
        });
    };
    let header = first.header()?;
    for second in &shards[1..] {
        let (one, other) = (first.path().to_owned(), second.path().to_owned());
        let theirs = second.header()?;
        if theirs.digest != header.digest {
            let short = |digest: &str| digest.chars().take(8).collect();
            return Err(MergeError::OtherStudy {
                first: one,
                second: other,
                first_digest: short(&header.digest),
                second_digest: short(&theirs.digest),
            });
        }
        let counts = [first, second].map(|shard| shard.partition().shards());
        if counts[0] != counts[1] || first.partition() != second.partition() {
            return Err(MergeError::OtherDivision {
                first: one,
                second: other,
                first_count: counts[0],
                second_count: counts[1],
            });
        }
        if let Some((what, [first_value, second_value])) = difference(&header, &theirs) {
            return Err(MergeError::OtherBuild {
                first: one,
                second: other,
                what,
                first_value,
                second_value,
            });
        }
    }
    shards.sort_by_key(ShardFile::shard);
    let count = shards[0].partition().shards();
    for pair in shards.windows(2) {
        if pair[0].shard() == pair[1].shard() {
            return Err(MergeError::Twice {
                first: pair[0].path().to_owned(),
                second: pair[1].path().to_owned(),
                shard: pair[0].shard() + 1,
                count,
            });
        }
    }
    let missing: Vec<usize> = (0..count)
        .filter(|&shard| shards.binary_search_by_key(&shard, ShardFile::shard).is_err())
        .map(|shard| shard + 1)
        .collect();
    if !missing.is_empty() {
        return Err(MergeError::Missing {
            several: missing.len() > 1,
            missing: in_words(&missing),
            count,
        });
    }
    for shard in &shards {
        let (done, points) = (shard.done()?, shard.partition().size(shard.shard()));
        if done < points {
            return Err(MergeError::Incomplete {
                path: shard.path().to_owned(),
                shard: shard.shard() + 1,
                count,
                done,
                points,
            });
        }
    }
    Ok(shards)
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

struct Whole<'a> {
    options: &'a MergeOptions<'a>,
    shards: &'a [ShardFile],
    plan: &'a SweepPlan,
    header: &'a SweepHeader,
    overwrite: Overwrite,
}

impl Whole<'_> {
    fn partition(&self) -> &Partition {
        self.shards[0].partition()
    }

    /// Writes every point. Returns the file, and how many points failed.
    fn copy(&self) -> Result<(PathBuf, usize), MergeError> {
        let MergeOptions { output, shards, .. } = *self.options;
        let mut rows = Vec::with_capacity(self.shards.len());
        for shard in self.shards {
            rows.push(shard.rows(self.plan)?);
        }
        let mut writer = SweepWriter::create(
            Reservation::take(output, self.overwrite, shards)?,
            self.header,
            self.plan,
        )?;
        let mut failed = 0;
        for number in 0..self.plan.points {
            let row = rows[self.partition().owner(number)].next(number as u64)?;
            failed += usize::from(row.failure.is_some());
            writer.push(row)?;
        }
        Ok((writer.finish(&Status::Complete)?, failed))
    }

    /// Writes where the points are. Returns the file, and how many points failed.
    fn refer(&self) -> Result<(PathBuf, usize), MergeError> {
        let MergeOptions { output, shards, .. } = *self.options;
        let mut sources = Vec::with_capacity(self.shards.len());
        let mut failures = Vec::new();
        for shard in self.shards {
            let path = relative_path(output, shard.path());
            let path = path
                .to_str()
                .ok_or_else(|| MergeError::NotUnicode { path: path.clone() })?;
            sources.push(Source {
                path: path.to_owned(),
                points: self.partition().size(shard.shard()),
                events: shard.event_count()?,
                patches: self.partition().patches(shard.shard()),
            });
            failures.extend(shard.failures()?);
        }
        failures.sort_by_key(|failure| failure.0);
        let storage = Storage::Shards(Shards {
            sources: &sources,
            rows: Rows::Points,
        });
        let place = Reservation::take(output, self.overwrite, shards)?;
        let mut writer = SweepWriter::create_with(place, self.header, self.plan, storage)?;
        let failed = failures.len();
        for (number, message) in failures {
            writer.push_failure(i64::try_from(number).unwrap_or(i64::MAX), message);
        }
        Ok((writer.finish(&Status::Complete)?, failed))
    }
}
