//! Where, along smooth sliding, the eigenvalues of the slip state cross into instability.

use super::growth::fast_growth_rate;
use crate::model::axial::AxialMotion;
use crate::model::slow_manifold::{of_momentum, slow_momentum};
use crate::model::torsion::{DIMENSION, TorsionModel, index::*};
use crate::simulation::State;
use serde::Serialize;

/// Share of the time in which the margin changes by its own size that one step of the search takes.
const STEP: f64 = 0.02;

/// Steps of the search each way: as long as the margin takes to change by its own size.
const STEPS: usize = 50;

/// Halvings of the bracket: from a fiftieth of a time scale to the rounding of the time.
const HALVINGS: usize = 60;

/// The zero of the largest real part of the fast eigenvalues of the slip state, along smooth (kick-free) sliding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Crossing {
    /// s.
    pub time: f64,
    /// |omega_r| there, rad/s.
    pub relative_velocity: f64,
}

/// The crossing near the zero of the margin at `time` with the state `at`; `None` where there is none within the
/// time that the margin takes to change by its own size.
///
/// The margin is the damping left to the relative mode with the rotor at rest; the rotor moves along and shifts the
/// eigenvalues' own crossing, by 0.1 ms in the paper's case.
pub fn eigenvalue_crossing(torsion: &TorsionModel, axial: &AxialMotion, time: f64, at: &State) -> Option<Crossing> {
    let path = Smooth {
        torsion,
        axial,
        sense: at.relative_velocity.signum(),
    };
    let mut y = [0.0; DIMENSION];
    y[ROTOR_TWIST_RATE] = at.rotor_twist_rate;
    y[ROTOR_SPEED] = at.theta_dot;
    let start = (time, slow_momentum(torsion, &y));
    let slowing = path.torque(start).abs() / (torsion.torsion.rotor_inertia + torsion.torsion.surface_inertia);
    let step = STEP / (torsion.friction.decay * slowing);
    let unstable = path.growth(start) > 0.0;
    let step = if unstable { -step } else { step };
    let mut near = start;
    for _ in 0..STEPS {
        let far = path.advanced(near, step);
        if far.0 < 0.0 || path.speed(far) <= 0.0 || !far.1.is_finite() {
            return None;
        }
        if (path.growth(far) > 0.0) != unstable {
            let mut width = step;
            for _ in 0..HALVINGS {
                width *= 0.5;
                let middle = path.advanced(near, width);
                if (path.growth(middle) > 0.0) == unstable {
                    near = middle;
                }
            }
            return Some(Crossing {
                time: near.0,
                relative_velocity: path.speed(near),
            });
        }
        near = far;
    }
    None
}

/// Smooth sliding: the motion on the slow manifold, whose one variable is the momentum I theta' + J phi_2'.
struct Smooth<'a> {
    torsion: &'a TorsionModel,
    axial: &'a AxialMotion,
    sense: f64,
}

/// (time, s; momentum, N m s).
type Point = (f64, f64);

impl Smooth<'_> {
    fn pressing(&self, t: f64) -> (f64, f64) {
        let axial = self.axial.at(t);
        (axial.pressing_force.max(0.0), axial.pressing_rate)
    }

    fn state(&self, (t, momentum): Point) -> [f64; DIMENSION] {
        of_momentum(self.torsion, self.sense, self.pressing(t), momentum)
    }

    fn torque(&self, point: Point) -> f64 {
        self.torsion
            .sliding_torque(self.sense, &self.state(point), self.pressing(point.0).0)
    }

    fn speed(&self, point: Point) -> f64 {
        self.sense * self.torsion.relative_velocity(&self.state(point))
    }

    fn growth(&self, point: Point) -> f64 {
        fast_growth_rate(self.torsion, self.axial, self.sense, point.0, self.speed(point))
    }

    /// One step of the classical method of order 4: at a fiftieth of the time scale its error is 1e-9 of the change.
    fn advanced(&self, (t, momentum): Point, step: f64) -> Point {
        let fall = |t: f64, momentum: f64| -self.torque((t, momentum));
        let k1 = fall(t, momentum);
        let k2 = fall(t + step / 2.0, momentum + step / 2.0 * k1);
        let k3 = fall(t + step / 2.0, momentum + step / 2.0 * k2);
        let k4 = fall(t + step, momentum + step * k3);
        (t + step, momentum + step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0)
    }
}
