//! The motion over a given time from a known state, with its derivatives: what periodic motions are found with.

use super::dynamics::{SystemDynamics, SystemLocation};
use super::options::{Method, SolverOptions};
use super::portrait::position;
use super::rules::SystemRules;
use super::simulate::prepared;
use super::variation::{Contact, MovedCases, alike_between_events};
use crate::hybrid::{
    self, Carried, CarryingRules, Dynamics as _, Limits, MovedCopy, MovedNumber, Observer, ObserverError, RunError,
    SegmentReport, Start, StateAt,
};
use crate::model::Mode;
use crate::model::equations::SystemEquations;
use crate::model::system::{Pressing, System};
use crate::record::EventKind;
use crate::signal::Drive;
use nalgebra::{DMatrix, DVector};
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

/// Relative tolerance of the series.
const RTOL: f64 = 1e-14;

/// Events after which a motion is given up.
const MOST_EVENTS: usize = 20_000;

/// Steps after which a motion is given up.
const MOST_STEPS: u64 = 2_000_000;

/// The same with derivatives, of a period: where a stick has no length, rounding can make thousands of both.
const MOST_EVENTS_OF_PERIOD: usize = 500;
const MOST_STEPS_OF_PERIOD: u64 = 20_000;

/// Segments in a row without a length, at most: beside a border rounding can make any number of them.
const MOST_IDLE: u32 = 50;

/// Points of a step at which extrema are looked for. A step is some radians of the fastest motion at most.
const POINTS_OF_STEP: usize = 12;

/// Of a step, where the sizes of the components are seen without that.
const POINTS_OF_SIZES: [f64; 3] = [0.25, 0.5, 0.75];

/// A slip begins at rest if its speed is below this share of the largest so far; a stick at its limit, if that is as near.
const AT_REST: f64 = 1e-9;

/// Halvings of the interval of an extremum.
const HALVINGS: usize = 60;

/// Where the sequence of events of a motion would change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Border {
    /// A slip comes to rest: a stick, or a reversal, is born. The distance is the least |omega_r| over its largest.
    Touch,
    /// A stick breaks away before its end. The distance is 1 - |T|/(mu_0 r F_n) where it is least within the stick.
    Breakaway,
    /// A stick ends as it begins. The distance is 1 - |T|/(mu_0 r F_n) at its start.
    Landing,
    /// A reversal sticks. The distance is |T|/(mu_0 r F_n) - 1 there.
    Reversal,
    /// The contact opens. The distance is the least F_n over its largest.
    Opening,
    /// A separation closes before its end. The distance is that of F_n from zero over the largest.
    Closing,
    /// A slip ends as it begins. The distance is its largest |omega_r| over that of the period.
    Slip,
    /// A separation ends as it begins. The distance is the least F_n, below zero, over the largest.
    Separation,
}

impl Border {
    /// All of them, in the order of their codes in files.
    pub const ALL: [Border; 8] = [
        Border::Touch,
        Border::Breakaway,
        Border::Landing,
        Border::Reversal,
        Border::Opening,
        Border::Closing,
        Border::Slip,
        Border::Separation,
    ];

    /// As a word in files.
    pub fn name(self) -> &'static str {
        match self {
            Border::Touch => "touch",
            Border::Breakaway => "breakaway",
            Border::Landing => "landing",
            Border::Reversal => "reversal",
            Border::Opening => "opening",
            Border::Closing => "closing",
            Border::Slip => "slip",
            Border::Separation => "separation",
        }
    }

    /// What changes there, in words.
    pub fn words(self) -> &'static str {
        match self {
            Border::Touch => "grazing: a slip touches rest",
            Border::Breakaway => "grazing: a stick reaches breakaway within",
            Border::Landing => "a stick has no length: it ends as it begins",
            Border::Reversal => "a reversal begins to stick",
            Border::Opening => "loss of contact",
            Border::Closing => "an open contact closes within",
            Border::Slip => "a slip has no length: it ends as it begins",
            Border::Separation => "a separation has no length: it ends as it begins",
        }
    }

    /// Whether its distance goes to zero as the way to it. That of what vanishes goes as a root of the way, with slopes that grow.
    pub(crate) fn is_regular(self) -> bool {
        !matches!(self, Border::Landing | Border::Slip | Border::Separation)
    }
}

/// How far a motion is from another sequence of events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Margin {
    pub border: Border,
    /// When, s.
    pub time: f64,
    /// Relative; see [`Border`].
    pub distance: f64,
}

/// A time in one mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Phase {
    pub mode: Mode,
    /// s.
    pub from: f64,
    /// s.
    pub to: f64,
    /// The largest |omega_r| of a slip; how far F_n is below zero in a separation, at most, over the largest F_n. 0 of others, and
    /// if extrema were not asked for.
    pub depth: f64,
}

/// An event of a motion.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ShotEvent {
    /// s.
    pub time: f64,
    pub kind: EventKind,
    pub mode_after: Mode,
}

/// A largest |omega_r| of a slip.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Peak {
    /// s.
    pub time: f64,
    /// omega_r, rad/s.
    pub relative_velocity: f64,
    /// What the motion depends on.
    pub state: DVector<f64>,
}

/// The motion over a time. States are what the motion depends on: twists, rates, the speeds of free chains, bristles.
#[derive(Debug, Clone)]
pub(crate) struct Shot {
    /// State at the end.
    pub end: DVector<f64>,
    /// d(state)/dt at the start, 1/s.
    pub start_rates: DVector<f64>,
    /// d(state)/dt at the end, 1/s.
    pub end_rates: DVector<f64>,
    /// d(end)/d(start).
    pub by_state: DMatrix<f64>,
    /// d(end)/d(number): a column for each.
    pub by_number: DMatrix<f64>,
    pub events: Vec<ShotEvent>,
    pub phases: Vec<Phase>,
    /// Largest magnitude of each component.
    pub sizes: Vec<f64>,
    /// If they were asked for.
    pub peaks: Vec<Peak>,
    /// If they were asked for.
    pub margins: Vec<Margin>,
    /// Least and largest position, as a portrait has it, if extrema were asked for; NaN of a system without one.
    pub position: (f64, f64),
    /// Least and largest omega_r, rad/s, if extrema were asked for.
    pub relative_velocity: (f64, f64),
}

/// Why there is no motion over the time.
#[derive(Debug)]
pub(crate) enum ShotError {
    /// The run failed.
    Run(RunError),
    /// It was asked to end.
    Interrupted,
}

/// What is wanted of a motion.
#[derive(Clone, Copy)]
pub(crate) struct Wanted<'a> {
    /// Derivatives by the state, and by these numbers of the case; `None`: no derivatives.
    pub derivatives: Option<&'a [MovedCases]>,
    /// Peaks and margins.
    pub extrema: bool,
    /// Asked now and then; `true` ends the motion.
    pub stop: &'a dyn Fn() -> bool,
}

/// What is recorded on the way.
struct Tape<'a> {
    dynamics: &'a SystemDynamics,
    wanted: Wanted<'a>,
    end_time: f64,
    end: Option<(Vec<f64>, SystemLocation)>,
    events: Vec<ShotEvent>,
    phases: Vec<Phase>,
    sizes: Vec<f64>,
    peaks: Vec<Peak>,
    margins: Vec<Margin>,
    /// The largest force, and whether it changes.
    force: (f64, bool),
    /// The rate of each curve at the last point of the phase.
    rates: [Option<f64>; 3],
    /// Least and largest position.
    position: (f64, f64),
    /// Least and largest omega_r.
    speed: (f64, f64),
    /// Segments in a row without a length.
    idle: u32,
}

/// A curve whose extrema are looked for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Curve {
    /// See [`Tape::watched`].
    Contact,
    /// The normal force, as far as it is from the sign that ends the mode.
    Force,
    /// What a portrait shows.
    Position,
}

impl Curve {
    const ALL: [Curve; 3] = [Curve::Contact, Curve::Force, Curve::Position];
}

impl Tape<'_> {
    fn moving(&self) -> usize {
        self.dynamics.system.mechanical()
    }

    fn see_speed(&mut self, location: &SystemLocation, t: f64, y: &[f64]) {
        let w = match location.mode {
            Mode::Stick => 0.0,
            _ => self
                .dynamics
                .system
                .relative_velocity(&self.dynamics.outside(location, t), y),
        };
        self.speed = (self.speed.0.min(w), self.speed.1.max(w));
    }

    fn see(&mut self, y: &[f64]) {
        for (size, y) in self.sizes.iter_mut().zip(y) {
            *size = size.max(y.abs());
        }
    }

    fn enter(&mut self, t: f64, mode: Mode) {
        if let Some(last) = self.phases.last_mut() {
            last.to = t;
        }
        let to = self.end_time;
        self.phases.push(Phase {
            mode,
            from: t,
            to,
            depth: 0.0,
        });
        self.rates = [None; 3];
    }

    /// What is watched in a mode, and its rate: |omega_r| of a slip, 1 - |T|/(mu_0 r F_n) of a stick.
    fn watched(&self, location: &SystemLocation, t: f64, y: &[f64]) -> (f64, f64) {
        let system = &self.dynamics.system;
        let outside = self.dynamics.outside(location, t);
        if location.mode == Mode::Stick {
            let mut rates = vec![0.0; y.len()];
            self.dynamics.rhs(location, t, y, &mut rates);
            let changes = self.dynamics.outside_rates(location, t);
            let (torque, rise) = (
                system.tested_torque(&outside, y),
                system.tested_torque(&changes, &rates),
            );
            let limit = system.breakaway_torque(outside.normal_force);
            let limit_rise = system.breakaway_torque(changes.normal_force);
            let sense = torque.signum();
            let rate = -sense * (rise * limit - torque * limit_rise) / (limit * limit);
            return (1.0 - sense * torque / limit, rate);
        }
        let w = system.relative_velocity(&outside, y);
        let sense = if location.sense == 0 || location.mode == Mode::Engaged {
            w.signum()
        } else {
            location.sign()
        };
        let rate = system.relative_acceleration(location.mode, location.sign(), location.piece, &outside, y);
        (sense * w, sense * rate)
    }

    fn distance_of_force(&self, location: &SystemLocation, t: f64) -> (f64, f64) {
        let sign = if location.mode == Mode::Separated { -1.0 } else { 1.0 };
        let force = self.dynamics.outside(location, t).normal_force;
        let rate = self.dynamics.outside_rates(location, t).normal_force;
        (sign * force / self.force.0, sign * rate)
    }

    /// A curve with its rate; `None` where it is not watched.
    fn curve(&self, which: Curve, location: &SystemLocation, t: f64, y: &[f64]) -> Option<(f64, f64)> {
        match which {
            Curve::Contact => Some(self.watched(location, t, y)),
            Curve::Force => self.force.1.then(|| self.distance_of_force(location, t)),
            Curve::Position => position(self.dynamics, y),
        }
    }

    /// Extrema within a step, by the zeros of the rates.
    fn look(
        &mut self,
        (from, to): (f64, f64),
        location: &SystemLocation,
        at: &mut StateAt<'_>,
    ) -> Result<(), ObserverError> {
        let mut y = vec![0.0; self.dynamics.system.dimension];
        let mut before = from;
        for k in 0..=POINTS_OF_STEP {
            let t = match k {
                POINTS_OF_STEP => to,
                k => from + (to - from) * k as f64 / POINTS_OF_STEP as f64,
            };
            at(t, &mut y)?;
            self.see(&y);
            self.see_speed(location, t, &y);
            for (index, which) in Curve::ALL.into_iter().enumerate() {
                let Some((value, rate)) = self.curve(which, location, t, &y) else {
                    continue;
                };
                self.reach(which, location.mode, value);
                // A slip may begin at rest, and a stick at its limit, where a rate has no sign.
                let begins = self.phases.last().is_some_and(|phase| phase.from == t);
                let fastest = self.speed.0.abs().max(self.speed.1.abs());
                let size = if location.mode == Mode::Stick { 1.0 } else { fastest };
                let at_rest = begins && which == Curve::Contact && value.abs() <= AT_REST * size;
                if let Some(last) = self.rates[index]
                    && last * rate < 0.0
                    && t > before
                {
                    let zero = between(before, t, last < 0.0, |t| {
                        at(t, &mut y)?;
                        Ok(self.curve(which, location, t, &y).map_or(0.0, |curve| curve.1))
                    })?;
                    at(zero, &mut y)?;
                    self.extremum(which, (location, zero, &y), last < 0.0);
                    at(t, &mut y)?;
                }
                if rate != 0.0 && !at_rest {
                    self.rates[index] = Some(rate);
                }
            }
            before = t;
        }
        Ok(())
    }

    fn reach(&mut self, which: Curve, mode: Mode, value: f64) {
        let phase = self.phases.last_mut();
        match (which, phase) {
            (Curve::Position, _) => self.position = (self.position.0.min(value), self.position.1.max(value)),
            (Curve::Contact, Some(phase)) if mode.slides() => phase.depth = phase.depth.max(value),
            (Curve::Force, Some(phase)) if mode == Mode::Separated => phase.depth = phase.depth.max(value),
            _ => {}
        }
    }

    fn extremum(&mut self, which: Curve, (location, time, y): (&SystemLocation, f64, &[f64]), is_least: bool) {
        let Some((distance, _)) = self.curve(which, location, time, y) else {
            return;
        };
        self.reach(which, location.mode, distance);
        self.see_speed(location, time, y);
        let border = match (which, location.mode) {
            (Curve::Force, Mode::Separated) => Border::Closing,
            (Curve::Force, _) => Border::Opening,
            (Curve::Contact, Mode::Stick) => Border::Breakaway,
            _ => Border::Touch,
        };
        let slides = location.mode.sense() != 0;
        let engaged = location.mode == Mode::Engaged;
        match which {
            Curve::Contact if !is_least && (slides || engaged) => {
                let outside = self.dynamics.outside(location, time);
                self.peaks.push(Peak {
                    time,
                    relative_velocity: self.dynamics.system.relative_velocity(&outside, y),
                    state: DVector::from_column_slice(&y[..self.moving()]),
                });
            }
            Curve::Contact | Curve::Force
                if is_least && (which == Curve::Force || slides || location.mode == Mode::Stick) =>
            {
                self.margins.push(Margin { border, time, distance });
            }
            _ => {}
        }
    }

    /// 1 - |T|/(mu_0 r F_n) of surfaces that have just come to rest.
    fn spare_torque(&self, location: &SystemLocation, t: f64, y: &[f64]) -> f64 {
        let system = &self.dynamics.system;
        let outside = self.dynamics.outside(location, t);
        let mut joined = y.to_vec();
        system.join(&outside, &mut joined);
        1.0 - system.tested_torque(&outside, &joined).abs() / system.breakaway_torque(outside.normal_force)
    }
}

/// The zero of a rate between two times, of which it is negative at the first if it `rises`.
fn between(
    mut low: f64,
    mut high: f64,
    rises: bool,
    mut rate: impl FnMut(f64) -> Result<f64, ObserverError>,
) -> Result<f64, ObserverError> {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if (rate(middle)? < 0.0) == rises {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(0.5 * (low + high))
}

impl Observer<SystemLocation, EventKind> for Tape<'_> {
    fn next_sample_time(&self) -> f64 {
        match self.end {
            Some(_) => f64::INFINITY,
            None => self.end_time,
        }
    }

    fn sample(&mut self, _: f64, location: &SystemLocation, y: &[f64]) -> Result<(), ObserverError> {
        self.see(y);
        self.end = Some((y.to_vec(), *location));
        Ok(())
    }

    fn wants_inside(&self) -> bool {
        true
    }

    fn inside(
        &mut self,
        from: f64,
        to: f64,
        location: &SystemLocation,
        at: &mut StateAt<'_>,
    ) -> Result<(), ObserverError> {
        if self.wanted.extrema {
            return self.look((from, to), location, at);
        }
        let mut y = vec![0.0; self.dynamics.system.dimension];
        for share in POINTS_OF_SIZES {
            at(from + share * (to - from), &mut y)?;
            self.see(&y);
        }
        Ok(())
    }

    fn event(
        &mut self,
        t: f64,
        kind: EventKind,
        before: (&SystemLocation, &[f64]),
        after: (&SystemLocation, &[f64]),
    ) -> Result<(), ObserverError> {
        self.see(before.1);
        self.see(after.1);
        self.events.push(ShotEvent {
            time: t,
            kind,
            mode_after: after.0.mode,
        });
        let border = match kind {
            EventKind::Stick if after.0.mode == Mode::Stick => Some((Border::Landing, 1.0)),
            EventKind::Reversal => Some((Border::Reversal, -1.0)),
            _ => None,
        };
        if let Some((border, sign)) = border.filter(|_| self.wanted.extrema) {
            let distance = sign * self.spare_torque(after.0, t, after.1);
            self.margins.push(Margin {
                border,
                time: t,
                distance,
            });
        }
        if before.0.mode != after.0.mode {
            self.enter(t, after.0.mode);
        }
        Ok(())
    }

    fn segment(&mut self, report: &SegmentReport<SystemLocation>) -> Result<(), ObserverError> {
        let moves = report.end - report.start > 4.0 * f64::EPSILON * report.end.abs();
        self.idle = if moves { 0 } else { self.idle + 1 };
        match self.idle > MOST_IDLE {
            true => Err(format!("the motion stands still at t = {:.12} s", report.end).into()),
            false => Ok(()),
        }
    }

    fn progress(&mut self, _: f64, _: &SystemLocation) -> ControlFlow<()> {
        match (self.wanted.stop)() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

type SystemStart = Start<SystemLocation>;

/// How the state where a motion starts depends on itself: surfaces that stick have one speed.
fn start_slopes(dynamics: &SystemDynamics, start: &SystemStart) -> DMatrix<f64> {
    let n = dynamics.system.mechanical();
    if start.location.mode != Mode::Stick {
        return DMatrix::identity(n, n);
    }
    let outside = dynamics.outside(&start.location, start.time);
    let joined = |unit: Option<usize>| {
        let mut y = start.state.clone();
        if let Some(k) = unit {
            y[k] += 1.0;
        }
        dynamics.system.join(&outside, &mut y);
        y
    };
    let own = joined(None);
    DMatrix::from_fn(n, n, |i, k| joined(Some(k))[i] - own[i])
}

/// The numbers by which a motion from `start` is differentiated: the components of its state, and those of the case.
fn numbers(
    (system, time): (&System, (f64, f64)),
    (dynamics, start): (&SystemDynamics, &SystemStart),
    moved: &[MovedCases],
    solver: &SolverOptions,
) -> Vec<MovedNumber<SystemDynamics, SystemRules>> {
    let slopes = start_slopes(dynamics, start);
    let of_state = slopes.column_iter().map(|slope| MovedNumber {
        copies: Vec::new(),
        start: slope.into_owned(),
        in_equations: false,
        rounded: None,
    });
    let mut all: Vec<_> = of_state.collect();
    all.extend(moved.iter().map(|number| {
        let copies = number.copies.iter().map(|copy| {
            let (dynamics, rules, _) = prepared(
                (&copy.system, copy.threshold),
                Some((time.0, &start.state)),
                solver,
                time.1,
            );
            MovedCopy {
                dynamics,
                rules: rules.resolving_all(),
                weight: copy.weight,
                bend: copy.bend,
            }
        });
        MovedNumber {
            copies: copies.collect(),
            start: DVector::zeros(slopes.nrows()),
            in_equations: number
                .copies
                .iter()
                .any(|copy| !alike_between_events(system, &copy.system)),
            rounded: None,
        }
    }));
    all
}

/// The motion of a system from `state` at `from` (s) over `time` (s), in a closed contact.
///
/// # Errors
/// Those of a run, and an interruption.
pub(crate) fn shoot(
    (system, threshold): (&System, f64),
    (from, state): (f64, &DVector<f64>),
    time: f64,
    wanted: Wanted<'_>,
) -> Result<Shot, ShotError> {
    let solver = SolverOptions {
        method: Method::Series,
        rtol: RTOL,
        ..SolverOptions::default()
    };
    let end_time = from + time;
    let dimension = SystemEquations::new(system).dimension;
    let mut y = vec![0.0; dimension];
    y[..state.len()].copy_from_slice(state.as_slice());
    let (dynamics, mut rules, start) = prepared((system, threshold), Some((from, &y)), &solver, end_time);
    let n = state.len();
    let excitation = &dynamics.excitation;
    let changing = !matches!(system.pressing, Pressing::Force(Drive::Value(_)));
    let mut tape = Tape {
        dynamics: &dynamics,
        wanted,
        end_time,
        end: None,
        events: Vec::new(),
        phases: Vec::new(),
        sizes: vec![0.0; n],
        peaks: Vec::new(),
        margins: Vec::new(),
        force: (excitation.largest_force(), changing),
        rates: [None; 3],
        position: (f64::INFINITY, f64::NEG_INFINITY),
        speed: (f64::INFINITY, f64::NEG_INFINITY),
        idle: 0,
    };
    tape.see(&start.state);
    tape.enter(from, start.location.mode);
    let rates = |location: &SystemLocation, t: f64, y: &[f64]| {
        let mut rates = vec![0.0; y.len()];
        dynamics.rhs(location, t, y, &mut rates);
        DVector::from_column_slice(&rates[..n])
    };
    let start_rates = rates(&start.location, from, &start.state);
    let (max_events, max_steps) = match wanted.derivatives {
        Some(_) => (MOST_EVENTS_OF_PERIOD, MOST_STEPS_OF_PERIOD),
        None => (MOST_EVENTS, MOST_STEPS),
    };
    let limits = Limits {
        max_events,
        chatter_count: super::CHATTER_COUNT,
        max_steps: Some(max_steps),
        foreseen_steps: None,
    };
    let (finish, slopes) = match wanted.derivatives {
        None => (
            hybrid::run(&dynamics, &mut rules, start, end_time, limits, &mut tape),
            None,
        ),
        Some(moved) => {
            let columns = numbers((system, (from, end_time)), (&dynamics, &start), moved, &solver);
            let measures = Box::new(Contact::new(&dynamics));
            let carried = Carried::new(dynamics.clone(), measures, n, f64::INFINITY, columns).beside_borders();
            let carried = Arc::new(Mutex::new(carried));
            let mut rules = CarryingRules::new(rules.clone(), rules.resolving_all(), carried.clone());
            let finish = hybrid::run(&dynamics, &mut rules, start, end_time, limits, &mut tape);
            let slopes = carried.lock().unwrap_or_else(PoisonError::into_inner).slopes();
            (finish, Some(slopes))
        }
    };
    let finish = finish.map_err(ShotError::Run)?;
    let Some((end, location)) = tape.end.take().filter(|_| !finish.interrupted) else {
        return Err(ShotError::Interrupted);
    };
    let slopes = slopes.unwrap_or_else(|| DMatrix::zeros(n, n));
    Ok(Shot {
        end_rates: rates(&location, end_time, &end),
        end: DVector::from_column_slice(&end[..n]),
        start_rates,
        by_state: slopes.columns(0, n).into_owned(),
        by_number: slopes.columns(n, slopes.ncols() - n).into_owned(),
        events: tape.events,
        phases: tape.phases,
        sizes: tape.sizes,
        peaks: tape.peaks,
        margins: tape.margins,
        position: match tape.position {
            (least, largest) if least <= largest => (least, largest),
            _ => (f64::NAN, f64::NAN),
        },
        relative_velocity: tape.speed,
    })
}
