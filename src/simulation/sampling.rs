//! When samples are due.

use super::options::{Around, OutputOptions};
use crate::record::{Event, EventKind};
use std::collections::VecDeque;

/// The sample times of a run in order, each once: multiples of the interval outside the windows, from + k interval
/// inside them, and the end.
#[derive(Debug, Clone)]
pub(crate) struct SampleTimes {
    /// The end of the run, s.
    pub end_time: f64,
    /// Disjoint stretches in order: (from, to, interval, origin); samples at origin + k interval in [from, to).
    stretches: Vec<(f64, f64, f64, f64)>,
    stretch: usize,
    count: f64,
    /// The time that is due, s.
    pub next: f64,
}

impl SampleTimes {
    pub fn new(output: &OutputOptions) -> Self {
        let end_time = output.end_time;
        let mut cuts: Vec<f64> = vec![0.0, end_time];
        for w in &output.windows {
            cuts.extend([w.from, w.to].into_iter().filter(|t| (0.0..end_time).contains(t)));
        }
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        let mut stretches: Vec<(f64, f64, f64, f64)> = Vec::new();
        for pair in cuts.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            // Where windows overlap the densest holds.
            let window = output
                .windows
                .iter()
                .filter(|w| w.from <= from && to <= w.to)
                .min_by(|a, b| a.interval.total_cmp(&b.interval));
            let (interval, origin) = window.map_or((output.interval, 0.0), |w| (w.interval, w.from));
            match stretches.last_mut() {
                Some(last) if last.2 == interval && last.3 == origin => last.1 = to,
                _ => stretches.push((from, to, interval, origin)),
            }
        }
        let mut times = SampleTimes {
            end_time,
            stretches,
            stretch: 0,
            count: 0.0,
            next: 0.0,
        };
        times.enter();
        times
    }

    /// Leaves out those before `t` (s).
    pub fn begin_at(&mut self, t: f64) {
        while self.next < t {
            self.advance();
        }
    }

    /// Moves on to the one after it.
    pub fn advance(&mut self) {
        if self.stretch >= self.stretches.len() {
            self.next = f64::INFINITY;
            return;
        }
        self.count += 1.0;
        self.settle();
    }

    fn enter(&mut self) {
        if let Some(&(from, _, interval, origin)) = self.stretches.get(self.stretch) {
            self.count = ((from - origin) / interval - 1e-9).ceil();
        }
        self.settle();
    }

    fn settle(&mut self) {
        match self.stretches.get(self.stretch) {
            None => self.next = self.end_time,
            Some(&(from, to, interval, origin)) => {
                let t = origin + self.count * interval;
                // A sample that rounding puts a hair before the end of its stretch is the next stretch's first.
                if t < to - 1e-9 * interval.min(to - from) {
                    self.next = t.max(from);
                } else {
                    self.stretch += 1;
                    self.enter();
                }
            }
        }
    }
}

/// Samples around events that a file has at most.
const MOST_AROUND: usize = 300_000;

/// Samples in a stretch between two events: a shorter one has its own interval.
const BETWEEN: f64 = 20.0;

/// A sample around an event that is nearer to the last one than this part of their interval is left out.
const APART: f64 = 1e-3;

/// The sample times around events: multiples of an interval, from a margin before an event, as far as it is foreseen, to a margin
/// after it; and in a short stretch between two foreseen events as many as make a curve of it.
#[derive(Debug, Clone)]
pub(super) struct TimesAround {
    around: Around,
    margin: f64,
    interval: f64,
    end_time: f64,
    /// Disjoint, in order of time.
    wanted: VecDeque<(f64, f64)>,
    /// Stretches between two foreseen events that are shorter than [`BETWEEN`] intervals, in order of time.
    short: VecDeque<(f64, f64)>,
    /// Where there are none, because there would be too many in all, s.
    left_out: Option<(f64, f64)>,
    /// The time that is due, s; infinite if none is.
    pub next: f64,
    left: usize,
    sticks: usize,
}

impl TimesAround {
    /// Of a run that is expected to have these events; `period` is the natural period, s. `None` where none are wanted.
    pub(super) fn new(output: &OutputOptions, period: f64, foreseen: &[Event]) -> Option<TimesAround> {
        let (margin, interval) = output.follow.sampling(period);
        let mut times = TimesAround {
            around: output.follow.around?,
            margin,
            interval,
            end_time: output.end_time,
            wanted: VecDeque::new(),
            short: VecDeque::new(),
            left_out: None,
            next: f64::INFINITY,
            left: MOST_AROUND,
            sticks: 0,
        };
        let mut before = 0.0;
        for event in foreseen {
            if times.take(event.time, event.kind, margin) {
                let length = event.time - before;
                // Rounding has to tell its samples apart.
                if length < BETWEEN * interval && length > 1e-12 * event.time {
                    times.short.push_back((before, event.time));
                }
                before = event.time;
            }
        }
        times.sticks = 0;
        times.limit();
        times.settle(f64::NEG_INFINITY);
        Some(times)
    }

    /// Whether the event is meant.
    fn take(&mut self, t: f64, kind: EventKind, before: f64) -> bool {
        let taken = self.around.takes(kind, self.sticks);
        self.sticks += usize::from(kind == EventKind::Stick);
        if !taken || self.left_out.is_some_and(|(from, to)| t > from && t < to) {
            return taken;
        }
        let (mut from, mut to) = ((t - before).max(0.0), (t + self.margin).min(self.end_time));
        if let Some(stop) = self.left_out.map(|span| span.0).filter(|&stop| t <= stop) {
            to = to.min(stop);
        }
        // Foreseen stretches may lie after it.
        let at = self.wanted.partition_point(|stretch| stretch.1 < from);
        while let Some(&next) = self.wanted.get(at).filter(|next| next.0 <= to) {
            (from, to) = (from.min(next.0), to.max(next.1));
            self.wanted.remove(at);
        }
        self.wanted.insert(at, (from, to));
        true
    }

    /// Samples up to a time, s.
    fn count(&self, until: f64) -> f64 {
        let before = |&(from, to): &(f64, f64)| (until.min(to) - from).max(0.0);
        let wide = self.wanted.iter().map(|stretch| before(stretch) / self.interval);
        let short = self
            .short
            .iter()
            .map(|stretch| before(stretch) / (stretch.1 - stretch.0) * BETWEEN);
        wide.chain(short).sum()
    }

    /// Of too many foreseen ones, half of those that a file may have are the first, and half are the last: a motion that comes to
    /// repeat itself is seen as it begins and as it is then.
    fn limit(&mut self) {
        let (all, most) = (self.count(self.end_time), MOST_AROUND as f64);
        if all <= most {
            return;
        }
        let time_of = |count: f64| {
            let (mut low, mut high) = (0.0, self.end_time);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if self.count(middle) < count {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            low
        };
        let (from, to) = (time_of(0.5 * most), time_of(all - 0.5 * most));
        log::warn!(
            "a file has {MOST_AROUND} samples around events at most, and this run would have {all:.0}: there are none from {from:.6} \
             to {to:.6} s; set output.margin or output.samples_per_period lower to have them there"
        );
        let outside = self
            .wanted
            .iter()
            .flat_map(|&(a, b)| [(a, b.min(from)), (a.max(to), b)]);
        self.wanted = outside.filter(|part| part.0 < part.1).collect();
        self.short.retain(|stretch| stretch.1 <= from || stretch.0 >= to);
        self.left_out = Some((from, to));
    }

    /// An event has come, s: foreseen or not, it has samples after it.
    pub(super) fn event(&mut self, t: f64, kind: EventKind) {
        self.take(t, kind, 0.0);
        self.settle(t);
    }

    /// A sample has been taken at `t` (s), whatever for.
    pub(super) fn taken(&mut self, t: f64) {
        if t == self.next {
            self.left -= 1;
            // More than foreseen, by a few of rounding or by many of events at other times.
            if self.left == 0 && self.left_out.is_none_or(|span| t < span.0) {
                log::warn!(
                    "there are no more dense samples around events after {t:?} s and {MOST_AROUND} of them: set output.margin or \
                     output.samples_per_period lower to have them later in the run"
                );
            }
        }
        self.settle(t);
    }

    /// Finds the time after `last`.
    fn settle(&mut self, last: f64) {
        self.next = f64::INFINITY;
        if self.left == 0 {
            return;
        }
        while let Some(&(from, to)) = self.wanted.front() {
            let mut count = (from / self.interval).ceil();
            if last >= from {
                count = count.max((last / self.interval + APART).ceil());
            }
            let mut t = count * self.interval;
            if t - last < APART * self.interval {
                t = (count + 1.0) * self.interval;
            }
            if t < to && t > last {
                self.next = t;
                break;
            }
            self.wanted.pop_front();
        }
        while let Some(&(from, to)) = self.short.front() {
            let interval = (to - from) / BETWEEN;
            let count = ((last - from) / interval + APART).floor().max(0.0) + 1.0;
            let t = from + count * interval;
            if count < BETWEEN && t > last {
                self.next = self.next.min(t);
                return;
            }
            self.short.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::{Following, OutputWindow};

    fn all(output: &OutputOptions) -> Vec<f64> {
        let mut times = SampleTimes::new(output);
        let mut list = Vec::new();
        while times.next.is_finite() {
            list.push(times.next);
            times.advance();
        }
        list
    }

    #[test]
    fn analytic_windows_are_denser_and_nothing_is_doubled() {
        let windows = vec![OutputWindow {
            from: 0.25,
            to: 0.5,
            interval: 0.125,
        }];
        let list = all(&OutputOptions {
            end_time: 1.0,
            interval: 0.25,
            windows,
            steps: false,
            follow: Following::default(),
        });
        assert_eq!(list, [0.0, 0.25, 0.375, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn analytic_times_increase_strictly_and_end_at_the_end() {
        let windows = vec![
            OutputWindow {
                from: 0.31,
                to: 0.62,
                interval: 0.01,
            },
            OutputWindow {
                from: 0.5,
                to: 0.9,
                interval: 0.003,
            },
        ];
        let list = all(&OutputOptions {
            end_time: 1.05,
            interval: 0.1,
            windows,
            steps: false,
            follow: Following::default(),
        });
        assert!(list.windows(2).all(|p| p[0] < p[1]));
        assert_eq!(list.first(), Some(&0.0));
        assert_eq!(list.last(), Some(&1.05));
    }
}
