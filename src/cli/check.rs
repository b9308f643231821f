//! `stickslip check`: whether a file is as it was written.

use super::arguments::{CheckOptions, Common};
use super::{CommandEnd, tell};
use crate::Error;
use stickslip_files::{Reason, check as check_file};

pub(super) fn check(options: &CheckOptions, common: &Common) -> Result<CommandEnd, Error> {
    let path = options.file.display();
    let report = check_file(&options.file).map_err(|error| match error.reason {
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
    let text = format!("{path}: {problems}; copy it again, or repeat the run");
    Err(Error::computation(text))
}
