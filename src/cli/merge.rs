//! `stickslip merge`: joins the shards of a sweep in one file.

use super::arguments::{Common, MergeArguments};
use super::{CommandEnd, tell};
use crate::Error;

pub(super) fn merge(options: &MergeArguments, common: &Common) -> Result<CommandEnd, Error> {
    if options.by_reference {
        return Err(Error::input(
            "--virtual is gone: merge copies the points, so that the file needs no shards any more; run it without --virtual",
        ));
    }
    let report = stickslip_files::merge(&options.shards, &options.output, options.force)?;
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
