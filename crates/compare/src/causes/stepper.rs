//! Solvers with steps: the equations of a case by a method of low order, with events at the ends of steps.

use super::motion::Played;
use super::observation::{Observation, ObservedValues};
use super::smooth::SHAPES;
use crate::Channel;
use crate::reference::Physics;
use std::cmp::Ordering;
use stickslip_engine::simulation::Course;
use stickslip_system::friction::Law;
use stickslip_system::model::Mode;
use stickslip_system::model::system::Kick;
use stickslip_system::record::EventKind;
use stickslip_system::record::sequence::SequenceEvent;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scheme {
    Exact,
    RungeKutta,
    Midpoint,
    Trapezoid,
    SymplecticEuler,
    Euler,
    ImplicitEuler,
}

/// Name, order, and a Runge-Kutta tableau: coefficients, weights and nodes. The solution itself has no tableau.
type SchemeRow = (
    &'static str,
    i32,
    &'static [&'static [f64]],
    &'static [f64],
    &'static [f64],
);

const CLASSICAL: [&[f64]; 4] = [&[], &[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0]];
const SIXTH: f64 = 1.0 / 6.0;
const SIMPSON: [f64; 4] = [SIXTH, 2.0 * SIXTH, 2.0 * SIXTH, SIXTH];

impl Scheme {
    /// All methods, which have an order.
    pub const METHODS: [Scheme; 6] = [
        Scheme::RungeKutta,
        Scheme::Midpoint,
        Scheme::Trapezoid,
        Scheme::SymplecticEuler,
        Scheme::Euler,
        Scheme::ImplicitEuler,
    ];

    fn row(self) -> SchemeRow {
        match self {
            Scheme::Exact => ("an exact method", 0, &[], &[], &[]),
            Scheme::RungeKutta => (
                "the classical Runge-Kutta method",
                4,
                &CLASSICAL,
                &SIMPSON,
                &[0.0, 0.5, 0.5, 1.0],
            ),
            Scheme::Midpoint => ("the midpoint method", 2, &[&[], &[0.5]], &[0.0, 1.0], &[0.0, 0.5]),
            Scheme::Trapezoid => ("the trapezoidal rule", 2, &[&[], &[0.5, 0.5]], &[0.5, 0.5], &[0.0, 1.0]),
            Scheme::SymplecticEuler => ("the semi-implicit Euler method", 1, &[&[]], &[1.0], &[0.0]),
            Scheme::Euler => ("the explicit Euler method", 1, &[&[]], &[1.0], &[0.0]),
            Scheme::ImplicitEuler => ("the implicit Euler method", 1, &[&[1.0]], &[1.0], &[1.0]),
        }
    }

    pub fn name(self) -> &'static str {
        self.row().0
    }

    pub fn order(self) -> i32 {
        self.row().1
    }

    pub fn is_low(self) -> bool {
        (1..4).contains(&self.order())
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stop {
    /// omega_r has changed its sign; it is then set to zero.
    Sign,
    /// |omega_r| is at most this (rad/s) and falls; omega_r is then set to zero.
    Within(f64),
    /// Like `Within`, but omega_r keeps its value.
    Frozen(f64),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stepper {
    pub step: f64,
    pub scheme: Scheme,
    pub stop: Stop,
    /// Events are located within a step, not taken at its end,
    pub located: bool,
    /// but slips begin at its end.
    pub late_slips: bool,
    /// A sample at the end of a step shows the state before the event there is handled.
    pub shows_before: bool,
    /// Within a step through zero the law depends on |omega_r|, not on omega_r in the sense of the slip.
    pub even: bool,
    /// A step through zero and out of the tolerance again is no stick.
    pub strict: bool,
    /// Part of mu_0 at which a stick ends.
    pub breakaway: f64,
    /// The twist of the rotor's first shaft is rounded to a multiple of this after every step, rad; 0 without rounding.
    pub digit: f64,
}

const MOST_STEPS: f64 = 3e5;
const MOST_ITERATIONS: usize = 60;
const MOST_EXPANSIONS: usize = 100;

struct Expanded {
    mode: Mode,
    from: f64,
    end: f64,
    known: [(f64, Vec<f64>); 2],
}

/// Length of an expansion that short steps share, in natural periods.
const SHARED: f64 = 0.125;

struct SteppedMotion<'a> {
    physics: &'a Physics,
    /// Index in [`SHAPES`] of a function that replaces the sign, with its speed (rad/s).
    smooth: Option<(usize, f64)>,
    even: bool,
    course: Course,
    /// Separate course for the channels, so that `course` keeps its expansion.
    reading: Course,
    expanded: Option<Expanded>,
    mode: Mode,
    t: f64,
    y: Vec<f64>,
    stages: Vec<Vec<f64>>,
}

impl<'a> SteppedMotion<'a> {
    fn new(physics: &'a Physics, (from, y): (f64, &[f64])) -> SteppedMotion<'a> {
        SteppedMotion {
            physics,
            smooth: None,
            even: false,
            course: physics.course(),
            reading: physics.course(),
            expanded: None,
            mode: Mode::Separated,
            t: from,
            y: y.to_vec(),
            stages: Vec::new(),
        }
    }

    fn velocity(&self) -> f64 {
        self.physics
            .system()
            .relative_velocity(&self.course.outside(self.t), &self.y)
    }

    fn read(&mut self, values: &mut ObservedValues, observation: &Observation, row: usize) {
        self.reading.stand_before(self.mode, self.t, &self.y);
        for (column, &channel) in values.iter_mut().zip(&observation.channels) {
            column[row] = match channel {
                // Some solvers keep omega_r in a stick.
                Channel::RELATIVE_VELOCITY => self.velocity(),
                _ => self.reading.series(self.physics.quantity(channel), 0.0).0[0],
            };
        }
    }

    fn rates(&self, t: f64, y: &[f64], rates: &mut [f64]) {
        let (system, outside) = (self.physics.system(), self.course.outside(t));
        let mut sense = f64::from(self.mode.sense());
        if self.smooth.is_some() || self.even && sense != 0.0 {
            system.rates(Mode::Separated, 0.0, 0, &outside, y, rates);
            let w = system.relative_velocity(&outside, y);
            let sign = self
                .smooth
                .map_or(sense, |(shape, speed)| (SHAPES[shape].value)(w / speed));
            let share = system.law_in(w, system.piece_of(w)).coefficient(w.abs()) * sign;
            let torque = share * system.radius * outside.normal_force;
            let each = rates.iter_mut().zip(system.interface_rates());
            each.for_each(|(rate, per)| *rate += torque * per);
            return;
        }
        let mut piece = 0;
        if self.mode.slides() {
            let w = system.relative_velocity(&outside, y);
            piece = system.piece_of(w);
            if self.mode == Mode::Engaged {
                sense = 1f64.copysign(w);
            }
        }
        system.rates(self.mode, sense, piece, &outside, y, rates);
    }

    /// Advances the state to a time (s) by the equations; `false` if it fails.
    fn exact(&mut self, to: f64) -> bool {
        let (t, mode) = (self.t, self.mode);
        let is_on = |expanded: &Expanded| {
            let known = expanded.known.iter().position(|(time, y)| *time == t && *y == self.y);
            known.filter(|_| expanded.mode == mode && to <= expanded.end)
        };
        let mut on = self.expanded.as_ref().and_then(is_on);
        if on.is_none() {
            let longest = SHARED * self.physics.natural_period();
            let corner = self.course.next_corner(t).map_or(f64::INFINITY, |corner| corner - t);
            let longest = longest.min(corner);
            if to - t < 0.5 * longest {
                let length = self.course.expand(mode, t, &self.y, longest);
                on = (t + length >= to).then_some(0);
                self.expanded = on.map(|_| Expanded {
                    mode,
                    from: t,
                    end: t + length,
                    known: [(t, self.y.clone()), (t, self.y.clone())],
                });
            }
        }
        match (on, &mut self.expanded) {
            (Some(place), Some(expanded)) => {
                // The start of a step stays known, because the step may begin again.
                if place == 1 {
                    expanded.known.swap(0, 1);
                }
                self.course.after(to - expanded.from, &mut self.y);
                let last = &mut expanded.known[1];
                last.0 = to;
                last.1.copy_from_slice(&self.y);
                true
            }
            _ => {
                self.expanded = None;
                self.course
                    .go(mode, (t, to), &mut self.y, MOST_EXPANSIONS, &mut |_, _| {})
            }
        }
    }

    /// A step of `h`, s; `false` if it fails.
    fn step(&mut self, scheme: Scheme, h: f64) -> bool {
        let t = self.t;
        let (_, order, coefficients, weights, nodes) = scheme.row();
        let arrived = order > 0 || self.exact(t + h);
        let mut stages = std::mem::take(&mut self.stages);
        stages.resize(weights.len() + 2, vec![0.0; self.y.len()]);
        let (spare, stages_of_step) = stages.split_at_mut(2);
        let [at, new] = spare else { return false };
        let is_implicit = coefficients.iter().enumerate().any(|(stage, row)| row.len() > stage);
        if is_implicit {
            self.rates(t, &self.y, at);
            stages_of_step.iter_mut().for_each(|stage| stage.copy_from_slice(at));
        }
        for _ in 0..if is_implicit { MOST_ITERATIONS } else { 1 } {
            let mut change = 0.0f64;
            for (number, (row, node)) in coefficients.iter().zip(nodes).enumerate() {
                at.copy_from_slice(&self.y);
                add(at, h, row, stages_of_step);
                self.rates(t + node * h, at, new);
                let pairs = stages_of_step[number].iter().zip(&*new);
                change = pairs.fold(change, |change, (old, new)| {
                    change.max((new - old).abs() / (1e-300 + new.abs()))
                });
                stages_of_step[number].copy_from_slice(new);
            }
            if change < 1e-15 {
                break;
            }
        }
        add(&mut self.y, h, weights, stages_of_step);
        if scheme == Scheme::SymplecticEuler {
            // Twists follow the rates at the end of the step.
            for rate in self.physics.system().twist_rates() {
                self.y[rate - 1] += h * h * stages_of_step[0][rate];
            }
        }
        self.stages = stages;
        self.t = t + h;
        arrived && self.y.iter().all(|y| y.is_finite())
    }
}

/// Adds the sum of the stages, times `h` and their weights, to a state.
fn add(y: &mut [f64], h: f64, weights: &[f64], stages: &[Vec<f64>]) {
    for (weight, stage) in weights.iter().zip(stages).filter(|(weight, _)| **weight != 0.0) {
        y.iter_mut().zip(stage).for_each(|(y, rate)| *y += h * weight * rate);
    }
}

/// Runge-Kutta step in parts of the time in which friction at rest stops a surface.
const SHORT: f64 = 0.2;
const MOST_SHORT_STEPS: f64 = 1e6;

/// The motion with a smooth function (index in [`SHAPES`], speed in rad/s) that replaces the sign, at the times of an
/// observation.
pub(crate) fn creeping(
    physics: &Physics,
    smooth: (usize, f64),
    (from, y): (f64, &[f64]),
    observation: &Observation,
) -> Option<Played> {
    let system = physics.system();
    let per_torque = 1.0 / system.rotor.surface_inertia() + 1.0 / system.stator.surface_inertia();
    let rate = system.law.coefficient(0.0) * system.radius * physics.course.largest_force() * per_torque / smooth.1;
    let longest = (SHORT / rate).min(SHORT / physics.course.fastest_rate());
    let mut motion = SteppedMotion {
        smooth: Some(smooth),
        ..SteppedMotion::new(physics, (from, y))
    };
    let times = observation.time.iter().copied();
    if (times.clone().last()? - from) / longest > MOST_SHORT_STEPS {
        return None;
    }
    let mut values = vec![vec![f64::NAN; observation.time.len()]; observation.channels.len()];
    for (row, time) in times.enumerate().filter(|(_, time)| *time >= from) {
        let begins = motion.t;
        let steps = ((time - begins) / longest).ceil().max(0.0);
        for n in 0..steps as usize {
            motion.t = begins + (time - begins) * n as f64 / steps;
            if !motion.step(Scheme::RungeKutta, (time - begins) / steps) {
                return None;
            }
        }
        motion.t = time;
        motion.read(&mut values, observation, row);
    }
    let (events, steps) = (Vec::new(), 0);
    Some(Played { values, events, steps })
}

/// Every `SEVERAL` samples, a motion is given up if it leaves more than `HALF` of the reference's squared difference so
/// far, and one of the two exceeds `PART` of the whole. It is also given up if it leaves more than `LEAVES` of the
/// whole,
const HALF: f64 = 0.5;
const SEVERAL: usize = 32;
const PART: f64 = 1e-5;
const LEAVES: f64 = 0.05;
/// or if it is this many times farther from the candidate than the reference is, with differences above this part of
/// the sizes.
const FARTHER: f64 = 100.0;
const DISTINCT: f64 = 1e-8;

struct StepperRows<'a> {
    observation: Option<&'a Observation>,
    values: ObservedValues,
    row: usize,
    end: usize,
    /// Sums of squares of candidate minus motion, and of candidate minus reference. `whole`: final value of the second
    /// sum; infinite if a motion is not given up.
    squares: [f64; 2],
    whole: f64,
    given_up: bool,
}

impl<'a> StepperRows<'a> {
    fn new(observation: Option<&'a Observation>, from: f64, end: usize) -> StepperRows<'a> {
        let (channels, count) = observation.map_or((0, 0), |seen| (seen.channels.len(), seen.time.len()));
        StepperRows {
            observation,
            values: vec![vec![f64::NAN; count]; channels],
            row: observation.map_or(0, |seen| seen.time.partition_point(|time| *time < from)),
            end: end.min(count),
            squares: [0.0; 2],
            whole: match observation {
                Some(seen) if end == usize::MAX => seen.square(&seen.reference),
                _ => f64::INFINITY,
            },
            given_up: false,
        }
    }

    fn next(&self) -> Option<f64> {
        let observation = self.observation?;
        (self.row < self.end).then(|| observation.time[self.row])
    }

    fn read(&mut self, motion: &mut SteppedMotion<'_>) {
        let Some(observation) = self.observation else {
            return;
        };
        motion.read(&mut self.values, observation, self.row);
        let known = observation
            .difference(&self.values, self.row)
            .zip(observation.difference(&observation.reference, self.row));
        if let Some((own, reference)) = known {
            self.squares[0] += own;
            self.squares[1] += reference;
        }
        self.row += 1;
        let [own, reference] = self.squares;
        let shows = self.whole.is_finite() && own > DISTINCT * DISTINCT * self.row as f64;
        let is_farther = shows && own > FARTHER * FARTHER * reference;
        let is_far =
            is_farther || own.max(reference) > PART * self.whole && own > HALF * reference || own > LEAVES * self.whole;
        self.given_up |= self.row.is_multiple_of(SEVERAL) && is_far;
    }
}

/// Halvings of a step to locate an event, and most events in a step.
const HALVINGS: usize = 45;
const MOST_IN_STEP: usize = 20;

impl Stepper {
    /// A solver that takes events, or sticks, at a change of sign.
    pub fn new(scheme: Scheme, located: bool, step: f64) -> Stepper {
        Stepper {
            step,
            scheme,
            stop: Stop::Sign,
            located,
            late_slips: false,
            shows_before: false,
            strict: false,
            even: false,
            breakaway: 1.0,
            digit: 0.0,
        }
    }

    pub fn is_variant(&self) -> bool {
        self.strict || self.even
    }

    /// The motion from a time (s) and a state to a time: its events, and the first `rows` samples of an observation.
    /// With `usize::MAX` rows it ends once it is far from the candidate. `None` if the contact opens or the motion does
    /// not finish.
    pub fn play(
        &self,
        physics: &Physics,
        (from, y): (f64, &[f64]),
        kicks: &[Kick],
        observation: Option<&Observation>,
        (to, rows): (f64, usize),
    ) -> Option<Played> {
        let mut rows = StepperRows::new(observation, from, rows);
        let last = match observation {
            Some(observation) => *observation.time.get(rows.end.checked_sub(1)?)?,
            None => to,
        };
        let steps = ((last - from) / self.step).ceil();
        if !(1.0..=MOST_STEPS).contains(&steps) {
            return None;
        }
        let system = physics.system();
        let mut motion = SteppedMotion {
            even: self.even,
            ..SteppedMotion::new(physics, (from, y))
        };
        let later = |kick: &&Kick| kick.time.at().is_some_and(|time| *time > from);
        let mut kicks: Vec<&Kick> = kicks.iter().filter(later).collect();
        kicks.sort_by(|a, b| a.time.at().partial_cmp(&b.time.at()).unwrap_or(Ordering::Equal));
        let torque = |t: f64, y: &[f64]| system.tested_torque(&physics.course.outside(t), y);
        let mode = |motion: &SteppedMotion<'_>| -> Option<Mode> {
            Some(match (physics.sticks(), motion.velocity()) {
                (false, _) => Mode::Engaged,
                (true, w) if w.abs() > 1e-12 * physics.speed() => Mode::sliding(w),
                (true, _) => match torque(motion.t, &motion.y) {
                    driving if driving.abs() <= self.limit(physics, driving, motion.t)? => Mode::Stick,
                    driving => Mode::sliding(driving),
                },
            })
        };
        motion.mode = mode(&motion)?;
        let mut events = Vec::new();
        for n in 0..steps as usize {
            if rows.given_up {
                break;
            }
            // The grid of steps, free of accumulated rounding.
            let grid = [n, n + 1].map(|n| from + n as f64 * self.step);
            motion.t = grid[0];
            for _ in 0..MOST_IN_STEP {
                let next = kicks.first().and_then(|kick| kick.time.at().copied());
                let next = next.filter(|time| *time <= grid[1]);
                if self.part(&mut motion, next.unwrap_or(grid[1]), &mut rows, &mut events)? && next.is_some() {
                    let (kick, is_stuck) = (kicks.remove(0), motion.mode == Mode::Stick);
                    system.kick(kick.on, kick.relative_velocity, is_stuck, &mut motion.y);
                    motion.mode = mode(&motion)?;
                }
                if motion.t >= grid[1] {
                    break;
                }
            }
            if motion.t < grid[1] {
                return None;
            }
            if self.digit > 0.0 {
                let twist = &mut motion.y[system.rotor.twists];
                *twist = (*twist / self.digit).round() * self.digit;
            }
        }
        while !rows.given_up && rows.next().is_some() {
            rows.read(&mut motion);
        }
        Some(Played {
            values: rows.values,
            events,
            steps: steps as u64,
        })
    }

    /// Torque at which a stick ends into a sense of sliding, N m; `None` if the contact is open.
    fn limit(&self, physics: &Physics, sense: f64, t: f64) -> Option<f64> {
        let force = physics.course.outside(t).normal_force;
        (force > 0.0).then(|| self.breakaway * physics.system().breakaway_torque(sense, force))
    }

    /// A step, or its part up to an event; `true` if it was completed.
    fn part(
        &self,
        motion: &mut SteppedMotion<'_>,
        to: f64,
        rows: &mut StepperRows<'_>,
        events: &mut Vec<SequenceEvent>,
    ) -> Option<bool> {
        let (physics, system) = (motion.physics, motion.physics.system());
        let (from, start, before, mode) = (motion.t, motion.y.clone(), motion.velocity(), motion.mode);
        let torque = |motion: &SteppedMotion<'_>| system.tested_torque(&physics.course.outside(motion.t), &motion.y);
        // The event at the end of a step to the current state.
        let happens = |motion: &SteppedMotion<'_>| -> Option<Option<EventKind>> {
            let driving = torque(motion);
            let limit = self.limit(physics, driving, motion.t)?;
            Some(match mode {
                Mode::Stick => (driving.abs() > limit).then_some(EventKind::Slip),
                Mode::SlipForward | Mode::SlipBackward => {
                    let w = motion.velocity();
                    let through = f64::from(mode.sense()) * w <= 0.0;
                    let stops = match self.stop {
                        Stop::Sign => through,
                        Stop::Within(band) | Stop::Frozen(band) => {
                            through && !self.strict || w.abs() <= band && w.abs() < before.abs()
                        }
                    };
                    match stops && driving.abs() <= limit {
                        true => Some(EventKind::Stick),
                        false => through.then_some(EventKind::Reversal),
                    }
                }
                _ => None,
            })
        };
        let go = |motion: &mut SteppedMotion<'_>, length: f64| {
            motion.t = from;
            motion.y.copy_from_slice(&start);
            length == 0.0 || motion.step(self.scheme, length)
        };
        let mut length = to - from;
        if !go(motion, length) {
            return None;
        }
        let mut event = happens(motion)?;
        let whole = event.is_none() || !self.located || self.late_slips && mode == Mode::Stick;
        if !whole {
            let (mut low, mut high) = (0.0, length);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if !go(motion, middle) {
                    return None;
                }
                match happens(motion)? {
                    Some(kind) => (high, event) = (middle, Some(kind)),
                    None => low = middle,
                }
            }
            length = high;
        }
        let end = if self.shows_before { 1.0 + 1e-9 } else { 1.0 - 1e-9 };
        let is_inside = |time: f64| time < from + length * end;
        while let Some(time) = rows.next().filter(|time| is_inside(*time)) {
            let since = Some(time - from).filter(|since| *since > 1e-9 * self.step);
            if !go(motion, since.unwrap_or(0.0)) {
                return None;
            }
            rows.read(motion);
        }
        if !go(motion, length) {
            return None;
        }
        if whole {
            motion.t = to;
        }
        let time = motion.t;
        match event {
            None => {}
            Some(EventKind::Slip) => motion.mode = Mode::sliding(torque(motion)),
            Some(EventKind::Stick) => {
                motion.mode = Mode::Stick;
                if !matches!(self.stop, Stop::Frozen(_)) {
                    system.join(&motion.course.outside(time), &mut motion.y);
                }
            }
            Some(_) => motion.mode = Mode::sliding(-f64::from(mode.sense())),
        }
        events.extend(event.map(|kind| SequenceEvent { time, kind }));
        Some(whole)
    }
}
