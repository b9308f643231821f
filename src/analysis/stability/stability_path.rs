//! Where, along smooth sliding, the eigenvalues of the slip state cross into instability.

use super::smooth_sliding::Slowing;
use crate::friction::Law;
use crate::record::State;
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
pub(crate) fn eigenvalue_crossing(sliding: &Slowing, time: f64, at: &State) -> Option<Crossing> {
    let path = sliding.path(at.relative_velocity.signum());
    let start = path.point(time, at);
    let slowing = path.torque(start).abs() / sliding.inertia();
    let rate = sliding.system.law.steepness_rate(at.relative_velocity.abs());
    let step = STEP / (rate * slowing);
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
