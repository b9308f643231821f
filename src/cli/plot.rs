//! `stickslip plot`.

use super::arguments::{Common, PlotOptions};
use super::{CommandError, End, print, print_json};
use crate::plot::page::{self, PageError};
use crate::results::{Overwrite, ResultFile};

/// Writes the interactive page of a result file.
pub(super) fn plot(options: &PlotOptions, common: &Common) -> Result<End, CommandError> {
    let overwrite = if options.force {
        Overwrite::Force
    } else {
        Overwrite::OwnResults
    };
    let file = ResultFile::open(&options.file).map_err(|error| CommandError::Input(error.to_string()))?;
    let page = page::write(&file, &options.html, overwrite).map_err(|error| match error {
        PageError::Io { .. } | PageError::Json { .. } => CommandError::Computation(error.to_string()),
        _ => CommandError::Input(error.to_string()),
    })?;
    if common.json {
        print_json(&serde_json::json!({ "file": options.html.display().to_string(), "page": page }))?;
    } else if !common.quiet {
        print(&format!("{}\n", options.html.display()))?;
    }
    Ok(End::Done)
}
