//! The modes of a system, its steady sliding and changes of its stability, as data for a report.

use super::impedance::Verdict;
use serde::Serialize;

/// The modes of a system, its steady sliding, and where that loses its stability. SI units and radians; in translation metres, newtons
/// and kilograms stand for radians, newton metres and kilogram square metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SystemModes {
    /// What drives the trains, as numbers.
    pub driving: Vec<Driven>,
    /// Where they slide steadily, the fastest first. Where they cannot, the relative velocity at t = 0.
    pub operating_points: Vec<OperatingPoint>,
    /// Without contact, at rest, and at each of those. Of sliding that slows down by itself also at vanishing speed, and where its
    /// margin of stability is zero.
    pub states: Vec<SystemState>,
    /// Relative velocities at which the stability of sliding changes, under F_n.
    pub critical_relative_velocities: Search,
    /// Normal forces at which that of steady sliding changes, N, under the same drives.
    pub critical_normal_forces: Option<Search>,
    /// Multiples of the damping of the rotor's shafts at which that of the first operating point changes.
    pub critical_rotor_damping: Option<Search>,
    /// The same of the stator's.
    pub critical_stator_damping: Option<Search>,
    /// What this case does not have, and why.
    pub absent: Vec<Absent>,
}

/// A signal as a number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Driven {
    /// Its key in the case.
    pub key: &'static str,
    /// In its own unit.
    pub value: f64,
    /// Which value of the signal it is.
    pub taken: &'static str,
}

/// Sliding at one relative velocity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperatingPoint {
    /// Whether twists and speeds stay as they are there.
    pub steady: bool,
    /// omega_r, rad/s.
    pub relative_velocity: f64,
    /// Of every inertia of the rotor, if steady, rad/s.
    pub rotor_speed: Option<f64>,
    /// Of every inertia of the stator, if steady, rad/s.
    pub stator_speed: Option<f64>,
    /// Of the interface, on the stator, N m.
    pub interface_torque: f64,
    /// If steady, rad.
    pub rotor_twist: Vec<f64>,
    /// If steady, rad.
    pub stator_twist: Vec<f64>,
    /// What becomes of a small disturbance.
    pub stability: Verdict,
}

/// The modes of one state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SystemState {
    /// "axial", "separated", "stick", "slip" or "engaged".
    pub state: &'static str,
    /// About which the state is linear, rad/s; `None` where it does not matter.
    pub relative_velocity: Option<f64>,
    /// The fastest first.
    pub modes: Vec<SystemMode>,
}

/// One eigenvalue, with its complex conjugate if it is complex. Rounding counts as 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SystemMode {
    /// What moves most: "axial", "relative" (surfaces against each other), "common" (surfaces together), "rotor surface" or "stator
    /// surface" (alone, where friction does not couple them), "surfaces" (joined), "bristles", or another inertia such as "rotor",
    /// with its number in a longer train.
    pub name: String,
    /// Re lambda, 1/s; positive: grows.
    pub growth_rate: f64,
    /// Im lambda >= 0, rad/s; 0 for a real root.
    pub angular_frequency: f64,
    /// The same as `frequency`.
    pub natural_frequency: Option<f64>,
    /// |lambda|/(2 pi), Hz: the frequency without damping; `None` for a real root.
    pub frequency: Option<f64>,
    /// -Re lambda/|lambda|; `None` for a real root.
    pub damping_ratio: Option<f64>,
    /// -Re lambda, 1/s; negative: grows.
    pub decay: f64,
    /// The inertia with the largest kinetic energy, such as "stator 0"; inertia 0 is the surface. `None` where none moves.
    pub moves: Option<String>,
    /// Of the velocities; the largest has amplitude 1 and phase 0.
    pub shape: Vec<ShapeComponent>,
}

/// The part that one inertia has in a mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShapeComponent {
    /// Column of the result file whose velocity this is: z, theta, phi2, phi1, or the column of a speed such as `rotor_speed_1`.
    pub coordinate: String,
    /// Relative to the largest of the mode.
    pub amplitude: f64,
    /// rad, in (-pi, pi], against the largest.
    pub phase: f64,
}

/// Where stability changes while one number is varied.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Search {
    /// The range that was searched.
    pub from: f64,
    /// Its upper end.
    pub to: f64,
    /// In rising order.
    pub changes: Vec<Change>,
    /// Where nothing changes, what holds over the whole range.
    pub throughout: Option<Verdict>,
}

/// A change of stability.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Change {
    /// Of what was varied.
    pub value: f64,
    /// |omega_r| there, rad/s.
    pub relative_velocity: f64,
    /// Of the motion that neither grows nor dies out, Hz; `None` where it does not oscillate.
    pub frequency: Option<f64>,
    /// Whether sliding is unstable at larger values.
    pub unstable_above: bool,
}

/// What a case does not have.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Absent {
    /// What.
    pub what: &'static str,
    /// Why.
    pub why: String,
}
