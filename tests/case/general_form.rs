//! Cases in the general form: what is read, and the messages about wrong ones: file, line, key and remedy.

use crate::common::cases::{built_in, parsed};
use crate::common::rows;
use std::path::PathBuf;

use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive};
use proptest::prelude::*;
use stickslip::case::{Case, CaseSource, Motion, Origin, Override, Words, WrittenCase, builtin, schema, train_keys};
use stickslip::friction::{FrictionLaw, Law as _};
use stickslip::model::system::{ContactLaw, End, KickSide, Pressing, Smoothing};
use stickslip::model::{BreakawayTest, KickTime, Parameters, nearest_double};
use stickslip::signal::{Drive, Frequency, HarmonicShape, Signal};
use stickslip::simulation::Around;

/// A case of rotation in which every kind of train and signal occurs. The tests change one thing at a time.
const VALID: &str = r#"title = "A drive"

[rotor]
inertia = [0.1, "2 kg m^2"]
stiffness = [500.0, 80.0]
damping = [0.5, 0.0]
end = "driven"
speed = { profile = "ramp", value = "60 rpm", rise_time = 2.0 }
torque = { profile = "sine", amplitude = 3.0, frequency = "5 Hz", from = 1.0, to = 4.0 }
torque_on = 0

[stator]
inertia = 0.2
stiffness = 300.0
end = "fixed"

[contact]
radius = 0.1
normal_force = { profile = "sum", signals = [100.0, { profile = "table", time = [0.0, 1.0], value = [0.0, 50.0] }] }

[friction]
law = "stribeck"
breakaway = 0.5
low_speed = 0.5
high_speed = 0.3
scale = 0.2

[initial]
rotor_twist = [0.01, 0.0]

[[perturbation]]
time = 1.5
relative_velocity = 1e-3
on = "rotor"

[output]
end_time = 10
"#;

const SMOOTH: &str = r#"motion = "translation"

[rotor]
end = "driven"
speed = "200 mm/s"

[stator]
inertia = [1.0]
stiffness = [1.0]
end = "fixed"

[contact]
normal_force = 1.0

[friction]
law = "hyperbolic"
low_speed = 1.0
high_speed = 0.0
scale = 0.3333333333333333
regularisation = { function = "arctan", speed = 1e-3 }

[output]
end_time = 100
"#;

const BRISTLES: &str = r#"motion = "translation"

[rotor]
inertia = [1.0]
stiffness = [2.0]
end = "driven"
speed = 0.1

[stator]
end = "fixed"

[contact]
normal_force = 10.0

[friction]
law = "lugre"
low_speed = 0.15
high_speed = 0.1
scale = 0.001
bristle_stiffness = "1e4 1/m"
bristle_damping = 30.0
viscous = 0.04
"#;

/// The paper's brake in the general form.
const BRAKE: &str = r#"
[rotor]
inertia = ["0.1 slug in ft", "20 slug in ft"]
stiffness = ["6.822e7 lbf in/rad"]
damping = ["200 lbf in s/rad"]
end = "free"

[stator]
inertia = ["0.1 slug in ft"]
stiffness = ["6.822e7 lbf in/rad"]
damping = ["200 lbf in s/rad"]
end = "fixed"

[axial]
mass = "10 lbm"
stiffness = "3.161e5 lbf/in"
damping = "50 lbf s/in"

[actuation]
profile = "ramp"
force = "500 lbf"
rise_time = "1 s"

[contact]
radius = "2.0625 in"

[friction]
breakaway = 0.6
low_speed = 0.6
high_speed = 0.3
decay = "5 s/rad"

[initial]
speed = "100 rad/s"

[[perturbation]]
time = "6.966 s"
relative_velocity = "1.3e-6 rad/s"
"#;

fn source(text: &str) -> CaseSource {
    CaseSource {
        text: text.to_owned(),
        origin: Origin::File(PathBuf::from("drive.toml")),
    }
}

fn parse(text: &str) -> Case {
    Case::read(&source(text), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// The text with `from`, which occurs once, replaced by `to`.
fn changed(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from:?} must occur once");
    text.replace(from, to)
}

fn refused(text: &str, from: &str, to: &str) -> String {
    let text = changed(text, from, to);
    let read = Case::read(&source(&text), &[]);
    read.expect_err("the case must be refused").to_string()
}

#[test]
fn case_trains_are_read_with_units_signals_and_defaults() {
    let case = parse(VALID);
    assert_eq!((case.title.as_str(), case.motion()), ("A drive", Motion::Rotation));
    let trains = &case.system;
    assert_eq!(trains.rotor.inertia, [0.1, 2.0]);
    assert_eq!(trains.rotor.viscous, [0.0, 0.0]);
    let found = (&trains.stator.inertia, &trains.stator.damping);
    assert_eq!(found, (&vec![0.2], &vec![0.0]));
    assert_eq!(trains.stator.end, End::Fixed);
    let End::Driven(Drive::Linear(Signal::Ramp(ramp))) = &trains.rotor.end else {
        panic!("{:?}", trains.rotor.end)
    };
    assert_eq!((ramp.value, ramp.rise_time), (std::f64::consts::TAU, 2.0));
    let torque = trains.rotor.torque.as_ref().unwrap();
    let Drive::Wave(wave) = &torque.signal else {
        panic!("{:?}", torque.signal)
    };
    let found = (torque.on, wave.shape, wave.amplitude, wave.mean);
    assert_eq!(found, (0, HarmonicShape::Sine, 3.0, 0.0));
    let found = (wave.frequency, wave.from, wave.to);
    assert_eq!(found, (Frequency::Cycles(5.0), Some(1.0), Some(4.0)));
    assert!(matches!(&trains.pressing, Pressing::Force(Drive::Sum(terms)) if terms.len() == 2));
    assert_eq!(trains.contact, ContactLaw::StickSlip);
    assert_eq!(case.threshold, 0.0);
    assert_eq!(trains.initial.rotor_twist, [0.01, 0.0]);
    // The ramp starts from rest.
    assert_eq!(trains.initial.rotor_speed, [0.0, 0.0]);
    let found = (trains.kicks[0].on, trains.kicks[0].time);
    assert_eq!(found, (KickSide::Rotor, KickTime::At(1.5)));
    assert_eq!(case.output.interval, 0.01);
}

#[test]
fn case_trains_without_stick_have_a_threshold_and_need_no_breakaway() {
    let case = parse(SMOOTH);
    assert_eq!(case.motion(), Motion::Translation);
    let ContactLaw::Regularised(regularisation) = &case.system.contact else {
        panic!("{:?}", case.system.contact)
    };
    let found = (regularisation.function, regularisation.speed);
    assert_eq!(found, (Smoothing::Arctan, 1e-3));
    let found = (case.threshold, case.system.breakaway, case.system.radius);
    assert_eq!(found, (0.01, 1.0, 1.0));
    assert_eq!(case.system.rotor.end, End::Driven(Drive::Value(0.2)));

    let case = parse(BRISTLES);
    let ContactLaw::Bristles(bristles) = &case.system.contact else {
        panic!("{:?}", case.system.contact)
    };
    let found = (bristles.stiffness, bristles.damping, bristles.viscous);
    assert_eq!(found, (1e4, 30.0, 0.04));
    // g is Stribeck's law without the viscous part, which is the bristles' sigma_2.
    assert!(matches!(case.system.law, FrictionLaw::Stribeck(_)));
    assert_eq!(case.system.law.number("viscous"), Some(0.0));
    assert_eq!((case.threshold, case.system.breakaway), (1e-4, 0.15));
    // The block moves with the driven end.
    assert_eq!(case.system.initial.rotor_speed, [0.1]);
    let case = parse(&changed(
        SMOOTH,
        "[output]",
        "[[perturbation]]\ntime = 1\nrelative_velocity = \"1 mm/s\"\n\n[output]",
    ));
    assert_eq!(case.system.kicks[0].relative_velocity, 1e-3);
}

#[test]
fn case_trains_say_the_numbers_of_the_brake() {
    let paper = built_in("paper", &[]);
    let paper = Parameters::of(&paper.system).unwrap();
    let case = parse(BRAKE);
    let trains = &case.system;
    let expected = [paper.torsion.surface_inertia, paper.torsion.rotor_inertia];
    assert_eq!(trains.rotor.inertia, expected);
    assert_eq!(trains.stator.stiffness, [paper.torsion.stiffness]);
    assert_eq!(trains.initial.rotor_speed, [100.0, 100.0]);
    assert_eq!(trains.radius, paper.contact.radius);
    let Pressing::Axial { axial, actuation } = &trains.pressing else {
        panic!("{:?}", trains.pressing)
    };
    let found = (axial.mass, axial.ringing_floor, actuation);
    assert_eq!(found, (paper.axial.mass, paper.axial.ringing_floor, &paper.actuation));
    let exact = Case::exact(&source(BRAKE), &[]).unwrap().system;
    let brake = Case::exact(&CaseSource::built_in("paper").unwrap(), &[])
        .unwrap()
        .system;
    assert_eq!(exact, brake);
}

#[test]
fn case_trains_read_back_from_their_resolved_text() {
    let watched = BRAKE
        .replace("\"6.966 s\"", "\"instability\"")
        .replace("[contact]\n", "[contact]\nbreakaway_test = \"rotor\"\n");
    let [kick] = &parse(&watched).system.kicks[..] else {
        panic!("one kick");
    };
    assert_eq!(kick.time, KickTime::Instability);
    assert_eq!(parse(&watched).system.breakaway_test, BreakawayTest::Rotor);
    for text in [VALID, SMOOTH, BRISTLES, BRAKE, &watched] {
        let case = parse(text);
        let resolved = case.resolved();
        let again = Case::read(&source(&resolved), &[]).unwrap_or_else(|error| panic!("{error}\n{resolved}"));
        let expected = {
            let mut case = case.clone();
            case.title.clone_from(&again.title);
            case
        };
        assert_eq!(again, expected, "{resolved}");
        assert_eq!(again.resolved(), resolved);
    }
}

#[test]
fn case_trains_exact_numbers_round_to_the_doubles() {
    for text in [VALID, SMOOTH, BRISTLES, BRAKE] {
        let case = parse(text).system;
        let exact = Case::exact(&source(text), &[]).unwrap().system;
        let round = |number: &BigRational| number.to_f64().unwrap();
        let all = |numbers: &[BigRational]| numbers.iter().map(round).collect::<Vec<f64>>();
        for (train, exact) in [(&case.rotor, &exact.rotor), (&case.stator, &exact.stator)] {
            assert_eq!(all(&exact.inertia), train.inertia);
            assert_eq!(all(&exact.stiffness), train.stiffness);
            assert_eq!(all(&exact.damping), train.damping);
            assert_eq!(all(&exact.viscous), train.viscous);
        }
        let drives = exact.drives().into_iter().map(|drive| drive.map(round));
        let drives = drives.collect::<Vec<_>>();
        assert_eq!(drives.iter().collect::<Vec<_>>(), case.drives());
        assert_eq!(all(&exact.initial.rotor_speed), case.initial.rotor_speed);
        assert_eq!(all(&exact.initial.rotor_twist), case.initial.rotor_twist);
        let found = (round(&exact.radius), round(&exact.breakaway));
        assert_eq!(found, (case.radius, case.breakaway));
        for (key, value) in &exact.law.numbers {
            assert_eq!(case.law.number(key), Some(nearest_double(value)), "{key}");
        }
        for (key, values) in &exact.law.lists {
            let values: Vec<f64> = values.iter().map(nearest_double).collect();
            assert_eq!(case.law.list(key), Some(&values[..]), "{key}");
        }
    }
}

/// A body that turns with a driven end has the end's speed to the last digit. Otherwise it would slip at once.
#[test]
fn case_trains_turn_with_a_driven_end_exactly() {
    let speeds = [
        "\"7 rpm\"",
        "{ profile = \"ramp\", value = \"7 rpm\", rise_time = 0 }",
        "{ profile = \"table\", time = [-1, 2], value = [\"1 rpm\", \"5 rpm\"] }",
        "{ profile = \"sum\", signals = [\"7 rpm\", { profile = \"sine\", amplitude = 1, frequency = 3 }] }",
    ];
    for speed in speeds {
        let text = changed(
            VALID,
            "speed = { profile = \"ramp\", value = \"60 rpm\", rise_time = 2.0 }",
            &format!("speed = {speed}"),
        );
        let case = parse(&text).system;
        let exact = Case::exact(&source(&text), &[]).unwrap().system;
        let End::Driven(drive) = &case.rotor.end else { panic!() };
        assert_eq!(case.initial.rotor_speed, [drive.at_start(); 2]);
        let [speed, other] = &exact.initial.rotor_speed[..] else {
            panic!()
        };
        assert_eq!(speed, other);
        // Revolutions with 40 digits, so that the rational number is no double.
        let rpm = |count: i64| {
            let case = changed(VALID, "value = \"60 rpm\"", &format!("value = \"{count} rpm\""));
            let exact = Case::exact(&source(&case), &[]).unwrap().system;
            let End::Driven(Drive::Linear(Signal::Ramp(ramp))) = exact.rotor.end else {
                panic!()
            };
            ramp.value
        };
        let expected = match drive {
            Drive::Linear(Signal::TimeTable(_)) => rpm(1) + (rpm(5) - rpm(1)) / BigRational::from_integer(3.into()),
            _ => rpm(7),
        };
        assert_eq!(*speed, expected);
    }
}

/// The speed of an end driven by a harmonic is no rational number at t = 0. It is known far beyond the digits of a
/// double, even if another element of the list is set. Otherwise a body that turns with the end would slip at once.
#[test]
fn case_trains_turn_with_a_harmonic_to_a_hundred_digits() {
    let decimal = |text: &str| stickslip::oracle::rational(text).unwrap();
    // Their series in exact fractions.
    let shapes = [
        (
            "sine",
            "1",
            "0.84147098480789650665250232163029899962256306079837106567275170999191040439123966894863974354305269585435",
        ),
        (
            "cosine",
            "-1.609",
            "-0.038194380708290563037294842778445843770760188291863673113957383743051439014801793687849658785233135617",
        ),
        (
            "sine",
            "22",
            "-0.0088513092904038759216902568157723324632892039513325664423308352980895520146283534679177916515312897888",
        ),
        ("sine", "0", "0"),
    ];
    for (profile, phase, value) in shapes {
        let speed = format!("{{ profile = \"{profile}\", mean = 1, amplitude = 2, frequency = 3, phase = {phase} }}");
        let text = changed(
            VALID,
            "{ profile = \"ramp\", value = \"60 rpm\", rise_time = 2.0 }",
            &speed,
        );
        let expected = decimal("1") + decimal("2") * decimal(value);
        let check = |found: &BigRational| {
            let error = found - &expected;
            assert!(
                error.abs() <= decimal("1e-98"),
                "{speed}: {:e}",
                error.to_f64().unwrap()
            );
        };
        let exact = Case::exact(&source(&text), &[]).unwrap().system;
        exact.initial.rotor_speed.iter().for_each(check);
        let set = [Override::parse("initial.rotor_speed.1=3").unwrap()];
        let exact = Case::exact(&source(&text), &set).unwrap().system;
        check(&exact.initial.rotor_speed[0]);
        assert_eq!(exact.initial.rotor_speed[1], decimal("3"));
    }
}

/// The default thresholds are ten times 0.07, which is 0.7000000000000001 in doubles, and a tenth of 0.7, which is
/// 0.06999999999999999.
#[test]
fn case_trains_have_an_exact_threshold() {
    let threshold = |text: &str| Case::exact(&source(text), &[]).unwrap().threshold;
    let decimal = |text: &str| stickslip::oracle::rational(text);
    let smooth = changed(SMOOTH, "speed = 1e-3 }", "speed = 0.07 }");
    assert_eq!(threshold(&smooth), decimal("0.7"));
    let bristles = changed(BRISTLES, "scale = 0.001", "scale = 0.7");
    assert_eq!(threshold(&bristles), decimal("0.07"));
    let given = changed(BRISTLES, "scale = 0.001", "scale = 0.001\nthreshold = \"0.7 mm/s\"");
    assert_eq!(threshold(&given), decimal("0.0007"));
    assert_eq!(threshold(VALID), None);
}

#[test]
fn case_trains_take_overrides_and_numbers_by_path() {
    let change = |text: &str| Override::parse(text).unwrap();
    let case = Case::read(
        &source(VALID),
        &[change("rotor.inertia.1=3"), change("stator.viscous=0.5")],
    )
    .unwrap();
    let found = (case.system.rotor.inertia[1], &case.system.stator.viscous);
    assert_eq!(found, (3.0, &vec![0.5]));
    assert_eq!(case.number("rotor.inertia.1").unwrap(), 3.0);
    assert_eq!(case.number("contact.normal_force.signals.1.value.1").unwrap(), 50.0);
    let written = WrittenCase::of(&case);
    let heavier = written.with("rotor.inertia.1", 4.0).unwrap();
    assert_eq!(heavier.system.rotor.inertia, [0.1, 4.0]);
    assert!(case.number("rotor.inertia.2").is_err());
    let wrong = written.with("rotor.inertia.1", -4.0).unwrap_err().to_string();
    assert_eq!(wrong, "--set rotor.inertia.1: must be greater than 0, but is -4.0");
}

#[test]
fn case_trains_have_words_of_their_own() {
    let numbers_parts = |source: &CaseSource, changes: &[Override]| Words::of(source, changes).numbers_parts();
    let paper = CaseSource::built_in("paper").unwrap();
    assert!(!numbers_parts(&paper, &[]));
    assert!(numbers_parts(&source(VALID), &[]));
    assert!(!numbers_parts(&source("rotor = = 1"), &[]));
    let both = changed(VALID, "[stator]", "[torsion]\nstiffness = 3\n\n[stator]");
    assert!(numbers_parts(&source(&both), &[]));
    // The file determines the form of the case. For a key of the other form the message gives its name in this one.
    let refused = |source: &CaseSource, change: &str| {
        let change = [Override::parse(change).unwrap()];
        assert_eq!(numbers_parts(source, &change), numbers_parts(source, &[]));
        Case::read(source, &change).unwrap_err().to_string()
    };
    let general = "is a key of a case of trains, [rotor] and [stator], but the case is of the short form, [torsion]";
    let found = refused(&paper, "rotor.end=fixed");
    assert_eq!(found, format!("--set rotor.end: {general}"));
    for [change, own] in rows(
        "
        rotor.damping.0=3    | torsion.damping
        stator.inertia.0=3   | torsion.surface_inertia
        rotor.inertia=[1, 2] | torsion.rotor_inertia and torsion.surface_inertia
    ",
    ) {
        let key = change.split('=').next().unwrap();
        assert_eq!(refused(&paper, change), format!("--set {key}: {general}; write {own}"));
    }
    assert_eq!(
        refused(&source(VALID), "torsion.damping=3"),
        "--set torsion.damping: is a key of the short form, [torsion], but the case has [rotor] and [stator] instead; write \
         rotor.damping.0 and stator.damping.0"
    );
}

/// The changes that the comments of a built-in case suggest are valid.
#[test]
fn case_trains_built_in_are_valid() {
    for built_in in builtin::TRAINS {
        let built_in_source = CaseSource::built_in(built_in.name).unwrap();
        assert!(Words::of(&built_in_source, &[]).numbers_parts(), "{}", built_in.name);
        let case = Case::read(&built_in_source, &[]).unwrap_or_else(|error| panic!("{error}"));
        let again = Case::read(&source(&case.resolved()), &[]).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(again, case);
        Case::exact(&built_in_source, &[]).unwrap();
    }
    for built_in in builtin::CASES {
        assert!(
            !Words::of(&CaseSource::built_in(built_in.name).unwrap(), &[]).numbers_parts(),
            "{}",
            built_in.name
        );
    }
    let settings = [
        "stator.torque.angular_frequency=2",
        "friction.kinetic=0.3",
        "friction.breakaway=0.3",
        "initial.stator_twist=0.2976761849915291949",
        "stator.torque.phase=2.674827314542496877",
    ];
    let case = built_in("den-hartog", &settings).system;
    assert_eq!(case.initial.stator_twist, [0.297_676_184_991_529_2]);
    // The phase for which x = X, x' = 0 at the start: V cos(phase) = X, with V = 1/(1 - 4).
    let Drive::Wave(wave) = &case.stator.torque.as_ref().unwrap().signal else {
        panic!()
    };
    assert!((wave.phase.cos() / -3.0 - case.initial.stator_twist[0]).abs() < 1e-16);
    let leine = CaseSource::built_in("belt-leine").unwrap();
    let case = Case::read(&leine, &[Override::parse("initial.stator_twist=1").unwrap()]).unwrap();
    let found = (&case.system.initial.stator_twist[..], case.system.law.coefficient(1.0));
    assert_eq!(found, (&[1.0][..], 0.25));
}

proptest! {
    /// A changed text is either read or refused. A case that is read reads back from its resolved text.
    #[test]
    fn property_case_trains_of_any_text_are_read_or_refused(
        which in 0..4usize, changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>(), 0..3u8), 1..4),
    ) {
        let text = [VALID, SMOOTH, BRISTLES, BRAKE][which];
        // Words, numbers and marks of a case exchange their places.
        let mut parts: Vec<&str> = text.split_inclusive([' ', ',', '\n', '"', '.']).collect();
        for (at, from, how) in changes {
            let (at, other) = (at.index(parts.len()), parts[from.index(parts.len())]);
            match how {
                0 => parts[at] = other,
                1 => parts.insert(at, other),
                _ => drop(parts.remove(at)),
            }
        }
        let text = parts.concat();
        if let Ok(case) = Case::read(&source(&text), &[]) {
            Case::exact(&source(&text), &[]).unwrap();
            let again = Case::read(&source(&case.resolved()), &[]);
            prop_assert_eq!(again.map_err(|error| error.to_string()), Ok(case));
        }
    }
}

#[test]
fn case_trains_of_the_manual_is_valid() {
    let docs = include_str!("../../docs/2-your-case.md");
    let (_, from) = docs.split_once("```toml\n").unwrap();
    let (text, after) = from.split_once("```").unwrap();
    assert!(after.contains("friction.regularisation={function=\"tanh\", speed=\"1 mm/s\"}"));
    assert_eq!(parse(text).system.contact, ContactLaw::StickSlip);
    let smooth = Override::parse("friction.regularisation={function=\"tanh\", speed=\"1 mm/s\"}").unwrap();
    let case = Case::read(&source(text), &[smooth]).unwrap();
    assert!(matches!(case.system.contact, ContactLaw::Regularised(_)));
}

#[test]
fn case_trains_keys_are_in_the_docs() {
    let docs = include_str!("../../docs/reference/keys.md");
    for key in train_keys() {
        let name = key.path.rsplit('.').next().unwrap();
        assert!(docs.contains(&format!("|`{name}`|")), "{}", key.path);
        assert!(!key.description.is_empty(), "{}", key.path);
        assert!(key.presence != schema::Presence::Default(""), "{}", key.path);
        assert!(schema::keys().all(|other| other.path != key.path), "{}", key.path);
    }
    for profile in ["ramp", "table", "sine", "cosine", "chirp", "sum"] {
        assert!(docs.contains(&format!("`{profile}`")), "{profile}");
    }
}

#[test]
fn case_trains_a_train_needs_a_shaft_to_what_holds_it() {
    insta::assert_snapshot!(refused(BRISTLES, "stiffness = [2.0]\n", ""), @r#"drive.toml:3: rotor.stiffness: missing: one is expected: one from the outermost inertia to the driven end; write stiffness = [...], numbers in N/m, or leave inertia out if the surface is itself driven"#);
    insta::assert_snapshot!(refused(VALID, "stiffness = 300.0\n", ""), @r#"drive.toml:12: stator.stiffness: missing: one is expected: one from the outermost inertia to the ground; write stiffness = [...], numbers in N m/rad, or write end = "free" if nothing holds it"#);
    insta::assert_snapshot!(refused(BRAKE, "stiffness = [\"6.822e7 lbf in/rad\"]\ndamping = [\"200 lbf in s/rad\"]\nend = \"free\"", "end = \"free\""), @r#"drive.toml:2: rotor.stiffness: missing: one is expected: one shaft between the 2 inertias; write stiffness = [...], numbers in N m/rad"#);
}

#[test]
fn case_trains_lists_have_the_length_of_the_train() {
    insta::assert_snapshot!(refused(VALID, "stiffness = [500.0, 80.0]", "stiffness = [500.0]"), @r#"drive.toml:5: rotor.stiffness: has one number, but 2 are expected: one shaft between the 2 inertias, and one from the outermost inertia to the driven end"#);
    insta::assert_snapshot!(refused(VALID, "damping = [0.5, 0.0]", "damping = 0.5"), @r#"drive.toml:6: rotor.damping: has one number, but 2 are expected: one shaft between the 2 inertias, and one from the outermost inertia to the driven end"#);
    insta::assert_snapshot!(refused(VALID, "stiffness = 300.0", "stiffness = [300.0, 1.0, 2.0]"), @r#"drive.toml:14: stator.stiffness: has 3 numbers, but one is expected: one from the outermost inertia to the ground"#);
    insta::assert_snapshot!(refused(VALID, "inertia = 0.2\n", ""), @r#"drive.toml:13: stator.stiffness: has one number, but none is expected: without inertia there is no shaft; remove it"#);
    insta::assert_snapshot!(refused(VALID, "rotor_twist = [0.01, 0.0]", "rotor_twist = [0.01]\nstator_speed = []"), @r#"
drive.toml:29: initial.rotor_twist: has one number, but 2 are expected: one for each shaft of the rotor
drive.toml:30: initial.stator_speed: has no number, but one is expected: one for each inertia of the stator
"#);
    insta::assert_snapshot!(refused(VALID, "stiffness = 300.0", "stiffness = 300.0\nviscous = [1, 2]"), @r#"drive.toml:15: stator.viscous: has 2 numbers, but one is expected: one for each inertia of the stator"#);
    insta::assert_snapshot!(refused(VALID, "stiffness = 300.0", "stiffness = { value = 3 }"), @r#"drive.toml:14: stator.stiffness: expected a list of numbers, each a torsional stiffness, N m/rad, but got a table"#);
}

#[test]
fn case_trains_inertia_is_positive_and_somewhere() {
    insta::assert_snapshot!(refused(VALID, "inertia = 0.2", "inertia = 0"), @r#"drive.toml:13: stator.inertia: must be greater than 0, but is 0.0"#);
    insta::assert_snapshot!(refused(VALID, "\"2 kg m^2\"]", "-2.0]"), @r#"drive.toml:4: rotor.inertia.1: must be greater than 0, but is -2.0"#);
    insta::assert_snapshot!(refused(VALID, "\"2 kg m^2\"]", "\"2 kg\"]"), @r#"drive.toml:4: rotor.inertia.1: expected a moment of inertia, kg m^2, but "2 kg" is a mass, kg"#);
    insta::assert_snapshot!(refused(BRAKE, "inertia = [\"0.1 slug in ft\", \"20 slug in ft\"]\nstiffness = [\"6.822e7 lbf in/rad\"]\ndamping = [\"200 lbf in s/rad\"]\nend = \"free\"", "end = \"free\""), @r#"drive.toml:2: rotor.inertia: missing: a surface without inertia moves as its far end does, and nothing says how a free end moves; write inertia = [...], or end = "fixed" or "driven""#);
    insta::assert_snapshot!(refused(SMOOTH, "inertia = [1.0]\nstiffness = [1.0]\n", ""), @r#"drive.toml:3: rotor.inertia: missing: no inertia anywhere, neither of the rotor nor of the stator: nothing moves but what is driven; give one of the trains an inertia"#);
}

#[test]
fn case_trains_ends_and_speeds_go_together() {
    insta::assert_snapshot!(refused(VALID, "end = \"fixed\"", "end = \"fixed\"\nspeed = 3"), @r#"drive.toml:16: stator.speed: belongs to a driven end, but end is "fixed": write end = "driven", or remove it; speeds at t = 0 are in [initial]"#);
    insta::assert_snapshot!(refused(VALID, "speed = { profile = \"ramp\", value = \"60 rpm\", rise_time = 2.0 }\n", ""), @r#"drive.toml:3: rotor.speed: missing: the speed of the driven end; write speed = a number in rad/s or "955 rpm", or a signal"#);
    insta::assert_snapshot!(refused(VALID, "end = \"fixed\"\n", ""), @r#"drive.toml:12: stator.end: missing: what holds the far end; write end = "free", "fixed" (to the ground) or "driven" (at a speed)"#);
    insta::assert_snapshot!(refused(VALID, "end = \"fixed\"", "end = \"fix\""), @r#"drive.toml:15: stator.end: expected one of "free", "fixed", "driven", but got "fix"; did you mean "fixed"?"#);
    insta::assert_snapshot!(refused(SMOOTH, "[rotor]\nend = \"driven\"\nspeed = \"200 mm/s\"\n", ""), @r#"drive.toml: rotor: missing: the train of the rotor; write [rotor] with inertia, stiffness and end, or with end = "fixed" alone for rigid ground"#);
}

#[test]
fn case_trains_torques_act_on_an_inertia_that_is_there() {
    insta::assert_snapshot!(refused(SMOOTH, "speed = \"200 mm/s\"", "speed = \"200 mm/s\"\ntorque = 3"), @r#"drive.toml:6: rotor.torque: a torque acts on an inertia, and the rotor has none: its end holds against any torque; remove it, or give inertia"#);
    insta::assert_snapshot!(refused(VALID, "torque_on = 0", "torque_on = 2"), @r#"drive.toml:10: rotor.torque_on: must be from 0 (the surface) to 1 (the outermost of 2 inertias), but is 2"#);
    insta::assert_snapshot!(refused(VALID, "stiffness = 300.0", "stiffness = 300.0\ntorque_on = 0"), @r#"drive.toml:15: stator.torque_on: there is no stator.torque that it is about: give one, or remove it"#);
    insta::assert_snapshot!(refused(VALID, "stiffness = 300.0", "stiffness = 300.0\ntorque = 1\ntorque_on = 1.5"), @r#"drive.toml:16: stator.torque_on: must be 0, the only inertia of the stator, but is the number 1.5"#);
}

#[test]
fn case_trains_one_thing_presses() {
    insta::assert_snapshot!(refused(BRAKE, "radius = \"2.0625 in\"", "radius = \"2.0625 in\"\nnormal_force = 10"), @r#"drive.toml:26: contact.normal_force: the normal force is given twice, with [axial]: keep either normal_force, or [axial] and [actuation]"#);
    insta::assert_snapshot!(refused(BRAKE, "radius = \"2.0625 in\"", "radius = \"2.0625 in\"\nouter_diameter = \"1 in\""), @r#"drive.toml:25: contact.radius: the radius is given twice, with contact.outer_diameter (drive.toml:26): keep either radius, or outer_diameter, inner_diameter and wear"#);
    insta::assert_snapshot!(refused(BRAKE, "radius = \"2.0625 in\"", "outer_diameter = \"1 in\"\ninner_diameter = \"4 in\"\nwear = \"uniform-wear\""), @r#"drive.toml:26: contact.inner_diameter: must be smaller than outer_diameter: 0.1016 m is not below 0.0254 m"#);
    insta::assert_snapshot!(refused(SMOOTH, "normal_force = 1.0\n", ""), @r#"drive.toml:12: contact.normal_force: missing: what presses the surfaces together; write normal_force = a number in N or "500 lbf" (or a signal), or give [axial] and [actuation]"#);
    insta::assert_snapshot!(refused(BRAKE, "[actuation]\nprofile = \"ramp\"\nforce = \"500 lbf\"\nrise_time = \"1 s\"\n", ""), @r#"drive.toml: actuation: missing: the axial mode presses by [axial] and [actuation]; write [actuation]"#);
    insta::assert_snapshot!(refused(BRAKE, "mass = \"10 lbm\"\n", ""), @r#"drive.toml:14: axial.mass: missing: m, the rotor mass; write mass = a number in kg or "10 lbm""#);
    insta::assert_snapshot!(refused(SMOOTH, "normal_force = 1.0", "normal_force = 1.0\nradius = 2"), @r#"drive.toml:14: contact.radius: has no meaning in translation, where friction is mu F_n: remove it"#);
    insta::assert_snapshot!(refused(VALID, "radius = 0.1\n", ""), @r#"drive.toml:17: contact.radius: missing: r, the effective friction radius; give radius, or outer_diameter, inner_diameter and wear"#);
}

#[test]
fn case_trains_a_chirp_is_read_and_written() {
    let sine = "{ profile = \"sine\", amplitude = 3.0, frequency = \"5 Hz\", from = 1.0, to = 4.0 }";
    let chirp = "{ profile = \"chirp\", amplitude = 3.0, start_frequency = 2, end_frequency = \"5 Hz\", duration = \"30 s\", mean = 1, phase = 0.5 }";
    let case = Case::read(&source(&VALID.replace(sine, chirp)), &[]).unwrap();
    let Drive::Wave(wave) = &case.system.rotor.torque.as_ref().unwrap().signal else {
        panic!();
    };
    let sweep = Frequency::Sweep {
        start: 2.0,
        end: 5.0,
        duration: 30.0,
    };
    assert_eq!(
        (wave.frequency, wave.mean, wave.amplitude, wave.phase),
        (sweep, 1.0, 3.0, 0.5)
    );
    // Written and read again, and changed by its keys.
    let again = Case::read(&source(&case.resolved()), &[]).unwrap();
    assert_eq!(again.system.rotor, case.system.rotor);
    let changed = Case::read(
        &source(&VALID.replace(sine, chirp)),
        &parsed(&["rotor.torque.end_frequency=7"]),
    )
    .unwrap();
    let Drive::Wave(wave) = &changed.system.rotor.torque.as_ref().unwrap().signal else {
        panic!();
    };
    assert!(matches!(wave.frequency, Frequency::Sweep { end: 7.0, .. }));
}

#[test]
fn case_trains_signals_are_checked_in_every_part() {
    insta::assert_snapshot!(refused(VALID, "time = [0.0, 1.0]", "time = [1.0, 0.0]"), @r#"drive.toml:19: contact.normal_force.signals.1.time.1: times must increase: 0.0 s follows 1.0 s"#);
    insta::assert_snapshot!(refused(VALID, "time = [0.0, 1.0]", "time = [0.0]"), @r#"drive.toml:19: contact.normal_force.signals.1.value: must be as long as contact.normal_force.signals.1.time: 2 values for 1 times"#);
    insta::assert_snapshot!(refused(VALID, "time = [0.0, 1.0]", "time = []"), @r#"
drive.toml:19: contact.normal_force.signals.1.time: must hold at least one time
drive.toml:19: contact.normal_force.signals.1.value: must be as long as contact.normal_force.signals.1.time: 2 values for 0 times
"#);
    insta::assert_snapshot!(refused(VALID, "frequency = \"5 Hz\"", "frequency = \"5 Hz\", angular_frequency = 3"), @r#"drive.toml:9: rotor.torque.angular_frequency: the frequency is given twice, with frequency: keep either frequency, in Hz, or angular_frequency, in rad/s"#);
    insta::assert_snapshot!(refused(VALID, "frequency = \"5 Hz\", ", ""), @r#"drive.toml:9: rotor.torque.frequency: missing: how fast the signal is; write frequency = a number in Hz or "50 Hz", or angular_frequency = a number in rad/s"#);
    insta::assert_snapshot!(refused(VALID, "frequency = \"5 Hz\"", "angular_frequency = \"5 Hz\""), @r#"drive.toml:9: rotor.torque.angular_frequency: "Hz" counts cycles, and is no unit of an angular velocity, rad/s: write rad/s, rev/s or rpm"#);
    insta::assert_snapshot!(refused(VALID, "frequency = \"5 Hz\"", "frequency = \"5 rad/s\""), @r#"drive.toml:9: rotor.torque.frequency: expected a frequency, Hz, but "5 rad/s" is an angular velocity, rad/s"#);
    insta::assert_snapshot!(refused(VALID, "frequency = \"5 Hz\"", "frequency = -5"), @r#"drive.toml:9: rotor.torque.frequency: must be greater than 0, but is -5.0"#);
    insta::assert_snapshot!(refused(VALID, "to = 4.0 }", "to = 0.5 }"), @r#"drive.toml:9: rotor.torque.to: must be after from: 0.5 s is not after 1.0 s"#);
    insta::assert_snapshot!(refused(VALID, "amplitude = 3.0", "amplitud = 3.0"), @r#"
drive.toml:9: rotor.torque.amplitud: unknown key; did you mean amplitude?
drive.toml:9: rotor.torque.amplitude: missing; write amplitude = a number in N m or "600 lbf in"
"#);
    insta::assert_snapshot!(refused(VALID, "amplitude = 3.0", "amplitude = 3.0, rise_time = 1"), @r#"drive.toml:9: rotor.torque.rise_time: belongs to profile "ramp", but the profile is "sine": remove it, or change the profile"#);
    insta::assert_snapshot!(refused(VALID, "amplitude = 3.0", "amplitude = \"3 N\""), @r#"drive.toml:9: rotor.torque.amplitude: expected a torque, N m, but "3 N" is a force, N"#);
    insta::assert_snapshot!(refused(VALID, "profile = \"ramp\", value", "value"), @r#"drive.toml:8: rotor.speed.profile: missing: what the signal is; write profile = "ramp" or "table" or "sine" or "cosine" or "chirp" or "sum", or a number instead of the table"#);
    insta::assert_snapshot!(refused(VALID, "profile = \"ramp\", value", "profile = \"ram\", value"), @r#"drive.toml:8: rotor.speed.profile: expected one of "ramp", "table", "sine", "cosine", "chirp", "sum", but got "ram"; did you mean "ramp"?"#);
    insta::assert_snapshot!(refused(VALID, "rise_time = 2.0", "rise_time = -2.0"), @r#"drive.toml:8: rotor.speed.rise_time: must not be negative, but is -2.0"#);
    insta::assert_snapshot!(refused(VALID, "signals = [100.0, {", "signals = [\"100\", {"), @r#"drive.toml:19: contact.normal_force.signals.0: "100" has no unit: write 100 without quotes if it is in N, or add the unit, such as "500 lbf""#);
    insta::assert_snapshot!(refused(VALID, "torque_on = 0", "torque_on = 0\nviscous = { profile = \"ramp\" }"), @r#"drive.toml:11: rotor.viscous: expected a list of numbers, each a torsional damping coefficient, N m s/rad, but got a table"#);
    insta::assert_snapshot!(refused(SMOOTH, "speed = \"200 mm/s\"", "speed = [1, 2]"), @r#"drive.toml:5: rotor.speed: expected a velocity, m/s, or a table with a profile, such as { profile = "table", time = [...], value = [...] }, but got an array"#);
}

#[test]
fn case_trains_friction_is_checked_as_of_the_brake() {
    insta::assert_snapshot!(refused(VALID, "breakaway = 0.5", "breakaway = 0.4"), @r#"drive.toml:23: friction.breakaway: must be at least friction.low_speed: 0.4 is below 0.5, and between the two torques neither stick nor slip is consistent; raise breakaway or lower low_speed"#);
    insta::assert_snapshot!(refused(VALID, "breakaway = 0.5\n", ""), @r#"drive.toml:21: friction.breakaway: missing: mu_0, friction coefficient at rest; at least low_speed; write breakaway = a number"#);
    insta::assert_snapshot!(refused(VALID, "law = \"stribeck\"", "law = \"stribek\""), @r#"drive.toml:22: friction.law: expected one of "exponential", "coulomb", "asymmetric", "hyperbolic", "stribeck", "polynomial", "table", "lugre", but got "stribek"; did you mean "stribeck"?"#);
    insta::assert_snapshot!(refused(VALID, "scale = 0.2", "scale = 0.2\ndecay = 3"), @r#"drive.toml:27: friction.decay: belongs to law "exponential", but the law is "stribeck": remove it, or change friction.law"#);
    insta::assert_snapshot!(refused(VALID, "scale = 0.2", "scale = 0.2\nexponent = 1.5"), @r#"drive.toml:27: friction.exponent: must be 1, 2, 3 or 4, but is 1.5: with any other the law has no Taylor series at standstill, where slips begin and end, and no method keeps its accuracy there; take a whole number, or law = "table" with points of the curve"#);
    insta::assert_snapshot!(refused(VALID, "law = \"stribeck\"\nbreakaway = 0.5\nlow_speed = 0.5\nhigh_speed = 0.3\nscale = 0.2\n\n[initial]\n", "law = \"polynomial\"\nbreakaway = 0.5\nlow_speed = 0.5\nlinear = -0.01\nvalid_below = 2.0\n\n[initial]\nrotor_speed = [5, 5]\n"), @r#"drive.toml:26: friction.valid_below: the friction law ends below the relative velocity at t = 0: 5.0 rad/s is not below 2.0 rad/s; start slower, raise valid_below if the law holds there, or take a law that is given at every speed"#);
    insta::assert_snapshot!(refused(SMOOTH, "scale = 0.3333333333333333", "scale = \"1 rad/s\""), @r#"drive.toml:19: friction.scale: expected a velocity, m/s, but "1 rad/s" is an angular velocity, rad/s"#);
    insta::assert_snapshot!(refused(VALID, "scale = 0.2", "scale = 0.2\nthreshold = 1"), @r#"drive.toml:27: friction.threshold: belongs to a contact without stick, a regularised one or one with bristles: a stick of this one needs no threshold; remove it"#);
    insta::assert_snapshot!(refused(VALID, "scale = 0.2", "scale = 0.2\nbristle_stiffness = 1"), @r#"drive.toml:27: friction.bristle_stiffness: belongs to law "lugre", but the law is "stribeck": remove it, or change friction.law"#);
}

#[test]
fn case_trains_contacts_without_stick_are_complete() {
    insta::assert_snapshot!(refused(BRISTLES, "viscous = 0.04", "viscous = 0.04\nregularisation = { function = \"tanh\", speed = 1e-3 }"), @r#"drive.toml:23: friction.regularisation: a contact with bristles is smooth already: remove regularisation, or change friction.law"#);
    insta::assert_snapshot!(refused(BRISTLES, "bristle_stiffness = \"1e4 1/m\"\n", ""), @r#"drive.toml:15: friction.bristle_stiffness: missing: sigma_0, stiffness of bristles over the normal force; write bristle_stiffness = a number in 1/m or "1e5 1/m""#);
    insta::assert_snapshot!(refused(BRISTLES, "bristle_stiffness = \"1e4 1/m\"", "bristle_stiffness = \"1e4 1/rad\""), @r#"drive.toml:20: friction.bristle_stiffness: expected a stiffness of bristles, 1/m, but "1e4 1/rad" is a stiffness of bristles, 1/rad"#);
    insta::assert_snapshot!(refused(BRISTLES, "scale = 0.001\n", ""), @r#"drive.toml:15: friction.scale: missing: x_s, sliding speed over which the friction coefficient falls; write scale = a number in m/s or "1 mm/s""#);
    insta::assert_snapshot!(refused(BRISTLES, "scale = 0.001", "scale = 0.001\ndecay = 3"), @r#"drive.toml:20: friction.decay: belongs to law "exponential", but the law is "lugre": remove it, or change friction.law"#);
    insta::assert_snapshot!(refused(BRISTLES, "high_speed = 0.1", "high_speed = 0"), @r#"drive.toml:18: friction.high_speed: must be greater than 0 with law "lugre": the bristles' rate is divided by it"#);
    insta::assert_snapshot!(refused(SMOOTH, "function = \"arctan\"", "function = \"atan\""), @r#"drive.toml:20: friction.regularisation.function: expected one of "tanh", "arctan", but got "atan"; did you mean "arctan"?"#);
    insta::assert_snapshot!(refused(SMOOTH, "function = \"arctan\", ", ""), @r#"drive.toml:20: friction.regularisation.function: missing: smooth function of omega_r/eps instead of its sign: no stick; write function = "tanh" or "arctan""#);
    insta::assert_snapshot!(refused(SMOOTH, ", speed = 1e-3", ""), @r#"drive.toml:20: friction.regularisation.speed: missing: eps, speed of the smooth function; write speed = a number in m/s or "1 mm/s""#);
    insta::assert_snapshot!(refused(SMOOTH, "speed = 1e-3", "speed = 0"), @r#"drive.toml:20: friction.regularisation.speed: must be greater than 0, but is 0.0"#);
    insta::assert_snapshot!(refused(SMOOTH, "speed = 1e-3", "speed = 1e-3, width = 3"), @r#"drive.toml:20: friction.regularisation.width: unknown key; [friction.regularisation] has function, speed"#);
}

#[test]
fn case_trains_the_start_and_kicks_are_possible() {
    insta::assert_snapshot!(refused(VALID, "rotor_twist = [0.01, 0.0]", "speed = 3"), @r#"drive.toml:29: initial.speed: is that of every inertia of a rotor with a free end, which this one has not: remove it, or give rotor_speed"#);
    insta::assert_snapshot!(refused(BRAKE, "speed = \"100 rad/s\"", "speed = \"100 rad/s\"\nrotor_speed = [100, 100]"), @r#"drive.toml:34: initial.speed: the speeds of the rotor are given twice, with initial.rotor_speed: keep one of them"#);
    insta::assert_snapshot!(refused(VALID, "time = 1.5", "time = \"instability\""), @r#"drive.toml:32: perturbation.0.time: no loss of stability that a kick could wait for: an end is driven, and sliding that is watched slows down by itself; give a time, in s"#);
    insta::assert_snapshot!(refused(SMOOTH, "[output]", "[[perturbation]]\ntime = 1\nrelative_velocity = 1\non = \"rotor\"\n\n[output]"), @r#"drive.toml:25: perturbation.0.on: the surface of the rotor has no inertia that a kick could move: kick the other one, or both"#);
    insta::assert_snapshot!(refused(VALID, "on = \"rotor\"", "on = \"roto\""), @r#"drive.toml:34: perturbation.0.on: expected one of "both", "rotor", "stator", but got "roto"; did you mean "rotor"?"#);
}

#[test]
fn case_trains_what_belongs_to_another_form_is_told() {
    insta::assert_snapshot!(refused(VALID, "[stator]", "[torsion]\nstiffness = 3\n\n[stator]"), @r#"drive.toml:12: torsion: beside [rotor] and [stator]: it is the short form of a rotor of two inertias and a stator of one; keep either [torsion], or [rotor] and [stator]"#);
    insta::assert_snapshot!(refused(VALID, "title = \"A drive\"", "title = \"A drive\"\nmotion = \"rolling\""), @r#"drive.toml:2: motion: expected one of "rotation", "translation", but got "rolling""#);
    // Without it the units and keys of the rest are unknown, so that nothing is said about them.
    insta::assert_snapshot!(refused(SMOOTH, "translation", "rolling"), @r#"drive.toml:1: motion: expected one of "rotation", "translation", but got "rolling""#);
    insta::assert_snapshot!(refused(VALID, "law = \"stribeck\"", "law = \"coulomb\"\nkinetic = 0.3\nviscous = 0.1\n"), @r#"
drive.toml:24: friction.viscous: belongs to law "stribeck" or "lugre", but the law is "coulomb": remove it, or change friction.law
drive.toml:27: friction.low_speed: belongs to law "exponential" or "hyperbolic" or "stribeck" or "polynomial" or "lugre", but the law is "coulomb": remove it, or change friction.law
drive.toml:28: friction.high_speed: belongs to law "exponential" or "hyperbolic" or "stribeck" or "lugre", but the law is "coulomb": remove it, or change friction.law
drive.toml:29: friction.scale: belongs to law "hyperbolic" or "stribeck" or "lugre", but the law is "coulomb": remove it, or change friction.law
"#);
    insta::assert_snapshot!(refused(VALID, "inertia = 0.2", "inertai = 0.2"), @r#"
drive.toml:13: stator.inertai: unknown key; did you mean stator.inertia?
drive.toml:14: stator.stiffness: has one number, but none is expected: without inertia there is no shaft; remove it
"#);
    insta::assert_snapshot!(refused(SMOOTH, "[contact]", "[contact]\nbreakaway_test = \"stator\""), @r#"drive.toml:13: contact.breakaway_test: belongs to a contact with stick, and this one has none: remove it"#);
    insta::assert_snapshot!(refused(VALID, "[output]", "[solver]\nmethod = \"paper\"\n\n[output]"), @r#"drive.toml:37: solver.method: method "paper" is the procedure of the paper for its two alike disks, a free rotor on a shaft and a surface on an equal shaft that ends in the ground, pressed by an axial motion: take another for this case"#);
    insta::assert_snapshot!(refused(VALID, "[output]", "[outputs]"), @r#"drive.toml:36: outputs: unknown key; did you mean output?"#);
    insta::assert_snapshot!(refused(VALID, "end_time = 10", "end_time = 1e15"), @r#"drive.toml:37: output.end_time: is too late for double precision: times near 1000000000000000.0 s are 2e-1 s apart, and the trains have oscillations with periods down to 6e-2 s; end earlier"#);
    insta::assert_snapshot!(refused(VALID, "end_time = 10", "end_time = 10\ninterval = 1e-12"), @r#"drive.toml:38: output.interval: asks for 1.0e13 samples, more than 1e9: raise the interval or end earlier"#);
    insta::assert_snapshot!(refused(VALID, "[stator]\ninertia = 0.2\nstiffness = 300.0\nend = \"fixed\"\n", "stator = 3\n"), @r#"
drive.toml:12: rotor.stator: unknown key; [rotor] has inertia, stiffness, damping, viscous, end, speed, torque, torque_on
drive.toml: stator: missing: the train of the stator; write [stator] with inertia, stiffness and end, or with end = "fixed" alone for rigid ground
"#);
}

/// `--set` sets one element of a list, whether the case contains the list, a number instead of a list of one, or
/// nothing.
#[test]
fn case_trains_elements_of_lists_are_set_by_their_index() {
    let with = |case: &str, changes: &[&str]| {
        let changes = parsed(changes);
        Case::read(&CaseSource::built_in(case).unwrap(), &changes).map_err(|error| error.to_string())
    };
    let groan = with(
        "groan",
        &[
            "rotor.inertia.1=1.3",
            "rotor.viscous.1=0.1",
            "initial.rotor_twist[1]=1 mrad",
        ],
    )
    .unwrap();
    let rotor = &groan.system.rotor;
    assert_eq!((&rotor.inertia, &rotor.viscous), (&vec![0.15, 1.3], &vec![0.0, 0.1]));
    assert_eq!(groan.system.initial.rotor_twist, [0.0, 1e-3]);
    // Elements that are not set turn with the driven end.
    let turning = with("groan", &["initial.rotor_speed.0=0.05"]).unwrap();
    assert_eq!(turning.system.initial.rotor_speed, [0.05, 0.1]);
    let belt = with("belt-leine", &["stator.inertia.0=2 kg", "stator.damping.0=0.1"]).unwrap();
    let found = (&belt.system.stator.inertia, &belt.system.stator.damping);
    assert_eq!(found, (&vec![2.0], &vec![0.1]));
    assert_eq!(Case::read(&source(&belt.resolved()), &[]).unwrap(), belt);
    for [change, words] in rows(
        "
        rotor.viscous.2=0.1 |
            --set rotor.viscous.2: there is no rotor.viscous.2: its elements are rotor.viscous.0 and rotor.viscous.1
        stator.viscous.1=0.1 | there is no stator.viscous.1: its one element is stator.viscous.0
        rotor.inertia.2=1 |
            --set rotor.inertia.2: there is no rotor.inertia.2: its elements are rotor.inertia.0 and rotor.inertia.1
        stator.inertia.1=1 | --set stator.inertia.1: there is no stator.inertia.1: its one element is stator.inertia.0
        rotor.viscous.0=-1 | rotor.viscous.0: must not be negative
        rotor.viscous.x=1 | expected a list of numbers
    ",
    ) {
        let said = with("groan", &[change]).unwrap_err();
        assert!(said.contains(words), "{words} in {said}");
    }
    let exact = [Override::parse("rotor.viscous.1=0.1").unwrap()];
    let exact = Case::exact(&CaseSource::built_in("groan").unwrap(), &exact)
        .unwrap()
        .system;
    assert_eq!(exact.rotor.viscous[1].to_string(), "1/10");
}

/// Both forms have samples around their events unless they say otherwise. A case stored in a file of a version
/// without the key is unchanged.
#[test]
fn regression_cases_of_either_form_have_samples_around_their_events() {
    let around = |source: &CaseSource, overrides: &[&str]| {
        let overrides = parsed(overrides);
        let case = Case::read(source, &overrides).unwrap();
        (case.output.follow.around, case.resolved())
    };
    let window = "output.window=[{from=0, to=1, interval=0.01}]";
    for name in ["paper", "belt-leine", "clutch", "lugre-slider"] {
        let source = CaseSource::built_in(name).unwrap();
        assert_eq!(around(&source, &["output.window=[]"]).0, Some(Around::Events), "{name}");
        assert_eq!(around(&source, &[window]).0, None, "{name}");
        let stated = ["output.window=[]", "output.around=\"none\""];
        let (none, resolved) = around(&source, &stated);
        assert_eq!(none, None, "{name}");
        // As stored by this version, and by a version without the key.
        let stored = |text: &str| CaseSource::result(&PathBuf::from("x.h5"), text.to_owned());
        let earlier: Vec<&str> = resolved.lines().filter(|line| !line.starts_with("around")).collect();
        assert!(earlier.len() + 1 == resolved.lines().count(), "{resolved}");
        assert_eq!(around(&stored(&resolved), &[]).0, None, "{name}");
        assert_eq!(around(&stored(&earlier.join("\n")), &[]).0, None, "{name}");
    }
}

/// Problems that would follow from the unknown law are not reported.
#[test]
fn case_of_a_misspelt_law_only_its_name_is_wrong() {
    let error = Case::read(
        &CaseSource::built_in("lugre-slider").unwrap(),
        &parsed(&["friction.law=lugr"]),
    )
    .unwrap_err();
    let keys: Vec<&str> = error.problems.iter().map(|problem| problem.key.as_str()).collect();
    assert_eq!(keys, ["friction.law"], "{error}");
}
