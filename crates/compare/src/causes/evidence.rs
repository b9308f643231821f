//! Data on a candidate, and runs of the reference's case that are compared with it.

use super::motion::{MotionRequest, Played, Traced};
use super::observation::{Observation, ObservedValues};
use super::parameters::Agreement;
use crate::detect::Detection;
use crate::error::Limit;
use crate::reference::Physics;
use std::borrow::Cow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use stickslip_case::WrittenCase;
use stickslip_system::model::KickTime;
use stickslip_system::model::system::System;
use stickslip_system::record::sequence::SequenceEvent;

/// Most steps of a run: a multiple of the reference's, and a constant.
const MOST_STEPS: (u64, u64) = (20, 5000);
/// Most events of a run: a multiple of the longer sequence's, and a constant.
const MOST_EVENTS: (usize, usize) = (3, 50);

/// Smaller relative changes of a parameter cannot be told from the error of a method: with 100 steps in a natural
/// period, order 2 changes the frequency by 5e-4.
const LEAST: f64 = 5e-4;

/// Fewest samples beyond the number of values that are fitted to them.
const MORE_SAMPLES: usize = 10;

/// Where a run begins.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum TrialStart {
    /// In the state of the case at t = 0.
    Case,
    /// At a time (s), in a state.
    At(f64, Vec<f64>),
}

/// Data on a candidate.
#[derive(Debug)]
pub(crate) struct Evidence<'a> {
    pub physics: &'a Physics,
    /// The reference's case.
    pub case: &'a WrittenCase,
    /// Some of the candidate's samples, with the reference at the same times; `None` for an event table.
    pub observation: Option<&'a Observation>,
    /// Events of the candidate and of the reference.
    pub word: &'a [SequenceEvent],
    pub reference: &'a [SequenceEvent],
    /// Compared part, s.
    pub covered: (f64, f64),
    /// Natural period, s.
    pub period: f64,
    /// Uncertainty of the candidate's event times, s.
    pub bound: f64,
    /// How the events were found in the samples, which then say more; `None` if they were stated.
    pub detected: Option<Detection>,
    pub shows_contact: bool,
    /// Difference of a sample that needs no explanation, in parts of the sizes.
    pub least: f64,
    /// The candidate ends before the first event, which starts amplified rounding.
    pub is_smooth: bool,
    /// Start of the reference and end of the runs, s.
    pub begins: f64,
    pub end: f64,
    /// Where the runs begin, the likeliest first.
    pub starts: Vec<TrialStart>,
    /// Runs of the unchanged case from each start.
    pub unchanged: Arc<[Option<Traced>]>,
    /// Time (s) and state of the candidate's first sample, if it shows the state.
    pub first: Option<(f64, Vec<f64>)>,
    /// Like `first`, or else the reference's state there. Solvers with steps begin here.
    pub origin: Option<(f64, Vec<f64>)>,
    /// Most steps of a run: a run with many times the reference's steps is not the candidate.
    pub most_steps: Option<usize>,
    /// Time of the reference's kick before its first event, s.
    pub kicked: Option<f64>,
    pub limit: Limit,
    /// Runs so far.
    pub runs: Arc<AtomicUsize>,
    /// Agreement of the reference's events with the candidate's, computed on demand.
    pub before: OnceLock<Agreement>,
    /// Events found in the kept samples of the candidate, computed on demand.
    pub found: OnceLock<Option<Vec<SequenceEvent>>>,
}

impl<'a> Evidence<'a> {
    /// Runs the unchanged case from all starts. Sets the bound on steps, and the origin of solvers with steps.
    pub fn prepared(mut self) -> Self {
        self.unchanged = (0..self.starts.len()).map(|start| self.trace(start)).collect();
        let traced = || self.unchanged.iter().flatten();
        let steps = traced().map(|run| run.played.steps).max();
        self.most_steps = steps.and_then(|steps| usize::try_from(MOST_STEPS.0 * steps + MOST_STEPS.1).ok());
        let from = self.observation.and_then(|seen| seen.time.first().copied());
        let of_reference = || {
            let run = traced().next()?;
            let time = from.unwrap_or(run.nodes.first()?.0).max(run.nodes.first()?.0);
            Some((time, run.state_at(self.physics, time)?.1))
        };
        // A state at the reference's start that is not the reference's is a mistake of its own.
        let later = self.first.clone().filter(|(time, _)| *time > self.begins);
        self.origin = later.or_else(of_reference);
        self
    }

    /// Uses another observation, or events alone.
    pub fn observed_as<'b>(&'b self, observation: Option<&'b Observation>) -> Evidence<'b> {
        Evidence {
            observation,
            starts: self.starts.clone(),
            unchanged: self.unchanged.clone(),
            first: self.first.clone(),
            origin: self.origin.clone(),
            runs: self.runs.clone(),
            before: OnceLock::new(),
            found: OnceLock::new(),
            ..*self
        }
    }

    /// Ends the runs at a time, s.
    pub fn until(&self, time: f64) -> Evidence<'_> {
        Evidence {
            end: self.end.min(time),
            ..self.observed_as(self.observation)
        }
    }

    /// The compared part of the samples, s.
    pub fn span(&self) -> (f64, f64) {
        let first = self.observation.and_then(|seen| seen.time.first().copied());
        let from = first.unwrap_or(self.begins).max(self.begins);
        (from, self.covered.1.min(self.end))
    }

    /// Time of the last of the first samples, s; infinite without samples.
    pub fn time_of(&self, count: usize) -> f64 {
        let last = self
            .observation
            .and_then(|seen| seen.time.get(count.checked_sub(1)?).copied());
        last.unwrap_or(f64::INFINITY)
    }

    /// Whether a limit of the search is reached: of wall time, or of runs.
    pub fn is_over(&self) -> bool {
        self.limit.is_over_after(self.runs.load(Ordering::Relaxed))
    }

    /// Counts a run; `None` if no more is allowed.
    pub fn count_run(&self) -> Option<()> {
        let before = self.runs.fetch_add(1, Ordering::Relaxed);
        (!self.limit.is_over_after(before)).then_some(())
    }

    /// Whether a start is the candidate's state at the reference's start: another state there is a mistake of its own.
    pub fn is_other_state(&self, start: usize) -> bool {
        let first = self.first.as_ref().filter(|(time, _)| *time <= self.begins);
        matches!((self.starts.get(start), first), (Some(TrialStart::At(at, _)), Some((time, _))) if at == time)
    }

    /// The start in the state of the case.
    pub fn start_of_case(&self) -> Option<usize> {
        self.starts.iter().position(|start| *start == TrialStart::Case)
    }

    /// Number of the candidate's events, 0 if only its motion up to an onset is known.
    pub fn compared_events(&self) -> usize {
        if self.is_smooth { 0 } else { self.word.len() }
    }

    /// Whether there are samples, or stated events, enough to name a mistake with this many fitted values. Fewer are
    /// reproduced by some value of nearly any parameter.
    pub fn determines(&self, fitted: usize) -> bool {
        let Some(observation) = self.observation.filter(|_| fitted > 0) else {
            return true;
        };
        let samples = observation.time.partition_point(|time| *time <= self.covered.1);
        let stated = if self.detected.is_none() { self.word.len() } else { 0 };
        samples + stated >= fitted + MORE_SAMPLES
    }

    /// A parameter of the case in SI; 0 if it has none of this path.
    pub fn own(&self, path: &str) -> f64 {
        self.case.number(path).map_or(0.0, |number| number.value)
    }

    /// Whether a change of parameters exceeds the error of a method.
    pub fn is_visible(&self, numbers: &[(String, f64)]) -> bool {
        numbers.iter().all(|(path, value)| {
            let own = self.own(path);
            own == 0.0 || (value / own - 1.0).abs() >= LEAST
        })
    }

    fn request<'b>(&self, system: &'b System, threshold: f64, start: &'b TrialStart) -> MotionRequest<'b> {
        MotionRequest {
            system,
            threshold,
            start,
            end: self.covered.1.min(self.end),
            most_events: MOST_EVENTS.0 * self.word.len().max(self.reference.len()) + MOST_EVENTS.1,
            most_steps: self.most_steps,
            shows_contact: self.shows_contact,
            limit: self.limit,
        }
    }

    /// Fixes the time of kicks that wait for a loss of stability, because a run from a later state does not know
    /// whether it was kicked.
    pub fn kicked(&self, system: &System) -> System {
        let mut system = system.clone();
        for kick in &mut system.kicks {
            if let (KickTime::Instability, Some(time)) = (kick.time, self.kicked) {
                kick.time = KickTime::At(time);
            }
        }
        system
    }

    fn begun<'b>(&self, system: &'b System, start: &TrialStart) -> Cow<'b, System> {
        match start {
            TrialStart::Case => Cow::Borrowed(system),
            TrialStart::At(..) => Cow::Owned(self.kicked(system)),
        }
    }

    fn trace(&self, start: usize) -> Option<Traced> {
        let case = self.case.case();
        self.count_run()?;
        let start = self.starts.get(start)?;
        let system = self.begun(&case.system, start);
        self.request(&system, case.threshold, start).traced()
    }

    /// States of the unchanged case from a time (s) and a state on.
    pub fn traced_from(&self, time: f64, state: Vec<f64>) -> Option<Traced> {
        let case = self.case.case();
        self.count_run()?;
        self.request(&case.system, case.threshold, &TrialStart::At(time, state))
            .traced()
    }

    /// The motion of a system from a start, sampled like the candidate.
    pub fn motion(&self, system: &System, threshold: f64, start: &TrialStart) -> Option<Played> {
        self.count_run()?;
        let system = self.begun(system, start);
        let request = self.request(&system, threshold, start);
        match self.observation {
            Some(observation) => request.sampled(self.physics, observation),
            None => request.events(),
        }
    }

    /// The motion of the case, changed by `change`, from a start.
    pub fn with(&self, start: usize, change: impl FnOnce(&mut System)) -> Option<Played> {
        let (case, start) = (self.case.case(), self.starts.get(start)?);
        let mut system = case.system.clone();
        change(&mut system);
        self.motion(&system, case.threshold, start)
    }

    /// The motion of the case with other parameters (paths, and values in SI) from a start.
    pub fn with_numbers(&self, start: usize, changes: &[(String, f64)]) -> Option<Played> {
        let case = self.case.with_all(changes).ok()?;
        self.motion(&case.system, case.threshold, self.starts.get(start)?)
    }

    /// The motion of the unchanged case from a start, sampled like the candidate.
    pub fn unchanged(&self, start: usize) -> Option<Played> {
        let traced = self.unchanged.get(start)?.as_ref()?;
        Some(match self.observation {
            Some(observation) => traced.sampled(&mut self.physics.course(), self.physics, observation),
            None => traced.played.clone(),
        })
    }

    /// The observed channels of the unchanged case from its own start, at other increasing times (s); NaN where the
    /// motion is unknown.
    pub fn unchanged_case_at(&self, times: &[f64]) -> Option<ObservedValues> {
        let traced = self.unchanged.get(self.start_of_case()?)?.as_ref()?;
        let channels = &self.observation?.channels;
        Some(traced.values_at(&mut self.physics.course(), self.physics, channels, times))
    }
}
