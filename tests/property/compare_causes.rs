//! Faults that an earlier version attributed to a correct part. Each reported cause is true, or none is reported.

use crate::common::cases::built_in;
use crate::common::compare::causes;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use stickslip::SavedRun;
use stickslip::compare::{CauseKind, Comparison, Reference};
use stickslip::results::{Overwrite, ResultFile};

fn run(folder: &Path, name: &str, case: &str, overrides: &[&str]) -> PathBuf {
    let case = built_in(case, &[overrides, &["output.around=none"]].concat());
    let path = folder.join(name);
    SavedRun::new(&case, &path).overwrite(Overwrite::Force).start().unwrap();
    path
}

/// Time and some columns of a result, as another program would write them.
fn csv(path: &Path, columns: &[&str]) -> String {
    let file = ResultFile::open(path).unwrap();
    let rows = file.sample_count().unwrap();
    let all: Vec<Vec<f64>> = ["time"]
        .iter()
        .chain(columns)
        .map(|name| file.column(name, 0..rows).unwrap())
        .collect();
    let mut text = format!("time,{}\n", columns.join(","));
    for row in 0..rows {
        let values: Vec<String> = all.iter().map(|column| format!("{:?}", column[row])).collect();
        writeln!(text, "{}", values.join(",")).unwrap();
    }
    text
}

fn judged(reference: &Path, text: &str) -> Comparison {
    let path = reference.with_file_name("mine.csv");
    std::fs::write(&path, text).unwrap();
    let reference = Reference::open(reference).unwrap();
    reference.compare(&path, &reference.mapping()).unwrap()
}

/// Samples of a case with changed keys, compared with the case itself.
fn planted(case: &str, overrides: &[&str], columns: &[&str]) -> Comparison {
    let folder = tempfile::tempdir().unwrap();
    let reference = run(folder.path(), "reference.h5", case, &[]);
    let other = run(folder.path(), "other.h5", case, overrides);
    judged(&reference, &csv(&other, columns))
}

/// Asserts that one parameter is named, alone or with equivalent ones, and that it has this value.
#[track_caller]
fn names(c: &Comparison, path: &str, value: f64) {
    let found = c.parameters.as_ref().unwrap_or_else(|| panic!("{}", c.verdict));
    // For a belt that sticks from the start, a twist at t = 0 looks like a shifted clock.
    let of_start = path.starts_with("initial.");
    assert!(
        match causes(c)[..] {
            [CauseKind::AnotherParameter | CauseKind::StickTest] => true,
            [CauseKind::TimeOffset, CauseKind::AnotherParameter] => of_start,
            _ => false,
        },
        "{}",
        c.verdict
    );
    assert_eq!(found.numbers.len(), 1, "{}", c.verdict);
    let named = found.numbers.iter().chain(&found.or).find(|number| number.path == path);
    let named = named.unwrap_or_else(|| panic!("{path}: {}", c.verdict));
    assert!((named.value / value - 1.0).abs() < 1e-3, "{path}: {}", c.verdict);
    assert!(found.explained >= 0.99, "{}", c.verdict);
}

const BELT: [&str; 2] = ["phi1", "phi1_dot"];

#[test]
fn property_a_number_of_a_belt_is_named_and_nothing_else_is() {
    for (key, value) in [
        ("rotor.speed", 0.21),
        ("rotor.speed", 0.206),
        ("friction.scale", 0.34),
        ("friction.breakaway", 1.03),
        ("stator.inertia", 1.02),
        ("stator.stiffness", 1.02),
        ("initial.stator_twist", 0.3),
        ("stator.torque", 0.05),
    ] {
        let c = planted("belt-leine", &[&format!("{key}={value}")], &BELT);
        let found = c.parameters.as_ref().unwrap_or_else(|| panic!("{key}: {}", c.verdict));
        // The general form numbers the elements of lists.
        let mut all = found.numbers.iter().chain(&found.or);
        let path = all
            .find(|number| number.path.starts_with(key))
            .map(|number| number.path.clone());
        names(&c, &path.unwrap_or_else(|| panic!("{key}: {}", c.verdict)), value);
    }
}

#[test]
fn property_a_right_export_is_not_accused() {
    for interval in ["10 ms", "0.5 ms"] {
        let folder = tempfile::tempdir().unwrap();
        let reference = run(folder.path(), "reference.h5", "belt-leine", &["output.end_time=40"]);
        let keys = [
            "output.end_time=40".to_owned(),
            format!("output.interval=\"{interval}\""),
        ];
        let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
        let other = run(folder.path(), "other.h5", "belt-leine", &keys);
        let c = judged(&reference, &csv(&other, &BELT));
        assert_eq!(causes(&c), [], "{}", c.verdict);
        assert!(c.unexplained.is_none(), "{}", c.verdict);
    }
}

/// A column that means what another one does is not passed over in silence.
#[test]
fn property_a_column_beside_one_of_its_meaning_is_said_not_to_be_compared() {
    let c = planted("block", &[], &["relative_velocity", "theta_dot", "rotor_speed_0"]);
    let absent: Vec<&str> = c.absent.iter().map(|absent| absent.what.as_str()).collect();
    let left_out = ["theta_dot", "rotor_speed_0"]
        .iter()
        .filter(|name| absent.contains(name));
    assert_eq!(left_out.count(), 2, "{absent:?}");
}

/// Two changed parameters are both named, or neither is. The contact's law at rest is not blamed for them.
#[test]
fn property_two_numbers_are_not_laid_on_the_stick_test() {
    let c = planted("belt-leine", &["stator.stiffness=1.02", "friction.scale=0.34"], &BELT);
    for diagnosis in &c.causes {
        assert_eq!(diagnosis.cause, CauseKind::AnotherParameter, "{}", c.verdict);
    }
    if let Some(found) = &c.parameters {
        let mut paths: Vec<&str> = found.numbers.iter().map(|number| number.path.as_str()).collect();
        paths.sort_unstable();
        assert_eq!(paths, ["friction.scale", "stator.stiffness.0"], "{}", c.verdict);
    }
}

/// A cosine instead of a sine, and a drive that turns differently.
#[test]
fn property_another_drive_is_no_clock_and_no_sign() {
    let c = planted("den-hartog", &["stator.torque.phase=1.5707963267948966"], &BELT);
    let clock = causes(&c).contains(&CauseKind::TimeOffset) || causes(&c).contains(&CauseKind::WrongUnits);
    assert!(!clock, "{}", c.verdict);
    let c = planted("den-hartog", &["stator.torque.angular_frequency=0.51"], &BELT);
    names(&c, "stator.torque.angular_frequency", 0.51);
}

/// Faults once attributed to kick, velocity tolerance, law at rest, damping or signs. The parameter is named, or none.
#[test]
#[ignore = "long: a search for the cause for each number"]
fn property_long_a_number_is_not_laid_on_another_part() {
    const BRAKE: [&str; 5] = ["rotor_twist", "rotor_twist_rate", "phi1", "phi1_dot", "theta_dot"];
    for (case, key, value, columns) in [
        // The brake stops before the kick of the reference.
        ("paper-si", "friction.high_speed", "0.3015", &BRAKE[..]),
        ("paper-si", "initial.speed", "99.5", &BRAKE),
        ("belt-coulomb", "rotor.speed", "0.103", &BELT),
        ("belt-exponential", "friction.breakaway", "0.412", &BELT),
        ("clutch", "initial.speed", "190", &["relative_velocity"]),
        // Half a turn negates the motion of a symmetric system.
        ("den-hartog", "stator.torque.phase", "3.141592653589793", &BELT),
    ] {
        let c = planted(case, &[&format!("{key}={value}")], columns);
        for diagnosis in &c.causes {
            let clock_or_start = key.contains("phase") && diagnosis.cause == CauseKind::TimeOffset;
            let is_right = match diagnosis.cause {
                CauseKind::StickTest => key == "friction.breakaway",
                CauseKind::AnotherParameter => c.parameters.as_ref().is_some_and(|found| {
                    let mut all = found.numbers.iter().chain(&found.or);
                    // The general form has an initial speed for each inertia.
                    let is_initial = |path: &str| key == "initial.speed" && path.starts_with("initial.rotor_speed");
                    all.any(|number| number.path.starts_with(key) || is_initial(&number.path))
                }),
                _ => clock_or_start,
            };
            assert!(is_right, "{case}, {key} = {value}: {}", c.verdict);
        }
    }
}
