//! The motion over a given time from a known state, with its derivatives, for the search of periodic motions.

use super::carried::{Carried, CarryingRules, VariationColumn};
use super::expansion::Expansion;
use super::options::{Method, SolverOptions};
use super::portrait::position;
use super::simulate::prepared;
use super::variation::{MovedCases, moved_number};
use crate::error::{Error, ErrorKind};
use crate::hybrid::dynamics::{SystemDynamics, SystemLocation};
use crate::hybrid::{self, Limits, Observer, SegmentReport, Start, StateAt};
use nalgebra::{DMatrix, DVector};
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};
use stickslip_system::model::Mode;
use stickslip_system::model::equations::SystemEquations;
use stickslip_system::model::system::{Pressing, System};
use stickslip_system::record::EventKind;
use stickslip_system::signal::Drive;
use stickslip_system::watch::{Watch, go_on_unless};

const RTOL: f64 = 1e-14;

const MOST_EVENTS: usize = 20_000;

const MOST_STEPS: u64 = 2_000_000;

/// Limits of a period with derivatives: if a stick has no length, rounding can make thousands of events and steps.
const MOST_EVENTS_OF_PERIOD: usize = 500;
const MOST_STEPS_OF_PERIOD: u64 = 20_000;

/// Most zero-length segments in a row: near a border rounding can make any number of them.
const MOST_IDLE: u32 = 50;

/// Number of intervals of a step in which extrema are searched. A step is at most some radians of the fastest motion.
const POINTS_OF_STEP: usize = 12;

/// Shares of a step at which the sizes of components are measured if no extrema are wanted.
const POINTS_OF_SIZES: [f64; 3] = [0.25, 0.5, 0.75];

/// A speed at a slip's start counts as zero below this share of the largest so far, and so does a stick's distance
/// from its limit.
const AT_REST: f64 = 1e-9;

const HALVINGS: usize = 60;

/// Borders between two sequences of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Border {
    /// A slip comes to rest: a stick, or a reversal, is born. Distance: smallest |omega_r| over its largest.
    Touch,
    /// A stick breaks away before its end. Distance: smallest 1 - |T|/(mu_0 r F_n) within the stick.
    Breakaway,
    /// A stick ends as it begins. Distance: 1 - |T|/(mu_0 r F_n) at its start.
    Landing,
    /// A reversal sticks. Distance: |T|/(mu_0 r F_n) - 1 at the reversal.
    Reversal,
    /// The contact opens. Distance: smallest F_n over its largest.
    Opening,
    /// A separation closes before its end. Distance: distance of F_n from zero over the largest.
    Closing,
    /// A slip ends as it begins. Distance: its largest |omega_r| over the largest of the period.
    Slip,
    /// A separation ends as it begins. Distance: deepest F_n below zero over the largest.
    Separation,
    /// A slip that ends at rest only touches it: [`Border::Touch`] from the other side. Distance: how far |omega_r|
    /// would fall below zero if the slip went on, over its largest.
    Graze,
    /// A stick that breaks away only touches its limit: [`Border::Breakaway`] from the other side. Distance: how far
    /// 1 - |T|/(mu_0 r F_n) would fall below zero if the stick went on.
    Release,
}

impl Border {
    /// All borders, in the order of their codes in files.
    pub const ALL: [Border; 10] = [
        Border::Touch,
        Border::Breakaway,
        Border::Landing,
        Border::Reversal,
        Border::Opening,
        Border::Closing,
        Border::Slip,
        Border::Separation,
        Border::Graze,
        Border::Release,
    ];

    /// Word in files.
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
            Border::Graze => "graze",
            Border::Release => "release",
        }
    }

    /// Description of the change.
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
            Border::Graze => "grazing: a slip that ends at rest only touches it",
            Border::Release => "grazing: a stick that breaks away only touches its limit",
        }
    }

    /// Whether derivatives are bounded on this side of the border. They have a root if a phase vanishes, or if it ends
    /// with a vanishing rate.
    pub fn is_regular(self) -> bool {
        !self.grazes() && !matches!(self, Border::Landing | Border::Slip | Border::Separation)
    }

    /// Whether a phase ends with a vanishing rate at the border.
    pub fn grazes(self) -> bool {
        self != self.seen_within()
    }

    /// The same border, seen from the side on which the phase does not end there.
    pub fn seen_within(self) -> Border {
        match self {
            Border::Graze => Border::Touch,
            Border::Release => Border::Breakaway,
            other => other,
        }
    }
}

/// Distance of a motion from another sequence of events.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// Border.
    pub border: Border,
    /// Time, s.
    pub time: f64,
    /// Relative distance; see [`Border`].
    pub distance: f64,
}

/// A time interval in one mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShotPhase {
    /// Mode of the contact.
    pub mode: Mode,
    /// Start, s.
    pub from: f64,
    /// End, s.
    pub to: f64,
    /// Largest |omega_r| (rad/s) of a slip, or largest depth of F_n below zero over the largest F_n in a separation.
    /// In other modes, and without extrema, 0.
    pub depth: f64,
}

/// An event of a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct ShotEvent {
    /// Time, s.
    pub time: f64,
    pub kind: EventKind,
    pub mode_after: Mode,
}

/// A local maximum of |omega_r| in a slip.
#[derive(Debug, Clone, PartialEq)]
pub struct Peak {
    /// Time, s.
    pub time: f64,
    /// omega_r, rad/s.
    pub relative_velocity: f64,
    /// Mechanical state, as in [`Shot`].
    pub state: DVector<f64>,
}

/// The motion over a time interval. States have the mechanical components only: twists, rates, speeds of free chains,
/// bristles.
#[derive(Debug, Clone)]
pub struct Shot {
    /// State at the end.
    pub end: DVector<f64>,
    /// d(state)/dt at the start, 1/s.
    pub start_rates: DVector<f64>,
    /// d(state)/dt at the end, 1/s.
    pub end_rates: DVector<f64>,
    /// d(end)/d(start).
    pub by_state: DMatrix<f64>,
    /// d(end)/d(parameter), a column for each parameter.
    pub by_number: DMatrix<f64>,
    /// Events in order of time.
    pub events: Vec<ShotEvent>,
    /// Phases in order of time.
    pub phases: Vec<ShotPhase>,
    /// Largest magnitude of each component of the state.
    pub sizes: Vec<f64>,
    /// Maxima of |omega_r|, if extrema are wanted.
    pub peaks: Vec<Peak>,
    /// Distances from borders, if extrema are wanted.
    pub margins: Vec<Margin>,
    /// Smallest and largest position of a portrait (rad), if extrema are wanted; NaN for a system without a position.
    pub position: (f64, f64),
    /// Smallest and largest omega_r, rad/s, if extrema are wanted.
    pub relative_velocity: (f64, f64),
}

/// Wanted results of a motion.
#[derive(Clone, Copy)]
pub struct WantedResults<'a> {
    /// Parameters of the derivatives by parameters; `None` for no derivatives at all. Derivatives by the state are
    /// always included.
    pub derivatives: Option<&'a [MovedCases]>,
    /// Whether to find peaks and margins.
    pub extrema: bool,
    /// May end the motion.
    pub stop: &'a dyn Watch,
}

struct Tape<'a> {
    dynamics: &'a SystemDynamics,
    wanted: WantedResults<'a>,
    end_time: f64,
    end: Option<(Vec<f64>, SystemLocation)>,
    events: Vec<ShotEvent>,
    phases: Vec<ShotPhase>,
    sizes: Vec<f64>,
    peaks: Vec<Peak>,
    margins: Vec<Margin>,
    force: (f64, bool),
    /// Rate of each curve at the last point of the phase.
    rates: [Option<f64>; 3],
    position: (f64, f64),
    speed: (f64, f64),
    idle: u32,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum PortraitCurve {
    Contact,
    /// Distance of the normal force from the sign that ends the mode.
    Force,
    Position,
}

impl PortraitCurve {
    const ALL: [PortraitCurve; 3] = [PortraitCurve::Contact, PortraitCurve::Force, PortraitCurve::Position];
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
        self.phases.push(ShotPhase {
            mode,
            from: t,
            to,
            depth: 0.0,
        });
        self.rates = [None; 3];
    }

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
            let sense = torque.signum();
            let limit = system.breakaway_torque(sense, outside.normal_force);
            let limit_rise = system.breakaway_torque(sense, changes.normal_force);
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

    fn curve(&self, which: PortraitCurve, location: &SystemLocation, t: f64, y: &[f64]) -> Option<(f64, f64)> {
        match which {
            PortraitCurve::Contact => Some(self.watched(location, t, y)),
            PortraitCurve::Force => self.force.1.then(|| self.distance_of_force(location, t)),
            PortraitCurve::Position => position(self.dynamics, y),
        }
    }

    fn look(&mut self, (from, to): (f64, f64), location: &SystemLocation, at: &mut StateAt<'_>) -> Result<(), Error> {
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
            for (index, which) in PortraitCurve::ALL.into_iter().enumerate() {
                let Some((value, rate)) = self.curve(which, location, t, &y) else {
                    continue;
                };
                self.reach(which, location.mode, value);
                // At the start of a slip from rest, or of a stick at its limit, a rate has no sign.
                let begins = self.phases.last().is_some_and(|phase| phase.from == t);
                let fastest = self.speed.0.abs().max(self.speed.1.abs());
                let size = if location.mode == Mode::Stick { 1.0 } else { fastest };
                let at_rest = begins && which == PortraitCurve::Contact && value.abs() <= AT_REST * size;
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

    fn reach(&mut self, which: PortraitCurve, mode: Mode, value: f64) {
        let phase = self.phases.last_mut();
        match (which, phase) {
            (PortraitCurve::Position, _) => self.position = (self.position.0.min(value), self.position.1.max(value)),
            (PortraitCurve::Contact, Some(phase)) if mode.slides() => phase.depth = phase.depth.max(value),
            (PortraitCurve::Force, Some(phase)) if mode == Mode::Separated => phase.depth = phase.depth.max(value),
            _ => {}
        }
    }

    fn extremum(&mut self, which: PortraitCurve, (location, time, y): (&SystemLocation, f64, &[f64]), is_least: bool) {
        let Some((distance, _)) = self.curve(which, location, time, y) else {
            return;
        };
        self.reach(which, location.mode, distance);
        self.see_speed(location, time, y);
        let border = match (which, location.mode) {
            (PortraitCurve::Force, Mode::Separated) => Border::Closing,
            (PortraitCurve::Force, _) => Border::Opening,
            (PortraitCurve::Contact, Mode::Stick) => Border::Breakaway,
            _ => Border::Touch,
        };
        let slides = location.mode.sense() != 0;
        let engaged = location.mode == Mode::Engaged;
        match which {
            PortraitCurve::Contact if !is_least && (slides || engaged) => {
                let outside = self.dynamics.outside(location, time);
                self.peaks.push(Peak {
                    time,
                    relative_velocity: self.dynamics.system.relative_velocity(&outside, y),
                    state: DVector::from_column_slice(&y[..self.moving()]),
                });
            }
            PortraitCurve::Contact | PortraitCurve::Force
                if is_least && (which == PortraitCurve::Force || slides || location.mode == Mode::Stick) =>
            {
                self.margins.push(Margin { border, time, distance });
            }
            _ => {}
        }
    }

    /// Distance from the border beyond which a phase only touches the guard that ends it. Rate and curvature of the
    /// guard give its least value if the phase continued. None if the guard would continue to fall.
    fn graze(&mut self, time: f64, location: &SystemLocation, y: &[f64]) {
        let SystemDynamics { system, excitation, .. } = self.dynamics;
        let mut beyond = Expansion::new(system, excitation);
        beyond.terms = 3;
        let unit = self.dynamics.unit(location.stretch);
        beyond.expand((system, excitation), location, time, y, unit);
        let (border, [start, rate, curvature, ..], size) = if location.mode == Mode::Stick {
            let tested = beyond.tested(system);
            let sense = tested[0].signum();
            let limit = beyond.limit(system, sense);
            let spare: [f64; 3] = std::array::from_fn(|n| (limit[n] - sense * tested[n]) / limit[0]);
            (Border::Release, spare, 1.0)
        } else {
            let fall = std::array::from_fn(|n| location.sign() * beyond.relative_velocity[n]);
            (Border::Graze, fall, self.speed.0.abs().max(self.speed.1.abs()))
        };
        if start.abs() <= AT_REST * size && rate < 0.0 && curvature > 0.0 {
            let distance = rate * rate / (4.0 * curvature);
            self.margins.push(Margin { border, time, distance });
        }
    }

    /// 1 - |T|/(mu_0 r F_n) for surfaces that have just come to rest.
    fn spare_torque(&self, location: &SystemLocation, t: f64, y: &[f64]) -> f64 {
        let system = &self.dynamics.system;
        let outside = self.dynamics.outside(location, t);
        let mut joined = y.to_vec();
        system.join(&outside, &mut joined);
        let torque = system.tested_torque(&outside, &joined);
        1.0 - torque.abs() / system.breakaway_torque(torque, outside.normal_force)
    }
}

fn between(
    mut low: f64,
    mut high: f64,
    rises: bool,
    mut rate: impl FnMut(f64) -> Result<f64, Error>,
) -> Result<f64, Error> {
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

impl Observer for Tape<'_> {
    fn next_sample_time(&self) -> f64 {
        match self.end {
            Some(_) => f64::INFINITY,
            None => self.end_time,
        }
    }

    fn sample(&mut self, _: f64, location: &SystemLocation, y: &[f64]) -> Result<(), Error> {
        self.see(y);
        self.end = Some((y.to_vec(), *location));
        Ok(())
    }

    fn wants_inside(&self) -> bool {
        true
    }

    fn inside(&mut self, from: f64, to: f64, location: &SystemLocation, at: &mut StateAt<'_>) -> Result<(), Error> {
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
    ) -> Result<(), Error> {
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
        let ends_phase = matches!(
            (kind, before.0.mode),
            (
                EventKind::Stick | EventKind::Reversal,
                Mode::SlipForward | Mode::SlipBackward
            ) | (EventKind::Slip, Mode::Stick)
        );
        if self.wanted.extrema && ends_phase {
            self.graze(t, before.0, before.1);
        }
        if before.0.mode != after.0.mode {
            self.enter(t, after.0.mode);
        }
        Ok(())
    }

    fn segment(&mut self, report: &SegmentReport) -> Result<(), Error> {
        let moves = report.end - report.start > 4.0 * f64::EPSILON * report.end.abs();
        self.idle = if moves { 0 } else { self.idle + 1 };
        if self.idle > MOST_IDLE {
            let message = format!("the motion stands still at t = {:.12} s", report.end);
            return Err(Error::new(ErrorKind::Standstill, report.end, message));
        }
        Ok(())
    }

    fn progress(&mut self, _: f64, _: &SystemLocation) -> ControlFlow<()> {
        go_on_unless(self.wanted.stop.stopped())
    }
}

/// Derivative of the joined start state by the given state: surfaces that stick have one speed.
fn start_slopes(dynamics: &SystemDynamics, start: &Start) -> DMatrix<f64> {
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

/// Parameters of the derivatives: the components of the start state, then the parameters of the case.
fn numbers(
    (system, time): (&System, (f64, f64)),
    (dynamics, start): (&SystemDynamics, &Start),
    moved: &[MovedCases],
    solver: &SolverOptions,
) -> Vec<VariationColumn> {
    let slopes = start_slopes(dynamics, start);
    let of_state = slopes
        .column_iter()
        .map(|slope| VariationColumn::of_state(slope.into_owned()));
    let from = Some((time.0, &start.state[..]));
    let of_case = |cases: &MovedCases| moved_number(system, cases, from, solver, time.1).0;
    of_state.chain(moved.iter().map(of_case)).collect()
}

/// The motion of a system from `state` at `from` (s) over `time` (s), in a closed contact. `threshold` is in rad/s.
///
/// # Errors
/// Errors of a run, or an interruption by `wanted.stop`.
pub fn shoot(
    (system, threshold): (&System, f64),
    (from, state): (f64, &DVector<f64>),
    time: f64,
    wanted: WantedResults<'_>,
) -> Result<Shot, Error> {
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
        chatter_window: rules.chatter_window(),
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
            let carried = Carried::new(dynamics.clone(), f64::INFINITY, columns).beside_borders();
            let carried = Arc::new(Mutex::new(carried));
            let mut rules = CarryingRules::new(rules, carried.clone());
            let finish = hybrid::run(&dynamics, &mut rules, start, end_time, limits, &mut tape);
            let slopes = carried.lock().unwrap_or_else(PoisonError::into_inner).slopes();
            (finish, Some(slopes))
        }
    };
    let finish = finish?;
    let Some((end, location)) = tape.end.take().filter(|_| !finish.interrupted) else {
        return Err(Error::new(ErrorKind::Interrupted, f64::NAN, "interrupted"));
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
