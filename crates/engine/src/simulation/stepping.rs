//! Explicit steps: one step of a Runge-Kutta method, its longest stable length, and the engine of `rk4`.
//!
//! ARKODE cannot accept a step whatever its error, and would fail at the discontinuities that naive solvers step over.

use crate::Error;
use crate::hybrid::{Advance, ChosenSolver, Direction, Engine, EngineSegment, Fired, SystemDynamics, SystemLocation};
use crate::sundials::{Coefficients, Counters};
use nalgebra::Complex;
use std::sync::Arc;
use stickslip_system::model::Torsion;
use stickslip_system::numerics::bisection::bisect;

/// An explicit Runge-Kutta method with its scratch, for states of the type `S`: an array or a vector of numbers.
#[derive(Debug)]
pub struct ExplicitStep<S> {
    coefficients: Coefficients,
    /// Derivatives at the stages of the last step.
    slopes: Vec<S>,
    stage: S,
    /// Solution of the last step.
    pub solution: S,
}

impl<S: AsRef<[f64]> + AsMut<[f64]> + Clone> ExplicitStep<S> {
    /// A method; `zeros` is a state of the right length.
    pub fn new(coefficients: Coefficients, zeros: S) -> Self {
        ExplicitStep {
            slopes: vec![zeros.clone(); coefficients.b.len()],
            coefficients,
            stage: zeros.clone(),
            solution: zeros,
        }
    }

    /// Evaluations of the right-hand side in a step.
    pub fn stages(&self) -> u64 {
        self.slopes.len() as u64
    }

    /// Steps from `y` at `t` by `step` (s), and stores the solution.
    pub fn take(&mut self, t: f64, y: &S, step: f64, rhs: impl Fn(f64, &S, &mut S)) {
        let Coefficients { a, b, c, .. } = &self.coefficients;
        for (stage, row) in a.iter().enumerate() {
            self.stage.clone_from(y);
            for (weight, slope) in row.iter().zip(&self.slopes).filter(|(weight, _)| **weight != 0.0) {
                add(&mut self.stage, step * weight, slope);
            }
            rhs(t + c[stage] * step, &self.stage, &mut self.slopes[stage]);
        }
        self.solution.clone_from(y);
        for (weight, slope) in b.iter().zip(&self.slopes) {
            add(&mut self.solution, step * weight, slope);
        }
    }

    /// Largest error estimate of the last step, of length `step` (s), over the first `judged` components.
    pub fn error(&mut self, step: f64, judged: usize) -> f64 {
        let Coefficients { b, d, .. } = &self.coefficients;
        self.stage.as_mut().fill(0.0);
        for ((weight, embedded), slope) in b.iter().zip(d).zip(&self.slopes) {
            add(&mut self.stage, step * (weight - embedded), slope);
        }
        // A maximum must not lose NaN.
        let errors = self.stage.as_ref()[..judged].iter();
        errors.fold(0.0, |worst, e| if e.abs() <= worst { worst } else { e.abs() })
    }
}

fn add<S: AsRef<[f64]> + AsMut<[f64]>>(sum: &mut S, factor: f64, term: &S) {
    for (sum, term) in sum.as_mut().iter_mut().zip(term.as_ref()) {
        *sum += factor * term;
    }
}

/// The classical Runge-Kutta method of order 4, without error estimate.
pub fn classical() -> Coefficients {
    let b = vec![1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];
    Coefficients {
        a: vec![vec![], vec![0.5], vec![0.0, 0.5], vec![0.0, 0.0, 1.0]],
        c: vec![0.0, 0.5, 0.5, 1.0],
        d: b.clone(),
        b,
    }
}

/// Growth per step that still counts as stable: on the imaginary axis, without damping, methods of some orders grow
/// slightly at any step.
const GROWTH: f64 = 1e-6;

/// Longest step |h lambda| of the search; no explicit method with 16 stages reaches it.
const FARTHEST: f64 = 40.0;

const RESOLUTION: usize = 4000;

/// Longest step (s) for which the torsional oscillations of both disks do not grow: |R(h lambda)| <= 1 for the
/// eigenvalues lambda of J x'' + c_t x' + k_t x = 0, and with the rotor's inertia. Friction is left out: growth by
/// friction is physical.
pub fn longest_stable_step(method: &Coefficients, torsion: &Torsion) -> f64 {
    let stator = 1.0 / torsion.surface_inertia;
    [stator, stator + 1.0 / torsion.rotor_inertia]
        .into_iter()
        .flat_map(|inverse| roots(torsion.damping * inverse, torsion.stiffness * inverse))
        .map(|root| limit(method, root))
        .fold(f64::INFINITY, f64::min)
}

fn roots(p: f64, q: f64) -> [Complex<f64>; 2] {
    let root = Complex::new(0.25 * p * p - q, 0.0).sqrt();
    [-0.5 * p - root, -0.5 * p + root]
}

fn limit(method: &Coefficients, root: Complex<f64>) -> f64 {
    let size = root.norm();
    if size == 0.0 {
        return f64::INFINITY;
    }
    let grows = |z: f64| method.stability_function(root / size * z).norm() > 1.0 + GROWTH;
    let step = FARTHEST / RESOLUTION as f64;
    let Some(first) = (1..=RESOLUTION).map(|k| k as f64 * step).find(|&z| grows(z)) else {
        return FARTHEST / size;
    };
    bisect(first - step, first, 50, |z| !grows(z)).0 / size
}

/// A remainder of a segment below this share of a step deserves no step of its own.
const REMAINDER: f64 = 1e-9;

/// Steps of one length by the classical Runge-Kutta method, as in a solver that is written in an afternoon. A guard
/// fires at the end of the step in which it has changed its sign; nothing is located inside.
pub(super) struct FixedSteps {
    dynamics: Arc<SystemDynamics>,
    method: ExplicitStep<Vec<f64>>,
    location: Option<SystemLocation>,
    /// Start of the segment and its longest duration, s.
    segment: (f64, f64),
    step: f64,
    /// Time (s) and state at the start of the last step, and at its end.
    before: (f64, Vec<f64>),
    after: (f64, Vec<f64>),
    values: Vec<f64>,
    counters: Counters,
}

impl FixedSteps {
    pub(super) fn new(dynamics: Arc<SystemDynamics>) -> Self {
        let zeros = vec![0.0; dynamics.dimension()];
        FixedSteps {
            dynamics,
            method: ExplicitStep::new(classical(), zeros.clone()),
            location: None,
            segment: (0.0, 0.0),
            step: f64::NAN,
            before: (0.0, zeros.clone()),
            after: (0.0, zeros),
            values: Vec::new(),
            counters: Counters::default(),
        }
    }

    /// Solves the motion for `length` (s) from the start of the last step.
    fn solve(&mut self, length: f64) -> Result<(), Error> {
        let location = self.location.ok_or_else(Error::no_such_solver)?;
        let (dynamics, start) = (&self.dynamics, self.segment.0);
        let (tau, state) = &self.before;
        self.method.take(start + tau, state, length, |t, y, dydt| {
            dynamics.rhs(&location, t, y, dydt);
        });
        match self.method.solution.iter().all(|value| value.is_finite()) {
            true => Ok(()),
            false => Err(Error::step("a step ended with values that are not finite")),
        }
    }
}

impl Engine for FixedSteps {
    fn begin(&mut self, segment: &EngineSegment<'_>, chosen: &ChosenSolver) -> Result<(), Error> {
        self.step = chosen.fixed_step.ok_or_else(Error::no_such_solver)?;
        self.location = Some(segment.location);
        self.segment = (segment.start, segment.span());
        self.after = (0.0, segment.state.to_vec());
        self.counters = Counters::default();
        Ok(())
    }

    fn advance(&mut self) -> Result<Advance, Error> {
        let location = self.location.ok_or_else(Error::no_such_solver)?;
        let (start, span) = self.segment;
        std::mem::swap(&mut self.before, &mut self.after);
        let tau = self.before.0;
        let end = (self.counters.steps + 1) as f64 * self.step;
        let is_last = end >= span - REMAINDER * self.step;
        let end = if is_last { span } else { end };
        self.solve(end - tau)?;
        self.after.0 = end;
        self.after.1.copy_from_slice(&self.method.solution);
        let counters = &mut self.counters;
        counters.steps += 1;
        counters.rhs_evaluations += self.method.stages();
        (counters.last_order, counters.last_step) = (4, end - tau);
        let guards = self.dynamics.guards(&location);
        self.values.resize(guards.len(), 0.0);
        self.dynamics
            .guard_values(&location, start + end, &self.after.1, &mut self.values);
        let crossed = guards
            .iter()
            .zip(&self.values)
            .map(|(guard, value)| match guard.direction {
                Direction::Rising => *value > 0.0,
                _ => *value < 0.0,
            });
        let fired = crossed.clone().any(|fires| fires);
        Ok(match (fired, is_last) {
            (true, _) => Advance::Guards(Fired::by_index(crossed)),
            (false, true) => Advance::Stop,
            (false, false) => Advance::Stepped,
        })
    }

    fn time(&self) -> f64 {
        self.after.0
    }

    fn state(&self) -> &[f64] {
        &self.after.1
    }

    fn state_at(&mut self, tau: f64, out: &mut [f64]) -> Result<(), Error> {
        self.solve(tau - self.before.0)?;
        out.copy_from_slice(&self.method.solution);
        Ok(())
    }

    fn counters(&mut self) -> Result<Counters, Error> {
        Ok(self.counters)
    }
}
