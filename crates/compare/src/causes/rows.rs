//! Rows of the reference's motion, processed as another program may have processed its own.

use super::Causes;
use super::evidence::{Evidence, TrialStart};
use super::judge::Judged;
use super::motion::Played;
use super::observation::{Observation, ObservedValues};
use super::search::{Search, Tried};
use crate::diagnosis::Diagnosis;

/// Largest distance of a sample from an even time, in intervals.
const UNEVEN: f64 = 0.1;
/// Most rows of the motion that are computed.
const MOST_ROWS: usize = 400_000;

/// The unchanged motion at even times, among which are those of the candidate's samples.
#[derive(Debug)]
pub(super) struct EvenRows {
    /// s.
    pub interval: f64,
    /// The observed channels; NaN where the motion is unknown.
    pub values: ObservedValues,
    /// Row of each sample of the candidate.
    pub places: Vec<usize>,
}

impl EvenRows {
    /// Rows from `before` intervals before the first sample to the last one; `None` if the samples are not even.
    pub fn of(evidence: &Evidence<'_>, start: usize, before: usize) -> Option<EvenRows> {
        let seen = evidence.observation?;
        let interval = seen.interval?;
        let first = *seen.time.first()?;
        let place = |time: &f64| {
            let number = (time - first) / interval;
            let is_even = (number - number.round()).abs() <= UNEVEN && number <= MOST_ROWS as f64;
            is_even.then_some(number.round() as usize + before)
        };
        let places: Vec<usize> = seen.time.iter().map(place).collect::<Option<_>>()?;
        let count = places.last()? + 1;
        if count > MOST_ROWS {
            return None;
        }
        let time = |row: usize| first + (row as f64 - before as f64) * interval;
        let times: Vec<f64> = (0..count).map(time).collect();
        Some(EvenRows {
            interval,
            values: evidence.unchanged_at(start, &times)?,
            places,
        })
    }

    /// Channels at the candidate's samples, processed by a function of all rows of a channel. It gives the value in a
    /// row.
    pub fn sampled<Value: Fn(usize) -> f64>(&self, process: impl Fn(&[f64]) -> Value) -> ObservedValues {
        let each = self.values.iter().map(|rows| {
            let value = process(rows);
            self.places.iter().map(|&row| value(row)).collect()
        });
        each.collect()
    }

    /// Channels at the candidate's samples as they are.
    pub fn plain(&self) -> ObservedValues {
        let each = self
            .values
            .iter()
            .map(|rows| self.places.iter().map(|&row| rows[row]).collect());
        each.collect()
    }
}

/// Whether a start is that of the case. The rows of a file are processed without regard to where the candidate begins.
pub(super) fn is_start_of_case(evidence: &Evidence<'_>, start: usize) -> bool {
    matches!(evidence.starts.get(start), Some(TrialStart::Case))
}

pub(super) fn start_of_case(evidence: &Evidence<'_>) -> Option<usize> {
    (0..evidence.starts.len()).find(|start| is_start_of_case(evidence, *start))
}

/// Channels of the candidate's own columns that the processed values bring closer to the candidate than `plain` ones
/// do, with the mean squares that are left then, in parts of the sizes; `None` if there are none.
pub(super) fn closer(
    seen: &Observation,
    plain: &ObservedValues,
    processed: &ObservedValues,
) -> Option<(f64, Vec<bool>)> {
    let mut left = 0.0;
    let mut which = vec![false; seen.channels.len()];
    for channel in (0..which.len()).filter(|&channel| seen.is_column(channel)) {
        let [plain, processed] = [plain, processed].map(|values| seen.left_in(channel, &values[channel]));
        which[channel] = processed < plain;
        left += if which[channel] { processed } else { plain };
    }
    which.contains(&true).then_some((left, which))
}

/// A motion in which only these channels, and those that follow from them, are processed.
pub(super) fn played(
    evidence: &Evidence<'_>,
    which: &[bool],
    mut plain: ObservedValues,
    processed: ObservedValues,
) -> Option<Played> {
    let columns = plain.iter_mut().zip(processed).zip(which);
    columns
        .filter(|(_, which)| **which)
        .for_each(|((plain, processed), _)| *plain = processed);
    written(evidence, plain)
}

/// A motion with these channels, from which others follow as they do in the candidate's file.
pub(super) fn written(evidence: &Evidence<'_>, mut values: ObservedValues) -> Option<Played> {
    evidence.observation?.derive(&mut values, evidence.physics);
    Some(Played {
        values,
        events: evidence.reference.to_vec(),
        steps: 0,
    })
}

/// Judges a processed motion by its samples.
pub(super) fn judged(evidence: &Evidence<'_>, played: &Played) -> Option<Judged> {
    evidence.judged(played, f64::INFINITY).map(Judged::by_samples)
}

/// Names of the channels: "phi1 and phi1_dot", or "each column".
pub(super) fn names(evidence: &Evidence<'_>, which: &[bool]) -> String {
    let Some(seen) = evidence.observation else {
        return String::new();
    };
    let columns = (0..seen.channels.len()).filter(|&channel| seen.is_column(channel));
    let columns: Vec<usize> = columns.collect();
    if columns.len() > 2 && columns.iter().all(|&channel| which[channel]) {
        return "each column".to_owned();
    }
    let named = columns.into_iter().filter(|&channel| which[channel]);
    let names: Vec<_> = named.map(|channel| seen.channels[channel].name()).collect();
    names.join(" and ")
}

/// Other mistakes that explain as much as the first of `all`, which is a mistake of the file. Those of the file are
/// returned in words. The first one of the motion becomes a diagnosis, which says that `name` and it look alike.
pub(super) fn beside(search: &Search<'_>, name: &str, all: &[Tried], causes: &mut Causes) -> String {
    let (of_file, of_motion): (Vec<Tried>, Vec<Tried>) =
        all[1..].iter().cloned().partition(|tried| tried.cause.is_of_file());
    let is_two = |other: &Tried| other.cause.stepper().is_some() && !other.cause.numbers().is_empty();
    if let Some(other) = of_motion.first().filter(|other| !is_two(other)) {
        let (kind, words) = match other.cause.numbers() {
            [] => other.cause.words(search),
            _ => other.cause.report(search, &of_motion, causes),
        };
        let words = format!("{words}; {name} and this cannot be told apart by what the candidate shows");
        causes.said.push(Diagnosis::tried(kind, words, other.judged.explained));
    }
    let mut named = vec![all[0].cause.words(search).0];
    let mut text = String::new();
    for tried in of_file {
        let (kind, words) = tried.cause.words(search);
        if !named.contains(&kind) {
            text += &format!("; as much is explained by {}: {words}", kind.name());
            named.push(kind);
        }
    }
    text
}
