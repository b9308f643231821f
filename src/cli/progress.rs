//! The progress bar, over simulated time.

use super::arguments::{Common, ProgressChoice};
use crate::simulation::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// Resolution of the bar.
const TICKS: f64 = 1000.0;

/// A bar with the simulated time, the mode and the number of events; nothing where none is wanted.
pub(super) struct RunBar {
    bar: ProgressBar,
    end_time: f64,
}

impl RunBar {
    pub(super) fn new(common: &Common, end_time: f64) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let shown = match common.progress {
            ProgressChoice::Always => true,
            ProgressChoice::Never => false,
            ProgressChoice::Auto => !common.quiet && terminal,
        };
        let bar = if shown {
            let target = if terminal {
                ProgressDrawTarget::stderr()
            } else {
                // Asked for although it is no terminal: a few updates a second, for whoever reads the stream.
                ProgressDrawTarget::term_like_with_hz(Box::new(console::Term::stderr()), 2)
            };
            let style = ProgressStyle::with_template("{bar:16} {msg}  {elapsed} (left {eta})")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::with_draw_target(Some(TICKS as u64), target).with_style(style)
        } else {
            ProgressBar::hidden()
        };
        RunBar { bar, end_time }
    }

    pub(super) fn show(&self, progress: Progress) {
        if self.bar.is_hidden() {
            return;
        }
        self.bar.set_position((TICKS * progress.time / self.end_time) as u64);
        self.bar.set_message(format!(
            "t = {:.6} s of {} s, {}, {} events",
            progress.time,
            self.end_time,
            progress.mode.name(),
            progress.events
        ));
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
