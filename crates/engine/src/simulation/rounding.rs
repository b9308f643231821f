//! Effect of rounding to double precision on event times, whatever the method.
//!
//! A method may have more error, but not less: methods differ between events, but at every event they use the same
//! rounded numbers:
//!
//! - parameters, each rounded by up to half a unit in its last place, once for all methods, and the constants that the
//!   equations of stick and slip derive from them, each rounded on its own;
//! - the state at the end and at the start of each segment, a rounding of each component;
//! - the clock, which adds up the lengths of the segments.
//!
//! If a kick is added to the slow manifold, the error of the manifold's series is included.
//!
//! The roundings of parameters are the same in every segment: their sizes are added. Roundings of states and clock are
//! independent at each event, without a preferred sign: their squares are added.

use nalgebra::{DMatrix, DVector};

const HALF_UNIT: f64 = f64::EPSILON / 2.0;

/// A derived constant, such as k_t/J, is a quotient or a sum of two: two roundings besides the parameter's own.
const ROUNDINGS_OF_CONSTANT: f64 = 2.0;

/// Rounded operations behind a component of a state at an event: torque from twist and rate, mean of two torques,
/// acceleration, and the sum that ends a step.
const ROUNDINGS_OF_STATE: f64 = 8.0;

const DEVIATIONS: f64 = 3.0;

/// A parameter with the derivatives of an event time by it, s per unit.
pub(super) struct Rounded {
    pub value: f64,
    /// Derivative through all equations.
    pub everywhere: f64,
    /// Derivative through the equations whose constants are derived separately.
    pub apart: f64,
    /// Whether constants of the equations are derived from it; otherwise the value is used directly.
    pub in_equations: bool,
}

/// Accumulated variances of rounding; each rounding is uniform within half a unit.
#[derive(Debug, Clone)]
pub(super) struct RoundingVariance {
    /// Covariance of the state at the last event.
    state: DMatrix<f64>,
    /// Variance of the clock, s^2.
    clock: f64,
}

fn variance(size: f64) -> f64 {
    (HALF_UNIT * size).powi(2) / 3.0
}

impl RoundingVariance {
    pub fn new(components: usize) -> RoundingVariance {
        RoundingVariance {
            state: DMatrix::zeros(components, components),
            clock: 0.0,
        }
    }

    fn add_variances(&mut self, of: impl Iterator<Item = f64>) {
        for (k, variance) in of.take(self.state.nrows()).enumerate() {
            self.state[(k, k)] += variance;
        }
    }

    /// Propagates the roundings of the last event by `since`, the image of unit deviations, and adds the rounding of
    /// the state `y`.
    pub fn state(&mut self, since: &DMatrix<f64>, y: &[f64]) {
        self.state = since * &self.state * since.transpose();
        self.add_variances(y.iter().map(|size| ROUNDINGS_OF_STATE * variance(*size)));
    }

    pub fn add(&mut self, error: &[f64]) {
        self.add_variances(error.iter().map(|size| size * size));
    }

    /// The clock at `t` (s), an event set off by the state, is a sum, and is rounded.
    pub fn read_clock(&mut self, t: f64) {
        self.clock += variance(t);
    }

    /// At a prescribed time the error of the clock becomes a deviation of the state along the flow.
    pub fn set_clock(&mut self, flow: &DVector<f64>) {
        self.state += flow * flow.transpose() * self.clock;
        self.clock = 0.0;
    }

    /// Error bound of an event time, s. `shift` is the derivative of the time by the state at the last event.
    pub fn of_event(&self, shift: &DVector<f64>, numbers: impl Iterator<Item = Rounded>) -> f64 {
        let given: f64 = numbers
            .map(|number| {
                let Rounded {
                    value,
                    everywhere,
                    apart,
                    in_equations,
                } = number;
                let derived = if in_equations { ROUNDINGS_OF_CONSTANT } else { 0.0 };
                let on_their_own = apart.abs() + (everywhere - apart).abs();
                (everywhere.abs() + derived * on_their_own) * value.abs() * HALF_UNIT
            })
            // Some parameters have no finite derivative, such as the rise time of a step.
            .filter(|moved| moved.is_finite())
            .sum();
        let states = (shift.transpose() * &self.state * shift)[0].max(0.0);
        given + DEVIATIONS * (states + self.clock).sqrt()
    }
}
