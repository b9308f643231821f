//! The attractor of a run without events, or without a period: against closed forms, and against integrators that
//! share nothing with this program.

use crate::common::cases::{attractor, near, parsed, summary};
use std::f64::consts::TAU;
use stickslip::analysis::{Neighbours, Outcome, Summary};
use stickslip::case::{Case, CaseSource, Origin};

/// A mass of 1 on a spring of 1 on a belt, pressed by 1.
fn belt(speed: f64, friction: &str, stator: &str, end: f64) -> String {
    format!(
        "motion = \"translation\"\nrotor = {{ end = \"driven\", speed = {speed:?} }}\ncontact = {{ normal_force = 1.0 }}\n\
         friction = {{ {friction} }}\noutput = {{ end_time = {end:?}, interval = 10.0 }}\n[stator]\ninertia = 1.0\n\
         stiffness = 1.0\nend = \"fixed\"\n{stator}\n"
    )
}

fn run(text: &str, changes: &[&str]) -> Summary {
    let source = CaseSource {
        text: text.to_owned(),
        origin: Origin::File("case.toml".into()),
    };
    summary(&Case::read(&source, &parsed(changes)).unwrap())
}

/// Friction does not depend on speed: a belt at 5 m/s leaves a linear oscillator about x = 0.3.
const COULOMB: &str = "law = \"coulomb\", breakaway = 0.3, kinetic = 0.3";

/// mu = 1.5 - 1.5 x + 0.45 x^3.
const POLYNOMIAL: &str =
    "law = \"polynomial\", breakaway = 1.5, low_speed = 1.5, linear = -1.5, cubic = 0.45, valid_below = 10.0";

/// mu falls from 1 to 0.4.
const FALLING: &str = "law = \"exponential\", breakaway = 1.0, low_speed = 1.0, high_speed = 0.4, decay = 1.4";

fn harmonic(shape: &str, amplitude: f64, frequency: &str) -> String {
    format!("{{ profile = \"{shape}\", amplitude = {amplitude:?}, {frequency} }}")
}

/// The amplitude is F/|1 - omega^2 + i c omega|. At resonance a sine leaves no speed at whole periods.
#[test]
fn analytic_a_forced_oscillator_has_the_period_of_its_forcing() {
    for (shape, omega) in [("cosine", 0.7), ("sine", 1.0), ("sine", 2.3)] {
        let torque = harmonic(shape, 0.1, &format!("angular_frequency = {omega:?}"));
        let text = belt(5.0, COULOMB, &format!("damping = 0.1\ntorque = {torque}"), 600.0);
        for method in ["cvode", "series"] {
            let summary = run(&text, &[&format!("solver.method={method}")]);
            let found = attractor(&summary);
            assert_eq!(found.period, TAU / omega, "{method}");
            assert_eq!((found.forcing_periods, found.sections, found.sticks), (Some(1), 1, 0));
            let response = (1.0f64 - omega * omega).hypot(0.1 * omega);
            let extremes = found.extremes.as_ref().unwrap();
            let error = extremes.amplitude.unwrap() - 0.1 / response;
            assert!(error.abs() < 1e-9, "{method} {omega}: {error:e}");
            // e^(-0.05 t) is a millionth of the state 276 s after the start, and not yet at half that time.
            assert!((130.0..500.0).contains(&found.since), "{}", found.since);
        }
    }
}

#[test]
fn analytic_two_harmonics_have_their_common_period() {
    let both = |a: &str, b: &str| {
        let signals = [harmonic("cosine", 0.1, a), harmonic("sine", 0.2, b)].join(", ");
        let torque = format!("damping = 0.1\ntorque = {{ profile = \"sum\", signals = [{signals}] }}");
        run(&belt(5.0, COULOMB, &torque, 900.0), &[])
    };
    let in_radians = both("angular_frequency = 0.7", "angular_frequency = 0.5");
    let period = attractor(&in_radians).period;
    assert!((period - 10.0 * TAU).abs() < 1e-12, "{period}");
    let in_hertz = both("frequency = 0.1", "frequency = 0.15");
    assert!((attractor(&in_hertz).period - 20.0).abs() < 1e-12);
    // The first harmonic ends, and only the second continues.
    let one_ends = both("frequency = 0.1, to = 300.0", "frequency = 0.15");
    let found = attractor(&one_ends);
    assert!((found.period - 1.0 / 0.15).abs() < 1e-12 && found.since > 300.0);
    let without = both("angular_frequency = 0.7", "frequency = 0.1");
    assert!(without.attractor().is_none());
}

/// Without damping the oscillation goes on for ever: x = 0.3 (1 - cos t).
#[test]
fn analytic_a_free_oscillation_has_its_own_period() {
    let summary = run(&belt(5.0, COULOMB, "", 600.0), &[]);
    let found = attractor(&summary);
    assert!((found.period - TAU).abs() < 1e-10, "{}", found.period);
    assert_eq!((found.forcing_periods, found.sections, found.sticks), (None, 1, 0));
    let extremes = found.extremes.as_ref().unwrap();
    assert!((extremes.amplitude.unwrap() - 0.3).abs() < 1e-9);
    // The period is found from the middle of the run.
    assert!((300.0..330.0).contains(&found.since), "{}", found.since);
}

#[test]
fn analytic_a_damped_oscillator_comes_to_steady_sliding() {
    // On a slow belt the oscillator has stuck before.
    for (speed, events) in [(5.0, 0), (0.1, 2)] {
        let summary = run(&belt(speed, COULOMB, "damping = 0.1", 600.0), &[]);
        assert_eq!(summary.events, events);
        let steady = Outcome::Steady {
            mode: "slip-forward",
            constant: true,
        };
        assert_eq!(summary.outcome, Some(steady));
    }
    // A shorter run does not reach steady sliding.
    let summary = run(&belt(0.1, COULOMB, "damping = 0.1", 150.0), &[]);
    assert_eq!(summary.outcome, Some(Outcome::NotPeriodic));
}

/// The start is 1e-9 m away from steady sliding, which is unstable: deviations grow by e^(0.075 t).
#[test]
fn analytic_sliding_from_which_the_motion_departs_is_not_steady() {
    let beside = belt(1.0, POLYNOMIAL, "", 80.0) + "[initial]\nstator_twist = 0.450000001\n";
    let summary = run(&beside, &[]);
    let departing = Outcome::Steady {
        mode: "slip-forward",
        constant: false,
    };
    assert_eq!(summary.outcome, Some(departing));
}

/// The attractor takes four periods of the forcing, by DOP853 at rtol 1e-12 (SciPy) over 1200 periods: its states
/// differ by 1e-11 after four periods, and by 0.3 and more after one or two. It sticks twice, in the transient.
#[test]
fn analytic_a_forced_belt_has_four_periods_of_the_forcing() {
    let torque = harmonic("cosine", 0.1, "angular_frequency = 1.709");
    let text = belt(1.0, POLYNOMIAL, &format!("torque = {torque}"), 3000.0);
    let summary = run(&text, &["solver.method=series"]);
    let found = attractor(&summary);
    assert_eq!(found.period, 4.0 * TAU / 1.709);
    assert_eq!((found.forcing_periods, found.sections, found.sticks), (Some(4), 4, 0));
    assert_eq!((summary.sticks, summary.slips), (2, 2));
    let extremes = found.extremes.as_ref().unwrap();
    let (position, velocity) = (extremes.position, extremes.relative_velocity);
    let ours = [position.0, position.1, velocity.0, velocity.1];
    let theirs = [0.059226708, 2.222638071, 0.012613929, 1.853749701];
    for (ours, theirs) in ours.into_iter().zip(theirs) {
        // The last digit, and the distance from the attractor.
        assert!((ours - theirs).abs() < 1e-9 + 3.0 * found.distance, "{ours} {theirs}");
    }
    assert!(summary.exponent.is_none());
}

/// Each breakaway is at x = 1 + 0.2 cos(1.1 t) with the speed of the belt, so that the phases of breakaways form a map
/// of the circle to itself. By Runge-Kutta steps (NumPy) its exponent over the mean time of return is 0.0195 1/s, from
/// 200,000 breakaways for each of three starts, which differ by 1.4e-4. At 0.3 rad/s the map has an inverse and does
/// not lock.
#[test]
fn analytic_the_exponent_is_that_of_the_map_of_breakaways() {
    let forced = |omega: f64| {
        let torque = harmonic("cosine", 0.2, &format!("angular_frequency = {omega:?}"));
        let text = belt(0.5, FALLING, &format!("torque = {torque}"), 3000.0);
        run(&text, &["solver.method=series"])
    };
    let chaotic = forced(1.1);
    assert_eq!(chaotic.outcome, Some(Outcome::NotPeriodic));
    let exponent = chaotic.exponent.expect("long enough");
    near(exponent.value, 0.0195, 3.0 * exponent.uncertainty);
    assert!((5e-4..4e-3).contains(&exponent.uncertainty), "{exponent:?}");
    assert_eq!(exponent.neighbours(), Neighbours::Part);
    let quasi_periodic = forced(0.3).exponent.expect("long enough");
    assert_eq!(quasi_periodic.neighbours(), Neighbours::Stay);
    assert!(quasi_periodic.value.abs() < 3e-4, "{quasi_periodic:?}");
}
