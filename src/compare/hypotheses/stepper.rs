//! Solvers that step: the equations of a case by a method of low order, with events at the ends of its steps.

use super::super::creep::SHAPES;
use super::super::reference::Physics;
use super::observation::{Observation, Values};
use super::play::Played;
use crate::friction::Law;
use crate::model::Mode;
use crate::record::EventKind;
use crate::record::sequence::SequenceEvent;
use crate::simulation::Course;

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

    /// Whether the order is below four.
    pub fn is_low(self) -> bool {
        !matches!(self, Scheme::Exact | Scheme::RungeKutta)
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
    /// Of mu_0, at which a stick ends.
    pub breakaway: f64,
    /// The twist of the rotor's first shaft is a multiple of this after every step, rad; 0 where it is not rounded.
    pub digit: f64,
}

/// Steps of a run at most; and of the fixed point of an implicit step.
const MOST_STEPS: f64 = 1e6;
const MOST_ITERATIONS: usize = 60;
/// What a sample may be off the grid of the steps, in steps.
const OFF: f64 = 0.02;
/// Expansions in a step at most.
const MOST_EXPANSIONS: usize = 100;

struct Motion<'a> {
    physics: &'a Physics,
    /// A function in the place of the sign: of [`SHAPES`], with its speed (rad/s).
    smooth: Option<(usize, f64)>,
    course: Course,
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
        self.course.stand_before(self.mode, self.t, &self.y);
        for (column, &channel) in values.iter_mut().zip(&observation.channels) {
            column[row] = self.course.series(self.physics.quantity(channel), 0.0).0[0];
        }
    }

    fn rates(&self, t: f64, y: &[f64], rates: &mut [f64]) {
        let (system, outside) = (self.physics.system(), self.course.outside(t));
        if let Some((shape, speed)) = self.smooth {
            system.rates(Mode::Separated, 0.0, 0, &outside, y, rates);
            let w = system.relative_velocity(&outside, y);
            let share = system.law_in(system.piece_of(w)).coefficient(w.abs()) * (SHAPES[shape].value)(w / speed);
            let torque = share * system.radius * outside.normal_force;
            rates
                .iter_mut()
                .zip(system.interface_rates())
                .for_each(|(rate, per)| *rate += torque * per);
            return;
        }
        let mut sense = f64::from(self.mode.sense());
        let mut piece = 0;
        if !matches!(self.mode, Mode::Stick | Mode::Separated) {
            let w = system.relative_velocity(&outside, y);
            piece = system.piece_of(w);
            if self.mode == Mode::Engaged {
                sense = 1f64.copysign(w);
            }
        }
        system.rates(self.mode, sense, piece, &outside, y, rates);
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
            Scheme::Exact => {
                let span = (t, t + h);
                arrived = self
                    .course
                    .go(self.mode, span, &mut self.y, MOST_EXPANSIONS, &mut |_, _| {});
            }
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
        course: physics.course(),
        mode: Mode::Separated,
        t: from,
        y: y.to_vec(),
        scratch: Default::default(),
    };
    let times = observation.time.iter().copied();
    if (times.clone().last()? - from) / longest > MOST_STEPS {
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

impl Stepper {
    /// The motion from a time (s) and a state on, at the times of an observation, which have to be on the grid of the steps; `None` if
    /// they are not, the contact opens or the motion has no end.
    pub fn play(&self, physics: &Physics, (from, y): (f64, &[f64]), observation: &Observation) -> Option<Played> {
        let last = *observation.time.last()?;
        let steps = ((last - from) / self.step).round();
        let on_grid = |time: &&f64| {
            let place = (**time - from) / self.step;
            (place - place.round()).abs() <= OFF
        };
        let later = observation.time.iter().filter(|time| **time >= from);
        if steps > MOST_STEPS || later.clone().count() == 0 || !later.clone().all(|time| on_grid(&time)) {
            return None;
        }
        let system = physics.system();
        let mut motion = Motion {
            physics,
            smooth: None,
            course: physics.course(),
            mode: Mode::Stick,
            t: from,
            y: y.to_vec(),
            scratch: Default::default(),
        };
        let limit = |t: f64| {
            let force = physics.course.outside(t).normal_force;
            (force > 0.0).then(|| self.breakaway * system.breakaway_torque(force))
        };
        let torque = |t: f64, y: &[f64]| system.tested_torque(&physics.course.outside(t), y);
        motion.mode = match (physics.sticks(), motion.velocity()) {
            (false, _) => Mode::Engaged,
            (true, w) if w.abs() > 1e-12 * physics.speed() => Mode::sliding(w),
            (true, _) => match torque(from, y) {
                driving if driving.abs() <= limit(from)? => Mode::Stick,
                driving => Mode::sliding(driving),
            },
        };
        let frozen = matches!(self.stop, Stop::Frozen(_));
        let mut values = vec![vec![f64::NAN; observation.time.len()]; observation.channels.len()];
        let (mut events, mut row) = (Vec::new(), observation.time.partition_point(|time| *time < from));
        for n in 0..=steps as usize {
            // The grid of the samples, without what sums of steps round to.
            motion.t = from + n as f64 * self.step;
            while observation
                .time
                .get(row)
                .is_some_and(|time| *time < motion.t + 0.5 * self.step)
            {
                motion.read(&mut values, observation, row);
                row += 1;
            }
            let (before, mode) = (motion.velocity(), motion.mode);
            if !motion.step(self.scheme, self.step) {
                return None;
            }
            if self.digit > 0.0 {
                let twist = &mut motion.y[system.rotor.twists];
                *twist = (*twist / self.digit).round() * self.digit;
            }
            let (t, limit) = (motion.t, limit(motion.t)?);
            let mut event = |kind| events.push(SequenceEvent { time: t, kind });
            match mode {
                Mode::Stick => {
                    let driving = torque(t, &motion.y);
                    if driving.abs() > limit {
                        motion.mode = Mode::sliding(driving);
                        event(EventKind::Slip);
                    }
                }
                Mode::SlipForward | Mode::SlipBackward => {
                    let w = motion.velocity();
                    let through = f64::from(mode.sense()) * w <= 0.0;
                    let stops = match self.stop {
                        Stop::Sign => through,
                        Stop::Within(band) | Stop::Frozen(band) => w.abs() <= band && w.abs() < before.abs(),
                    };
                    if stops && torque(t, &motion.y).abs() <= limit {
                        motion.mode = Mode::Stick;
                        if !frozen {
                            system.join(&motion.course.outside(t), &mut motion.y);
                        }
                        event(EventKind::Stick);
                    } else if through {
                        motion.mode = Mode::sliding(-f64::from(mode.sense()));
                        event(EventKind::Reversal);
                    }
                }
                _ => {}
            }
        }
        Some(Played {
            values,
            events,
            steps: steps as u64,
        })
    }
}
