//! Progress bars: of a run, of the oracle and of a comparison over simulated time, of studies over their runs.

use super::arguments::{Common, ProgressChoice};
use super::captured;
use crate::compare::CompareProgress;
use crate::oracle::OracleProgress;
use crate::simulation::Progress;
use crate::sweep::SweepProgress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::io::IsTerminal;
use std::path::Path;

const MESSAGE: &str = "{bar:16} {msg}  {elapsed} (left {eta})";

/// Resolution of the bar.
const TICKS: f64 = 1000.0;

/// A bar with the simulated time, the mode and the number of events; nothing where none is wanted.
pub(super) struct RunBar {
    bar: ProgressBar,
    end_time: f64,
}

impl RunBar {
    pub(super) fn new(common: &Common, end_time: f64) -> Self {
        RunBar {
            bar: bar(common, TICKS as u64, MESSAGE),
            end_time,
        }
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

/// A bar with the simulated time of the oracle's present run, and its digits.
pub(super) struct OracleBar {
    bar: ProgressBar,
}

impl OracleBar {
    pub(super) fn new(common: &Common) -> Self {
        OracleBar {
            bar: bar(common, TICKS as u64, MESSAGE),
        }
    }

    pub(super) fn show(&self, progress: OracleProgress) {
        if self.bar.is_hidden() {
            return;
        }
        let position = (TICKS * progress.time / progress.end_time) as u64;
        // Another run, with more digits.
        if position < self.bar.position() {
            self.bar.reset();
        }
        self.bar.set_position(position);
        self.bar.set_message(format!(
            "oracle with {} digits: t = {:.6} s of {} s",
            progress.digits, progress.time, progress.end_time
        ));
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar with the share of a comparison that is done.
pub(super) struct CompareBar {
    bar: ProgressBar,
    /// Of the candidate.
    file: String,
}

impl CompareBar {
    pub(super) fn new(common: &Common, file: &Path) -> Self {
        CompareBar {
            bar: bar(common, TICKS as u64, MESSAGE),
            file: file.display().to_string(),
        }
    }

    pub(super) fn show(&self, progress: CompareProgress) {
        if self.bar.is_hidden() {
            return;
        }
        self.bar.set_position((TICKS * progress.done) as u64);
        let task = if progress.pass == 1 { "events" } else { "states" };
        self.bar
            .set_message(format!("{}: {task}, t = {:.6} s", self.file, progress.time));
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar that counts what is done of a known number.
pub(super) struct CountBar {
    bar: ProgressBar,
    what: &'static str,
}

impl CountBar {
    pub(super) fn new(common: &Common, what: &'static str) -> Self {
        let bar = bar(common, 0, MESSAGE);
        CountBar { bar, what }
    }

    pub(super) fn show(&self, done: usize, of: usize, under_way: &str) {
        captured::progress(done as u64, of as u64);
        if self.bar.is_hidden() {
            return;
        }
        self.bar.set_length(of as u64);
        self.bar.set_position(done as u64);
        self.bar
            .set_message(format!("{done} of {of} {}, {under_way}", self.what));
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar with the points that are done, how many a second, and the time left.
pub(super) struct SweepBar {
    bar: ProgressBar,
}

impl SweepBar {
    pub(super) fn new(common: &Common) -> Self {
        let bar = bar(common, 1, "{bar:16} {pos} of {msg}  {rate}  {elapsed} (left {eta})");
        bar.set_message("0 points");
        SweepBar { bar }
    }

    pub(super) fn show(&self, progress: SweepProgress) {
        captured::progress(progress.done, progress.total);
        if self.bar.is_hidden() {
            return;
        }
        if self.bar.length() != Some(progress.total) {
            self.bar.set_length(progress.total);
        }
        // What an earlier start has done says nothing about the rate.
        if self.bar.position() == 0 && progress.done > 0 {
            self.bar.set_position(progress.done);
            self.bar.reset_eta();
        } else {
            self.bar.set_position(progress.done);
        }
        let more = if progress.open { " or more" } else { "" };
        let failed = match progress.failed {
            0 => String::new(),
            failed => format!(", {failed} failed"),
        };
        self.bar.set_message(format!("{}{more} points{failed}", progress.total));
    }

    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar on standard error, hidden where none is wanted.
fn bar(common: &Common, length: u64, template: &str) -> ProgressBar {
    let terminal = std::io::stderr().is_terminal();
    let shown = match common.progress {
        ProgressChoice::Always => true,
        ProgressChoice::Never => false,
        ProgressChoice::Auto => !common.quiet && terminal,
    };
    if !shown {
        return ProgressBar::hidden();
    }
    let target = if terminal {
        ProgressDrawTarget::stderr()
    } else {
        // Asked for although it is no terminal: a few updates a second, for whoever reads the stream.
        ProgressDrawTarget::term_like_with_hz(Box::new(console::Term::stderr()), 2)
    };
    let style = ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("rate", |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            // A bar that cannot be drawn is no reason to stop.
            let _ = write!(text, "{:.1} a second", state.per_sec());
        });
    ProgressBar::with_draw_target(Some(length), target).with_style(style)
}
