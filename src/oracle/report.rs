//! What an oracle run gives.

use super::number::Number;
use super::series::{State, component::*};
use crate::model::Mode;
use crate::record::EventKind;

/// The state at an event or a sample; rad and rad/s, m and m/s.
#[derive(Debug, Clone)]
pub struct OracleState {
    /// z, m.
    pub z: Number,
    /// z', m/s.
    pub z_dot: Number,
    /// theta - phi_2, rad.
    pub rotor_twist: Number,
    /// phi_1, rad.
    pub stator_twist: Number,
    /// theta, rad.
    pub theta: Number,
    /// theta', rad/s.
    pub theta_dot: Number,
    /// phi_2', rad/s.
    pub phi2_dot: Number,
    /// phi_1', rad/s.
    pub phi1_dot: Number,
}

impl OracleState {
    pub(super) fn new<const N: usize>(y: &State<N>) -> OracleState {
        OracleState {
            z: (&y[Z]).into(),
            z_dot: (&y[Z_DOT]).into(),
            rotor_twist: (&y[ROTOR_TWIST]).into(),
            stator_twist: (&y[STATOR_TWIST]).into(),
            theta: (&y[ROTOR_ANGLE]).into(),
            theta_dot: (&y[ROTOR_SPEED]).into(),
            phi2_dot: (&(&y[ROTOR_SPEED] - &y[ROTOR_TWIST_RATE])).into(),
            phi1_dot: (&y[STATOR_TWIST_RATE]).into(),
        }
    }

    /// Name and value of each component.
    pub fn components(&self) -> [(&'static str, &Number); 8] {
        [
            ("z", &self.z),
            ("z_dot", &self.z_dot),
            ("rotor_twist", &self.rotor_twist),
            ("stator_twist", &self.stator_twist),
            ("theta", &self.theta),
            ("theta_dot", &self.theta_dot),
            ("phi2_dot", &self.phi2_dot),
            ("phi1_dot", &self.phi1_dot),
        ]
    }
}

/// An event, with the state after it.
#[derive(Debug, Clone)]
pub struct OracleEvent<S = OracleState> {
    /// s.
    pub time: Number,
    /// What happened.
    pub kind: EventKind,
    /// Mode after the event.
    pub mode_after: Mode,
    /// The state after the event.
    pub state: S,
}

/// What an oracle run found.
#[derive(Debug, Clone)]
pub struct OracleReport<S = OracleState> {
    /// All events, in order.
    pub events: Vec<OracleEvent<S>>,
    /// The state at each of the times that were asked for, as far as the run reaches.
    pub samples: Vec<(Number, S)>,
    /// How many steps it took.
    pub steps: u64,
    /// Bits of the mantissa of all numbers.
    pub bits: usize,
}
