//! The loop: segment after segment, until the end.

use super::budget::{Limits, StepBudget};
use super::engine::Engines;
use super::{
    Advance, ChosenSolver, Engine, EngineSegment, Fired, Observer, Rules, SegmentReport, SystemDynamics,
    SystemLocation, Transition,
};
use crate::error::{Error, ErrorKind, ErrorPlace};
use crate::sundials::Counters;
use std::sync::Arc;

/// Steps between two stop checks by the observer.
const STEPS_BETWEEN_QUESTIONS: u32 = 256;

/// Samples between two stop checks. Samples can be far denser than steps, and cost milliseconds each if a solver
/// integrates up to them again.
const SAMPLES_BETWEEN_QUESTIONS: u32 = 32;

/// Start of a run.
#[derive(Debug, Clone)]
pub struct Start {
    /// Start time, s.
    pub time: f64,
    /// Initial location.
    pub location: SystemLocation,
    /// Initial state, of length [`SystemDynamics::dimension`].
    pub state: Vec<f64>,
}

/// End of a run.
#[derive(Debug, Clone)]
pub struct Finish {
    /// End time, s.
    pub time: f64,
    /// Final location.
    pub location: SystemLocation,
    /// Whether the observer ended the run early.
    pub interrupted: bool,
}

enum SegmentEnd {
    Guards(Fired),
    Stop,
    Searched,
    Interrupted,
}

/// Integrates from `start` to `end_time`. Samples, events and segments before a failure have been handed out.
pub fn run(
    dynamics: &Arc<SystemDynamics>,
    rules: &mut dyn Rules,
    start: Start,
    end_time: f64,
    limits: Limits,
    observer: &mut dyn Observer,
) -> Result<Finish, Error> {
    let mut run = HybridRun {
        dynamics: dynamics.clone(),
        rules,
        engines: Engines::new(dynamics.clone()),
        observer,
        budget: StepBudget::new(limits, start.time, end_time),
        time: start.time,
        location: start.location,
        state: start.state,
        sampled: 0,
        interrupted_at: None,
        sample: vec![0.0; dynamics.dimension()],
    };
    let interrupted = run.to(end_time)?;
    Ok(Finish {
        time: run.time,
        location: run.location,
        interrupted,
    })
}

struct HybridRun<'a> {
    dynamics: Arc<SystemDynamics>,
    rules: &'a mut dyn Rules,
    engines: Engines,
    observer: &'a mut dyn Observer,
    budget: StepBudget,
    time: f64,
    location: SystemLocation,
    state: Vec<f64>,
    sampled: u32,
    interrupted_at: Option<f64>,
    sample: Vec<f64>,
}

impl HybridRun<'_> {
    fn to(&mut self, end_time: f64) -> Result<bool, Error> {
        loop {
            let mut stop = end_time;
            while let Some(next) = self.rules.next_time_event(&self.location, self.time) {
                if next > self.time {
                    stop = stop.min(next);
                    break;
                }
                let transitions = self.rules.at_time_event(&self.location, self.time, &self.state);
                let in_vain = transitions.is_empty();
                self.apply(transitions, "a time event")?;
                if in_vain {
                    self.counted(|budget, place| budget.search_for_time_event(place))?;
                } else {
                    self.counted(StepBudget::restart)?;
                }
            }
            if self.time >= end_time {
                break;
            }
            let location = self.location;
            let searched = match self.segment(stop)? {
                SegmentEnd::Stop => false,
                SegmentEnd::Searched => true,
                SegmentEnd::Interrupted => return Ok(true),
                SegmentEnd::Guards(fired) => {
                    let transitions = self.rules.at_guards(&location, self.time, &self.state, fired);
                    let name = self.dynamics.guards(&location)[fired.first()].name;
                    self.apply(transitions, name)?;
                    false
                }
            };
            if self.observer.progress(self.time, &self.location).is_break() {
                return Ok(true);
            }
            if searched {
                self.counted(|budget, place| budget.search(place, stop))?;
            } else {
                self.counted(StepBudget::restart)?;
            }
        }
        self.samples_until(self.time, true, |run, _| {
            run.sample.copy_from_slice(&run.state);
            Ok(())
        })?;
        Ok(false)
    }

    fn segment(&mut self, stop: f64) -> Result<SegmentEnd, Error> {
        let (start, location, state) = (self.time, self.location, self.state.clone());
        let chosen = &self.rules.solver(&location, start, &state);
        let segment = EngineSegment {
            location,
            start,
            stop,
            state: &state,
        };
        let engine = self.engines.take(chosen, &segment, &*self.rules);
        let solver = chosen.kind.name();
        let (end, counters) = match engine.map_err(|source| self.place(start).failed(solver, source)) {
            Ok(mut engine) => {
                let end = self.advance(&mut *engine, &segment, chosen);
                let counters = engine.counters();
                self.engines.put(chosen, engine);
                match (end, counters) {
                    (Ok(end), Ok(counters)) => (Ok(end), counters),
                    (Ok(_), Err(source)) => (Err(self.place(self.time).failed(solver, source)), Counters::default()),
                    (Err(error), _) => (Err(error), Counters::default()),
                }
            }
            Err(error) => (Err(error), Counters::default()),
        };
        match &end {
            Err(error) if error.kind == ErrorKind::Recorder => return end,
            Err(error) if error.kind == ErrorKind::Overflow => self.time = self.time.max(error.time),
            _ => {}
        }
        // Reported before a failure is returned, so that the samples before the failure have their segment.
        let report = SegmentReport {
            start,
            end: self.time,
            location,
            solver: chosen.kind,
            counters,
        };
        self.observer.segment(&report)?;
        end
    }

    fn advance(
        &mut self,
        engine: &mut dyn Engine,
        segment: &EngineSegment<'_>,
        chosen: &ChosenSolver,
    ) -> Result<SegmentEnd, Error> {
        let (start, solver) = (segment.start, chosen.kind.name());
        let begun = engine.begin(segment, chosen);
        begun.map_err(|source| self.place(start).failed(solver, source))?;
        let mut steps = 0u32;
        let end = loop {
            let from = self.time;
            let advance = engine.advance();
            let advance = advance.map_err(|source| self.place(from).failed(solver, source))?;
            self.state.copy_from_slice(engine.state());
            self.time = match advance {
                Advance::Stop => segment.stop,
                _ => start + engine.time(),
            };
            if let Some((tau, guard)) = engine.grazed() {
                let guard = &self.dynamics.guards(&segment.location)[guard];
                self.observer.grazed(start + tau, &segment.location, guard);
            }
            if self.observer.wants_inside() && self.time > from {
                let place = self.place(self.time);
                let mut at = |t: f64, out: &mut [f64]| {
                    let inside = engine.state_at(t - start, out);
                    inside.map_err(|source| place.failed(solver, source))
                };
                self.observer.inside(from, self.time, &segment.location, &mut at)?;
            }
            self.samples_until(self.time, false, |run, t| {
                let inside = engine.state_at(t - start, &mut run.sample);
                inside.map_err(|source| run.place(t).failed(solver, source))
            })?;
            if let Some(t) = self.interrupted_at {
                self.time = t;
                self.state.copy_from_slice(&self.sample);
                break SegmentEnd::Interrupted;
            }
            match advance {
                Advance::Stepped => {}
                Advance::Stop => break SegmentEnd::Stop,
                Advance::Guards(fired) => break SegmentEnd::Guards(fired),
                Advance::Searched => break SegmentEnd::Searched,
            }
            if self.observer.wants_steps() {
                self.observer.step(self.time, &segment.location, &self.state)?;
            }
            self.counted(|budget, place| budget.step(place, segment.stop, solver))?;
            steps = steps.wrapping_add(1);
            if steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS)
                && self.observer.progress(self.time, &segment.location).is_break()
            {
                break SegmentEnd::Interrupted;
            }
        };
        self.place(self.time).check_finite(&self.state)?;
        Ok(end)
    }

    fn samples_until(
        &mut self,
        t: f64,
        inclusive: bool,
        mut fill: impl FnMut(&mut Self, f64) -> Result<(), Error>,
    ) -> Result<(), Error> {
        loop {
            let due = self.observer.next_sample_time();
            // A NaN is never reached.
            if !(due < t || (due == t && inclusive)) {
                return Ok(());
            }
            fill(self, due)?;
            self.observer.sample(due, &self.location, &self.sample)?;
            self.sampled = self.sampled.wrapping_add(1);
            if self.sampled.is_multiple_of(SAMPLES_BETWEEN_QUESTIONS)
                && self.observer.progress(due, &self.location).is_break()
            {
                self.interrupted_at = Some(due);
                return Ok(());
            }
        }
    }

    fn apply(&mut self, transitions: Vec<Transition>, guard: &str) -> Result<(), Error> {
        for transition in transitions {
            if let Some(kind) = transition.kind {
                let (before, after) = (
                    (&self.location, &self.state[..]),
                    (&transition.location, &transition.state[..]),
                );
                self.observer.event(self.time, kind, before, after)?;
                if kind.in_event_sequence() {
                    self.budget.transition(self.place(self.time), guard)?;
                }
            }
            self.location = transition.location;
            self.state = transition.state;
            if let Some(what) = self.rules.outside(&self.location, self.time, &self.state) {
                return Err(self.place(self.time).outside(&what));
            }
        }
        Ok(())
    }

    fn counted(&mut self, count: impl FnOnce(&mut StepBudget, ErrorPlace) -> Result<(), Error>) -> Result<(), Error> {
        let place = self.place(self.time);
        count(&mut self.budget, place)
    }

    fn place(&self, time: f64) -> ErrorPlace {
        let mode = self.location.mode;
        ErrorPlace { time, mode }
    }
}
