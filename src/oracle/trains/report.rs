//! What a run of two trains gives.

use super::series::{ROTOR, STATOR, State};
use crate::oracle::float::Float;
use crate::oracle::number::Number;

/// The state at an event or a sample; rad and rad/s.
#[derive(Debug, Clone)]
pub struct TrainOracleState {
    /// Of the shafts of the rotor, from the contact outwards: outer less inner angle, rad.
    pub rotor_twist: Vec<Number>,
    /// Their rates, rad/s.
    pub rotor_twist_rate: Vec<Number>,
    /// Of the inertias of the rotor, from the contact outwards, rad/s.
    pub rotor_speed: Vec<Number>,
    /// Of the shafts of the stator, from the contact outwards: inner less outer angle, rad.
    pub stator_twist: Vec<Number>,
    /// Their rates, rad/s.
    pub stator_twist_rate: Vec<Number>,
    /// Of the inertias of the stator, from the contact outwards, rad/s.
    pub stator_speed: Vec<Number>,
    /// omega_r, the speed of the rotor's surface less that of the stator's, rad/s.
    pub relative_velocity: Number,
    /// z, m, and z', m/s, of an axial mode.
    pub axial: Option<[Number; 2]>,
    /// The deflection of the bristles, rad; zero where the engaged contact has none. `None` where the contact sticks and slips.
    pub deflection: Option<Number>,
}

impl TrainOracleState {
    /// With the speeds of the inertias, and of the surface, of both trains.
    pub(super) fn new<const N: usize>(
        state: &State<N>,
        [rotor, stator]: &[(Vec<Float<N>>, Float<N>); 2],
        engaged: bool,
    ) -> TrainOracleState {
        let numbers = |values: &[Float<N>]| values.iter().map(Number::from).collect();
        let [of_rotor, of_stator] = [ROTOR, STATOR].map(|c| &state.chains[c]);
        TrainOracleState {
            rotor_twist: numbers(&of_rotor.twist),
            rotor_twist_rate: numbers(&of_rotor.rate),
            rotor_speed: numbers(&rotor.0),
            stator_twist: numbers(&of_stator.twist),
            stator_twist_rate: numbers(&of_stator.rate),
            stator_speed: numbers(&stator.0),
            relative_velocity: (&(&rotor.1 - &stator.1)).into(),
            axial: state.axial.as_ref().map(|axial| axial.each_ref().map(Number::from)),
            deflection: engaged.then(|| (&state.deflection).into()),
        }
    }
}
