//! Commands on files: `stickslip inspect` lists what a file contains, `check` says whether it is as it was written, and
//! `merge` joins the shards of a sweep.

use super::arguments::{CheckOptions, Common, InspectOptions, MergeArguments};
use super::{CommandEnd, complain, show, tell};
use crate::Error;
use stickslip_files::{Contents, Reason};

pub(super) fn inspect(options: &InspectOptions, common: &Common) -> Result<CommandEnd, Error> {
    let contents = Contents::read(&options.file)?;
    let path = options.file.display();
    if contents.growing && !common.quiet {
        complain(&format!(
            "{path}: still being written; this is what the last flush left"
        ));
    }
    if let Some(problems) = contents.damage.as_ref().filter(|_| !common.quiet) {
        complain(&format!(
            "warning: {path}: damaged, and what is listed may be wrong: {problems}; copy it again, or repeat the run"
        ));
    }
    show(common, &contents)
}

pub(super) fn check(options: &CheckOptions, common: &Common) -> Result<CommandEnd, Error> {
    let report = stickslip_files::check(&options.file).map_err(|error| match error.reason {
        // The file seems to be of this program, but is wrong.
        Reason::Damaged(_) | Reason::BeyondLimits(_) => Error::computation(error),
        _ => error.into(),
    })?;
    tell(common, &report)?;
    let problems = match report.problems.len() {
        0 => return Ok(CommandEnd::Done),
        1 => "1 problem".to_owned(),
        many => format!("{many} problems"),
    };
    Err(Error::computation(format!(
        "{}: {problems}; copy it again, or repeat the run",
        options.file.display()
    )))
}

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
