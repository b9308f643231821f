//! Whether a candidate creeps where it should stick, as regularised friction does.

use super::reference::Physics;
use crate::friction::Law;
use crate::model::system::Smoothing;
use std::f64::consts::FRAC_PI_2;

/// How a candidate creeps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Creep {
    /// Of [`SHAPES`].
    pub shape: usize,
    /// eps, rad/s.
    pub speed: f64,
    /// The largest |omega_r| that was looked at, rad/s.
    pub largest: f64,
}

/// Collects omega_r and T_f where omega_r is small and hardly changes: there friction balances T_f.
#[derive(Debug)]
pub(super) struct CreepPass<'a> {
    physics: &'a Physics,
    /// The speed of an oscillation that friction causes, rad/s.
    speed: f64,
    /// 1/J_1 + 1/J_2, what a torque of the contact accelerates omega_r by, 1/(kg m^2).
    per_torque: f64,
    last: Option<(f64, f64)>,
    /// Sums of w^2, and for each function of w a and a^2, where a is its inverse at T_f/(mu(0) r F_n).
    squares: f64,
    sums: [[f64; 2]; SHAPES.len()],
    largest: f64,
    count: u64,
}

/// A function in the place of the sign.
#[derive(Debug)]
pub(super) struct Shape {
    pub name: &'static str,
    /// Of omega_r/eps.
    pub value: fn(f64) -> f64,
    /// omega_r/eps at a share of the torque.
    inverse: fn(f64) -> f64,
    /// Where a case can have it.
    pub smoothing: Option<Smoothing>,
}

/// Those that are looked for.
pub(super) const SHAPES: [Shape; 5] = [
    Shape {
        name: "tanh(omega_r/eps)",
        value: f64::tanh,
        inverse: f64::atanh,
        smoothing: Some(Smoothing::Tanh),
    },
    Shape {
        name: "(2/pi) arctan(omega_r/eps)",
        value: |x| x.atan() / FRAC_PI_2,
        inverse: |z| (FRAC_PI_2 * z).tan(),
        smoothing: Some(Smoothing::Arctan),
    },
    Shape {
        name: "omega_r/eps up to 1",
        value: |x| x.clamp(-1.0, 1.0),
        inverse: |z| z,
        smoothing: None,
    },
    Shape {
        name: "omega_r/sqrt(omega_r^2 + eps^2)",
        value: |x| x / x.hypot(1.0),
        inverse: |z| z / (1.0 - z * z).sqrt(),
        smoothing: None,
    },
    Shape {
        name: "1 - exp(-|omega_r|/eps)",
        value: |x| -(-x.abs()).exp_m1() * x.signum(),
        inverse: |z| -(-z.abs()).ln_1p() * z.signum(),
        smoothing: None,
    },
];

/// Near its limit a torque says little of the speed, near zero too.
const SHARES: (f64, f64) = (0.05, 0.9);
/// Creep is slower than this part of the speeds of slip, and changes slower than this part of what friction accelerates by.
const SLOW: f64 = 0.05;
const STEADY: f64 = 0.02;
/// Fewer samples are no evidence.
const FEWEST: u64 = 20;
/// What the function may leave of the square of the speeds.
const LEFT: f64 = 1e-2;
/// Slower than this part of the speeds of slip is at rest.
const AT_REST: f64 = 1e-9;

impl<'a> CreepPass<'a> {
    /// Before the first sample.
    pub fn new(physics: &'a Physics) -> CreepPass<'a> {
        let system = physics.system();
        let (rotor, stator) = (system.rotor.surface_inertia(), system.stator.surface_inertia());
        CreepPass {
            physics,
            speed: physics.speed(),
            per_torque: 1.0 / rotor + 1.0 / stator,
            last: None,
            squares: 0.0,
            sums: [[0.0; 2]; SHAPES.len()],
            largest: 0.0,
            count: 0,
        }
    }

    /// Takes the next sample: a time (s) and the state.
    pub fn add(&mut self, time: f64, y: &[f64]) {
        let (physics, system) = (self.physics, self.physics.system());
        let driving = physics.course.driving(time);
        let w = system.relative_velocity(&driving, y);
        let before = self.last.replace((time, w));
        let (Some((earlier, was)), true) = (before, w.abs() < SLOW * self.speed) else {
            return;
        };
        let limit = system.law.coefficient(0.0) * system.radius * physics.course.outside(time).normal_force;
        if limit <= 0.0 {
            return;
        }
        let share = system.transmitted_torque(&driving, y) / limit;
        let steady = (w - was).abs() <= STEADY * limit * self.per_torque * (time - earlier);
        if !steady || !(SHARES.0..SHARES.1).contains(&share.abs()) {
            return;
        }
        self.count += 1;
        self.squares += w * w;
        self.largest = self.largest.max(w.abs());
        for (sums, shape) in self.sums.iter_mut().zip(&SHAPES) {
            let a = (shape.inverse)(share);
            sums[0] += w * a;
            sums[1] += a * a;
        }
    }

    /// How it creeps, after the last sample; `None` if it does not.
    pub fn finish(self) -> Option<Creep> {
        if self.count < FEWEST || self.largest <= AT_REST * self.speed {
            return None;
        }
        let left = |sums: &[f64; 2]| 1.0 - sums[0] * sums[0] / (sums[1] * self.squares);
        let fits = self
            .sums
            .iter()
            .enumerate()
            .map(|(shape, sums)| (left(sums), shape, sums));
        let (least, shape, sums) = fits.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (least <= LEFT).then(|| Creep {
            shape,
            speed: sums[0] / sums[1],
            largest: self.largest,
        })
    }
}
