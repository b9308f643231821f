//! Another initial state: the candidate begins in a state that is not the reference's.

use super::evidence::{Evidence, TrialStart};
use super::judge::EXPLAINED;
use super::motion::Played;
use super::search::{Search, Tried};
use super::{Cause, Causes, Proposal, kick};
use crate::diagnosis::CauseKind;
use std::sync::Arc;

/// The candidate's own first state.
#[derive(Debug)]
pub(crate) struct OtherState;

impl Cause for OtherState {
    fn propose(_: &Search<'_>) -> Vec<Proposal> {
        vec![Arc::new(OtherState)]
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        match evidence.starts.get(start)? {
            TrialStart::At(..) => evidence.with(start, |_| {}),
            TrialStart::Case => None,
        }
    }

    fn begins_at(&self, _: &Evidence<'_>, _: usize) -> bool {
        true
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        EXPLAINED
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        4
    }

    fn is_state(&self) -> bool {
        true
    }

    fn words(&self, _: &Search<'_>) -> (CauseKind, String) {
        (CauseKind::AnotherState, "it begins in another state".to_owned())
    }

    /// A state behind a kick that differs is another kick.
    fn report(&self, search: &Search<'_>, all: &[Tried], causes: &mut Causes) -> (CauseKind, String) {
        let (kind, words) = kick::shown(search, &all[0], causes).unwrap_or_else(|| self.words(search));
        (kind, format!("{words}: {}", search.outcome(&all[0])))
    }
}
