//! `stickslip calibrate` from the user's side: report, file, case, refusals, interruption.

use crate::common::cli::{Folder, json, refusal, says, send};
use crate::common::json::*;

/// A calibration that T_n = 2 pi sqrt(J/k_t) alone decides, with short runs.
pub const QUICK: &str = r#"
title = "the inertia of the surfaces"
case = "paper"

[set]
output.end_time = 0.02
"actuation.rise_time" = 0.01
perturbation = []

[[free]]
key = "torsion.surface_inertia"
from = 0.005
to = 0.03

[[target]]
quantity = "natural_period"
value = "0.00024 s"

[[target]]
quantity = "stick_count"
value = 48

[search]
points = 32
starts = 2
"#;

#[test]
fn results_the_report_the_file_and_the_case_say_the_same() {
    let folder = Folder::new();
    folder.write("inertia.toml", QUICK);
    let arguments = ["calibrate", "inertia.toml", "--case", "found.toml", "--json"];
    let stdout = folder.ok(&arguments);
    let report = json(&stdout);
    assert_eq!(folder.names(), ["found.toml", "inertia.h5", "inertia.toml"]);
    assert_eq!(report["status"], "complete");
    assert_eq!(report["consistent"], false);
    assert_eq!(report["targets"][0]["role"], "held");
    assert_eq!(report["targets"][1]["role"], "out-of-reach");
    assert_eq!(report["parameters"][0]["determined"], "determined");
    let file = folder.sweep_file("inertia.h5");
    assert_eq!(file.text("status").unwrap().as_deref(), Some("complete"));
    assert_eq!(file.text("study_digest").unwrap().as_deref(), report["digest"].as_str());
    let one = |name: &str| file.numbers(name).unwrap();
    // The JSON reader may be wrong in the last bit of a number.
    let same = |file: f64, report: &serde_json::Value| (file / report.number() - 1.0).abs() < 1e-15;
    let parameter = &report["parameters"][0];
    for name in ["optimum", "least", "largest"] {
        assert!(same(one(&format!("calibration/{name}"))[0], &parameter[name]), "{name}");
    }
    assert_eq!(one("targets/role"), [0.0, 2.0]);
    assert_eq!(
        file.text("targets/target/flag_meanings").unwrap().as_deref(),
        Some("natural_period stick_count")
    );
    // Every run is in the file, with its parameter.
    let runs = report["runs"].whole() as usize;
    assert_eq!(file.shape("natural_period").unwrap(), [runs]);
    let (inertias, periods) = (one("torsion_surface_inertia"), one("natural_period"));
    let quotient = periods[0] / inertias[0].sqrt();
    for (inertia, period) in inertias.iter().zip(&periods) {
        assert!((period / inertia.sqrt() / quotient - 1.0).abs() < 1e-14);
    }
    let period = folder.json("run found.toml")["summary"]["natural_period"].number();
    assert!(same(period, &report["targets"][0]["here"]), "{period}");
    let stdout = folder.ok("calibrate inertia.toml -v");
    says(
        &stdout,
        "torsion.surface_inertia & natural_period & 1 of the targets hold &
         stick_count holds nowhere in the ranges & -96.00 & inertia.h5",
    );
}

#[test]
fn property_the_file_does_not_depend_on_threads() {
    let folder = Folder::new();
    folder.write("inertia.toml", QUICK);
    let mut files = Vec::new();
    for jobs in ["1", "2", "5"] {
        let name = format!("of-{jobs}.h5");
        folder.ok(&["calibrate", "inertia.toml", "-j", jobs, "-o", &name, "-q"]);
        files.push(folder.read(&name));
    }
    assert!(files[0] == files[1] && files[1] == files[2]);
}

#[test]
fn cli_mistakes_in_a_study_are_named_by_line_and_key() {
    let folder = Folder::new();
    for (from, to, words) in [
        ("to = 0.03", "", "free.0.to: missing"),
        ("from = 0.005", "from = 0.03", "from and to are both 0.03"),
        (
            "key = \"torsion",
            "key = \"torsoin",
            "did you mean torsion.surface_inertia?",
        ),
        (
            "\"natural_period\"",
            "\"natural_priod\"",
            "did you mean natural_period?",
        ),
        ("\"natural_period\"", "\"steps\"", "to measure"),
        ("\"0.00024 s\"", "0.00024", "in quotes as it was printed"),
        ("\"0.00024 s\"", "\"0.00024 kg\"", "expected a time, s"),
        ("value = 48", "value = 48\nweight = -1", "target.1.weight"),
        ("value = 48", "value = 48\nhalf_width = 0", "must be greater than 0"),
        (
            "\"stick_count\"\nvalue = 48",
            "\"natural_period\"\nvalue = \"240 us\"",
            "is a target twice",
        ),
        ("points = 32", "points = 3", "search.points"),
        ("case = \"paper\"", "case = \"papier\"", "did you mean paper?"),
        (
            "output.end_time = 0.02",
            "output.end_time = {}",
            "wrong.toml:6: set.output.end_time: an empty table sets nothing",
        ),
        ("from = 0.005", "from = 0.005\ncount = 5", "free.0.count: unknown key"),
        ("[[free]]", "[[axis]]", "axis: unknown key"),
    ] {
        assert!(QUICK.contains(from), "{from}");
        folder.write("wrong.toml", QUICK.replace(from, to));
        folder.refused("calibrate wrong.toml", &[words, "wrong.toml:"]);
    }
    folder.refused("calibrate papr-decay", &["did you mean paper-decay?"]);
    // A case that is invalid in the whole range.
    folder.write(
        "wrong.toml",
        QUICK.replace("from = 0.005", "from = -0.005").replace("0.03", "-0.03"),
    );
    folder.refused("calibrate wrong.toml", &["must be greater than 0"]);
}

#[test]
fn cli_no_file_is_replaced_that_is_not_the_programs_own() {
    let folder = Folder::new();
    folder.write("inertia.toml", QUICK);
    folder.write("other.toml", "mine");
    for (arguments, words) in [
        (["--case", "other.toml"], "is there already"),
        (["--case", "inertia.toml"], "is an input"),
        (["--case", "inertia.h5"], "is the result file"),
        (["--case", "nowhere/x.toml"], "does not exist"),
        (["-o", "other.toml"], "other.toml"),
        (["-o", "inertia.toml"], "inertia.toml"),
    ] {
        let mut command = folder.stickslip("calibrate inertia.toml");
        let text = refusal(command.args(arguments));
        assert!(text.contains(words), "{words} in {text}");
    }
    assert_eq!(folder.names(), ["inertia.toml", "other.toml"]);
    assert_eq!(folder.read("other.toml"), b"mine");
}

#[test]
fn regression_what_cannot_be_written_is_said_before_the_search() {
    let folder = Folder::new();
    folder.write("inertia.toml", QUICK);
    // No other program makes such a folder. It is in the place of the lock.
    std::fs::create_dir(folder.path(".inertia.partial.h5.lock")).unwrap();
    folder.refused("calibrate inertia.toml", &[".inertia.partial.h5.lock"]);
    if cfg!(target_os = "linux") {
        // Nobody can create a file in /proc.
        let arguments = ["calibrate", "inertia.toml", "-o", "x.h5", "--case", "/proc/x.toml"];
        let (_, text) = folder.ends(&arguments, 1);
        says(&text, &["/proc/x.toml", "another with --case"]);
    }
    assert_eq!(folder.names(), [".inertia.partial.h5.lock", "inertia.toml"]);
}

#[test]
fn cli_targets_out_of_reach_of_all_fail_with_the_nearest() {
    let folder = Folder::new();
    folder.write("none.toml", QUICK.replace("0.00024 s", "0.9 s"));
    let (stdout, stderr) = folder.ends("calibrate none.toml", 1);
    assert_eq!(stdout, "");
    says(&stderr, &["no target holds anywhere", "natural_period"]);
}

#[cfg(unix)]
#[test]
fn cli_an_interruption_leaves_the_runs_made_so_far() {
    let folder = Folder::new();
    // Some minutes, most of it for the sample.
    let long = QUICK
        .replace("points = 32", "points = 65536")
        .replace("output.end_time = 0.02", "output.end_time = 10");
    folder.write("long.toml", long.replace("\"actuation.rise_time\" = 0.01", ""));
    let mut child = folder.start("calibrate long.toml -j 2");
    std::thread::sleep(std::time::Duration::from_secs(4));
    send("INT", child.id());
    let ended = child.wait().unwrap();
    assert_eq!(ended.code(), Some(130));
    let file = folder.sweep_file("long.partial.h5");
    assert_eq!(file.text("status").unwrap().as_deref(), Some("interrupted"));
    assert!(!file.numbers("natural_period").unwrap().is_empty());
    assert!(!folder.path("long.h5").exists());
}
