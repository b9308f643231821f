//! Progress bars: simulated time of runs and comparisons, number of runs of studies.

use super::arguments::{Common, ProgressChoice};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Arguments;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use stickslip_system::watch::{Watch, go_on_unless};

const TICKS: f64 = 1000.0;

/// A shorter command shows no bar, unless it is asked for.
const PATIENCE: Duration = Duration::from_millis(500);

/// Kind of a progress bar.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum BarKind {
    /// Share of the work.
    Share,
    /// Parts of a known number.
    Parts,
    /// Points, with their rate.
    Points,
    /// Branches, of an unknown number.
    Branches,
}

/// Progress bar of a command, with the flag that stops the command.
pub(super) struct Bar {
    bar: ProgressBar,
    /// Terminal of the bar, and the time of its first drawing; `None` as soon as it is drawn.
    target: Mutex<Option<(ProgressDrawTarget, Instant)>>,
    shown: BarKind,
    stop: Arc<AtomicBool>,
}

impl Bar {
    fn new(common: &Common, shown: BarKind, stop: &Arc<AtomicBool>) -> Self {
        let template = match shown {
            BarKind::Share | BarKind::Parts => "{bar:16} {msg}  {elapsed}{left}",
            BarKind::Points => "{bar:16} {pos} of {msg}  {rate}  {elapsed}{left}",
            BarKind::Branches => "{spinner} {msg}  {elapsed}",
        };
        let target = target(common).map(|(target, delay)| (target, Instant::now() + delay));
        Bar {
            bar: bar(TICKS as u64, template),
            target: Mutex::new(target),
            shown,
            stop: stop.clone(),
        }
    }

    /// Draws the bar from now on if it is time.
    fn show(&self) {
        let Ok(mut target) = self.target.lock() else { return };
        if let Some((target, _)) = target.take_if(|(_, from)| Instant::now() >= *from) {
            self.bar.set_draw_target(target);
        }
    }
}

/// Does `work` under a progress bar.
pub(super) fn watched<R>(common: &Common, shown: BarKind, stop: &Arc<AtomicBool>, work: impl FnOnce(&Bar) -> R) -> R {
    let bar = Bar::new(common, shown, stop);
    let result = work(&bar);
    bar.bar.finish_and_clear();
    result
}

impl Watch for Bar {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn at(&self, done: f64, of: f64, what: Arguments<'_>) -> ControlFlow<()> {
        let bar = &self.bar;
        let unit = if self.shown == BarKind::Share { TICKS / of } else { 1.0 };
        let (position, length) = ((unit * done) as u64, (unit * of) as u64);
        self.show();
        if !bar.is_hidden() {
            let before = bar.position();
            if bar.length() != Some(length) {
                bar.set_length(length);
            }
            // The oracle has started a further run with more digits.
            if position < before && self.shown == BarKind::Share {
                bar.reset();
            }
            bar.set_position(position);
            // Points of an earlier start do not count for the rate.
            if self.shown == BarKind::Points && before == 0 && position > 0 {
                bar.reset_eta();
            }
            bar.set_message(what.to_string());
        }
        go_on_unless(self.stopped())
    }
}

/// Terminal and delay of a bar; `None` without a bar.
fn target(common: &Common) -> Option<(ProgressDrawTarget, Duration)> {
    let terminal = std::io::stderr().is_terminal();
    let shown = match common.progress {
        ProgressChoice::Always => true,
        ProgressChoice::Never => false,
        ProgressChoice::Auto => !common.quiet && terminal,
    };
    if !shown {
        return None;
    }
    let delay = match common.progress {
        ProgressChoice::Always => Duration::ZERO,
        ProgressChoice::Never | ProgressChoice::Auto => PATIENCE,
    };
    let target = if terminal {
        ProgressDrawTarget::stderr()
    } else {
        // Requested without a terminal: a few updates per second suffice for readers of the stream.
        ProgressDrawTarget::term_like_with_hz(Box::new(console::Term::stderr()), 2)
    };
    Some((target, delay))
}

fn bar(length: u64, template: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("rate", |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            // A bar that cannot be drawn must not stop the command.
            let _ = write!(text, "{:.1} a second", state.per_sec());
        })
        .with_key("left", |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            // The first steps say little about the rest.
            if state.pos() > 0 && state.elapsed() > PATIENCE {
                let _ = write!(text, " (left {:#})", HumanDuration(state.eta()));
            }
        });
    ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::hidden()).with_style(style)
}
