//! What an earlier, incomplete start of a sweep has left: the journals of ranks, or the whole file.

use super::error::SweepError;
use super::journal::{Existing, Journal, rank_journals};
use super::report::{NAMED_FAILURES, SweepReport};
use super::shard::Shard;
use crate::results::{ResultError, ShardFile, SweepFile, check_sound};
use std::path::{Path, PathBuf};

/// The journals that ranks have left beside a sweep file.
pub(super) fn ranks_left(path: &Path) -> Result<Vec<PathBuf>, SweepError> {
    rank_journals(path).map_err(|error| ResultError::io(path, "looking for the journals of ranks", error).into())
}

/// Brings what ranks have left in journals of their own into the journal of the sweep, or does with them what is to be
/// done with that one.
pub(super) fn gather(journal: &mut Journal, path: &Path, digest: &str, existing: Existing) -> Result<(), SweepError> {
    for file in ranks_left(path)? {
        let mut other = Journal::open(&file, digest, existing)?;
        journal.absorb(&mut other)?;
        other.remove()?;
    }
    Ok(())
}

/// The report of a sweep that had been complete before it was resumed.
pub(super) fn already_there(path: &Path, digest: &str, shard: Option<Shard>) -> Result<SweepReport, SweepError> {
    let refused = |what: &str| {
        SweepError::Refused(format!(
            "{}: {what}, so there is nothing to resume; choose another name with -o, or start anew without --resume",
            path.display()
        ))
    };
    let check = |found: Option<String>| match found.as_deref() == Some(digest) {
        true => Ok(()),
        false => Err(refused(
            "is the file of another study, or of this one before it was changed",
        )),
    };
    let (points, mut failures) = match shard {
        None => {
            let file = SweepFile::open(path)?;
            check_sound(path)?;
            check(file.digest())?;
            (file.numbers("status")?.len() as u64, file.failures()?)
        }
        Some(expected) => {
            let file = ShardFile::open(path)?;
            check_sound(path)?;
            check(file.digest())?;
            let (found, count) = (file.shard() + 1, file.partition().shards());
            if (found, count) != (expected.index(), expected.count()) {
                let what = format!("holds another shard ({found} of {count}, not {expected})");
                return Err(refused(&what));
            }
            (file.done()? as u64, file.failures()?)
        }
    };
    let failed = failures.len() as u64;
    failures.truncate(NAMED_FAILURES);
    Ok(SweepReport {
        file: path.to_owned(),
        interrupted: false,
        points,
        run_now: 0,
        failures,
        failed,
        unfinished: None,
        boundaries: None,
    })
}
