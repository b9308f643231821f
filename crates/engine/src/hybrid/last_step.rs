//! The last step of a SUNDIALS solver, and the states inside it.

use super::{Direction, SystemDynamics, SystemLocation};
use crate::Error;
use crate::sundials::{AdvanceTarget, Advanced, OdeSystem, Solver};
use nalgebra::DMatrixViewMut;
use std::sync::Arc;
use stickslip_system::numerics::band::BandMut;

pub(super) struct Flow {
    pub(super) dynamics: Arc<SystemDynamics>,
    pub(super) location: SystemLocation,
    pub(super) origin: f64,
    pub(super) settling: f64,
}

impl OdeSystem for Flow {
    fn dimension(&self) -> usize {
        self.dynamics.dimension()
    }

    fn rhs(&mut self, tau: f64, y: &[f64], dydt: &mut [f64]) {
        self.dynamics.rhs(&self.location, self.origin + tau, y, dydt);
    }

    fn has_jacobian(&self) -> bool {
        true
    }

    fn jacobian(&mut self, tau: f64, y: &[f64], _dydt: &[f64], jacobian: DMatrixViewMut<'_, f64>) {
        self.dynamics.jacobian(&self.location, self.origin + tau, y, jacobian);
    }

    fn half_width(&self) -> Option<usize> {
        self.dynamics.half_width()
    }

    fn band_jacobian(&mut self, tau: f64, y: &[f64], _dydt: &[f64], jacobian: &mut BandMut<'_>) {
        self.dynamics
            .band_jacobian(&self.location, self.origin + tau, y, jacobian);
    }

    fn enter_band(&self, x: &[f64], z: &mut [f64]) {
        self.dynamics.enter_band(x, z);
    }

    fn leave_band(&self, z: &[f64], b: &[f64], x: &mut [f64]) {
        self.dynamics.leave_band(&self.location, z, b, x);
    }

    fn roots(&mut self, tau: f64, y: &[f64], values: &mut [f64]) {
        self.dynamics.guard_values(&self.location, self.origin + tau, y, values);
        if tau <= self.settling {
            for (index, (value, guard)) in values.iter_mut().zip(self.dynamics.guards(&self.location)).enumerate() {
                let beyond = self.dynamics.starts_beyond(&self.location, self.origin, y, index);
                match guard.direction {
                    Direction::Falling if beyond => *value = value.min(-f64::MIN_POSITIVE),
                    Direction::Rising if beyond => *value = value.max(f64::MIN_POSITIVE),
                    Direction::Falling => *value = value.max(f64::MIN_POSITIVE),
                    Direction::Rising => *value = value.min(-f64::MIN_POSITIVE),
                    Direction::Either => {}
                }
            }
        }
    }
}

/// A solver with its last step.
///
/// A multistep method interpolates by a polynomial of its own order. The dense output of ARKODE's one-step methods has
/// degree 5 at most, far below a method of order 8. Therefore `probe`, a second solver of the same kind, repeats the
/// step up to the wanted time.
pub(super) struct LastStep {
    pub(super) solver: Solver<Flow>,
    pub(super) probe: Option<Solver<Flow>>,
    pub(super) start: f64,
    pub(super) start_state: Vec<f64>,
}

impl LastStep {
    pub(super) fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), Error> {
        let Some(probe) = &mut self.probe else {
            let inside = self.solver.interpolate(tau.min(self.solver.time()), 0, out);
            // By rounding, the start of the step may lie before the solver's own value for it.
            if inside.is_err() && tau - self.start <= 8.0 * f64::EPSILON * tau {
                out.copy_from_slice(&self.start_state);
                return Ok(());
            }
            return inside;
        };
        let span = tau - self.start;
        // ARKODE takes no step shorter than the rounding of the step's start.
        if span <= 8.0 * f64::EPSILON * self.solver.mesh_time()? {
            out.copy_from_slice(&self.start_state);
            return Ok(());
        }
        probe.restart(self.start, &self.start_state)?;
        probe.set_initial_step(Some(span))?;
        probe.set_stop_time(Some(tau))?;
        while probe.advance(tau, AdvanceTarget::OneStep)? != Advanced::StopTime {}
        out.copy_from_slice(probe.state());
        Ok(())
    }
}
