//! The case run again from where a candidate begins, with other numbers, and held against its events.

use super::mistake::Agreement;
use crate::case::WrittenCase;
use crate::compare::hypotheses::{Played, Score};
use crate::record::EventKind;
use crate::record::sequence::{Alignment, SequenceEvent};

/// Events of a trial, as a multiple of the candidate's, and some more.
const MOST_EVENTS: (usize, usize) = (3, 50);
/// Pairs further apart than this part of the natural period are unrelated.
const RELATED: f64 = 0.25;
/// How long a trial goes on behind the candidate's last event, in natural periods: what it has beyond is too many.
const BEYOND: f64 = 20.0;

/// Where trials start.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) enum Start {
    /// At t = 0, as the case does.
    Case,
    /// At a time (s), with a state.
    At(f64, Vec<f64>),
}

/// Runs of a case against the events of a candidate.
#[derive(Debug)]
pub(super) struct Trials<'a> {
    /// The numbers of the case that is run.
    pub numbers: &'a WrittenCase,
    start: Start,
    /// s.
    end: f64,
    /// The part of the time that the candidate covers, s.
    covered: (f64, f64),
    /// The candidate's events.
    pub word: &'a [SequenceEvent],
    /// The natural period, s.
    pub period: f64,
}

impl<'a> Trials<'a> {
    /// Of a case from `start` on against the candidate's events `word`, which covers the times from and to (s).
    pub fn new(
        numbers: &'a WrittenCase,
        start: Start,
        word: &'a [SequenceEvent],
        covered: (f64, f64),
        period: f64,
    ) -> Trials<'a> {
        let last = word.last().map_or(covered.0, |event| event.time);
        let end = Some((last + BEYOND * period).min(covered.1));
        Trials {
            end: end
                .filter(|end| end.is_finite())
                .unwrap_or(numbers.case().output.end_time),
            numbers,
            start,
            covered,
            word,
            period,
        }
    }

    /// The events of the case with other numbers, as far as the candidate covers them; `None` if there is no such run.
    pub fn run(&self, changes: &[(&str, f64)]) -> Option<Vec<SequenceEvent>> {
        self.run_counted(changes).map(|(events, _)| events)
    }

    /// As [`Self::run`], with how many steps the run took.
    pub fn run_counted(&self, changes: &[(&str, f64)]) -> Option<(Vec<SequenceEvent>, u64)> {
        let case = self.numbers.with_all(changes).ok()?;
        let score = Score {
            system: &case.system,
            threshold: case.threshold,
            start: &self.start,
            end: self.end,
            most_events: MOST_EVENTS.0 * self.word.len() + MOST_EVENTS.1,
            most_steps: None,
        };
        let Played { mut events, steps, .. } = score.events()?;
        events.retain(|event| event.time >= self.covered.0 && event.time <= self.end);
        Some((events, steps))
    }

    /// How far a run agrees with the candidate.
    pub fn agreement(&self, run: &[SequenceEvent]) -> Agreement {
        agreement(run, self.word, self.period)
    }
}

/// How far the events of a run agree with those of a candidate, by the natural period (s).
pub(in super::super) fn agreement(run: &[SequenceEvent], word: &[SequenceEvent], period: f64) -> Agreement {
    let alignment = Alignment::of(run, word, period);
    let related = RELATED * period;
    let errors = alignment.matched().map(|(r, c)| (word[c].time - run[r].time).abs());
    let errors: Vec<f64> = errors.filter(|error| *error <= related).collect();
    let unmatched = run.len() + word.len() - 2 * errors.len();
    let squares: f64 = errors.iter().map(|e| e * e).sum();
    Agreement {
        matched: errors.len(),
        unmatched,
        rms: (squares / errors.len().max(1) as f64).sqrt(),
        max: errors.iter().copied().fold(0.0, f64::max),
        cost: unmatched as f64 + errors.iter().map(|e| e / related).sum::<f64>(),
    }
}

/// What tells runs apart whose events have no partners: the last event, the first one, and how long a cycle is, s.
pub(super) fn landmarks(word: &[SequenceEvent]) -> [Option<f64>; 3] {
    let sticks = word.iter().filter(|e| e.kind == EventKind::Stick);
    let sticks: Vec<f64> = sticks.map(|e| e.time).collect();
    // The last sticks before the final one are long.
    let cycle = match &sticks[..sticks.len() - sticks.len() / 4] {
        some @ [first, _, .., last] if some.len() > 2 => Some((last - first) / (some.len() - 1) as f64),
        _ => None,
    };
    [word.last().map(|e| e.time), word.first().map(|e| e.time), cycle]
}
