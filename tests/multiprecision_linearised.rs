//! The linearised run against differences of oracle runs.

use num_bigint::BigInt;
use num_rational::BigRational;
use std::ops::ControlFlow;
use stickslip::analysis::linearised::{Linearised, linearise};
use stickslip::case::{Case, CaseSource};
use stickslip::oracle::{self, ExactActuation, ExactParameters, OracleOptions, nearest_double, rational};
use stickslip::simulation::{EventKind, MemoryRecorder, simulate};

fn run(case: &Case) -> MemoryRecorder {
    let mut recorder = MemoryRecorder::default();
    simulate(&case.parameters, &case.solver, &case.output, &mut recorder, &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap();
    recorder
}

fn setup(name: &str) -> (Case, ExactParameters, Linearised) {
    let source = CaseSource::built_in(name).unwrap();
    let case = Case::parse(&source, &[]).unwrap();
    let exact = Case::exact_parameters(&source, &[]).unwrap();
    let recorder = run(&case);
    let unstable = recorder.events.iter().rfind(|e| e.kind == EventKind::Destabilised);
    let linearised = linearise(&case, &case.solver, unstable.map(|e| e.time), &|| false).unwrap();
    (case, exact, linearised)
}

fn field<'a>(exact: &'a mut ExactParameters, path: &str) -> &'a mut BigRational {
    match path {
        "axial.mass" => &mut exact.mass,
        "axial.stiffness" => &mut exact.axial_stiffness,
        "axial.damping" => &mut exact.axial_damping,
        "torsion.rotor_inertia" => &mut exact.rotor_inertia,
        "torsion.surface_inertia" => &mut exact.surface_inertia,
        "torsion.stiffness" => &mut exact.torsional_stiffness,
        "torsion.damping" => &mut exact.torsional_damping,
        "contact.radius" => &mut exact.radius,
        "friction.breakaway" => &mut exact.breakaway,
        "friction.low_speed" => &mut exact.low_speed,
        "friction.high_speed" => &mut exact.high_speed,
        "friction.decay" => &mut exact.decay,
        "initial.speed" => &mut exact.speed,
        "perturbation.0.relative_velocity" => &mut exact.kicks[0].relative_velocity,
        "perturbation.0.time" => exact.kicks[0].time.as_mut().expect("a time"),
        _ => match &mut exact.actuation {
            ExactActuation::Ramp { force, rise_time } => match path {
                "actuation.force" => force,
                _ => rise_time,
            },
            ExactActuation::Table { time, force } => {
                let (rest, index) = path.rsplit_once('.').expect("an index");
                let list = if rest == "actuation.time" { time } else { force };
                &mut list[index.parse::<usize>().expect("an index")]
            }
        },
    }
}

/// d(time)/d(parameter) of every event by a difference of two oracle runs, over a share 1e-10 of the parameter on each
/// side: of 38 digits some 15 are left. Breakaway friction must not fall below that at low speed, so that either goes one
/// way only.
fn differences(exact: &ExactParameters, path: &str, end_time: &str) -> Vec<f64> {
    let share = rational("1e-10").unwrap();
    let signs = match path {
        "friction.breakaway" => [1, 0],
        "friction.low_speed" => [0, -1],
        _ => [1, -1],
    };
    let [above, below] = signs.map(|sign| {
        let mut changed = exact.clone();
        let value = field(&mut changed, path);
        *value = &*value + &*value * &share * BigInt::from(sign);
        let options = OracleOptions {
            digits: 33,
            end_time: rational(end_time).unwrap(),
            sample_times: Vec::new(),
            max_events: 1000,
        };
        oracle::run(&changed, &options, &mut |_| ControlFlow::Continue(())).unwrap()
    });
    assert_eq!(above.events.len(), below.events.len());
    let width = field(&mut exact.clone(), path).clone() * share * BigInt::from(signs[0] - signs[1]);
    above
        .events
        .iter()
        .zip(&below.events)
        .map(|(a, b)| {
            let difference = a.time.to_rational().unwrap() - b.time.to_rational().unwrap();
            nearest_double(&(difference / &width))
        })
        .collect()
}

/// 64 samples in a period, a cubic between them: 1e-6 of the oscillation at a time, which adds up over a hundred events
/// to some 1e-5.
fn check(name: &str, end_time: &str, wanted: impl Fn(&str) -> bool) {
    let (_, exact, linearised) = setup(name);
    let mut checked = 0;
    for (column, parameter) in linearised.parameters.iter().enumerate() {
        if parameter.value == 0.0 || !wanted(&parameter.path) {
            continue;
        }
        checked += 1;
        let expected = differences(&exact, &parameter.path, end_time);
        assert_eq!(expected.len(), linearised.events.len());
        let largest = expected.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for (event, expected) in linearised.events.iter().zip(expected) {
            let error = event.by_parameter[column] - expected;
            assert!(
                error.abs() < 1e-4 * expected.abs() + 1e-5 * largest,
                "{}: {} at {} moves by {:e}, not {expected:e}",
                parameter.path,
                event.kind.name(),
                event.time,
                event.by_parameter[column]
            );
        }
    }
    assert!(checked > 0);
}

#[test]
fn multiprecision_sensitivities_of_a_release() {
    check("release", "0.9", |path| {
        ["friction.breakaway", "perturbation.0.relative_velocity"].contains(&path)
    });
}

/// Every parameter, by 40 oracle runs.
#[test]
#[ignore = "takes a minute or two"]
fn multiprecision_sensitivities_of_a_release_by_every_parameter() {
    check("release", "0.9", |_| true);
}

#[test]
#[ignore = "takes minutes"]
fn multiprecision_sensitivities_of_the_paper_by_every_parameter() {
    check("paper", "7", |_| true);
}

/// The unstable growth to the first stick against the oracle: a kick that is larger by a share of 1e-10 moves the first
/// stick by the sensitivity, and that is a deviation of delta/2 on each surface, of which the worst direction is no less.
#[test]
fn multiprecision_growth_covers_the_kick() {
    let (case, _, linearised) = setup("release");
    let column = linearised
        .parameters
        .iter()
        .position(|p| p.path == "perturbation.0.relative_velocity")
        .expect("a kick");
    // Given at the instability itself, half on each surface: of length 1/sqrt(2).
    for event in linearised.events.iter().filter(|e| e.kind.in_mode_word()) {
        let Some(worst) = event.per_deviation.filter(|w| *w > 0.0) else {
            continue;
        };
        let kick = event.by_parameter[column].abs();
        assert!(
            kick <= worst * std::f64::consts::FRAC_1_SQRT_2 * 1.001,
            "{kick:e} {worst:e}"
        );
    }
    // The e-folds of the eigenvalues, to within those of the phase and the shape of the modes.
    let recorder = run(&case);
    let growth = stickslip::analysis::Growth::of_run(&case.parameters, &recorder.events, 1.2).expect("unstable");
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
