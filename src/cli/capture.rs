//! A command inside another program, which receives the report and the JSON document.

use super::arguments::ProgressChoice;
use super::{Arguments, CommandEnd, dispatch};
use crate::Error;
use clap::Parser;
use std::cell::RefCell;
use std::ffi::OsString;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Captured output of a command.
#[derive(Debug, Default)]
pub struct Said {
    /// Report for standard output, if the command has one in addition to its document.
    pub text: String,
    /// JSON document.
    pub document: Option<String>,
    /// Messages for standard error.
    pub messages: Vec<String>,
}

struct Capture {
    said: Said,
    stop: Arc<AtomicBool>,
}

thread_local! {
    static CAPTURE: RefCell<Option<Capture>> = const { RefCell::new(None) };
}

/// Runs a command with these arguments, without the program's name. Returns the captured report, document and
/// messages, and the outcome. `stop` stops the command cleanly. No signal handler and no logger is set. `export -o -`
/// still writes to standard output.
pub fn capture(
    arguments: impl IntoIterator<Item = OsString>,
    stop: Arc<AtomicBool>,
) -> (Said, Result<CommandEnd, Error>) {
    /// Ends the capture also after a panic. Otherwise this thread would never print again.
    struct Capturing;
    impl Drop for Capturing {
        fn drop(&mut self) {
            CAPTURE.with_borrow_mut(Option::take);
        }
    }
    let said = Said::default();
    CAPTURE.with_borrow_mut(|slot| *slot = Some(Capture { said, stop }));
    let _capturing = Capturing;
    let end = ended(arguments);
    let said = CAPTURE.with_borrow_mut(Option::take).map(|capture| capture.said);
    (said.unwrap_or_default(), end)
}

fn ended(arguments: impl IntoIterator<Item = OsString>) -> Result<CommandEnd, Error> {
    let program = std::iter::once(OsString::from("stickslip"));
    let arguments = Arguments::try_parse_from(program.chain(arguments))
        .map_err(|error| Error::input(super::usage::message(&error)))?;
    let Arguments { command, mut common } = arguments;
    common.json = true;
    common.progress = ProgressChoice::Never;
    dispatch(command, &common)
}

pub(super) fn text(text: &str) -> bool {
    with(|said| said.text.push_str(text))
}

pub(super) fn document(text: &str) -> bool {
    with(|said| said.document = Some(text.to_owned()))
}

pub(super) fn message(text: &str) -> bool {
    with(|said| said.messages.push(text.to_owned()))
}

pub(super) fn now() -> bool {
    CAPTURE.with_borrow(Option::is_some)
}

pub(super) fn stop() -> Option<Arc<AtomicBool>> {
    CAPTURE.with_borrow(|capture| capture.as_ref().map(|capture| capture.stop.clone()))
}

fn with(action: impl FnOnce(&mut Said)) -> bool {
    CAPTURE.with_borrow_mut(|capture| capture.as_mut().map(|capture| action(&mut capture.said)).is_some())
}
