//! Solvers that step: the equations of a case by a method of low order, with events at the ends of its steps.

use super::super::Channel;
use super::super::creep::SHAPES;
use super::super::reference::Physics;
use super::observation::{Observation, Values};
use super::play::Played;
use crate::friction::Law;
use crate::model::Mode;
use crate::model::system::Kick;
use crate::record::EventKind;
use crate::record::sequence::SequenceEvent;
use crate::simulation::Course;
use std::cmp::Ordering;

/// How a step is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Scheme {
    /// The Taylor series: without error.
    Exact,
    RungeKutta,
    Midpoint,
    Trapezoid,
    Euler,
    SymplecticEuler,
    ImplicitEuler,
}

impl Scheme {
    pub const ALL: [Scheme; 7] = [
        Scheme::Exact,
        Scheme::RungeKutta,
        Scheme::Midpoint,
        Scheme::Trapezoid,
        Scheme::SymplecticEuler,
        Scheme::Euler,
        Scheme::ImplicitEuler,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Scheme::Exact => "an exact method",
            Scheme::RungeKutta => "the classical Runge-Kutta method",
            Scheme::Midpoint => "the midpoint method",
            Scheme::Trapezoid => "the trapezoidal rule",
            Scheme::Euler => "the explicit Euler method",
            Scheme::SymplecticEuler => "the semi-implicit Euler method",
            Scheme::ImplicitEuler => "the implicit Euler method",
        }
    }

    /// The order; `None` of what has no error.
    pub fn order(self) -> Option<i32> {
        match self {
            Scheme::Exact => None,
            Scheme::RungeKutta => Some(4),
            Scheme::Midpoint | Scheme::Trapezoid => Some(2),
            Scheme::Euler | Scheme::SymplecticEuler | Scheme::ImplicitEuler => Some(1),
        }
    }

    /// Whether the order is below four.
    pub fn is_low(self) -> bool {
        self.order().is_some_and(|order| order < 4)
    }
}

/// How a stick is declared at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) enum Stop {
    /// omega_r has changed its sign; it then becomes zero.
    Sign,
    /// |omega_r| is up to this (rad/s) and falls; it then becomes zero.
    Within(f64),
    /// The same, but it stays what it was.
    Frozen(f64),
}

/// A solver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in super::super) struct Stepper {
    /// s.
    pub step: f64,
    pub scheme: Scheme,
    pub stop: Stop,
    /// Events are located within a step, not taken at its end.
    pub located: bool,
    /// A sample at the end of a step shows the state before what is done for an event there.
    pub shows_before: bool,
    /// Within a step that leads through zero the law is one of |omega_r|, not of omega_r in the sense of the slip.
    pub even: bool,
    /// A step that leads through zero and out of the tolerance again is no stick.
    pub strict: bool,
    /// Of mu_0, at which a stick ends.
    pub breakaway: f64,
    /// The twist of the rotor's first shaft is a multiple of this after every step, rad; 0 where it is not rounded.
    pub digit: f64,
}

/// Steps of a run at most; and of the fixed point of an implicit step.
const MOST_STEPS: f64 = 3e5;
const MOST_ITERATIONS: usize = 60;
/// Expansions in a step at most.
const MOST_EXPANSIONS: usize = 100;

/// An expansion of the motion, which many short steps share: where it began and ends (s), and states that are on it.
struct Expanded {
    mode: Mode,
    from: f64,
    end: f64,
    known: [(f64, Vec<f64>); 2],
}

/// How far an expansion that short steps share goes, in natural periods.
const SHARED: f64 = 0.125;

struct Motion<'a> {
    physics: &'a Physics,
    /// A function in the place of the sign: of [`SHAPES`], with its speed (rad/s).
    smooth: Option<(usize, f64)>,
    /// As [`Stepper::even`].
    even: bool,
    course: Course,
    /// For the channels, so that the other one keeps its expansion.
    reading: Course,
    expanded: Option<Expanded>,
    mode: Mode,
    t: f64,
    y: Vec<f64>,
    scratch: [Vec<f64>; 5],
}

impl Motion<'_> {
    fn velocity(&self) -> f64 {
        self.physics
            .system()
            .relative_velocity(&self.course.outside(self.t), &self.y)
    }

    /// Writes the channels into a row.
    fn read(&mut self, values: &mut Values, observation: &Observation, row: usize) {
        self.reading.stand_before(self.mode, self.t, &self.y);
        for (column, &channel) in values.iter_mut().zip(&observation.channels) {
            column[row] = match channel {
                // Which stays what it was in the stick of some solvers.
                Channel::RelativeVelocity => self.velocity(),
                _ => self.reading.series(self.physics.quantity(channel), 0.0).0[0],
            };
        }
    }

    fn rates(&self, t: f64, y: &[f64], rates: &mut [f64]) {
        let (system, outside) = (self.physics.system(), self.course.outside(t));
        let sense = f64::from(self.mode.sense());
        if self.smooth.is_some() || self.even && sense != 0.0 {
            system.rates(Mode::Separated, 0.0, 0, &outside, y, rates);
            let w = system.relative_velocity(&outside, y);
            let sign = self
                .smooth
                .map_or(sense, |(shape, speed)| (SHAPES[shape].value)(w / speed));
            let share = system.law_in(system.piece_of(w)).coefficient(w.abs()) * sign;
            let torque = share * system.radius * outside.normal_force;
            rates
                .iter_mut()
                .zip(system.interface_rates())
                .for_each(|(rate, per)| *rate += torque * per);
            return;
        }
        let mut sense = f64::from(self.mode.sense());
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

    /// Takes the state to a time (s) by the equations. Whether it has come there.
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
                // What a step begins with stays known, as it may begin again.
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

    fn step(&mut self, scheme: Scheme, h: f64) -> bool {
        let [mut a, mut b, mut c, mut d, mut at] = std::mem::take(&mut self.scratch);
        let t = self.t;
        let plus = |at: &mut Vec<f64>, y: &[f64], h: f64, k: &[f64]| {
            at.clear();
            at.extend(y.iter().zip(k).map(|(y, k)| y + h * k));
        };
        for rates in [&mut a, &mut b, &mut c, &mut d] {
            rates.resize(self.y.len(), 0.0);
        }
        let mut arrived = true;
        match scheme {
            Scheme::Exact => arrived = self.exact(t + h),
            Scheme::RungeKutta => {
                self.rates(t, &self.y, &mut a);
                plus(&mut at, &self.y, h / 2.0, &a);
                self.rates(t + h / 2.0, &at, &mut b);
                plus(&mut at, &self.y, h / 2.0, &b);
                self.rates(t + h / 2.0, &at, &mut c);
                plus(&mut at, &self.y, h, &c);
                self.rates(t + h, &at, &mut d);
                for (k, y) in self.y.iter_mut().enumerate() {
                    *y += h / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]);
                }
            }
            Scheme::Midpoint => {
                self.rates(t, &self.y, &mut a);
                plus(&mut at, &self.y, h / 2.0, &a);
                self.rates(t + h / 2.0, &at, &mut b);
                self.y.iter_mut().zip(&b).for_each(|(y, b)| *y += h * b);
            }
            Scheme::Euler => {
                self.rates(t, &self.y, &mut a);
                self.y.iter_mut().zip(&a).for_each(|(y, a)| *y += h * a);
            }
            Scheme::SymplecticEuler => {
                self.rates(t, &self.y, &mut a);
                self.y.iter_mut().zip(&a).for_each(|(y, a)| *y += h * a);
                // Twists by the rates at the end of the step.
                for rate in self.physics.system().twist_rates() {
                    self.y[rate - 1] += h * h * a[rate];
                }
            }
            Scheme::ImplicitEuler | Scheme::Trapezoid => {
                self.rates(t, &self.y, &mut a);
                let new = if scheme == Scheme::Trapezoid { 0.5 } else { 1.0 };
                plus(&mut at, &self.y, h, &a);
                for _ in 0..MOST_ITERATIONS {
                    self.rates(t + h, &at, &mut b);
                    let mut change = 0.0f64;
                    for (k, at) in at.iter_mut().enumerate() {
                        let next = self.y[k] + h * (new * b[k] + (1.0 - new) * a[k]);
                        change = change.max((next - *at).abs() / (1e-300 + next.abs()));
                        *at = next;
                    }
                    if change < 1e-15 {
                        break;
                    }
                }
                self.y.copy_from_slice(&at);
            }
        }
        self.t = t + h;
        self.scratch = [a, b, c, d, at];
        arrived && self.y.iter().all(|y| y.is_finite())
    }
}

/// A step of the Runge-Kutta method in parts of the time in which friction at rest stops a surface.
const SHORT: f64 = 0.2;
const MOST_SHORT_STEPS: f64 = 1e6;

/// The motion with a smooth function in the place of the sign, of [`SHAPES`] with its speed (rad/s), at the times of an observation.
pub(super) fn creeping(
    physics: &Physics,
    smooth: (usize, f64),
    (from, y): (f64, &[f64]),
    observation: &Observation,
) -> Option<Played> {
    let system = physics.system();
    let per_torque = 1.0 / system.rotor.surface_inertia() + 1.0 / system.stator.surface_inertia();
    let rate = system.law.coefficient(0.0) * system.radius * physics.course.largest_force() * per_torque / smooth.1;
    let longest = (SHORT / rate).min(SHORT / physics.course.fastest_rate());
    let mut motion = Motion {
        physics,
        smooth: Some(smooth),
        even: false,
        course: physics.course(),
        reading: physics.course(),
        expanded: None,
        mode: Mode::Separated,
        t: from,
        y: y.to_vec(),
        scratch: Default::default(),
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

/// A motion is given up when it takes away less than half of the squared difference up to a sample, looked at after so many, where the
/// reference or it leaves more than this part of the whole, and when what it leaves is more than a larger part.
const HALF: f64 = 0.5;
const SEVERAL: usize = 32;
const PART: f64 = 1e-5;
const LEAVES: f64 = 0.05;
/// So is one that is so much farther from the candidate than the reference is, by differences of more than a part of the sizes.
const FARTHER: f64 = 100.0;
const DISTINCT: f64 = 1e-8;

/// Which samples of an observation are written, and when a motion is given up.
struct Rows<'a> {
    observation: Option<&'a Observation>,
    values: Values,
    row: usize,
    /// Samples up to here.
    end: usize,
    /// Sums of the squares of candidate less motion, and less reference, and the whole of the latter; infinite where a motion is not given
    /// up.
    squares: [f64; 2],
    whole: f64,
    given_up: bool,
}

impl<'a> Rows<'a> {
    fn new(observation: Option<&'a Observation>, from: f64, end: usize) -> Rows<'a> {
        let (channels, count) = observation.map_or((0, 0), |seen| (seen.channels.len(), seen.time.len()));
        Rows {
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

    /// The time of the next sample, s.
    fn next(&self) -> Option<f64> {
        let observation = self.observation?;
        (self.row < self.end).then(|| observation.time[self.row])
    }

    /// Writes the next sample of a motion.
    fn read(&mut self, motion: &mut Motion<'_>) {
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

/// Halvings of a step in which an event is located, and events in a step at most.
const HALVINGS: usize = 45;
const MOST_IN_STEP: usize = 20;

impl Stepper {
    /// The motion from a time (s) and a state on, up to a time: its events, and the first `rows` samples of an observation; with
    /// `usize::MAX` of `rows` up to where it is far from the candidate. `None` if the contact opens, or the motion has no end.
    pub fn play(
        &self,
        physics: &Physics,
        (from, y): (f64, &[f64]),
        kicks: &[Kick],
        observation: Option<&Observation>,
        (to, rows): (f64, usize),
    ) -> Option<Played> {
        let mut rows = Rows::new(observation, from, rows);
        let last = match observation {
            Some(observation) => *observation.time.get(rows.end.checked_sub(1)?)?,
            None => to,
        };
        let steps = ((last - from) / self.step).ceil();
        if !(1.0..=MOST_STEPS).contains(&steps) {
            return None;
        }
        let system = physics.system();
        let mut motion = Motion {
            physics,
            smooth: None,
            even: self.even,
            course: physics.course(),
            reading: physics.course(),
            expanded: None,
            mode: Mode::Stick,
            t: from,
            y: y.to_vec(),
            scratch: Default::default(),
        };
        let kicks = kicks.iter();
        let mut kicks: Vec<&Kick> = kicks
            .filter(|kick| kick.time.at().is_some_and(|time| *time > from))
            .collect();
        kicks.sort_by(|a, b| a.time.at().partial_cmp(&b.time.at()).unwrap_or(Ordering::Equal));
        let torque = |t: f64, y: &[f64]| system.tested_torque(&physics.course.outside(t), y);
        let mode = |motion: &Motion<'_>| -> Option<Mode> {
            Some(match (physics.sticks(), motion.velocity()) {
                (false, _) => Mode::Engaged,
                (true, w) if w.abs() > 1e-12 * physics.speed() => Mode::sliding(w),
                (true, _) => match torque(motion.t, &motion.y) {
                    driving if driving.abs() <= self.limit(physics, motion.t)? => Mode::Stick,
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
            // The grid of the steps, without what their sums round to.
            let grid = [n, n + 1].map(|n| from + n as f64 * self.step);
            motion.t = grid[0];
            for _ in 0..MOST_IN_STEP {
                let next = kicks
                    .first()
                    .and_then(|kick| kick.time.at().copied())
                    .filter(|time| *time <= grid[1]);
                if self.part(&mut motion, next.unwrap_or(grid[1]), &mut rows, &mut events)? && next.is_some() {
                    let kick = kicks.remove(0);
                    system.kick(
                        kick.on,
                        kick.relative_velocity,
                        motion.mode == Mode::Stick,
                        &mut motion.y,
                    );
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

    /// The torque at which a stick ends, N m; `None` where the contact is open.
    fn limit(&self, physics: &Physics, t: f64) -> Option<f64> {
        let force = physics.course.outside(t).normal_force;
        (force > 0.0).then(|| self.breakaway * physics.system().breakaway_torque(force))
    }

    /// A step, or its part up to an event in it. Whether it was made to its end.
    fn part(
        &self,
        motion: &mut Motion<'_>,
        to: f64,
        rows: &mut Rows<'_>,
        events: &mut Vec<SequenceEvent>,
    ) -> Option<bool> {
        let (physics, system) = (motion.physics, motion.physics.system());
        let (from, start, before, mode) = (motion.t, motion.y.clone(), motion.velocity(), motion.mode);
        let torque = |motion: &Motion<'_>| system.tested_torque(&physics.course.outside(motion.t), &motion.y);
        // What happens at the end of a step that leads there.
        let happens = |motion: &Motion<'_>| -> Option<Option<EventKind>> {
            let limit = self.limit(physics, motion.t)?;
            Some(match mode {
                Mode::Stick => (torque(motion).abs() > limit).then_some(EventKind::Slip),
                Mode::SlipForward | Mode::SlipBackward => {
                    let w = motion.velocity();
                    let through = f64::from(mode.sense()) * w <= 0.0;
                    let stops = match self.stop {
                        Stop::Sign => through,
                        Stop::Within(band) | Stop::Frozen(band) => {
                            through && !self.strict || w.abs() <= band && w.abs() < before.abs()
                        }
                    };
                    match stops && torque(motion).abs() <= limit {
                        true => Some(EventKind::Stick),
                        false => through.then_some(EventKind::Reversal),
                    }
                }
                _ => None,
            })
        };
        let go = |motion: &mut Motion<'_>, length: f64| {
            motion.t = from;
            motion.y.copy_from_slice(&start);
            length == 0.0 || motion.step(self.scheme, length)
        };
        let mut length = to - from;
        if !go(motion, length) {
            return None;
        }
        let mut event = happens(motion)?;
        let whole = event.is_none() || !self.located;
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
        // Samples on the way, by the same method.
        let end = if self.shows_before { 1.0 + 1e-9 } else { 1.0 - 1e-9 };
        let is_inside = |time: f64| time < from + length * end;
        while let Some(time) = rows.next().filter(|time| is_inside(*time)) {
            if !go(
                motion,
                if time - from > 1e-9 * self.step {
                    time - from
                } else {
                    0.0
                },
            ) {
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
