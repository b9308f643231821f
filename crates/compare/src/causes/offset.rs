//! A constant that is added to a channel.

use super::evidence::Evidence;
use super::judge::{ALL, Judged};
use super::motion::Played;
use super::search::Search;
use super::{Cause, Proposal, rows};
use crate::diagnosis::CauseKind;
use std::sync::Arc;

/// Largest remaining part of the mean square of a channel that is off by a constant.
const LEFT: f64 = 0.01;

/// Constants that are added to channels, each in its unit; 0 without one.
#[derive(Debug)]
pub(crate) struct ChannelOffset {
    constants: Vec<f64>,
}

impl Cause for ChannelOffset {
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let Some(seen) = search.evidence.observation else {
            return Vec::new();
        };
        let constant = |channel: usize| {
            let mean = seen.mean_off(channel);
            let moved: Vec<f64> = seen.reference[channel].iter().map(|value| value + mean).collect();
            let left = [&moved, &seen.reference[channel]].map(|values| seen.left_in(channel, values));
            let is_off = seen.is_column(channel) && left[0] <= LEFT * left[1];
            if is_off { mean } else { 0.0 }
        };
        let constants: Vec<f64> = (0..seen.channels.len()).map(constant).collect();
        match constants.iter().any(|constant| *constant != 0.0) {
            true => vec![Arc::new(ChannelOffset { constants })],
            false => Vec::new(),
        }
    }

    fn run(&self, evidence: &Evidence<'_>, _: usize) -> Option<Played> {
        let columns = evidence.observation?.reference.iter().zip(&self.constants);
        let moved = columns.map(|(values, constant)| values.iter().map(|value| value + constant).collect());
        rows::written(evidence, moved.collect())
    }

    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        rows::judged(evidence, played).map(Judged::by_constants)
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        1.0 - ALL
    }

    fn words(&self, search: &Search<'_>) -> (CauseKind, String) {
        let channels = search.evidence.observation.map_or(&[][..], |seen| &seen.channels);
        let vocabulary = search.evidence.physics.vocabulary();
        let each = channels
            .iter()
            .zip(&self.constants)
            .filter(|(_, constant)| **constant != 0.0);
        let each = each.map(|(channel, constant)| {
            format!(
                "{} is off by {constant:.4e} {}",
                channel.name(),
                vocabulary.unit(*channel)
            )
        });
        let words = each.collect::<Vec<_>>().join(" and ");
        (CauseKind::ChannelOffset, words)
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        self.constants.iter().filter(|constant| **constant != 0.0).count()
    }

    fn is_of_rows(&self) -> bool {
        true
    }
}
