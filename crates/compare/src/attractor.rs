//! Periodic motions (attractors) at the end of result files and of other candidates.

use serde::Serialize;
use stickslip_files::{ResultError, ResultFile};
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::SequenceEvent;

/// A periodic motion in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ComparedAttractor {
    /// s.
    pub period: f64,
    /// Sticks that begin in a period.
    pub sticks: u64,
    /// Half the range of the position over a period, rad (m in translation); `None` if unknown.
    pub amplitude: Option<f64>,
}

const LONGEST: usize = 64;

/// Largest relative difference between two successive periods.
const SAME: f64 = 1e-4;

impl ComparedAttractor {
    pub(super) fn of_file(file: &ResultFile) -> Result<Option<ComparedAttractor>, ResultError> {
        let Some(table) = file.stick_slip()? else {
            return Ok(None);
        };
        let number = |name: &str| table.value(name).filter(|value| value.is_finite());
        Ok(number("attractor_period").map(|period| ComparedAttractor {
            period,
            sticks: number("attractor_sticks").unwrap_or(0.0) as u64,
            amplitude: number("attractor_amplitude"),
        }))
    }

    /// The shortest repetition of kinds and intervals that occurs twice in a row at the end of `events`, and the start
    /// of its last period (s). `slack`: uncertainty of the times, s.
    ///
    /// Events do not tell which way a contact slips, so a motion that is symmetric in both directions repeats twice in
    /// a period. `reference`, a word with its period (s), resolves this: if its repetition has as many sections as the
    /// candidate's, a period of the candidate has as many repetitions as one of the reference.
    pub fn of_events(
        events: &[SequenceEvent],
        slack: f64,
        reference: Option<(&[SequenceEvent], f64)>,
    ) -> Option<(ComparedAttractor, f64)> {
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
        let attractor = ComparedAttractor {
            period: events[c].time - events[b].time,
            sticks: sticks.count() as u64,
            amplitude: None,
        };
        Some((attractor, events[b].time))
    }
}

fn sections(events: &[SequenceEvent]) -> Vec<usize> {
    let is_section = |&k: &usize| matches!(events[k].kind, EventKind::Slip | EventKind::Reversal);
    (0..events.len()).filter(is_section).collect()
}

/// Smallest number of sections after which kinds and intervals repeat; restricted to `only` if given.
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
