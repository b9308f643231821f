//! What a command says while it runs inside another program: it is kept, and nothing is printed.

use std::cell::RefCell;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};

/// What a command has said.
#[derive(Debug, Default)]
pub struct Said {
    /// Its report, as on standard output; of the commands that have one beside their document.
    pub text: String,
    /// Its JSON document.
    pub document: Option<String>,
    /// What it said on standard error.
    pub messages: Vec<String>,
}

/// What a program shares with a command that it runs: the wish to end it, and how far it is.
#[derive(Debug, Default)]
pub struct Watch {
    /// Ends the command in good order.
    pub stop: Arc<AtomicBool>,
    progress: Mutex<Option<(u64, u64)>>,
}

impl Watch {
    /// What is done, of how much: of the commands that count, such as `sweep`. `None` before it begins.
    pub fn progress(&self) -> Option<(u64, u64)> {
        self.progress.lock().ok().and_then(|progress| *progress)
    }
}

struct Capture {
    said: Said,
    watch: Arc<Watch>,
}

thread_local! {
    static CAPTURE: RefCell<Option<Capture>> = const { RefCell::new(None) };
}

/// As long as it lives, what commands say in this thread is kept.
#[derive(Debug)]
pub(super) struct Capturing(());

impl Capturing {
    /// In this thread, under watch.
    pub fn new(watch: Arc<Watch>) -> Self {
        let said = Said::default();
        CAPTURE.with_borrow_mut(|slot| *slot = Some(Capture { said, watch }));
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

/// Takes how far the command is.
pub(super) fn progress(done: u64, total: u64) {
    CAPTURE.with_borrow(|capture| {
        if let Some(mut progress) = capture.as_ref().and_then(|capture| capture.watch.progress.lock().ok()) {
            *progress = Some((done, total));
        }
    });
}

/// What ends the command.
pub(super) fn stop() -> Option<Arc<AtomicBool>> {
    CAPTURE.with_borrow(|capture| capture.as_ref().map(|capture| capture.watch.stop.clone()))
}

fn with(action: impl FnOnce(&mut Said)) -> bool {
    CAPTURE.with_borrow_mut(|capture| capture.as_mut().map(|capture| action(&mut capture.said)).is_some())
}
