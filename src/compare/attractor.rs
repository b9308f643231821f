//! The periodic motion that a run has come to, of result files and of other candidates.

use crate::record::EventKind;
use crate::record::sequence::SequenceEvent;
use crate::results::{ResultError, ResultFile};
use serde::Serialize;

/// A periodic motion in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Attractor {
    /// s.
    pub period: f64,
    /// Sticks that begin in a period.
    pub sticks: u64,
    /// Half of the range of the position over a period, rad (m in translation); `None` where there is none or it is not known.
    pub amplitude: Option<f64>,
}

/// The most breakaways and reversals in a period that are looked for.
const LONGEST: usize = 64;

/// Largest relative difference between two successive periods.
const SAME: f64 = 1e-4;

impl Attractor {
    /// What a result file says of itself; `None` where its motion does not repeat itself.
    pub(super) fn of_file(file: &ResultFile) -> Result<Option<Attractor>, ResultError> {
        let Some(table) = file.stick_slip()? else {
            return Ok(None);
        };
        let number = |name: &str| table.value(name).filter(|value| value.is_finite());
        Ok(number("attractor_period").map(|period| Attractor {
            period,
            sticks: number("attractor_sticks").unwrap_or(0.0) as u64,
            amplitude: number("attractor_amplitude"),
        }))
    }

    /// Of events alone: the shortest repetition of kinds and intervals, twice in a row at the end; with where its last period
    /// begins (s). Times are known to `slack` (s).
    ///
    /// Events do not tell which way a contact slips, so a motion that is the same either way repeats itself twice in a period.
    /// `reference`, a word with its own period (s), says so: where the candidate has as many sections in a repetition, its
    /// period has as many repetitions.
    pub(super) fn of_events(
        events: &[SequenceEvent],
        slack: f64,
        reference: Option<(&[SequenceEvent], f64)>,
    ) -> Option<(Attractor, f64)> {
        let sections = sections(events);
        let mut count = repetition(events, &sections, slack, None)?;
        if let Some((word, period)) = reference {
            let places = self::sections(word);
            let alone = repetition(word, &places, 0.0, None);
            let end = places.last().map_or(0.0, |&k| word[k].time);
            let whole = places
                .iter()
                .filter(|&&k| word[k].time > end - (1.0 - 1e-3) * period)
                .count();
            if alone == Some(count) && whole > count && repetition(events, &sections, slack, Some(whole)).is_some() {
                count = whole;
            }
        }
        let last = sections.len() - 1;
        let (b, c) = (sections[last - count], sections[last]);
        let sticks = events[b..c].iter().filter(|event| event.kind == EventKind::Stick);
        let attractor = Attractor {
            period: events[c].time - events[b].time,
            sticks: sticks.count() as u64,
            amplitude: None,
        };
        Some((attractor, events[b].time))
    }
}

/// Breakaways and reversals.
fn sections(events: &[SequenceEvent]) -> Vec<usize> {
    let is_section = |&k: &usize| matches!(events[k].kind, EventKind::Slip | EventKind::Reversal);
    (0..events.len()).filter(is_section).collect()
}

/// The fewest sections, or `only` so many, after which kinds and intervals come again.
fn repetition(events: &[SequenceEvent], sections: &[usize], slack: f64, only: Option<usize>) -> Option<usize> {
    let last = sections.len().checked_sub(1)?;
    let mut counts = 1..=LONGEST.min(last / 2);
    counts.find(|&count| {
        let at = |back: usize| sections[last - back];
        let (a, b, c) = (at(2 * count), at(count), at(0));
        let kinds = |from: usize, to: usize| events[from..to].iter().map(|event| event.kind);
        if only.is_some_and(|only| only != count) || !kinds(a, b).eq(kinds(b, c)) {
            return false;
        }
        let period = events[c].time - events[b].time;
        let same = |k: usize| {
            let (now, before) = (events[b + k].time - events[b].time, events[a + k].time - events[a].time);
            (now - before).abs() <= (SAME * period).max(slack)
        };
        period > 0.0 && (1..=c - b).all(same)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_word_that_repeats_has_a_period() {
        let word = cycles(
            5,
            &[
                (0.0, EventKind::Slip),
                (1.0, EventKind::Reversal),
                (2.0, EventKind::Stick),
            ],
            3.0,
        );
        let (attractor, from) = Attractor::of_events(&word, 0.0, None).unwrap();
        assert_eq!((attractor.period, attractor.sticks, from), (3.0, 1, 10.0));
        assert!(Attractor::of_events(&word[..6], 0.0, None).is_none());
    }

    fn cycles(count: u32, events: &[(f64, EventKind)], period: f64) -> Vec<SequenceEvent> {
        let cycle = |k: u32| {
            let event = move |&(time, kind): &(f64, EventKind)| SequenceEvent {
                time: period * f64::from(k) + time,
                kind,
            };
            events.iter().map(event).collect::<Vec<_>>()
        };
        (0..count).flat_map(cycle).collect()
    }

    /// There and back by the same kinds in the same times.
    #[test]
    fn analytic_a_motion_that_is_the_same_either_way_has_the_period_of_its_reference() {
        let word = cycles(12, &[(0.0, EventKind::Slip), (1.0, EventKind::Stick)], 3.0);
        let (attractor, _) = Attractor::of_events(&word, 0.0, Some((&word, 6.0))).unwrap();
        assert_eq!((attractor.period, attractor.sticks), (6.0, 2));
        // One that is not the same either way has its own.
        let slant = [
            (0.0, EventKind::Slip),
            (1.0, EventKind::Stick),
            (3.1, EventKind::Slip),
            (4.0, EventKind::Stick),
        ];
        let slant = cycles(6, &slant, 6.0);
        let (attractor, _) = Attractor::of_events(&slant, 0.0, Some((&word, 6.0))).unwrap();
        assert_eq!((attractor.period, attractor.sticks), (6.0, 2));
        let (attractor, _) = Attractor::of_events(&word, 0.0, Some((&slant, 6.0))).unwrap();
        assert_eq!((attractor.period, attractor.sticks), (3.0, 1));
    }

    /// Times that are known to the interval of the samples.
    #[test]
    fn analytic_a_period_of_samples_is_no_multiple_of_itself() {
        let mut word = cycles(12, &[(0.0, EventKind::Slip), (0.2, EventKind::Stick)], 0.67);
        for (k, event) in word.iter_mut().enumerate() {
            // To and fro by half of an interval of 2 ms.
            event.time += 1e-3 * (1.7 * k as f64).sin();
        }
        assert!(Attractor::of_events(&word, 0.0, None).is_none());
        let (attractor, _) = Attractor::of_events(&word, 4e-3, None).unwrap();
        assert!((attractor.period - 0.67).abs() < 2e-3 && attractor.sticks == 1);
    }
}
