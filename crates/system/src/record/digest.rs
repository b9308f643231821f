//! The events of a run in bounded memory: counts, cycles, and the first and last of them.

use super::rows::{Event, EventKind};

/// Stick k and the slip after it; period k is from stick k to stick k+1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// Duration of the stick, s.
    pub stick_duration: f64,
    /// Duration of the slip, s.
    pub slip_duration: f64,
    /// Period, s.
    pub period: f64,
}

/// Statistics of the cycles, updated event by event.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CycleStatistics {
    /// Time of the first stick, s.
    pub onset_time: Option<f64>,
    /// Time of the last stick, s, unless another event of the sequence follows.
    pub final_stick_time: Option<f64>,
    /// Number of sticks.
    pub stick_count: usize,
    /// Breakaways from stick.
    pub slip_count: usize,
    /// Events of each kind, in the order of [`EventKind::ALL`].
    pub counts: [usize; EventKind::ALL.len()],
    /// The first cycle.
    pub first: Option<Cycle>,
    /// The last cycle.
    pub last: Option<Cycle>,
    /// Shortest and longest stick of the cycles, s.
    pub stick_range: Option<(f64, f64)>,
    /// Shortest and longest slip of the cycles, s.
    pub slip_range: Option<(f64, f64)>,
    /// Time of the open stick, and of the event that ended it.
    open: Option<(f64, Option<f64>)>,
}

impl CycleStatistics {
    /// From the times (s) and kinds of all events of a run, in order. Also returns the cycles: one less than sticks,
    /// since the final stick has no duration.
    pub fn of_events(events: impl IntoIterator<Item = (f64, EventKind)>) -> (CycleStatistics, Vec<Cycle>) {
        let mut statistics = CycleStatistics::default();
        let events = events.into_iter();
        let cycles = events.filter_map(|(time, kind)| statistics.push(time, kind)).collect();
        (statistics, cycles)
    }

    /// Adds the next event, by time (s) and kind; returns the cycle that it completes.
    pub fn push(&mut self, time: f64, kind: EventKind) -> Option<Cycle> {
        self.counts[kind as usize] += 1;
        if !kind.in_event_sequence() {
            return None;
        }
        let stick = kind == EventKind::Stick;
        self.final_stick_time = stick.then_some(time);
        self.slip_count += usize::from(kind == EventKind::Slip);
        if !stick {
            if let Some((_, end @ None)) = &mut self.open {
                *end = Some(time);
            }
            return None;
        }
        self.onset_time.get_or_insert(time);
        self.stick_count += 1;
        let Some((start, Some(end))) = self.open.replace((time, None)) else {
            return None;
        };
        let cycle = Cycle {
            stick_duration: end - start,
            slip_duration: time - end,
            period: time - start,
        };
        self.first.get_or_insert(cycle);
        self.last = Some(cycle);
        self.stick_range = widened(self.stick_range, cycle.stick_duration);
        self.slip_range = widened(self.slip_range, cycle.slip_duration);
        Some(cycle)
    }

    /// Number of events of these kinds.
    pub fn count(&self, kinds: &[EventKind]) -> usize {
        kinds.iter().map(|&kind| self.counts[kind as usize]).sum()
    }

    /// T_i, s: the first period.
    pub fn first_period(&self) -> Option<f64> {
        self.first.map(|c| c.period)
    }

    /// T_f, s: the last period.
    pub fn last_period(&self) -> Option<f64> {
        self.last.map(|c| c.period)
    }
}

fn widened(range: Option<(f64, f64)>, value: f64) -> Option<(f64, f64)> {
    Some(range.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
}

/// Digest of a run's events: their number, the cycles, and the data for the growth of a perturbation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventDigest {
    /// Number of all events.
    pub count: usize,
    /// Statistics of the stick-slip.
    pub cycles: CycleStatistics,
    /// Kicks before the first stick: at most as many as the case has.
    pub kicks: Vec<Event>,
    /// The loss of stability after which sliding stays unstable. The first one, unless stability returns for longer
    /// than the oscillation itself crosses the margin, as after a large kick.
    pub instability: Option<Event>,
    /// Last event before the instability with a zero or opposite relative velocity, s; negative infinity without one.
    pub last_turn: f64,
    /// A return of stability counts if it lasts longer than this, s.
    lasting: f64,
    stable_since: f64,
    /// Last events with a relative velocity that is not positive, and not negative, s.
    turned: (f64, f64),
}

impl EventDigest {
    /// A digest without events, for a run whose surfaces swing with this period (s); `None` for a run without
    /// instability.
    pub fn new(natural_period: Option<f64>) -> Self {
        EventDigest {
            lasting: 20.0 * natural_period.unwrap_or(0.0),
            last_turn: f64::NEG_INFINITY,
            stable_since: f64::NEG_INFINITY,
            turned: (f64::NEG_INFINITY, f64::NEG_INFINITY),
            ..EventDigest::default()
        }
    }

    /// Digest of a list of events, in order.
    pub fn of_events(natural_period: Option<f64>, events: &[Event]) -> Self {
        let mut digest = EventDigest::new(natural_period);
        for event in events {
            digest.push(event);
        }
        digest
    }

    /// Adds the next event; returns the cycle that it completes.
    pub fn push(&mut self, event: &Event) -> Option<Cycle> {
        self.count += 1;
        if self.cycles.onset_time.is_none() {
            self.before_first_stick(event);
        }
        self.cycles.push(event.time, event.kind)
    }

    fn before_first_stick(&mut self, event: &Event) {
        let w = event.before.relative_velocity;
        match event.kind {
            EventKind::Kick => self.kicks.push(*event),
            EventKind::Destabilised if self.instability.is_none() || event.time - self.stable_since > self.lasting => {
                self.instability = Some(*event);
                self.last_turn = if w > 0.0 { self.turned.0 } else { self.turned.1 };
            }
            EventKind::Restabilised => self.stable_since = event.time,
            _ => {}
        }
        if w <= 0.0 {
            self.turned.0 = event.time;
        }
        if w >= 0.0 {
            self.turned.1 = event.time;
        }
    }
}
