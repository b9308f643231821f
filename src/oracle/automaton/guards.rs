//! Guards: which of them ends a step first, and what one says that stands beyond its boundary.

use super::{Run, Watch};
use crate::model::Mode;
use crate::oracle::OracleError;
use crate::oracle::float::Float;
use crate::oracle::roots::{Crossing, first_zero};
use crate::oracle::series::{Expansion, component::*, evaluate};
use num_traits::Signed;
use std::cmp::Ordering;

/// Two happenings closer than this (s) are at one instant, by the statement of the model (docs/methods.md).
const INSTANT: f64 = 1e-18;

/// What can end a step before its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Guard {
    Stop,
    Stability,
    Separation,
    Contact,
    Breakaway(i8),
    /// An end of the piece of the friction law, the upper one with +1.
    Knot(i8),
}

impl<const N: usize> Run<N> {
    /// The guard that ends the step first, with its time from the start of the step.
    pub(super) fn first_guard(
        &mut self,
        expansion: &Expansion<N>,
        step: &Float<N>,
    ) -> Result<Option<(Float<N>, Guard)>, OracleError> {
        let negated = |p: &[Float<N>]| p.iter().map(|c| -c).collect::<Vec<_>>();
        let mut guards: Vec<(Guard, Vec<Float<N>>)> = Vec::with_capacity(3);
        match self.mode {
            Mode::Separated | Mode::Engaged => {
                if !self.stays_open {
                    guards.push((Guard::Contact, negated(expansion.normal())));
                }
            }
            Mode::Stick => {
                guards.push((Guard::Separation, expansion.normal().to_vec()));
                for sense in [1, -1] {
                    guards.push((Guard::Breakaway(sense), expansion.reserve(&self.model, sense)));
                }
            }
            Mode::SlipForward | Mode::SlipBackward => {
                guards.push((Guard::Separation, expansion.normal().to_vec()));
                guards.push((Guard::Stop, expansion.speed().to_vec()));
                if let Some(knot) = self.knots.get(self.piece) {
                    let mut below = negated(expansion.speed());
                    below[0] += knot;
                    guards.push((Guard::Knot(1), below));
                }
                if let Some(knot) = self.piece.checked_sub(1).and_then(|last| self.knots.get(last)) {
                    let mut above = expansion.speed().to_vec();
                    above[0] -= knot;
                    guards.push((Guard::Knot(-1), above));
                }
                match self.watch {
                    Watch::Stable => guards.push((Guard::Stability, expansion.margin(&self.model))),
                    Watch::Unstable => guards.push((Guard::Stability, negated(&expansion.margin(&self.model)))),
                    Watch::Off => {}
                }
            }
        }
        let mut first: Option<(Float<N>, Guard)> = None;
        for (guard, polynomial) in guards {
            let known = self
                .zeros
                .iter()
                .find(|(zero, _)| *zero == guard)
                .map_or(0, |(_, count)| *count);
            let crossing = first_zero(&polynomial, known, step);
            let time = match crossing {
                Crossing::None => continue,
                Crossing::At(time) => time,
                Crossing::Beyond => self.beyond(guard, known)?,
            };
            if guard == Guard::Contact {
                let [z, z_dot] = [Z, Z_DOT].map(|c| evaluate(expansion.component(c), &time));
                if self.rests([&z, &z_dot], &(&self.time + &time)) {
                    self.stays_open = true;
                    continue;
                }
            }
            if first.as_ref().is_none_or(|(earliest, _)| time < *earliest) {
                first = Some((time, guard));
            }
        }
        Ok(first)
    }

    /// A guard that stands beyond its boundary fires at once, if it may: after a kick, or at the start of a run. One that
    /// has just been at its boundary and moves the wrong way belongs to a motion against its own mode.
    fn beyond(&self, guard: Guard, known: usize) -> Result<Float<N>, OracleError> {
        let what = match guard {
            Guard::Contact | Guard::Stability | Guard::Knot(_) if known == 0 => return Ok(Float::zero()),
            Guard::Contact | Guard::Separation => "the contact force turns at zero",
            Guard::Stability => "the stability of sliding turns at its limit",
            Guard::Knot(_) => "the sliding speed turns at a knot of the friction law",
            Guard::Stop => "a slip starts against its own sense",
            Guard::Breakaway(_) => "a stick starts beyond its breakaway torque",
        };
        Err(OracleError::Degenerate {
            time: self.time.to_f64(),
            what,
        })
    }

    /// Whether an open contact with this axial state at `time` stays open whatever rings: F does not press, and what is left
    /// of the oscillation is below its floor.
    pub(super) fn rests(&self, axial: [&Float<N>; 2], time: &Float<N>) -> bool {
        let (start, [force, slope]) = &self.force;
        let presses_later = match self.later_force.front() {
            Some(next) => next.force.is_positive(),
            None => slope.signum() > 0,
        };
        if force.signum() > 0 || presses_later {
            return false;
        }
        let force = force + &(slope * &(time - start));
        let [z, z_dot] = self.model.free_part(axial, [&force, slope]).map(|part| part.to_f64());
        (z * z + z_dot * z_dot * self.axial_time_squared).sqrt() < self.ringing_floor
    }

    /// To which side the pressing force leaves zero at a corner of F, and whether it stood beyond zero there already. What
    /// it takes less than an instant for, it does at once.
    pub(super) fn leaving(&self) -> (i8, bool) {
        let [z, z_dot] = [&self.state[Z], &self.state[Z_DOT]];
        let [force, slope] = &self.force.1;
        let model = &self.model;
        let normal = model.normal_force(z, z_dot);
        let acceleration = model.axial_acceleration(&normal, force);
        let rate = model.normal_force(z_dot, &acceleration);
        let curvature = model.normal_force(&acceleration, &model.axial_acceleration(&rate, slope));
        let [normal, rate, curvature] = [normal, rate, curvature].map(|value| value.to_f64());
        if normal.abs() > (rate.abs() + curvature.abs() * INSTANT / 2.0) * INSTANT {
            return (if normal > 0.0 { 1 } else { -1 }, true);
        }
        let ahead = normal + (rate + curvature * INSTANT / 2.0) * INSTANT;
        match ahead.total_cmp(&0.0) {
            // An undamped force leaves rest with its third derivative.
            _ if ahead == 0.0 => (slope.signum(), false),
            Ordering::Greater => (1, false),
            _ => (-1, false),
        }
    }
}
