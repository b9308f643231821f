//! The linearised run against differences of oracle runs.

use crate::common::cases::{parsed, recorded};
use num_bigint::BigInt;
use num_rational::BigRational;
use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use stickslip::analysis::linearised::{Linearised, linearise};
use stickslip::case::{Case, CaseNumber, CaseSource, WrittenCase};
use stickslip::model::system::{ExactSystem, Pressing};
use stickslip::model::{KickTime, nearest_double};
use stickslip::oracle::{self, OracleEvent, OracleOptions, rational};
use stickslip::record::EventKind;
use stickslip::signal::{Ramp, Signal, Table};

fn setup(name: &str, set: &[&str]) -> (Case, ExactSystem, Linearised) {
    let source = CaseSource::built_in(name).unwrap();
    let set = parsed(set);
    let case = Case::read(&source, &set).unwrap();
    let exact = Case::exact(&source, &set).unwrap().system;
    let linearised = linearise(&WrittenCase::of(&case), None, &|| false).unwrap();
    (case, exact, linearised)
}

/// The places of a system that a key of the short form says.
fn places<'a>(exact: &'a mut ExactSystem, path: &str) -> Vec<&'a mut BigRational> {
    let Pressing::Axial { axial, actuation } = &mut exact.pressing else {
        panic!("the short form presses by its axial mode");
    };
    let (rotor, stator) = (&mut exact.rotor, &mut exact.stator);
    match path {
        "axial.mass" => vec![&mut axial.mass],
        "axial.stiffness" => vec![&mut axial.stiffness],
        "axial.damping" => vec![&mut axial.damping],
        "torsion.rotor_inertia" => vec![&mut rotor.inertia[1]],
        "torsion.surface_inertia" => vec![&mut rotor.inertia[0], &mut stator.inertia[0]],
        "torsion.stiffness" => vec![&mut rotor.stiffness[0], &mut stator.stiffness[0]],
        "torsion.damping" => vec![&mut rotor.damping[0], &mut stator.damping[0]],
        "contact.radius" => vec![&mut exact.radius],
        "friction.breakaway" => vec![&mut exact.breakaway],
        "initial.speed" => exact.initial.rotor_speed.iter_mut().collect(),
        "perturbation.0.relative_velocity" => vec![&mut exact.kicks[0].relative_velocity],
        "perturbation.0.time" => match &mut exact.kicks[0].time {
            KickTime::At(time) => vec![time],
            KickTime::Instability => panic!("a kick without a time"),
        },
        _ if path.starts_with("friction.") => {
            let key = path.trim_start_matches("friction.");
            let law = &mut exact.law;
            vec![match key.split_once('.') {
                Some((list, index)) => {
                    let list = law
                        .lists
                        .iter_mut()
                        .find(|entry| entry.0 == list)
                        .expect("a list of the law");
                    &mut list.1[index.parse::<usize>().expect("an index")]
                }
                None => {
                    let number = law.numbers.iter_mut().find(|entry| entry.0 == key);
                    &mut number.expect("a number of the law").1
                }
            }]
        }
        _ => match actuation {
            Signal::Ramp(Ramp {
                value: force,
                rise_time,
            }) => match path {
                "actuation.force" => vec![force],
                _ => vec![rise_time],
            },
            Signal::Table(Table { time, value: force }) => {
                let (rest, index) = path.rsplit_once('.').expect("an index");
                let list = if rest == "actuation.time" { time } else { force };
                vec![&mut list[index.parse::<usize>().expect("an index")]]
            }
        },
    }
}

/// The share by which a parameter is changed. Of the 38 digits of a run, a growth of e^18 takes eight and this 16: 14 are
/// left of the difference, and what is of second order in it is 1e-8 of it.
const SHARE: &str = "1e-16";

/// The friction at vanishing speed, by the keys of the laws.
const AT_REST: [&str; 3] = ["friction.low_speed", "friction.kinetic", "friction.coefficient.0"];

/// The events of the case with one parameter changed by [`SHARE`] of it, or of the case itself; and the change. Breakaway
/// friction must not fall below that at low speed, so that the latter goes down.
fn events(exact: &ExactSystem, path: Option<&str>, end_time: &str) -> (Vec<OracleEvent>, BigRational) {
    let mut changed = exact.clone();
    let mut change = BigRational::from_integer(BigInt::from(0));
    if let Some(path) = path {
        let mut places = places(&mut changed, path);
        change = &*places[0] * rational(SHARE).unwrap() * BigInt::from(if AT_REST.contains(&path) { -1 } else { 1 });
        places.iter_mut().for_each(|value| **value += &change);
    }
    let options = OracleOptions {
        digits: 33,
        end_time: rational(end_time).unwrap(),
        ..OracleOptions::default()
    };
    let report = oracle::run(&changed, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    (report.events, change)
}

/// Holds d(time)/d(parameter) of every event against the difference of oracle runs, on two threads. 64 samples in a period, a
/// cubic between them: 1e-6 of the oscillation at a time, which adds up over a hundred events to some 1e-5. What the equations
/// are differentiated by, differences over a share 1e-6, leaves 1e-10 of rounding of a parameter's whole effect: an event
/// that depends on none of it is moved by that, and a time of seconds can be moved by seconds in all.
fn check(name: &str, end_time: &str, wanted: impl Fn(&str) -> bool) {
    check_with(name, &[], end_time, wanted);
}

/// The same of a case with other values.
fn check_with(name: &str, set: &[&str], end_time: &str, wanted: impl Fn(&str) -> bool) {
    let (_, exact, linearised) = setup(name, set);
    let wanted: Vec<(usize, &CaseNumber)> = linearised
        .parameters
        .iter()
        .enumerate()
        .filter(|(_, parameter)| parameter.value != 0.0 && wanted(&parameter.path))
        .collect();
    assert!(!wanted.is_empty());
    let paths: Vec<Option<&str>> = std::iter::once(None)
        .chain(wanted.iter().map(|(_, parameter)| Some(parameter.path.as_str())))
        .collect();
    let next = AtomicUsize::new(0);
    let runs: Vec<Mutex<Option<_>>> = paths.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(index) = Some(next.fetch_add(1, Ordering::Relaxed)).filter(|k| *k < paths.len()) {
                    *runs[index].lock().unwrap() = Some(events(&exact, paths[index], end_time));
                }
            });
        }
    });
    let mut runs = runs.into_iter().map(|run| run.into_inner().unwrap().expect("a run"));
    let (unchanged, _) = runs.next().expect("the case itself");
    assert_eq!(unchanged.len(), linearised.events.len());
    for ((column, parameter), (changed, change)) in wanted.into_iter().zip(runs) {
        assert_eq!(changed.len(), unchanged.len(), "{}", parameter.path);
        let expected: Vec<f64> = changed
            .iter()
            .zip(&unchanged)
            .map(|(a, b)| {
                let difference = a.time.to_rational().unwrap() - b.time.to_rational().unwrap();
                nearest_double(&(difference / &change))
            })
            .collect();
        let largest = expected.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let rounding = 1e-10 / parameter.value.abs();
        // A known defect (docs/accuracy.md, Sensitivities): a force at the end of a stretch of constant force.
        let beside_constant =
            name == "release" && ["actuation.force.1", "actuation.force.2"].contains(&&*parameter.path);
        let share = if beside_constant { 1e-3 } else { 1e-4 };
        for (event, expected) in linearised.events.iter().zip(expected) {
            let error = event.by_parameter[column].value - expected;
            assert!(
                error.abs() < share * expected.abs() + 1e-5 * largest + rounding,
                "{}: {} at {} moves by {:e}, not {expected:e}",
                parameter.path,
                event.kind.name(),
                event.time,
                event.by_parameter[column].value
            );
        }
    }
}

#[test]
fn multiprecision_sensitivities_of_a_release() {
    check("release", "0.9", |path| {
        ["friction.breakaway", "perturbation.0.relative_velocity"].contains(&path)
    });
}

/// Every parameter.
#[test]
#[ignore = "takes half a minute"]
fn multiprecision_sensitivities_of_a_release_by_every_parameter() {
    check("release", "0.9", |_| true);
}

#[test]
#[ignore = "takes a minute"]
fn multiprecision_sensitivities_of_the_paper_by_every_parameter() {
    check("paper", "7", |_| true);
}

/// What makes a short run of the paper's brake, from a low speed, with this setting of friction.
fn from_low_speed(friction: &str) -> [&str; 5] {
    [
        "initial.speed=3",
        "actuation={profile=\"ramp\", force=2225, rise_time=0.02}",
        "perturbation=[{time=\"instability\", relative_velocity=1e-4}]",
        "output={end_time=0.4, interval=0.01}",
        friction,
    ]
}

/// Every parameter of a friction law, on the paper's brake from a low speed; and how many there are.
fn check_law(friction: &str, parameters: usize) {
    let friction = format!("friction={friction}");
    let set = from_low_speed(&friction);
    let (_, _, linearised) = setup("paper-si", &set);
    let of_law = |path: &str| path.starts_with("friction.") && path != "friction.breakaway";
    let found = linearised.parameters.iter().filter(|p| of_law(&p.path)).count();
    assert_eq!(found, parameters, "{friction}");
    // The largest of a cubic is an error of a run, and the last points of a table are above all speeds.
    check_with("paper-si", &set, "0.4", |path| {
        of_law(path) && path != "friction.valid_below"
    });
}

#[test]
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

/// The power of Stribeck's law is a whole number for every run, and a parameter nevertheless; the oracle has none beside the
/// whole ones, and the others are held against it.
#[test]
fn multiprecision_sensitivities_by_the_parameters_of_stribeck() {
    let friction = "{law=\"stribeck\", breakaway=0.62, low_speed=0.6, high_speed=0.3, scale=0.5, viscous=0.01}";
    let friction = format!("friction={friction}");
    let set = from_low_speed(&friction);
    let of_law = |path: &str| path.starts_with("friction.") && path != "friction.breakaway";
    let (_, _, linearised) = setup("paper-si", &set);
    let power = linearised
        .parameters
        .iter()
        .position(|p| p.path == "friction.exponent")
        .expect("a parameter");
    let first = linearised
        .events
        .iter()
        .find(|event| event.kind == EventKind::Stick)
        .expect("a stick");
    assert!(first.by_parameter[power].value.is_finite() && first.by_parameter[power].value != 0.0);
    check_with("paper-si", &set, "0.4", |path| {
        of_law(path) && path != "friction.exponent"
    });
}

#[test]
fn multiprecision_sensitivities_by_the_points_of_a_table() {
    let points = "speed=[0, 0.2, 0.5, 1, 4], coefficient=[0.6, 0.45, 0.35, 0.31, 0.3]";
    check_law(&format!("{{law=\"table\", breakaway=0.62, {points}}}"), 9);
    check_law(
        &format!("{{law=\"table\", breakaway=0.62, {points}, interpolation=\"linear\"}}"),
        9,
    );
}

/// The unstable growth to the first stick against the oracle: a kick that is larger by a share of 1e-10 moves the first
/// stick by the sensitivity, and that is a deviation of delta/2 on each surface, of which the worst direction is no less.
#[test]
fn multiprecision_growth_covers_the_kick() {
    let (case, _, linearised) = setup("release", &[]);
    let column = linearised
        .parameters
        .iter()
        .position(|p| p.path == "perturbation.0.relative_velocity")
        .expect("a kick");
    // Given at the instability itself, half on each surface: of length 1/sqrt(2).
    for event in linearised.events.iter().filter(|e| e.kind.in_event_sequence()) {
        let Some(worst) = event.per_deviation.filter(|w| *w > 0.0) else {
            continue;
        };
        let kick = event.by_parameter[column].value.abs();
        assert!(
            kick <= worst * std::f64::consts::FRAC_1_SQRT_2 * 1.001,
            "{kick:e} {worst:e}"
        );
    }
    // The e-folds of the eigenvalues, to within those of the phase and the shape of the modes.
    let recorder = recorded(&case);
    let growth = stickslip::analysis::Growth::of_run(&case.system, &recorder.events, 1.2).expect("unstable");
    let first = linearised
        .events
        .iter()
        .find(|e| e.kind == EventKind::Stick)
        .expect("a stick");
    let grown = first.growth.expect("after the instability");
    assert!(
        (grown - growth.to_first_stick).abs() < 1.5,
        "{grown} {}",
        growth.to_first_stick
    );
}
