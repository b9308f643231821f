//! Progress bars: simulated time of runs and comparisons, number of runs of studies.

use super::arguments::{Common, ProgressChoice};
use super::captured;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::io::IsTerminal;
use std::path::Path;
use stickslip_analysis::continuation::ContinuationProgress;
use stickslip_analysis::sweep::SweepProgress;
use stickslip_compare::{CompareProgress, CompareStage};
use stickslip_engine::simulation::Progress;
use stickslip_oracle::OracleProgress;

const MESSAGE: &str = "{bar:16} {msg}  {elapsed} (left {eta})";

const TICKS: f64 = 1000.0;

pub(super) struct Bar(ProgressBar);

impl Bar {
    pub(super) fn new(common: &Common) -> Self {
        Bar(bar(common, TICKS as u64, MESSAGE))
    }

    pub(super) fn of_points(common: &Common) -> Self {
        let bar = bar(common, 1, "{bar:16} {pos} of {msg}  {rate}  {elapsed} (left {eta})");
        bar.set_message("0 points");
        Bar(bar)
    }

    pub(super) fn run(&self, progress: Progress, end_time: f64) {
        let Progress { time, mode, events } = progress;
        let mode = mode.name();
        self.share(time / end_time, || {
            format!("t = {time:.6} s of {end_time} s, {mode}, {events} events")
        });
    }

    pub(super) fn oracle(&self, progress: OracleProgress) {
        let OracleProgress { digits, time, end_time } = progress;
        // A further run with more digits has started.
        if !self.0.is_hidden() && ((TICKS * time / end_time) as u64) < self.0.position() {
            self.0.reset();
        }
        self.share(time / end_time, || {
            format!("exact solver with {digits} digits: t = {time:.6} s of {end_time} s")
        });
    }

    pub(super) fn comparison(&self, progress: CompareProgress, candidate: &Path) {
        self.share(progress.done, || {
            let stage = match progress.stage {
                CompareStage::Events { time } => format!("events, t = {time:.6} s"),
                CompareStage::States { time } => format!("states, t = {time:.6} s"),
                CompareStage::Causes { of: 0, .. } => "trying causes".to_owned(),
                CompareStage::Causes { runs, of } => format!("trying causes, {runs} of {of} runs"),
            };
            format!("{}: {stage}", candidate.display())
        });
    }

    pub(super) fn count(&self, done: usize, of: usize, what: &str, under_way: &str) {
        captured::progress(done as u64, of as u64);
        if self.0.is_hidden() {
            return;
        }
        self.0.set_length(of as u64);
        self.0.set_position(done as u64);
        self.0.set_message(format!("{done} of {of} {what}, {under_way}"));
    }

    pub(super) fn points(&self, progress: SweepProgress) {
        captured::progress(progress.done, progress.total);
        let bar = &self.0;
        if bar.is_hidden() {
            return;
        }
        if bar.length() != Some(progress.total) {
            bar.set_length(progress.total);
        }
        // Points of an earlier start do not count for the rate.
        let earlier = bar.position() == 0 && progress.done > 0;
        bar.set_position(progress.done);
        if earlier {
            bar.reset_eta();
        }
        let more = if progress.open { " or more" } else { "" };
        let failed = match progress.failed {
            0 => String::new(),
            failed => format!(", {failed} failed"),
        };
        bar.set_message(format!("{}{more} points{failed}", progress.total));
    }

    pub(super) fn of_branches(common: &Common) -> Self {
        Bar(bar(common, 1, "{spinner} {msg}  {elapsed}"))
    }

    pub(super) fn branches(&self, progress: ContinuationProgress) {
        captured::progress(progress.points as u64, progress.points as u64);
        if self.0.is_hidden() {
            return;
        }
        self.0.tick();
        self.0.set_message(format!(
            "branch {}, {} points, at {:.9}",
            progress.branches.saturating_sub(1),
            progress.points,
            progress.value
        ));
    }

    fn share(&self, share: f64, message: impl FnOnce() -> String) {
        if !self.0.is_hidden() {
            self.0.set_position((TICKS * share) as u64);
            self.0.set_message(message());
        }
    }

    pub(super) fn finish(&self) {
        self.0.finish_and_clear();
    }
}

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
        // Requested without a terminal: a few updates per second suffice for readers of the stream.
        ProgressDrawTarget::term_like_with_hz(Box::new(console::Term::stderr()), 2)
    };
    let style = ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("rate", |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            // A bar that cannot be drawn must not stop the command.
            let _ = write!(text, "{:.1} a second", state.per_sec());
        });
    ProgressBar::with_draw_target(Some(length), target).with_style(style)
}
