//! Derivatives of the events by the parameters of a case, by the linearised run, against differences of the oracle.

use crate::common::cases::{parsed, recorded, truth};
use num_rational::BigRational;
use rayon::prelude::*;
use stickslip::analysis::linearised::{Linearised, linearise};
use stickslip::case::{Case, CaseSource, Override, WrittenCase};
use stickslip::model::nearest_double;
use stickslip::oracle::{OracleEvent, rational};
use stickslip::record::EventKind;

/// The relative step of a difference. Its truncation error is of second order in step times growth: (1e-13 e^18)^2,
/// 4e-11.
const STEP: f64 = 1e-13;

/// Digits of the oracle. A difference over [`STEP`] keeps 20 of them, minus eight for a growth of e^18.
const DIGITS: u32 = 33;

/// Half a unit of the sixth digit of a value between 1 and 10.
const SIXTH_DIGIT: f64 = 5e-6;

/// Derivatives below this share of the largest one by the same parameter must have six digits of that share.
const SMALL: f64 = 1e-3;

/// So must those by a parameter whose whole effect is below this share of the time: the linearised run takes
/// differences of times over 4e-6 of a parameter, with 4 roundings of the time.
const NEGLIGIBLE: f64 = 3e-4;

/// The built-in cases. Those with many events end after a first stretch of stick-slip.
const CASES: [(&str, &[&str]); 16] = [
    ("belt-coulomb", &[]),
    ("belt-exponential", &["output.end_time=12"]),
    ("belt-leine", &["output.end_time=20"]),
    ("belt-leine-arctan", &["output.end_time=20"]),
    ("belt-leine-tanh", &["output.end_time=20"]),
    ("block", &[]),
    ("clutch", &[]),
    ("den-hartog", &["output.end_time=16"]),
    ("drill-string", &["output.end_time=30"]),
    ("groan", &["output.end_time=1.6"]),
    ("hairer", &[]),
    (
        "lugre-slider",
        &["output.end_time=8.5", "friction.bristle_stiffness=2e3"],
    ),
    ("paper", &["output.end_time=7"]),
    ("paper-si", &["output.end_time=7"]),
    ("release", &["output.end_time=0.9"]),
    ("unperturbed", &[]),
];

/// The cases of [`CASES`] for which the oracle needs seconds per run.
const LONG: [&str; 4] = ["paper", "paper-si", "release", "unperturbed"];

/// Parameters whose change makes a run begin in another mode or have other events, so that there is no derivative: the
/// speed of the belt on which a mass lies at rest, and the mass's own speed; forces of a table at corners that are
/// none then; its time 0.
const OTHER_EVENTS: [&str; 5] = [
    "rotor.speed",
    "initial.stator_speed",
    "actuation.force.0",
    "actuation.force.4",
    "actuation.time.0",
];

/// Largest uncertainty of an event's time for a change of a parameter by its whole value, as a share of the largest
/// such change.
const WIDEST: f64 = 1e-4;

type Times = Vec<(EventKind, BigRational)>;

/// Exact times of the events with one parameter moved; `None` if the case does not allow the value.
fn exact(source: &CaseSource, changes: &[Override], moved: (&str, f64)) -> Option<Times> {
    let mut changes = changes.to_vec();
    changes.push(Override::number(moved.0, moved.1));
    let case = Case::read(source, &changes).ok()?;
    let solved = truth((source, &changes), &case, DIGITS).unwrap();
    let event = |event: &OracleEvent| (event.kind, event.time.to_rational().unwrap());
    Some(solved.report.events.iter().map(event).collect())
}

/// The exact reader takes a double as its shortest decimal.
fn decimal(value: f64) -> BigRational {
    rational(&format!("{value:e}")).unwrap()
}

/// d(time)/d(parameter) of every event by central differences, or by one-sided ones of second order where the
/// parameter is at a limit; `None` where the events are not those of `kinds`.
fn differences(
    (source, changes): (&CaseSource, &[Override]),
    kinds: &[EventKind],
    path: &str,
    value: f64,
) -> Option<Vec<f64>> {
    let unit = if value == 0.0 { 1.0 } else { value };
    let at = |steps: f64| {
        let moved = value + steps * STEP * unit;
        Some((decimal(moved), exact(source, changes, (path, moved))?))
    };
    let same = |times: &Times| times.iter().map(|event| event.0).eq(kinds.iter().copied());
    let divided = |a: &(BigRational, Times), b: &(BigRational, Times)| -> Option<Vec<BigRational>> {
        let pairs = a.1.iter().zip(&b.1);
        (same(&a.1) && same(&b.1)).then(|| pairs.map(|(x, y)| (&x.1 - &y.1) / (&a.0 - &b.0)).collect())
    };
    let found = match (at(1.0), at(-1.0)) {
        (Some(above), Some(below)) => divided(&above, &below)?,
        (above, below) => {
            let side = if above.is_some() { 1.0 } else { -1.0 };
            let (near, own, far) = (above.or(below)?, at(0.0)?, at(2.0 * side)?);
            let pairs = divided(&near, &own)?.into_iter().zip(divided(&far, &own)?);
            pairs.map(|(near, far)| &near + &near - far).collect()
        }
    };
    Some(found.iter().map(nearest_double).collect())
}

fn linearised(name: &str, settings: &[&str]) -> (CaseSource, Vec<Override>, Linearised) {
    let source = CaseSource::built_in(name).unwrap();
    let changes = parsed(settings);
    let written = WrittenCase::read(&source, &changes).unwrap();
    let linearised = linearise(&written, None, &|| false).unwrap();
    (source, changes, linearised)
}

/// Compares the derivatives of a case by the `wanted` parameters (index and path) with the oracle.
fn check(name: &str, settings: &[&str], wanted: impl Fn(usize, &str) -> bool) {
    let (source, changes, linearised) = linearised(name, settings);
    let parameters = linearised.parameters.iter().enumerate();
    let kept = parameters.filter(|(index, number)| wanted(*index, &number.path));
    let numbers: Vec<usize> = kept.map(|(index, _)| index).collect();
    assert!(!numbers.is_empty());
    let kinds: Vec<EventKind> = linearised.events.iter().map(|event| event.kind).collect();
    let (path, value) = (&linearised.parameters[0].path, linearised.parameters[0].value);
    let unmoved = exact(&source, &changes, (path, value)).unwrap();
    assert!(unmoved.iter().map(|event| event.0).eq(kinds.iter().copied()), "{name}");
    let slopes = |&index: &usize| {
        let number = &linearised.parameters[index];
        (
            index,
            differences((&source, &changes), &kinds, &number.path, number.value),
        )
    };
    let found: Vec<_> = numbers.par_iter().map(slopes).collect();
    let (mut compared, mut worst, mut failures) = (0, 0.0f64, Vec::new());
    for (index, truths) in found {
        let number = &linearised.parameters[index];
        let unit = if number.value == 0.0 { 1.0 } else { number.value.abs() };
        let Some(truths) = truths else {
            assert!(
                OTHER_EVENTS.contains(&&*number.path),
                "{name}: {} makes other events",
                number.path
            );
            continue;
        };
        let largest = truths.iter().fold(0.0f64, |most, slope| most.max(slope.abs()));
        for (event, truth) in truths.iter().enumerate() {
            let slope = linearised.slope(event, index);
            let least = (SMALL * largest).max(NEGLIGIBLE * linearised.events[event].time / unit);
            let error = (slope.value - truth).abs();
            let size = truth.abs().max(least);
            let relative = if error == 0.0 { 0.0 } else { error / size };
            let six_digits = SIXTH_DIGIT * 10f64.powf(size.log10().floor());
            let wide = WIDEST * size.max(largest);
            // A comparison with NaN is also a failure.
            if !(error <= six_digits && error <= slope.uncertainty && slope.uncertainty <= wide) {
                failures.push(format!(
                    "{} at event {event}: {:e} instead of {truth:e}, off by {relative:.1e}, said to be within {:e}",
                    number.path, slope.value, slope.uncertainty
                ));
            }
            worst = worst.max(relative);
            compared += 1;
        }
    }
    println!(
        "{name}: {compared} derivatives by {} numbers within {worst:.1e}",
        numbers.len()
    );
    assert!(compared > 0, "{name}");
    assert!(failures.is_empty(), "{name}: {}", failures.join("\n"));
}

/// Every third parameter of a case, each case with another start, and every eighth of `unperturbed`, for which a run
/// of the oracle takes half a minute. All parameters of `paper`, or of all cases if STICKSLIP_EVERY_NUMBER is set.
fn check_built_in(which: impl Fn(&str) -> bool) {
    let wanted = std::env::var_os("STICKSLIP_EVERY_NUMBER").is_some();
    for (name, settings) in CASES.iter().filter(|case| which(case.0)) {
        let every = wanted || *name == "paper";
        let part = if *name == "unperturbed" { 8 } else { 3 };
        check(name, settings, |index, _| every || index % part == name.len() % part);
    }
}

#[test]
#[ignore = "takes a minute"]
fn multiprecision_long_sensitivities_of_the_built_in_cases() {
    check_built_in(|name| !LONG.contains(&name));
}

#[test]
#[ignore = "takes minutes"]
fn multiprecision_sensitivities_of_the_built_in_brakes() {
    check_built_in(|name| LONG.contains(&name));
}

/// Changes that make a short run of the paper's brake, from a low speed, with this friction.
fn from_low_speed(friction: &str) -> [&str; 5] {
    [
        "initial.speed=3",
        "actuation={profile=\"ramp\", force=2225, rise_time=0.02}",
        "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
        "output={end_time=0.4, interval=0.01}",
        friction,
    ]
}

/// Every parameter of a friction law, on the paper's brake from a low speed; and the number of these parameters.
fn check_law(friction: &str, parameters: usize) {
    let friction = format!("friction={friction}");
    let set = from_low_speed(&friction);
    let (_, _, linearised) = linearised("paper-si", &set);
    let of_law = |path: &str| path.starts_with("friction.") && path != "friction.breakaway";
    let found = linearised.parameters.iter().filter(|p| of_law(&p.path)).count();
    assert_eq!(found, parameters, "{friction}");
    // The largest parameter of a cubic makes a run fail, and the last points of a table are above all speeds.
    check("paper-si", &set, |_, path| {
        of_law(path) && path != "friction.valid_below"
    });
}

#[test]
#[ignore = "takes 20 seconds; those of Stribeck's law stand for it"]
fn multiprecision_sensitivities_by_the_parameters_of_smooth_laws() {
    check_law("{law=\"coulomb\", breakaway=0.6, kinetic=0.3}", 1);
    check_law(
        "{law=\"hyperbolic\", breakaway=0.62, low_speed=0.6, high_speed=0.3, scale=0.25}",
        3,
    );
    check_law(
        "{law=\"polynomial\", breakaway=0.62, low_speed=0.6, linear=-0.3, quadratic=0.1, cubic=-0.01, valid_below=4}",
        5,
    );
}

/// The power of Stribeck's law is a whole number in every run, but still a parameter. The oracle only has whole
/// powers; the other parameters are compared with it.
#[test]
fn multiprecision_sensitivities_by_the_parameters_of_stribeck() {
    let friction = "{law=\"stribeck\", breakaway=0.62, low_speed=0.6, high_speed=0.3, scale=0.5, viscous=0.01}";
    let friction = format!("friction={friction}");
    let set = from_low_speed(&friction);
    let of_law = |path: &str| path.starts_with("friction.") && path != "friction.breakaway";
    let (_, _, linearised) = linearised("paper-si", &set);
    let power = linearised
        .parameters
        .iter()
        .position(|p| p.path == "friction.exponent")
        .expect("a parameter");
    let mut events = linearised.events.iter();
    let first = events.find(|event| event.kind == EventKind::Stick).expect("a stick");
    assert!(first.by_parameter[power].value.is_finite() && first.by_parameter[power].value != 0.0);
    check("paper-si", &set, |_, path| of_law(path) && path != "friction.exponent");
}

#[test]
#[ignore = "takes a minute"]
fn multiprecision_long_sensitivities_by_the_points_of_a_table() {
    let points = "speed=[0, 0.2, 0.5, 1, 4], coefficient=[0.6, 0.45, 0.35, 0.31, 0.3]";
    check_law(&format!("{{law=\"table\", breakaway=0.62, {points}}}"), 9);
    check_law(
        &format!("{{law=\"table\", breakaway=0.62, {points}, interpolation=\"linear\"}}"),
        9,
    );
}

/// The unstable growth to the first stick. If a kick grows by a share, the first stick moves by the sensitivity; this
/// is a deviation of delta/2 on each surface, and the worst direction gives no less. The kick of `release` acts at the
/// loss of stability, that of `paper-si` later. The oscillation of `paper-si` becomes stable and unstable again before
/// the first stick, and keeps its growth.
#[test]
fn multiprecision_growth_covers_the_kick() {
    for name in ["release", "paper-si"] {
        let (source, _, linearised) = linearised(name, &[]);
        let case = Case::read(&source, &[]).unwrap();
        let column = linearised
            .parameters
            .iter()
            .position(|p| p.path == "perturbation.0.relative_velocity")
            .expect("a kick");
        // The kick is given where growth begins, half on each surface: its length is 1/sqrt(2).
        for event in linearised.events.iter().filter(|e| e.kind.in_event_sequence()) {
            let Some(worst) = event.per_deviation.filter(|w| *w > 0.0) else {
                continue;
            };
            let kick = event.by_parameter[column].value.abs();
            assert!(
                kick <= worst * std::f64::consts::FRAC_1_SQRT_2 * 1.001,
                "{name}: {kick:e} {worst:e}"
            );
        }
        // The e-folds of the eigenvalues, up to the phase and the shape of the modes.
        let recorder = recorded(&case);
        let growth = stickslip::analysis::Growth::of_run(&case.system, &recorder.events, case.output.end_time);
        let gained = growth.and_then(|growth| growth.from_kick).expect("a kick");
        let events = linearised.events;
        let first = events.iter().find(|e| e.kind == EventKind::Stick).expect("a stick");
        let grown = first.growth.expect("after the instability");
        assert!((grown - gained).abs() < 1.5, "{name}: {grown} {gained}");
    }
}
