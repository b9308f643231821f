//! The periodic motion that a run has come to, of result files and of other candidates.

use super::candidate::Block;
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

/// The range of one column over a stretch of time, between samples by parabolas.
#[derive(Debug)]
pub(super) struct Range {
    from: f64,
    to: f64,
    recent: [Option<(f64, f64)>; 2],
    extremes: Option<(f64, f64)>,
}

impl Range {
    /// Over a stretch (s).
    pub fn new(from: f64, to: f64) -> Range {
        Range {
            from,
            to,
            recent: [None; 2],
            extremes: None,
        }
    }

    /// Takes the next samples.
    pub fn add(&mut self, block: &Block, column: usize) {
        let first = block.time.partition_point(|t| *t < self.from);
        for (&t, &x) in block.time[first..].iter().zip(&block.columns[column][first..]) {
            if t > self.to {
                break;
            }
            self.take(x);
            if let [Some(b), Some(a)] = self.recent
                && (b.1 - a.1) * (x - b.1) < 0.0
            {
                self.take(vertex(a, b, (t, x)));
            }
            self.recent = [Some((t, x)), self.recent[0]];
        }
    }

    fn take(&mut self, x: f64) {
        let (low, high) = self.extremes.unwrap_or((x, x));
        self.extremes = Some((low.min(x), high.max(x)));
    }

    /// Half of it.
    pub fn amplitude(&self) -> Option<f64> {
        self.extremes.map(|(low, high)| (high - low) / 2.0)
    }
}

/// The extreme of the parabola through three points.
fn vertex(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> f64 {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (c.0 - a.0);
    let slope = left + bend * (b.0 - a.0);
    b.1 - slope * slope / (4.0 * bend)
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

    #[test]
    fn analytic_extremes_between_samples_are_those_of_parabolas() {
        let block = Block {
            time: (0..20).map(f64::from).collect(),
            columns: vec![(0..20).map(|k| 1.0 - (f64::from(k) - 7.3).powi(2)).collect()],
        };
        let mut range = Range::new(2.0, 11.0);
        range.add(&block, 0);
        let (low, high) = range.extremes.unwrap();
        assert!((high - 1.0).abs() < 1e-12 && (low - (1.0 - 5.3f64.powi(2))).abs() < 1e-12);
    }
}
