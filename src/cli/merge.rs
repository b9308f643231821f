//! `stickslip merge`.

use super::arguments::{Common, MergeOptions};
use super::{CommandError, End, tell};
use crate::results::MergeError;

/// Puts the shards of a study together and reports it.
pub(super) fn merge(options: &MergeOptions, common: &Common) -> Result<End, CommandError> {
    let report = crate::results::merge(&crate::results::MergeOptions {
        shards: &options.shards,
        output: &options.output,
        replace: options.force,
        by_reference: options.by_reference,
    })
    .map_err(|error| command_error(&error))?;
    let document = || {
        document! {
            file: report.file.display().to_string(),
            digest: &report.digest,
            shards: report.shards,
            points: report.points,
            failed: report.failed,
            // Whether the points stay in the shards.
            r#virtual: options.by_reference,
        }
    };
    tell(common, document, || {
        let where_they_are = if options.by_reference {
            ", which stay in the shards"
        } else {
            ""
        };
        let failed = match report.failed {
            0 => String::new(),
            failed => format!(" ({failed} failed)"),
        };
        let (points, shards) = (report.points, report.shards);
        let file = report.file.display();
        format!("{points} points{failed} of {shards} shards{where_they_are}\n{file}\n")
    })?;
    if report.failed == report.points {
        return Err(CommandError::computation(format!(
            "all {} points failed. The messages are in /failures of {}",
            report.points,
            report.file.display()
        )));
    }
    Ok(End::Done)
}

fn command_error(error: &MergeError) -> CommandError {
    match error {
        MergeError::File(inner) if inner.is_of_the_system() => CommandError::computation(error),
        _ => CommandError::input(error),
    }
}
