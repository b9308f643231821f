//! Guards: which of them ends a step first, and what one says that stands beyond its boundary.

use super::{Run, Watch};
use crate::model::Mode;
use crate::oracle::OracleError;
use crate::oracle::float::Float;
use crate::oracle::roots::{Crossing, first_zero};
use crate::oracle::series::{Expansion, component::*, evaluate};

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
                let at = &self.time + &time;
                if self.actuation.rests(&self.model.axial, [&z, &z_dot], &at) {
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
}
