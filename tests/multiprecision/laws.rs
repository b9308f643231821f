//! Every friction law on the paper's brake against the oracle: `arkode` by default and at rtol 1e-13, `series`, and
//! the certificate.
//!
//! The brake is `paper-si` from a low speed, so that the oracle takes a second. Its first stick comes at the end of an
//! instability or, if the law has none, at the end of sliding. A kick in stick-slip, or a release of the force, makes
//! it slip again.

use crate::common::cases::{errors, exact_events, recorded, source, written};
use crate::common::random_brakes::Random;
use std::ops::ControlFlow;
use stickslip::Run;
use stickslip::analysis::Certify;
use stickslip::analysis::linearised::linearise;
use stickslip::case::{Case, CaseSource, Override, WrittenCase};
use stickslip::friction::FrictionLaw;
use stickslip::oracle::{self, OracleError, OracleOptions, rational};
use stickslip::record::EventKind;
use stickslip::simulation::natural_period;

/// Multiple of the effect of rounding on an event that a method may add by its own arithmetic.
const OF_ROUNDING: f64 = 100.0;

/// If rounding may move an event by more than this share of the natural period, its place in the oscillation is
/// unknown.
const ILL_CONDITIONED: f64 = 0.02;

fn overrides(friction: &str, more: &[&str]) -> Vec<Override> {
    let base = [
        "initial.speed=3",
        "actuation={profile=\"ramp\", force=2225, rise_time=0.02}",
        "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
        "output={end_time=0.4, interval=0.01}",
    ];
    let friction = format!("friction={friction}");
    let all = base.into_iter().chain([friction.as_str()]).chain(more.iter().copied());
    all.map(|text| Override::parse(text).unwrap()).collect()
}

fn case(overrides: &[Override], more: &[&str]) -> Case {
    let more = more.iter().map(|text| Override::parse(text).unwrap());
    let all: Vec<Override> = overrides.iter().cloned().chain(more).collect();
    Case::read(&CaseSource::built_in("paper-si").unwrap(), &all).unwrap()
}

/// Largest effect of rounding on each event, s.
fn rounding(case: &Case) -> Vec<f64> {
    let linearised = linearise(&WrittenCase::of(case), None, &|| false).unwrap();
    linearised.events.iter().map(|event| event.rounding).collect()
}

/// Compares the methods with the oracle. Returns the number of events of the sequence, or `None` where rounding
/// decides.
fn hold(overrides: &[Override], what: &str) -> Option<usize> {
    let series = case(overrides, &["solver.method=series"]);
    let allowance = rounding(&series);
    let hardest = allowance.iter().copied().fold(0.0, f64::max);
    if OF_ROUNDING * hardest > ILL_CONDITIONED * natural_period(&series.system).unwrap() {
        println!("{what}: ill-conditioned, rounding moves an event by {hardest:.1e} s");
        return None;
    }
    let source = CaseSource::built_in("paper-si").unwrap();
    let exact = exact_events(&source, overrides, series.output.end_time, 38);
    for (settings, allowed) in [
        (&["solver.method=cvode"][..], 1e-9),
        (&["solver.method=arkode"][..], 1e-9),
        (&["solver.method=arkode", "solver.rtol=1e-13"][..], 1e-11),
        (&["solver.method=series"][..], 1e-12),
    ] {
        let recorder = recorded(&case(overrides, settings));
        let what = format!("{what}, {settings:?}");
        let mut worst = 0.0_f64;
        for (error, rounding) in errors(&what, &recorder.events, &exact).into_iter().zip(&allowance) {
            let allowed = f64::max(allowed, OF_ROUNDING * rounding);
            assert!(error <= allowed, "{what}: off by {error:.1e} s of {allowed:.1e}");
            worst = worst.max(error);
        }
        println!("{what}: {} events within {worst:.1e} s", exact.len());
    }
    Some(exact.iter().filter(|event| event.kind.in_event_sequence()).count())
}

/// Also compares the certificate, whose uncertainties must cover the distances from the oracle, and requires at least
/// this many events of the sequence.
fn hold_and_certify(friction: &str, more: &[&str], least: usize) {
    let overrides = overrides(friction, more);
    let events = hold(&overrides, friction).expect("well-conditioned");
    assert!(events >= least, "{friction}: {events} events");
    let source = CaseSource::built_in("paper-si").unwrap();
    let exact = Case::exact(&source, &overrides).unwrap();
    let case = case(&overrides, &[]);
    let result = recorded(&case);
    let start = Certify::new(&case).oracle(&exact, 25).start(&result).unwrap();
    let certificate = start.certificate;
    assert_eq!(certificate.contradiction, None, "{friction}");
    for event in &certificate.events {
        let error = event.true_error.expect("the oracle has it").abs();
        // The uncertainty of the methods' ladder, before the oracle.
        assert!(
            error <= event.ladder_uncertainty,
            "{friction}: off by {error:.1e} s, of {:.1e}",
            event.ladder_uncertainty
        );
    }
}

/// For laws without an instability: rising friction and a grip that is released and applied again, so that they slip
/// again.
const GRIP_AGAIN: &str = "actuation={profile=\"table\", time=[0, 0.02, 0.1, 0.12, 0.14, 0.16], \
                          force=[0, 2225, 2225, 300, 300, 2225]}";

/// A mass on a spring and on a belt that swings: slips and sticks of both senses, each by its own coefficients.
#[test]
fn multiprecision_asymmetric_on_a_belt_that_swings() {
    let text = r#"
title = "a belt that swings"
motion = "translation"
rotor = { end = "driven", speed = { profile = "cosine", amplitude = 0.4, frequency = 0.3 } }
stator = { inertia = 1.0, stiffness = 40.0, damping = 0.05, end = "fixed" }
contact = { normal_force = 10.0 }
friction = { law = "asymmetric", breakaway = 0.5, kinetic = 0.35, breakaway_backward = 0.3, kinetic_backward = 0.15 }
output = { end_time = 10.0 }
"#;
    let exact = exact_events(&source(text), &[], 10.0, 30);
    let senses: Vec<i8> = exact.iter().map(|event| event.mode_after.sense()).collect();
    assert!([-1, 0, 1].iter().all(|sense| senses.contains(sense)), "{senses:?}");
    for (method, allowed) in [
        ("series", 1e-11),
        ("cvode", 1e-8),
        ("arkode", 1e-8),
        ("cvode-bdf", 1e-6),
        ("esdirk", 1e-6),
    ] {
        let recorder = recorded(&written(text, &[&format!("solver.method={method}")]));
        let worst = errors(method, &recorder.events, &exact).into_iter().fold(0.0, f64::max);
        println!("{method}: {} events within {worst:.1e} s", exact.len());
        assert!(worst <= allowed, "{method}: {worst:.1e}");
    }
}

/// A block on a spring and on a rough floor under chirps, through its resonance in both directions: as the force on it,
/// as the motion of the floor, and as the force that presses them together.
#[test]
fn multiprecision_blocks_under_chirps() {
    let sweep = |from: f64, to: f64, more: &str| {
        format!(
            "{{ profile = \"chirp\", start_frequency = {from}, end_frequency = {to}, duration = 7.3, phase = 0.4, {more} }}"
        )
    };
    let case = |floor: &str, torque: &str, force: &str| {
        format!(
            r#"
motion = "translation"
rotor = {{ end = "driven", speed = {floor} }}
stator = {{ inertia = 1.0, stiffness = 40.0, damping = 0.5, end = "fixed", torque = {torque} }}
contact = {{ normal_force = {force} }}
friction = {{ law = "coulomb", breakaway = 0.5, kinetic = 0.3 }}
output = {{ end_time = 10.0 }}
"#
        )
    };
    for text in [
        case("0.0", &sweep(0.3, 2.5, "amplitude = 12.0"), "10.0"),
        case(&sweep(2.5, 0.3, "amplitude = 0.7, mean = 0.1"), "0.0", "10.0"),
        case("0.2", "0.0", &sweep(0.2, 1.9, "amplitude = 11.0, mean = 10.0")),
    ] {
        let exact = exact_events(&source(&text), &[], 10.0, 30);
        let corners = exact.iter().filter(|event| event.kind == EventKind::Corner);
        assert_eq!(corners.count(), 1, "{text}");
        assert!(exact.len() > 10, "{} events: {text}", exact.len());
        for (method, allowed) in [("series", 1e-12), ("cvode", 1e-8), ("erk", 1e-8), ("arkode", 1e-8)] {
            let recorder = recorded(&written(&text, &[&format!("solver.method={method}")]));
            let worst = errors(method, &recorder.events, &exact).into_iter().fold(0.0, f64::max);
            println!("{method}: {} events within {worst:.1e} s", exact.len());
            assert!(worst <= allowed, "{method}: {worst:.1e}: {text}");
        }
    }
}

/// The asymmetric brake turns backward first: friction differs from that of the stick that follows, and of the slip after
/// it. Stribeck's curve is Gaussian, flat at rest: sliding is unstable between two speeds, and stable below both; with other
/// exponents it is compared without a certificate. The polynomial falls and is flat at its end. With straight lines the
/// margin of stability jumps at the knots.
#[test]
fn multiprecision_every_law() {
    let again = &["initial.speed=1.5", "perturbation=[]", GRIP_AGAIN][..];
    let backward = &["initial.speed=-1.5", "perturbation=[]", GRIP_AGAIN];
    let asymmetric = "asymmetric\", breakaway=0.5, kinetic=0.4, breakaway_backward=0.45, kinetic_backward=0.3";
    let curve = "breakaway=0.6, low_speed=0.6, high_speed=0.3";
    let polynomial =
        "polynomial\", breakaway=0.6, low_speed=0.6, linear=-0.3, quadratic=0.1, cubic=-0.01, valid_below=4";
    for (law, more, least) in [
        ("coulomb\", breakaway=0.45, kinetic=0.3", again, 3),
        (asymmetric, backward, 3),
        (&format!("hyperbolic\", {curve}, scale=0.25"), &[], 3),
        (&format!("stribeck\", {curve}, scale=0.5, viscous=0.01"), &[], 1),
        (polynomial, &[], 1),
        (&format!("table\", breakaway=0.6, {TABLE}"), &[], 1),
        (
            &format!("table\", breakaway=0.6, {TABLE}, interpolation=\"linear\""),
            &[],
            1,
        ),
    ] {
        hold_and_certify(&format!("{{law=\"{law}}}"), more, least);
    }
    for exponent in [1, 3, 4] {
        let friction = format!("{{law=\"stribeck\", {curve}, scale=0.35, exponent={exponent}}}");
        assert!(hold(&overrides(&friction, &[]), &friction).expect("well-conditioned") >= 1);
    }
}

/// The paper's law by 16 points with curves between them.
const TABLE: &str = "speed=[0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1, 1.25, 1.5, 2, 2.5, 4], \
                     coefficient=[0.6, 0.552, 0.511, 0.477, 0.449, 0.405, 0.374, 0.352, 0.337, 0.318, 0.309, \
                     0.304, 0.302, 0.3005, 0.3, 0.3]";

/// Where the law ends the run ends, at the time and the speed that the oracle finds.
#[test]
fn multiprecision_beyond_the_polynomial() {
    let overrides = overrides(
        "{law=\"polynomial\", breakaway=0.6, low_speed=0.6, linear=-0.1, valid_below=3.5}",
        &["perturbation=[{time=0.0123, relative_velocity=0.8}]"],
    );
    for method in ["arkode", "series", "cvode", "paper"] {
        let case = case(&overrides, &[&format!("solver.method={method}")]);
        let failure = Run::new(&case).start().unwrap_err();
        let message = failure.to_string();
        for words in [
            "t = 0.0123",
            "3.",
            "valid below 3.5 rad/s",
            "friction.valid_below",
            "slip-forward",
        ] {
            assert!(message.contains(words), "{method}: {words} in {message}");
        }
    }
    let exact = Case::exact(&CaseSource::built_in("paper-si").unwrap(), &overrides)
        .unwrap()
        .system;
    let options = OracleOptions {
        digits: 30,
        end_time: rational("0.4").unwrap(),
        ..OracleOptions::default()
    };
    let error = oracle::run(&exact, &options, &mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(
        matches!(error, OracleError::BeyondLaw(time) if time == 0.0123),
        "{error}"
    );
}

/// A law of a kind (0 to 5) by a number, with parameters near the paper's.
fn random_law(kind: usize, index: u64) -> String {
    let mut random = Random(2_000_000 + 100 * kind as u64 + index);
    let (low, high) = (random.within(0.5, 0.6), random.within(0.2, 0.4));
    let drop = low - high;
    match kind {
        0 => format!("{{law=\"coulomb\", breakaway={low:.6}, kinetic={high:.6}}}"),
        1 => format!(
            "{{law=\"hyperbolic\", breakaway=0.6, low_speed={low:.6}, high_speed={high:.6}, scale={:.6}}}",
            random.within(0.1, 0.5)
        ),
        2 => format!(
            "{{law=\"stribeck\", breakaway=0.6, low_speed={low:.6}, high_speed={high:.6}, scale={:.6}, exponent={}, \
             viscous={:.6}}}",
            random.within(0.2, 0.7),
            1 + index % 4,
            random.within(0.0, 0.02)
        ),
        3 => {
            // low - drop (3 u - 3 u^2 + u^3), u = x/end
            let end = random.within(3.2, 4.0);
            format!(
                "{{law=\"polynomial\", breakaway=0.6, low_speed={low:.6}, linear={:.6}, quadratic={:.6}, cubic={:.6}, \
                 valid_below={end:.6}}}",
                -3.0 * drop / end,
                3.0 * drop / end.powi(2),
                -drop / end.powi(3),
            )
        }
        _ => {
            let (mut x, mut points) = (0.0, Vec::new());
            let decay = random.within(2.5, 6.0);
            while x < 3.5 {
                points.push((x, high + drop * (-decay * x).exp()));
                x += random.within(0.05, 0.1) + 0.2 * x;
            }
            let list = |part: fn(&(f64, f64)) -> f64| {
                let texts: Vec<String> = points.iter().map(|point| format!("{:.6}", part(point))).collect();
                texts.join(", ")
            };
            let interpolation = ["monotone-cubic", "linear"][kind - 4];
            format!(
                "{{law=\"table\", breakaway=0.6, speed=[{}], coefficient=[{}], interpolation=\"{interpolation}\"}}",
                list(|point| point.0),
                list(|point| point.1)
            )
        }
    }
}

/// Six brakes of each law, with kicks of 1e-6 to 1e-2 rad/s.
#[test]
#[ignore = "takes minutes"]
fn multiprecision_random_laws() {
    for kind in 0..6 {
        let mut conditioned = 0;
        for index in 0..6 {
            let friction = random_law(kind, index);
            let kick = 10f64.powf(Random(index).within(-6.0, -2.0));
            let kick = format!("perturbation=[{{time=\"instability\", relative_velocity={kick:.6e}}}]");
            let more = if kind == 0 { [GRIP_AGAIN] } else { [kick.as_str()] };
            conditioned += usize::from(hold(&overrides(&friction, &more), &friction).is_some());
        }
        assert!(conditioned >= 4, "{kind}: {conditioned}");
    }
}

/// The oracle has every law of the program.
#[test]
fn multiprecision_the_oracle_has_every_law() {
    for name in FrictionLaw::NAMES {
        assert!(
            EXAMPLES
                .iter()
                .any(|example| example.contains(&format!("law=\"{name}\""))),
            "{name}"
        );
    }
    for example in EXAMPLES {
        let overrides = overrides(example, &["output.end_time=1e-3"]);
        let events = exact_events(&CaseSource::built_in("paper-si").unwrap(), &overrides, 1e-3, 20);
        assert!(events.is_empty());
    }
}

const EXAMPLES: &[&str] = &[
    "{law=\"exponential\", breakaway=0.6, low_speed=0.6, high_speed=0.3, decay=3.5}",
    "{law=\"coulomb\", breakaway=0.6, kinetic=0.3}",
    "{law=\"asymmetric\", breakaway=0.6, kinetic=0.3, breakaway_backward=0.4, kinetic_backward=0.2}",
    "{law=\"hyperbolic\", breakaway=0.6, low_speed=0.6, high_speed=0.3, scale=0.25}",
    "{law=\"stribeck\", breakaway=0.6, low_speed=0.6, high_speed=0.3, scale=0.5, viscous=0.01}",
    "{law=\"polynomial\", breakaway=0.6, low_speed=0.6, linear=-0.3, quadratic=0.1, cubic=-0.01, valid_below=4}",
    "{law=\"table\", breakaway=0.6, speed=[0, 1, 2], coefficient=[0.6, 0.4, 0.3]}",
];
