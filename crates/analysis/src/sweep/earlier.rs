//! Complete file of an earlier start of a sweep.

use super::error::SweepError;
use super::report::{NAMED_FAILURES, SweepReport};
use super::shard::Shard;
use std::path::Path;
use stickslip_files::{ShardFile, StudyFile, check_sound};

/// Report of a sweep that was already complete when it was resumed.
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
            let file = StudyFile::open_sweep(path)?;
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
