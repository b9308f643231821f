//! Columns that are moving averages.

use super::evidence::Evidence;
use super::judge::ALL;
use super::motion::Played;
use super::observation::ObservedValues;
use super::rows::EvenRows;
use super::search::Search;
use super::{Cause, Proposal, rows};
use crate::diagnosis::CauseKind;
use std::sync::Arc;

/// Most samples of a moving average.
const MOST: usize = 256;

/// The mean of `count` samples, of which the sample is the last, or the middle one if it is `centred`.
#[derive(Debug)]
pub(crate) struct MovingAverage {
    count: usize,
    centred: bool,
    /// The channels that are averaged.
    which: Vec<bool>,
}

/// Sums of the rows of a channel up to each row, from the first row that is known.
struct Sums {
    known: usize,
    sums: Vec<f64>,
}

impl Sums {
    fn of(values: &[f64]) -> Sums {
        let known = values
            .iter()
            .position(|value| value.is_finite())
            .unwrap_or(values.len());
        let sums = values[known..].iter().scan(0.0, |sum, value| {
            *sum += value;
            Some(*sum)
        });
        let sums = [0.0].into_iter().chain(sums).collect();
        Sums { known, sums }
    }

    /// Mean of `count` rows, of which the row is the last or the middle one; NaN if not all of them are known.
    fn mean(&self, row: usize, count: usize, centred: bool) -> f64 {
        let after = if centred { count / 2 } else { 0 };
        let mean = || {
            let end = (row + after + 1).checked_sub(self.known)?;
            Some((self.sums.get(end)? - self.sums[end.checked_sub(count)?]) / count as f64)
        };
        mean().unwrap_or(f64::NAN)
    }
}

impl Cause for MovingAverage {
    /// The number of samples with which the averages are closest to the candidate.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let rows = rows::start_of_case(evidence).and_then(|start| EvenRows::of(evidence, start, MOST));
        let Some((seen, rows)) = evidence.observation.zip(rows) else {
            return Vec::new();
        };
        let plain = rows.plain();
        let sums: Vec<Sums> = rows.values.iter().map(|values| Sums::of(values)).collect();
        let average = |(count, centred): (usize, bool)| {
            let mean = |sums: &Sums| rows.places.iter().map(|&row| sums.mean(row, count, centred)).collect();
            let averaged: ObservedValues = sums.iter().map(mean).collect();
            let (left, which) = rows::closer(seen, &plain, &averaged)?;
            Some((left, MovingAverage { count, centred, which }))
        };
        let last = (2..=MOST).map(|count| (count, false));
        let middle = (3..=MOST).step_by(2).map(|count| (count, true));
        let best = last
            .chain(middle)
            .filter_map(average)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, average)| Arc::new(average) as Proposal)
            .into_iter()
            .collect()
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        let rows = EvenRows::of(evidence, start, MOST)?;
        let averaged = rows.sampled(|values| {
            let sums = Sums::of(values);
            move |row| sums.mean(row, self.count, self.centred)
        });
        rows::played(evidence, &self.which, rows.plain(), averaged)
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        1.0 - ALL
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let names = rows::names(search.evidence, &self.which);
        let place = if self.centred { "centred at" } else { "which ends at" };
        let words = format!("{names}: a moving average of {} samples, {place} the row", self.count);
        (CauseKind::MovingAverage, words)
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        1
    }

    fn is_of_rows(&self) -> bool {
        true
    }
}
