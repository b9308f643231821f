//! `stickslip sweep` from the user's side: files that depend on the study alone, kills and resumption, refusals.

use crate::common::cli::{Folder, says};
use crate::common::json::*;
use crate::common::page::document;
use crate::common::rows;
use stickslip::plot::studies::{self, Choice};

/// Runs of a millisecond: the ramp and the beginning of sliding. A few of them fail.
pub const QUICK: &str = r#"
title = "a quick map"
case = "paper"

[set]
output.end_time = 0.02
"actuation.rise_time" = 0.01

[[axis]]
key = "torsion.damping"
from = 10
to = 30
count = 6

[[axis]]
key = ["friction.low_speed", "friction.high_speed"]
values = [0.3, 0.45, 0.7]

[[axis]]
key = "solver.method"
values = ["arkode", "erk"]

[keep]
events = true
"#;

#[test]
fn results_a_grid_has_its_axes_as_dimensions_and_its_failures_in_words() {
    let folder = Folder::new();
    folder.write("map.toml", QUICK);
    let report = folder.json("sweep map.toml");
    assert_eq!((&report["points"], &report["failed"]), (&36.into(), &12.into()));
    assert_eq!(folder.names(), ["map.h5", "map.toml"]);
    let file = folder.sweep_file("map.h5");
    assert_eq!(file.text("status").unwrap().as_deref(), Some("complete"));
    assert_eq!(file.text("study_digest").unwrap().as_deref(), report["digest"].as_str());
    assert_eq!(file.shape("stick_count").unwrap(), [6, 3, 2]);
    let found = file.numbers("torsion_damping").unwrap();
    assert_eq!(found, [10.0, 14.0, 18.0, 22.0, 26.0, 30.0]);
    assert_eq!(
        file.text("friction_low_speed/keys").unwrap().as_deref(),
        Some("friction.low_speed friction.high_speed")
    );
    assert_eq!(
        file.text("solver_method/flag_meanings").unwrap().as_deref(),
        Some("arkode erk")
    );
    // mu_0 = 0.6 is below mu_s = 0.7. These points are invalid cases, and are reported as such.
    let status = file.numbers("status").unwrap();
    for (number, status) in status.iter().enumerate() {
        assert_eq!(*status, if number % 6 >= 4 { 1.0 } else { 0.0 }, "point {number}");
    }
    let failures = file.failures().unwrap();
    assert_eq!(failures.len(), 12);
    assert_eq!(failures[0].0, 4);
    assert!(
        failures[0]
            .1
            .contains("friction.breakaway: must be at least friction.low_speed"),
        "{}",
        failures[0].1
    );
    let slips = file.numbers("slip_count").unwrap();
    assert!(
        slips
            .iter()
            .zip(&status)
            .all(|(&slips, &status)| slips == if status == 1.0 { -1.0 } else { 0.0 })
    );
    // T_n = 2 pi sqrt(J/k_t) of the paper's case, which does not depend on the axes.
    let period = file.numbers("natural_period").unwrap()[0];
    assert!((period - 2.4056e-4).abs() < 1e-8, "{period}");
}

#[test]
fn property_the_file_does_not_depend_on_threads_interruptions_or_time() {
    let folder = Folder::new();
    for (study, title) in [(QUICK, "a quick map"), (crate::shards::SMOOTH, "a smooth belt")] {
        folder.write("map.toml", study);
        folder.ok("sweep map.toml -j 1 -o one.h5 --force");
        for jobs in ["2", "7"] {
            folder.ok(&["sweep", "map.toml", "-j", jobs, "-o", "many.h5", "--force"]);
            assert!(
                folder.read("one.h5") == folder.read("many.h5"),
                "{title} with {jobs} threads"
            );
        }
    }
}

#[cfg(unix)]
#[test]
fn property_killed_at_any_moment_and_resumed_the_file_is_the_same() {
    use std::time::Duration;
    let folder = Folder::new();
    // Some hundred points, which take a second or two in total.
    let study = QUICK.replace("count = 6", "count = 60");
    folder.write("map.toml", &study);
    folder.ok("sweep map.toml -o whole.h5");
    let kills: u64 = std::env::var("STICKSLIP_TEST_KILLS").map_or(50, |kills| kills.parse().unwrap());
    let mut under_way = 0;
    for kill in 0..kills {
        let mut child = folder.start("sweep map.toml -j 2 -o killed.h5 --resume");
        // At arbitrary moments. The sweep takes longer than the latest.
        std::thread::sleep(Duration::from_micros(2_000 + kill * 7919 % 60_000));
        child.kill().unwrap();
        child.wait().unwrap();
        under_way += u64::from(folder.path("killed.journal").exists());
        // A finished sweep is compared, and started again.
        if folder.path("killed.h5").exists() && !folder.path("killed.journal").exists() {
            assert!(
                folder.read("whole.h5") == folder.read("killed.h5"),
                "after {kill} kills"
            );
            std::fs::remove_file(folder.path("killed.h5")).unwrap();
        }
    }
    assert_eq!(folder.json("sweep map.toml -o killed.h5 --resume")["points"], 360);
    assert!(
        under_way > kills / 2,
        "{under_way} of {kills} kills came while points were run"
    );
    assert!(folder.read("whole.h5") == folder.read("killed.h5"));
    assert_eq!(folder.names(), ["killed.h5", "map.toml", "whole.h5"]);
    // When it is resumed once more, there is nothing left to do.
    assert_eq!(folder.json("sweep map.toml -o killed.h5 --resume")["run_now"], 0);
    assert!(folder.read("whole.h5") == folder.read("killed.h5"));
}

#[test]
fn cli_what_was_begun_is_neither_lost_nor_mixed_with_another_study() {
    let folder = Folder::new();
    // So many points that the sweep is not finished when it is killed. Those of the first 20 ms are in its journal.
    let study = QUICK.replace("count = 6", "count = 30");
    folder.write("map.toml", &study);
    folder.write("other.toml", study.replace("to = 30", "to = 31"));
    // A journal with some points, as after an interruption.
    let mut child = folder.start("sweep map.toml -j 1");
    folder.wait_for(&mut child, "map.journal", 200);
    child.kill().unwrap();
    child.wait().unwrap();
    folder.refused("sweep map.toml", &["--resume goes on with it"]);
    folder.refused("sweep other.toml -o map.h5 --resume", &["belongs to another study"]);
    folder.ok("sweep map.toml --force");
    assert!(!folder.path("map.journal").exists());
    folder.refused("sweep other.toml -o map.h5 --resume", &["is the file of another study"]);
    // Without --resume it is the result of another study, which a new sweep replaces by force only.
    folder.refused("sweep other.toml -o map.h5", "axis.0.to = 30 there, 31 here & --force");
    folder.ok("sweep other.toml -o map.h5 --force");
}

#[test]
fn cli_bad_studies_are_refused_with_file_line_and_key() {
    let folder = Folder::new();
    let said = |from: &str, to: &str| {
        let bad = QUICK.replacen(from, to, 1);
        assert_ne!(bad, QUICK, "{from}");
        folder.write("bad.toml", bad);
        let stderr = folder.refused("sweep bad.toml", "");
        assert_eq!(folder.names(), ["bad.toml"], "{to}");
        stderr
    };
    for [from, to, words] in rows(
        r#"
        count = 6 | cuont = 6 | bad.toml:13: axis.0.cuont: unknown key; did you mean count? & axis.0.count: missing
        count = 6 | count = 0 | bad.toml:13: axis.0.count: expected a whole number from 1
        key = "torsion.damping" | key = "torsion.dampnig" |
            bad.toml:10: axis.0.key: a case has no key "torsion.dampnig"; did you mean torsion.damping?
        from = 10 | from = "10 N" | bad.toml:11: axis.0.from: expected a torsional damping
        from = 10 | from = -10 | bad.toml:11: axis.0.from: must not be negative
        values = [0.3, 0.45, 0.7] | values = [] | bad.toml:17: axis.1.values: an axis without values
        values = [0.3, 0.45, 0.7] | values = [0.3, 0.3] | bad.toml:17: axis.1.values.1: 0.3 stands twice
        values = ["arkode", "erk"] | values = ["arkode", "ekr"] | bad.toml:21: axis.2.values.1: there is no "ekr" & did you mean "erk"?
        key = ["friction.low_speed", "friction.high_speed"] | key = ["friction.low_speed", "friction.low_speed"] |
            friction.low_speed stands on two axes
        case = "paper" | case = "papr" | bad.toml:3: case: there is no built-in case "papr" (did you mean paper?)
        output.end_time = 0.02 | output.end_tim = 0.02 |
            bad.toml:6: set.output.end_tim: a case has no key & did you mean output.end_time?
        events = true | events = 1 | bad.toml:24: keep.events: expected true or false
        output.end_time = 0.02 | torsion.surface_inertia = -1 |
            no point of the study is a valid case & must be greater than 0
    "#,
    ) {
        says(&said(from, to), words);
    }
    says(
        &said("values = [0.3, 0.45, 0.7]", "values = [0.3, 0.45]\nfrom = 1"),
        "bad.toml:18: axis.1.from: an axis has either values",
    );
    says(&said("case = \"paper\"", ""), &["case: missing: the base case"]);
    says(
        &said(
            "output.end_time = 0.02",
            "output.end_time = {}\nfriction.typo = {}\noutput.window = {}",
        ),
        "bad.toml:6: set.output.end_time: an empty table sets nothing &
         bad.toml:7: set.friction.typo: a case has no key &
         bad.toml:8: set.output.window: a case has no key",
    );
    let stderr = said("[keep]", "[boundary]\ncriterion = \"sticks > 2\"\n[keep]");
    assert!(
        ["boundary", "is not", "sticks"]
            .iter()
            .any(|word| stderr.contains(word)),
        "{stderr}"
    );
    says(
        &said("[keep]", "[sample]\nmethod = \"sobol\"\ncount = 8\n[keep]"),
        "bad.toml:13: axis.0.count: this range is not divided into points; remove the count",
    );
}

#[test]
fn cli_a_table_of_points_is_read_with_units_and_refused_by_line() {
    let folder = Folder::new();
    let study = "case = \"paper\"\npoints = \"points.csv\"\n[set]\noutput.end_time = 0.01\n";
    folder.write("table.toml", study);
    folder.write(
        "points.csv",
        "friction.decay, torsion.damping\n5, 200 lbf in s/rad\n# a remark\n2.5 s/rad, 10\n",
    );
    folder.ok("sweep table.toml");
    let file = folder.sweep_file("table.h5");
    assert_eq!(file.numbers("point").unwrap(), [0.0, 1.0]);
    assert_eq!(file.numbers("friction_decay").unwrap(), [5.0, 2.5]);
    // 200 lbf in s/rad, converted exactly.
    assert_eq!(file.numbers("torsion_damping").unwrap(), [22.59696580552334, 10.0]);
    for (table, words) in [
        ("friction.decay\n5\nfast\n", "points.csv:3: friction.decay:"),
        (
            "friction.decay,torsion.damping\n5\n",
            "points.csv:2: 1 values for 2 keys",
        ),
        ("alpha\n5\n", "points.csv:1: a case has no key \"alpha\""),
        ("friction.decay\n", "a table of points without a point"),
    ] {
        folder.write("points.csv", table);
        folder.refused("sweep table.toml", &[words, "table.toml:2: points:"]);
    }
}

/// Another friction law has other keys. A table with a law replaces that of the case; one without a law sets its
/// keys.
#[test]
fn cli_a_study_may_choose_another_friction_law() {
    let folder = Folder::new();
    let study = |settings: &str, key: &str| {
        format!(
            "case = \"paper\"\n[set]\noutput.end_time = 0.01\n{settings}\n[[axis]]\nkey = \"{key}\"\nvalues = [0.2, 0.25]\n"
        )
    };
    let law = "{law=\"hyperbolic\", breakaway=0.6, low_speed=0.6, high_speed=0.3, scale=0.2}";
    folder.write("inline.toml", study(&format!("friction = {law}"), "friction.scale"));
    folder.write(
        "table.toml",
        study(
            "[set.friction]\nlaw = \"hyperbolic\"\nbreakaway = 0.6\nlow_speed = 0.6\nhigh_speed = 0.3\nscale = 1",
            "friction.scale",
        ),
    );
    folder.write("keys.toml", study("[set.friction]\ndecay = 4", "friction.high_speed"));
    for name in ["inline", "table", "keys"] {
        folder.ok(&["sweep", &format!("{name}.toml"), "-q"]);
        let file = folder.sweep_file(&format!("{name}.h5"));
        assert_eq!(file.numbers("status").unwrap(), [0.0, 0.0], "{name}");
    }
}

#[test]
fn cli_a_kept_trajectory_is_a_result_file_of_each_point() {
    let folder = Folder::new();
    let study = "case = \"paper\"\n[set]\noutput.end_time = 0.01\noutput.interval = 1e-3\noutput.window = []\n\
                 [[axis]]\nkey = \"friction.decay\"\nvalues = [2, 3]\n[keep]\ntrajectory = true\nevents = true\n";
    folder.write("runs.toml", study);
    folder.ok("sweep runs.toml");
    for (number, decay) in [(0, 2.0), (1, 3.0)] {
        let run = folder.result(&format!("runs.runs/{number:06}.h5"));
        assert_eq!(run.sample_count().unwrap(), 11);
        let events = folder.sweep_file("runs.h5").numbers("events/point").unwrap();
        let kept = events.iter().filter(|&&point| point == f64::from(number)).count();
        assert_eq!(kept, run.events().unwrap().len());
        assert!(run.resolved().unwrap().contains(&format!("decay = {decay:?}")));
    }
}

/// A light rotor that stops within milliseconds, so that runs are short.
pub const BOUNDARY: &str = r#"
case = "paper"
set = { perturbation = [], axial.damping = "20000 lbf s/in", actuation.rise_time = 0, torsion.rotor_inertia = 0.002,
    initial.speed = 10, output.end_time = 0.01 }
axis = [
    { key = "friction.decay", from = 0.05, to = 0.8, count = 5, spacing = "log" },
    { key = "torsion.damping", from = 5, to = 40, count = 4 },
]
boundary = { criterion = "instability_time > 0", refinements = 1, growth_contours = [0.5] }
"#;

#[test]
fn property_a_boundary_does_not_depend_on_threads_and_is_drawn() {
    let folder = Folder::new();
    folder.write("limit.toml", BOUNDARY);
    let report = folder.json("sweep limit.toml -j 1");
    assert_eq!(report["curves"].list().len(), 1);
    folder.ok("sweep limit.toml -j 3 -o three.h5");
    assert!(folder.read("limit.h5") == folder.read("three.h5"));
    folder.ok("plot limit.h5 -o limit.svg");
    let figure = folder.text("limit.svg");
    assert!(figure.contains("stable at every speed"), "the linear limit is named");
    // The page has the curves of the figure, point by point.
    folder.ok("plot limit.h5 --html limit.html");
    let page = document(&folder.text("limit.html"));
    let drawn = studies::figures(&folder.sweep_file("limit.h5"), &Choice::default()).unwrap();
    let [panel] = &drawn[0].panels[..] else {
        panic!("one panel")
    };
    let overlay = &page["overlays"][0];
    assert_eq!(overlay["curves"], serde_json::to_value(&panel.curves).unwrap());
    assert_eq!(overlay["labels"], serde_json::to_value(&panel.labels).unwrap());
    let found = (&overlay["x"], &overlay["y"]);
    assert_eq!(found, (&"friction_decay".into(), &"torsion_damping".into()));
    assert!(panel.curves.iter().any(|curve| curve.label == "stable at every speed"));
    // A grid has no boundary, and is drawn as a map.
    folder.write("map.toml", QUICK);
    folder.ok("sweep map.toml");
    assert_eq!(folder.json("plot map.h5 -o map.svg")["files"][0]["file"], "map.svg");
}

/// `inspect` lists a sweep. Commands for the result of one run say that they got a sweep, and what to do with it.
#[test]
fn cli_every_command_knows_a_sweep_file() {
    let folder = Folder::new();
    folder.write("map.toml", QUICK);
    folder.ok("sweep map.toml");
    let stdout = folder.ok("inspect map.h5 -v");
    says(
        &stdout,
        "stickslip-sweep & 6 x 3 x 2 & number of sticks & /failures & /events & default_rtol",
    );
    let contents = folder.json("inspect map.h5");
    let as_array = contents["variables"].list();
    let sticks = as_array.with("name", "stick_count");
    // The fill value of failed points is not counted.
    assert_eq!((&sticks["min"], &sticks["shape"]), (&0.0.into(), &vec![6, 3, 2].into()));
    for command in ["certify", "modes", "run"] {
        folder.refused(&[command, "map.h5"], &["the many runs of a sweep", "trajectory = true"]);
    }
    folder.ok("run paper -o run.h5 --set output.end_time=0.01");
    for pair in [["map.h5", "run.h5"], ["run.h5", "map.h5"]] {
        folder.refused(&["compare", pair[0], pair[1]], &["the many runs of a sweep"]);
    }
}

/// A criterion that changes nowhere gives no boundary, and a message. Runs that end before the stop, and therefore
/// have too few sticks, are reported, too.
#[test]
fn cli_a_sweep_says_what_makes_its_boundary_doubtful() {
    let folder = Folder::new();
    folder.write(
        "none.toml",
        BOUNDARY.replace("instability_time > 0", "stick_count > 1000"),
    );
    let stdout = folder.ok("sweep none.toml");
    says(&stdout, "the first grid, 5 x 4, stick_count > 1000 changes nowhere");
    assert!(!stdout.contains("a stick that lasts"), "{stdout}");
    let short = "case = \"paper\"\nset.solver.method = \"series\"\n[[axis]]\nkey = \"initial.speed\"\nvalues = [100, 200, 250]\n";
    folder.write("short.toml", short);
    let stdout = folder.ok("sweep short.toml");
    assert!(stdout.contains("2 runs end before a stick that lasts"), "{stdout}");
    assert_eq!(folder.json("sweep short.toml -o j.h5")["unfinished"], 2);
}
