//! Data that distinguish two changes which reproduce a candidate equally well.

use super::judge::Evidence;
use super::observation::Observation;
use super::{Bench, Tried};
use crate::Channel;
use std::sync::OnceLock;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) enum Apart {
    /// A channel, shown by the candidate or not, with the time (s) and the difference in its unit.
    Channel {
        channel: Channel,
        shown: bool,
        time: f64,
        by: f64,
    },
    /// An event with its number and the difference in time, s.
    Event { number: usize, by: f64 },
    /// The two motions are equal.
    Nowhere,
}

const ROUNDING: f64 = 1e-12;

impl Bench<'_> {
    /// Largest difference of two changes at the candidate's times, in parts of the channels' sizes; `None` if one of
    /// them cannot be run again.
    pub fn apart(&self, one: &Tried, other: &Tried) -> Option<Apart> {
        let Some(seen) = self.evidence.observation else {
            let [one, other] = [one, other].map(|tried| self.played(&tried.change, tried.start));
            let (one, other) = (one?.events, other?.events);
            let off = one.iter().zip(&other).map(|(a, b)| (a.time - b.time).abs());
            let (number, by) = off.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
            if one.len() != other.len() && by <= ROUNDING * self.evidence.period {
                let last = one.iter().chain(&other).map(|event| event.time).fold(0.0, f64::max);
                let number = one.len().min(other.len());
                return Some(Apart::Event {
                    number,
                    by: (self.evidence.covered.1 - last).abs(),
                });
            }
            let is_one = by <= ROUNDING * self.evidence.period && one.len() == other.len();
            return Some(if is_one {
                Apart::Nowhere
            } else {
                Apart::Event { number, by }
            });
        };
        let compared = seen
            .channels
            .iter()
            .zip(&seen.sizes)
            .filter(|(_, size)| size.is_finite());
        let mut channels: Vec<Channel> = compared.map(|(channel, _)| *channel).collect();
        let shown = channels.len();
        let state = self.physics.state.iter().copied();
        let lacking: Vec<Channel> = state.filter(|channel| !channels.contains(channel)).collect();
        channels.extend(lacking);
        let unknown = vec![vec![f64::NAN; seen.time.len()]; channels.len()];
        let sizes: Vec<f64> = channels
            .iter()
            .map(|&channel| self.physics.size(channel, false))
            .collect();
        let all = Observation {
            sizes: sizes.clone(),
            time: seen.time.clone(),
            values: unknown.clone(),
            reference: unknown,
            channels: channels.clone(),
            ..Observation::default()
        };
        let bench = Bench {
            evidence: Evidence {
                observation: Some(&all),
                before: OnceLock::new(),
                found: OnceLock::new(),
                ..self.evidence
            },
            starts: self.starts.clone(),
            first: self.first.clone(),
            origin: self.origin.clone(),
            runs: Default::default(),
            ..*self
        };
        let [one, other] = [one, other].map(|tried| bench.played(&tried.change, tried.start));
        let (one, other) = (one?.values, other?.values);
        let mut largest = (ROUNDING, Apart::Nowhere);
        for (k, &channel) in channels.iter().enumerate() {
            for (row, (a, b)) in one[k].iter().zip(&other[k]).enumerate() {
                let by = (a - b).abs();
                if by / sizes[k] > largest.0 {
                    let (time, shown) = (seen.time[row], k < shown);
                    largest = (
                        by / sizes[k],
                        Apart::Channel {
                            channel,
                            shown,
                            time,
                            by,
                        },
                    );
                }
            }
        }
        Some(largest.1)
    }
}
