//! Sample times.

use super::options::{Around, OutputOptions};
use std::collections::VecDeque;
use stickslip_system::numerics::bisection::bisect;
use stickslip_system::record::{Event, EventKind};

/// Sample times of a run in order, each once: multiples of the interval outside the windows, from + k interval inside
/// them, and the end time.
#[derive(Debug, Clone)]
pub struct SampleTimes {
    /// End of the run, s.
    pub end_time: f64,
    /// Disjoint stretches in order: (from, to, interval, origin) in s. Samples are at origin + k interval in [from,
    /// to).
    stretches: Vec<(f64, f64, f64, f64)>,
    stretch: usize,
    count: f64,
    /// Next time, s.
    pub next: f64,
}

impl SampleTimes {
    /// Times for `output`, from t = 0.
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
            // Among overlapping windows the densest counts.
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

    /// Skips the times before `t` (s).
    pub fn begin_at(&mut self, t: f64) {
        while self.next < t {
            self.advance();
        }
    }

    /// Advances to the next time.
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
                // A sample that is by rounding just before the end of its stretch is the first sample of the next
                // stretch.
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

const MOST_AROUND: usize = 300_000;

/// Number of samples between two events that are close together; such a stretch has its own interval.
const BETWEEN: f64 = 20.0;

/// Smallest distance of a sample around an event from the last sample, in intervals.
const APART: f64 = 1e-3;

/// Sample times around events: multiples of an interval, from a margin before a predicted event to a margin after it.
/// A short stretch between two predicted events has enough samples for a curve.
#[derive(Debug, Clone)]
pub(super) struct TimesAround {
    around: Around,
    margin: f64,
    interval: f64,
    end_time: f64,
    wanted: VecDeque<(f64, f64)>,
    /// Stretches between two predicted events that are shorter than [`BETWEEN`] intervals, in order of time.
    short: VecDeque<(f64, f64)>,
    /// Time span without samples, because there would be too many, s.
    left_out: Option<(f64, f64)>,
    /// Next time, s; infinite if there is none.
    pub next: f64,
    left: usize,
    sticks: usize,
}

impl TimesAround {
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
                // Rounding must not merge the samples.
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
        // Stretches around predicted events may lie after this one.
        let at = self.wanted.partition_point(|stretch| stretch.1 < from);
        while let Some(&next) = self.wanted.get(at).filter(|next| next.0 <= to) {
            (from, to) = (from.min(next.0), to.max(next.1));
            self.wanted.remove(at);
        }
        self.wanted.insert(at, (from, to));
        true
    }

    fn count(&self, until: f64) -> f64 {
        let before = |&(from, to): &(f64, f64)| (until.min(to) - from).max(0.0);
        let wide = self.wanted.iter().map(|stretch| before(stretch) / self.interval);
        let short = self
            .short
            .iter()
            .map(|stretch| before(stretch) / (stretch.1 - stretch.0) * BETWEEN);
        wide.chain(short).sum()
    }

    /// Limits the samples around predicted events: half of the limit are the first samples, half are the last. A
    /// motion that becomes periodic is then seen at its beginning and in its final form.
    fn limit(&mut self) {
        let (all, most) = (self.count(self.end_time), MOST_AROUND as f64);
        if all <= most {
            return;
        }
        let time_of = |count: f64| bisect(0.0, self.end_time, 60, |time| self.count(time) < count).0;
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

    pub(super) fn event(&mut self, t: f64, kind: EventKind) {
        self.take(t, kind, 0.0);
        self.settle(t);
    }

    pub(super) fn taken(&mut self, t: f64) {
        if t == self.next {
            self.left -= 1;
            // There are more samples than predicted, by rounding or by events at other times.
            if self.left == 0 && self.left_out.is_none_or(|span| t < span.0) {
                log::warn!(
                    "there are no more dense samples around events after {t:?} s and {MOST_AROUND} of them: set output.margin or \
                     output.samples_per_period lower to have them later in the run"
                );
            }
        }
        self.settle(t);
    }

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
