//! Result of an oracle run.

use super::equations::{ROTOR, STATOR, State};
use super::float::Float;
use super::number::ExactDouble;
use stickslip_system::model::Mode;
use stickslip_system::record::EventKind;

/// The state at an event or a sample.
#[derive(Debug, Clone)]
pub struct OracleState {
    /// Twists of the rotor's shafts, from the contact outwards: outer minus inner angle, rad.
    pub rotor_twist: Vec<ExactDouble>,
    /// Twist rates of the rotor's shafts, rad/s.
    pub rotor_twist_rate: Vec<ExactDouble>,
    /// Speeds of the rotor's inertias, from the contact outwards, rad/s.
    pub rotor_speed: Vec<ExactDouble>,
    /// Twists of the stator's shafts, from the contact outwards: inner minus outer angle, rad.
    pub stator_twist: Vec<ExactDouble>,
    /// Twist rates of the stator's shafts, rad/s.
    pub stator_twist_rate: Vec<ExactDouble>,
    /// Speeds of the stator's inertias, from the contact outwards, rad/s.
    pub stator_speed: Vec<ExactDouble>,
    /// omega_r: speed of the rotor's surface minus that of the stator's, rad/s.
    pub relative_velocity: ExactDouble,
    /// z (m) and z' (m/s) of an axial mode.
    pub axial: Option<[ExactDouble; 2]>,
    /// Angles of the outermost inertias of rotor and stator since t = 0, rad; `None` for a train without a free end.
    pub angles: [Option<ExactDouble>; 2],
    /// Deflection of the bristles, rad; zero for regularised contacts. `None` for contacts that stick and slip.
    pub deflection: Option<ExactDouble>,
}

impl OracleState {
    /// Name and value of each component that is a column of a result file: axial motion, shafts at the contact, the
    /// rotor's outermost inertia, the surfaces.
    pub fn components(&self) -> Vec<(&'static str, &ExactDouble)> {
        let [z, z_dot] = self
            .axial
            .as_ref()
            .map_or([None; 2], |axial| axial.each_ref().map(Some));
        let all = [
            ("z", z),
            ("z_dot", z_dot),
            ("rotor_twist", self.rotor_twist.first()),
            ("stator_twist", self.stator_twist.first()),
            ("theta", self.angles[0].as_ref()),
            ("theta_dot", self.rotor_speed.last()),
            ("phi2_dot", self.rotor_speed.first()),
            ("phi1_dot", self.stator_speed.first()),
        ];
        all.into_iter()
            .filter_map(|(name, value)| Some((name, value?)))
            .collect()
    }

    pub(super) fn new<const N: usize>(
        state: &State<N>,
        [rotor, stator]: &[(Vec<Float<N>>, Float<N>); 2],
        engaged: bool,
    ) -> OracleState {
        let numbers = |values: &[Float<N>]| values.iter().map(ExactDouble::from).collect();
        let [of_rotor, of_stator] = [ROTOR, STATOR].map(|c| &state.chains[c]);
        OracleState {
            rotor_twist: numbers(&of_rotor.twist),
            rotor_twist_rate: numbers(&of_rotor.rate),
            rotor_speed: numbers(&rotor.0),
            stator_twist: numbers(&of_stator.twist),
            stator_twist_rate: numbers(&of_stator.rate),
            stator_speed: numbers(&stator.0),
            relative_velocity: (&(&rotor.1 - &stator.1)).into(),
            axial: state
                .axial
                .as_ref()
                .map(|axial| axial.each_ref().map(ExactDouble::from)),
            angles: [of_rotor, of_stator].map(|chain| chain.free.is_some().then(|| (&chain.angle).into())),
            deflection: engaged.then(|| (&state.deflection).into()),
        }
    }
}

/// An event with the state after it.
#[derive(Debug, Clone)]
pub struct OracleEvent {
    /// Time, s.
    pub time: ExactDouble,
    /// Kind of event.
    pub kind: EventKind,
    /// Mode after the event.
    pub mode_after: Mode,
    /// State after the event.
    pub state: OracleState,
}

/// Result of an oracle run.
#[derive(Debug, Clone)]
pub struct OracleReport {
    /// All events, in order of time.
    pub events: Vec<OracleEvent>,
    /// States at the requested times that the run reaches.
    pub samples: Vec<(ExactDouble, OracleState)>,
    /// Number of steps.
    pub steps: u64,
    /// Bits of the mantissa of all numbers.
    pub bits: usize,
}
