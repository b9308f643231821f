//! Stick and separation in closed form.
//!
//! In both the torsional system is linear with constant coefficients, whatever F(t) does: the contact force enters
//! neither. The matrix exponential is exact at any time, costs less than one step of an integrator, and its energy
//! proves when a stick can never break away again.

use super::BreakawayTest;
use super::axial::AxialMotion;
use super::breakaway::{Bounded, Breakaway, Search, first_breakaway};
use super::linear_flow::{Functional, LinearFlow};
use super::state::{TorsionState, index::*};
use super::torsion::TorsionModel;
use nalgebra::{Matrix4, RowVector4, U4, Vector4};

/// The linear motions of one brake.
#[derive(Debug, Clone)]
pub struct ClosedForm {
    model: TorsionModel,
    /// Twists are scaled by this to the size of their rates.
    omega: f64,
    stick: LinearFlow<U4>,
    separated: LinearFlow<U4>,
    tested: Functional<U4>,
}

impl ClosedForm {
    /// Of a brake.
    pub fn new(model: &TorsionModel) -> Self {
        let omega = 2f64.powi(model.natural_angular_frequency().log2().round() as i32);
        let (k, c_t) = (model.torsion.stiffness / omega, model.torsion.damping);
        let flow = |(matrix, energy)| LinearFlow::new(matrix, Matrix4::from_diagonal(&energy));
        let stick = flow(model.torsion.joined_flow(omega));
        let (rotor, stator) = match model.contact.breakaway_test {
            BreakawayTest::Transmitted => (0.5, 0.5),
            BreakawayTest::Stator => (0.0, 1.0),
            BreakawayTest::Rotor => (1.0, 0.0),
        };
        let tested = stick.functional(RowVector4::new(
            rotor * k,
            rotor * c_t,
            stator * k,
            (stator - rotor) * c_t,
        ));
        ClosedForm {
            model: model.clone(),
            omega,
            separated: flow(model.torsion.free_flow(omega)),
            stick,
            tested,
        }
    }

    /// The state without its quadratures, in the coordinates of a stick.
    fn stuck(&self, y: &TorsionState) -> Vector4<f64> {
        let [u, v] = [ROTOR_TWIST, STATOR_TWIST].map(|twist| self.omega * y[twist]);
        Vector4::new(u, y[ROTOR_SPEED], v, y[STATOR_TWIST_RATE])
    }

    /// The same in those of a separation.
    fn free(&self, y: &TorsionState) -> Vector4<f64> {
        let [u, v] = [ROTOR_TWIST, STATOR_TWIST].map(|twist| self.omega * y[twist]);
        Vector4::new(u, y[ROTOR_TWIST_RATE], v, y[STATOR_TWIST_RATE])
    }

    /// The state a time `tau >= 0` (s) into a stick that began with `y`, in which both surfaces have one speed.
    pub fn stick(&self, y: &TorsionState, tau: f64) -> TorsionState {
        let start = self.stuck(y);
        let x = self.stick.advance(&start, tau);
        let mut state = self.expanded(y, &x);
        state[ROTOR_SPEED] = x[1];
        state[ROTOR_TWIST_RATE] = x[1] - x[3];
        state[DAMPING_LOSS] += self.energy_loss(&self.stick, &start, &x);
        state
    }

    /// The state a time `tau >= 0` (s) into a separation that began with `y`.
    pub fn separated(&self, y: &TorsionState, tau: f64) -> TorsionState {
        let start = self.free(y);
        let x = self.separated.advance(&start, tau);
        let mut state = self.expanded(y, &x);
        state[ROTOR_TWIST_RATE] = x[1];
        // Rotor and rotor surface keep I theta' + J phi_2' = (I + J) theta' - J u'.
        let share = self.model.torsion.surface_share();
        state[ROTOR_SPEED] = y[ROTOR_SPEED] + share * (state[ROTOR_TWIST_RATE] - y[ROTOR_TWIST_RATE]);
        let twist_change = state[ROTOR_TWIST] - y[ROTOR_TWIST];
        let turned = y[ROTOR_SPEED] * tau + share * (twist_change - y[ROTOR_TWIST_RATE] * tau);
        state[SLIP] = y[SLIP] + turned - twist_change - (state[STATOR_TWIST] - y[STATOR_TWIST]);
        state[DAMPING_LOSS] += self.energy_loss(&self.separated, &start, &x);
        state
    }

    /// What both have in common.
    fn expanded(&self, y: &TorsionState, x: &Vector4<f64>) -> TorsionState {
        let mut state = *y;
        state[ROTOR_TWIST] = x[0] / self.omega;
        state[STATOR_TWIST] = x[2] / self.omega;
        state[STATOR_TWIST_RATE] = x[3];
        state
    }

    fn energy_loss(&self, flow: &LinearFlow<U4>, start: &Vector4<f64>, end: &Vector4<f64>) -> f64 {
        let (from, to) = (flow.energy_norm(start), flow.energy_norm(end));
        0.5 * (from - to) * (from + to)
    }

    /// The first time within `within` (s) of `t` at which the tested torque reaches mu_0 r F_n, in a stick that began
    /// at `t` with `y`. No corner of F may lie inside. The search steps over times in which bounds on the curvature
    /// exclude a root, and so passes over none.
    pub fn next_breakaway(&self, axial: &AxialMotion, t: f64, y: &TorsionState, within: f64) -> Breakaway {
        let capacity = self.model.friction.breakaway * self.model.contact.radius;
        let start = self.stuck(y);
        let tested = |tau: f64| {
            let x = self.stick.advance(&start, tau);
            let energy = self.stick.energy_norm(&x);
            let torque = Bounded {
                value: self.tested.value(&x),
                rate: self.tested.rate(&x),
                curvature: self.tested.largest_curvature_later(energy),
            };
            (torque, self.tested.largest_later(energy))
        };
        let limit = |tau: f64| axial.bounded(t + tau).scaled(capacity);
        let lowest = |tau: f64| capacity * axial.lowest_pressing_force_after(t + tau);
        let search = Search {
            period: self.model.natural_period(),
            within,
            noise: 0.0,
        };
        first_breakaway(search, tested, limit, lowest)
    }
}
