//! The linear modes against closed forms, and the report on the loss of stability.

use crate::common::cases::built_in;
use crate::common::systems::{exponential, pair, train};
use crate::common::{disks, output, run};
use proptest::prelude::*;
use std::f64::consts::TAU;
use stickslip::analysis::Modes;
use stickslip::analysis::stability::modes::{OnsetDecision, SlowingModes, Stability, SystemMode, SystemState};
use stickslip::case::Case;
use stickslip::friction::{Exponential, Law};
use stickslip::model::Torsion;
use stickslip::model::system::{End, Pressing, System};
use stickslip::record::EventKind;
use stickslip::signal::Drive;

fn modes_of(case: &Case) -> Modes {
    Modes::of_case(&case.system, &case.solver, case.output.end_time)
}

fn slowing_of(case: &Case) -> SlowingModes {
    modes_of(case).slowing.expect("a brake")
}

fn named<'a>(state: &'a SystemState, name: &str) -> &'a SystemMode {
    let found = state.modes.iter().find(|mode| mode.name == name);
    found.unwrap_or_else(|| panic!("no mode {name} among {:?}", state.modes))
}

fn close(value: f64, expected: f64, relative: f64) -> bool {
    (value - expected).abs() <= relative * expected.abs()
}

/// The eigenvalue routine is backward stable: its error is some epsilon of the largest eigenvalue, which is some 1e5
/// epsilon of a mode a hundred times slower.
const EIGENVALUE: f64 = 1e-10;

#[test]
fn published_natural_period_and_frequency_of_the_paper() {
    let modes = modes_of(&built_in("paper", &[]));
    let slowing = modes.slowing.unwrap();
    assert_eq!(format!("{:.2}", slowing.torsional_frequency / 1e3), "4.16");
    assert_eq!(format!("{:.5}", slowing.natural_period), "0.00024");
    let mut states = modes.states.iter();
    let slip = states.find(|s| s.relative_velocity == Some(100.0)).unwrap();
    let stator = named(slip, "stator surface");
    assert!(close(
        stator.natural_frequency.unwrap(),
        slowing.torsional_frequency,
        EIGENVALUE
    ));
}

#[test]
fn analytic_axial_mode() {
    let case = built_in("paper-si", &[]);
    let axial = disks(&case).axial;
    let modes = modes_of(&case);
    let axial_modes = &modes.states[0].modes;
    let mode = &axial_modes[0];
    assert_eq!(axial_modes.len(), 1);
    let omega = (axial.stiffness / axial.mass).sqrt();
    assert!(close(mode.natural_frequency.unwrap(), omega / TAU, EIGENVALUE));
    let ratio = axial.damping / (2.0 * (axial.stiffness * axial.mass).sqrt());
    assert!(close(mode.damping_ratio.unwrap(), ratio, EIGENVALUE));
    let slowing = modes.slowing.unwrap();
    assert!(close(slowing.axial_frequency.unwrap(), omega / TAU, 1e-15));
    assert!(close(slowing.axial_damping_ratio.unwrap(), ratio, 1e-15));
}

/// Two real roots whose product is k_e/m and whose sum is -c_a/m.
#[test]
fn analytic_overdamped_axial_mode_has_two_real_roots() {
    let case = built_in("paper-si", &["axial.damping=60000"]);
    let axial = disks(&case).axial;
    let states = modes_of(&case).states;
    let roots: Vec<f64> = states[0].modes.iter().map(|m| m.growth_rate).collect();
    assert_eq!(roots.len(), 2);
    assert!(close(roots[0] * roots[1], axial.stiffness / axial.mass, EIGENVALUE));
    assert!(close(roots[0] + roots[1], -axial.damping / axial.mass, EIGENVALUE));
}

fn torsions() -> impl Strategy<Value = (Torsion, f64)> {
    // The largest ratio keeps every mode below critical damping: no mode here is faster than sqrt(k_t (1/I + 1/J)),
    // 1.23 sqrt(k_t/J).
    (0.1..100.0f64, 1e-3..0.05f64, 1e5..1e7f64, 1e-3..0.8f64, 0.5..10.0f64).prop_map(|(i, j, k_t, ratio, alpha)| {
        let torsion = Torsion {
            rotor_inertia: i,
            surface_inertia: j,
            stiffness: k_t,
            damping: 2.0 * ratio * (k_t * j).sqrt(),
        };
        (torsion, alpha)
    })
}

const RADIUS: f64 = 0.05;

fn law(decay: f64) -> Exponential {
    exponential(0.6, 0.3, decay)
}

fn stick_and_slip(torsion: &Torsion, decay: f64, force: f64, x: f64) -> (SystemState, SystemState) {
    let train = |inertia: &[f64], end| train(inertia, &[torsion.stiffness], &[torsion.damping], end);
    let (surface, rotor) = (torsion.surface_inertia, torsion.rotor_inertia);
    let (rotor, stator) = (train(&[surface, rotor], End::Free), train(&[surface], End::Fixed));
    let mut brake = System {
        radius: RADIUS,
        ..pair(rotor, stator, Pressing::Force(Drive::Value(force)), law(decay))
    };
    brake.initial.rotor_speed = vec![x; 2];
    let states = Modes::linear(&brake).states;
    let find = |name: &str, x: Option<f64>| {
        let is_it = |state: &&SystemState| state.state == name && state.relative_velocity == x;
        let mut found = states.iter().filter(is_it);
        found.next().expect("the state").clone()
    };
    (find("stick", None), find("slip", Some(x)))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Stick: (k - I w^2)(2k - 2J w^2) = k^2, and damping proportional to stiffness gives each mode c w/(2k). The
    /// rotor turns on both springs in series, the surfaces with inertia 2J on two springs.
    #[test]
    fn analytic_stick_modes((torsion, decay) in torsions()) {
        let Torsion { rotor_inertia: i, surface_inertia: j, stiffness: k, damping: c } = torsion;
        let (a, b) = (2.0 * i * j, -2.0 * k * (i + j));
        let root = (b * b - 4.0 * a * k * k).sqrt();
        let fast = ((-b + root) / (2.0 * a)).sqrt();
        // The product of both squares is k^2/a: no cancellation.
        let slow = k / a.sqrt() / fast;
        let (stick, _) = stick_and_slip(&torsion, decay, 2000.0, 3.0);
        for (name, omega) in [("surfaces", fast), ("rotor", slow)] {
            let mode = named(&stick, name);
            prop_assert!(close(mode.natural_frequency.unwrap(), omega / TAU, 1e-8), "{name}: {mode:?}");
            prop_assert!((mode.damping_ratio.unwrap() - c * omega / (2.0 * k)).abs() < 1e-8, "{name}: {mode:?}");
        }
        // The surfaces move as one.
        for mode in &stick.modes {
            prop_assert_eq!(mode.shape[1].amplitude, mode.shape[2].amplitude);
        }
    }

    /// Slip without a slope of friction: the stator's surface alone, and the rotor's surface against the rotor with
    /// w^2 = k (1/I + 1/J); each damped by c w/(2k).
    #[test]
    fn analytic_slip_modes_without_slope((torsion, _) in torsions()) {
        let Torsion { rotor_inertia: i, surface_inertia: j, stiffness: k, damping: c } = torsion;
        let (_, slip) = stick_and_slip(&torsion, 0.0, 2000.0, 3.0);
        for (name, omega) in [("stator surface", (k / j).sqrt()), ("rotor surface", (k / i + k / j).sqrt())] {
            let mode = named(&slip, name);
            prop_assert!(close(mode.natural_frequency.unwrap(), omega / TAU, 1e-8), "{name}: {mode:?}");
            prop_assert!((mode.damping_ratio.unwrap() - c * omega / (2.0 * k)).abs() < 1e-8, "{name}: {mode:?}");
        }
    }

    /// Slip of a very heavy rotor: J x'' + (c_t - 2 r F_n alpha (mu_s - mu_d) exp(-alpha x)) x' + k_t x = 0 for the
    /// relative mode, c_t alone for the common mode. The rotor's part is J/I, 1e-12 and less.
    #[test]
    fn analytic_relative_mode_of_a_heavy_rotor(
        (torsion, decay) in torsions(), x in 0.0..1.0f64, force in 100.0..3000.0f64,
    ) {
        let torsion = Torsion { rotor_inertia: 1e10, ..torsion };
        let Torsion { surface_inertia: j, stiffness: k, damping: c, .. } = torsion;
        let slope = -2.0 * RADIUS * force * law(decay).coefficient_and_slope(x).1;
        let ratio = (c - slope) / (2.0 * (k * j).sqrt());
        // Complex roots, and a coupling that identifies the modes.
        prop_assume!(ratio.abs() < 0.99 && slope > 1e-3);
        let (_, slip) = stick_and_slip(&torsion, decay, force, x);
        let relative = named(&slip, "relative");
        prop_assert!(close(relative.natural_frequency.unwrap(), (k / j).sqrt() / TAU, 1e-7), "{relative:?}");
        prop_assert!((relative.damping_ratio.unwrap() - ratio).abs() < 1e-7, "{relative:?} against {ratio}");
        let common = named(&slip, "common");
        prop_assert!((common.damping_ratio.unwrap() - c / (2.0 * (k * j).sqrt())).abs() < 1e-7, "{common:?}");
    }
}

/// Each shape is an eigenvector: A v = lambda v in the equation of the rotor, I theta'' = -T_r, of a stick mode.
#[test]
fn analytic_shape_satisfies_the_rotor_equation() {
    let case = built_in("paper", &[]);
    let Torsion {
        rotor_inertia: i,
        stiffness: k,
        damping: c,
        ..
    } = disks(&case).torsion;
    let states = modes_of(&case).states;
    for mode in &states.iter().find(|state| state.state == "stick").unwrap().modes {
        let part = |k: usize| {
            let s = &mode.shape[k];
            nalgebra::Complex::from_polar(s.amplitude, s.phase)
        };
        let lambda = nalgebra::Complex::new(mode.growth_rate, mode.angular_frequency);
        let (rotor, surface) = (part(0), part(1));
        // Velocities w: lambda I w_r = -(c + k/lambda)(w_r - w_s).
        let residual = lambda * i * rotor + (rotor - surface) * (nalgebra::Complex::from(c) + k / lambda);
        let size = (lambda * i * rotor).norm() + (rotor * k / lambda).norm();
        assert!(residual.norm() < 1e-9 * size, "{}: {residual}", mode.name);
    }
}

/// The critical speed makes the margin zero, and the run loses its stability there. F_n is constant by then, because
/// the ringing after the ramp has decayed.
#[test]
fn analytic_critical_speed_is_that_of_the_run() {
    let case = built_in("paper", &[]);
    let modes = slowing_of(&case);
    let critical = modes.critical_speed.unwrap();
    let (slope, damping) = (
        disks(&case).friction.law.coefficient_and_slope(critical).1,
        disks(&case).torsion.damping,
    );
    let margin = damping + 2.0 * disks(&case).contact.radius * modes.normal_force * slope;
    assert!(margin.abs() < 1e-12 * damping, "{margin}");
    let lost = modes.instability.unwrap();
    // The event is located to 1e-12 s at a deceleration of 16 rad/s^2.
    assert!((lost.relative_velocity - critical).abs() < 1e-9, "{lost:?}");
    let (recorder, _) = run(&disks(&case), &case.solver, &output(6.98, 1.0));
    let events = recorder.events;
    let event = events.iter().find(|e| e.kind == EventKind::Destabilised).unwrap();
    // The runs end at different times, which shifts their steps.
    assert!((lost.time - event.time).abs() < 1e-11, "{lost:?}");
}

/// At the eigenvalue crossing the fast pair of the slip state is neutral, 0.1 ms from the zero of the margin.
#[test]
fn analytic_eigenvalue_crossing_is_neutral() {
    for name in ["paper", "paper-si"] {
        let case = built_in(name, &[]);
        let modes = slowing_of(&case);
        let lost = modes.instability.unwrap();
        let crossing = lost.eigenvalue_crossing.unwrap();
        assert_eq!(modes.stability, Stability::Lost);
        let apart = (crossing.time - lost.time).abs();
        assert!(apart > 5e-5 && apart < 2e-4, "{name}: {apart:e}");
        let Exponential { decay, .. } = *disks(&case).friction.law.as_exponential().unwrap();
        let force = lost.normal_force * disks(&case).contact.radius / RADIUS;
        let (_, slip) = stick_and_slip(&disks(&case).torsion, decay, force, crossing.relative_velocity);
        let growth = named(&slip, "relative").growth_rate;
        // 1e-10 of a frequency of 26,000 rad/s.
        assert!(growth.abs() < 3e-6, "{name}: {growth:e}");
        let found = lost.growth_rate;
        assert!(found < -1.0, "stable still where the margin is zero: {found}");
    }
}

#[test]
fn analytic_onset_is_laid_to_what_decides_it() {
    let decided = |name: &str, overrides: &[&str]| {
        let lost = slowing_of(&built_in(name, overrides)).instability.unwrap();
        lost.onset_decided_by
    };
    assert_eq!(decided("paper", &[]), OnsetDecision::Perturbation);
    assert_eq!(decided("unperturbed", &[]), OnsetDecision::Rounding);
    // So little damping is missing that nothing has time to grow.
    let mild = ["perturbation=[]", "torsion.damping=348 N m s/rad"];
    assert_eq!(decided("paper", &mild), OnsetDecision::SmoothSliding);
}

#[test]
fn analytic_sliding_that_stays_stable_is_called_so() {
    let stability = |overrides: &[&str]| {
        let modes = slowing_of(&built_in("paper", overrides));
        assert_eq!(modes.instability, None);
        modes.stability
    };
    assert_eq!(stability(&["friction.decay=0"]), Stability::FrictionDoesNotFall);
    let rising = ["friction.low_speed=0.2"];
    assert_eq!(stability(&rising), Stability::FrictionDoesNotFall);
    let found = stability(&["torsion.damping=400 N m s/rad"]);
    assert_eq!(found, Stability::DampingSuffices);
    assert_eq!(stability(&["output.end_time=1"]), Stability::NotReached);
}
