//! The energy balance of a candidate, from its own channels and the reference's parameters.

use super::candidate::Block;
use super::reference::{Physics, Subject, TrainPhysics};
use crate::friction::Law;
use crate::model::Mode;
use crate::model::state::{Components, TorsionState};
use serde::Serialize;

/// How far a candidate's energy balance is from closing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EnergyDrift {
    /// Largest |kinetic + elastic + dissipated - work of kicks and of the drives of trains - initial| of the torsional motion, J.
    pub max: f64,
    /// The time of it, s.
    pub max_at: f64,
    /// The same at the last sample, with its sign, J.
    pub last: f64,
    /// The torsional energy at the first sample, J.
    pub initial: f64,
    /// How much time is covered, s: where samples are dense enough to add up the losses.
    pub covered: f64,
}

/// Samples in a natural period without which losses between them are unknown.
const PER_PERIOD: f64 = 8.0;

/// What is kept of a sample.
#[derive(Debug, Clone, Copy)]
struct Sample {
    time: f64,
    energy: f64,
    at_rest: bool,
    /// Power that friction dissipates, W, and its rate, W/s.
    friction: (f64, f64),
    /// Power that the dampers dissipate, less that of the drives of trains, W, and its rate, W/s.
    damping: (f64, f64),
}

/// Adds up the dissipated energy: between two samples of one mode by the rule that takes the power and its rate at both,
/// of order 4; over a stop or a breakaway by where the power of friction is zero. Gaps longer than an eighth of the natural
/// period are left out.
#[derive(Debug)]
pub(crate) struct EnergyPass<'a> {
    subject: &'a Subject,
    /// A relative velocity up to this is none, rad/s.
    tolerance: f64,
    /// Time (s) and work (J) of kicks.
    kicks: Vec<(f64, f64)>,
    last: Option<Sample>,
    drift: Option<EnergyDrift>,
}

impl<'a> EnergyPass<'a> {
    /// Before the first sample.
    pub fn new(subject: &'a Subject, tolerance: f64, kicks: Vec<(f64, f64)>) -> EnergyPass<'a> {
        EnergyPass {
            subject,
            tolerance,
            kicks,
            last: None,
            drift: None,
        }
    }

    /// Takes the next samples; `columns` are the positions of [`Subject::energy_channels`] in the block.
    pub fn add(&mut self, block: &Block, columns: &[usize]) {
        for (row, &time) in block.time.iter().enumerate() {
            let value = |k: usize| block.columns[columns[k]][row];
            let sample = match self.subject {
                Subject::Brake(physics, _) => self.of_brake(physics, time, value),
                Subject::Trains(physics) => self.of_trains(physics, time, value),
            };
            self.sample(time, sample);
        }
    }

    fn sample(&mut self, time: f64, sample: Sample) {
        if let (Some(last), Some(drift)) = (self.last, &mut self.drift) {
            let h = time - last.time;
            if h * PER_PERIOD <= self.subject.natural_period() {
                let lost = match self.subject {
                    Subject::Brake(..) => dissipated(&last, &sample, h),
                    Subject::Trains(_) => dissipated_by_trains(&last, &sample, h),
                };
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
                covered: 0.0,
            });
        }
        self.last = Some(sample);
    }

    fn of_brake(&self, physics: &Physics, time: f64, value: impl Fn(usize) -> f64) -> Sample {
        let y = Components {
            rotor_twist: value(0),
            rotor_twist_rate: value(1),
            stator_twist: value(2),
            stator_twist_rate: value(3),
            rotor_speed: value(4),
            ..Components::default()
        };
        let y = y.state();
        let energy = physics.torsion.torsion.kinetic_energy(&y) + physics.torsion.torsion.elastic_energy(&y);
        Sample {
            energy,
            ..self.power(physics, time, &y)
        }
    }

    /// The rates of the powers are central differences along the motion.
    fn of_trains(&self, physics: &TrainPhysics, time: f64, value: impl Fn(usize) -> f64) -> Sample {
        /// A share of the natural period over which a power is straight: the difference errs by (2 pi 1e-4)^2/6 of it.
        const STRAIGHT: f64 = 1e-4;
        let y = physics.y(value);
        let w = physics.system().relative_velocity(&physics.course.outside(time), &y);
        let mode = physics.mode(w, self.tolerance);
        let (energy, friction, loss) = physics.energy(mode, time, &y);
        let mut rates = vec![0.0; y.len()];
        physics.course.rates(mode, time, &y, &mut rates);
        let step = STRAIGHT * physics.scale.period;
        let [ahead, behind] = [step, -step].map(|step| {
            let there: Vec<f64> = y.iter().zip(&rates).map(|(y, rate)| y + step * rate).collect();
            physics.energy(mode, time + step, &there)
        });
        Sample {
            time,
            energy,
            at_rest: mode == Mode::Stick,
            friction: (friction, (ahead.1 - behind.1) / (2.0 * step)),
            damping: (loss, (ahead.2 - behind.2) / (2.0 * step)),
        }
    }

    fn power(&self, physics: &Physics, time: f64, y: &TorsionState) -> Sample {
        let model = &physics.torsion;
        let radius = model.contact.radius;
        let w = model.relative_velocity(y);
        let axial = physics.axial.at(time);
        let (force, force_rate) = (axial.pressing_force.max(0.0), axial.pressing_rate);
        let at_rest = w.abs() <= self.tolerance;
        let mode = if at_rest { Mode::Stick } else { Mode::sliding(w) };
        let rates = model.rates_at(mode, || force, y);
        let mut lost = (0.0, 0.0);
        if !at_rest {
            let (mu, slope) = model.friction.law.coefficient_and_slope(w.abs());
            let acceleration = w.signum() * model.relative_velocity(&rates);
            let rate = acceleration * force * (mu + slope * w.abs()) + mu * w.abs() * force_rate;
            lost = (mu * radius * force * w.abs(), radius * rate);
        }
        Sample {
            time,
            energy: 0.0,
            at_rest,
            friction: lost,
            damping: (
                model.torsion.damping_power(y),
                model.torsion.damping_power_rate(y, &rates),
            ),
        }
    }

    /// The drift, after the last sample; `None` if the samples are nowhere dense enough.
    pub fn finish(self) -> Option<EnergyDrift> {
        self.drift.filter(|drift| drift.covered > 0.0)
    }
}

/// The same of trains, whose drives put in another power from the stop on: the torque of the contact jumps there.
fn dissipated_by_trains(a: &Sample, b: &Sample, h: f64) -> f64 {
    // Before and after the time x at which the mode changes.
    let around = |x: f64| {
        let rest = h - x;
        x * (a.damping.0 + a.damping.1 * x / 2.0) + rest * (b.damping.0 - b.damping.1 * rest / 2.0)
    };
    let part = |time: f64| if time > 0.0 { time.min(h) } else { h };
    match (a.at_rest, b.at_rest) {
        (false, true) => {
            let x = part(-a.friction.0 / a.friction.1);
            a.friction.0 * x / 2.0 + around(x)
        }
        (true, false) => {
            let x = part(2.0 * b.friction.0 / b.friction.1);
            b.friction.0 * x / 3.0 + around(h - x)
        }
        _ => dissipated(a, b, h),
    }
}

/// What is dissipated in the time `h` (s) between two samples, J.
fn dissipated(a: &Sample, b: &Sample, h: f64) -> f64 {
    let smooth = |a: (f64, f64), b: (f64, f64)| h * (a.0 + b.0) / 2.0 + h * h * (a.1 - b.1) / 12.0;
    let part = |time: f64| if time > 0.0 { time.min(h) } else { h };
    match (a.at_rest, b.at_rest) {
        // Friction's power falls to zero along a straight line, and rises from it with the square of time.
        (false, true) => {
            a.friction.0 * part(-a.friction.0 / a.friction.1) / 2.0 + h * (a.damping.0 + b.damping.0) / 2.0
        }
        (true, false) => {
            b.friction.0 * part(2.0 * b.friction.0 / b.friction.1) / 3.0 + h * (a.damping.0 + b.damping.0) / 2.0
        }
        _ => smooth(a.friction, b.friction) + smooth(a.damping, b.damping),
    }
}
