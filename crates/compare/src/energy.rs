//! Energy balance of a candidate, from its own channels and the reference's parameters.

use super::reference::Physics;
use serde::Serialize;
use stickslip_engine::simulation::Course;
use stickslip_system::model::Mode;

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
