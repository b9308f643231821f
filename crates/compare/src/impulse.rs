//! Impulses, which explicit finite-element codes store instead of forces.
//!
//! An impulse is the integral of a force or a torque since the start of a run. Its difference between two samples is
//! exact however fast the force changes, but dividing it by their distance would add noise. Therefore the reference is
//! integrated from the first common sample, and the changes of the impulse since then are compared at equal times,
//! across events.

use super::Channel;
use super::candidate::Block;
use super::reference::{GapPolynomial, Physics, Walk};
use super::states::Squares;
use serde::Serialize;
use std::borrow::Cow;
use stickslip_files::ResultError;

/// Errors of an impulse, candidate minus reference, both since the first sample.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImpulseErrors {
    /// "normal_impulse" or "friction_impulse".
    pub channel: Cow<'static, str>,
    /// Its SI unit.
    pub unit: &'static str,
    /// Number of compared samples.
    pub samples: u64,
    /// Time of the first sample, s.
    pub from: f64,
    /// Time of the last sample, s.
    pub to: f64,
    /// Change of the reference from the first sample to the last, in `unit`.
    pub reference: f64,
    /// Change of the candidate, in `unit`.
    pub candidate: f64,
    /// Largest absolute error, in `unit`.
    pub max: f64,
    /// Time of the largest error, s.
    pub max_at: f64,
    /// Root mean square of the error, in `unit`.
    pub rms: f64,
    /// Whether the candidate's sign is opposite; it was reversed.
    pub opposite: bool,
    /// Resolution of 32-bit numbers of this size, in `unit`; `None` for a candidate with 64 bits or of text.
    pub resolution: Option<f64>,
}

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
    column: usize,
    /// The candidate's impulse at the first and the last sample.
    first: f64,
    last: f64,
    sum: f64,
    errors: [Errors; 2],
    largest: f64,
    single: bool,
}

#[derive(Debug)]
pub(super) struct ImpulsePass<'a> {
    walk: Walk<'a>,
    forces: Vec<Channel>,
    curves: Vec<GapPolynomial>,
    impulses: Vec<Impulse>,
    span: Option<(f64, f64)>,
    samples: u64,
    ended: bool,
}

impl<'a> ImpulsePass<'a> {
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

    /// Integrates the reference's forces between two times (s); `false` where they are unknown.
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

    pub fn finish(self, physics: &Physics) -> Vec<ImpulseErrors> {
        let Some((from, to)) = self.span.filter(|_| self.samples > 1) else {
            return Vec::new();
        };
        let of = |impulse: &Impulse| {
            let opposite = impulse.errors[1].squares.is_less(&impulse.errors[0].squares);
            let errors = impulse.errors[usize::from(opposite)];
            let change = impulse.last - impulse.first;
            // Spacing of 32-bit numbers of the largest size.
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
