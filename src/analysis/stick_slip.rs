//! Stick-slip statistics from the event sequence.

use crate::simulation::{Event, EventKind};

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

/// The stick-slip of a run. The final stick has no duration, so there is one cycle fewer than there are sticks.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StickSlip {
    pub cycles: Vec<Cycle>,
    /// Time of the first stick, s.
    pub onset_time: Option<f64>,
    /// Time of the last stick, s, if the run ends in it.
    pub final_stick_time: Option<f64>,
    pub stick_count: usize,
    /// Breakaways from stick.
    pub slip_count: usize,
}

impl StickSlip {
    /// From all events of a run, in order.
    pub fn from_events(events: &[Event]) -> Self {
        let in_word = events.iter().filter(|e| e.kind.in_mode_word());
        StickSlip::from_word(in_word.map(|e| (e.time, e.kind)))
    }

    /// From the times (s) and kinds of the event sequence alone.
    pub fn from_word(word: impl IntoIterator<Item = (f64, EventKind)>) -> Self {
        let mut last = None;
        let mut result = StickSlip::default();
        // (time of the stick that is open, time of the event that ended it)
        let mut open: Option<(f64, Option<f64>)> = None;
        for (time, kind) in word {
            match (kind, &mut open) {
                (EventKind::Stick, current) => {
                    if let Some((stick, Some(end))) = *current {
                        result.cycles.push(Cycle {
                            stick_duration: end - stick,
                            slip_duration: time - end,
                            period: time - stick,
                        });
                    }
                    *current = Some((time, None));
                    result.onset_time.get_or_insert(time);
                    result.stick_count += 1;
                }
                (_, Some((_, end @ None))) => *end = Some(time),
                _ => {}
            }
            result.slip_count += usize::from(kind == EventKind::Slip);
            last = Some((time, kind));
        }
        result.final_stick_time = last.filter(|l| l.1 == EventKind::Stick).map(|l| l.0);
        result
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
    use crate::simulation::State;

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
