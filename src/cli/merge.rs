//! `stickslip merge`: joins the shards of a sweep in one file.

use super::arguments::{Common, MergeArguments};
use super::{CommandEnd, CommandError, tell};

pub(super) fn merge(options: &MergeArguments, common: &Common) -> Result<CommandEnd, CommandError> {
    if options.by_reference {
        return Err(CommandError::input(
            "--virtual is gone: merge copies the points, so that the file needs no shards any more; run it without --virtual",
        ));
    }
    let merged = stickslip_files::merge(&options.shards, &options.output, options.force);
    let report = merged.map_err(|error| match error.is_of_the_system() {
        true => CommandError::computation(error),
        false => CommandError::input(error),
    })?;
    tell(common, &report)?;
    if report.failed == report.points {
        return Err(CommandError::computation(format!(
            "all {} points failed. The messages are in /failures of {}",
            report.points,
            report.file.display()
        )));
    }
    Ok(CommandEnd::Done)
}
