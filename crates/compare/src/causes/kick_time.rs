//! A kick at another time.

use super::evidence::Evidence;
use super::fit::fitted;
use super::judge::ALL;
use super::motion::Played;
use super::search::Search;
use super::{Cause, Proposal};
use crate::diagnosis::CauseKind;
use std::sync::Arc;
use stickslip_engine::workers::over_processors;
use stickslip_system::model::KickTime;

/// Times of a kick on each side of the reference's that are tried, in natural periods, and how many of them are fitted.
const TRIED: i32 = 12;
const APART: f64 = 0.25;
const FITTED: usize = 3;

/// The kick of this number comes at another time.
#[derive(Debug)]
pub(crate) struct KickMoved {
    number: usize,
    /// Times of the candidate's kick and of the reference's, s.
    time: f64,
    own: f64,
}

impl Cause for KickMoved {
    /// Times at which the candidate parts from the motion without kicks, and near the reference's kick, fitted.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let Some(seen) = evidence.observation else {
            return Vec::new();
        };
        let kicks = evidence.case.case().system.kicks.iter().enumerate();
        let kicks = kicks.filter_map(|(number, kick)| Some((number, *kick.time.at()?)));
        let starts = (0..evidence.starts.len()).filter(|start| search.may_begin_at(*start));
        let starts: Vec<usize> = starts.collect();
        let mut found: Vec<Proposal> = Vec::new();
        for ((number, own), &start) in kicks.flat_map(|kick| starts.iter().map(move |start| (kick, start))) {
            let at = |time: f64| KickMoved { number, time, own };
            let unkicked = evidence.with(start, |system| system.kicks.clear());
            let parts = unkicked.and_then(|played| seen.time.get(seen.close(&played.values, evidence.least)).copied());
            let near = (-TRIED..=TRIED).map(|k| own + f64::from(k) * APART * evidence.period);
            let begin: Vec<f64> = near.chain(parts).collect();
            let left = over_processors(begin.len(), &|| false, |k| {
                let played = at(begin[k]).run(evidence, start)?;
                Some((evidence.judged(&played, f64::INFINITY)?.left, begin[k]))
            });
            let mut left: Vec<(f64, f64)> = left.into_iter().flatten().collect();
            left.sort_by(|a, b| a.0.total_cmp(&b.0));
            left.truncate(FITTED);
            let times = over_processors(left.len(), &|| false, |k| {
                fitted(evidence, left[k].1, APART * evidence.period, &|time| {
                    at(time).run(evidence, start)
                })
            });
            let times = times.into_iter().flatten().filter(|time| *time != own);
            found.extend(times.map(|time| Arc::new(at(time)) as Proposal));
        }
        found
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        evidence.with(start, |system| system.kicks[self.number].time = KickTime::At(self.time))
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        1.0 - ALL
    }

    fn words(&self, _: &Search<'_>) -> (CauseKind, String) {
        let words = format!("its kick comes at {:.6} s, and not at {:.6} s", self.time, self.own);
        (CauseKind::AnotherKick, words)
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        1
    }
}
