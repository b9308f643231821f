//! Runs of the case with other parameters from where a candidate begins, compared with its events.

use super::Material;
use super::mistake::Agreement;
use crate::hypotheses::{PlayScore, Played};
use crate::limit::Limit;
use stickslip_case::WrittenCase;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::{Alignment, SequenceEvent};

const MOST_EVENTS: (usize, usize) = (3, 50);
/// Pairs further apart than this part of the natural period are unrelated.
const RELATED: f64 = 0.25;
/// Natural periods that a trial continues after the candidate's last event; events there are surplus.
const BEYOND: f64 = 20.0;

#[derive(Debug, Clone, PartialEq)]
pub(in super::super) enum TrialStart {
    Case,
    At(f64, Vec<f64>),
}

#[derive(Debug)]
pub(super) struct Trials<'a> {
    pub numbers: &'a WrittenCase,
    start: TrialStart,
    end: f64,
    covered: (f64, f64),
    pub word: &'a [SequenceEvent],
    pub period: f64,
    shows_contact: bool,
    limit: Limit,
}

impl<'a> Trials<'a> {
    pub fn new(material: &Material<'a>, start: TrialStart) -> Trials<'a> {
        let Material {
            numbers,
            word,
            covered,
            period,
            shows_contact,
            limit,
            ..
        } = *material;
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
            shows_contact,
            limit,
        }
    }

    /// Events of the case with other parameters within the covered time; `None` if the run fails.
    pub fn run(&self, changes: &[(&str, f64)]) -> Option<Vec<SequenceEvent>> {
        self.run_counted(changes).map(|(events, _)| events)
    }

    pub fn run_counted(&self, changes: &[(&str, f64)]) -> Option<(Vec<SequenceEvent>, u64)> {
        let case = self.numbers.with_all(changes).ok()?;
        let score = PlayScore {
            system: &case.system,
            threshold: case.threshold,
            start: &self.start,
            end: self.end,
            most_events: MOST_EVENTS.0 * self.word.len() + MOST_EVENTS.1,
            most_steps: None,
            shows_contact: self.shows_contact,
            limit: self.limit,
        };
        let Played { mut events, steps, .. } = score.events()?;
        events.retain(|event| event.time >= self.covered.0 && event.time <= self.end);
        Some((events, steps))
    }

    pub fn agreement(&self, run: &[SequenceEvent]) -> Agreement {
        agreement(run, self.word, self.period)
    }
}

/// Agreement of the events of a run with a candidate's; `period` is the natural period, s.
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

/// Landmarks of runs whose events have no partners: the last event, the first one, and the duration of a cycle, s.
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
