//! Each diagnosis for a candidate with that fault. A simple solver with this fault alone makes the candidate.

use crate::common::cli::says;
use crate::common::compare::{
    NAMES, SOUND, Solver, Stop, agrees, causes, compare, csv, events_csv, rows_of, run, word_of, write,
};
use stickslip::compare::{CauseKind, Comparison, Mapping};

fn judge(solver: Solver) -> Comparison {
    let folder = tempfile::tempdir().unwrap();
    compare(
        &write(&folder, "candidate.csv", &csv(&solver.run())),
        &Mapping::default(),
    )
}

#[test]
fn property_a_sound_solver_is_not_accused() {
    let c = judge(SOUND);
    agrees(&c);
    // Events are taken at steps of a microsecond, and each has the error of the preceding ones.
    assert!(c.event_errors.max.unwrap() < 5e-6, "{}", c.verdict);
}

/// Asserts that the first cause of each faulty solver is the expected one.
#[track_caller]
fn named(faults: impl IntoIterator<Item = (Solver, CauseKind)>) {
    let mut others = Vec::new();
    for (solver, cause) in faults {
        let c = judge(solver);
        if causes(&c).first() != Some(&cause) {
            others.push((cause, c.verdict));
            continue;
        }
        match cause {
            CauseKind::AbsoluteAngles => assert_eq!(c.causes.len(), 1, "{}", c.verdict),
            CauseKind::StickTest => says(&c.verdict, &["1.1"]),
            _ => {}
        }
    }
    assert!(others.is_empty(), "{others:#?}");
}

#[test]
fn property_a_missing_kick_and_another_breakaway_are_named() {
    named([
        (Solver { kicked: false, ..SOUND }, CauseKind::UnperturbedRun),
        (
            Solver {
                breakaway: 1.1,
                ..SOUND
            },
            CauseKind::StickTest,
        ),
    ]);
}

#[test]
#[ignore = "long: six solvers, each compared to the end"]
fn property_long_each_fault_of_a_solver_is_named() {
    named([
        // The fault shows in the grid of the twist.
        (
            Solver {
                absolute_angles: true,
                ..SOUND
            },
            CauseKind::AbsoluteAngles,
        ),
        (
            Solver {
                stop: Stop::Within(3e-2),
                ..SOUND
            },
            CauseKind::VelocityTolerance,
        ),
        (
            Solver {
                stop: Stop::Frozen(3e-2),
                ..SOUND
            },
            CauseKind::VelocityTolerance,
        ),
        (Solver { step: 60e-6, ..SOUND }, CauseKind::UnresolvedMode),
        // Implicit Euler with 24 steps in a period: the samples are dense enough, but the growth is damped.
        (
            Solver {
                step: 10e-6,
                implicit: true,
                ..SOUND
            },
            CauseKind::UnresolvedMode,
        ),
    ]);
    // A stop is seen only within 0.02 rad/s, and omega_r changes by 0.2 rad/s in a step. Most sticks become reversals.
    let c = judge(Solver {
        step: 28e-6,
        stop: Stop::Within(2e-2),
        ..SOUND
    });
    assert!(causes(&c).contains(&CauseKind::StepTooLarge), "{}", c.verdict);
}

/// The rotor's test in this program, judged from its values alone and from its case.
#[test]
fn property_another_breakaway_test_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let rotor = folder.path().join("rotor.h5");
    run(&rotor, "paper", &["contact.breakaway_test=rotor"]);
    let by_case = compare(&rotor, &Mapping::default());
    assert_eq!(causes(&by_case), [CauseKind::StickTest], "{}", by_case.verdict);
    // A series alone does not show the start of such a slip: at first it goes back by 1e-5 rad/s.
    let mapping = Mapping {
        event_file: Some(write(&folder, "rotor.events.csv", &events_csv(&word_of(&rotor)))),
        ..Mapping::default()
    };
    let series = write(&folder, "rotor.csv", &csv(&rows_of(&rotor, 6.966)));
    let by_numbers = compare(&series, &mapping);
    assert_eq!(causes(&by_numbers), [CauseKind::StickTest], "{}", by_numbers.verdict);
    says(&by_numbers.verdict, &["the rotor torque"]);
}

#[test]
fn property_units_are_recognised() {
    let folder = tempfile::tempdir().unwrap();
    let rows = rows_of(crate::common::compare::paper(), 6.966);
    // Each channel has a wrong unit.
    for (column, factor, unit) in [
        (5, 30.0 / std::f64::consts::PI, "rpm"),
        (5, 180.0 / std::f64::consts::PI, "deg/s"),
        (0, 180.0 / std::f64::consts::PI, "deg"),
        (2, 1e6, "urad"),
        (3, -1.0, "the opposite sign"),
    ] {
        let wrong = rows.iter().map(|&(t, mut values)| {
            values[column] *= factor;
            (t, values)
        });
        let c = compare(
            &write(&folder, "units.csv", &csv(&wrong.collect())),
            &Mapping::default(),
        );
        assert_eq!(causes(&c)[0], CauseKind::WrongUnits, "{unit}: {}", c.verdict);
        says(&c.verdict, &[unit, NAMES[column]]);
    }
    // Torque in lbf in, together with a correct relative velocity.
    let file = stickslip::results::ResultFile::open(crate::common::compare::paper()).unwrap();
    let count = file.sample_count().unwrap();
    let samples = file.samples(0..count).unwrap();
    let mut text = "time,relative_velocity,friction_torque\n".to_owned();
    for s in samples.iter().filter(|s| s.time >= 6.966) {
        let torque = s.channels.friction_torque / 0.112_984_829_027_616_7;
        text += &format!("{:?},{:?},{torque:?}\n", s.time, s.state.relative_velocity);
    }
    let c = compare(&write(&folder, "torque.csv", &text), &Mapping::default());
    assert!(c.verdict.contains("friction_torque looks like lbf in"), "{}", c.verdict);
    // Times in milliseconds, in a file of events alone.
    let word: Vec<(f64, String)> = word_of(crate::common::compare::paper())
        .into_iter()
        .map(|(t, k)| (1e3 * t, k))
        .collect();
    let c = compare(&write(&folder, "ms.csv", &events_csv(&word)), &Mapping::default());
    assert!(c.verdict.contains("time looks like ms"), "{}", c.verdict);
}

#[test]
fn property_another_case_is_named_by_its_keys() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.h5");
    run(&other, "paper", &["friction.decay=4.9"]);
    let c = compare(&other, &Mapping::default());
    assert_eq!(causes(&c).first(), Some(&CauseKind::AnotherCase));
    assert_eq!(c.case_differences.len(), 1);
    assert_eq!(c.case_differences[0].key, "friction.decay");
}
