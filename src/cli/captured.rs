//! What a command says while it runs inside another program: it is kept for that program, and nothing is printed.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What a command has said so far.
#[derive(Debug, Default)]
pub(super) struct Said {
    /// Its report, as on standard output; of the commands that have one beside their document.
    pub text: String,
    /// Its JSON document.
    pub document: Option<String>,
    /// What it said on standard error.
    pub messages: Vec<String>,
}

struct Capture {
    said: Said,
    stop: Arc<AtomicBool>,
}

thread_local! {
    static CAPTURE: RefCell<Option<Capture>> = const { RefCell::new(None) };
}

/// As long as it lives, what commands say in this thread is kept.
#[derive(Debug)]
pub(super) struct Capturing(());

impl Capturing {
    /// `stop` ends the command.
    pub fn new(stop: Arc<AtomicBool>) -> Self {
        let said = Said::default();
        CAPTURE.with_borrow_mut(|slot| *slot = Some(Capture { said, stop }));
        Capturing(())
    }

    /// What was said.
    pub fn end(self) -> Said {
        CAPTURE
            .with_borrow_mut(Option::take)
            .map_or_else(Said::default, |capture| capture.said)
    }
}

impl Drop for Capturing {
    fn drop(&mut self) {
        // After a panic as well: else this thread would not print any more.
        CAPTURE.with_borrow_mut(Option::take);
    }
}

/// Takes what would be printed; `false` if nothing is captured.
pub(super) fn text(text: &str) -> bool {
    with(|said| said.text.push_str(text))
}

/// Takes a document.
pub(super) fn document(text: &str) -> bool {
    with(|said| said.document = Some(text.to_owned()))
}

/// Takes what would be said on standard error.
pub(super) fn message(text: &str) -> bool {
    with(|said| said.messages.push(text.to_owned()))
}

/// Whether something is captured.
pub(super) fn now() -> bool {
    CAPTURE.with_borrow(Option::is_some)
}

/// What ends the command.
pub(super) fn stop() -> Option<Arc<AtomicBool>> {
    CAPTURE.with_borrow(|capture| capture.as_ref().map(|capture| capture.stop.clone()))
}

fn with(action: impl FnOnce(&mut Said)) -> bool {
    CAPTURE.with_borrow_mut(|capture| capture.as_mut().map(|capture| action(&mut capture.said)).is_some())
}
