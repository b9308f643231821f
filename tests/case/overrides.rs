//! Values set from outside the file, and numbers read and set by their paths.

use crate::common::cases::parsed;
use crate::common::systems::ramp;
use proptest::prelude::*;
use stickslip::case::quantity::Dimension;
use stickslip::case::{Case, CaseNumber, CaseSource, Override, WrittenCase, schema};
use stickslip::model::system::{Kick, KickSide};
use stickslip::model::{BreakawayTest, KickTime, Parameters};
use stickslip::signal::{Signal, TimeTable};
use stickslip::simulation::{Method, OutputWindow, SolverOptions};

fn with(name: &str, overrides: &[&str]) -> Result<Case, String> {
    let overrides = parsed(overrides);
    Case::read(&CaseSource::built_in(name).unwrap(), &overrides).map_err(|error| error.to_string())
}

fn paper(overrides: &[&str]) -> Case {
    with("paper", overrides).unwrap_or_else(|error| panic!("{error}"))
}

fn refused(overrides: &[&str]) -> String {
    with("paper", overrides).expect_err("the overrides must be refused")
}

#[test]
fn a_number_is_si_and_text_is_a_quantity_with_or_without_quotes() {
    for text in [
        "torsion.damping=22.59696580552334",
        "torsion.damping=200 lbf in s/rad",
        "torsion.damping=\"200 lbf in s/rad\"",
        "torsion.damping = '200 lbf in s/rad'",
    ] {
        assert_eq!(paper(&[text]).system.rotor.damping[0], 22.59696580552334, "{text}");
    }
    assert_eq!(paper(&["axial.mass=.5"]).number("axial.mass").unwrap(), 0.5);
    assert_eq!(paper(&["axial.mass=5."]).number("axial.mass").unwrap(), 5.0);
    assert_eq!(paper(&["axial.mass=5"]).number("axial.mass").unwrap(), 5.0);
}

#[test]
fn the_last_of_two_overrides_holds() {
    let found = paper(&["axial.mass=1", "axial.mass=2"]).number("axial.mass").unwrap();
    assert_eq!(found, 2.0);
}

#[test]
fn keys_and_tables_absent_from_the_file_can_be_set() {
    let case = paper(&[
        "solver.method=cvode-bdf",
        "solver.rtol=1e-8",
        "solver.max_step=1 us",
        "output.steps=true",
        "title=Mine",
    ]);
    assert_eq!(case.solver.method, Method::CvodeBdf);
    assert_eq!((case.solver.rtol, case.solver.max_step), (1e-8, Some(1e-6)));
    assert!(case.output.steps);
    assert_eq!(case.title, "Mine");
    let found = paper(&["contact.breakaway_test=rotor"]).system.breakaway_test;
    assert_eq!(found, BreakawayTest::Rotor);
}

#[test]
fn elements_of_arrays_are_set_added_and_removed() {
    for text in "perturbation.0.relative_velocity=1e-5 perturbation[0].relative_velocity=1e-5".split(' ') {
        assert_eq!(paper(&[text]).system.kicks[0].relative_velocity, 1e-5, "{text}");
    }
    assert!(paper(&["perturbation=[]"]).system.kicks.is_empty());
    assert!(paper(&["output.window=[]"]).output.windows.is_empty());
    let added = paper(&[
        "perturbation.1.time=instability",
        "perturbation.1.relative_velocity=1e-7",
    ]);
    let kick = Kick {
        time: KickTime::Instability,
        relative_velocity: 1e-7,
        on: KickSide::Both,
    };
    assert_eq!(added.system.kicks[1], kick);
    let first = with(
        "unperturbed",
        &[
            "perturbation.0.time=instability",
            "perturbation[0].relative_velocity=1e-7",
        ],
    );
    assert_eq!(first.unwrap().system.kicks, [kick]);
    let replaced = paper(&["output.window=[{from=1, to=2, interval=\"1 ms\"}, {from=3, to=4}]"]);
    let window = |from, to| OutputWindow {
        from,
        to,
        interval: 1e-3,
    };
    assert_eq!(replaced.output.windows, [window(1.0, 2.0), window(3.0, 4.0)]);
    let table = with("release", &["actuation.force.1=\"100 lbf\"", "actuation.time[1]=0.2"]).unwrap();
    assert_eq!(table.number("actuation.force.1").unwrap(), 444.82216152605);
    assert_eq!(table.number("actuation.time.1").unwrap(), 0.2);
}

#[test]
fn whole_tables_are_replaced() {
    let step = paper(&["actuation={profile=\"ramp\", force=\"1 kN\", rise_time=0}"]);
    let expected = ramp(1000.0, 0.0);
    assert_eq!(Parameters::of(&step.system).unwrap().actuation, expected);
    let table = paper(&["actuation={profile=\"table\", time=[0, 1], force=[0, \"500 lbf\"]}"]);
    assert!(matches!(
        Parameters::of(&table.system).unwrap().actuation,
        Signal::TimeTable(TimeTable { .. })
    ));
    let diameters = paper(&["contact={outer_diameter=\"6 in\", inner_diameter=\"3 in\", wear=\"uniform-wear\"}"]);
    assert!((diameters.system.radius / (2.25 * 0.0254) - 1.0).abs() < 1e-15);
}

#[test]
fn the_sampling_interval_follows_the_end_where_it_is_not_given() {
    let case = paper(&["output={end_time=7.5}"]);
    assert_eq!((case.output.end_time, case.output.interval), (7.5, 7.5e-3));
    let case = paper(&["output={}"]);
    assert_eq!((case.output.end_time, case.output.interval), (10.0, 0.01));
}

#[test]
fn a_wrong_override_is_named_as_such() {
    insta::assert_snapshot!(refused(&["torsion.damping=200 lbf in"]), @r#"--set torsion.damping: expected a torsional damping coefficient, N m s/rad, but "200 lbf in" is a torque, N m"#);
    insta::assert_snapshot!(refused(&["torsion.dampin=200"]), @r#"--set torsion.dampin: unknown key; did you mean torsion.damping?"#);
    insta::assert_snapshot!(refused(&["axial.mass=-1"]), @r#"--set axial.mass: must be greater than 0, but is -1.0"#);
    insta::assert_snapshot!(refused(&["axial.mass=nan"]), @r#"--set axial.mass: must be finite, but is NaN"#);
    insta::assert_snapshot!(refused(&["axial.mass="]), @r#"--set axial.mass: "" is not a quantity: expected a mass, kg, such as "10 lbm""#);
    insta::assert_snapshot!(refused(&["axial.mass.x=1"]), @r#"--set axial.mass.x: axial.mass is the text "10 lbm", which has nothing inside"#);
    insta::assert_snapshot!(refused(&["axial=1"]), @r#"--set axial: expected a table, but got the number 1"#);
    insta::assert_snapshot!(refused(&["solver.method=euler"]), @r#"--set solver.method: expected one of "cvode", "arkode", "cvode-bdf", "cvode-adams", "erk", "esdirk", "series", "paper", "rk4" and 23 more (`stickslip case --keys KEY` lists them), but got "euler""#);
    insta::assert_snapshot!(refused(&["perturbation.2.time=1"]), @r#"--set perturbation.2.time: there is no perturbation.2: the next new element is perturbation.1"#);
    insta::assert_snapshot!(refused(&["perturbation.time=1"]), @r#"--set perturbation.time: perturbation is an array: its elements are numbered, as in perturbation.0"#);
    insta::assert_snapshot!(refused(&["perturbation.1.time=1"]), @r#"--set perturbation.1.time: then perturbation.1.relative_velocity is missing: delta, jump of omega_r, half on each surface; write relative_velocity = a number in rad/s or "955 rpm""#);
    insta::assert_snapshot!(refused(&["perturbation=none"]), @r#"--set perturbation: expected an array of tables: write [[perturbation]], or perturbation = []"#);
    insta::assert_snapshot!(refused(&["friction.breakaway=0.5"]), @r#"--set friction.breakaway: must be at least friction.low_speed: 0.5 is below 0.6, and between the two torques neither stick nor slip is consistent; raise breakaway or lower low_speed"#);
    insta::assert_snapshot!(refused(&["friction.low_speed=0.7"]), @r#"--set friction.low_speed: then friction.breakaway must be at least friction.low_speed: 0.6 is below 0.7, and between the two torques neither stick nor slip is consistent; raise breakaway or lower low_speed"#);
    insta::assert_snapshot!(refused(&["output.window.1.from=8"]), @r#"--set output.window.1.from: then output.window.1.to must be after from: 6.992 s is not after 8.0 s"#);
    insta::assert_snapshot!(refused(&["output.end_time=1e8"]), @r#"--set output.end_time: then output.interval asks for 1.0e10 samples, more than 1e9: raise the interval or end earlier"#);
    insta::assert_snapshot!(refused(&["axial={mass=1}"]), @r#"
--set axial: axial.stiffness: missing: k_e, equivalent axial stiffness; write stiffness = a number in N/m or "3.161e5 lbf/in"
--set axial: axial.damping: missing: c_a, axial damping; write damping = a number in N s/m or "50 lbf s/in"
"#);
    insta::assert_snapshot!(refused(&["axial={mass=1, stiffness=-1, damping=1}"]), @r#"--set axial: axial.stiffness: must be greater than 0, but is -1.0"#);
}

#[test]
fn an_override_that_would_switch_alternatives_says_how_to_do_it() {
    insta::assert_snapshot!(refused(&["contact.outer_diameter=6 in"]), @r#"--set contact.outer_diameter: the radius is given twice, with contact.radius (built-in case paper:31): replace the whole table, contact={outer_diameter=..., inner_diameter=..., wear="uniform-wear"}"#);
    insta::assert_snapshot!(refused(&["contact={outer_diameter=0.2, inner_diameter=0.1, wear=\"uniform-wear\"}", "contact.radius=0.05"]), @r#"--set contact.radius: the radius is given twice, with contact.outer_diameter (--set contact): replace the whole table, contact={radius=...}"#);
    insta::assert_snapshot!(refused(&["actuation.profile=table"]), @r#"--set actuation.profile: then actuation.rise_time belongs to profile "ramp", but the profile is "table": replace the whole table, actuation={profile="table", time=[...], force=[...]}"#);
    insta::assert_snapshot!(refused(&["actuation.time=[0, 1]"]), @r#"--set actuation.time: belongs to profile "table", but the profile is "ramp": replace the whole table, actuation={profile="table", time=[...], force=[...]}"#);
}

#[test]
fn a_path_of_any_length_is_an_error_and_no_overflow() {
    let deep = format!("{}=1", vec!["a"; 100_000].join("."));
    assert!(refused(&[&deep]).ends_with("unknown key"));
    let nested = format!("title={}", "[".repeat(100_000));
    assert_eq!(paper(&[&nested]).title, "[".repeat(100_000));
}

#[test]
fn an_override_without_key_or_value_is_refused_at_once() {
    let refused = |text: &str| Override::parse(text).unwrap_err().to_string();
    insta::assert_snapshot!(refused("torsion.damping"), @r#"--set torsion.damping: expected KEY=VALUE, such as torsion.damping=22.6"#);
    insta::assert_snapshot!(refused("=1"), @r#"--set =1: "" is not a key: expected a dotted path, such as torsion.damping"#);
    insta::assert_snapshot!(refused("torsion..damping=1"), @r#"--set torsion..damping=1: "torsion..damping" is not a key: expected a dotted path, such as torsion.damping"#);
    insta::assert_snapshot!(refused(""), @r#"--set : expected KEY=VALUE, such as torsion.damping=22.6"#);
}

#[test]
fn every_number_of_a_case_can_be_moved_by_its_path() {
    for name in ["paper", "release"] {
        let case = WrittenCase::of(&with(name, &["solver.atol_rate=1e-9"]).unwrap());
        assert!(case.numbers().len() >= 17);
        for CaseNumber { path, value, .. } in case.numbers() {
            assert_eq!(case.case().number(path).unwrap(), *value, "{path}");
            // Such a small change violates no condition, except that breakaway must not fall below low_speed.
            let after = if path.ends_with("low_speed") {
                value * (1.0 - 1e-9)
            } else {
                value * (1.0 + 1e-9)
            };
            let moved = case.with(path, after).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(moved.number(path).unwrap(), after, "{path}");
        }
    }
}

#[test]
fn moving_numbers_equals_overriding_them() {
    let case = WrittenCase::of(&paper(&[]));
    let moved = case.with_all(&[
        ("friction.decay", 4.0),
        ("perturbation.0.time", 6.95),
        ("solver.max_step", 1e-5),
    ]);
    let expected = paper(&["friction.decay=4", "perturbation.0.time=6.95", "solver.max_step=1e-5"]);
    assert_eq!(moved.unwrap(), expected);
    let number = [Override::number("friction.decay", 4.0)];
    let overridden = Case::read(&CaseSource::built_in("paper").unwrap(), &number).unwrap();
    assert_eq!(overridden.system.law.as_exponential().unwrap().decay, 4.0);
}

#[test]
fn a_kick_at_the_instability_has_no_time_until_one_is_set() {
    let release = with("release", &[]).unwrap();
    insta::assert_snapshot!(release.number("perturbation.0.time").unwrap_err(), @r#"perturbation.0.time: the case has no number of that path"#);
    let moved = WrittenCase::of(&release).with("perturbation.0.time", 0.8).unwrap();
    assert_eq!(moved.system.kicks[0].time, KickTime::At(0.8));
}

#[test]
fn a_number_that_does_not_fit_is_refused() {
    let case = WrittenCase::of(&paper(&[]));
    let refused = |path: &str, value: f64| case.with(path, value).unwrap_err();
    insta::assert_snapshot!(refused("axial.mass", -1.0), @r#"--set axial.mass: must be greater than 0, but is -1.0"#);
    insta::assert_snapshot!(refused("friction.low_speed", 0.7), @r#"--set friction.low_speed: then friction.breakaway must be at least friction.low_speed: 0.6 is below 0.7, and between the two torques neither stick nor slip is consistent; raise breakaway or lower low_speed"#);
    insta::assert_snapshot!(refused("axial.mas", 1.0), @r#"--set axial.mas: unknown key; did you mean axial.mass?"#);
    insta::assert_snapshot!(refused("perturbation.2.time", 1.0), @r#"--set perturbation.2.time: there is no perturbation.2: the next new element is perturbation.1"#);
    insta::assert_snapshot!(paper(&[]).number("solver.max_step").unwrap_err(), @r#"solver.max_step: the case has no number of that path"#);
    insta::assert_snapshot!(paper(&[]).number("title").unwrap_err(), @r#"title: the case has no number of that path"#);
}

#[test]
fn the_schema_describes_every_key() {
    for key in schema::keys() {
        assert!(!key.description.is_empty(), "{}", key.path);
    }
    let unit = |path: &str| {
        schema::keys()
            .find(|key| key.path == path)
            .unwrap()
            .dimension()
            .map(Dimension::unit)
    };
    assert_eq!(unit("torsion.damping"), Some("N m s/rad"));
    assert_eq!(unit("friction.breakaway"), Some("1"));
    assert_eq!(unit("solver.method"), None);
}

#[test]
fn the_defaults_are_those_that_the_schema_promises() {
    let case = paper(&["solver={}", "output={}"]);
    assert_eq!(case.solver, SolverOptions::default());
    let promised = |path: &str| match schema::keys().find(|key| key.path == path).unwrap().presence {
        schema::Presence::Default(text) => text,
        other => panic!("{path}: {other:?}"),
    };
    assert_eq!(promised("solver.method"), case.solver.method.name());
    assert_eq!(promised("solver.rtol").parse(), Ok(case.solver.rtol));
    assert_eq!(promised("solver.max_events").parse(), Ok(case.solver.max_events));
    assert_eq!(promised("output.end_time"), format!("{} s", case.output.end_time));
    assert_eq!(promised("output.interval"), "end_time / 1000");
    assert_eq!(case.output.interval, case.output.end_time / 1000.0);
    assert_eq!(promised("output.steps").parse(), Ok(case.output.steps));
}

proptest! {
    #[test]
    fn property_no_override_panics(
        text in "\\PC*",
        path in "[a-z0-9.\\[\\]]{0,12}",
        index in 0..schema::keys().count(),
        value in "[-0-9a-z\"\\[\\]{}=., ]{0,12}",
    ) {
        let known = format!("{}={value}", schema::keys().nth(index).unwrap().path.replace("[]", ".0"));
        for text in [text, format!("{path}={value}"), known] {
            if let Ok(change) = Override::parse(&text) {
                let _ = Case::read(&CaseSource::built_in("paper").unwrap(), &[change]);
            }
        }
    }
}

/// A quantity that is written in another way, or in another unit, is the same.
#[test]
fn a_value_in_another_unit_is_no_difference() {
    let said = |there: &str, here: &str| {
        let of = |value: &str| format!("[torsion]\nstiffness = {value}\n");
        let differences = stickslip::case::differences(&of(there), &of(here));
        let words: Vec<String> = differences.iter().map(ToString::to_string).collect();
        words.join("; ")
    };
    assert_eq!(said("\"8e3 N m/rad\"", "8000"), "");
    assert_eq!(said("\"8 kN m/rad\"", "\"8000 N m/rad\""), "");
    assert_eq!(
        said("\"8 kN m/rad\"", "8001"),
        "torsion.stiffness = 8 kN m/rad there, 8001 N m/rad here"
    );
}
