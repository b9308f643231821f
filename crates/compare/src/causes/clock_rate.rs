//! A clock that runs at another rate: times that are scaled.

use super::evidence::Evidence;
use super::fit::fitted;
use super::judge::Judged;
use super::motion::Played;
use super::search::Search;
use super::{Cause, Proposal, rows};
use crate::diagnosis::CauseKind;
use std::sync::Arc;
use stickslip_system::record::sequence::SequenceEvent;

/// Smallest part that another rate must explain: with the right one nothing is left.
const OF_RATE: f64 = 1.0 - 1e-6;
/// Fewest events that show a rate: a mass that slides to rest under another friction has another rate, too.
const FEWEST_EVENTS: usize = 5;
/// Unit of the fit.
const UNIT: f64 = 1e-3;
/// Smallest change of a rate. A method of order 2 with 300 steps in a natural period changes the frequency by as much.
const LEAST: f64 = 5e-5;
/// Largest factor of a rate. Units of time are causes of their own.
const MOST: f64 = 2.0;

/// Times pass at `rate` times the reference's from `origin` (s) on.
#[derive(Debug)]
pub(crate) struct ClockRate {
    rate: f64,
    origin: f64,
}

impl ClockRate {
    /// The reference's time at a time of the candidate, s.
    fn to_reference(&self, time: f64) -> f64 {
        self.origin + (time - self.origin) / self.rate
    }

    fn played(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        let moved = |event: &SequenceEvent| SequenceEvent {
            time: self.origin + (event.time - self.origin) * self.rate,
            kind: event.kind,
        };
        let mut played = Played {
            values: Vec::new(),
            events: evidence.reference.iter().map(moved).collect(),
            steps: 0,
        };
        if let Some(seen) = evidence.observation {
            let times: Vec<f64> = seen.time.iter().map(|time| self.to_reference(*time)).collect();
            played.values = evidence.unchanged_at(start, &times)?;
            seen.derive(&mut played.values, evidence.physics);
        }
        Some(played)
    }
}

impl Cause for ClockRate {
    /// Rates that the events show, fitted.
    fn propose(search: &Search<'_>) -> Vec<Proposal> {
        let evidence = search.evidence;
        let Some(start) = rows::start_of_case(evidence).filter(|_| evidence.word.len() >= FEWEST_EVENTS) else {
            return Vec::new();
        };
        let first = evidence.observation.and_then(|seen| seen.time.first().copied());
        let mut origins = vec![0.0];
        origins.extend(first.filter(|first| *first != 0.0));
        let of_origin = |origin: f64| {
            let pairs = evidence.word.iter().zip(evidence.reference);
            let pairs = pairs.filter(|(theirs, ours)| theirs.kind == ours.kind && ours.time != origin);
            let mut ratios: Vec<f64> = pairs.map(|(a, b)| (a.time - origin) / (b.time - origin)).collect();
            ratios.sort_by(f64::total_cmp);
            let shown = ratios.get(ratios.len() / 2).copied();
            let begin = shown
                .into_iter()
                .chain([1.0])
                .filter(|rate| (1.0 / MOST..MOST).contains(rate));
            let rates = begin.filter_map(|begin| {
                fitted(evidence, begin, UNIT, &|rate| {
                    ClockRate { rate, origin }.played(evidence, start)
                })
            });
            rates.collect::<Vec<f64>>()
        };
        let rates = origins
            .into_iter()
            .flat_map(|origin| of_origin(origin).into_iter().map(move |rate| (rate, origin)));
        let large = rates.filter(|(rate, _)| (rate - 1.0).abs() >= LEAST && (1.0 / MOST..MOST).contains(rate));
        large
            .map(|(rate, origin)| Arc::new(ClockRate { rate, origin }) as Proposal)
            .collect()
    }

    fn run(&self, evidence: &Evidence<'_>, start: usize) -> Option<Played> {
        self.played(evidence, start)
    }

    fn judge(&self, evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
        let judged = evidence.judged(played, f64::INFINITY)?;
        Some(if evidence.detected.is_some() {
            judged.by_samples()
        } else {
            judged
        })
    }

    fn least(&self, _: &Evidence<'_>) -> f64 {
        OF_RATE
    }

    fn words(&self, _: &Search<'_>) -> (CauseKind, String) {
        let from = match self.origin {
            0.0 => String::new(),
            origin => format!(" from {origin:.6} s on"),
        };
        let words = format!("its clock runs at {:.6} times the reference's{from}", self.rate);
        (CauseKind::ClockRate, words)
    }

    fn complexity(&self, _: &Evidence<'_>) -> usize {
        1
    }

    fn is_of_file(&self) -> bool {
        true
    }

    fn begins_at(&self, evidence: &Evidence<'_>, start: usize) -> bool {
        rows::is_start_of_case(evidence, start)
    }
}
