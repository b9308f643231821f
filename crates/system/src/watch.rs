//! Observers of long computations.

use std::fmt::Arguments;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

/// `Break` if `stop`, otherwise `Continue`.
pub fn go_on_unless(stop: bool) -> ControlFlow<()> {
    match stop {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}

/// Observer of a long computation: it learns the progress, and may end the computation in good order.
///
/// A flag ends the computation once it is set, and a function once it returns true. `()` never does.
pub trait Watch: Sync {
    /// Whether the computation should end.
    fn stopped(&self) -> bool;

    /// Learns that `done` of `of` parts are done, and in words what is being computed. `Break` if [`Self::stopped`].
    fn at(&self, _done: f64, _of: f64, _what: Arguments<'_>) -> ControlFlow<()> {
        go_on_unless(self.stopped())
    }
}

impl Watch for () {
    fn stopped(&self) -> bool {
        false
    }
}

impl Watch for AtomicBool {
    fn stopped(&self) -> bool {
        self.load(Ordering::Relaxed)
    }
}

impl<F: Fn() -> bool + Sync> Watch for F {
    fn stopped(&self) -> bool {
        self()
    }
}
