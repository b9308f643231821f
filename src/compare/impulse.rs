//! Impulses: what explicit finite-element codes store instead of forces.
//!
//! An impulse is the integral of a force, or of a torque, since the start of a run. Its difference between two samples is exact however fast
//! the force changes, and dividing it by their distance would only add noise: so the reference is integrated, from the first
//! sample that both runs have, and the change of the impulse since then is compared, at the same times, across events.

use super::Channel;
use super::candidate::Block;
use super::reference::{Curve, Physics, Walk};
use super::states::Squares;
use crate::results::ResultError;
use serde::Serialize;
use std::borrow::Cow;

/// The errors of an impulse, candidate minus reference, both since the first sample.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImpulseErrors {
    /// "normal_impulse" or "friction_impulse".
    pub channel: Cow<'static, str>,
    /// Its SI unit.
    pub unit: &'static str,
    /// How many samples were compared.
    pub samples: u64,
    /// The first of them, s.
    pub from: f64,
    /// The last of them, s.
    pub to: f64,
    /// By how much the reference's changes from the first sample to the last, in `unit`.
    pub reference: f64,
    /// By how much the candidate's does, in `unit`.
    pub candidate: f64,
    /// Largest absolute error, in `unit`.
    pub max: f64,
    /// Where it is, s.
    pub max_at: f64,
    /// Root mean square of the error, in `unit`.
    pub rms: f64,
    /// Whether the candidate's has the opposite sign, which has been turned.
    pub opposite: bool,
    /// What 32-bit numbers of its size resolve, in `unit`; `None` of a candidate with 64 bits or of text.
    pub resolution: Option<f64>,
}

/// Errors for one sign of a candidate's impulse.
#[derive(Debug, Clone, Copy, Default)]
struct Errors {
    max: f64,
    max_at: f64,
    squares: Squares,
}

impl Errors {
    fn add(&mut self, time: f64, error: f64) {
        if error.abs() > self.max {
            (self.max, self.max_at) = (error.abs(), time);
        }
        self.squares.add(error);
    }
}

#[derive(Debug)]
struct Impulse {
    channel: Channel,
    /// In the blocks.
    column: usize,
    /// The candidate's at the first sample, and at the last one.
    first: f64,
    last: f64,
    /// The reference's since the first sample.
    sum: f64,
    errors: [Errors; 2],
    largest: f64,
    single: bool,
}

/// The pass over a candidate's impulses.
#[derive(Debug)]
pub(super) struct ImpulsePass<'a> {
    walk: Walk<'a>,
    forces: Vec<Channel>,
    curves: Vec<Curve>,
    impulses: Vec<Impulse>,
    /// First and last sample, s.
    span: Option<(f64, f64)>,
    samples: u64,
    /// The end of the reference, or a part of it that is too sparse, has been reached.
    ended: bool,
}

impl<'a> ImpulsePass<'a> {
    /// Of those of `channels`, which are those of the blocks to come; `None` without an impulse among them.
    pub fn new(
        channels: &[Channel],
        walk: impl FnOnce() -> Result<Walk<'a>, ResultError>,
    ) -> Result<Option<Self>, ResultError> {
        let found = channels.iter().enumerate().filter_map(|(column, &channel)| {
            let (_, force) = Channel::IMPULSES.iter().find(|(impulse, _)| *impulse == channel)?;
            let impulse = Impulse {
                channel,
                column,
                first: 0.0,
                last: 0.0,
                sum: 0.0,
                errors: [Errors::default(); 2],
                largest: 0.0,
                single: true,
            };
            Some((*force, impulse))
        });
        let (forces, impulses): (Vec<Channel>, Vec<Impulse>) = found.unzip();
        if forces.is_empty() {
            return Ok(None);
        }
        Ok(Some(ImpulsePass {
            walk: walk()?,
            forces,
            curves: Vec::new(),
            impulses,
            span: None,
            samples: 0,
            ended: false,
        }))
    }

    /// Compares the next samples.
    ///
    /// # Errors
    /// Of the reference's file.
    pub fn add(&mut self, block: &Block) -> Result<(), ResultError> {
        for (row, &time) in block.time.iter().enumerate() {
            if self.ended {
                return Ok(());
            }
            match self.span {
                None => {
                    if self.walk.at(time)?.is_none() {
                        continue;
                    }
                    self.span = Some((time, time));
                    for impulse in &mut self.impulses {
                        impulse.first = block.columns[impulse.column][row];
                    }
                }
                Some((from, last)) => {
                    if !self.integrate(last, time)? {
                        self.ended = true;
                        return Ok(());
                    }
                    self.span = Some((from, time));
                }
            }
            self.samples += 1;
            for impulse in &mut self.impulses {
                let value = block.columns[impulse.column][row];
                let change = value - impulse.first;
                impulse.last = value;
                impulse.single &= f64::from(value as f32) == value;
                impulse.largest = impulse.largest.max(value.abs());
                impulse.errors[0].add(time, change - impulse.sum);
                impulse.errors[1].add(time, -change - impulse.sum);
            }
        }
        Ok(())
    }

    /// Adds the reference's forces from one time to another (s), gap by gap; `false` where it is not known.
    fn integrate(&mut self, mut from: f64, to: f64) -> Result<bool, ResultError> {
        while from < to {
            let Some((left, right, _)) = self.walk.at(from.next_up())? else {
                return Ok(false);
            };
            if self.walk.curves(&self.forces, &mut self.curves) != Some(true) || right <= from {
                return Ok(false);
            }
            let (end, width) = (right.min(to), right - left);
            let part = |time: f64| ((time - left) / width).clamp(0.0, 1.0);
            for (impulse, curve) in self.impulses.iter_mut().zip(&self.curves) {
                impulse.sum += width * curve.integral(part(from), part(end));
            }
            from = end;
        }
        Ok(true)
    }

    /// What came of it.
    pub fn finish(self, physics: &Physics) -> Vec<ImpulseErrors> {
        let Some((from, to)) = self.span.filter(|_| self.samples > 1) else {
            return Vec::new();
        };
        let of = |impulse: &Impulse| {
            let opposite = impulse.errors[1].squares.is_less(&impulse.errors[0].squares);
            let errors = impulse.errors[usize::from(opposite)];
            let change = impulse.last - impulse.first;
            // The distance of 32-bit numbers of the largest size.
            let quantum = super::resolution::Rounding::Single.quantum(impulse.largest);
            ImpulseErrors {
                channel: impulse.channel.name(),
                unit: physics.vocabulary().unit(impulse.channel),
                samples: self.samples,
                from,
                to,
                reference: impulse.sum,
                candidate: if opposite { -change } else { change },
                max: errors.max,
                max_at: errors.max_at,
                rms: errors.squares.rms(self.samples),
                opposite,
                resolution: (impulse.single && impulse.largest > 0.0).then_some(quantum),
            }
        };
        self.impulses.iter().map(of).collect()
    }
}
