//! What rounding to double precision does to the times of events, whatever the method.
//!
//! A method may have more error, but not less: between events each goes its own way, and at every event they meet in the
//! same numbers. These are
//!
//! - the numbers of the case, each rounded by up to half a unit in its last place, once for all methods, and the constants
//!   that the equations of stick and those of slip derive from it, rounded in each on their own;
//! - the state, where a segment ends and where the next one begins, a rounding of each component;
//! - the clock, which adds up the lengths of the segments.
//!
//! Where a kick is added to the slow manifold, the error of that manifold's series comes with it.
//!
//! The first two kinds of rounding are the same in every segment, and are added by their size. Those of states and of the
//! clock are as many as there are events and have no preferred sign: their squares are added.

use nalgebra::{DMatrix, DVector};

/// Half a unit in the last place of 1.
const HALF_UNIT: f64 = f64::EPSILON / 2.0;

/// A derived constant, such as k_t/J, is a quotient or a sum of two: two roundings beside that of the number.
const ROUNDINGS_OF_CONSTANT: f64 = 2.0;

/// A component of a state at an event is what some operations made of it, each rounded: those of a torque from twist and
/// rate, of the mean of two torques, of an acceleration, and of the sum that ends a step.
const ROUNDINGS_OF_STATE: f64 = 8.0;

/// Standard deviations that are taken for the most that happens.
const DEVIATIONS: f64 = 3.0;

/// A number of the case: by how much it moves an event, s per its unit.
pub(super) struct Rounded {
    pub value: f64,
    /// In all.
    pub everywhere: f64,
    /// By the equations whose constants are derived apart.
    pub apart: f64,
    /// Whether the equations have it in constants of theirs; else it is used as it is.
    pub in_equations: bool,
}

/// The variances of what rounding has done so far, one rounding to a number counting as uniform within half a unit.
#[derive(Debug, Clone)]
pub(super) struct Rounding {
    /// Of the state, at the last event.
    state: DMatrix<f64>,
    /// Of the clock, s^2.
    clock: f64,
}

/// Variance of a number of this size that has been rounded once.
fn variance(size: f64) -> f64 {
    (HALF_UNIT * size).powi(2) / 3.0
}

impl Rounding {
    /// Of so many components, before the first rounding.
    pub fn new(components: usize) -> Rounding {
        Rounding {
            state: DMatrix::zeros(components, components),
            clock: 0.0,
        }
    }

    fn add_variances(&mut self, of: impl Iterator<Item = f64>) {
        for (k, variance) in of.take(self.state.nrows()).enumerate() {
            self.state[(k, k)] += variance;
        }
    }

    /// Takes the roundings to where unit deviations have become `since`, and rounds the state `y` there.
    pub fn state(&mut self, since: &DMatrix<f64>, y: &[f64]) {
        self.state = since * &self.state * since.transpose();
        self.add_variances(y.iter().map(|size| ROUNDINGS_OF_STATE * variance(*size)));
    }

    /// Each component is off by so much besides.
    pub fn add(&mut self, error: &[f64]) {
        self.add_variances(error.iter().map(|size| size * size));
    }

    /// The clock reads `t` (s) at an event that the state sets off: a sum.
    pub fn read_clock(&mut self, t: f64) {
        self.clock += variance(t);
    }

    /// The clock is at a time of the case. What it was off by, the state is off by along the flow.
    pub fn set_clock(&mut self, flow: &DVector<f64>) {
        self.state += flow * flow.transpose() * self.clock;
        self.clock = 0.0;
    }

    /// How far an event can be off, s. It moves by `shift` with the components of the state at the last event.
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
            // Some numbers are none that an event could be differentiated by, such as the rise time of a step.
            .filter(|moved| moved.is_finite())
            .sum();
        let states = (shift.transpose() * &self.state * shift)[0].max(0.0);
        given + DEVIATIONS * (states + self.clock).sqrt()
    }
}
