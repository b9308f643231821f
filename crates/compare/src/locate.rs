//! Times of events between two samples, from the reference's equations.
//!
//! The last sample before an event is continued in its mode to the guard: omega_r = 0 for a stick or reversal, the
//! limit of the tested torque for a slip, the threshold of |omega_r| for a contact without stick. From there the motion
//! continues in the next mode to the first sample after the event. The miss there tests the equations. With the
//! rounding of the samples it bounds the time: every other switching time that leads to that sample is within the
//! bound. If a candidate switches elsewhere than at the guard, such as at the end of a step, its bound reaches that
//! place.

use super::candidate::Candidate;
use super::detect::Found;
use super::reference::Physics;
use std::collections::VecDeque;
use stickslip_engine::simulation::Course;
use stickslip_system::model::Mode;
use stickslip_system::record::EventKind;

/// Samples kept around an event: two before it, three after it, and those that reveal it.
const KEPT: usize = 10;
const MOST_STEPS: usize = 400;
const MOST_EXPANSIONS: usize = 500_000;
/// Most trials of a bound. Each shrinks it at least by the square root of the last excess.
const MOST_TRIALS: usize = 12;
/// Rounding of a motion in doubles, in parts of the size of the state.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// If the equations agree with the samples, their time is taken with a bound up to this multiple of the
/// interpolation's: for a mass without a shaft no sample shows when a stick began.
const AS_GOOD: f64 = 1.1;
/// Error of the reference's events, in natural periods.
const OF_REFERENCE: f64 = 1e-12;
const MOVED: f64 = 1e-7;

type SwitchRow = (f64, Vec<f64>);

#[derive(Debug)]
pub(super) struct Locator<'a> {
    physics: &'a Physics,
    candidate: &'a Candidate,
    course: Course,
    threshold: f64,
    /// Times at which the equations change, s, in order.
    breaks: Vec<f64>,
    rows: VecDeque<SwitchRow>,
    left: usize,
}

#[derive(Debug, Clone, Copy)]
struct Switch {
    kind: EventKind,
    mode: Mode,
    next: Mode,
    /// Sign of omega_r before a stop, and after a breakaway.
    sense: f64,
}

#[derive(Debug, Clone, Copy)]
struct Located {
    time: f64,
    bound: f64,
    /// The motion reaches the sample after the event within the rounding of both samples.
    agrees: bool,
}

impl<'a> Locator<'a> {
    /// `None` for a candidate without the whole state.
    pub fn new(
        physics: &'a Physics,
        candidate: &'a Candidate,
        threshold: f64,
        breaks: Vec<f64>,
    ) -> Option<Locator<'a>> {
        let is_whole = physics.state.iter().all(|&channel| candidate.has(channel));
        is_whole.then(|| Locator {
            physics,
            candidate,
            course: physics.course(),
            threshold,
            breaks,
            rows: VecDeque::with_capacity(KEPT),
            left: MOST_EXPANSIONS,
        })
    }

    /// Takes the next sample: time (s), and the channels of [`Physics::state`].
    pub fn add(&mut self, time: f64, value: impl Fn(usize) -> f64) {
        let mut y = match self.rows.len() {
            KEPT => self.rows.pop_front().map_or_else(Vec::new, |row| row.1),
            _ => Vec::new(),
        };
        y.resize(self.physics.system().dimension, 0.0);
        self.physics.set(&mut y, value);
        self.rows.push_back((time, y));
    }

    /// Improves the events after the first `located` ones. `clock` (s) is the rounding of the times.
    pub fn locate_all(&mut self, events: &mut [Found], located: &mut usize, clock: f64) {
        for event in &mut events[*located..] {
            self.locate(event, clock);
        }
        *located = events.len();
    }

    fn locate(&mut self, found: &mut Found, clock: f64) {
        if self.left == 0 {
            return;
        }
        let place = |time: f64| self.rows.iter().position(|row| row.0 == time);
        let (Some(before), Some(behind)) = (place(found.between.0), place(found.between.1)) else {
            return;
        };
        // Because of rounding or the tolerance, the last sample at rest may be after a breakaway.
        for before in [Some(before), before.checked_sub(1)].into_iter().flatten() {
            if let Some(located) = self.between(found, before, behind, clock)
                && located.bound < found.bound * if located.agrees { AS_GOOD } else { 1.0 }
                && (located.time - found.time).abs() <= found.bound + located.bound
            {
                (found.time, found.bound) = (located.time, located.bound);
                return;
            }
        }
    }

    fn velocity(&self, (time, y): (f64, &[f64])) -> f64 {
        self.physics.system().relative_velocity(&self.course.outside(time), y)
    }

    fn guard(&self, switch: &Switch, time: f64, y: &[f64]) -> f64 {
        let (system, outside) = (self.physics.system(), self.course.outside(time));
        let velocity = || system.relative_velocity(&outside, y);
        match (switch.mode, switch.kind) {
            (Mode::Engaged, EventKind::Stick) => velocity().abs() - self.threshold,
            (Mode::Engaged, _) => self.threshold - velocity().abs(),
            (Mode::Stick, _) => {
                let limit = system.breakaway_torque(switch.sense, outside.normal_force);
                limit - switch.sense * system.tested_torque(&outside, y)
            }
            _ => switch.sense * velocity(),
        }
    }

    fn switch(&self, kind: EventKind, before: &SwitchRow, behind: &SwitchRow) -> Option<Switch> {
        let of = |row: &SwitchRow| self.velocity((row.0, &row.1));
        let (mode, next, sense) = match kind {
            EventKind::Stick | EventKind::Slip if !self.physics.sticks() => (Mode::Engaged, Mode::Engaged, 0.0),
            EventKind::Stick => (Mode::sliding(of(before)), Mode::Stick, of(before).signum()),
            EventKind::Slip => (Mode::Stick, Mode::sliding(of(behind)), of(behind).signum()),
            EventKind::Reversal => (
                Mode::sliding(of(before)),
                Mode::sliding(-of(before)),
                of(before).signum(),
            ),
            _ => return None,
        };
        Some(Switch {
            kind,
            mode,
            next,
            sense,
        })
    }

    fn between(&mut self, found: &Found, before: usize, behind: usize, clock: f64) -> Option<Located> {
        let (from, behind_row) = (self.rows[before].clone(), &self.rows[behind]);
        let switch = self.switch(found.kind, &from, behind_row)?;
        let until = behind_row.0 + (behind_row.0 - from.0);
        let (time, y) = self.root(&switch, &from, until)?;
        // A sample within the tolerance may precede rest.
        let to = self.rows.iter().skip(behind).find(|row| row.0 > time)?.clone();
        let broken = self.breaks.partition_point(|at| *at <= from.0);
        if self.breaks.get(broken).is_some_and(|at| *at < to.0) {
            return None;
        }
        let arrived = self.arrival(&switch, (time, &y), to.0)?;
        let later = self.arrival(&switch, (time, &y), to.0 + 2.0 * clock)?;

        // Largest deviation of the arrival from the sample in each component, and of the time.
        let sizes = self.course.sizes().to_vec();
        let places = self.physics.places.clone();
        let error = |k: usize, y: &[f64]| self.candidate.rounding_of(self.physics.state[k], y[places[k]]);
        let limit = |k: usize| {
            let (place, of_sample) = (places[k], error(k, &to.1));
            let of_clock = (later[place] - arrived[place]).abs();
            of_clock + of_sample + ROUNDING * (sizes[place] + to.1[place].abs())
        };
        let mut limits: Vec<f64> = (0..places.len()).map(limit).collect();
        let errors: Vec<f64> = (0..places.len()).map(|k| error(k, &from.1)).collect();
        let of_reference = OF_REFERENCE * self.physics.natural_period();
        let mut of_guard = clock + of_reference + 4.0 * f64::EPSILON * time.abs();
        for (k, &place) in places.iter().enumerate() {
            let size = sizes[place] + from.1[place].abs();
            let (error, step) = (errors[k], errors[k].max(MOVED * size));
            if error <= ROUNDING * size {
                continue;
            }
            let moved = [step, -step].into_iter().find_map(|step| {
                let mut moved = from.clone();
                moved.1[place] += step;
                let (at, y) = self.root(&switch, &moved, until)?;
                Some((at, self.arrival(&switch, (at, &y), to.0)?))
            });
            let (at, arrival) = moved?;
            of_guard += (at - time).abs() * error / step;
            for (limit, &place) in limits.iter_mut().zip(&places) {
                *limit += (arrival[place] - arrived[place]).abs() * error / step;
            }
        }

        let mut agrees = true;
        for (limit, &place) in limits.iter_mut().zip(&places) {
            let missed = (arrived[place] - to.1[place]).abs();
            agrees &= missed <= *limit;
            *limit += missed;
        }
        if switch.mode == Mode::Engaged {
            // The mode does not change: the motion only passes the threshold.
            let slope = (self.guard(&switch, to.0, &arrived) / (to.0 - time)).abs();
            let missed = (self.velocity((to.0, &arrived)) - self.velocity((to.0, &to.1))).abs();
            let bound = of_guard + 2.0 * missed / slope;
            return bound.is_finite().then_some(Located { time, bound, agrees });
        }
        let mut bound = 0.0f64;
        for range in [to.0 - time, from.0 - time] {
            bound = bound.max(self.open(&switch, (time, &y), range, (to.0, &arrived), &limits));
        }
        let bound = bound + of_guard;
        Some(Located { time, bound, agrees })
    }

    /// Largest distance (s) from a switch, up to `range` (s, negative before it), of another switch that leads to the
    /// same sample within the limits.
    fn open(
        &mut self,
        switch: &Switch,
        (time, y): (f64, &[f64]),
        range: f64,
        (to, arrived): (f64, &[f64]),
        limits: &[f64],
    ) -> f64 {
        let (mut moved, mut reached) = (range, true);
        for _ in 0..MOST_TRIALS {
            let (mut other, span) = (y.to_vec(), (time, time + moved));
            let there = self
                .course
                .go(switch.mode, span, &mut other, MOST_STEPS, &mut |_, _| {});
            let arrival = self.arrival(switch, (time + moved, &other), to).filter(|_| there);
            let Some(arrival) = arrival else {
                // The law ends, or changes over a shorter time, on the other side of rest.
                (moved, reached) = (0.25 * moved, false);
                continue;
            };
            let parts = self.physics.places.iter().zip(limits);
            let missed = parts
                .map(|(&place, limit)| (arrival[place] - arrived[place]).abs() / limit)
                .fold(0.0, f64::max);
            if missed <= 1.0 && !reached {
                return range.abs();
            }
            if missed <= 4.0 {
                // In the first trial: the whole range is possible.
                return moved.abs();
            }
            reached = true;
            // The miss grows at most with the square of the distance.
            moved *= (2.0 / missed).sqrt();
        }
        moved.abs()
    }

    /// First time up to `until` (s) at which a motion from a row reaches the guard, and the state there.
    fn root(&mut self, switch: &Switch, (from, y): &SwitchRow, until: f64) -> Option<SwitchRow> {
        let (mut time, mut y) = (*from, y.clone());
        let mut start = self.guard(switch, time, &y);
        if start <= 0.0 {
            return None;
        }
        let mut end = y.clone();
        for _ in 0..MOST_STEPS {
            let length = self.course.expand(switch.mode, time, &y, until - time);
            self.left = self.left.saturating_sub(1);
            self.course.after(length, &mut end);
            let value = self.guard(switch, time + length, &end);
            if !value.is_finite() {
                return None;
            }
            if value <= 0.0 {
                let (mut low, mut high) = ((0.0, start), (length, value));
                let mut side = 0;
                for _ in 0..100 {
                    let secant = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
                    let x = secant.clamp(low.0, high.0);
                    self.course.after(x, &mut end);
                    let value = self.guard(switch, time + x, &end);
                    if !value.is_finite() {
                        return None;
                    }
                    if value > 0.0 {
                        (low, high.1) = ((x, value), if side == 1 { high.1 / 2.0 } else { high.1 });
                        side = 1;
                    } else {
                        (high, low.1) = ((x, value), if side == -1 { low.1 / 2.0 } else { low.1 });
                        side = -1;
                    }
                    if high.0 - low.0 <= f64::EPSILON * (time + length).abs() || value == 0.0 {
                        break;
                    }
                }
                self.course.after(high.0, &mut end);
                return Some((time + high.0, end));
            }
            (time, start) = (time + length, value);
            y.copy_from_slice(&end);
            if time >= until || length <= 0.0 || value.is_nan() {
                break;
            }
        }
        None
    }

    /// Advances a state between two times (s); `false` if it fails.
    fn go(&mut self, mode: Mode, span: (f64, f64), y: &mut [f64]) -> bool {
        let mut steps = 0;
        let arrived = self.course.go(mode, span, y, MOST_STEPS, &mut |_, _| steps += 1);
        self.left = self.left.saturating_sub(steps);
        arrived
    }

    fn arrival(&mut self, switch: &Switch, (time, y): (f64, &[f64]), to: f64) -> Option<Vec<f64>> {
        let mut y = y.to_vec();
        if switch.mode == Mode::Stick || switch.next == Mode::Stick {
            self.physics.system().join(&self.course.outside(time), &mut y);
        }
        let arrived = self.go(switch.next, (time, to), &mut y);
        (arrived && y.iter().all(|y| y.is_finite())).then_some(y)
    }
}
