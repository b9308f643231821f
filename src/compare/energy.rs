//! The energy balance of a candidate, from its own channels and the reference's parameters.

use super::reference::Physics;
use crate::model::Mode;
use crate::simulation::Course;
use serde::Serialize;

/// How far a candidate's energy balance is from closing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EnergyDrift {
    /// Largest |kinetic + elastic + dissipated - work of kicks and of drives - initial| of the motion in the plane of the contact, J.
    pub max: f64,
    /// The time of it, s.
    pub max_at: f64,
    /// The same at the last sample, with its sign, J.
    pub last: f64,
    /// Its energy at the first sample, J.
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
    /// Power that the dampers dissipate, less that of the drives, W, and its rate, W/s.
    damping: (f64, f64),
}

/// Adds up the dissipated energy: between two samples of one mode by the rule that takes the power and its rate at both,
/// of order 4; over a stop or a breakaway by where the power of friction is zero. Gaps longer than an eighth of the natural
/// period are left out.
#[derive(Debug)]
pub(crate) struct EnergyPass<'a> {
    physics: &'a Physics,
    course: Course,
    /// A relative velocity up to this is none, rad/s.
    tolerance: f64,
    /// Time (s) and work (J) of kicks.
    kicks: Vec<(f64, f64)>,
    last: Option<Sample>,
    drift: Option<EnergyDrift>,
}

impl<'a> EnergyPass<'a> {
    /// Before the first sample.
    pub fn new(physics: &'a Physics, tolerance: f64, kicks: Vec<(f64, f64)>) -> EnergyPass<'a> {
        EnergyPass {
            physics,
            course: physics.course(),
            tolerance,
            kicks,
            last: None,
            drift: None,
        }
    }

    /// Takes the next sample: a time (s) and the state.
    pub fn add(&mut self, time: f64, y: &[f64]) {
        let sample = self.at(time, y);
        self.sample(time, sample);
    }

    fn at(&mut self, time: f64, y: &[f64]) -> Sample {
        let outside = self.course.outside(time);
        let w = self.physics.system().relative_velocity(&outside, y);
        // What does not press has no friction.
        let mode = if outside.normal_force > 0.0 {
            self.physics.mode(w, self.tolerance)
        } else {
            Mode::Separated
        };
        let [friction, damping] = self.course.powers(mode, time, y);
        Sample {
            time,
            energy: self.physics.energy(time, y),
            at_rest: mode == Mode::Stick,
            friction,
            damping,
        }
    }

    fn sample(&mut self, time: f64, sample: Sample) {
        if let (Some(last), Some(drift)) = (self.last, &mut self.drift) {
            let h = time - last.time;
            if h * PER_PERIOD <= self.physics.natural_period() {
                let mut change = sample.energy - last.energy + dissipated(&last, &sample, h, self.physics.is_driven());
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

    /// The drift, after the last sample; `None` if the samples are nowhere dense enough, or if an energy is beyond the largest number.
    pub fn finish(self) -> Option<EnergyDrift> {
        self.drift
            .filter(|drift| drift.covered > 0.0 && drift.last.is_finite() && drift.initial.is_finite())
    }
}

/// What is dissipated in the time `h` (s) between two samples, less what drives put in, J. At a stop and at a breakaway the power of
/// drives jumps with the torque of the contact; that of dampers alone goes on, and the mean of both ends errs less.
fn dissipated(a: &Sample, b: &Sample, h: f64, is_driven: bool) -> f64 {
    let smooth = |a: (f64, f64), b: (f64, f64)| h * (a.0 + b.0) / 2.0 + h * h * (a.1 - b.1) / 12.0;
    // Before and after the time x at which the mode changes.
    let around = |x: f64| {
        let rest = h - x;
        if !is_driven {
            return h * (a.damping.0 + b.damping.0) / 2.0;
        }
        x * (a.damping.0 + a.damping.1 * x / 2.0) + rest * (b.damping.0 - b.damping.1 * rest / 2.0)
    };
    let part = |time: f64| if time > 0.0 { time.min(h) } else { h };
    match (a.at_rest, b.at_rest) {
        // Friction's power falls to zero along a straight line, and rises from it with the square of time.
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
