//! `stickslip modes`.

use crate::common::cli::{Folder, json, says};
use crate::common::json::*;

#[test]
fn cli_modes_says_the_same_in_table_and_json() {
    let folder = Folder::new();
    let table = folder.clean("modes");
    let document = folder.json("modes paper");
    assert_eq!(document["stability"], "lost");
    assert_eq!(document["instability"]["onset_decided_by"], "perturbation");
    let time = document["instability"]["time"].number();
    says(
        &table,
        &[
            format!("{time:.9} s"),
            format!("{:.6} rad/s", document["critical_speed"].number()),
            format!("{:.2}", document["instability"]["growth_exponent"].number()),
            "4.1570 kHz".to_owned(),
            "the perturbation".to_owned(),
        ],
    );
    let states = document["states"].list();
    assert_eq!(states.len(), 6);
    assert_eq!(folder.names(), [""; 0]);
    // The table fits a terminal.
    assert!(table.lines().skip(1).all(|line| line.chars().count() <= 80), "{table}");
}

fn value(table: &str, name: &str) -> String {
    let line = table.lines().find(|line| line.starts_with(name));
    let line = line.unwrap_or_else(|| panic!("no {name} in {table}"));
    line[name.len()..].split_whitespace().next().unwrap().to_owned()
}

/// Loss of stability, growth and the cause of the onset for every built-in case. The forecast of `modes` must agree
/// with the events of `run`.
#[test]
fn cli_modes_agree_with_what_run_prints() {
    let folder = Folder::new();
    for (case, decided_by) in [
        ("paper", "perturbation"),
        ("paper-si", "perturbation"),
        ("unperturbed", "rounding"),
        ("release", "perturbation"),
    ] {
        let (report, warnings) = folder.ends(&["run", case, "-v"], 0);
        let table = folder.ok(&["modes", case, "-v"]);
        for (in_run, in_modes) in [
            ("loss of stability", "loss of stability (zero of the margin)"),
            ("growth exponent G", "growth exponent G"),
            ("onset of stick-slip", "first stick"),
            ("e-folds gained from the kick", "e-folds gained from the kick"),
            ("kick above rounding, e-folds", "kick above rounding, e-folds"),
        ] {
            assert_eq!(value(&report, in_run), value(&table, in_modes), "{case}: {in_run}");
        }
        assert_eq!(
            folder.json(&["modes", case])["instability"]["onset_decided_by"],
            decided_by,
            "{case}"
        );
        let warned = warnings.contains("amplified rounding");
        assert_eq!(warned, decided_by == "rounding", "{case}: {warnings}");
    }
}

#[test]
fn cli_modes_of_a_result_are_those_of_its_case() {
    let folder = Folder::new();
    folder.ok("run paper-si -q");
    let of_case = folder.ok("modes paper-si");
    let of_file = folder.ok("modes paper-si.h5");
    assert_eq!(of_case, of_file);
}

#[test]
fn cli_modes_without_an_instability_says_why() {
    let folder = Folder::new();
    let table = folder.ok("modes --set friction.decay=0");
    assert!(table.contains("friction does not fall with speed"), "{table}");
    folder.refused("modes --set friction.decoy=0", &["friction.decoy"]);
}

/// A friction law that falls within 1e-5 rad/s. Before that the kick decays like any other, at c_t/2J = 1000 1/s. The
/// instability lasts for less than one oscillation.
#[test]
fn cli_modes_of_a_window_that_nothing_can_swing_up_in() {
    let folder = Folder::new();
    let steep = ["modes", "-v", "--set", "friction.decay=1e6"];
    let table = folder.ok(&steep);
    assert!(table.contains("shorter than one oscillation"), "{table}");
    assert!(table.contains("not counted: no oscillation fits in"), "{table}");
    // No rate of growth is printed, because it has no time to act. The other rates are those of the modes, some 1000
    // 1/s.
    let lines = table.lines().filter(|line| !line.starts_with("changed: "));
    let words = lines.flat_map(str::split_whitespace);
    let numbers = words.filter_map(|word| word.parse::<f64>().ok());
    assert!(numbers.filter(|number| *number > 1e4).count() == 0, "{table}");
    let document = folder.ok(&[&steep[..], &["--json"]].concat());
    let document = json(&document);
    let number = |name: &str| document["instability"][name].number();
    let expected = -1000.0 * (number("time") - 6.966);
    // The mode's share of the rotor, J/I, and one e-fold in the window.
    let gained = number("e_folds_gained");
    assert!((gained - expected).abs() < 0.05 * expected.abs(), "{gained} {expected}");
    assert!(number("smooth_end") - number("time") < document["natural_period"].number());
    let table = folder.ok("modes -v");
    assert!(!table.contains("shorter than one oscillation"), "{table}");
}

/// Each point of a friction table starts its own stick-slip.
#[test]
fn cli_modes_names_the_points_of_a_friction_table() {
    let folder = Folder::new();
    let table = "friction={law=\"table\", breakaway=0.6, speed=[0, 1], coefficient=[0.6, 0.3]}";
    let kick = "perturbation=[{kind=\"kick\", time=\"instability\", relative_velocity=1e-9}]";
    for (settings, words) in [
        (
            &["--set", table, "--set", "perturbation=[]"][..],
            "the points of the friction table",
        ),
        (
            &["--set", table, "--set", kick],
            "the perturbation or the points of the friction table",
        ),
    ] {
        let said = folder.ok(&[&["modes", "paper"], settings].concat());
        assert!(said.contains(words), "{said}");
        let document = folder.ok(&[&["modes", "paper", "--json"], settings].concat());
        assert_eq!(json(&document)["instability"]["onset_decided_by"], "friction-points");
    }
}

/// For systems in the general form, table and JSON agree, missing features are named, and no figure is offered.
#[test]
fn cli_modes_of_trains() {
    let folder = Folder::new();
    let table = folder.clean("modes belt-exponential -v");
    let document = folder.json("modes belt-exponential");
    assert_eq!(document["motion"], "translation");
    assert_eq!(document["operating_points"][0]["stability"], "unstable");
    let critical = &document["critical_relative_velocities"]["changes"][0];
    assert_eq!(critical["unstable_above"], false);
    says(
        &table,
        &[
            format!("{:.8}", critical["value"].number()),
            "omega_r, m/s".to_owned(),
            "steady sliding at  0.3 m/s".to_owned(),
            "1.59155".to_owned(),
            "stick mode: ".to_owned(),
            "axial mode: ".to_owned(),
        ],
    );
    assert!(!table.contains("rad"), "{table}");
    let changed = folder.ok("modes belt-exponential --set rotor.speed=0.5");
    assert!(changed.contains("stability          stable"), "{changed}");
    let turning = folder.ok("modes drill-string -v");
    assert!(turning.contains("rad/s") && turning.contains("N m"), "{turning}");
    let clutch = folder.ok("modes clutch");
    assert!(clutch.contains("not steady"), "{clutch}");
    folder.refused("modes clutch --figure modes.svg", &["--figure"]);
    folder.refused("modes paper --figure nowhere/modes.svg", &["another with --figure"]);
    assert_eq!(folder.names(), [""; 0]);
}

/// Every built-in case of the general form has its modes in a table that fits a terminal, apart from sentences.
#[test]
fn cli_modes_of_every_case_of_trains() {
    let folder = Folder::new();
    for case in stickslip::case::builtin::TRAINS {
        let (table, stderr) = folder.ends(&["modes", case.name, "-v"], 0);
        assert_eq!(stderr, "", "{}", case.name);
        assert!(!table.contains("NaN") && !table.contains("inf"), "{table}");
        let wide = table
            .lines()
            .skip(1)
            .find(|line| line.chars().count() > 80 && !line.contains(": "));
        assert_eq!(wide, None, "{}", case.name);
    }
}
