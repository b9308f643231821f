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

use super::equations::Dynamic;
use crate::model::state::DYNAMIC;
use nalgebra::SMatrix;

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
    /// By the equations of stick.
    pub in_stick: f64,
    /// Whether the equations have it in constants of theirs; else it is used as it is.
    pub in_equations: bool,
}

/// The variances of what rounding has done so far, one rounding to a number counting as uniform within half a unit.
#[derive(Debug, Clone, Default)]
pub(super) struct Rounding {
    /// Of the state, at the last event.
    state: SMatrix<f64, DYNAMIC, DYNAMIC>,
    /// Of the clock, s^2.
    clock: f64,
}

/// Variance of a number of this size that has been rounded once.
fn variance(size: f64) -> f64 {
    (HALF_UNIT * size).powi(2) / 3.0
}

impl Rounding {
    /// Takes the roundings to where unit deviations have become `since`, and rounds the state `y` there.
    pub fn state(&mut self, since: &SMatrix<f64, DYNAMIC, DYNAMIC>, y: &Dynamic) {
        let fresh = y.map(|size| ROUNDINGS_OF_STATE * variance(size));
        self.state = since * self.state * since.transpose() + SMatrix::from_diagonal(&fresh);
    }

    /// Each component is off by so much besides.
    pub fn add(&mut self, error: &Dynamic) {
        self.state += SMatrix::from_diagonal(&error.map(|size| size * size));
    }

    /// The clock reads `t` (s) at an event that the state sets off: a sum.
    pub(crate) fn read_clock(&mut self, t: f64) {
        self.clock += variance(t);
    }

    /// The clock is at a time of the case. What it was off by, the state is off by along the flow.
    pub(crate) fn set_clock(&mut self, flow: &Dynamic) {
        self.state += flow * flow.transpose() * self.clock;
        self.clock = 0.0;
    }

    /// How far an event can be off, s. It moves by `shift` with the components of the state at the last event.
    pub(crate) fn of_event(&self, shift: &Dynamic, numbers: impl Iterator<Item = Rounded>) -> f64 {
        let given: f64 = numbers
            .map(|number| {
                let Rounded {
                    value,
                    everywhere,
                    in_stick,
                    in_equations,
                } = number;
                let derived = if in_equations { ROUNDINGS_OF_CONSTANT } else { 0.0 };
                let apart = in_stick.abs() + (everywhere - in_stick).abs();
                (everywhere.abs() + derived * apart) * value.abs() * HALF_UNIT
            })
            // The rise time of a step is no number that an event could be differentiated by.
            .filter(|moved| moved.is_finite())
            .sum();
        let states = (shift.transpose() * self.state * shift)[0].max(0.0);
        given + DEVIATIONS * (states + self.clock).sqrt()
    }
}
