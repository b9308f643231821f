//! `compare` with a problem of the benchmark set as its reference. The command that it names for the score is run by
//! .ci/benchmarks.py.

use crate::common::cli::{Folder, says};
use crate::common::json::*;
use std::path::{Path, PathBuf};

fn problem(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("benchmarks").join(name)
}

fn compared(folder: &Folder, reference: &Path, candidate: &Path, more: &[&str]) -> serde_json::Value {
    let (reference, candidate) = (reference.to_str().unwrap(), candidate.to_str().unwrap());
    let arguments = [&["compare", reference, candidate, "--json"][..], more].concat();
    let output = folder.stickslip(&arguments[..]).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    let document = serde_json::from_slice::<serde_json::Value>(&output.stdout);
    document.unwrap_or_else(|_| panic!("{error}"))["comparisons"][0].clone()
}

#[test]
fn cli_a_problem_of_the_set_is_a_reference() {
    let folder = Folder::new();
    let belt = problem("09-belt-coulomb");
    let found = compared(&folder, &belt, &belt.join("events.csv"), &["--quick"]);
    // The rows of a table with kinds are events, whatever other columns it has.
    assert_eq!(found["format"], "CSV");
    assert!(found["detection"].is_null(), "{found}");
    assert_eq!((&found["missing"], &found["spurious"]), (&0.into(), &0.into()));
    assert_eq!(found["event_errors"]["matched"], 29);
    assert!(found["event_errors"]["max"].number() < 1e-11, "{found}");
    // Samples alone, in the columns of the problem.
    let found = compared(&folder, &belt, &belt.join("samples.csv"), &["--quick"]);
    assert_eq!((&found["missing"], &found["spurious"]), (&0.into(), &0.into()));
    assert!(!found["detection"].is_null(), "{found}");
}

/// The score is computed by the set's checker, whose command the report names.
#[test]
fn cli_a_late_event_of_a_problem_is_an_error_and_has_a_score_elsewhere() {
    let folder = Folder::new();
    let belt = problem("10-belt-leine");
    let text = std::fs::read_to_string(belt.join("events.csv")).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut cells: Vec<String> = lines[5].split(',').map(str::to_owned).collect();
    cells[1] = format!("{:.17}", cells[1].parse::<f64>().unwrap() + 1e-3);
    lines[5] = cells.join(",");
    let late = folder.write("late.csv", lines.join("\n"));
    let found = compared(&folder, &belt, &late, &["--quick"]);
    let largest = found["event_errors"]["max"].number();
    assert!((largest - 1e-3).abs() < 1e-8, "{largest}");
    let (checker, belt) = (problem("check.py").display().to_string(), belt.display().to_string());
    let command = format!("python3 {checker} {belt} {}", late.display());
    assert_eq!(found["score_command"], *command);
    let late = late.to_str().unwrap();
    let text = folder.ok(&["compare", &belt, late, "--quick"][..]);
    says(&text, &[&format!("score it by the rules of the set: {command}\n")]);
    // The events are in a separate file.
    let samples = format!("{belt}/samples.csv");
    let found = compared(&folder, belt.as_ref(), samples.as_ref(), &["--quick", "--events", late]);
    assert_eq!(
        found["score_command"],
        *format!("python3 {checker} {belt} {samples} --events {late}")
    );
    // The command contains the settings of the search for events, in shell syntax. There is no command for files that
    // the checker cannot read.
    let text = std::fs::read_to_string(&samples).unwrap();
    let spaced = folder.write("my samples.csv", &text);
    let found = compared(
        &folder,
        belt.as_ref(),
        &spaced,
        &["--quick", "--velocity-tolerance", "1e-6", "--hysteresis", "3"],
    );
    let quoted = format!("'{}'", spaced.display());
    assert_eq!(
        found["score_command"],
        *format!("python3 {checker} {belt} {quoted} --threshold 1e-6 --hysteresis 3")
    );
    let other = folder.write("other.csv", text.replacen("time,", "t,", 1));
    assert!(compared(&folder, belt.as_ref(), &other, &["--quick"])["score_command"].is_null());
}

/// The names of a problem's columns are known, even those of several inertias.
#[test]
fn cli_the_columns_of_a_problem_are_channels() {
    let folder = Folder::new();
    for (name, channels) in [
        ("16-drill-string", 3),
        ("17-groan", 6),
        ("15-clutch", 4),
        ("18-lugre", 3),
    ] {
        let reference = problem(name);
        let found = compared(&folder, &reference, &reference.join("samples.csv"), &["--quick"]);
        let rows = found["channels"].list();
        let mut known: Vec<&str> = rows.iter().map(|row| row["channel"].text()).collect();
        known.sort_unstable();
        known.dedup();
        assert!(known.len() >= channels, "{name}: {known:?}");
        for row in rows {
            let mistake = row["relative"].as_f64().unwrap_or(0.0);
            assert!(mistake < 1e-6, "{name}: {row}");
        }
    }
}

#[test]
fn cli_what_is_no_problem_is_refused() {
    let folder = Folder::new();
    let refused = |reference: &str, words: &str| folder.refused(&["compare", reference, "mine.csv"], words);
    folder.write("mine.csv", "time,x,v\n0,0,0\n1,0,0\n");
    std::fs::create_dir(folder.path("empty")).unwrap();
    refused(
        "empty",
        "empty: a folder without a set.toml beside it & the folder of a problem in its set",
    );
    let set = std::fs::read_to_string(problem("set.toml")).unwrap();
    folder.write("set.toml", &set);
    refused("empty", "no problem in the set.toml beside it");
    // A set without its cases.
    std::fs::create_dir(folder.path("01-launched-mass")).unwrap();
    refused("01-launched-mass", "01-launched-mass.toml & take the set again");
    folder.write("set.toml", set.replacen("version", "edition", 1));
    refused("empty", "set.toml & take the file of a published benchmark set");
}
