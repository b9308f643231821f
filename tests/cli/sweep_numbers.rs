//! Values from `stickslip sweep` and `calibrate` against closed forms and single runs; keys, axes and quantities that
//! a base case does not have.

use crate::common::cases::built_in;
use crate::common::cli::{Folder, json, output, refusal, says};
use crate::common::json::*;
use crate::common::rows;
use std::f64::consts::PI;
use stickslip::sweep::{Existing, Journal, PointOutcome, QUANTITIES, STUDIES, Study, StudySource};

/// A mass on a belt with Coulomb friction that starts at rest relative to the belt. Slips and sticks have closed
/// forms.
const BELT: &str = r#"
title = "Coulomb belt"
case = "belt-coulomb"
set = { output.end_time = "20 s" }
axis = [
    { key = ["rotor.speed", "initial.stator_speed"], from = "0.05 m/s", to = "0.2 m/s", count = 4 },
    { key = "stator.stiffness.0", values = ["100 N/m", 400] },
]
keep = { events = true }
"#;

/// D = (mu_0 - mu_d) F_n = 1 N, m = 1 kg. Slips take (pi + 2 atan(v k/(w D)))/w and sticks 2 D/(k v). The spring
/// swings about mu_d F_n/k by hypot(D/k, v/w). These segments are linear, so that the events are exact to rounding.
#[test]
fn analytic_a_grid_of_coulomb_belts() {
    let folder = Folder::new();
    folder.write("belt.toml", BELT);
    let report = folder.json("sweep belt.toml");
    assert_eq!((&report["points"], &report["failed"]), (&8.into(), &0.into()));
    assert_eq!(report["unfinished"], 0);
    let file = folder.sweep_file("belt.h5");
    let numbers = |name: &str| file.numbers(name).unwrap();
    assert_eq!(file.shape("attractor_period").unwrap(), [4, 2]);
    for [place, attribute, text] in rows(
        "
        rotor_speed | units | m/s
        rotor_speed | keys | rotor.speed initial.stator_speed
        attractor_amplitude | units | m
        attractor_relative_velocity_max | units | m s-1
        motion | flag_meanings |
            periodic stuck not-periodic steady-slip steady-stick steady-separated steady-engaged
        events/relative_velocity | units | m s-1
        events/mode_after | flag_meanings | separated stick slip-forward slip-backward engaged
    ",
    ) {
        assert_eq!(
            file.text(&format!("{place}/{attribute}")).unwrap().as_deref(),
            Some(text),
            "{place}"
        );
    }
    assert_eq!(file.text("meta/motion").unwrap().as_deref(), Some("translation"));
    let references = file.text("references").unwrap();
    assert_eq!(references.as_deref(), Some("stickslip, docs/theory.md: Trains"));
    let (speeds, springs) = (numbers("rotor_speed"), numbers("stator_stiffness_0"));
    let names = "last_slip_duration last_stick_duration attractor_period attractor_amplitude attractor_sticks motion";
    let columns: Vec<Vec<f64>> = names.split(' ').map(numbers).collect();
    let [slip, stick, period, amplitude, sticks, motion] = &columns[..] else {
        panic!("{names}")
    };
    for (i, v) in speeds.iter().enumerate() {
        for (j, k) in springs.iter().enumerate() {
            let (point, w) = (2 * i + j, k.sqrt());
            let expected_slip = (PI + 2.0 * (v * k / w).atan()) / w;
            let expected_stick = 2.0 / (k * v);
            let near = |value: f64, expected: f64, what: &str| {
                let error = (value - expected).abs();
                assert!(error < 1e-11, "{what} at {v}, {k}: {value}, not {expected}");
            };
            near(slip[point], expected_slip, "slip");
            near(stick[point], expected_stick, "stick");
            near(period[point], expected_slip + expected_stick, "period");
            near(amplitude[point], (1.0 / k).hypot(v / w), "amplitude");
            assert_eq!((motion[point], sticks[point]), (0.0, 1.0));
        }
    }
    // A driven belt does not slow down by itself, so that there is no growth on the way.
    assert!(numbers("growth_exponent").iter().all(|value| value.is_nan()));
    assert!(numbers("noise_determined").iter().all(|value| *value == -1.0));
    assert!(numbers("stick_threshold").iter().all(|value| value.is_nan()));
    let stdout = folder.ok("check belt.h5");
    assert!(stdout.contains("all checksums agree"), "{stdout}");
}

/// Engagements of the built-in clutch without its engine's torque: whatever the force does, friction turns
/// J_1 J_2/(J_1 + J_2) omega^2/2 into heat until it locks. Slip is linear, so that the numbers hold to the tolerance of a run.
const ENGAGEMENTS: &str = r#"
case = "clutch"
set = { rotor.torque = 0, output.end_time = "3 s", solver.method = "series" }
axis = [
    { key = "initial.speed", from = "100 rad/s", to = "300 rad/s", count = 3 },
    { key = "rotor.inertia.0", from = 0.2, to = 0.4, count = 3 },
]
"#;

#[test]
fn analytic_what_a_clutch_heats_up_by() {
    let folder = Folder::new();
    let heat = |inertia: f64, speed: f64| 0.5 * inertia * 1.5 / (inertia + 1.5) * speed * speed;
    folder.write("grid.toml", ENGAGEMENTS);
    folder.json("sweep grid.toml");
    let file = folder.sweep_file("grid.h5");
    assert_eq!(file.text("dissipated_energy/units").unwrap().as_deref(), Some("J"));
    let found = file.numbers("dissipated_energy").unwrap();
    for (i, speed) in [100.0, 200.0, 300.0].into_iter().enumerate() {
        for (j, inertia) in [0.2, 0.3, 0.4].into_iter().enumerate() {
            let (found, expected) = (found[3 * i + j], heat(inertia, speed));
            let error = (found / expected - 1.0).abs();
            assert!(error < 1e-9, "{speed} {inertia}: {found}, not {expected}");
        }
    }
    // As a criterion: the speed at which 3 kJ are reached.
    let boundary = "boundary = { criterion = \"dissipated_energy >= 3000\", refinements = 0, width = 1e-9 }\n";
    folder.write("limit.toml", format!("{boundary}{ENGAGEMENTS}"));
    folder.json("sweep limit.toml");
    let file = folder.sweep_file("limit.h5");
    let column = |name: &str| file.numbers(&format!("boundary/{name}")).unwrap();
    let (speeds, inertias) = (column("initial_speed"), column("rotor_inertia_0"));
    assert!(speeds.len() >= 3);
    for (speed, inertia) in speeds.into_iter().zip(inertias) {
        assert!((heat(inertia, speed) / 3000.0 - 1.0).abs() < 1e-7, "{speed} {inertia}");
    }
    // As a target: the speed from which it heats up by as much.
    let target = "case = \"clutch\"\nset = { rotor.torque = 0 }\nfree = [{ key = \"initial.speed\", from = 100, to = 300 }]\n\
                  target = [{ quantity = \"dissipated_energy\", value = \"3.529 kJ\" }]\n";
    folder.write("target.toml", target);
    let report = folder.json("calibrate target.toml");
    let number = |name: &str| report["parameters"][0][name].number();
    assert!(number("least") < 200.0 && 200.0 < number("largest"), "{report}");
    assert!(number("largest") - number("least") < 0.04, "{report}");
    // In a file, where the column ends with it.
    folder.ok("run clutch --set rotor.torque=0 -q -o one.h5 --method series");
    let inspected = folder.json("inspect one.h5");
    let value = inspected["attributes"].with("name", "dissipated_energy")["value"].number();
    let run = folder.result("one.h5");
    let last = run.sample_count().unwrap() - 1;
    assert_eq!(value, run.column("dissipated_friction", last..last + 1).unwrap()[0]);
    assert!((value / heat(0.2, 200.0) - 1.0).abs() < 1e-9, "{value}");
}

/// A point in the journal of an earlier version keeps its numbers; one that this version did not have is NaN.
#[test]
fn regression_a_journal_without_the_latest_quantity_is_resumed() {
    let folder = Folder::new();
    let path = folder.write("grid.toml", ENGAGEMENTS);
    let study = Study::parse(StudySource::find(path.to_str().unwrap(), STUDIES).unwrap(), &[]).unwrap();
    let mut journal = Journal::open(&folder.path("grid.journal"), &study.digest(), Existing::Refuse).unwrap();
    let earlier = PointOutcome {
        number: 1,
        result: Ok(vec![1.0; QUANTITIES.len() - 1]),
        events: Vec::new(),
    };
    journal.append(&[earlier]).unwrap();
    drop(journal);
    folder.ok("sweep grid.toml --resume");
    let file = folder.sweep_file("grid.h5");
    let latest = file.numbers(QUANTITIES[QUANTITIES.len() - 1].name).unwrap();
    assert_eq!(file.numbers("onset_time").unwrap()[1], 1.0);
    assert!(latest[1].is_nan() && latest[0] > 0.0, "{latest:?}");
}

/// What a run does not have is NaN, or -1 of a count, and never 0: the mass begins in a slip that never ends.
/// The coefficient mu_d + (mu_s - mu_d) exp(-(v/v_s)^2) falls over a stretch of speeds alone: with the damping c of the mass steady
/// sliding is unstable where 2 (mu_s - mu_d) F_n v/v_s^2 exp(-(v/v_s)^2) is above c, between two speeds of the belt, and stable at both
/// ends of the axis. That changes with v by at least 3 N s^2/m^2 at all of the points, so that they hold to rounding.
#[test]
fn analytic_sliding_that_becomes_stable_again_has_two_limits() {
    let folder = Folder::new();
    let study = r#"
case = "belt-exponential"
boundary = { criterion = "stick_count >= 1", refinements = 0, width = 0.1 }
axis = [
    { key = "rotor.speed", from = 0.01, to = 2, count = 9 },
    { key = "stator.damping.0", from = 0.5, to = 2.9, count = 3 },
]
[set]
solver.method = "series"
output.end_time = 2
friction = { law = "stribeck", breakaway = 0.4, low_speed = 0.4, high_speed = 0.2, scale = 0.5 }
contact.normal_force = 10
"#;
    folder.write("two.toml", study);
    folder.json("sweep two.toml");
    let file = folder.sweep_file("two.h5");
    let column = |name: &str| file.numbers(&format!("stability_limit/{name}")).unwrap();
    let (speeds, dampings) = (column("rotor_speed"), column("stator_damping_0"));
    assert_eq!(speeds.len(), 2 * 61);
    // The steepest fall is at v_s/sqrt(2).
    let steepest = 0.5 / 2f64.sqrt();
    for (pair, c) in speeds.chunks(2).zip(dampings.chunks(2)) {
        let apart = c[0] == c[1] && pair[0] < steepest && steepest < pair[1];
        assert!(apart, "{pair:?} {c:?}");
        for v in pair {
            let fall = 2.0 * 0.2 * 10.0 * v / 0.25 * (-v * v / 0.25).exp();
            assert!((fall / c[0] - 1.0).abs() < 1e-12, "{v} {c:?}: {fall}");
        }
    }
}

#[test]
fn results_what_a_run_of_trains_does_not_have_is_absent() {
    let folder = Folder::new();
    // The mass begins in a slip that never ends, and its damping keeps the slip from being a free oscillation. Values
    // that the run does not have are NaN, or -1 for counts, and never 0.
    let study =
        "case = \"belt-coulomb\"\n[set]\nstator.damping = 0.5\n[[axis]]\nkey = \"rotor.speed\"\nvalues = [0.1, 0.2]\n";
    folder.write("slip.toml", study);
    folder.json("sweep slip.toml");
    let file = folder.sweep_file("slip.h5");
    let at = |name: &str| file.numbers(name).unwrap()[1];
    assert_eq!((at("motion"), at("stick_count"), at("event_count")), (3.0, 0.0, 0.0));
    assert_eq!(at("attractor_sticks"), -1.0);
    for name in "onset_time final_stick_time first_stick_duration last_slip_duration first_period attractor_period \
        attractor_amplitude attractor_position_min attractor_since last_event_time"
        .split(' ')
    {
        assert!(at(name).is_nan(), "{name}");
    }
}

/// A point of a study equals the single run of its case: for elements of lists, keys of signals and initial values,
/// and for each way to name the base case.
#[test]
fn regression_points_are_the_single_runs_of_their_cases() {
    let folder = Folder::new();
    let settings = rows(
        "
        rotor.inertia.1            | 1.4
        rotor.viscous.1            | 0.02
        rotor.speed.amplitude      | 0.05
        rotor.speed.frequency      | 3
        contact.normal_force.value | 3900
        initial.rotor_twist.1      | 1e-3
        friction.breakaway         | 0.47
        solver.rtol                | 1e-9
    ",
    );
    let drive = "rotor.speed={ profile = \"sine\", mean = 0.3, amplitude = 0.1, frequency = \"2 Hz\" }";
    let start = "initial.rotor_speed=[0.1, 0.1]";
    let base = format!("[set]\noutput.end_time = 1\nsolver.method = \"series\"\n{start}\n{drive}\n");
    let axis = |[key, value]: &[&str; 2]| format!("[[axis]]\nkey = \"{key}\"\nvalues = [{value}]\n");
    let axes: String = settings.iter().map(axis).collect();
    let sets = settings.iter().map(|[key, value]| format!(" --set {key}={value}"));
    let sets = format!(
        "--set output.end_time=1 --set '{start}' --set '{drive}'{}",
        sets.collect::<String>()
    );
    let stdout = folder.ok(&format!("run groan --force --json --no-witness --method series {sets}"));
    let summary = json(&stdout)["summary"].clone();
    assert!(summary["sticks"].whole() > 5, "{summary}");
    // The same base case: built in, as a file, and as the result of a run.
    let text = stickslip::case::CaseSource::built_in("groan").unwrap().text;
    folder.write("mine.toml", text);
    folder.ok("run mine.toml -q --set output.end_time=0.01 -o done.h5");
    for case in ["groan", "mine.toml", "done.h5"] {
        folder.write("study.toml", format!("case = \"{case}\"\n{base}{axes}"));
        folder.json("sweep study.toml --force");
        let file = folder.sweep_file("study.h5");
        for (name, expected) in [
            ("stick_count", &summary["sticks"]),
            ("event_count", &summary["events"]),
            ("onset_time", &summary["onset_time"]),
            ("longest_slip_duration", &summary["slip_duration_range"][1]),
            ("shortest_stick_duration", &summary["stick_duration_range"][0]),
        ] {
            let value = file.numbers(name).unwrap()[0];
            let expected = expected.number();
            // The JSON reader may be wrong in the last bit of a number.
            let error = (value - expected).abs();
            assert!(error <= 1e-15 * expected, "{case}, {name}: {value}, not {expected}");
        }
    }
}

/// Steady sliding of a belt with the exponential law is stable above the damping alpha (mu_s - mu_d) F_n exp(-alpha
/// v) per unit of mass. The line next to a boundary equals it to rounding. Runs whose start has nearly decayed find
/// the boundary with an error that follows from the slow growth over the remaining 350 s: from 5 % below, there are
/// enough e-folds.
#[test]
fn analytic_the_boundary_of_a_slow_start_is_the_hopf_line() {
    let folder = Folder::new();
    let study = r#"
case = "belt-exponential"
boundary = { criterion = "attractor_period > 0", refinements = 0, width = 3e-3 }
axis = [
    { key = "rotor.speed", from = 0.1, to = 0.4, count = 4 },
    { key = "stator.damping.0", from = 1, to = 6, count = 4 },
]
[set]
solver.method = "series"
output.end_time = 400
contact.normal_force = { profile = "ramp", value = 10, rise_time = 50 }
"#;
    folder.write("hopf.toml", study);
    let report = folder.json("sweep hopf.toml");
    assert_eq!(report["curves"].list().len(), 1);
    let file = folder.sweep_file("hopf.h5");
    let line = |group: &str| {
        let column = |name: &str| file.numbers(&format!("{group}/{name}")).unwrap();
        column("rotor_speed").into_iter().zip(column("stator_damping_0"))
    };
    let hopf = |v: f64| 5.0 * 0.2 * 10.0 * (-5.0 * v).exp();
    let limit: Vec<(f64, f64)> = line("stability_limit").collect();
    folder.ok("plot hopf.h5 -o hopf.svg");
    let figure = folder.text("hopf.svg");
    says(&figure, "steady sliding loses its stability");
    assert!(limit.len() > 40, "{}", limit.len());
    for (v, c) in limit {
        assert!((c / hopf(v) - 1.0).abs() < 1e-12, "{v} {c}");
    }
    let mut points = 0;
    for (v, c) in line("boundary") {
        assert!((0.93..1.005).contains(&(c / hopf(v))), "{v} {c}: {}", c / hopf(v));
        points += 1;
    }
    assert!(points >= 5, "{points}");
    // `modes` finds the same line.
    let arguments = ["modes", "belt-exponential", "--json", "--set", "rotor.speed=0.25"];
    let stdout = folder.ok(&arguments);
    let critical = json(&stdout)["critical_stator_damping"]["changes"][0]["value"].number();
    assert!((critical / hopf(0.25) - 1.0).abs() < 1e-9, "{critical}");
}

/// Bursts, groan without bursts, and steady sliding: three points of the built-in study, with another method.
#[test]
fn regression_groan_over_the_speed_holds_for_single_runs() {
    let folder = Folder::new();
    let text = StudySource::find("groan-speed", STUDIES).unwrap().text;
    let axis = text.find("from = ").unwrap();
    folder.write("groan.toml", format!("{}values = [0.02, 0.5, 1.5]\n", &text[..axis]));
    let report = folder.json("sweep groan.toml");
    assert_eq!((&report["failed"], &report["unfinished"]), (&0.into(), &0.into()));
    let file = folder.sweep_file("groan.h5");
    let numbers = |name: &str| file.numbers(name).unwrap();
    assert_eq!(numbers("motion"), [0.0, 0.0, 3.0]);
    assert_eq!(numbers("attractor_sticks"), [2.0, 1.0, -1.0]);
    assert_eq!(file.text("attractor_amplitude/units").unwrap().as_deref(), Some("rad"));
    assert_eq!(numbers("stick_count")[2], 0.0);
    let stdout = folder.ok("run groan --json --no-witness --set rotor.speed=0.5 --set output.end_time=6 -o single.h5");
    let single = &json(&stdout)["summary"]["outcome"];
    // The distance of each run from its periodic motion is given: less than 1e-4 of the motion.
    for (name, other) in [
        ("attractor_period", &single["period"]),
        ("attractor_amplitude", &single["extremes"]["amplitude"]),
    ] {
        let (value, other) = (numbers(name)[1], other.number());
        assert!((value / other - 1.0).abs() < 2e-4, "{name}: {value}, {other}");
    }
}

#[test]
fn results_trajectories_of_the_points_are_results_of_trains() {
    let folder = Folder::new();
    let keep = BELT.replace("events = true", "events = true, trajectory = true");
    folder.write("belt.toml", keep);
    folder.json("sweep belt.toml");
    let file = folder.sweep_file("belt.h5");
    let counts = file.numbers("event_count").unwrap();
    let points = file.numbers("events/point").unwrap();
    for (point, count) in counts.iter().enumerate() {
        let kept = points.iter().filter(|&&of| of == point as f64).count();
        let run = folder.result(&format!("belt.runs/{point:06}.h5"));
        let found = (kept as f64, run.events().unwrap().len() as f64);
        assert_eq!(found, (*count, *count), "point {point}");
        assert!(run.resolved().unwrap().contains("[stator]"));
    }
    // The results of the points do not depend on whether they are stored.
    folder.write("plain.toml", BELT);
    folder.json("sweep plain.toml");
    let plain = folder.sweep_file("plain.h5");
    for name in ["attractor_period", "last_slip_duration", "onset_time"] {
        assert_eq!(plain.numbers(name).unwrap(), file.numbers(name).unwrap(), "{name}");
    }
}

#[test]
fn cli_samples_and_tables_of_points_know_the_keys_of_trains() {
    let folder = Folder::new();
    let sample = "case = \"groan\"\n[set]\noutput.end_time = 0.6\nsolver.method = \"series\"\n[sample]\nmethod = \"sobol\"\n\
                  count = 4\n[[axis]]\nkey = \"rotor.stiffness.1\"\nfrom = 6e3\nto = 9e3\n[[axis]]\n\
                  key = \"contact.normal_force.rise_time\"\nfrom = \"0.1 s\"\nto = \"0.3 s\"\n";
    folder.write("sample.toml", sample);
    assert_eq!(folder.json("sweep sample.toml --set rotor.inertia.1=1.3")["failed"], 0);
    let table = "case = \"belt-leine\"\npoints = \"points.csv\"\n[set]\noutput.end_time = 10\n";
    folder.write("table.toml", table);
    folder.write("points.csv", "rotor.speed,stator.inertia[0]\n0.2,1\n0.3 m/s,1.5\n");
    assert_eq!(folder.json("sweep table.toml")["points"], 2);
    let file = folder.sweep_file("table.h5");
    assert_eq!(file.numbers("stator_inertia_0").unwrap(), [1.0, 1.5]);
    for [from, to, words] in rows(
        "
        stator.inertia[0] | stator.inertia.1 |
            points.csv:1: there is no stator.inertia.1: its one element is stator.inertia.0
        stator.inertia[0] | stator.inertai.0 | did you mean stator.inertia.0?
        0.3 m/s | 0.3 rad/s | points.csv:3: rotor.speed: expected a velocity, m/s
    ",
    ) {
        let table = "rotor.speed,stator.inertia[0]\n0.2,1\n0.3 m/s,1.5\n".replace(from, to);
        folder.write("points.csv", table);
        folder.refused("sweep table.toml", &[words]);
    }
}

#[test]
fn cli_axes_that_the_base_case_does_not_have_are_refused_in_its_words() {
    let folder = Folder::new();
    for [case, key, words] in rows(
        r#"
        groan | rotor.inertai.1 | a case has no key "rotor.inertai.1"; did you mean rotor.inertia.1?
        groan | rotor.inertia |
            rotor.inertia is a list, and an axis varies one number: its elements are rotor.inertia.0 and rotor.inertia.1
        groan | rotor.inertia.2 | there is no rotor.inertia.2: its elements are rotor.inertia.0 and rotor.inertia.1
        belt-leine | rotor.inertia.0 | there is no rotor.inertia.0: in this case the list is empty
        groan | rotor.speed.amplitude | rotor.speed is a number in this case and has no amplitude
        groan | contact.normal_force.amplitude | is of profile "ramp" in this case, which has value, rise_time
        groan | contact.normal_force.rise_tme | did you mean contact.normal_force.rise_time?
        groan | rotor.torque | no point of the study
        groan | rotor.torque.amplitude | this case has no rotor.torque; give it one in [set]
        groan | torsion.damping |
            is a key of the short form, [torsion], but the case has [rotor] and [stator] instead; write rotor.damping.0
        groan | motion | make one study for each motion
        groan | brake.pad | a case of trains has no key "brake.pad"; its keys are dotted paths
        paper | rotor.inertia.1 |
            is a key of a case of trains, [rotor] and [stator], but the case is of the short form, [torsion]; write torsion.rotor_inertia
    "#,
    ) {
        folder.write(
            "bad.toml",
            format!("case = \"{case}\"\n[[axis]]\nkey = \"{key}\"\nvalues = [-1e300, -2e300]\n"),
        );
        let mut command = folder.stickslip("sweep bad.toml");
        // A torque of this size is a valid case, which fails.
        if key == "rotor.torque" {
            output(&mut command, 1);
            continue;
        }
        let stderr = refusal(&mut command);
        says(&stderr, &[words, "bad.toml:3: axis.0.key: "]);
    }
    // Limits and units of values, and the settings.
    for [key, values, set, words] in rows(
        r#"
        rotor.inertia.1 | -1 | - | axis.0.values.0: must be greater than 0, but is -1
        rotor.damping.1 | -1 | - | axis.0.values.0: must not be negative
        rotor.speed | "1 m/s" | - | axis.0.values.0: expected an angular velocity, rad/s
        rotor.end | "drivn" | - | did you mean "driven"?
        rotor.speed | 1 | rotor.dampnig = 1 | set.rotor.dampnig: a case has no key
        rotor.speed | 1 | rotor.inertia = [1, 2, 3] |
            rotor.stiffness: no point of the study is a valid case: has 2 numbers, but 3 are expected
    "#,
    ) {
        let set = if set == "-" {
            String::new()
        } else {
            format!("[set]\n{set}\n")
        };
        let axis = format!("[[axis]]\nkey = \"{key}\"\nvalues = [{values}]\n");
        folder.write("bad.toml", format!("case = \"groan\"\n{axis}{set}"));
        folder.refused("sweep bad.toml", &[words]);
    }
}

#[test]
fn cli_an_axis_does_not_extend_a_list_that_is_set() {
    let folder = Folder::new();
    let axis = "case = \"groan\"\n[[axis]]\nkey = \"rotor.inertia.1\"\nvalues = [1.3, 1.4]\n";
    folder.write("set.toml", format!("{axis}[set]\nrotor.inertia = 2\n"));
    folder.write("axis.toml", axis);
    for arguments in [&["set.toml"][..], &["axis.toml", "--set", "rotor.inertia=2"]] {
        let stderr = refusal(folder.stickslip("sweep").args(arguments));
        let words = "there is no rotor.inertia.1: its one element is rotor.inertia.0";
        assert!(stderr.contains(words), "{words} in {stderr}");
    }
}

/// The belt with a closed form alternately sticks for 0.2 s and slips for 0.471 s, for ever. One stick is from 1.342
/// s to 1.542 s. A run that ends in it has found no period, and a later end changes its result. The clutch locks for
/// good.
#[test]
fn analytic_a_stick_that_may_be_one_of_a_cycle_is_counted() {
    let folder = Folder::new();
    for (case, ends, unfinished, motions) in [
        ("belt-coulomb", "[1.4, 10.0]", 1, [1.0, 0.0]),
        ("clutch", "[1.0, 2.0]", 0, [1.0, 1.0]),
    ] {
        let axis = format!("[[axis]]\nkey = \"output.end_time\"\nvalues = {ends}\n");
        folder.write(&format!("{case}.toml"), format!("case = \"{case}\"\n{axis}"));
        let report = folder.json(&format!("sweep {case}.toml"));
        assert_eq!(report["unfinished"], unfinished, "{case}");
        let file = folder.sweep_file(&format!("{case}.h5"));
        assert_eq!(file.numbers("motion").unwrap(), motions);
    }
}

#[test]
fn cli_boundaries_are_on_quantities_that_the_runs_have() {
    let folder = Folder::new();
    let study = |case: &str, axes: [&str; 2], rest: &str| {
        let [x, y] = axes.map(|key| format!("[[axis]]\nkey = \"{key}\"\nfrom = 1\nto = 2\ncount = 3\n"));
        format!("case = \"{case}\"\n{x}{y}[boundary]\n{rest}\n")
    };
    let belt = ["rotor.speed", "stator.damping.0"];
    let brake = ["friction.decay", "torsion.damping"];
    for [case, rest, words] in rows(
        r#"
        belt-exponential | criterion = "growth_exponent > 20" |
            no run of this case has "growth_exponent": its sliding is not watched for a loss of stability: an end is driven
        belt-exponential | criterion = "nothing_of_the_kind > 20" | there are stick_count, slip_count
        belt-exponential | criterion = "attractor_perod > 2" | did you mean attractor_period?
        belt-exponential | growth_contours = [20] |
            boundary.growth_contours: no run of this case has "growth_exponent": its sliding is not watched
        paper | criterion = "attractor_period > 2" |
            no run of this case has "attractor_period": nothing drives its sliding
    "#,
    ) {
        let axes = if case == "paper" { brake } else { belt };
        folder.write("bad.toml", study(case, axes, rest));
        folder.refused("sweep bad.toml", &[words, "bad.toml:13: boundary."]);
    }
}

#[test]
fn property_both_forms_of_a_brake_have_the_same_boundary() {
    let folder = Folder::new();
    let study = |case: &str, damping: &str| {
        format!(
            "case = \"{case}\"\n[set]\nsolver.method = \"series\"\n[[axis]]\nkey = \"friction.decay\"\nfrom = 0.05\nto = 0.8\n\
             count = 4\nspacing = \"log\"\n[[axis]]\nkey = {damping}\nfrom = 5\nto = 40\ncount = 3\n[boundary]\n\
             criterion = \"instability_time > 0\"\nrefinements = 0\nwidth = 1e-2\ngrowth_contours = [0.02]\n"
        )
    };
    // A light rotor that stops within milliseconds.
    let light = [
        "perturbation=[]",
        "axial.damping=20000 lbf s/in",
        "actuation.rise_time=0",
        "torsion.rotor_inertia=0.002",
        "initial.speed=10",
        "output.end_time=0.01",
    ];
    let short = built_in("paper", &light);
    folder.write("short.toml", short.resolved());
    folder.write("trains.toml", short.in_general_form().resolved());
    folder.write("a.toml", study("short.toml", "\"torsion.damping\""));
    let both = "[\"rotor.damping.0\", \"stator.damping.0\"]";
    folder.write("b.toml", study("trains.toml", both));
    let [a, b] = ["a", "b"].map(|name| {
        folder.ok(&format!("sweep {name}.toml"));
        folder.sweep_file(&format!("{name}.h5"))
    });
    let mut growing = 0;
    for quantity in stickslip::sweep::QUANTITIES {
        let [here, there] = [&a, &b].map(|file| file.numbers(quantity.name).unwrap());
        assert_eq!(here.len(), there.len());
        for (here, there) in here.iter().zip(&there) {
            assert!(here.to_bits() == there.to_bits(), "{}: {here} {there}", quantity.name);
            growing += usize::from(quantity.name == "growth_exponent" && *here > 0.0);
        }
    }
    assert_eq!(growing, 3);
    for group in ["linear_limit", "growth_contours"] {
        let [here, there] = [&a, &b]
            .map(|file| ["friction_decay", "level"].map(|name| file.numbers(&format!("{group}/{name}")).unwrap()));
        assert!(!here[0].is_empty() && here == there, "{group}");
    }
}

/// Stiffness and friction of the Coulomb belt, from its slip, its stick and its amplitude with four printed digits.
const CALIBRATION: &str = r#"
title = "spring and friction of a belt"
case = "belt-coulomb"
free = [
    { key = "stator.stiffness.0", from = "60 N/m", to = "200 N/m" },
    { key = "friction.kinetic", from = 0.2, to = 0.39 },
]
target = [
    { quantity = "last_slip_duration", value = "0.4712 s" },
    { quantity = "last_stick_duration", value = "200.0 ms" },
    { quantity = "attractor_amplitude", value = "14.14 mm" },
    { quantity = "attractor_sticks", value = 1, weight = 0 },
]
search = { points = 64, starts = 2 }
"#;

#[test]
fn analytic_a_calibration_of_trains_finds_the_case() {
    let folder = Folder::new();
    folder.write("belt.toml", CALIBRATION);
    let arguments = ["calibrate", "belt.toml", "--case", "found.toml", "--json"];
    let stdout = folder.ok(&arguments);
    let report = json(&stdout);
    assert_eq!(report["consistent"], true);
    // k = 100 N/m and mu_d = 0.3, within the accuracy of four digits.
    for (place, true_value) in [(0, 100.0), (1, 0.3)] {
        let parameter = &report["parameters"][place];
        let number = |name: &str| parameter[name].number();
        assert!(number("least") < true_value, "{parameter}");
        assert!(true_value < number("largest"), "{parameter}");
        assert!((number("optimum") / true_value - 1.0).abs() < 1e-3, "{parameter}");
        assert_eq!(parameter["determined"], "determined");
    }
    let units: Vec<&str> = (0..4).map(|k| report["targets"][k]["unit"].text()).collect();
    assert_eq!(units, ["s", "s", "m", "1"]);
    let half = report["targets"][2]["half_width"].number();
    assert!((half - 5e-6).abs() < 1e-18, "{half}");
    let file = folder.sweep_file("belt.h5");
    let references = file.text("references").unwrap();
    assert_eq!(references.as_deref(), Some("stickslip, docs/theory.md: Trains"));
    let found = file.shape("attractor_amplitude").unwrap()[0] as u64;
    assert_eq!(found, report["runs"].whole());
    let period = folder.json("run found.toml --no-witness")["summary"]["outcome"]["period"].number();
    assert!((period - 0.6712).abs() < 2e-4, "{period}");
    for [from, to, words] in rows(
        r#"
        "14.14 mm"            | "14.14 mrad"         | target.2.value: expected a length, m
        "attractor_amplitude" | "attractor_amplitde" | did you mean attractor_amplitude?
        "attractor_amplitude" | "natural_period"     | no run of this case has "natural_period": its sliding is not watched
        "attractor_amplitude" | "motion"             | has no quantity "motion" to measure
        "stator.stiffness.0"  | "stator.stiffness.1" | free.0.key: there is no stator.stiffness.1
    "#,
    ) {
        assert!(CALIBRATION.contains(from), "{from}");
        folder.write("wrong.toml", CALIBRATION.replace(from, to));
        folder.refused("calibrate wrong.toml", &[words]);
    }
}

/// The base case slows down by itself. With a torque it does not.
#[test]
fn cli_an_axis_of_a_torque_may_ask_for_what_a_driven_motion_has() {
    let torque = |show: &str, key: &str| {
        let study = format!(
            "case = \"paper-si\"\nshow = [\"{show}\"]\n[[axis]]\nkey = \"{key}\"\nvalues = [1, 2]\n[set]\noutput.end_time = 7\n"
        );
        Study::parse(StudySource::text("study", &study), &[])
    };
    let refused = torque("attractor_period", "initial.speed").unwrap_err().to_string();
    assert!(refused.contains("nothing drives its sliding"), "{refused}");
    let folder = Folder::new();
    folder.write("general.toml", built_in("paper-si", &[]).in_general_form().resolved());
    let driven = |show: &str| {
        let study = format!(
            "case = \"general.toml\"\nshow = [\"{show}\"]\n[[axis]]\nkey = \"rotor.torque\"\nvalues = [1, 2]\n"
        );
        folder.write("study.toml", study);
        let source = StudySource::find(folder.path("study.toml").to_str().unwrap(), STUDIES).unwrap();
        Study::parse(source, &[])
    };
    driven("attractor_period").unwrap();
    let refused = driven("growth_exponent").unwrap_err().to_string();
    assert!(refused.contains("an external torque acts"), "{refused}");
}
