//! Stick and separation in closed form, for the automaton.

use super::dynamics::{GUARD_FORWARD, SystemDynamics, SystemLocation};
use crate::hybrid::{ClosedEnd, WithClosedForms};
use std::f64::consts::TAU;
use stickslip_system::model::Mode;
use stickslip_system::model::breakaway::{Breakaway, BreakawaySearch};
use stickslip_system::model::closed_form::LinearMotion;

impl SystemDynamics {
    /// The linear motion of a location, and the external torques of rotor and stator (N m), if it has a closed form.
    fn motion(&self, location: &SystemLocation) -> Option<(&LinearMotion, [f64; 2])> {
        let torques = match location.mode {
            Mode::Stick | Mode::Separated => self.excitation.at_rest(location.stretch)?,
            Mode::SlipForward | Mode::SlipBackward | Mode::Engaged => return None,
        };
        Some((self.closed_form.of(&self.system, location.mode)?, torques))
    }

    /// Whether the segment that begins at `t` (s) with the state `y` has a closed form. A stick that begins at its
    /// limit (within rounding) has none: the rates of its torque decide, whatever their order.
    pub fn has_closed_form(&self, location: &SystemLocation, t: f64, y: &[f64]) -> bool {
        let Some((motion, torques)) = self.motion(location) else {
            return false;
        };
        if location.mode != Mode::Stick {
            return true;
        }
        let noise = self.torque_noise();
        let torque = motion.tested_torque(y, torques).abs();
        let limit = self.system.breakaway_torque(self.outside(location, t).normal_force);
        torque <= noise || (limit - torque).abs() > noise
    }

    /// Whether a stick that begins at `t` (s) with the state `y` lasts to the next corner of the signals: the closed
    /// form shows that no remaining motion can break it.
    pub(super) fn stays_stuck(&self, location: &SystemLocation, t: f64, y: &[f64]) -> bool {
        let end = self.excitation.corners().get(location.stretch);
        let within = end.map_or(f64::INFINITY, |end| end - t);
        let sticks = location.mode == Mode::Stick && self.has_closed_form(location, t, y);
        sticks && self.breakaway(location, t, y, within) == Some(Breakaway::Never)
    }

    fn breakaway(&self, location: &SystemLocation, t: f64, y: &[f64], within: f64) -> Option<Breakaway> {
        let (motion, torques) = self.motion(location).filter(|_| location.mode == Mode::Stick)?;
        let (system, excitation, stretch) = (&self.system, &self.excitation, location.stretch);
        let capacity = system.breakaway_torque(1.0);
        let search = BreakawaySearch {
            period: self.natural_period().unwrap_or(TAU * self.unit(stretch)),
            within,
            noise: self.torque_noise(),
        };
        let limit = |tau: f64| excitation.pressing(stretch, t + tau).scaled(capacity);
        let lowest = |tau: f64| capacity * excitation.lowest_pressing(stretch, t + tau, t + within);
        Some(motion.breakaway(y, torques, search, limit, lowest))
    }
}

impl WithClosedForms for SystemDynamics {
    fn closed_state(&self, location: &SystemLocation, _t: f64, y: &[f64], tau: f64, out: &mut [f64]) {
        match self.motion(location) {
            Some((motion, torques)) => motion.state(y, torques, tau, out),
            None => unreachable!("the plan asks for a closed form where there is one"),
        }
    }

    fn closed_end(&self, location: &SystemLocation, t: f64, y: &[f64], within: f64) -> ClosedEnd {
        match self.breakaway(location, t, y, within) {
            Some(Breakaway::After { after, sense }) => ClosedEnd::Guard {
                after,
                index: if sense > 0.0 { GUARD_FORWARD } else { GUARD_FORWARD + 1 },
            },
            Some(Breakaway::NotBefore { until }) => ClosedEnd::Unknown { after: until },
            Some(Breakaway::NotYet | Breakaway::Never) | None => ClosedEnd::None,
        }
    }
}
