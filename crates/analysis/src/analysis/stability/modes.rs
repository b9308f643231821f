//! Results of `stickslip modes`: linear modes of a case. For sliding that slows down by itself, also damping over
//! speed, loss of stability, and cause of the onset of stick-slip.

use super::Growth;
use super::growth::run_to_first_stick;
use super::linear::SlidingVerdict;
use super::sliding_path::Slowing;
use super::states::{at_start, critical_speeds};
use serde::Serialize;
use std::f64::consts::TAU;
use stickslip_engine::simulation::{RunReport, SolverOptions, natural_period};
use stickslip_system::friction::{FrictionLaw, Law};
use stickslip_system::model::equations::SystemEquations;
use stickslip_system::model::stability::fast_growth_rate;
use stickslip_system::model::system::{Pressing, System};
use stickslip_system::numerics::bisection::bisect;
use stickslip_system::record::State;

const CURVE: usize = 201;

/// Step of the search, as a fraction of the time in which the margin changes by its own size.
const SEARCH_STEP: f64 = 0.02;

/// Steps in each direction, over the time in which the margin changes by its own size.
const SEARCH_STEPS: usize = 50;

/// Bisections of the bracket, from a fiftieth of a time scale to the rounding of the time.
const HALVINGS: usize = 60;

/// Zero of the largest real part of the slip's fast eigenvalues, along smooth (kick-free) sliding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StabilityCrossing {
    /// Time, s.
    pub time: f64,
    /// Relative velocity |omega_r|, rad/s.
    pub relative_velocity: f64,
}

/// Damping of the relative mode in steady sliding at one speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EffectiveDamping {
    /// Relative velocity |omega_r|, rad/s.
    pub relative_velocity: f64,
    /// Stability margin 2 (R + r F_n mu'(|omega_r|)), N m s/rad; c_t + 2 r F_n mu' for two equal disks.
    pub damping: f64,
    /// Ratio of that margin to the aperiodic limit, 2 sqrt(k_t J) for two equal disks.
    pub damping_ratio: f64,
    /// Largest real part of the slip's fast eigenvalues, 1/s.
    pub growth_rate: f64,
}

/// Stability of steady sliding in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stability {
    /// Stability is lost within the run.
    Lost,
    /// Friction does not fall with speed: always stable.
    FrictionDoesNotFall,
    /// c_t outweighs the falling friction at every speed under the largest force.
    DampingSuffices,
    /// Instability is possible, but the run sticks or ends before.
    NotReached,
}

/// Cause of the onset of stick-slip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnsetDecision {
    /// Perturbation of the case, well above rounding.
    Perturbation,
    /// Amplified rounding and solver error.
    Rounding,
    /// Smooth sliding itself ends in a stick, before either has grown.
    SmoothSliding,
    /// Corners of a friction table excite the fast mode; a run without perturbation shows which of them counts.
    FrictionPoints,
}

/// Loss of stability along the case's own sliding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Instability {
    /// Zero of the margin, s.
    pub time: f64,
    /// Relative velocity |omega_r| at that time, rad/s.
    pub relative_velocity: f64,
    /// Normal force F_n at that time, N.
    pub normal_force: f64,
    /// Largest real part of the fast eigenvalues at that time, 1/s: not zero, as the rotor moves too.
    pub growth_rate: f64,
    /// Nearby zero of that real part.
    pub eigenvalue_crossing: Option<StabilityCrossing>,
    /// End of smooth sliding in its stop, s; the end of the run without one.
    pub smooth_end: f64,
    /// First stick of the run, s.
    pub onset_time: Option<f64>,
    /// Growth exponent G, e-folds.
    pub growth_exponent: f64,
    /// Part of G up to the first stick, e-folds.
    pub growth_to_onset: f64,
    /// e-folds from the kick to the first stick.
    pub e_folds_gained: Option<f64>,
    /// ln(effect of the kick / effect of rounding) at the first stick. Negative: the kick has decayed below rounding.
    pub kick_above_noise: Option<f64>,
    /// Cause of the onset.
    pub onset_decided_by: OnsetDecision,
}

/// Results of `stickslip modes`. SI units and radians; in translation metres, newtons and kilograms replace radians,
/// newton metres and kilogram square metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Modes {
    /// Loss of stability; `None` if sliding does not slow down by itself, and in [`Modes::linear`].
    #[serde(flatten)]
    pub slowing: Option<SlowingModes>,
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

/// Damping and loss of stability in sliding that slows down by itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SlowingModes {
    /// sqrt(k_e/m)/(2 pi), Hz; `None` for a prescribed normal force.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial_frequency: Option<f64>,
    /// c_a/(2 sqrt(k_e m)).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axial_damping_ratio: Option<f64>,
    /// Inverse of the natural period, Hz.
    pub torsional_frequency: f64,
    /// Shorter period of a surface on its shaft, T_n = 2 pi sqrt(J/k_t) for two equal disks, s.
    pub natural_period: f64,
    /// Largest actuating force, N: F_n of the slip states and of the effective damping.
    pub normal_force: f64,
    /// |omega_r| of zero effective damping under that force, rad/s; `None` without a zero.
    pub critical_speed: Option<f64>,
    /// Every such speed, the highest first, if there are several: steady sliding is unstable below the first, stable
    /// below the second, and so on. Empty if there is one or none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub critical_speeds: Vec<f64>,
    /// Curve from 0 to beyond the critical speed.
    pub effective_damping: Vec<EffectiveDamping>,
    /// Stability of steady sliding until the stop.
    pub stability: Stability,
    /// `None` if sliding is stable until the stop.
    pub instability: Option<Instability>,
    /// Failure of the run that sought the instability.
    pub run_failure: Option<String>,
}

impl Instability {
    /// Duration of unstable smooth sliding, s.
    pub fn window(&self) -> f64 {
        self.smooth_end - self.time
    }
}

impl Modes {
    /// Modes of a system. Sliding that slows down by itself is integrated to its first stick to find the instability.
    pub fn of_case(trains: &System, solver: &SolverOptions, end_time: f64) -> Modes {
        Modes {
            slowing: SlowingModes::of_case(trains, solver, end_time),
            ..Modes::linear(trains)
        }
    }
}

impl SlowingModes {
    fn of_case(trains: &System, solver: &SolverOptions, end_time: f64) -> Option<SlowingModes> {
        let sliding = Slowing::new(trains)?;
        let natural_period = natural_period(trains)?;
        let (mut report, failure) = run_to_first_stick(trains, solver, end_time, true, &());
        if failure.is_none() {
            // Smooth sliding is examined to the end of the case, beyond the stop of this run.
            report.end = end_time;
        }
        let force = sliding.excitation.largest_force().max(0.0);
        let mut critical_speeds = critical_speeds(&sliding.system, force);
        let critical_speed = critical_speeds.first().copied();
        if critical_speeds.len() < 2 {
            critical_speeds.clear();
        }
        let axial = match &trains.pressing {
            Pressing::Axial { axial, .. } => Some(axial),
            Pressing::Force(_) => None,
        };
        let instability = instability(trains, &sliding, &report);
        Some(SlowingModes {
            axial_frequency: axial.map(|axial| (axial.stiffness / axial.mass).sqrt() / TAU),
            axial_damping_ratio: axial.map(|axial| axial.damping / (2.0 * (axial.stiffness * axial.mass).sqrt())),
            torsional_frequency: 1.0 / natural_period,
            natural_period,
            normal_force: force,
            critical_speed,
            critical_speeds,
            effective_damping: damping_curve(
                &sliding.system,
                TAU / natural_period,
                force,
                critical_speed,
                at_start(trains).abs(),
            ),
            stability: stability(&trains.law, critical_speed, instability.is_some()),
            instability,
            run_failure: failure.map(|error| error.to_string()),
        })
    }
}

/// Damping from standstill to nearly constant friction; if friction is constant, over the speeds of the run.
fn damping_curve(
    system: &SystemEquations,
    angular_frequency: f64,
    force: f64,
    critical: Option<f64>,
    initial: f64,
) -> Vec<EffectiveDamping> {
    let scale = 0.5 * system.law.extent();
    let end = match critical {
        Some(critical) => critical + scale,
        None if scale.is_finite() => scale,
        None => initial.max(1.0),
    };
    // Two surfaces swing against each other; their reduced inertia is J/2 if they are equal.
    let [one, other] = [&system.rotor, &system.stator].map(|side| side.surface_inertia().recip());
    let aperiodic = 4.0 * angular_frequency / (one + other);
    let at = |x: f64| {
        let contact_damping = system.radius * force * system.law.coefficient_and_slope(x).1;
        let damping = system.twice_resistance.unwrap_or(0.0) + 2.0 * contact_damping;
        EffectiveDamping {
            relative_velocity: x,
            damping,
            damping_ratio: damping / aperiodic,
            growth_rate: fast_growth_rate(system, contact_damping),
        }
    };
    (0..CURVE).map(|k| at(end * k as f64 / (CURVE - 1) as f64)).collect()
}

fn instability(trains: &System, sliding: &Slowing, report: &RunReport) -> Option<Instability> {
    let growth = Growth::of_digest(trains, &report.digest, report.end)?;
    let lost = report.digest.instability.as_ref()?;
    let (time, state): (f64, State) = (lost.time, lost.before);
    let x = state.relative_velocity.abs();
    let start = at_start(trains).abs();
    let decided = if trains.law.knots().iter().any(|knot| *knot < start) {
        OnsetDecision::FrictionPoints
    } else if !report.stopped_smoothly && growth.amplifies_rounding() {
        OnsetDecision::Rounding
    } else if growth.above_noise.is_some_and(|above| above > THOUSANDFOLD) {
        OnsetDecision::Perturbation
    } else {
        OnsetDecision::SmoothSliding
    };
    Some(Instability {
        time,
        relative_velocity: x,
        normal_force: sliding.force(time),
        growth_rate: sliding.rate(time, x),
        eigenvalue_crossing: eigenvalue_crossing(sliding, time, &state),
        smooth_end: growth.smooth_end,
        onset_time: report.digest.cycles.onset_time,
        growth_exponent: growth.exponent,
        growth_to_onset: growth.to_first_stick,
        e_folds_gained: growth.from_kick,
        kick_above_noise: growth.above_noise,
        onset_decided_by: decided,
    })
}

/// ln 1000: a perturbation a thousand times above rounding determines three digits of the onset.
const THOUSANDFOLD: f64 = 6.907_755_278_982_137;

fn stability(law: &FrictionLaw, critical: Option<f64>, lost: bool) -> Stability {
    if lost {
        Stability::Lost
    } else if !law.falls() {
        Stability::FrictionDoesNotFall
    } else if critical.is_none() {
        Stability::DampingSuffices
    } else {
        Stability::NotReached
    }
}

/// Crossing near the margin's zero at `time`, within the time scale of the margin. The margin assumes a rotor at rest.
/// The rotor's motion shifts the eigenvalues' crossing by 0.1 ms in the paper's case.
fn eigenvalue_crossing(sliding: &Slowing, time: f64, at: &State) -> Option<StabilityCrossing> {
    let path = sliding.path(at.relative_velocity.signum());
    let start = path.point(time, at);
    let slowing = path.torque(start).abs() / sliding.inertia();
    let rate = sliding.system.law.steepness_rate(at.relative_velocity.abs());
    let step = SEARCH_STEP / (rate * slowing);
    let unstable = path.growth(start) > 0.0;
    let step = if unstable { -step } else { step };
    let mut near = start;
    for _ in 0..SEARCH_STEPS {
        let far = path.advanced(near, step);
        if far.0 < 0.0 || path.speed(far) <= 0.0 || !far.1.is_finite() {
            return None;
        }
        if (path.growth(far) > 0.0) != unstable {
            let (step, _) = bisect(0.0, step, HALVINGS, |step| {
                (path.growth(path.advanced(near, step)) > 0.0) == unstable
            });
            let crossing = path.advanced(near, step);
            return Some(StabilityCrossing {
                time: crossing.0,
                relative_velocity: path.speed(crossing),
            });
        }
        near = far;
    }
    None
}
