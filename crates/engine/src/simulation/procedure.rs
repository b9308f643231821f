//! The paper's own procedure, for study: absolute angles, a Runge-Kutta method of order 5 with steps from 1e-8 to 1e-4
//! s, and the state of the contact by equation (9), tested at the end of each step.
//!
//! Events are not located. An event has the time of the first step end at which (9) gives another state. If omega_r
//! passes zero by more than epsilon within a step, friction changes sign inside the right-hand side until a step
//! happens to end within epsilon of zero; each change is recorded as a reversal.
//!
//! Gaps in the paper are filled as usual: Dormand and Prince's pair; an absolute tolerance on every component in SI
//! units and radians; a step of the smallest length is always accepted; entering stick gives both surfaces their mean
//! speed, as (4) has one speed; the torque in (10) follows the case's `contact.breakaway_test`. Steps are shortened for
//! kicks only.

use super::Simulation;
use super::observer::Recording;
use super::options::{OutputOptions, SolverOptions};
use super::readings::AbsoluteReadings;
use super::report::{RunFailure, RunReport};
use super::rules::beyond_the_law;
use super::stepping::ExplicitStep;
use crate::error::{Error, ErrorPlace};
use crate::hybrid::{MarginWatch, Observer, Start, SystemLocation};
use crate::sundials::{Counters, ErkTable};
use stickslip_system::friction::Law;
use stickslip_system::model::absolute_angles::{AbsoluteModel, AbsoluteState, DIMENSION, UNKNOWNS};
use stickslip_system::model::{KickTime, Mode};
use stickslip_system::record::{EventDigest, EventKind, Recorder};
use stickslip_system::watch::Watch;

pub(crate) const PAIR: ErkTable = ErkTable::DormandPrince7s45;

/// epsilon of equation (9), rad/s.
pub const EPSILON: f64 = 1e-5;

/// Shortest and longest step, s.
pub const STEPS: (f64, f64) = (1e-8, 1e-4);

/// Tolerance on the error estimate in units of `solver.rtol`: the paper's 1e-11 by default.
const TOLERANCE_SHARE: f64 = 0.1;

/// Usual bounds of step control: safety factor,
const SAFETY: f64 = 0.9;

/// and smallest and largest change of the step.
const CHANGE: (f64, f64) = (0.2, 5.0);

const STEPS_BETWEEN_QUESTIONS: u64 = 256;

pub(crate) const SOLVER: &str = "paper";

/// Step control of the procedure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Largest error estimate of a step in any component, in its SI unit.
    pub tolerance: f64,
    /// Shortest step, s.
    pub shortest_step: f64,
    /// Longest step, s.
    pub longest_step: f64,
}

impl Settings {
    /// Settings of a run with these options.
    pub fn new(solver: &SolverOptions) -> Self {
        let longest_step = solver.max_step.map_or(STEPS.1, |step| step.min(STEPS.1));
        Settings {
            tolerance: TOLERANCE_SHARE * solver.rtol,
            shortest_step: STEPS.0.min(longest_step),
            longest_step,
        }
    }
}

/// Message for a system that the procedure does not cover.
pub const FOREIGN: &str = "method \"paper\" is the procedure of the paper for its two alike disks, a free rotor on a shaft and a surface on an equal shaft that \
     ends in the ground, pressed by an axial motion: take another for this case";

/// Integrates the paper's pair of disks by the procedure; the counterpart of [`super::simulate()`], with the same
/// contract.
pub(crate) fn run(
    problem: Simulation<'_>,
    solver: &SolverOptions,
    output: &OutputOptions,
    recorder: &mut dyn Recorder,
    watch: &dyn Watch,
) -> Result<RunReport, Box<RunFailure>> {
    let system = problem.system;
    let Some(model) = AbsoluteModel::new(system) else {
        let error = Error::refused(FOREIGN);
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
    let location = SystemLocation {
        watch: match mode {
            Mode::Stick => MarginWatch::Off,
            _ => MarginWatch::Stable,
        },
        ..SystemLocation::new(mode, 0)
    };
    let digest = EventDigest::new(Some(model.natural_period()));
    let start = Start {
        time: 0.0,
        location,
        state: state.to_vec(),
    };
    let recording = Recording::new(readings, digest, (solver, output), recorder, watch, &start);
    let mut run = ProcedureRun {
        model: &model,
        pair: ExplicitStep::new(PAIR.coefficients(), [0.0; DIMENSION]),
        order: PAIR.order(),
        settings: Settings::new(solver),
        recording,
        time: 0.0,
        state,
        location,
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
        Ok(true) => run.recording.in_time(run.time, &run.location).map(|()| true),
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

struct ProcedureRun<'a> {
    model: &'a AbsoluteModel,
    pair: ExplicitStep<AbsoluteState>,
    order: u32,
    settings: Settings,
    recording: Recording<'a, AbsoluteReadings<'a>>,
    time: f64,
    state: AbsoluteState,
    location: SystemLocation,
    kicks: Vec<(f64, f64)>,
    next_kick: usize,
    waiting_kicks: Vec<f64>,
    corner: Option<f64>,
    segment_start: f64,
    counters: Counters,
    counted: usize,
    max_events: usize,
    max_steps: Option<u64>,
}

impl ProcedureRun<'_> {
    fn to(&mut self, end: f64) -> Result<bool, Error> {
        let mut proposed = self.settings.shortest_step;
        let mut steps = 0u64;
        while self.time < end {
            self.kick_now()?;
            let kick = self.kicks.get(self.next_kick).map_or(f64::INFINITY, |k| k.0);
            let stop = end.min(kick);
            let (step, next) = self.step(proposed, stop);
            let before = (self.time, self.state);
            // A remainder of the size of rounding deserves no step of its own.
            self.time = if step >= stop - before.0 { stop } else { before.0 + step };
            if self.time <= before.0 {
                return Err(self.stuck());
            }
            self.state = self.pair.solution;
            proposed = next;
            self.samples(before, step)?;
            self.place().check_finite(&self.state)?;
            self.check_law()?;
            self.end_of_step()?;
            steps += 1;
            if let Some(budget) = self.max_steps.filter(|&budget| steps > budget) {
                return Err(self.place().too_many_steps(budget));
            }
            if self.recording.wants_steps() && self.time < end {
                self.recording.step(self.time, &self.location, &self.state)?;
            }
            let asks = steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS);
            if asks && self.recording.progress(self.time, &self.location).is_break() {
                self.end_segment()?;
                return Ok(true);
            }
        }
        self.end_segment()?;
        while self.recording.next_sample_time() <= end {
            let due = self.recording.next_sample_time();
            self.recording.sample(due, &self.location, &self.state)?;
        }
        Ok(false)
    }

    /// Takes a step that passes the error test or has the smallest length, at most to `stop`. Returns its length and
    /// the next proposal.
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
            let (model, mode) = (self.model, self.location.mode);
            self.pair.take(self.time, &self.state, taken, |t, y, dydt| {
                model.rhs(mode, t, y, dydt);
            });
            let error = self.pair.error(taken, UNKNOWNS);
            self.counters.rhs_evaluations += self.pair.stages();
            // A NaN error shortens the step as far as allowed.
            let wanted = if error.is_finite() {
                let share = (error / tolerance).max(1e-30);
                taken * (SAFETY * share.powf(-1.0 / f64::from(self.order))).clamp(CHANGE.0, CHANGE.1)
            } else {
                CHANGE.0 * taken
            };
            let passes = error <= tolerance;
            if passes || taken <= shortest_step {
                self.counters.steps += 1;
                self.counters.last_step = taken;
                self.counters.last_order = self.order;
                // A step that was cut for the stop does not reduce the proposal.
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

    fn samples(&mut self, before: (f64, AbsoluteState), step: f64) -> Result<(), Error> {
        let (model, mode) = (self.model, self.location.mode);
        loop {
            let due = self.recording.next_sample_time();
            if due >= self.time {
                return Ok(());
            }
            let sample = if due > before.0 {
                self.pair
                    .take(before.0, &before.1, (due - before.0).min(step), |t, y, dydt| {
                        model.rhs(mode, t, y, dydt);
                    });
                self.pair.solution
            } else {
                before.1
            };
            self.recording.sample(due, &self.location, &sample)?;
        }
    }

    fn end_of_step(&mut self) -> Result<(), Error> {
        if let Some(corner) = self.corner.filter(|&corner| corner <= self.time) {
            self.corner = self.model.force.next_corner(corner);
            self.happen(EventKind::Corner, self.location, self.state)?;
        }
        self.test_stability()?;
        let found = self
            .model
            .contact(&self.state, self.location.mode == Mode::Separated, EPSILON);
        let kind = match (self.location.mode, found) {
            (before, after) if before == after => return Ok(()),
            (_, Mode::Separated) => EventKind::Separation,
            (Mode::Separated, _) => EventKind::Contact,
            (_, Mode::Stick) => EventKind::Stick,
            (Mode::Stick, _) => EventKind::Slip,
            _ => EventKind::Reversal,
        };
        let (state, watch) = if found == Mode::Stick {
            (self.model.joined(&self.state), MarginWatch::Off)
        } else {
            (self.state, self.location.watch)
        };
        let after = SystemLocation {
            watch,
            ..SystemLocation::new(found, 0)
        };
        self.happen(kind, after, state)
    }

    fn test_stability(&mut self) -> Result<(), Error> {
        let location = self.location;
        if location.mode.sense() == 0 || location.watch == MarginWatch::Off {
            return Ok(());
        }
        let sense = location.sign();
        let force = self.model.pressing_force(&self.state).max(0.0);
        let w = self.model.relative_velocity(&self.state);
        let stable = self.model.is_stable(sense, w, force);
        let watching = |watch| SystemLocation { watch, ..location };
        match (location.watch, stable) {
            (MarginWatch::Stable, false) => {
                self.happen(EventKind::Destabilised, watching(MarginWatch::Unstable), self.state)?;
                for delta in std::mem::take(&mut self.waiting_kicks) {
                    self.kick(delta)?;
                }
                Ok(())
            }
            (MarginWatch::Unstable, true) => {
                self.happen(EventKind::Restabilised, watching(MarginWatch::Stable), self.state)
            }
            _ => Ok(()),
        }
    }

    fn kick_now(&mut self) -> Result<(), Error> {
        while let Some(&(_, delta)) = self.kicks.get(self.next_kick).filter(|kick| kick.0 <= self.time) {
            self.next_kick += 1;
            self.kick(delta)?;
        }
        Ok(())
    }

    fn kick(&mut self, delta: f64) -> Result<(), Error> {
        let kicked = self.model.kicked(self.location.mode, &self.state, delta);
        self.happen(EventKind::Kick, self.location, kicked)
    }

    fn happen(&mut self, kind: EventKind, after: SystemLocation, state: AbsoluteState) -> Result<(), Error> {
        if self.time > self.segment_start {
            self.end_segment()?;
        }
        let (place, before) = (self.place(), std::mem::replace(&mut self.location, after));
        self.recording
            .event(self.time, kind, (&before, &self.state), (&after, &state))?;
        self.state = state;
        self.counted += usize::from(kind.in_event_sequence());
        match self.counted > self.max_events {
            true => Err(place.too_many_events(self.max_events, "the test at the end of a step")),
            false => Ok(()),
        }
    }

    fn end_segment(&mut self) -> Result<(), Error> {
        let counters = std::mem::take(&mut self.counters);
        let span = (self.segment_start, self.time);
        self.segment_start = self.time;
        self.recording.end_segment(span, &self.location, SOLVER, &counters)
    }

    fn place(&self) -> ErrorPlace {
        ErrorPlace {
            time: self.time,
            mode: self.location.mode,
        }
    }

    /// Fails if the sliding speed has left the friction law's range.
    fn check_law(&self) -> Result<(), Error> {
        let speed = self.model.relative_velocity(&self.state).abs();
        let end = self.model.law.ends_at();
        if self.location.mode.sense() == 0 || speed < end || end.is_infinite() {
            return Ok(());
        }
        Err(self.place().outside(&beyond_the_law(speed, end)))
    }

    fn stuck(&self) -> Error {
        let step = self.counters.last_step;
        let why = format!("a step of {step:.1e} s is below the resolution of the time");
        self.place().standstill(&why)
    }
}
