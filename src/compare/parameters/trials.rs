//! The case run again from where a candidate begins, with other numbers, and held against its events.

use super::mistake::Agreement;
use crate::case::WrittenCase;
use crate::record::sequence::{Alignment, SequenceEvent};
use crate::record::{EventKind, NoRecorder};
use crate::simulation::{Method, OutputOptions, Progress, SolverOptions};
use crate::simulation::{Problem, simulate_from};
use std::ops::ControlFlow;

/// As in a certificate's reruns: within 1e-12 s of exact events.
const RTOL: f64 = 1e-12;
/// What a trial may take: questions of its control between two events, each after 256 steps or some 2 ms.
const MOST_QUESTIONS: usize = 400;
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
#[derive(Debug, Clone)]
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
        let end = (last + BEYOND * period).min(covered.1);
        Trials {
            end: if end.is_finite() {
                end
            } else {
                numbers.case().output.end_time
            },
            numbers,
            start,
            covered,
            word,
            period,
        }
    }

    /// The same from another start.
    pub fn from(&self, start: Start) -> Trials<'a> {
        Trials { start, ..self.clone() }
    }

    /// The events of the case with other numbers, as far as the candidate covers them; `None` if there is no such run.
    pub fn run(&self, changes: &[(&str, f64)]) -> Option<Vec<SequenceEvent>> {
        self.run_counted(changes).map(|(events, _)| events)
    }

    /// As [`Self::run`], with how many steps the run took.
    pub fn run_counted(&self, changes: &[(&str, f64)]) -> Option<(Vec<SequenceEvent>, u64)> {
        let case = self.numbers.with_all(changes).ok()?;
        let case = &case;
        let problem = Problem {
            trains: &case.system,
            threshold: case.threshold(),
            further: false,
        };
        let start = match &self.start {
            Start::Case => None,
            Start::At(time, state) => Some((*time, &state[..])),
        };
        let solver = SolverOptions {
            method: Method::Series,
            rtol: RTOL,
            ..SolverOptions::default()
        };
        let output = OutputOptions::at_the_ends(self.end);
        let most = MOST_EVENTS.0 * self.word.len() + MOST_EVENTS.1;
        let (mut questions, mut events) = (0, 0);
        let control = &mut |progress: Progress| {
            questions = if progress.events == events { questions + 1 } else { 0 };
            events = progress.events;
            match questions > MOST_QUESTIONS || events > most {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        };
        let report = simulate_from(problem, start, &solver, &output, &mut NoRecorder, control).ok()?;
        if report.interrupted {
            return None;
        }
        let covered = |time: f64| time >= self.covered.0 && time <= self.end;
        let events = report
            .events
            .iter()
            .filter(|e| e.kind.in_event_sequence() && covered(e.time));
        Some((
            events.map(SequenceEvent::from).collect(),
            report.work.iter().map(|work| work.steps).sum(),
        ))
    }

    /// How far a run agrees with the candidate.
    pub fn agreement(&self, run: &[SequenceEvent]) -> Agreement {
        let alignment = Alignment::of(run, self.word, self.period);
        let related = RELATED * self.period;
        let errors: Vec<f64> = alignment
            .matched()
            .map(|(r, c)| (self.word[c].time - run[r].time).abs())
            .filter(|error| *error <= related)
            .collect();
        let unmatched = run.len() + self.word.len() - 2 * errors.len();
        let squares: f64 = errors.iter().map(|e| e * e).sum();
        Agreement {
            matched: errors.len(),
            unmatched,
            rms: (squares / errors.len().max(1) as f64).sqrt(),
            max: errors.iter().copied().fold(0.0, f64::max),
            cost: unmatched as f64 + errors.iter().map(|e| e / related).sum::<f64>(),
        }
    }
}

/// What tells runs apart whose events have no partners: the last event, the first one, and how long a cycle is, s.
pub(super) fn landmarks(word: &[SequenceEvent]) -> [Option<f64>; 3] {
    let sticks: Vec<f64> = word
        .iter()
        .filter(|e| e.kind == EventKind::Stick)
        .map(|e| e.time)
        .collect();
    let cycle = |sticks: &[f64]| {
        // The last sticks before the final one are long.
        let some = &sticks[..sticks.len() - sticks.len() / 4];
        let (first, last) = (some.first()?, some.last()?);
        (some.len() > 2).then(|| (last - first) / (some.len() - 1) as f64)
    };
    [
        word.last().map(|e| e.time),
        word.first().map(|e| e.time),
        (!sticks.is_empty()).then(|| cycle(&sticks)).flatten(),
    ]
}
