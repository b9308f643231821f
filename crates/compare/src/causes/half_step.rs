//! Speeds that are stored half a step before or after the positions of their rows, as the leap-frog method has them.

use super::evidence::Evidence;
use super::fit::fitted;
use super::judge::ALL;
use super::motion::Played;
use super::search::Search;
use super::{Cause, Proposal, rows};
use crate::diagnosis::CauseKind;
use std::sync::Arc;
use stickslip_case::quantity::Dimension;

/// Speeds that are stored beside the positions of another time.
#[derive(Debug)]
pub(crate) struct HalfStep {
    /// Time by which the speeds are later than their rows, s. Negative: earlier.
    late: f64,
}

fn is_speed(evidence: &Evidence<'_>) -> Option<Vec<bool>> {
    let seen = evidence.observation?;
    let channels = seen.channels.iter().enumerate();
    let is_speed = channels.map(|(place, channel)| {
        seen.is_column(place) && matches!(channel.dimension(), Dimension::AngularVelocity | Dimension::Velocity)
    });
    Some(is_speed.collect())
}

impl HalfStep {
    fn played(late: f64, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        let seen = evidence.observation?;
        let times: Vec<f64> = seen.time.iter().map(|time| time + late).collect();
        let at = |times: &[f64]| evidence.unchanged_at(start, times);
        rows::played(evidence, &is_speed(evidence)?, at(&seen.time)?, at(&times)?)
    }
}

impl Cause for HalfStep {
    /// Half of the interval of the samples, and what the samples show, on both sides.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let speeds = is_speed(evidence).unwrap_or_default();
        let Some((seen, start)) = evidence.observation.zip(rows::start_of_case(evidence)) else {
            return Vec::new();
        };
        let has_position = (0..speeds.len()).any(|channel| seen.is_column(channel) && !speeds[channel]);
        let Some(half) = seen.interval.map(|interval| 0.5 * interval) else {
            return Vec::new();
        };
        if !speeds.contains(&true) || !has_position {
            return Vec::new();
        }
        let shown = |begin: f64| fitted(evidence, begin, half, &|late| HalfStep::played(late, evidence, start));
        let all = [-half, half].into_iter().flat_map(|late| [Some(late), shown(late)]);
        all.flatten()
            .map(|late| Arc::new(HalfStep { late }) as Proposal)
            .collect()
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        HalfStep::played(self.late, evidence, start)
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        1.0 - ALL
    }

    fn words(&self, _: &Search<'_>) -> (CauseKind, String) {
        let side = if self.late > 0.0 { "after" } else { "before" };
        let words = format!(
            "its speeds are those of half a step of {:.3e} s {side} its positions, as the leap-frog method stores them",
            2.0 * self.late.abs()
        );
        (CauseKind::HalfStep, words)
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        1
    }

    fn is_of_rows(&self) -> bool {
        true
    }
}
