//! A stick whose fast oscillation has died: the motion of its slow mode alone.
//!
//! In stick both disks' dampings and stiffnesses are in one proportion, so that its two modes are those of the undamped
//! system: with x = (theta - phi_2 + phi_1, phi_1) equation (4) is M x'' + K (c_t x' + k_t x) = 0, M = diag(I, 2J),
//! K = ((1, -1), (-1, 2)), and each mode m obeys q'' = -xi (c_t q' + k_t q) with K m = xi M m. Once the faster one is gone,
//! what is left moves along the slower mode exactly, and its equation is not stiff.

use super::Torsion;
use super::state::index::*;
use super::torsion::TorsionModel;

/// The two modes of stick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlowStick {
    torsion: Torsion,
    /// xi of the slower mode, 1/(kg m^2).
    compliance: f64,
    /// The slower mode m, of length 1 in M: (theta - phi_2 + phi_1, phi_1).
    mode: [f64; 2],
    /// M m.
    weights: [f64; 2],
    /// Least rate at which a motion of the faster mode dies, 1/s.
    pub fast_decay: f64,
}

impl SlowStick {
    /// Of a brake.
    pub fn new(model: &TorsionModel) -> Self {
        let Torsion {
            rotor_inertia: i,
            surface_inertia: j,
            stiffness,
            damping,
        } = model.torsion;
        // 2 I J xi^2 - 2 (I + J) xi + 1 = 0
        let larger = (i + j + i.hypot(j)) / (2.0 * i * j);
        let smaller = 1.0 / (2.0 * i * j * larger);
        // The first row of K m = xi M m.
        let shape = [1.0, 1.0 - smaller * i];
        let length = (i * shape[0] * shape[0] + 2.0 * j * shape[1] * shape[1]).sqrt();
        let mode = shape.map(|part| part / length);
        let half = 0.5 * larger * damping;
        let square = half * half - larger * stiffness;
        SlowStick {
            torsion: model.torsion,
            compliance: smaller,
            mode,
            weights: [i * mode[0], 2.0 * j * mode[1]],
            // The slower of two real roots without cancellation.
            fast_decay: if square > 0.0 {
                larger * stiffness / (half + square.sqrt())
            } else {
                half
            },
        }
    }

    /// The rates of a state `y` on the slower mode, DIMENSION of them; what a state has of the faster one is left alone.
    pub fn rhs(&self, y: &[f64], dydt: &mut [f64]) {
        let [whole, stator] = self.mode;
        let along = |x: [f64; 2]| self.weights[0] * x[0] + self.weights[1] * x[1];
        let q = along([y[ROTOR_TWIST] + y[STATOR_TWIST], y[STATOR_TWIST]]);
        let q_dot = along([y[ROTOR_TWIST_RATE] + y[STATOR_TWIST_RATE], y[STATOR_TWIST_RATE]]);
        let q_ddot = -self.compliance * (self.torsion.damping * q_dot + self.torsion.stiffness * q);
        dydt[ROTOR_TWIST] = q_dot * (whole - stator);
        dydt[ROTOR_TWIST_RATE] = q_ddot * (whole - stator);
        dydt[STATOR_TWIST] = q_dot * stator;
        dydt[STATOR_TWIST_RATE] = q_ddot * stator;
        dydt[ROTOR_SPEED] = q_ddot * whole;
        dydt[SLIP] = 0.0;
        dydt[FRICTION_LOSS] = 0.0;
        dydt[DAMPING_LOSS] = self.torsion.damping_power(y);
    }
}
