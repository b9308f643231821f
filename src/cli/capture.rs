//! A command run inside another program: what it would say is handed back.

use super::arguments::ProgressChoice;
use super::captured::{Capturing, Said, Watch};
use super::{Arguments, CommandError, End, dispatch};
use clap::Parser;
use std::ffi::OsString;
use std::sync::Arc;

/// What a command said, and how it ended.
#[derive(Debug)]
pub struct Captured {
    /// Its report, as on standard output; of the commands that have one beside their document.
    pub text: String,
    /// Its JSON document.
    pub document: Option<String>,
    /// What it said on standard error.
    pub messages: Vec<String>,
    /// How it ended.
    pub end: Result<End, CommandError>,
}

/// Runs a command with these arguments, without the name of the program. What it has to say is captured, report and document
/// both, and `watch` follows and ends it. It sets no handler of signals, and no logger. A table that is asked for on standard
/// output (`export -o -`) goes there.
pub fn capture(arguments: impl IntoIterator<Item = OsString>, watch: Arc<Watch>) -> Captured {
    let capturing = Capturing::new(watch);
    let end = ended(arguments);
    let Said {
        text,
        document,
        messages,
    } = capturing.end();
    Captured {
        text,
        document,
        messages,
        end,
    }
}

fn ended(arguments: impl IntoIterator<Item = OsString>) -> Result<End, CommandError> {
    let program = std::iter::once(OsString::from("stickslip"));
    let arguments = Arguments::try_parse_from(program.chain(arguments)).map_err(|error| {
        let text = error.to_string();
        CommandError::Input(text.strip_prefix("error: ").unwrap_or(&text).trim_end().to_owned())
    })?;
    let Arguments { command, mut common } = arguments;
    common.json = true;
    common.progress = ProgressChoice::Never;
    dispatch(command, &common)
}
