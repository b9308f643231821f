//! `stickslip inspect`: lists what a file contains.

use super::arguments::{Common, InspectOptions};
use super::{CommandEnd, complain, show};
use crate::Error;
use stickslip_files::Contents;

pub(super) fn inspect(options: &InspectOptions, common: &Common) -> Result<CommandEnd, Error> {
    let contents = Contents::read(&options.file)?;
    if contents.growing && !common.quiet {
        complain(&format!(
            "{}: still being written; this is what the last flush left",
            options.file.display()
        ));
    }
    if let Some(problems) = contents.damage.as_ref().filter(|_| !common.quiet) {
        complain(&format!(
            "warning: {}: damaged, and what is listed may be wrong: {problems}; copy it again, or repeat the run",
            options.file.display()
        ));
    }
    show(common, &contents)?;
    Ok(CommandEnd::Done)
}
