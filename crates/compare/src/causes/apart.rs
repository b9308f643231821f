//! Data that distinguish two mistakes which reproduce a candidate equally well.

use super::evidence::Evidence;
use super::observation::Observation;
use super::search::Tried;
use crate::Channel;

const ROUNDING: f64 = 1e-12;

/// Where two mistakes differ most at the candidate's times, in parts of the channels' sizes, in words; `None` if one of
/// them cannot be run again.
pub(crate) fn apart(evidence: &Evidence<'_>, one: &Tried, other: &Tried) -> Option<String> {
    let one_motion = "; the first two are one motion: another start, drive or force tells them apart".to_owned();
    let Some(seen) = evidence.observation else {
        let [one, other] = [one, other].map(|tried| tried.cause.run(evidence, tried.start));
        let (one, other) = (one?.events, other?.events);
        let off = one.iter().zip(&other).map(|(a, b)| (a.time - b.time).abs());
        let (mut number, mut by) = off.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        if by <= ROUNDING * evidence.period {
            if one.len() == other.len() {
                return Some(one_motion);
            }
            let last = one.iter().chain(&other).map(|event| event.time).fold(0.0, f64::max);
            (number, by) = (one.len().min(other.len()), (evidence.covered.1 - last).abs());
        }
        return Some(format!(
            "; the first two differ most at event {number}, by {by:.1e} s: more digits or samples tell them apart"
        ));
    };
    let physics = evidence.physics;
    let compared = seen.channels.iter().zip(&seen.sizes);
    let compared = compared.filter(|(_, size)| size.is_finite());
    let mut channels: Vec<Channel> = compared.map(|(channel, _)| *channel).collect();
    let shown = channels.len();
    let state = physics.state.iter().copied();
    let lacking: Vec<Channel> = state.filter(|channel| !channels.contains(channel)).collect();
    channels.extend(lacking);
    let unknown = vec![vec![f64::NAN; seen.time.len()]; channels.len()];
    let sizes = channels.iter().map(|&channel| physics.size(channel, false));
    let all = Observation {
        sizes: sizes.collect(),
        time: seen.time.clone(),
        values: unknown.clone(),
        reference: unknown,
        channels,
        ..Observation::default()
    };
    let evidence = evidence.observed_as(Some(&all));
    let [one, other] = [one, other].map(|tried| tried.cause.run(&evidence, tried.start));
    let (one, other) = (one?.values, other?.values);
    let mut largest = (ROUNDING, one_motion);
    for (k, &channel) in all.channels.iter().enumerate() {
        for (row, (a, b)) in one[k].iter().zip(&other[k]).enumerate() {
            let by = (a - b).abs();
            if by / all.sizes[k] > largest.0 {
                let (name, unit) = (channel.name(), physics.vocabulary().unit(channel));
                let lacking = if k < shown { "" } else { ", which the candidate lacks" };
                let words = format!(
                    "; the first two differ most in {name}{lacking}, by {by:.1e} {unit} at {:.6} s",
                    seen.time[row]
                );
                largest = (by / all.sizes[k], words);
            }
        }
    }
    Some(largest.1)
}
