//! Columns that are exchanged.

use super::evidence::Evidence;
use super::judge::ALL;
use super::motion::Played;
use super::search::Search;
use super::{Cause, Proposal, rows};
use crate::diagnosis::CauseKind;
use std::sync::Arc;

/// Index of the reference's channel in each column of the candidate.
#[derive(Debug)]
pub(crate) struct SwappedColumns {
    places: Vec<usize>,
}

impl Cause for SwappedColumns {
    /// Each column is the channel that is closest to it, if no two are the same one.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let Some(seen) = search.evidence.observation else {
            return Vec::new();
        };
        let columns = (0..seen.channels.len()).filter(|&channel| seen.is_column(channel));
        let columns: Vec<usize> = columns.collect();
        let mut places: Vec<usize> = (0..seen.channels.len()).collect();
        for &channel in &columns {
            let left = |of: &usize| seen.left_in(channel, &seen.reference[*of]);
            let closest = columns.iter().copied().min_by(|a, b| left(a).total_cmp(&left(b)));
            // A column that is equal to its own channel is not another.
            places[channel] = closest.filter(|of| left(of) < left(&channel)).unwrap_or(channel);
        }
        let mut sorted = places.clone();
        sorted.sort_unstable();
        let is_exchange = sorted.iter().enumerate().all(|(place, of)| place == *of);
        match is_exchange && sorted != places {
            true => vec![Arc::new(SwappedColumns { places })],
            false => Vec::new(),
        }
    }

    fn run(&self, evidence: &Evidence<'_>, _: usize) -> Option<Played> {
        let reference = &evidence.observation?.reference;
        rows::written(evidence, self.places.iter().map(|&of| reference[of].clone()).collect())
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        1.0 - ALL
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let moved: Vec<bool> = self.places.iter().enumerate().map(|(place, of)| place != *of).collect();
        let names = rows::names(search.evidence, &moved);
        (CauseKind::SwappedColumns, format!("the columns {names} are exchanged"))
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        0
    }

    fn is_of_rows(&self) -> bool {
        true
    }
}
