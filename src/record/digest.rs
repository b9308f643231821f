//! The events of a run in bounded memory, however many there are: counts, cycles and the first and last of them.

use super::rows::{Event, EventKind};

/// Stick k and the slip after it; period k is from stick k to stick k+1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycle {
    /// s.
    pub stick_duration: f64,
    /// s.
    pub slip_duration: f64,
    /// s.
    pub period: f64,
}

/// Statistics of the cycles, brought up to date event by event.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CycleStatistics {
    /// Time of the first stick, s.
    pub onset_time: Option<f64>,
    /// Time of the last stick, s, if nothing of the event sequence follows it.
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
    /// Time of the stick that is open, time of the event that ended it.
    open: Option<(f64, Option<f64>)>,
}

impl CycleStatistics {
    /// Of the times (s) and kinds of all events of a run, in order; with the cycles, of which there is one fewer than sticks: the
    /// final stick has no duration.
    pub fn of_events(events: impl IntoIterator<Item = (f64, EventKind)>) -> (CycleStatistics, Vec<Cycle>) {
        let mut statistics = CycleStatistics::default();
        let events = events.into_iter();
        let cycles = events.filter_map(|(time, kind)| statistics.push(time, kind)).collect();
        (statistics, cycles)
    }

    /// Takes the next event, by time (s) and kind; returns the cycle that it completes.
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

    /// Events of some kinds together.
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

/// The events of a run, digested: their number, the cycles, and what the growth of a perturbation is computed from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventDigest {
    /// Events of every kind.
    pub count: usize,
    /// The stick-slip.
    pub cycles: CycleStatistics,
    /// Those before the first stick: at most as many as the case has.
    pub kicks: Vec<Event>,
    /// The loss of stability after which sliding stays unstable: the first, unless stability returns for longer than the
    /// oscillation itself takes it across the margin, as after a large kick.
    pub instability: Option<Event>,
    /// The last event before it that found the relative velocity zero or of the other sign, s; negative infinity if
    /// there is none.
    pub last_turn: f64,
    /// Stability that lasts longer than this has returned, s.
    lasting: f64,
    stable_since: f64,
    /// The last events that found the relative velocity not positive, and not negative, s.
    turned: (f64, f64),
}

impl EventDigest {
    /// Of a run whose surfaces swing with this period (s), and that has had no event yet; `None` of a run that has no instability to
    /// tell of.
    pub fn new(natural_period: Option<f64>) -> Self {
        EventDigest {
            lasting: 20.0 * natural_period.unwrap_or(0.0),
            last_turn: f64::NEG_INFINITY,
            stable_since: f64::NEG_INFINITY,
            turned: (f64::NEG_INFINITY, f64::NEG_INFINITY),
            ..EventDigest::default()
        }
    }

    /// Of events that are all at hand, in order.
    pub fn of_events(natural_period: Option<f64>, events: &[Event]) -> Self {
        let mut digest = EventDigest::new(natural_period);
        for event in events {
            digest.push(event);
        }
        digest
    }

    /// Takes the next event; returns the cycle that it completes.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_cycles_of_a_short_sequence() {
        let (stick, slip) = (|t| (t, EventKind::Stick), |t| (t, EventKind::Slip));
        let kick = (0.5, EventKind::Kick);
        let (s, cycles) = CycleStatistics::of_events([kick, stick(1.0), slip(1.25), stick(2.0), slip(2.5), stick(4.0)]);
        assert_eq!((s.stick_count, s.slip_count, cycles.len()), (3, 2, 2));
        assert_eq!((s.onset_time, s.final_stick_time), (Some(1.0), Some(4.0)));
        assert_eq!(
            cycles[1],
            Cycle {
                stick_duration: 0.5,
                slip_duration: 1.5,
                period: 2.0
            }
        );
        assert_eq!((s.first_period(), s.last_period()), (Some(1.0), Some(2.0)));
    }

    #[test]
    fn analytic_a_run_that_ends_slipping_has_no_final_stick() {
        let (s, cycles) = CycleStatistics::of_events([(1.0, EventKind::Stick), (2.0, EventKind::Separation)]);
        assert_eq!((s.stick_count, cycles.len(), s.final_stick_time), (1, 0, None));
    }
}
