//! Stick and separation in closed form, for the automaton.

use crate::Error;
use crate::hybrid::dynamics::{GUARD_FORWARD, SystemDynamics, SystemLocation};
use crate::hybrid::{Advance, ChosenSolver, Engine, EngineSegment, Fired};
use crate::sundials::Counters;
use std::f64::consts::TAU;
use std::sync::Arc;
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
        let torque = motion.tested_torque(y, torques);
        let limit = self
            .system
            .breakaway_torque(torque, self.outside(location, t).normal_force);
        torque.abs() <= noise || (limit - torque.abs()).abs() > noise
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
        let capacity = |sense: f64| system.breakaway_torque(sense, 1.0);
        let least = capacity(1.0).min(capacity(-1.0));
        let search = BreakawaySearch {
            period: self.natural_period().unwrap_or(TAU * self.unit(stretch)),
            within,
            noise: self.torque_noise(),
        };
        let limit = |sense: f64, tau: f64| excitation.pressing(stretch, t + tau).scaled(capacity(sense));
        let lowest = |tau: f64| least * excitation.lowest_pressing(stretch, t + tau, t + within);
        Some(motion.breakaway(y, torques, search, limit, lowest))
    }

    /// Writes the state `tau` (s) after the state `y` in a location with a closed form.
    pub fn closed_state(&self, location: &SystemLocation, y: &[f64], tau: f64, out: &mut [f64]) {
        match self.motion(location) {
            Some((motion, torques)) => motion.state(y, torques, tau, out),
            None => unreachable!("the plan asks for a closed form where there is one"),
        }
    }
}

/// Takes a whole segment as one step, in closed form.
pub struct ClosedFormEngine {
    dynamics: Arc<SystemDynamics>,
    location: Option<SystemLocation>,
    /// Start and stop, s.
    span: (f64, f64),
    start: Vec<f64>,
    tau: f64,
    state: Vec<f64>,
}

impl ClosedFormEngine {
    /// An engine for a system.
    pub fn new(dynamics: Arc<SystemDynamics>) -> Self {
        let zeros = vec![0.0; dynamics.dimension()];
        ClosedFormEngine {
            dynamics,
            location: None,
            span: (0.0, 0.0),
            start: zeros.clone(),
            tau: 0.0,
            state: zeros,
        }
    }
}

impl Engine for ClosedFormEngine {
    fn begin(&mut self, segment: &EngineSegment<'_>, _: &ChosenSolver) -> Result<(), Error> {
        self.location = Some(segment.location);
        self.span = (segment.start, segment.stop);
        self.start.copy_from_slice(segment.state);
        self.state.copy_from_slice(segment.state);
        self.tau = 0.0;
        Ok(())
    }

    fn advance(&mut self) -> Result<Advance, Error> {
        let location = self.location.ok_or_else(Error::no_such_solver)?;
        let (start, stop) = self.span;
        let span = stop - start;
        let (after, advance) = match self.dynamics.breakaway(&location, start, &self.start, span) {
            Some(Breakaway::After { after, sense }) if after < span => {
                let guard = if sense > 0.0 { GUARD_FORWARD } else { GUARD_FORWARD + 1 };
                (after, Advance::Guards(Fired::one(guard)))
            }
            Some(Breakaway::NotBefore { until }) if start + until < stop => (until, Advance::Searched),
            _ => (span, Advance::Stop),
        };
        self.dynamics
            .closed_state(&location, &self.start, after, &mut self.state);
        self.tau = after;
        Ok(advance)
    }

    fn time(&self) -> f64 {
        self.tau
    }

    fn state(&self) -> &[f64] {
        &self.state
    }

    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), Error> {
        let location = self.location.ok_or_else(Error::no_such_solver)?;
        self.dynamics.closed_state(&location, &self.start, tau, out);
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters, Error> {
        Ok(Counters::default())
    }
}
