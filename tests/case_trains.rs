//! Cases of trains: what is read of them, and what is said about a wrong one: the file, the line, the key, and what to do.

use std::path::PathBuf;

use num_rational::BigRational;
use num_traits::ToPrimitive;
use stickslip::case::{COMMANDS_OF_TRAINS, Case, CaseSource, Motion, Origin, Override, TrainCase};
use stickslip::friction::{FrictionLaw, Law as _};
use stickslip::model::trains::{ContactLaw, End, KickSide, Pressing, Smoothing};
use stickslip::signal::{Drive, Frequency, Shape, Signal};

/// A case of rotation in which every kind of train and signal occurs; the tests break one thing at a time.
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

/// A block on a driven plate with a contact without stick.
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

/// LuGre's block.
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

/// The brake of the paper as trains.
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

fn parse(text: &str) -> TrainCase {
    TrainCase::parse(&source(text), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// The text with one thing in the place of another, which occurs once.
fn changed(text: &str, from: &str, to: &str) -> String {
    assert_eq!(text.matches(from).count(), 1, "{from:?} must occur once");
    text.replace(from, to)
}

/// What is said of a wrong case.
fn refused(text: &str, from: &str, to: &str) -> String {
    let text = changed(text, from, to);
    let read = TrainCase::parse(&source(&text), &[]);
    read.expect_err("the case must be refused").to_string()
}

#[test]
fn case_trains_are_read_with_units_signals_and_defaults() {
    let case = parse(VALID);
    assert_eq!((case.title.as_str(), case.motion), ("A drive", Motion::Rotation));
    let trains = &case.parameters;
    assert_eq!(trains.rotor.inertia, [0.1, 2.0]);
    assert_eq!(trains.rotor.viscous, [0.0, 0.0]);
    assert_eq!(
        (&trains.stator.inertia, &trains.stator.damping),
        (&vec![0.2], &vec![0.0])
    );
    assert_eq!(trains.stator.end, End::Fixed);
    let End::Driven(Drive::Linear(Signal::Ramp(ramp))) = &trains.rotor.end else {
        panic!("{:?}", trains.rotor.end)
    };
    assert_eq!((ramp.value, ramp.rise_time), (std::f64::consts::TAU, 2.0));
    let torque = trains.rotor.torque.as_ref().unwrap();
    let Drive::Wave(wave) = &torque.signal else {
        panic!("{:?}", torque.signal)
    };
    assert_eq!(
        (torque.on, wave.shape, wave.amplitude, wave.mean),
        (0, Shape::Sine, 3.0, 0.0)
    );
    assert_eq!(
        (wave.frequency, wave.from, wave.to),
        (Frequency::Cycles(5.0), Some(1.0), Some(4.0))
    );
    assert!(matches!(&trains.pressing, Pressing::Force(Drive::Sum(terms)) if terms.len() == 2));
    assert_eq!(trains.contact, ContactLaw::StickSlip);
    assert_eq!(case.threshold, None);
    assert_eq!(trains.initial.rotor_twist, [0.01, 0.0]);
    // The ramp starts from rest.
    assert_eq!(trains.initial.rotor_speed, [0.0, 0.0]);
    assert_eq!((trains.kicks[0].on, trains.kicks[0].time), (KickSide::Rotor, 1.5));
    assert_eq!(case.output.interval, 0.01);
}

#[test]
fn case_trains_without_stick_have_a_threshold_and_need_no_breakaway() {
    let case = parse(SMOOTH);
    assert_eq!(case.motion, Motion::Translation);
    let ContactLaw::Regularised(regularisation) = &case.parameters.contact else {
        panic!("{:?}", case.parameters.contact)
    };
    assert_eq!(
        (regularisation.function, regularisation.speed),
        (Smoothing::Arctan, 1e-3)
    );
    assert_eq!(
        (case.threshold, case.parameters.breakaway, case.parameters.radius),
        (Some(0.01), 1.0, 1.0)
    );
    assert_eq!(case.parameters.rotor.end, End::Driven(Drive::Value(0.2)));

    let case = parse(BRISTLES);
    let ContactLaw::Bristles(bristles) = &case.parameters.contact else {
        panic!("{:?}", case.parameters.contact)
    };
    assert_eq!(
        (bristles.stiffness, bristles.damping, bristles.viscous),
        (1e4, 30.0, 0.04)
    );
    // g is Stribeck's without the viscous part, which is the bristles' sigma_2.
    assert!(matches!(case.parameters.law, FrictionLaw::Stribeck(_)));
    assert_eq!(case.parameters.law.number("viscous"), Some(0.0));
    assert_eq!((case.threshold, case.parameters.breakaway), (Some(1e-4), 0.15));
    // Its block turns with the driven end.
    assert_eq!(case.parameters.initial.rotor_speed, [0.1]);
    let case = parse(&changed(
        SMOOTH,
        "[output]",
        "[[perturbation]]\ntime = 1\nrelative_velocity = \"1 mm/s\"\n\n[output]",
    ));
    assert_eq!(case.parameters.kicks[0].relative_velocity, 1e-3);
}

#[test]
fn case_trains_say_the_numbers_of_the_brake() {
    let paper = Case::parse(&CaseSource::built_in("paper").unwrap(), &[])
        .unwrap()
        .parameters;
    let case = parse(BRAKE);
    let trains = &case.parameters;
    assert_eq!(
        trains.rotor.inertia,
        [paper.torsion.surface_inertia, paper.torsion.rotor_inertia]
    );
    assert_eq!(trains.stator.stiffness, [paper.torsion.stiffness]);
    assert_eq!(trains.initial.rotor_speed, [100.0, 100.0]);
    assert_eq!(trains.radius, paper.contact.radius);
    let Pressing::Axial { axial, actuation } = &trains.pressing else {
        panic!("{:?}", trains.pressing)
    };
    assert_eq!(
        (axial.mass, axial.ringing_floor, actuation),
        (paper.axial.mass, paper.axial.ringing_floor, &paper.actuation)
    );
    let exact = TrainCase::exact_parameters(&source(BRAKE), &[]).unwrap();
    let brake = Case::exact_parameters(&CaseSource::built_in("paper").unwrap(), &[]).unwrap();
    assert_eq!(
        exact.rotor.inertia,
        [brake.surface_inertia.clone(), brake.rotor_inertia]
    );
    assert_eq!(
        (exact.rotor.damping, exact.stator.viscous),
        (vec![brake.torsional_damping], vec![BigRational::default()])
    );
    assert_eq!(
        (exact.radius, exact.breakaway, exact.law),
        (brake.radius, brake.breakaway, brake.law)
    );
    assert_eq!(exact.initial.rotor_speed, [brake.speed.clone(), brake.speed]);
    assert_eq!(Some(&exact.kicks[0].time), brake.kicks[0].time.as_ref());
}

#[test]
fn case_trains_read_back_from_their_resolved_text() {
    for text in [VALID, SMOOTH, BRISTLES, BRAKE] {
        let case = parse(text);
        let resolved = case.resolved();
        let again = TrainCase::parse(&source(&resolved), &[]).unwrap_or_else(|error| panic!("{error}\n{resolved}"));
        assert_eq!(
            again,
            TrainCase {
                title: again.title.clone(),
                ..case.clone()
            },
            "{resolved}"
        );
        assert_eq!(again.resolved(), resolved);
    }
}

#[test]
fn case_trains_exact_numbers_round_to_the_doubles() {
    for text in [VALID, SMOOTH, BRISTLES, BRAKE] {
        let case = parse(text).parameters;
        let exact = TrainCase::exact_parameters(&source(text), &[]).unwrap();
        let round = |number: &BigRational| number.to_f64().unwrap();
        let all = |numbers: &[BigRational]| numbers.iter().map(round).collect::<Vec<f64>>();
        for (train, exact) in [(&case.rotor, &exact.rotor), (&case.stator, &exact.stator)] {
            assert_eq!(all(&exact.inertia), train.inertia);
            assert_eq!(all(&exact.stiffness), train.stiffness);
            assert_eq!(all(&exact.damping), train.damping);
            assert_eq!(all(&exact.viscous), train.viscous);
        }
        let drives = exact
            .drives()
            .into_iter()
            .map(|drive| drive.map(round))
            .collect::<Vec<_>>();
        assert_eq!(drives.iter().collect::<Vec<_>>(), case.drives());
        assert_eq!(all(&exact.initial.rotor_speed), case.initial.rotor_speed);
        assert_eq!(all(&exact.initial.rotor_twist), case.initial.rotor_twist);
        assert_eq!(
            (round(&exact.radius), round(&exact.breakaway)),
            (case.radius, case.breakaway)
        );
        assert_eq!(exact.law.rounded(), case.law);
    }
}

/// What turns with a driven end has its speed to the last digit, or it would slip at once.
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
        let case = parse(&text).parameters;
        let exact = TrainCase::exact_parameters(&source(&text), &[]).unwrap();
        let End::Driven(drive) = &case.rotor.end else { panic!() };
        assert_eq!(case.initial.rotor_speed, [drive.at_start(); 2]);
        let [speed, other] = &exact.initial.rotor_speed[..] else {
            panic!()
        };
        assert_eq!(speed, other);
        // Revolutions to 40 digits, so that the rational is no double's.
        let rpm = |count: i64| {
            let case = changed(VALID, "value = \"60 rpm\"", &format!("value = \"{count} rpm\""));
            let exact = TrainCase::exact_parameters(&source(&case), &[]).unwrap();
            let End::Driven(Drive::Linear(Signal::Ramp(ramp))) = exact.rotor.end else {
                panic!()
            };
            ramp.value
        };
        let expected = match drive {
            Drive::Linear(Signal::Table(_)) => rpm(1) + (rpm(5) - rpm(1)) / BigRational::from_integer(3.into()),
            _ => rpm(7),
        };
        assert_eq!(*speed, expected);
    }
}

#[test]
fn case_trains_take_overrides_and_numbers_by_path() {
    let change = |text: &str| Override::parse(text).unwrap();
    let case = TrainCase::parse(
        &source(VALID),
        &[change("rotor.inertia.1=3"), change("stator.viscous=0.5")],
    )
    .unwrap();
    assert_eq!(
        (case.parameters.rotor.inertia[1], &case.parameters.stator.viscous),
        (3.0, &vec![0.5])
    );
    assert_eq!(case.number("rotor.inertia.1").unwrap(), 3.0);
    assert_eq!(case.number("contact.normal_force.signals.1.value.1").unwrap(), 50.0);
    let heavier = case.with_number("rotor.inertia.1", 4.0).unwrap();
    assert_eq!(heavier.parameters.rotor.inertia, [0.1, 4.0]);
    assert!(case.number("rotor.inertia.2").is_err());
    let wrong = case.with_number("rotor.inertia.1", -4.0).unwrap_err().to_string();
    assert_eq!(wrong, "--set rotor.inertia.1: must be greater than 0, but is -4.0");
}

#[test]
fn case_trains_are_told_from_brakes() {
    let paper = CaseSource::built_in("paper").unwrap();
    assert!(!TrainCase::is_one(&paper, &[]));
    assert!(TrainCase::is_one(&source(VALID), &[]));
    assert!(!TrainCase::is_one(&source("rotor = = 1"), &[]));
    let rotor = Override::parse("rotor.end=fixed").unwrap();
    assert!(TrainCase::is_one(&paper, std::slice::from_ref(&rotor)));
    let said = Case::parse(&source(VALID), &[]).unwrap_err().to_string();
    assert!(
        said.starts_with("drive.toml:3: rotor: a case of trains, [rotor] and [stator]"),
        "{said}"
    );
    assert!(
        said.ends_with(&format!("stickslip {}", COMMANDS_OF_TRAINS.join(" and "))),
        "{said}"
    );
    let said = Case::parse(&paper, &[rotor]).unwrap_err().to_string();
    assert!(
        said.starts_with("--set rotor.end: then rotor a case of trains"),
        "{said}"
    );
}

#[test]
fn collect() {
    let all = [
        (
            "a_train_needs_a_shaft_to_what_holds_it/0",
            BRISTLES,
            "stiffness = [2.0]\n",
            "",
        ),
        (
            "a_train_needs_a_shaft_to_what_holds_it/1",
            VALID,
            "stiffness = 300.0\n",
            "",
        ),
        (
            "a_train_needs_a_shaft_to_what_holds_it/2",
            BRAKE,
            "stiffness = [\"6.822e7 lbf in/rad\"]\ndamping = [\"200 lbf in s/rad\"]\nend = \"free\"",
            "end = \"free\"",
        ),
        (
            "lists_have_the_length_of_the_train/0",
            VALID,
            "stiffness = [500.0, 80.0]",
            "stiffness = [500.0]",
        ),
        (
            "lists_have_the_length_of_the_train/1",
            VALID,
            "damping = [0.5, 0.0]",
            "damping = 0.5",
        ),
        (
            "lists_have_the_length_of_the_train/2",
            VALID,
            "stiffness = 300.0",
            "stiffness = [300.0, 1.0, 2.0]",
        ),
        ("lists_have_the_length_of_the_train/3", VALID, "inertia = 0.2\n", ""),
        (
            "lists_have_the_length_of_the_train/4",
            VALID,
            "rotor_twist = [0.01, 0.0]",
            "rotor_twist = [0.01]\nstator_speed = []",
        ),
        (
            "lists_have_the_length_of_the_train/5",
            VALID,
            "stiffness = 300.0",
            "stiffness = 300.0\nviscous = [1, 2]",
        ),
        (
            "lists_have_the_length_of_the_train/6",
            VALID,
            "stiffness = 300.0",
            "stiffness = { value = 3 }",
        ),
        (
            "inertia_is_positive_and_somewhere/0",
            VALID,
            "inertia = 0.2",
            "inertia = 0",
        ),
        ("inertia_is_positive_and_somewhere/1", VALID, "\"2 kg m^2\"]", "-2.0]"),
        (
            "inertia_is_positive_and_somewhere/2",
            VALID,
            "\"2 kg m^2\"]",
            "\"2 kg\"]",
        ),
        (
            "inertia_is_positive_and_somewhere/3",
            BRAKE,
            "inertia = [\"0.1 slug in ft\", \"20 slug in ft\"]\nstiffness = [\"6.822e7 lbf in/rad\"]\ndamping = [\"200 lbf in s/rad\"]\nend = \"free\"",
            "end = \"free\"",
        ),
        (
            "inertia_is_positive_and_somewhere/4",
            SMOOTH,
            "inertia = [1.0]\nstiffness = [1.0]\n",
            "",
        ),
        (
            "ends_and_speeds_go_together/0",
            VALID,
            "end = \"fixed\"",
            "end = \"fixed\"\nspeed = 3",
        ),
        (
            "ends_and_speeds_go_together/1",
            VALID,
            "speed = { profile = \"ramp\", value = \"60 rpm\", rise_time = 2.0 }\n",
            "",
        ),
        ("ends_and_speeds_go_together/2", VALID, "end = \"fixed\"\n", ""),
        (
            "ends_and_speeds_go_together/3",
            VALID,
            "end = \"fixed\"",
            "end = \"fix\"",
        ),
        (
            "ends_and_speeds_go_together/4",
            SMOOTH,
            "[rotor]\nend = \"driven\"\nspeed = \"200 mm/s\"\n",
            "",
        ),
        (
            "torques_act_on_an_inertia_that_is_there/0",
            SMOOTH,
            "speed = \"200 mm/s\"",
            "speed = \"200 mm/s\"\ntorque = 3",
        ),
        (
            "torques_act_on_an_inertia_that_is_there/1",
            VALID,
            "torque_on = 0",
            "torque_on = 2",
        ),
        (
            "torques_act_on_an_inertia_that_is_there/2",
            VALID,
            "stiffness = 300.0",
            "stiffness = 300.0\ntorque_on = 0",
        ),
        (
            "torques_act_on_an_inertia_that_is_there/3",
            VALID,
            "stiffness = 300.0",
            "stiffness = 300.0\ntorque = 1\ntorque_on = 1.5",
        ),
        (
            "one_thing_presses/0",
            BRAKE,
            "radius = \"2.0625 in\"",
            "radius = \"2.0625 in\"\nnormal_force = 10",
        ),
        (
            "one_thing_presses/1",
            BRAKE,
            "radius = \"2.0625 in\"",
            "radius = \"2.0625 in\"\nouter_diameter = \"1 in\"",
        ),
        (
            "one_thing_presses/2",
            BRAKE,
            "radius = \"2.0625 in\"",
            "outer_diameter = \"1 in\"\ninner_diameter = \"4 in\"\nwear = \"uniform-wear\"",
        ),
        ("one_thing_presses/3", SMOOTH, "normal_force = 1.0\n", ""),
        (
            "one_thing_presses/4",
            BRAKE,
            "[actuation]\nprofile = \"ramp\"\nforce = \"500 lbf\"\nrise_time = \"1 s\"\n",
            "",
        ),
        ("one_thing_presses/5", BRAKE, "mass = \"10 lbm\"\n", ""),
        (
            "one_thing_presses/6",
            SMOOTH,
            "normal_force = 1.0",
            "normal_force = 1.0\nradius = 2",
        ),
        ("one_thing_presses/7", VALID, "radius = 0.1\n", ""),
        (
            "signals_are_checked_in_every_part/0",
            VALID,
            "time = [0.0, 1.0]",
            "time = [1.0, 0.0]",
        ),
        (
            "signals_are_checked_in_every_part/1",
            VALID,
            "time = [0.0, 1.0]",
            "time = [0.0]",
        ),
        (
            "signals_are_checked_in_every_part/2",
            VALID,
            "time = [0.0, 1.0]",
            "time = []",
        ),
        (
            "signals_are_checked_in_every_part/3",
            VALID,
            "frequency = \"5 Hz\"",
            "frequency = \"5 Hz\", angular_frequency = 3",
        ),
        (
            "signals_are_checked_in_every_part/4",
            VALID,
            "frequency = \"5 Hz\", ",
            "",
        ),
        (
            "signals_are_checked_in_every_part/5",
            VALID,
            "frequency = \"5 Hz\"",
            "angular_frequency = \"5 Hz\"",
        ),
        (
            "signals_are_checked_in_every_part/6",
            VALID,
            "frequency = \"5 Hz\"",
            "frequency = \"5 rad/s\"",
        ),
        (
            "signals_are_checked_in_every_part/7",
            VALID,
            "frequency = \"5 Hz\"",
            "frequency = -5",
        ),
        ("signals_are_checked_in_every_part/8", VALID, "to = 4.0 }", "to = 0.5 }"),
        (
            "signals_are_checked_in_every_part/9",
            VALID,
            "amplitude = 3.0",
            "amplitud = 3.0",
        ),
        (
            "signals_are_checked_in_every_part/10",
            VALID,
            "amplitude = 3.0",
            "amplitude = 3.0, rise_time = 1",
        ),
        (
            "signals_are_checked_in_every_part/11",
            VALID,
            "amplitude = 3.0",
            "amplitude = \"3 N\"",
        ),
        (
            "signals_are_checked_in_every_part/12",
            VALID,
            "profile = \"ramp\", value",
            "value",
        ),
        (
            "signals_are_checked_in_every_part/13",
            VALID,
            "profile = \"ramp\", value",
            "profile = \"ram\", value",
        ),
        (
            "signals_are_checked_in_every_part/14",
            VALID,
            "rise_time = 2.0",
            "rise_time = -2.0",
        ),
        (
            "signals_are_checked_in_every_part/15",
            VALID,
            "signals = [100.0, {",
            "signals = [\"100\", {",
        ),
        (
            "signals_are_checked_in_every_part/16",
            VALID,
            "torque_on = 0",
            "torque_on = 0\nviscous = { profile = \"ramp\" }",
        ),
        (
            "signals_are_checked_in_every_part/17",
            SMOOTH,
            "speed = \"200 mm/s\"",
            "speed = [1, 2]",
        ),
        (
            "friction_is_checked_as_of_the_brake/0",
            VALID,
            "breakaway = 0.5",
            "breakaway = 0.4",
        ),
        ("friction_is_checked_as_of_the_brake/1", VALID, "breakaway = 0.5\n", ""),
        (
            "friction_is_checked_as_of_the_brake/2",
            VALID,
            "law = \"stribeck\"",
            "law = \"stribek\"",
        ),
        (
            "friction_is_checked_as_of_the_brake/3",
            VALID,
            "scale = 0.2",
            "scale = 0.2\ndecay = 3",
        ),
        (
            "friction_is_checked_as_of_the_brake/4",
            VALID,
            "scale = 0.2",
            "scale = 0.2\nexponent = 1.5",
        ),
        (
            "friction_is_checked_as_of_the_brake/5",
            VALID,
            "law = \"stribeck\"\nbreakaway = 0.5\nlow_speed = 0.5\nhigh_speed = 0.3\nscale = 0.2\n\n[initial]\n",
            "law = \"polynomial\"\nbreakaway = 0.5\nlow_speed = 0.5\nlinear = -0.01\nvalid_below = 2.0\n\n[initial]\nrotor_speed = [5, 5]\n",
        ),
        (
            "friction_is_checked_as_of_the_brake/6",
            SMOOTH,
            "scale = 0.3333333333333333",
            "scale = \"1 rad/s\"",
        ),
        (
            "friction_is_checked_as_of_the_brake/7",
            VALID,
            "scale = 0.2",
            "scale = 0.2\nthreshold = 1",
        ),
        (
            "friction_is_checked_as_of_the_brake/8",
            VALID,
            "scale = 0.2",
            "scale = 0.2\nbristle_stiffness = 1",
        ),
        (
            "contacts_without_stick_are_complete/0",
            BRISTLES,
            "viscous = 0.04",
            "viscous = 0.04\nregularisation = { function = \"tanh\", speed = 1e-3 }",
        ),
        (
            "contacts_without_stick_are_complete/1",
            BRISTLES,
            "bristle_stiffness = \"1e4 1/m\"\n",
            "",
        ),
        (
            "contacts_without_stick_are_complete/2",
            BRISTLES,
            "bristle_stiffness = \"1e4 1/m\"",
            "bristle_stiffness = \"1e4 1/rad\"",
        ),
        ("contacts_without_stick_are_complete/3", BRISTLES, "scale = 0.001\n", ""),
        (
            "contacts_without_stick_are_complete/4",
            BRISTLES,
            "scale = 0.001",
            "scale = 0.001\ndecay = 3",
        ),
        (
            "contacts_without_stick_are_complete/5",
            BRISTLES,
            "high_speed = 0.1",
            "high_speed = 0",
        ),
        (
            "contacts_without_stick_are_complete/6",
            SMOOTH,
            "function = \"arctan\"",
            "function = \"atan\"",
        ),
        (
            "contacts_without_stick_are_complete/7",
            SMOOTH,
            "function = \"arctan\", ",
            "",
        ),
        ("contacts_without_stick_are_complete/8", SMOOTH, ", speed = 1e-3", ""),
        (
            "contacts_without_stick_are_complete/9",
            SMOOTH,
            "speed = 1e-3",
            "speed = 0",
        ),
        (
            "contacts_without_stick_are_complete/10",
            SMOOTH,
            "speed = 1e-3",
            "speed = 1e-3, width = 3",
        ),
        (
            "the_start_and_kicks_are_possible/0",
            VALID,
            "rotor_twist = [0.01, 0.0]",
            "speed = 3",
        ),
        (
            "the_start_and_kicks_are_possible/1",
            BRAKE,
            "speed = \"100 rad/s\"",
            "speed = \"100 rad/s\"\nrotor_speed = [100, 100]",
        ),
        (
            "the_start_and_kicks_are_possible/2",
            VALID,
            "time = 1.5",
            "time = \"instability\"",
        ),
        (
            "the_start_and_kicks_are_possible/3",
            SMOOTH,
            "[output]",
            "[[perturbation]]\ntime = 1\nrelative_velocity = 1\non = \"rotor\"\n\n[output]",
        ),
        (
            "the_start_and_kicks_are_possible/4",
            VALID,
            "on = \"rotor\"",
            "on = \"roto\"",
        ),
        (
            "what_belongs_to_another_form_is_told/0",
            VALID,
            "[stator]",
            "[torsion]\nstiffness = 3\n\n[stator]",
        ),
        (
            "what_belongs_to_another_form_is_told/1",
            VALID,
            "title = \"A drive\"",
            "title = \"A drive\"\nmotion = \"rolling\"",
        ),
        (
            "what_belongs_to_another_form_is_told/2",
            VALID,
            "inertia = 0.2",
            "inertai = 0.2",
        ),
        (
            "what_belongs_to_another_form_is_told/3",
            VALID,
            "radius = 0.1",
            "radius = 0.1\nbreakaway_test = \"stator\"",
        ),
        (
            "what_belongs_to_another_form_is_told/4",
            VALID,
            "[output]",
            "[solver]\nmethod = \"paper\"\n\n[output]",
        ),
        ("what_belongs_to_another_form_is_told/5", VALID, "[output]", "[outputs]"),
        (
            "what_belongs_to_another_form_is_told/6",
            VALID,
            "end_time = 10",
            "end_time = 1e15",
        ),
        (
            "what_belongs_to_another_form_is_told/7",
            VALID,
            "end_time = 10",
            "end_time = 10\ninterval = 1e-12",
        ),
        (
            "what_belongs_to_another_form_is_told/8",
            VALID,
            "[stator]\ninertia = 0.2\nstiffness = 300.0\nend = \"fixed\"\n",
            "stator = 3\n",
        ),
    ];
    let mut map = serde_json::Map::new();
    for (key, base, from, to) in all {
        let text = changed(base, from, to);
        let said = match TrainCase::parse(&source(&text), &[]) {
            Ok(_) => "ACCEPTED".to_owned(),
            Err(e) => e.to_string(),
        };
        println!("--- {key}\n{said}");
        map.insert(key.to_owned(), said.into());
    }
    std::fs::write("/tmp/case_msgs.json", serde_json::to_string(&map).unwrap()).unwrap();
}
