//! Stick-slip statistics from the event sequence.

use crate::record::{Cycle, CycleStatistics, Event, EventKind};

/// The stick-slip of a run. The final stick has no duration, so there is one cycle fewer than there are sticks.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StickSlip {
    /// In order of time.
    pub cycles: Vec<Cycle>,
    /// Time of the first stick, s.
    pub onset_time: Option<f64>,
    /// Time of the last stick, s, if the run ends in it.
    pub final_stick_time: Option<f64>,
    /// Sticks that began.
    pub stick_count: usize,
    /// Breakaways from stick.
    pub slip_count: usize,
}

impl StickSlip {
    /// From all events of a run, in order.
    pub fn from_events(events: &[Event]) -> Self {
        let in_word = events.iter().filter(|e| e.kind.in_event_sequence());
        StickSlip::from_word(in_word.map(|e| (e.time, e.kind)))
    }

    /// From the times (s) and kinds of the event sequence alone.
    pub(crate) fn from_word(word: impl IntoIterator<Item = (f64, EventKind)>) -> Self {
        let mut statistics = CycleStatistics::default();
        let word = word.into_iter();
        let cycles = word.filter_map(|(time, kind)| statistics.push(time, kind)).collect();
        StickSlip {
            cycles,
            onset_time: statistics.onset_time,
            final_stick_time: statistics.final_stick_time,
            stick_count: statistics.stick_count,
            slip_count: statistics.slip_count,
        }
    }

    /// T_i, s: the first period.
    pub fn first_period(&self) -> Option<f64> {
        self.cycles.first().map(|c| c.period)
    }

    /// T_f, s: the last period.
    pub fn last_period(&self) -> Option<f64> {
        self.cycles.last().map(|c| c.period)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Mode;
    use crate::record::State;

    fn event(time: f64, kind: EventKind, mode_after: Mode) -> Event {
        let (before, after) = (State::default(), State::default());
        Event {
            time,
            kind,
            mode_after,
            segment: 0,
            before,
            after,
            internal_force: 0.0,
        }
    }

    #[test]
    fn analytic_cycles_of_a_short_sequence() {
        let stick = |t| event(t, EventKind::Stick, Mode::Stick);
        let slip = |t| event(t, EventKind::Slip, Mode::SlipForward);
        let kick = event(0.5, EventKind::Kick, Mode::SlipForward);
        let s = StickSlip::from_events(&[kick, stick(1.0), slip(1.25), stick(2.0), slip(2.5), stick(4.0)]);
        assert_eq!((s.stick_count, s.slip_count, s.cycles.len()), (3, 2, 2));
        assert_eq!((s.onset_time, s.final_stick_time), (Some(1.0), Some(4.0)));
        assert_eq!(
            s.cycles[1],
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
        let s = StickSlip::from_events(&[
            event(1.0, EventKind::Stick, Mode::Stick),
            event(2.0, EventKind::Separation, Mode::Separated),
        ]);
        assert_eq!((s.stick_count, s.cycles.len(), s.final_stick_time), (1, 0, None));
    }
}
