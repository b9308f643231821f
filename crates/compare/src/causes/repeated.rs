//! Rows that stand several times, while the time goes on.

use super::evidence::Evidence;
use super::judge::ALL;
use super::motion::Played;
use super::search::Search;
use super::{Cause, Proposal, rows};
use crate::diagnosis::CauseKind;
use std::sync::Arc;

/// Each row is written `times` times; its values belong to the first of these times.
#[derive(Debug)]
pub(crate) struct RepeatedRows {
    times: usize,
}

impl Cause for RepeatedRows {
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let times = search.evidence.observation.and_then(|seen| seen.repeated);
        let proposal = times.map(|times| Arc::new(RepeatedRows { times }) as Proposal);
        proposal.into_iter().collect()
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        let held = &evidence.observation?.since;
        rows::written(evidence, evidence.unchanged_at(start, held)?)
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        1.0 - ALL
    }

    fn words(&self, _: &Search<'_>) -> (CauseKind, String) {
        let words = format!("each row stands {} times, while the time goes on", self.times);
        (CauseKind::RepeatedRows, words)
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        0
    }

    fn is_of_rows(&self) -> bool {
        true
    }
}
