//! The periodic motion that a run has come to, of result files and of other candidates.

use super::detect::Found;
use crate::record::EventKind;
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

/// Of two successive periods found in samples, by which share they may differ.
const SAME: f64 = 1e-4;

impl Attractor {
    /// What a result file of trains says of itself; `None` where its motion does not repeat itself.
    pub(super) fn of_file(file: &ResultFile) -> Result<Option<Attractor>, ResultError> {
        let Some(table) = file.stick_slip()? else {
            return Ok(None);
        };
        let number = |name: &str| {
            let found = table.extras.iter().find(|extra| extra.name == name);
            found.map(|extra| extra.value).filter(|value| value.is_finite())
        };
        Ok(number("attractor_period").map(|period| Attractor {
            period,
            sticks: number("attractor_sticks").unwrap_or(0.0) as u64,
            amplitude: number("attractor_amplitude"),
        }))
    }

    /// Of events alone: the shortest repetition of kinds and intervals, twice in a row at the end; with where its last period
    /// begins (s).
    pub(super) fn of_events(events: &[Found]) -> Option<(Attractor, f64)> {
        let sections: Vec<usize> = (0..events.len())
            .filter(|&k| matches!(events[k].kind, EventKind::Slip | EventKind::Reversal))
            .collect();
        let last = sections.len().checked_sub(1)?;
        (1..=LONGEST.min(last / 2)).find_map(|count| {
            let at = |back: usize| sections[last - back];
            let (a, b, c) = (at(2 * count), at(count), at(0));
            let kinds = |from: usize, to: usize| events[from..to].iter().map(|event| event.kind);
            if !kinds(a, b).eq(kinds(b, c)) {
                return None;
            }
            let period = events[c].time - events[b].time;
            let same = |k: usize| {
                let (now, before) = (events[b + k].time - events[b].time, events[a + k].time - events[a].time);
                (now - before).abs() <= SAME * period
            };
            if period <= 0.0 || !(1..=c - b).all(same) {
                return None;
            }
            let sticks = kinds(b, c).filter(|&kind| kind == EventKind::Stick).count() as u64;
            let attractor = Attractor {
                period,
                sticks,
                amplitude: None,
            };
            Some((attractor, events[b].time))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_a_word_that_repeats_has_a_period() {
        let word: Vec<Found> = (0..5)
            .flat_map(|k| {
                let t = 3.0 * f64::from(k);
                [
                    Found::new(t, EventKind::Slip),
                    Found::new(t + 1.0, EventKind::Reversal),
                    Found::new(t + 2.0, EventKind::Stick),
                ]
            })
            .collect();
        let (attractor, from) = Attractor::of_events(&word).unwrap();
        assert_eq!((attractor.period, attractor.sticks, from), (3.0, 1, 10.0));
        assert!(Attractor::of_events(&word[..6]).is_none());
    }
}
