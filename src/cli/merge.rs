//! `stickslip merge`: joins the shards of a sweep in one file.

use super::arguments::{Common, MergeArguments};
use super::{CommandEnd, tell};
use crate::Error;
use stickslip_files::MergeError;

pub(super) fn merge(options: &MergeArguments, common: &Common) -> Result<CommandEnd, Error> {
    if options.by_reference {
        return Err(Error::input(
            "--virtual is gone: merge copies the points, so that the file needs no shards any more; run it without --virtual",
        ));
    }
    let report = stickslip_files::merge(&stickslip_files::MergeOptions {
        shards: &options.shards,
        output: &options.output,
        replace: options.force,
    })
    .map_err(|error| command_error(&error))?;
    tell(common, &report)?;
    if report.failed == report.points {
        return Err(Error::computation(format!(
            "all {} points failed. The messages are in /failures of {}",
            report.points,
            report.file.display()
        )));
    }
    Ok(CommandEnd::Done)
}

fn command_error(error: &MergeError) -> Error {
    match error {
        MergeError::File(inner) if inner.is_of_the_system() => Error::computation(error),
        _ => Error::input(error),
    }
}
