//! Computations without the interpreter's lock, which Ctrl-C ends in good order.

use crate::errors::Raised;
use pyo3::prelude::*;
use std::fmt::Arguments;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use stickslip::{Watch, go_on_unless};

/// Signals are looked for so often.
const INTERVAL: Duration = Duration::from_millis(50);
/// Of a thread that computes: that of the program's main thread.
const STACK: usize = 8 << 20;

/// Observer in the thread of Python, which ends a computation after a signal or an exception of `progress`.
pub struct Signals {
    /// The time of the last look, and what was raised: KeyboardInterrupt as a rule.
    state: Mutex<(Instant, Option<PyErr>)>,
    progress: Option<Py<PyAny>>,
}

impl Signals {
    /// `progress` is called with what is done, of how much, both in s of simulated time.
    pub fn new(progress: Option<Py<PyAny>>) -> Self {
        Signals {
            state: Mutex::new((Instant::now(), None)),
            progress,
        }
    }

    pub fn raised(self) -> Option<PyErr> {
        self.state.into_inner().unwrap_or_else(PoisonError::into_inner).1
    }

    fn look(&self, done: Option<(f64, f64)>) -> bool {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let (last, raised) = &mut *state;
        if raised.is_none() && last.elapsed() >= INTERVAL {
            *last = Instant::now();
            *raised = Python::attach(|py| {
                py.check_signals()?;
                match (&self.progress, done) {
                    (Some(progress), Some(numbers)) => progress.call1(py, numbers).map(drop),
                    _ => Ok(()),
                }
            })
            .err();
        }
        raised.is_some()
    }
}

impl Watch for Signals {
    fn stopped(&self) -> bool {
        self.look(None)
    }

    fn at(&self, done: f64, of: f64, _what: Arguments<'_>) -> ControlFlow<()> {
        go_on_unless(self.look(Some((done, of))))
    }
}

/// Observer of a computation in a thread of its own.
#[derive(Debug, Default)]
pub struct Handle {
    /// Ends the computation in good order.
    pub stop: Arc<AtomicBool>,
    /// What is done, of how much; `None` before the start.
    progress: Mutex<Option<(f64, f64)>>,
}

impl Handle {
    fn progress(&self) -> Option<(f64, f64)> {
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watch for Handle {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn at(&self, done: f64, of: f64, _what: Arguments<'_>) -> ControlFlow<()> {
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = Some((done, of));
        go_on_unless(self.stopped())
    }
}

/// Computes in a thread of its own, and calls `progress` with what is done, of how much, as it changes. A signal, or an
/// exception of `progress`, ends the computation in good order, and is raised then.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(Arc<Handle>) -> T + Send,
) -> PyResult<T> {
    let watch = Arc::new(Handle::default());
    let mut told = None;
    let mut tell = |watch: &Handle| -> PyResult<()> {
        let now = watch.progress();
        match (&progress, now) {
            (Some(progress), Some(numbers)) if now != told => {
                told = now;
                let (done, of) = numbers;
                // Counts are integers in Python, too.
                let made = Python::attach(|py| match done.fract() == 0.0 && of.fract() == 0.0 {
                    true => progress.call1(py, (done as u64, of as u64)),
                    false => progress.call1(py, numbers),
                });
                made.map(drop)
            }
            _ => Ok(()),
        }
    };
    let waited = py.detach(|| {
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            let shared = watch.clone();
            let spawned = std::thread::Builder::new()
                .stack_size(STACK)
                .spawn_scoped(scope, move || {
                    let result = catch_unwind(AssertUnwindSafe(|| work(shared)));
                    let _ = sender.send(result);
                });
            if let Err(error) = spawned {
                return (None, Some(PyErr::from(error)));
            }
            let mut raised = None;
            loop {
                match receiver.recv_timeout(INTERVAL) {
                    Ok(result) => {
                        let raised = raised.or_else(|| tell(&watch).err());
                        return (result.ok(), raised);
                    }
                    Err(RecvTimeoutError::Disconnected) => return (None, raised),
                    Err(RecvTimeoutError::Timeout) => {
                        if raised.is_none() {
                            let signals = Python::attach(|py| py.check_signals());
                            raised = signals.and_then(|()| tell(&watch)).err();
                            if raised.is_some() {
                                watch.stop.store(true, Ordering::Relaxed);
                            }
                        }
                    }
                }
            }
        })
    });
    match waited {
        (_, Some(raised)) => Err(raised),
        (Some(result), None) => Ok(result),
        (None, None) => Err(internal().into()),
    }
}

/// A panic of the library, which is an error of the program.
pub fn internal() -> Raised {
    let text =
        "an error of stickslip itself; what is above on standard error says where. Please report it with the case";
    Raised("RunError", text.to_owned())
}
