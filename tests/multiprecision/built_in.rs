//! The built-in cases of rotor and stator by every kind of method, and certificates of others, against the oracle.

use crate::common::cases::{self, built_in, by, from_truth, parsed, recorded, source, truth, written};
use crate::common::cli::says;
use num_rational::BigRational;
use num_traits::{One, ToPrimitive, Zero};
use std::time::{Duration, Instant};
use stickslip::analysis::Certificate;
use stickslip::analysis::certificate::Verdict;
use stickslip::case::CaseSource;
use stickslip::case::builtin::TRAINS;
use stickslip::model::Mode;
use stickslip::record::{EventKind, MemoryRecorder};
use stickslip::simulation::Method;

fn rational(value: f64) -> BigRational {
    BigRational::from_float(value).unwrap()
}

/// Bounds of each method, s: errors of all events of a run.
const METHODS: [(Method, f64, f64); 6] = [
    (Method::Arkode, 1e-10, 1e-9),
    (Method::Arkode, 1e-13, 1e-11),
    (Method::Series, 1e-10, 1e-12),
    (Method::Cvode, 1e-10, 5e-12),
    (Method::CvodeBdf, 1e-12, 1e-7),
    (Method::Erk, 1e-12, 1e-9),
];

#[test]
fn multiprecision_every_built_in_case_by_every_kind_of_method() {
    for name in TRAINS.iter().map(|case| case.name) {
        // Bristles of 1e5 per metre limit the oracle to steps of microseconds.
        let settings = if name == "lugre-slider" {
            &["output.end_time=12"][..]
        } else {
            &[]
        };
        let case = built_in(name, settings);
        let truth = truth((&CaseSource::built_in(name).unwrap(), &parsed(settings)), &case, 20).unwrap();
        println!("{name}: {} events", truth.report.events.len());
        for (method, rtol, bound) in METHODS {
            let label = format!("{name} by {} at {rtol:e}", method.name());
            let mut case = by(&case, method);
            case.solver.rtol = rtol;
            let events = recorded(&case).events;
            let worst = from_truth(&label, &events, &truth);
            println!("  {label}: {worst:e}");
            assert!(worst <= bound, "{label}: {worst:e} s");
            for (event, exact) in events.iter().zip(&truth.report.events) {
                assert_eq!(event.mode_after, exact.mode_after, "{label} at {}", event.time);
            }
        }
    }
}

/// A run of a case, and its certificate with this many digits.
fn certified(text: &str, changes: &[&str], digits: u32) -> (MemoryRecorder, Certificate) {
    let (_, record, certified) = cases::certified(&source(text), &parsed(changes), digits);
    (record, certified.certificate)
}

fn channel(certificate: &Certificate, name: &str) -> usize {
    let mut channels = certificate.bands.channels.iter();
    channels.position(|channel| channel.name == name).unwrap()
}

/// The double of 2.3 is below 2.3, where the force has its last corner. The oracle has the corner nevertheless.
#[test]
fn multiprecision_a_corner_at_the_end_is_certified() {
    let text = r#"
motion = "translation"
rotor = { end = "driven", speed = 1.0 }
stator = { end = "fixed", inertia = 1.0, stiffness = 100.0 }
contact = { normal_force = { profile = "table", time = [0.0, 2.3], value = [10.0, 12.0] } }
friction = { law = "coulomb", breakaway = 0.6, kinetic = 0.3 }
output = { end_time = 2.3, interval = 0.1 }
"#;
    // A corner beyond the end is no event of the run, even if it is beyond by less than rounding.
    for (changes, events) in [(&[][..], 1), (&["output.end_time=2.2999999999999994"][..], 0)] {
        let (_, certificate) = certified(text, changes, 18);
        assert_eq!(certificate.events.len(), events);
        let expected = Verdict::Converged;
        assert_eq!(certificate.verdict, expected, "{changes:?}: {:?}", certificate.events);
        assert!(certificate.least_digits().is_none_or(|digits| digits >= 15));
    }
}

/// A regularised contact, and a kick that takes |omega_r| below or above its threshold: an event of every method and
/// of the oracle, at the time of the kick.
#[test]
fn multiprecision_a_kick_across_the_threshold_is_an_event() {
    let text = |kick: &str| {
        format!(
            r#"
motion = "translation"
rotor = {{ end = "fixed", inertia = [0.1476], stiffness = [47610.0], damping = [0.4652] }}
stator = {{ end = "fixed", inertia = [1.217, 0.05479], stiffness = [19220.0, 26310.0], damping = [5.133, 3.537],
    viscous = [2.043, 0.3146], torque = {{ profile = "cosine", amplitude = 1.16, angular_frequency = 69.34, phase = 0.6038 }}, torque_on = 0 }}
contact = {{ normal_force = 1.564 }}
friction = {{ law = "polynomial", low_speed = 0.4114, linear = -86.29, quadratic = 8087.0, cubic = 1.494,
    valid_below = 0.3805, regularisation = {{ function = "arctan", speed = 0.0007724 }}, threshold = 0.0007411 }}
output = {{ end_time = 0.06583, interval = 0.00159 }}
perturbation = [{{ kind = "kick", {kick} }}]
"#
        )
    };
    for (kick, crossing) in [
        ("time = 0.03922, relative_velocity = -0.008742", EventKind::Stick),
        ("time = 0.0185, relative_velocity = 0.01", EventKind::Slip),
    ] {
        let (record, certificate) = certified(&text(kick), &[], 18);
        let mut events = record.events.iter();
        let at = events.position(|event| event.kind == EventKind::Kick).unwrap();
        let [kick, next] = &record.events[at..=at + 1] else {
            panic!()
        };
        assert_eq!((next.kind, next.time), (crossing, kick.time));
        assert_eq!(certificate.verdict, Verdict::Converged, "{:?}", certificate.events);
        // Sticks and slips alternate.
        let kinds = record.events.iter().map(|event| event.kind);
        let kinds: Vec<_> = kinds.filter(|kind| *kind != EventKind::Kick).collect();
        assert!(kinds.windows(2).all(|pair| pair[0] != pair[1]), "{kinds:?}");
        for rung in &certificate.ladder {
            assert_eq!((rung.agreeing, rung.events), (kinds.len(), kinds.len()), "{rung:?}");
        }
    }
}

fn sine(x: &BigRational) -> BigRational {
    let (mut sum, mut term) = (BigRational::zero(), x.clone());
    let mut n = BigRational::one();
    for _ in 0..24 {
        sum += &term;
        let next = &n + BigRational::one();
        n = &next + BigRational::one();
        term = -term * x * x / (next * &n);
    }
    sum
}

/// A harmonic normal force that opens the contact soon, and until then is far smaller than its mean and amplitude. All
/// methods share its zero and its values; the effect of their rounding is in the ladder's uncertainty and in the
/// bands.
#[test]
fn multiprecision_a_ladder_covers_the_rounding_of_the_normal_force() {
    let text = r#"
motion = "translation"
rotor = { end = "free", inertia = [1.328] }
stator = { end = "fixed", inertia = [0.8118], stiffness = [7324.0], damping = [4.818] }
contact = { normal_force = { profile = "sine", mean = 1.592, amplitude = 2.222, angular_frequency = 0.6514, phase = -2.498 } }
friction = { law = "coulomb", breakaway = 0.4498, kinetic = 0.3688 }
initial = { speed = 0.1307 }
output = { end_time = 0.5, interval = 0.001 }
"#;
    let (record, certificate) = certified(text, &[], 18);
    assert_eq!(certificate.verdict, Verdict::Converged);
    let mut events = certificate.events.iter();
    let separation = events.find(|event| event.kind == "separation").unwrap();
    let error = separation.true_error.unwrap().abs();
    assert!(error <= separation.ladder_uncertainty, "{separation:?}");
    // The force is known to some 1e-15 N, and falls by 1 N/s.
    assert!(error < 3e-15, "{separation:?}");
    let column = channel(&certificate, "normal_force");
    let [mean, amplitude, omega, phase] = [1592, 2222, 6514, -2498].map(|n| BigRational::from_integer(n.into()));
    let [thousand, ten_thousand] = [1000, 10_000].map(|n| BigRational::from_integer(n.into()));
    let mut checked = 0;
    let rows = record.samples.iter().enumerate();
    for (index, row) in rows.filter(|(_, row)| row.time < separation.time) {
        let angle = &omega / &ten_thousand * rational(row.time) + &phase / &thousand;
        let exact = (&mean + &amplitude * sine(&angle)) / &thousand;
        let error = (rational(record.values(index)[column]) - exact).to_f64().unwrap().abs();
        let mut stretches = certificate.bands.stretches.iter();
        let stretch = stretches.find(|stretch| row.time < stretch.end).unwrap();
        let band = stretch.at_fixed_time(column);
        assert!(error <= band, "{}: {error:e}, band {band:e}", row.time);
        checked += 1;
    }
    assert!(checked > 200, "{checked}");
}

/// Bristles of an open contact have no deflection.
#[test]
fn analytic_bristles_are_at_rest_while_the_contact_is_open() {
    let text = r#"
rotor = { end = "driven", inertia = [2.4], stiffness = [1784.0], damping = [0.606], speed = 0.928 }
stator = { end = "fixed", inertia = [9.408], stiffness = [269.4], damping = [1.942] }
contact = { normal_force = { profile = "sine", mean = 1381.0, amplitude = 1517.0, angular_frequency = 5.32 },
    radius = 0.07031 }
friction = { law = "lugre", low_speed = 0.5604, high_speed = 0.2474, scale = 0.9173, bristle_stiffness = 9.44,
    exponent = 1, bristle_damping = 0.1208 }
output = { end_time = 1.5, interval = 0.01 }
"#;
    let (record, certificate) = certified(text, &[], 18);
    assert_eq!(certificate.verdict, Verdict::Converged);
    let column = channel(&certificate, "bristle_deflection");
    let deflection = |index: usize| record.values(index)[column];
    let rows = 0..record.samples.len();
    let is_open = |index: &usize| record.samples[*index].mode == Mode::Separated;
    let open: Vec<usize> = rows.clone().filter(is_open).collect();
    assert!(open.len() > 10, "{}", open.len());
    assert!(open.iter().all(|index| deflection(*index) == 0.0));
    assert!(rows.clone().any(|index| deflection(index).abs() > 1e-3));
}

/// The wall time that a case allows a run also limits the oracle, which would take far longer for this many digits.
#[test]
#[ignore = "takes half a minute"]
fn property_the_oracle_keeps_to_the_wall_time_of_the_case() {
    let source = CaseSource::built_in("groan").unwrap();
    let clock = Instant::now();
    let (_, certificate) = certified(&source.text, &["solver.method=series", "solver.max_wall_time=3"], 400);
    let why = certificate.without_oracle.expect("no oracle");
    says(&why, &["is allowed 3.0 s", "--max-wall-time"]);
    // Three seconds for the oracle, and the runs of the ladder; the rest is for a machine with other load.
    assert!(clock.elapsed() < Duration::from_secs(60), "{:?}", clock.elapsed());
}

/// A mass on a belt, and a flywheel on ground that is shaken.
const SATURATED: [&str; 2] = [
    r#"
title = "a mass on a belt"
motion = "translation"
rotor = { end = "driven", speed = 1.0 }
stator = { end = "fixed", inertia = 1.0, stiffness = 100.0 }
contact = { normal_force = 10.0 }
friction = { law = "coulomb", kinetic = 0.3, regularisation = { function = "tanh", speed = 0.01 } }
initial = { stator_speed = -1.0 }
output = { end_time = 5.0, interval = 0.1 }
"#,
    r#"
title = "a shaken flywheel"
rotor = { end = "fixed" }
stator = { end = "fixed", inertia = 0.5184, stiffness = 50230.0, damping = 4.335,
    torque = { profile = "cosine", amplitude = 26.33, angular_frequency = 299.7, phase = 0.8195 } }
contact = { normal_force = 193.1, radius = 0.1732 }
friction = { law = "coulomb", kinetic = 0.2882, regularisation = { function = "tanh", speed = 0.01068 },
    threshold = 0.00492 }
output = { end_time = 0.1928, interval = 0.005 }
"#,
];

/// Far from rest tanh is 1 to all digits, and none of its coefficients shows the side on which it is not. No step of
/// the series goes there.
#[test]
fn multiprecision_a_saturated_tanh() {
    for text in SATURATED {
        let case = by(&written(text, &[]), Method::Series);
        let truth = truth((&source(text), &[]), &case, 20).unwrap();
        let worst = from_truth(text, &recorded(&case).events, &truth);
        // Some roundings in each of up to 500 steps.
        assert!(worst < 1e-13, "{worst:e} s");
    }
}
