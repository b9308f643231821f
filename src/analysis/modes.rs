//! The linear modes of the brake in its states, and what becomes of steady sliding: how its damping falls with the
//! speed, when it loses stability, and what then decides the onset of stick-slip.

use super::eigenvalues::leading_block;
use super::growth_rate::fast_growth_rate;
use super::stability_path::{Crossing, eigenvalue_crossing};
use super::{Growth, Summary};
use crate::friction::{FrictionLaw, Law};
use crate::hybrid::RunError;
use crate::model::axial::AxialMotion;
use crate::model::linear_part::{joined_speeds, speeds};
use crate::model::state::DYNAMIC;
use crate::model::torsion::{TorsionModel, spinning};
use crate::model::trains::Trains;
use crate::model::{Axial, Mode, Parameters};
use crate::numerics::eigenvalues::eigenvalues;
use crate::record::State;
use crate::run::Run;
use crate::simulation::{Following, OutputOptions, RunFailure, RunReport, SolverOptions};
use nalgebra::{Complex, DMatrix};
use serde::Serialize;
use std::f64::consts::TAU;
use std::ops::ControlFlow;

/// In stick the rotor speed follows from the twist rates: theta' = u' + v'.
const STICK_DYNAMIC: usize = DYNAMIC - 1;

/// Points of the curve of effective damping.
const CURVE: usize = 201;

/// One eigenvalue of a state's linear equations, with its complex conjugate if it is complex.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Eigenmode {
    /// What moves most: "axial", "relative" (surfaces against each other), "common" (surfaces together), "rotor
    /// surface" or "stator surface" (alone, where friction does not couple them), "rotor", "surfaces" (joined).
    pub name: &'static str,
    /// Re lambda, 1/s; positive: grows.
    pub growth_rate: f64,
    /// Im lambda >= 0, rad/s; 0 for a real root.
    pub angular_frequency: f64,
    /// |lambda|/(2 pi), Hz: the frequency without damping; `None` for a real root.
    pub natural_frequency: Option<f64>,
    /// -Re lambda/|lambda|; `None` for a real root.
    pub damping_ratio: Option<f64>,
    /// Of the velocities; the largest has amplitude 1 and phase 0.
    pub shape: Vec<ShapeComponent>,
}

/// The part that one inertia has in a mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ShapeComponent {
    /// Channel of the result file whose velocity this is: z, theta, phi2, phi1.
    pub coordinate: &'static str,
    /// Relative to the largest of the mode.
    pub amplitude: f64,
    /// rad, in (-pi, pi], against the largest.
    pub phase: f64,
}

/// The modes of one state of the brake.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateModes {
    /// "axial", "stick" or "slip".
    pub state: &'static str,
    /// |omega_r|, rad/s, about which slip is linear; `None` where it does not matter.
    pub relative_velocity: Option<f64>,
    /// In the order of falling real part.
    pub modes: Vec<Eigenmode>,
}

/// Damping of the relative mode in steady sliding at one speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EffectiveDamping {
    /// |omega_r|, rad/s.
    pub relative_velocity: f64,
    /// The stability margin c_t + 2 r F_n mu'(|omega_r|), N m s/rad.
    pub damping: f64,
    /// The same over 2 sqrt(k_t J).
    pub damping_ratio: f64,
    /// Largest real part of the fast eigenvalues of the coupled slip state, 1/s.
    pub growth_rate: f64,
}

/// Whether steady sliding loses its stability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stability {
    /// It does, within the run.
    Lost,
    /// Friction does not fall with speed: no speed and no force makes it unstable.
    FrictionDoesNotFall,
    /// c_t outweighs the falling friction at every speed under the largest force.
    DampingSuffices,
    /// It could, but the run sticks or ends before.
    NotReached,
}

/// What decides when and how stick-slip sets in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnsetDecision {
    /// The perturbation of the case, well above rounding.
    Perturbation,
    /// Rounding and solver error, amplified.
    Rounding,
    /// Neither grows to matter: the smooth sliding itself comes to its stick.
    SmoothSliding,
    /// The points of a friction table: each that sliding passes excites the fast mode, as a perturbation of the case does,
    /// and a run without that tells which of them it is.
    FrictionPoints,
}

/// The loss of stability along the case's own sliding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Instability {
    /// Zero of the margin, s.
    pub time: f64,
    /// |omega_r| there, rad/s.
    pub relative_velocity: f64,
    /// F_n there, N.
    pub normal_force: f64,
    /// Largest real part of the fast eigenvalues there, 1/s: not zero, as the rotor moves too.
    pub growth_rate: f64,
    /// Where that real part itself crosses zero, if that is near.
    pub eigenvalue_crossing: Option<Crossing>,
    /// Where smooth sliding itself comes to its stop, s; the end of the run if it never does.
    pub smooth_end: f64,
    /// First stick of the run, s.
    pub onset_time: Option<f64>,
    /// G, e-folds.
    pub growth_exponent: f64,
    /// Its part up to the first stick.
    pub growth_to_onset: f64,
    /// From the kick to the first stick.
    pub e_folds_gained: Option<f64>,
    /// By how many e-folds the kick stands above rounding at the first stick; negative if it has died out.
    pub kick_above_noise: Option<f64>,
    /// By which of the criteria.
    pub onset_decided_by: OnsetDecision,
}

/// Everything that `stickslip modes` says of a case. SI units and radians.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Modes {
    /// sqrt(k_e/m)/(2 pi), Hz.
    pub axial_frequency: f64,
    /// c_a/(2 sqrt(k_e m)).
    pub axial_damping_ratio: f64,
    /// sqrt(k_t/J)/(2 pi), Hz.
    pub torsional_frequency: f64,
    /// T_n = 2 pi sqrt(J/k_t), s.
    pub natural_period: f64,
    /// The largest actuating force, N: the F_n of the slip states and of the effective damping.
    pub normal_force: f64,
    /// |omega_r| at which the effective damping is zero under that force, rad/s; `None` if it never is.
    pub critical_speed: Option<f64>,
    /// Every such speed, the highest first, where there are several: below the second steady sliding is stable again, below
    /// the third unstable, and so on. Empty where there is one or none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub critical_speeds: Vec<f64>,
    /// At rest and in slip, in stick, without contact.
    pub states: Vec<StateModes>,
    /// From 0 to beyond the critical speed.
    pub effective_damping: Vec<EffectiveDamping>,
    /// Of steady sliding, through the stop.
    pub stability: Stability,
    /// `None` if sliding is stable to the stop.
    pub instability: Option<Instability>,
    /// Why the run that looked for the instability failed, if it did.
    pub run_failure: Option<String>,
}

impl Instability {
    /// How long smooth sliding is unstable before it stops, s.
    pub fn window(&self) -> f64 {
        self.smooth_end - self.time
    }
}

impl Modes {
    /// Of a case. Integrates it up to its first stick to find the loss of stability where the run itself has it.
    pub fn of_case(parameters: &Parameters, solver: &SolverOptions, end_time: f64) -> Modes {
        let (report, failure) = run_to_first_stick(parameters, solver, end_time);
        let torsion = TorsionModel::new(parameters);
        let force = parameters.largest_force().max(0.0);
        let mut critical_speeds = torsion.critical_speeds(force);
        let critical_speed = critical_speeds.first().copied();
        let initial = parameters.initial.speed.abs();
        let mut speeds = vec![0.0, initial];
        speeds.extend(&critical_speeds);
        if critical_speeds.len() < 2 {
            critical_speeds.clear();
        }
        speeds.sort_by(f64::total_cmp);
        speeds.dedup();
        let mut states = vec![axial_modes(&parameters.axial), stick_modes(&torsion)];
        states.extend(speeds.iter().map(|&x| slip_modes(&torsion, force, x)));
        let instability = instability(parameters, &torsion, &parameters.axial_motion(), &report);
        Modes {
            axial_frequency: (parameters.axial.stiffness / parameters.axial.mass).sqrt() / TAU,
            axial_damping_ratio: parameters.axial.damping
                / (2.0 * (parameters.axial.stiffness * parameters.axial.mass).sqrt()),
            torsional_frequency: torsion.natural_angular_frequency() / TAU,
            natural_period: torsion.natural_period(),
            normal_force: force,
            critical_speed,
            critical_speeds,
            states,
            effective_damping: damping_curve(&torsion, force, critical_speed, initial),
            stability: stability(&parameters.friction.law, critical_speed, instability.is_some()),
            instability,
            run_failure: failure.map(|error| error.to_string()),
        }
    }
}

/// Damping of the relative mode at |omega_r| = `x` under `normal_force`.
pub fn effective_damping(torsion: &TorsionModel, normal_force: f64, x: f64) -> EffectiveDamping {
    let damping = torsion.stability_margin(1.0, x, normal_force);
    let critical = 2.0 * (torsion.torsion.stiffness * torsion.torsion.surface_inertia).sqrt();
    let growth_rate = slip_modes(torsion, normal_force, x)
        .modes
        .iter()
        .filter(|mode| mode.name != "rotor")
        .map(|mode| mode.growth_rate)
        .fold(f64::NEG_INFINITY, f64::max);
    EffectiveDamping {
        relative_velocity: x,
        damping,
        damping_ratio: damping / critical,
        growth_rate,
    }
}

fn damping_curve(torsion: &TorsionModel, force: f64, critical: Option<f64>, initial: f64) -> Vec<EffectiveDamping> {
    // Where friction has all but ceased to change; where it does not change, as far as the run goes.
    let scale = 0.5 * torsion.friction.law.extent();
    let end = match critical {
        Some(critical) => critical + scale,
        None if scale.is_finite() => scale,
        None => initial.max(1.0),
    };
    (0..CURVE)
        .map(|k| effective_damping(torsion, force, end * k as f64 / (CURVE - 1) as f64))
        .collect()
}

/// The axial oscillator (1), as m z'' + c_a z' + k_e z = 0.
pub(crate) fn axial_modes(axial: &Axial) -> StateModes {
    let omega = (axial.stiffness / axial.mass).sqrt();
    let matrix = DMatrix::from_row_slice(2, 2, &[0.0, omega, -omega, -axial.damping / axial.mass]);
    let velocity = |v: &[Complex<f64>]| vec![("z", v[1])];
    StateModes {
        state: "axial",
        relative_velocity: None,
        modes: eigenmodes(&matrix, velocity, |_, _| "axial"),
    }
}

/// Stick (4): the rotor and the joined surfaces, a Jacobian that depends on nothing.
pub fn stick_modes(torsion: &TorsionModel) -> StateModes {
    let jacobian = torsion.dynamic_jacobian(Mode::Stick, || 0.0, &spinning(0.0));
    let velocities = |v: &[Complex<f64>]| named(joined_speeds(v));
    let name = |_: Complex<f64>, shape: &[Complex<f64>]| {
        if shape[0].norm() > shape[1].norm() {
            "rotor"
        } else {
            "surfaces"
        }
    };
    StateModes {
        state: "stick",
        relative_velocity: None,
        modes: eigenmodes(&leading_block(&jacobian, STICK_DYNAMIC, torsion), velocities, name),
    }
}

/// Slip (3) about |omega_r| = `x` under a constant `normal_force` (N).
pub fn slip_modes(torsion: &TorsionModel, normal_force: f64, x: f64) -> StateModes {
    let jacobian = torsion.sliding_jacobian(1.0, normal_force, x);
    let velocities = |v: &[Complex<f64>]| named(speeds(v));
    let name = |_: Complex<f64>, shape: &[Complex<f64>]| {
        let (relative, common) = ((shape[1] - shape[2]).norm(), (shape[1] + shape[2]).norm());
        // The rotor takes its own surface along: that mode has the rotor as its largest part.
        if shape[0].norm() >= 0.9 * shape[1].norm().max(shape[2].norm()) {
            "rotor"
        } else if shape[1].norm() < 0.5 * shape[2].norm() {
            "stator surface"
        } else if shape[2].norm() < 0.5 * shape[1].norm() {
            "rotor surface"
        } else if relative >= common {
            "relative"
        } else {
            "common"
        }
    };
    StateModes {
        state: "slip",
        relative_velocity: Some(x),
        modes: eigenmodes(&leading_block(&jacobian, DYNAMIC, torsion), velocities, name),
    }
}

fn named([theta, phi2, phi1]: [Complex<f64>; 3]) -> Vec<(&'static str, Complex<f64>)> {
    vec![("theta", theta), ("phi2", phi2), ("phi1", phi1)]
}

/// Eigenvalues with Im >= 0, the fastest first, each with the velocities of its right eigenvector.
fn eigenmodes(
    matrix: &DMatrix<f64>,
    velocities: impl Fn(&[Complex<f64>]) -> Vec<(&'static str, Complex<f64>)>,
    name: impl Fn(Complex<f64>, &[Complex<f64>]) -> &'static str,
) -> Vec<Eigenmode> {
    let eigenvalues = eigenvalues(matrix);
    let largest = eigenvalues.iter().map(|l| l.norm()).fold(0.0, f64::max);
    let mut kept: Vec<Complex<f64>> = eigenvalues.iter().copied().filter(|l| l.im >= 0.0).collect();
    kept.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    kept.into_iter()
        .map(|lambda| {
            let vector = eigenvector(matrix, lambda);
            let parts = velocities(&vector);
            let shape: Vec<Complex<f64>> = parts.iter().map(|part| part.1).collect();
            let first = shape.iter().copied().fold(Complex::new(0.0, 0.0), |best, c| {
                // Of equal parts the first is the reference, whatever their last digit says.
                if c.norm() > best.norm() * (1.0 + 1e-9) { c } else { best }
            });
            // A real root has no frequency; nor has one that only rounding makes complex.
            let oscillates = lambda.im > 1e-12 * largest;
            Eigenmode {
                name: name(lambda, &shape),
                growth_rate: lambda.re,
                angular_frequency: if oscillates { lambda.im } else { 0.0 },
                natural_frequency: oscillates.then(|| lambda.norm() / TAU),
                damping_ratio: oscillates.then(|| -lambda.re / lambda.norm()),
                shape: parts
                    .iter()
                    .map(|&(coordinate, part)| {
                        let relative = part / first;
                        ShapeComponent {
                            coordinate,
                            amplitude: relative.norm(),
                            phase: relative.arg(),
                        }
                    })
                    .collect(),
            }
        })
        .collect()
}

/// The right singular vector of the least singular value of A - lambda.
pub(super) fn eigenvector(matrix: &DMatrix<f64>, lambda: Complex<f64>) -> Vec<Complex<f64>> {
    let n = matrix.nrows();
    let shifted = DMatrix::from_fn(n, n, |i, j| {
        Complex::from(matrix[(i, j)]) - if i == j { lambda } else { Complex::from(0.0) }
    });
    let decomposition = shifted.svd(false, true);
    let least = decomposition
        .singular_values
        .iter()
        .enumerate()
        .min_by(|a, b| a.1.total_cmp(b.1))
        .map_or(n - 1, |(k, _)| k);
    decomposition
        .v_t
        .map(|v_t| v_t.row(least).iter().map(|c| c.conj()).collect())
        .unwrap_or_default()
}

/// The events of a run up to its first stick, and the error of a run that failed before.
fn run_to_first_stick(parameters: &Parameters, solver: &SolverOptions, end_time: f64) -> (RunReport, Option<RunError>) {
    let output = OutputOptions {
        end_time,
        interval: end_time,
        windows: Vec::new(),
        steps: false,
        follow: Following::default(),
    };
    let result = Run::of_trains(&Trains::from(parameters), 0.0, solver, &output)
        .control(|progress| {
            if progress.mode == Mode::Stick {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })
        .start();
    match result {
        // Smooth sliding is looked at to where the case ends, not to where this run was stopped.
        Ok(report) => (
            RunReport {
                end: end_time,
                ..report
            },
            None,
        ),
        Err(failure) => {
            let RunFailure { error, report } = *failure;
            (report, Some(error))
        }
    }
}

fn instability(
    parameters: &Parameters,
    torsion: &TorsionModel,
    axial: &AxialMotion,
    report: &RunReport,
) -> Option<Instability> {
    let summary = Summary::of_run(parameters, report);
    let time = summary.instability_time?;
    let growth = Growth::of_digest(parameters, &report.digest, report.end)?;
    let state: State = report.digest.instability.as_ref()?.before;
    let sense = state.relative_velocity.signum();
    let x = state.relative_velocity.abs();
    let passed = |knot: &f64| *knot < parameters.initial.speed.abs();
    let decided = if torsion.friction.law.knots().iter().any(passed) {
        OnsetDecision::FrictionPoints
    } else if summary.noise_determined {
        OnsetDecision::Rounding
    } else if summary.kick_above_noise.is_some_and(|above| above > THOUSANDFOLD) {
        OnsetDecision::Perturbation
    } else {
        OnsetDecision::SmoothSliding
    };
    Some(Instability {
        time,
        relative_velocity: x,
        normal_force: axial.pressing_force(time).max(0.0),
        growth_rate: fast_growth_rate(torsion, axial, sense, time, x),
        eigenvalue_crossing: eigenvalue_crossing(torsion, axial, time, &state),
        smooth_end: growth.smooth_end,
        onset_time: summary.onset_time,
        growth_exponent: summary.growth_exponent.unwrap_or(0.0),
        growth_to_onset: summary.growth_to_onset.unwrap_or(0.0),
        e_folds_gained: summary.e_folds_gained,
        kick_above_noise: summary.kick_above_noise,
        onset_decided_by: decided,
    })
}

/// ln 1000: what stands a thousand times above rounding leaves three digits of the onset to the perturbation.
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
