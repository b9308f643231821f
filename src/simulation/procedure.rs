//! The paper's own procedure, to be studied beside the reference runs: absolute angles, a Runge-Kutta method of order 5
//! with steps from 1e-8 to 1e-4 s, and the state of the contact by equation (9), tested at the end of each step.
//!
//! Nothing is located. An event has the time of the step's end at which (9) says something else than before, and
//! where omega_r passes zero by more than epsilon within a step, the friction turns its sign inside the right-hand side
//! until a step happens to end within epsilon of zero. Each such turn is recorded as a reversal.
//!
//! What the paper leaves open is filled in as an ordinary program would have it: Dormand and Prince's pair; the tolerance is
//! absolute, on the error estimate of every component in SI units and radians; a step of the least length is taken
//! whatever its error; entering stick gives both surfaces their mean speed, as (4) has one speed for both; the torque in
//! (10) is that of the case's `contact.breakaway_test`. Kicks are the only times that a step is shortened for.

use super::observer::Recording;
use super::options::{OutputOptions, SolverOptions};
use super::readings::AbsoluteReadings;
use super::report::{Progress, RunFailure, RunReport};
use super::runge_kutta::EmbeddedPair;
use super::{Problem, Watch};
use crate::friction::Law;
use crate::hybrid::{Observer, ObserverError, RunError, Start};
use crate::model::absolute_angles::{AbsoluteModel, AbsoluteState, DIMENSION, UNKNOWNS};
use crate::model::{KickTime, Mode};
use crate::record::{EventDigest, EventKind, Recorder};
use crate::sundials::{Counters, ErkTable};
use std::ops::ControlFlow;

/// The pair of order 5.
pub(crate) const PAIR: ErkTable = ErkTable::DormandPrince7s45;

/// epsilon of equation (9), rad/s.
pub const EPSILON: f64 = 1e-5;

/// The shortest and the longest step, s.
pub const STEPS: (f64, f64) = (1e-8, 1e-4);

/// The tolerance on the error estimate as a multiple of `solver.rtol`: the paper's 1e-11 by default.
const TOLERANCE_SHARE: f64 = 0.1;

/// Usual bounds of a step control: a step is aimed at this share of what the tolerance allows,
const SAFETY: f64 = 0.9;

/// and changes at most by these factors.
const CHANGE: (f64, f64) = (0.2, 5.0);

/// The control is asked whether to go on after so many steps.
const STEPS_BETWEEN_QUESTIONS: u64 = 256;

/// The name in result files.
pub(crate) const SOLVER: &str = "paper";

/// What a run by the procedure is stepped with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest error estimate of a step in any component, in its SI unit.
    pub tolerance: f64,
    /// s.
    pub shortest_step: f64,
    /// s.
    pub longest_step: f64,
}

impl Settings {
    /// Of a run with these options.
    pub fn new(solver: &SolverOptions) -> Self {
        let longest_step = solver.max_step.map_or(STEPS.1, |step| step.min(STEPS.1));
        Settings {
            tolerance: TOLERANCE_SHARE * solver.rtol,
            shortest_step: STEPS.0.min(longest_step),
            longest_step,
        }
    }
}

/// Why the procedure is refused.
pub(crate) const FOREIGN: &str = "method \"paper\" is the procedure of the paper for its two alike disks, a free rotor on a shaft and a surface on an equal shaft that \
     ends in the ground, pressed by an axial motion: take another for this case";

/// Integrates a system by the procedure; the counterpart of [`super::simulate()`], with the same contract. A system that is not the
/// paper's pair of disks is refused.
pub(crate) fn run(
    problem: Problem<'_>,
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    control: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<RunReport, Box<RunFailure>> {
    let system = problem.system;
    let Some(model) = AbsoluteModel::new(system) else {
        let error = RunError::Refused(FOREIGN);
        let report = RunReport::default();
        return Err(Box::new(RunFailure { error, report }));
    };
    let state = model.start();
    let mode = if model.force.starts_positive() {
        model.contact(&state, false, EPSILON)
    } else {
        Mode::Separated
    };
    let readings = AbsoluteReadings {
        model: &model,
        further: problem.further,
    };
    let (mut kicks, mut waiting_kicks) = (Vec::new(), Vec::new());
    for kick in &system.kicks {
        match kick.time {
            KickTime::At(time) => kicks.push((time, kick.relative_velocity)),
            KickTime::Instability => waiting_kicks.push(kick.relative_velocity),
        }
    }
    kicks.sort_by(|a, b| a.0.total_cmp(&b.0));
    let watch = if mode == Mode::Stick { Watch::Off } else { Watch::Stable };
    let digest = EventDigest::new(Some(model.natural_period()));
    let start = Start {
        time: 0.0,
        location: mode,
        state: state.to_vec(),
    };
    let recording = Recording::new(readings, digest, (solver, output), recorder, control, &start);
    let mut run = Run {
        model: &model,
        pair: EmbeddedPair::new(PAIR, UNKNOWNS),
        settings: Settings::new(solver),
        recording,
        time: 0.0,
        state,
        mode,
        watch,
        kicks,
        next_kick: 0,
        waiting_kicks,
        corner: model.force.next_corner(0.0),
        segment_start: 0.0,
        counters: Counters::default(),
        counted: 0,
        max_events: solver.max_events,
        max_steps: solver.max_steps.map(|steps| steps as u64),
    };
    let result = match run.to(output.end_time) {
        Ok(true) => run.recording.in_time(run.time, &run.mode).map(|()| true),
        other => other,
    };
    let waiting = run.waiting_kicks.len();
    let end = run.time;
    let mut report = run.recording.into_report();
    report.count_kicks(system.kicks.len(), waiting);
    match result {
        Ok(interrupted) => {
            report.end = end;
            report.interrupted = interrupted;
            Ok(report)
        }
        Err(error) => Err(Box::new(RunFailure { error, report })),
    }
}

struct Run<'a> {
    model: &'a AbsoluteModel,
    pair: EmbeddedPair<DIMENSION>,
    settings: Settings,
    recording: Recording<'a, AbsoluteReadings<'a>>,
    time: f64,
    state: AbsoluteState,
    mode: Mode,
    watch: Watch,
    /// Timed kicks in order, and which is next.
    kicks: Vec<(f64, f64)>,
    next_kick: usize,
    /// Kicks waiting for the loss of stability.
    waiting_kicks: Vec<f64>,
    /// The next corner of F(t).
    corner: Option<f64>,
    segment_start: f64,
    counters: Counters,
    counted: usize,
    max_events: usize,
    max_steps: Option<u64>,
}

impl Run<'_> {
    /// Steps to `end`; whether the control ended the run earlier.
    fn to(&mut self, end: f64) -> Result<bool, RunError> {
        let mut proposed = self.settings.shortest_step;
        let mut steps = 0u64;
        while self.time < end {
            self.kick_now()?;
            let kick = self.kicks.get(self.next_kick).map_or(f64::INFINITY, |k| k.0);
            let stop = end.min(kick);
            let (step, next) = self.step(proposed, stop);
            let before = (self.time, self.state);
            // What is left before a stop is not worth a step of its own if it is of the size of rounding.
            self.time = if step >= stop - before.0 { stop } else { before.0 + step };
            if self.time <= before.0 {
                return Err(self.stuck());
            }
            self.state = self.pair.solution;
            proposed = next;
            self.samples(before, step)?;
            self.check_finite()?;
            self.check_law()?;
            self.end_of_step()?;
            steps += 1;
            let mode = self.mode;
            if let Some(budget) = self.max_steps.filter(|&budget| steps > budget) {
                return Err(RunError::TooManySteps {
                    time: self.time,
                    budget,
                    location: describe(mode),
                });
            }
            if self.recording.wants_steps() && self.time < end {
                self.recording
                    .step(self.time, &mode, &self.state)
                    .map_err(|error| observed(error, mode))?;
            }
            if steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS) && self.recording.progress(self.time, &mode).is_break() {
                self.end_segment()?;
                return Ok(true);
            }
        }
        self.end_segment()?;
        while self.recording.next_sample_time() <= end {
            let mode = self.mode;
            let due = self.recording.next_sample_time();
            self.recording
                .sample(due, &mode, &self.state)
                .map_err(|error| observed(error, mode))?;
        }
        Ok(false)
    }

    /// Takes a step of the pair that passes the test, or is of the least length; at most to `stop`. Returns its length and
    /// the proposal for the next.
    fn step(&mut self, proposed: f64, stop: f64) -> (f64, f64) {
        let Settings {
            tolerance,
            shortest_step,
            longest_step,
        } = self.settings;
        let left = stop - self.time;
        let mut step = proposed;
        loop {
            let taken = step.min(left);
            let (model, mode) = (self.model, self.mode);
            let error = self.pair.step(self.time, &self.state, taken, |t, y, dydt| {
                model.rhs(mode, t, y, dydt);
            });
            self.counters.rhs_evaluations += self.pair.slopes.len() as u64;
            // An error that is no number asks for the shortest step that is tried.
            let wanted = if error.is_finite() {
                let share = (error / tolerance).max(1e-30);
                taken * (SAFETY * share.powf(-1.0 / f64::from(self.pair.order))).clamp(CHANGE.0, CHANGE.1)
            } else {
                CHANGE.0 * taken
            };
            let passes = error <= tolerance;
            if passes || taken <= shortest_step {
                self.counters.steps += 1;
                self.counters.last_step = taken;
                self.counters.last_order = self.pair.order;
                // A step that was cut for the stop says nothing against the proposal.
                let next = if passes && taken < step {
                    step.max(wanted)
                } else {
                    wanted
                };
                return (taken, next.clamp(shortest_step, longest_step));
            }
            self.counters.error_test_failures += 1;
            step = wanted.clamp(shortest_step, longest_step);
        }
    }

    /// Hands out the samples that are due within the last step: the step again, as far as they are.
    fn samples(&mut self, before: (f64, AbsoluteState), step: f64) -> Result<(), RunError> {
        let (model, mode) = (self.model, self.mode);
        loop {
            let due = self.recording.next_sample_time();
            if due >= self.time {
                return Ok(());
            }
            let sample = if due > before.0 {
                self.pair
                    .step(before.0, &before.1, (due - before.0).min(step), |t, y, dydt| {
                        model.rhs(mode, t, y, dydt);
                    });
                self.pair.solution
            } else {
                before.1
            };
            self.recording
                .sample(due, &mode, &sample)
                .map_err(|error| observed(error, mode))?;
        }
    }

    /// What (9) and the other tests say at the end of a step.
    fn end_of_step(&mut self) -> Result<(), RunError> {
        if let Some(corner) = self.corner.filter(|&corner| corner <= self.time) {
            self.corner = self.model.force.next_corner(corner);
            self.happen(EventKind::Corner, self.mode, self.watch, self.state)?;
        }
        self.test_stability()?;
        let found = self.model.contact(&self.state, self.mode == Mode::Separated, EPSILON);
        let kind = match (self.mode, found) {
            (before, after) if before == after => return Ok(()),
            (_, Mode::Separated) => EventKind::Separation,
            (Mode::Separated, _) => EventKind::Contact,
            (_, Mode::Stick) => EventKind::Stick,
            (Mode::Stick, _) => EventKind::Slip,
            _ => EventKind::Reversal,
        };
        let (state, watch) = if found == Mode::Stick {
            (self.model.joined(&self.state), Watch::Off)
        } else {
            (self.state, self.watch)
        };
        self.happen(kind, found, watch, state)
    }

    /// The margin of steady sliding, watched until the first stick.
    fn test_stability(&mut self) -> Result<(), RunError> {
        if self.mode.sense() == 0 || self.watch == Watch::Off {
            return Ok(());
        }
        let sense = f64::from(self.mode.sense());
        let force = self.model.pressing_force(&self.state).max(0.0);
        let w = self.model.relative_velocity(&self.state);
        let stable = self.model.stability_margin(sense, w, force) >= 0.0;
        match (self.watch, stable) {
            (Watch::Stable, false) => {
                self.happen(EventKind::Destabilised, self.mode, Watch::Unstable, self.state)?;
                for delta in std::mem::take(&mut self.waiting_kicks) {
                    self.kick(delta)?;
                }
                Ok(())
            }
            (Watch::Unstable, true) => self.happen(EventKind::Restabilised, self.mode, Watch::Stable, self.state),
            _ => Ok(()),
        }
    }

    /// The timed kicks that are due.
    fn kick_now(&mut self) -> Result<(), RunError> {
        while let Some(&(_, delta)) = self.kicks.get(self.next_kick).filter(|kick| kick.0 <= self.time) {
            self.next_kick += 1;
            self.kick(delta)?;
        }
        Ok(())
    }

    fn kick(&mut self, delta: f64) -> Result<(), RunError> {
        let kicked = self.model.kicked(self.mode, &self.state, delta);
        self.happen(EventKind::Kick, self.mode, self.watch, kicked)
    }

    /// Records an event, with the segment that it ends, and takes over what is after it.
    fn happen(&mut self, kind: EventKind, mode: Mode, watch: Watch, state: AbsoluteState) -> Result<(), RunError> {
        if self.time > self.segment_start {
            self.end_segment()?;
        }
        let before = self.mode;
        (self.mode, self.watch) = (mode, watch);
        let after = self.mode;
        self.recording
            .event(self.time, kind, (&before, &self.state), (&after, &state))
            .map_err(|error| observed(error, after))?;
        self.state = state;
        self.counted += usize::from(kind.in_event_sequence());
        if self.counted > self.max_events {
            return Err(RunError::TooManyEvents {
                time: self.time,
                budget: self.max_events,
                location: describe(before),
                guard: "the test at the end of a step".to_owned(),
            });
        }
        Ok(())
    }

    fn end_segment(&mut self) -> Result<(), RunError> {
        let counters = std::mem::take(&mut self.counters);
        let span = (self.segment_start, self.time);
        self.segment_start = self.time;
        let mode = self.mode;
        self.recording
            .end_segment(span, &mode, SOLVER, &counters)
            .map_err(|error| observed(error, mode))
    }

    fn check_finite(&self) -> Result<(), RunError> {
        RunError::check_finite(&self.state, self.time, || describe(self.mode))
    }

    /// Whether the friction law is given at the speed that the step has come to.
    fn check_law(&self) -> Result<(), RunError> {
        let speed = self.model.relative_velocity(&self.state).abs();
        let end = self.model.law.ends_at();
        if self.mode.sense() == 0 || speed < end || end.is_infinite() {
            return Ok(());
        }
        let what = format!(
            "the sliding speed has come to {speed:.6} rad/s, and the friction law is valid below {end:?} rad/s"
        );
        Err(RunError::Outside {
            time: self.time,
            location: describe(self.mode),
            what,
        })
    }

    /// A step that rounding swallows.
    fn stuck(&self) -> RunError {
        RunError::Standstill {
            time: self.time,
            location: describe(self.mode),
            why: format!(
                "a step of {:.1e} s is below the resolution of the time",
                self.counters.last_step
            ),
        }
    }
}

fn observed(error: ObserverError, mode: Mode) -> RunError {
    RunError::observed(error, || describe(mode))
}

fn describe(mode: Mode) -> String {
    format!("mode {}", mode.name())
}
