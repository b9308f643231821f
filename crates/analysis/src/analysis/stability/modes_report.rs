//! Report data: modes of a system, steady sliding and changes of its stability.

use super::impedance::SlidingVerdict;
use serde::Serialize;

/// Modes of a system, steady sliding, and changes of its stability. SI units and radians; in translation metres,
/// newtons and kilograms replace radians, newton metres and kilogram square metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SystemModes {
    /// Values of the drives.
    pub driving: Vec<Driven>,
    /// Points of steady sliding, the fastest first; without one, the relative velocity at t = 0.
    pub operating_points: Vec<OperatingPoint>,
    /// States without contact, at rest, and at each operating point; for a stop also zero speed and zero margin.
    pub states: Vec<SystemState>,
    /// Relative velocities at which sliding changes its stability, under F_n.
    pub critical_relative_velocities: ChangeSearch,
    /// Normal forces at which steady sliding changes its stability, N, under the same drives.
    pub critical_normal_forces: Option<ChangeSearch>,
    /// Factors of the rotor's shaft damping at which the first operating point changes its stability.
    pub critical_rotor_damping: Option<ChangeSearch>,
    /// Factors of the stator's shaft damping, likewise.
    pub critical_stator_damping: Option<ChangeSearch>,
    /// Missing parts of the report, with reasons.
    pub absent: Vec<MissingModes>,
}

/// Value of a signal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Driven {
    /// Key in the case.
    pub key: &'static str,
    /// Value in the signal's unit.
    pub value: f64,
    /// Choice of the value, such as "constant" or "mean".
    pub taken: &'static str,
}

/// Sliding at one relative velocity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperatingPoint {
    /// Whether twists and speeds stay constant.
    pub steady: bool,
    /// Relative velocity omega_r, rad/s.
    pub relative_velocity: f64,
    /// Speed of all rotor inertias, if steady, rad/s.
    pub rotor_speed: Option<f64>,
    /// Speed of all stator inertias, if steady, rad/s.
    pub stator_speed: Option<f64>,
    /// Torque of the interface on the stator, N m.
    pub interface_torque: f64,
    /// Rotor twists, if steady, rad.
    pub rotor_twist: Vec<f64>,
    /// Stator twists, if steady, rad.
    pub stator_twist: Vec<f64>,
    /// Stability against a small disturbance.
    pub stability: SlidingVerdict,
}

/// Modes of one state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SystemState {
    /// "axial", "separated", "stick", "slip" or "engaged".
    pub state: &'static str,
    /// Relative velocity of the linearisation, rad/s; `None` if it has no effect.
    pub relative_velocity: Option<f64>,
    /// Modes, the fastest first.
    pub modes: Vec<SystemMode>,
}

/// Eigenvalue, with its conjugate if complex. Rounding counts as 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SystemMode {
    /// Largest motion: "axial", "relative" (surfaces against each other), "common" (surfaces together), "rotor surface"
    /// or "stator surface" (alone, without friction coupling), "surfaces" (joined), "bristles", or another inertia such
    /// as "rotor", with its index in a longer train.
    pub name: String,
    /// Re lambda, 1/s; positive: grows.
    pub growth_rate: f64,
    /// Im lambda >= 0, rad/s; 0 for a real root.
    pub angular_frequency: f64,
    /// Copy of `frequency`.
    pub natural_frequency: Option<f64>,
    /// Undamped frequency |lambda|/(2 pi), Hz; `None` for a real root.
    pub frequency: Option<f64>,
    /// -Re lambda/|lambda|; `None` for a real root.
    pub damping_ratio: Option<f64>,
    /// -Re lambda, 1/s; negative: grows.
    pub decay: f64,
    /// Inertia with the largest kinetic energy, such as "stator 0"; inertia 0 is the surface. `None` if none moves.
    pub moves: Option<String>,
    /// Velocities; the largest has amplitude 1 and phase 0.
    pub shape: Vec<ShapeComponent>,
}

/// Part of one inertia in a mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShapeComponent {
    /// Result column of the velocity: z, theta, phi2, phi1, or the column of a speed such as `rotor_speed_1`.
    pub coordinate: String,
    /// Amplitude relative to the largest.
    pub amplitude: f64,
    /// Phase relative to the largest, rad, in (-pi, pi].
    pub phase: f64,
}

/// Changes of stability as one parameter varies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChangeSearch {
    /// Lower end of the search.
    pub from: f64,
    /// Upper end of the search.
    pub to: f64,
    /// Changes in rising order.
    pub changes: Vec<StabilityChange>,
    /// Verdict for the whole range if nothing changes.
    pub throughout: Option<SlidingVerdict>,
}

/// Change of stability.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StabilityChange {
    /// Value of the varied parameter.
    pub value: f64,
    /// Relative velocity |omega_r|, rad/s.
    pub relative_velocity: f64,
    /// Frequency of the neutral motion, Hz; `None` without oscillation.
    pub frequency: Option<f64>,
    /// Whether sliding is unstable at larger values.
    pub unstable_above: bool,
}

/// Missing part of a report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MissingModes {
    /// Name of the part.
    pub what: &'static str,
    /// Reason.
    pub why: String,
}
