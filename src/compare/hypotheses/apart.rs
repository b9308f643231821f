//! What would tell two changes apart that reproduce a candidate equally well.

use super::judge::Evidence;
use super::observation::Observation;
use super::{Bench, Tried};
use crate::compare::Channel;
use std::sync::OnceLock;

/// Where the motions of two changes differ most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) enum Apart {
    /// A channel, which the candidate has or not, with the time (s) and by how much, in its unit.
    Channel {
        channel: Channel,
        shown: bool,
        time: f64,
        by: f64,
    },
    /// An event of one kind or of two, with its number and by how much, s.
    Event { number: usize, by: f64 },
    /// Nowhere: the two are one motion.
    Nowhere,
}

/// Differences below this part of a size, or of the natural period, are rounding.
const ROUNDING: f64 = 1e-12;

impl Bench<'_> {
    /// Where two changes differ most at the candidate's times, in parts of the channels' sizes; `None` if one of them cannot be run again.
    pub fn apart(&self, one: &Tried, other: &Tried) -> Option<Apart> {
        let Some(seen) = self.evidence.observation else {
            let [one, other] = [one, other].map(|tried| self.played(&tried.change, tried.start));
            let (one, other) = (one?.events, other?.events);
            let off = one.iter().zip(&other).map(|(a, b)| (a.time - b.time).abs());
            let (number, by) = off.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
            // One has more of them.
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
        let mut channels = seen.channels.clone();
        channels.extend(
            self.physics
                .state
                .iter()
                .filter(|channel| !seen.channels.contains(channel)),
        );
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
            interval: seen.interval,
            channels: channels.clone(),
        };
        let bench = Bench {
            evidence: Evidence {
                observation: Some(&all),
                before: OnceLock::new(),
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
                    let (time, shown) = (seen.time[row], k < seen.channels.len());
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
