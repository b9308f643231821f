//! Runs a command inside another program, which receives the report and the JSON document.

use super::arguments::ProgressChoice;
use super::captured::{Capturing, CommandHandle, Said};
use super::{Arguments, CommandEnd, dispatch};
use crate::Error;
use clap::Parser;
use std::ffi::OsString;
use std::sync::Arc;

/// Runs a command with these arguments, without the program's name. Returns the captured report, document and
/// messages, and the outcome. `watch` follows and stops the command. No signal handler and no logger is set. `export
/// -o -` still writes to standard output.
pub fn capture(
    arguments: impl IntoIterator<Item = OsString>,
    watch: Arc<CommandHandle>,
) -> (Said, Result<CommandEnd, Error>) {
    let capturing = Capturing::new(watch);
    let end = ended(arguments);
    (capturing.end(), end)
}

fn ended(arguments: impl IntoIterator<Item = OsString>) -> Result<CommandEnd, Error> {
    let program = std::iter::once(OsString::from("stickslip"));
    let arguments = Arguments::try_parse_from(program.chain(arguments)).map_err(|error| {
        let text = error.to_string();
        Error::input(text.strip_prefix("error: ").unwrap_or(&text).trim_end().to_owned())
    })?;
    let Arguments { command, mut common } = arguments;
    common.json = true;
    common.progress = ProgressChoice::Never;
    dispatch(command, &common)
}
