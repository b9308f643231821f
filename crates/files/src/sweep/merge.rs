//! Merges the files of a study's shards. The result equals the file of a single sweep byte for byte.

use serde::{Serialize, Serializer};
use std::path::{Path, PathBuf};

use super::shard::ShardFile;
use super::writer::SweepWriter;
use crate::check::check_sound;
use crate::disk::same_file;
use crate::study::StudyHeader;
use crate::{Overwrite, Reason, Reservation, ResultError, Status, partial_path};

/// Result of a merge.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MergeReport {
    /// Output file.
    #[serde(serialize_with = "displayed")]
    pub file: PathBuf,
    /// Digest of the study.
    pub digest: String,
    /// Number of shards.
    pub shards: usize,
    /// Number of points in all shards.
    pub points: usize,
    /// Number of points whose run failed.
    pub failed: usize,
}

fn displayed<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.display())
}

/// Merges the files of all shards of one study, in any order. The result equals the file of a single sweep byte for
/// byte. Unless `replace`, even a result of this program is not replaced.
///
/// # Errors
/// Shards that are of different studies, builds or divisions, missing, duplicate, or incomplete; an existing output;
/// failures to read and write.
pub fn merge(inputs: &[PathBuf], output: &Path, replace: bool) -> Result<MergeReport, ResultError> {
    if inputs.iter().any(|shard| same_file(shard, output)) {
        return Err(Reason::IsInput.of(output));
    }
    if !replace && std::fs::symlink_metadata(output).is_ok() && !output.is_dir() {
        return Err(Reason::Exists.of(output));
    }
    let shards = open_all(inputs)?;
    let plan = shards[0].plan()?;
    let header = shards[0].header()?;
    // Checked last: faults of the study itself have clearer messages.
    shards.iter().try_for_each(|shard| check_sound(shard.path()))?;
    let place = Reservation::take(output, Overwrite::by_force(replace), inputs)?;
    let rows = shards.iter().map(|shard| {
        let rows = shard.rows(&plan);
        shard.close();
        rows
    });
    let mut rows = rows.collect::<Result<Vec<_>, _>>()?;
    let mut writer = SweepWriter::create(place, &header, &plan)?;
    let mut failed = 0;
    for number in 0..plan.points {
        let row = rows[shards[0].partition().owner(number)].next(number as u64)?;
        failed += usize::from(row.failure.is_some());
        writer.push(row)?;
    }
    Ok(MergeReport {
        file: writer.finish(&Status::Complete)?,
        digest: header.digest,
        shards: shards.len(),
        points: plan.points,
        failed,
    })
}

fn open_all(inputs: &[PathBuf]) -> Result<Vec<ShardFile>, ResultError> {
    let wrong = |what: String| Err(Reason::Shards(what).of(Path::new("")));
    let mut shards: Vec<ShardFile> = Vec::with_capacity(inputs.len());
    for path in inputs {
        let partial = partial_path(path);
        if !path.exists() && partial.exists() {
            let partial = partial.display();
            let what =
                format!("not there yet, but {partial} is: this shard was interrupted; sweep it again with --resume");
            return Err(Reason::Shards(what).of(path));
        }
        let shard = ShardFile::open(path)?;
        shard.close();
        shards.push(shard);
    }
    let Some(first) = shards.first() else {
        return wrong(without(&[1], 1));
    };
    let header = first.header()?;
    let count = first.partition().shards();
    for second in &shards[1..] {
        let both = format!("{} and {}", first.path().display(), second.path().display());
        let theirs = second.header()?;
        second.close();
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
    let is_missing = |shard: &usize| shards.binary_search_by_key(shard, ShardFile::shard).is_err();
    let missing: Vec<usize> = (0..count).filter(is_missing).map(|shard| shard + 1).collect();
    if !missing.is_empty() {
        return wrong(without(&missing, count));
    }
    for shard in &shards {
        let (done, points) = (shard.done()?, shard.partition().size(shard.shard()));
        shard.close();
        if done < points {
            let number = shard.shard() + 1;
            let what = format!(
                "shard {number} of {count} is incomplete: {done} of its {points} points are done; sweep it again with --resume"
            );
            return Err(Reason::Shards(what).of(shard.path()));
        }
    }
    Ok(shards)
}

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

/// Lists numbers in words, such as "2, 5 to 9 and 12".
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

fn difference(first: &StudyHeader, second: &StudyHeader) -> Option<(String, [String; 2])> {
    if first.source != second.source {
        return Some(("source".to_owned(), [first.source.clone(), second.source.clone()]));
    }
    let named = |header: &StudyHeader, name: &str| {
        let found = header.meta.iter().find(|(other, _)| other == name);
        found.map_or("none".to_owned(), |(_, value)| value.to_string())
    };
    let mut names = first.meta.iter().chain(&second.meta).map(|(name, _)| name);
    names.find_map(|name| {
        let values = [named(first, name), named(second, name)];
        (values[0] != values[1]).then(|| (name.clone(), values))
    })
}
