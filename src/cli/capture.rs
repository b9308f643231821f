//! A command inside another program, which receives the report and the JSON document.

use super::arguments::ProgressChoice;
use super::{Arguments, CommandEnd, dispatch};
use crate::Error;
use clap::Parser;
use std::cell::RefCell;
use std::ffi::OsString;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use stickslip_analysis::sweep::Executor;

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

/// Channel between a program and its command, for stop requests, progress and an executor.
#[derive(Debug, Default)]
pub struct CommandHandle {
    /// Stops the command cleanly.
    pub stop: Arc<AtomicBool>,
    progress: Mutex<Option<(u64, u64)>>,
    executor: Mutex<Option<Box<dyn Executor>>>,
}

impl CommandHandle {
    /// Lets an executor run the points of a sweep, instead of threads of this process.
    pub fn let_run(&self, executor: Box<dyn Executor>) {
        if let Ok(mut slot) = self.executor.lock() {
            *slot = Some(executor);
        }
    }

    /// Completed steps and their total, for commands that count, such as `sweep`; `None` before the start.
    pub fn progress(&self) -> Option<(u64, u64)> {
        self.progress.lock().ok().and_then(|progress| *progress)
    }
}

struct Capture {
    said: Said,
    watch: Arc<CommandHandle>,
}

thread_local! {
    static CAPTURE: RefCell<Option<Capture>> = const { RefCell::new(None) };
}

/// Runs a command with these arguments, without the program's name. Returns the captured report, document and
/// messages, and the outcome. `watch` follows and stops the command. No signal handler and no logger is set. `export
/// -o -` still writes to standard output.
pub fn capture(
    arguments: impl IntoIterator<Item = OsString>,
    watch: Arc<CommandHandle>,
) -> (Said, Result<CommandEnd, Error>) {
    /// Ends the capture also after a panic. Otherwise this thread would never print again.
    struct Capturing;
    impl Drop for Capturing {
        fn drop(&mut self) {
            CAPTURE.with_borrow_mut(Option::take);
        }
    }
    let said = Said::default();
    CAPTURE.with_borrow_mut(|slot| *slot = Some(Capture { said, watch }));
    let _capturing = Capturing;
    let end = ended(arguments);
    let said = CAPTURE.with_borrow_mut(Option::take).map(|capture| capture.said);
    (said.unwrap_or_default(), end)
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

pub(super) fn progress(done: u64, total: u64) {
    CAPTURE.with_borrow(|capture| {
        if let Some(mut progress) = capture.as_ref().and_then(|capture| capture.watch.progress.lock().ok()) {
            *progress = Some((done, total));
        }
    });
}

pub(super) fn executor() -> Option<Box<dyn Executor>> {
    CAPTURE.with_borrow(|capture| capture.as_ref()?.watch.executor.lock().ok()?.take())
}

pub(super) fn stop() -> Option<Arc<AtomicBool>> {
    CAPTURE.with_borrow(|capture| capture.as_ref().map(|capture| capture.watch.stop.clone()))
}

fn with(action: impl FnOnce(&mut Said)) -> bool {
    CAPTURE.with_borrow_mut(|capture| capture.as_mut().map(|capture| action(&mut capture.said)).is_some())
}
