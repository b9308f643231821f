//! A command run inside another program: what it would print is handed back, and nothing is printed.

use super::arguments::ProgressChoice;
use super::{Arguments, CommandError, End, dispatch};
use clap::Parser;
use std::cell::RefCell;
use std::ffi::OsString;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What a command printed, and how it ended.
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

/// What is captured in this thread.
struct Capture {
    text: String,
    document: Option<String>,
    messages: Vec<String>,
    stop: Arc<AtomicBool>,
}

thread_local! {
    static CAPTURE: RefCell<Option<Capture>> = const { RefCell::new(None) };
}

/// Runs a command with these arguments, without the name of the program. What it has to say is captured, report and document
/// both, and `stop` ends it in good order. It sets no handler of signals, and no logger.
pub fn capture(arguments: impl IntoIterator<Item = OsString>, stop: Arc<AtomicBool>) -> Captured {
    let capture = Capture {
        text: String::new(),
        document: None,
        messages: Vec::new(),
        stop,
    };
    CAPTURE.with_borrow_mut(|slot| *slot = Some(capture));
    let end = ended(arguments);
    let capture = CAPTURE.with_borrow_mut(Option::take);
    let (text, document, messages) = capture.map_or_else(Default::default, |c| (c.text, c.document, c.messages));
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

/// Takes what would be printed; `false` if nothing is captured.
pub(super) fn text(text: &str) -> bool {
    with(|capture| capture.text.push_str(text))
}

/// Takes a document.
pub(super) fn document(text: &str) -> bool {
    with(|capture| capture.document = Some(text.to_owned()))
}

/// Takes what would be said on standard error.
pub(super) fn message(text: &str) -> bool {
    with(|capture| capture.messages.push(text.to_owned()))
}

/// Whether something is captured.
pub(super) fn now() -> bool {
    CAPTURE.with_borrow(Option::is_some)
}

/// What ends the command.
pub(super) fn stop() -> Option<Arc<AtomicBool>> {
    CAPTURE.with_borrow(|capture| capture.as_ref().map(|capture| capture.stop.clone()))
}

fn with(action: impl FnOnce(&mut Capture)) -> bool {
    CAPTURE.with_borrow_mut(|capture| capture.as_mut().map(action).is_some())
}
