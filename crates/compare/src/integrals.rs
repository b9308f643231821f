//! Integrals over a candidate's samples: impulses, and the balance of its energy.
//!
//! Explicit finite-element codes store impulses instead of forces. The difference of an impulse between two samples is
//! exact however fast the force changes, but dividing it by their distance would add noise. Therefore the reference is
//! integrated from the first common sample, and the changes of the impulse since then are compared at equal times,
//! across events.

use super::Channel;
use super::candidate::Block;
use super::reference::{Physics, Walk};
use super::states::ErrorSum;
use serde::Serialize;
use std::borrow::Cow;
use stickslip_engine::simulation::Course;
use stickslip_files::ResultError;
use stickslip_system::model::Mode;

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

#[derive(Debug)]
struct Impulse {
    channel: Channel,
    column: usize,
    /// The candidate's impulse at the first and the last sample.
    first: f64,
    last: f64,
    sum: f64,
    /// Errors, and those of the opposite sign.
    errors: [ErrorSum; 2],
    largest: f64,
    single: bool,
}

#[derive(Debug)]
pub(super) struct ImpulsePass<'a> {
    /// Through the forces, in the order of their impulses.
    walk: Walk<'a>,
    impulses: Vec<Impulse>,
    span: Option<(f64, f64)>,
    ended: bool,
}

impl<'a> ImpulsePass<'a> {
    pub fn new(
        channels: &[Channel],
        walk: impl FnOnce(&[Channel]) -> Result<Walk<'a>, ResultError>,
    ) -> Result<Option<Self>, ResultError> {
        let found = channels.iter().enumerate().filter_map(|(column, &channel)| {
            let (_, force) = Channel::IMPULSES.iter().find(|(impulse, _)| *impulse == channel)?;
            let impulse = Impulse {
                channel,
                column,
                first: 0.0,
                last: 0.0,
                sum: 0.0,
                errors: [ErrorSum::default(); 2],
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
            walk: walk(&forces)?,
            impulses,
            span: None,
            ended: false,
        }))
    }

    pub fn add(&mut self, block: &Block) -> Result<(), ResultError> {
        for (row, &time) in block.time.iter().enumerate() {
            if self.ended {
                return Ok(());
            }
            if let Some((from, last)) = self.span {
                self.ended = !self.integrate(last, time)?;
                if self.ended {
                    return Ok(());
                }
                self.span = Some((from, time));
            } else if self.walk.at(time)?.is_some() {
                self.span = Some((time, time));
                for impulse in &mut self.impulses {
                    impulse.first = block.columns[impulse.column][row];
                }
            } else {
                continue;
            }
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
            if !self.walk.expand() || right <= from {
                return Ok(false);
            }
            let (end, width) = (right.min(to), right - left);
            let part = |time: f64| ((time - left) / width).clamp(0.0, 1.0);
            for (impulse, curve) in self.impulses.iter_mut().zip(&self.walk.curves) {
                impulse.sum += width * curve.integral(part(from), part(end));
            }
            from = end;
        }
        Ok(true)
    }

    pub fn finish(self, physics: &Physics) -> Vec<ImpulseErrors> {
        let Some((from, to)) = self.span.filter(|(from, to)| to > from) else {
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
                samples: errors.samples,
                from,
                to,
                reference: impulse.sum,
                candidate: if opposite { -change } else { change },
                max: errors.max,
                max_at: errors.max_at,
                rms: errors.rms(),
                opposite,
                resolution: (impulse.single && impulse.largest > 0.0).then_some(quantum),
            }
        };
        self.impulses.iter().map(of).collect()
    }
}

/// Error of a candidate's energy balance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EnergyDrift {
    /// Largest |kinetic + elastic + dissipated - work of kicks and drives - initial| of the motion in the plane of the
    /// contact, J.
    pub max: f64,
    /// Time of the largest error, s.
    pub max_at: f64,
    /// Error at the last sample, with its sign, J.
    pub last: f64,
    /// Energy at the first sample, J.
    pub initial: f64,
    /// Resolution of the samples, J: twice the change of the losses if every second sample is left out, with all
    /// changes of the same sign. A smaller drift may be an error of the sums.
    pub resolved: f64,
    /// Covered time, s: samples are dense enough there to add up the losses.
    pub covered: f64,
}

impl EnergyDrift {
    /// Whether the drift exceeds the resolution of the samples.
    pub fn is_resolved(&self) -> bool {
        self.max > self.resolved
    }
}

/// Fewest samples in a natural period that show the losses between them.
const PER_PERIOD: f64 = 8.0;

/// At a change of the mode the sums are of first order only, so their error is not smaller than the effect of leaving
/// out a sample.
const SAFETY: f64 = 2.0;

#[derive(Debug, Clone, Copy)]
struct EnergySample {
    time: f64,
    energy: f64,
    at_rest: bool,
    /// Dissipated power of friction, W, and its rate, W/s.
    friction: (f64, f64),
    /// Dissipated power of the dampers minus the power of the drives, W, and its rate, W/s.
    damping: (f64, f64),
}

/// Adds up the dissipated energy. Between two samples of one mode, a rule of order 4 uses the power and its rate at
/// both. Over a stop or a breakaway, the sums split where the power of friction is zero. Gaps longer than an eighth of
/// the natural period are left out. Adding up two neighbouring intervals without the sample between them shows the
/// resolution of the samples.
#[derive(Debug)]
pub(crate) struct EnergyPass<'a> {
    physics: &'a Physics,
    course: Course,
    tolerance: f64,
    /// Time (s) and work (J) of kicks.
    kicks: Vec<(f64, f64)>,
    last: Option<EnergySample>,
    /// The sample before the last, and the dissipation between the two, J.
    before: Option<(EnergySample, f64)>,
    was_thinned: bool,
    drift: Option<EnergyDrift>,
}

impl<'a> EnergyPass<'a> {
    pub fn new(physics: &'a Physics, tolerance: f64, kicks: Vec<(f64, f64)>) -> EnergyPass<'a> {
        EnergyPass {
            physics,
            course: physics.course(),
            tolerance,
            kicks,
            last: None,
            before: None,
            was_thinned: false,
            drift: None,
        }
    }

    pub fn add(&mut self, time: f64, y: &[f64]) {
        let sample = self.at(time, y);
        self.sample(time, sample);
    }

    fn at(&mut self, time: f64, y: &[f64]) -> EnergySample {
        let outside = self.course.outside(time);
        let w = self.physics.system().relative_velocity(&outside, y);
        let mode = if outside.normal_force > 0.0 {
            self.physics.mode(w, self.tolerance)
        } else {
            Mode::Separated
        };
        let [friction, damping] = self.course.powers(mode, time, y);
        EnergySample {
            time,
            energy: self.physics.energy(time, y),
            at_rest: mode == Mode::Stick,
            friction,
            damping,
        }
    }

    fn sample(&mut self, time: f64, sample: EnergySample) {
        if let (Some(last), Some(drift)) = (self.last, &mut self.drift) {
            let h = time - last.time;
            if h * PER_PERIOD > self.physics.natural_period() {
                self.before = None;
            } else {
                let is_driven = self.physics.is_driven();
                let lost = dissipated(&last, &sample, h, is_driven);
                if let Some((first, before)) = self.before {
                    let at_once = dissipated(&first, &sample, time - first.time, is_driven);
                    drift.resolved += SAFETY * (at_once - before - lost).abs();
                    self.was_thinned = true;
                }
                self.before = Some((last, lost));
                let mut change = sample.energy - last.energy + lost;
                let kicks = self.kicks.iter().filter(|(at, _)| last.time < *at && *at <= time);
                change -= kicks.map(|(_, work)| work).sum::<f64>();
                drift.covered += h;
                drift.last += change;
                if drift.last.abs() > drift.max {
                    (drift.max, drift.max_at) = (drift.last.abs(), time);
                }
            }
        } else {
            self.drift = Some(EnergyDrift {
                max: 0.0,
                max_at: time,
                last: 0.0,
                initial: sample.energy,
                resolved: 0.0,
                covered: 0.0,
            });
        }
        self.last = Some(sample);
    }

    /// The drift, after the last sample; `None` without three dense samples in a row, or if an energy overflows.
    pub fn finish(self) -> Option<EnergyDrift> {
        let was_thinned = self.was_thinned;
        self.drift
            .filter(|drift| was_thinned && drift.last.is_finite() && drift.initial.is_finite())
    }
}

/// Dissipation in the time `h` (s) between two samples minus the work of the drives, J. At a stop and at a breakaway
/// the power of drives jumps with the contact torque; the power of dampers alone is continuous, and the mean of both
/// ends is more accurate.
fn dissipated(a: &EnergySample, b: &EnergySample, h: f64, is_driven: bool) -> f64 {
    let smooth = |a: (f64, f64), b: (f64, f64)| h * (a.0 + b.0) / 2.0 + h * h * (a.1 - b.1) / 12.0;
    let around = |x: f64| {
        let rest = h - x;
        if !is_driven {
            return h * (a.damping.0 + b.damping.0) / 2.0;
        }
        x * (a.damping.0 + a.damping.1 * x / 2.0) + rest * (b.damping.0 - b.damping.1 * rest / 2.0)
    };
    let part = |time: f64| if time > 0.0 { time.min(h) } else { h };
    match (a.at_rest, b.at_rest) {
        // The power of friction falls to zero linearly, and rises from it with the square of time.
        (false, true) => {
            let x = part(-a.friction.0 / a.friction.1);
            a.friction.0 * x / 2.0 + around(x)
        }
        (true, false) => {
            let x = part(2.0 * b.friction.0 / b.friction.1);
            b.friction.0 * x / 3.0 + around(h - x)
        }
        _ => smooth(a.friction, b.friction) + smooth(a.damping, b.damping),
    }
}
