//! The loop: segment after segment, until the end.

use super::dips::Dips;
use super::solver::{ChosenSolver, LastStep, Pair, Pool, SolverKind};
use super::{
    Advance, ClosedEnd, Dynamics, Observer, ObserverError, Rules, SegmentReport, Stepper, StepperError, Transition,
};
use crate::sundials::{Counters, Outcome, SolverError, Task};
use std::collections::VecDeque;
use std::sync::Arc;

/// The observer is asked whether to go on after so many steps,
const STEPS_BETWEEN_QUESTIONS: u32 = 256;

/// and after so many samples, which can be far denser than the steps, and take milliseconds each where a solver integrates
/// up to them anew.
const SAMPLES_BETWEEN_QUESTIONS: u32 = 32;

/// So many steps and restarts in a row that do not move the time by its rounding at the end are a standstill.
const STANDSTILL: u32 = 10_000;

/// Steps over which the pace of a run is taken,
const STRIDE: u32 = 100_000;

/// of which a stretch of closed form that is searched in vain is worth so many,
const SEARCH: u32 = 5000;

/// and restarts are steps, too: a run of many short segments may be faster later, and is given more.
const MOST_RESTARTS: f64 = 1e10;

/// Where a run starts.
#[derive(Debug, Clone)]
pub struct Start<L> {
    pub time: f64,
    pub location: L,
    pub state: Vec<f64>,
}

/// What ends a run that does not get on.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Most counted transitions.
    pub max_events: usize,
    /// This many counted transitions within [`Rules::chatter_window`] are chattering.
    pub chatter_count: usize,
    /// Most steps of the solvers.
    pub max_steps: Option<u64>,
    /// A segment whose pace would take it more steps than this is ended.
    pub foreseen_steps: Option<f64>,
}

/// Where a run ended.
#[derive(Debug, Clone)]
pub struct Finish<L> {
    pub time: f64,
    pub location: L,
    pub state: Vec<f64>,
    /// Ended early by the observer.
    pub interrupted: bool,
}

/// Why a run failed.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    #[error("{solver} failed at t = {time:.12} s in {location}: {source}")]
    Solver {
        solver: &'static str,
        time: f64,
        location: String,
        source: SolverError,
    },
    #[error("{solver} failed at t = {time:.12} s in {location}: {source}")]
    Stepper {
        solver: &'static str,
        time: f64,
        location: String,
        source: StepperError,
    },
    #[error(
        "chattering at t = {time:.12} s: {count} transitions {}, the last from {location} by the guard \"{guard}\"",
        duration(*window)
    )]
    Chattering {
        time: f64,
        count: usize,
        window: f64,
        location: String,
        guard: String,
    },
    #[error(
        "the event budget of {budget} transitions is used up at t = {time:.12} s, the last from {location} by the guard \"{guard}\""
    )]
    TooManyEvents {
        time: f64,
        budget: usize,
        location: String,
        guard: String,
    },
    #[error("the state is not finite at t = {time:.12} s in {location}: component {component} is {value}")]
    NotFinite {
        time: f64,
        location: String,
        component: usize,
        value: f64,
    },
    #[error("a value is not finite at t = {time:.12} s in {location}: {what} is {value}")]
    Overflow {
        time: f64,
        location: String,
        what: &'static str,
        value: f64,
    },
    #[error("the budget of {budget} steps is used up at t = {time:.12} s in {location}")]
    TooManySteps { time: f64, budget: u64, location: String },
    #[error("the budget of {budget} s of wall time is used up at t = {time:.12} s in {location}")]
    OutOfTime { time: f64, budget: f64, location: String },
    #[error("the run stands still at t = {time:.12} s in {location}: {why}")]
    Standstill { time: f64, location: String, why: String },
    #[error(
        "the run makes no progress at t = {time:.12} s in {location}: the last {STRIDE} steps of {solver} came {covered:.1e} s \
         on, and {ahead:.1e} s lie ahead, more than {most:.0e} such steps"
    )]
    NoProgress {
        time: f64,
        location: String,
        solver: &'static str,
        covered: f64,
        ahead: f64,
        most: f64,
    },
    #[error(transparent)]
    Observer(ObserverError),
}

/// What an observer says of a value that is not finite: a failure of the run, and not of the observer.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {value} at t = {time:.12} s")]
pub struct Overflow {
    pub time: f64,
    pub what: &'static str,
    pub value: f64,
}

impl RunError {
    /// The error of an observer in a location.
    pub(crate) fn observed(error: ObserverError, location: impl FnOnce() -> String) -> RunError {
        match error.downcast::<Overflow>() {
            Ok(overflow) => RunError::Overflow {
                time: overflow.time,
                location: location(),
                what: overflow.what,
                value: overflow.value,
            },
            Err(error) => RunError::Observer(error),
        }
    }
}

fn duration(window: f64) -> String {
    if window > 0.0 {
        format!("within {window:.1e} s")
    } else {
        "at one instant".to_owned()
    }
}

/// How a segment ended.
enum SegmentEnd {
    /// Guards fired.
    Guards(Vec<usize>),
    /// It reached its stop time.
    Stop,
    /// The search for its guards came so far, and goes on from there.
    Search,
    /// The observer asked for an end.
    Interrupted,
}

/// Integrates from `start` to `end_time`.
pub fn run<D, R, O>(
    dynamics: &Arc<D>,
    rules: &mut R,
    start: Start<D::Location>,
    end_time: f64,
    limits: Limits,
    observer: &mut O,
) -> Result<Finish<D::Location>, RunError>
where
    D: Dynamics,
    R: Rules<D>,
    O: Observer<D::Location, R::Kind>,
{
    let mut run = Run {
        dynamics: dynamics.clone(),
        pool: Pool::new(dynamics.clone()),
        stepper: None,
        observer,
        limits,
        counted: 0,
        recent: VecDeque::with_capacity(limits.chatter_count + 1),
        time: start.time,
        location: start.location,
        state: start.state,
        sampled: 0,
        interrupted_at: None,
        sample: vec![0.0; dynamics.dimension()],
        pace: Pace::new(start.time, end_time),
    };
    let interrupted = run.to(end_time, rules)?;
    Ok(Finish {
        time: run.time,
        location: run.location,
        state: run.state,
        interrupted,
    })
}

struct Run<'a, D: Dynamics, O> {
    dynamics: Arc<D>,
    pool: Pool<D>,
    /// The model's own solver, once it has been needed.
    stepper: Option<Box<dyn Stepper<D::Location>>>,
    observer: &'a mut O,
    limits: Limits,
    counted: usize,
    /// Times of the last counted transitions.
    recent: VecDeque<f64>,
    time: f64,
    location: D::Location,
    state: Vec<f64>,
    /// Samples handed out.
    sampled: u32,
    /// The sample at which the observer asked for an end.
    interrupted_at: Option<f64>,
    /// Scratch for interpolated states.
    sample: Vec<f64>,
    pace: Pace,
}

/// How fast a run gets on.
struct Pace {
    end_time: f64,
    /// All steps.
    steps: u64,
    /// The last time that the run has come on to, and steps and restarts since.
    came_to: f64,
    idle: u32,
    /// Where the present stride began, its steps and restarts, and whether the segment is another one since.
    from: f64,
    taken: u32,
    restarted: bool,
}

impl Pace {
    fn new(start: f64, end_time: f64) -> Self {
        Pace {
            end_time,
            steps: 0,
            came_to: start,
            idle: 0,
            from: start,
            taken: 0,
            restarted: false,
        }
    }
}

impl<D: Dynamics, O> Run<'_, D, O> {
    fn to<R>(&mut self, end_time: f64, rules: &mut R) -> Result<bool, RunError>
    where
        R: Rules<D>,
        O: Observer<D::Location, R::Kind>,
    {
        loop {
            let mut stop = end_time;
            while let Some(next) = rules.next_time_event(&self.location, self.time) {
                if next > self.time {
                    stop = stop.min(next);
                    break;
                }
                let transitions = rules.at_time_event(&self.location, self.time, &self.state);
                let in_vain = transitions.is_empty();
                self.apply(rules, transitions, "a time event")?;
                if in_vain {
                    self.get_on(end_time, "the search for the next event", STRIDE)?;
                } else {
                    self.count_restart()?;
                }
            }
            if self.time >= end_time {
                break;
            }
            let chosen = rules.solver(&self.location);
            let (start, location) = (self.time, self.location);
            let (end, counters) = match chosen.kind {
                SolverKind::ClosedForm => (self.closed_segment::<R>(stop), Counters::default()),
                SolverKind::Series => match self.stepped_segment::<R>(&chosen, stop) {
                    Ok((end, counters)) => (Ok(end), counters),
                    Err(error) => (Err(error), Counters::default()),
                },
                _ => match self.solved_segment::<R>(&chosen, stop) {
                    Ok((end, counters)) => (Ok(end), counters),
                    Err(error) => (Err(error), Counters::default()),
                },
            };
            if let Err(RunError::Observer(error)) = end {
                return Err(RunError::Observer(error));
            }
            // Samples up to there have been handed out.
            if let Err(RunError::Overflow { time, .. }) = &end {
                self.time = self.time.max(*time);
            }
            // Before a failure is passed on: what was sampled until then has its segment, too.
            let report = SegmentReport {
                start,
                end: self.time,
                location,
                solver: chosen.kind,
                counters,
            };
            self.observer.segment(&report).map_err(|error| self.observed(error))?;
            let mut searching = false;
            match end? {
                SegmentEnd::Stop => {}
                SegmentEnd::Search => searching = true,
                SegmentEnd::Interrupted => return Ok(true),
                SegmentEnd::Guards(fired) => {
                    let transitions = rules.at_guards(&self.location, self.time, &self.state, &fired);
                    let name = fired.first().map_or("", |&k| self.dynamics.guards(&location)[k].name);
                    self.apply(rules, transitions, name)?;
                }
            }
            if self.observer.progress(self.time, &self.location).is_break() {
                return Ok(true);
            }
            if searching {
                self.get_on(stop, "the search for a breakaway", SEARCH)?;
            } else {
                self.count_restart()?;
            }
        }
        self.samples_until::<R>(self.time, true, |run, _| {
            run.sample.copy_from_slice(&run.state);
            Ok(())
        })?;
        Ok(false)
    }

    /// A segment by its closed form.
    fn closed_segment<R>(&mut self, stop: f64) -> Result<SegmentEnd, RunError>
    where
        R: Rules<D>,
        O: Observer<D::Location, R::Kind>,
    {
        let (start, state) = (self.time, self.state.clone());
        let span = stop - start;
        let dynamics = self.dynamics.clone();
        let location = self.location;
        let (after, end) = match dynamics.closed_end(&location, start, &state, span) {
            ClosedEnd::Guard { after, index } if after < span => (after, SegmentEnd::Guards(vec![index])),
            // The run goes on with a new segment.
            ClosedEnd::Unknown { after } if start + after < stop => (after, SegmentEnd::Search),
            _ => (span, SegmentEnd::Stop),
        };
        let end_time = if after < span { start + after } else { stop };
        self.samples_until::<R>(end_time, false, |run, t| {
            dynamics.closed_state(&location, start, &state, t - start, &mut run.sample);
            Ok(())
        })?;
        if let Some(t) = self.interrupted_at {
            self.time = t;
            self.state.copy_from_slice(&self.sample);
            return Ok(SegmentEnd::Interrupted);
        }
        dynamics.closed_state(&location, start, &state, after, &mut self.state);
        self.time = end_time;
        self.check_finite()?;
        Ok(end)
    }

    /// A segment by the model's own solver.
    fn stepped_segment<R>(&mut self, chosen: &ChosenSolver, stop: f64) -> Result<(SegmentEnd, Counters), RunError>
    where
        R: Rules<D>,
        O: Observer<D::Location, R::Kind>,
    {
        let (start, location) = (self.time, self.location);
        let own = self.stepper.take();
        let mut stepper = own.unwrap_or_else(|| D::stepper(self.dynamics.clone()));
        stepper.begin(&location, start, &self.state, stop - start, chosen);
        let mut steps = 0u32;
        let end = loop {
            let advance = stepper.advance().map_err(|source| RunError::Stepper {
                solver: chosen.kind.name(),
                time: self.time,
                location: self.dynamics.describe(&location),
                source,
            })?;
            self.state.copy_from_slice(stepper.state());
            let end = match advance {
                Advance::Stepped => None,
                Advance::Stop => Some(SegmentEnd::Stop),
                Advance::Guard(index) => Some(SegmentEnd::Guards(vec![index])),
            };
            let at_stop = matches!(end, Some(SegmentEnd::Stop));
            self.time = if at_stop { stop } else { start + stepper.time() };
            self.samples_until::<R>(self.time, false, |run, t| {
                stepper.state_at(t - start, &mut run.sample);
                Ok(())
            })?;
            if let Some(t) = self.interrupted_at {
                self.time = t;
                self.state.copy_from_slice(&self.sample);
                break SegmentEnd::Interrupted;
            }
            if let Some(end) = end {
                break end;
            }
            if self.observer.wants_steps() {
                self.observer
                    .step(self.time, &location, &self.state)
                    .map_err(|error| self.observed(error))?;
            }
            self.count_step(stop, chosen.kind.name())?;
            steps = steps.wrapping_add(1);
            if steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS) && self.observer.progress(self.time, &location).is_break()
            {
                break SegmentEnd::Interrupted;
            }
        };
        let counters = stepper.counters();
        self.stepper = Some(stepper);
        self.check_finite()?;
        Ok((end, counters))
    }

    /// A segment by a solver.
    fn solved_segment<R>(&mut self, chosen: &ChosenSolver, stop: f64) -> Result<(SegmentEnd, Counters), RunError>
    where
        R: Rules<D>,
        O: Observer<D::Location, R::Kind>,
    {
        let (start, location) = (self.time, self.location);
        let span = stop - start;
        let dynamics = self.dynamics.clone();
        let failed = |time: f64, source| RunError::Solver {
            solver: chosen.kind.name(),
            time,
            location: dynamics.describe(&location),
            source,
        };
        // The solver stays borrowed from the pool while samples go to the observer.
        let mut pool = std::mem::replace(&mut self.pool, Pool::new(self.dynamics.clone()));
        let result = (|| {
            let mut pair = pool
                .prepare(chosen, location, start, &self.state, span)
                .map_err(|e| failed(start, e))?;
            let mut last_step = LastStep::new(&self.state);
            let mut dips = Dips::new(&*dynamics, &location);
            let mut steps = 0u32;
            let end = loop {
                let outcome = pair
                    .solver
                    .advance(span, Task::OneStep)
                    .map_err(|e| failed(self.time, e))?;
                let mut tau = pair.solver.time();
                let mut end = None;
                if outcome == Outcome::Roots {
                    let found = pair.solver.crossings_found();
                    let fired: Vec<usize> = found
                        .iter()
                        .enumerate()
                        .filter(|(_, c)| c.is_some())
                        .map(|(k, _)| k)
                        .collect();
                    tau = self
                        .refine_root(&mut pair, &last_step, start, fired[0])
                        .map_err(|e| failed(start + tau, e))?;
                    end = Some(SegmentEnd::Guards(fired));
                } else {
                    self.state.copy_from_slice(pair.solver.state());
                    if tau >= span {
                        end = Some(SegmentEnd::Stop);
                    }
                }
                let dip = dips.in_step(&*dynamics, &mut pair, &last_step, start, (tau, &self.state));
                if let Some(dip) = dip.map_err(|e| failed(start + tau, e))? {
                    tau = dip.time;
                    last_step
                        .state_at(&mut pair, tau, &mut self.state)
                        .map_err(|e| failed(start + tau, e))?;
                    end = Some(SegmentEnd::Guards(vec![dip.guard]));
                }
                self.time = if matches!(end, Some(SegmentEnd::Stop)) {
                    stop
                } else {
                    start + tau
                };
                self.samples_until::<R>(self.time, false, |run, t| {
                    last_step
                        .state_at(&mut pair, (t - start).min(tau), &mut run.sample)
                        .map_err(|e| failed(t, e))
                })?;
                if let Some(t) = self.interrupted_at {
                    self.time = t;
                    self.state.copy_from_slice(&self.sample);
                    break SegmentEnd::Interrupted;
                }
                if let Some(end) = end {
                    break end;
                }
                if self.observer.wants_steps() {
                    self.observer
                        .step(self.time, &location, &self.state)
                        .map_err(|error| self.observed(error))?;
                }
                last_step.advance(tau, &self.state);
                self.count_step(stop, chosen.kind.name())?;
                steps = steps.wrapping_add(1);
                if steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS)
                    && self.observer.progress(self.time, &location).is_break()
                {
                    break SegmentEnd::Interrupted;
                }
            };
            let counters = pair.solver.counters().map_err(|e| failed(self.time, e))?;
            Ok((end, counters))
        })();
        self.pool = pool;
        let result = result?;
        self.check_finite()?;
        Ok(result)
    }

    /// The root that the solver has found in its last step, to the accuracy of the method; leaves the state there in
    /// `self.state` and returns its time on the segment's clock.
    ///
    /// Without a probe that is what the solver returned. With one it is Newton's method on the repeated step, from the
    /// root of the dense output.
    fn refine_root(
        &mut self,
        pair: &mut Pair<'_, D>,
        last_step: &LastStep,
        start: f64,
        guard: usize,
    ) -> Result<f64, SolverError> {
        let mut tau = pair.solver.time();
        self.state.copy_from_slice(pair.solver.state());
        if pair.probe.is_none() {
            return Ok(tau);
        }
        let end = pair.solver.mesh_time()?;
        let guards = self.dynamics.guards(&self.location).len();
        let (mut values, mut ahead) = (vec![0.0; guards], vec![0.0; guards]);
        let mut rates = vec![0.0; self.state.len()];
        for _ in 0..4 {
            last_step.state_at(pair, tau, &mut self.state)?;
            let (t, dynamics, location) = (start + tau, &self.dynamics, &self.location);
            dynamics.guard_values(location, t, &self.state, &mut values);
            dynamics.rhs(location, t, &self.state, &mut rates);
            // The guard's derivative along the flow, by a step far shorter than any time scale of the solution.
            let probe_step = 1e-6 * (end - last_step.start());
            for (y, (state, rate)) in self.sample.iter_mut().zip(self.state.iter().zip(&rates)) {
                *y = state + probe_step * rate;
            }
            dynamics.guard_values(location, t + probe_step, &self.sample, &mut ahead);
            let slope = (ahead[guard] - values[guard]) / probe_step;
            let next = tau - values[guard] / slope;
            // A slope of nothing, or a correction out of the step: the root is a grazing one, and stays where it is.
            if !(next > last_step.start() && next <= end) {
                break;
            }
            let change = (next - tau).abs();
            if change <= 4.0 * f64::EPSILON * end {
                break;
            }
            tau = next;
        }
        Ok(tau)
    }

    /// Hands out the samples due before `t` (and at it, if `inclusive`); `fill` puts the state into `self.sample`.
    fn samples_until<R>(
        &mut self,
        t: f64,
        inclusive: bool,
        mut fill: impl FnMut(&mut Self, f64) -> Result<(), RunError>,
    ) -> Result<(), RunError>
    where
        R: Rules<D>,
        O: Observer<D::Location, R::Kind>,
    {
        loop {
            let due = self.observer.next_sample_time();
            // A time that is no number is never reached.
            if !(due < t || (due == t && inclusive)) {
                return Ok(());
            }
            fill(self, due)?;
            self.observer
                .sample(due, &self.location, &self.sample)
                .map_err(|error| self.observed(error))?;
            self.sampled = self.sampled.wrapping_add(1);
            if self.sampled.is_multiple_of(SAMPLES_BETWEEN_QUESTIONS)
                && self.observer.progress(due, &self.location).is_break()
            {
                self.interrupted_at = Some(due);
                return Ok(());
            }
        }
    }

    fn apply<R>(
        &mut self,
        rules: &R,
        transitions: Vec<Transition<R::Kind, D::Location>>,
        guard: &str,
    ) -> Result<(), RunError>
    where
        R: Rules<D>,
        O: Observer<D::Location, R::Kind>,
    {
        for transition in transitions {
            if let Some(kind) = transition.kind {
                self.observer
                    .event(
                        self.time,
                        kind,
                        (&self.location, &self.state),
                        (&transition.location, &transition.state),
                    )
                    .map_err(|error| self.observed(error))?;
                if rules.counts(&kind) {
                    self.count(rules, guard)?;
                }
            }
            self.location = transition.location;
            self.state = transition.state;
        }
        Ok(())
    }

    fn count<R: Rules<D>>(&mut self, rules: &R, guard: &str) -> Result<(), RunError> {
        self.counted += 1;
        let location = || self.dynamics.describe(&self.location);
        if self.counted > self.limits.max_events {
            return Err(RunError::TooManyEvents {
                time: self.time,
                budget: self.limits.max_events,
                location: location(),
                guard: guard.to_owned(),
            });
        }
        self.recent.push_back(self.time);
        if self.recent.len() > self.limits.chatter_count {
            self.recent.pop_front();
            let window = self.time - self.recent[0];
            if window < rules.chatter_window() {
                return Err(RunError::Chattering {
                    time: self.time,
                    count: self.recent.len(),
                    window,
                    location: location(),
                    guard: guard.to_owned(),
                });
            }
        }
        Ok(())
    }

    fn observed(&self, error: ObserverError) -> RunError {
        RunError::observed(error, || self.dynamics.describe(&self.location))
    }

    /// Counts a step of a segment that ends at `stop`.
    fn count_step(&mut self, stop: f64, solver: &'static str) -> Result<(), RunError> {
        self.pace.steps += 1;
        if let Some(budget) = self.limits.max_steps.filter(|&budget| self.pace.steps > budget) {
            return Err(RunError::TooManySteps {
                time: self.time,
                budget,
                location: self.dynamics.describe(&self.location),
            });
        }
        self.get_on(stop, solver, 1)
    }

    /// Counts the end of a segment, or what is done at an instant.
    fn count_restart(&mut self) -> Result<(), RunError> {
        self.pace.restarted = true;
        self.get_on(self.pace.end_time, "the solvers", 1)
    }

    /// Ends a run that does not come on; `taken` says how many steps it has taken for this.
    fn get_on(&mut self, stop: f64, solver: &'static str, taken: u32) -> Result<(), RunError> {
        let pace = &mut self.pace;
        if self.time > pace.came_to + f64::EPSILON * pace.end_time {
            (pace.came_to, pace.idle) = (self.time, 0);
        } else {
            pace.idle += 1;
        }
        if pace.idle > STANDSTILL {
            return Err(RunError::Standstill {
                time: pace.came_to,
                location: self.dynamics.describe(&self.location),
                why: format!("{STANDSTILL} steps and restarts in a row have not moved the time"),
            });
        }
        pace.taken += taken;
        if pace.taken < STRIDE {
            return Ok(());
        }
        let covered = self.time - pace.from;
        let (ahead, most) = if pace.restarted {
            (
                pace.end_time - self.time,
                self.limits.foreseen_steps.map(|_| MOST_RESTARTS),
            )
        } else {
            (stop - self.time, self.limits.foreseen_steps)
        };
        (pace.from, pace.taken, pace.restarted) = (self.time, 0, false);
        match most {
            Some(most) if ahead * f64::from(STRIDE) > covered * most => Err(RunError::NoProgress {
                time: self.time,
                location: self.dynamics.describe(&self.location),
                solver,
                covered,
                ahead,
                most,
            }),
            _ => Ok(()),
        }
    }

    fn check_finite(&self) -> Result<(), RunError> {
        match self.state.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            None => Ok(()),
            Some((component, &value)) => Err(RunError::NotFinite {
                time: self.time,
                location: self.dynamics.describe(&self.location),
                component,
                value,
            }),
        }
    }
}
