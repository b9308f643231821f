//! How much the unstable sliding before the first stick amplifies a perturbation.

use crate::hybrid::Dynamics;
use crate::model::axial::AxialMotion;
use crate::model::torsion::{DIMENSION, TorsionModel, index::*};
use crate::model::{Mode, Parameters};
use crate::simulation::brake::{Brake, Location, Watch};
use crate::simulation::{Event, EventKind};
use crate::sundials::{Esdirk, EsdirkTable, Integrator, OdeSystem, SolverError, Task, Tolerances};
use nalgebra::{Complex, DMatrix, DMatrixViewMut};
use std::sync::Arc;

/// Components of the slip state that carry its dynamics: the twists, their rates and the rotor speed.
const DYNAMIC: usize = 5;

/// Relative tolerance of the smooth path. Loose on purpose: its steps stride over the fast mode, and an L-stable method
/// then stays on the smooth solution, which is the one wanted here.
const SMOOTH_TOLERANCE: f64 = 1e-7;

/// Points at which the growth rate is taken; its integral is then good to about six digits.
const POINTS: usize = 2000;

/// A perturbation's growth along the kick-free smooth sliding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Growth {
    /// When steady sliding loses stability (zero of the margin on the run's own relative velocity), s.
    pub instability: f64,
    /// G: integral of max(0, Re lambda) from the instability to the first stick (or the end of the run).
    pub exponent: f64,
    /// Integral of Re lambda from the first kick to the first stick: the e-folds that the kick gains.
    pub from_kick: Option<f64>,
    /// Part of G that lies before the first kick: what noise gains before the kick is there.
    pub before_kick: Option<f64>,
}

impl Growth {
    /// Of a run, from its events; `None` if sliding never lost stability before the first stick.
    ///
    /// lambda is the fast pair of the slip state's Jacobian: of its five eigenvalues that with the largest real part,
    /// the slow root of the rotor excepted.
    ///
    /// # Errors
    /// If the smooth path cannot be integrated.
    pub fn of_run(parameters: &Parameters, events: &[Event], end: f64) -> Result<Option<Growth>, SolverError> {
        let first_stick = events.iter().find(|e| e.kind == EventKind::Stick).map(|e| e.time);
        let until = first_stick.unwrap_or(end);
        let Some(unstable) = events
            .iter()
            .find(|e| e.kind == EventKind::Destabilised && e.time <= until)
        else {
            return Ok(None);
        };
        let kick = events.iter().find(|e| e.kind == EventKind::Kick && e.time < until);
        let start = kick.filter(|k| k.time < unstable.time).unwrap_or(unstable);
        if until <= start.time || start.before.relative_velocity == 0.0 {
            return Ok(None);
        }
        let s = &start.before;
        let mut y = vec![0.0; DIMENSION];
        y[ROTOR_TWIST] = s.rotor_twist;
        y[ROTOR_TWIST_RATE] = s.rotor_twist_rate;
        y[STATOR_TWIST] = s.phi1;
        y[STATOR_TWIST_RATE] = s.phi1_dot;
        y[ROTOR_SPEED] = s.theta_dot;
        let mode = if s.relative_velocity > 0.0 {
            Mode::SlipForward
        } else {
            Mode::SlipBackward
        };
        let rates = growth_rates(parameters, mode, start.time, &y, until)?;
        let integral = |from: f64, f: fn(f64) -> f64| integrate(&rates, from, f);
        let from_kick = kick.map(|k| integral(k.time, |rate| rate));
        let exponent = integral(unstable.time, |rate| rate.max(0.0));
        let before_kick = kick.map(|k| {
            if k.time > unstable.time {
                exponent - integral(k.time, |r| r.max(0.0))
            } else {
                0.0
            }
        });
        Ok(Some(Growth {
            instability: unstable.time,
            exponent,
            from_kick,
            before_kick,
        }))
    }
}

/// Trapezoidal integral of f(rate) from `from` to the last point.
fn integrate(rates: &[(f64, f64)], from: f64, f: fn(f64) -> f64) -> f64 {
    rates
        .windows(2)
        .map(|pair| {
            let ((a, ra), (b, rb)) = (pair[0], pair[1]);
            let start = a.max(from);
            if start >= b {
                return 0.0;
            }
            let at_start = ra + (rb - ra) * (start - a) / (b - a);
            0.5 * (f(at_start) + f(rb)) * (b - start)
        })
        .sum()
}

/// (t, Re lambda) along the smooth sliding from `start` to `until`.
fn growth_rates(
    parameters: &Parameters,
    mode: Mode,
    start: f64,
    y: &[f64],
    until: f64,
) -> Result<Vec<(f64, f64)>, SolverError> {
    let brake = Arc::new(Brake::new(parameters));
    let location = Location {
        mode,
        resolved: false,
        watch: Watch::Off,
    };
    let path = SmoothSliding {
        brake: brake.clone(),
        location,
        start,
    };
    let span = until - start;
    let twist = y[STATOR_TWIST].abs().max(1e-9);
    let speed = brake.torsion.relative_velocity(y).abs();
    let mut absolute = vec![1e30; DIMENSION];
    for (k, scale) in [
        (ROTOR_TWIST, twist),
        (STATOR_TWIST, twist),
        (ROTOR_TWIST_RATE, speed),
        (STATOR_TWIST_RATE, speed),
        (ROTOR_SPEED, speed),
    ] {
        absolute[k] = SMOOTH_TOLERANCE * scale;
    }
    let tolerances = Tolerances {
        relative: SMOOTH_TOLERANCE,
        absolute,
    };
    let mut solver = Esdirk::new(path, EsdirkTable::Esdirk436L2sa6s34, 0.0, y, &tolerances)?;
    solver.set_stop_time(Some(span))?;
    let mut rates = Vec::with_capacity(POINTS + 1);
    let mut state = y.to_vec();
    let sense = f64::from(mode.sense());
    for k in 0..=POINTS {
        let tau = span * k as f64 / POINTS as f64;
        if k > 0 {
            while solver.time() < tau {
                solver.advance(span, Task::OneStep)?;
            }
            solver.interpolate(tau, 0, &mut state)?;
        }
        rates.push((
            start + tau,
            fast_growth_rate(&brake.torsion, &brake.axial, sense, start + tau, &state),
        ));
    }
    Ok(rates)
}

/// The largest real part among the fast eigenvalues of the slip state's Jacobian at `t` and `y`, 1/s.
pub fn fast_growth_rate(torsion: &TorsionModel, axial: &AxialMotion, sense: f64, t: f64, y: &[f64]) -> f64 {
    fast_eigenvalues(torsion, axial, sense, t, y)
        .iter()
        .map(|l| l.re)
        .fold(f64::NEG_INFINITY, f64::max)
}

/// The eigenvalues of the slip state's Jacobian but the slow root of the rotor, 1/s.
pub fn fast_eigenvalues(
    torsion: &TorsionModel,
    axial: &AxialMotion,
    sense: f64,
    t: f64,
    y: &[f64],
) -> Vec<Complex<f64>> {
    let mut full = DMatrix::zeros(DIMENSION, DIMENSION);
    torsion.slip_jacobian(sense, axial.pressing_force(t).max(0.0), y, &mut full.as_view_mut());
    // Twists scaled to the size of their rates: the eigenvalues stay, their rounding shrinks.
    let omega = torsion.natural_angular_frequency();
    let scale = |k: usize| {
        if k == ROTOR_TWIST || k == STATOR_TWIST {
            omega
        } else {
            1.0
        }
    };
    let jacobian = DMatrix::from_fn(DYNAMIC, DYNAMIC, |i, j| full[(i, j)] * scale(i) / scale(j));
    let mut eigenvalues: Vec<_> = jacobian.complex_eigenvalues().iter().copied().collect();
    eigenvalues.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    eigenvalues.truncate(DYNAMIC - 1);
    eigenvalues
}

/// Slip without guards.
struct SmoothSliding {
    brake: Arc<Brake>,
    location: Location,
    start: f64,
}

impl OdeSystem for SmoothSliding {
    fn dimension(&self) -> usize {
        DIMENSION
    }
    fn rhs(&mut self, tau: f64, y: &[f64], dydt: &mut [f64]) {
        self.brake.rhs(&self.location, self.start + tau, y, dydt);
    }
    fn has_jacobian(&self) -> bool {
        true
    }
    fn jacobian(&mut self, tau: f64, y: &[f64], _dydt: &[f64], jacobian: DMatrixViewMut<'_, f64>) {
        self.brake.jacobian(&self.location, self.start + tau, y, jacobian);
    }
}
