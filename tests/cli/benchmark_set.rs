//! `compare` with a problem of the benchmark set as its reference. That it says what the set's own checker says, to the last
//! bit, is checked with Python (.ci/benchmarks.py).

use crate::common::cli::Folder;
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
    let score = &found["benchmark"];
    assert_eq!(score["problem"], "09-belt-coulomb");
    assert_eq!(score["sequence"]["agrees"], true);
    assert!(score["digits"].as_f64().unwrap() > 14.0, "{score}");
    assert_eq!(score["events"].as_array().unwrap().len(), 29);
    // The run of its case agrees, too.
    assert!(found["event_errors"]["max"].as_f64().unwrap() < 1e-11, "{found}");
    // By samples alone, whose columns are those of the problem.
    let found = compared(&folder, &belt, &belt.join("samples.csv"), &["--quick"]);
    let score = &found["benchmark"];
    assert_eq!(
        (&score["sequence"]["agrees"], &score["threshold"]),
        (&true.into(), &1e-8.into())
    );
    assert!(
        score["scores"]["position"]["relative"].as_f64().unwrap() < 1e-15,
        "{score}"
    );
    let period = score["summary"]
        .as_array()
        .unwrap()
        .iter()
        .find(|value| value["name"] == "period");
    assert!(period.unwrap()["error"].as_f64().unwrap().abs() < 1e-5, "{score}");
}

#[test]
fn cli_a_late_event_of_a_problem_is_a_requirement_not_met() {
    let folder = Folder::new();
    let belt = problem("10-belt-leine");
    let text = std::fs::read_to_string(belt.join("events.csv")).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut cells: Vec<String> = lines[5].split(',').map(str::to_owned).collect();
    cells[1] = format!("{:.17}", cells[1].parse::<f64>().unwrap() + 1e-3);
    lines[5] = cells.join(",");
    let late = folder.write("late.csv", lines.join("\n"));
    let found = compared(&folder, &belt, &late, &["--quick"]);
    let digits = found["benchmark"]["digits"].as_f64().unwrap();
    // 1 ms of 2 pi s.
    assert!((digits - 3.798).abs() < 1e-3, "{digits}");
    let largest = found["benchmark"]["largest_event_error"].as_f64().unwrap();
    assert!((largest - 1e-3).abs() < 1e-12, "{largest}");
    let (belt, late) = (belt.to_str().unwrap(), late.to_str().unwrap());
    let output = folder
        .stickslip(&["compare", belt, late, "--quick", "--require", "digits>=6"][..])
        .output()
        .unwrap();
    let (text, error) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(
        text.contains("by the rules of the set: 10-belt-leine, set 1.0"),
        "{text}"
    );
    assert!(
        error.contains("digits is 3.798e0, where digits>=6 is required"),
        "{error}"
    );
}

/// The names of a problem's columns are known: also those of several inertias.
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
        let rows = found["channels"].as_array().unwrap();
        let mut known: Vec<&str> = rows.iter().map(|row| row["channel"].as_str().unwrap()).collect();
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
    let refused = |reference: &str, says: &[&str]| {
        let output = folder
            .stickslip(&["compare", reference, "mine.csv"][..])
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{error}");
        for says in says {
            assert!(error.contains(says), "{error}");
        }
    };
    folder.write("mine.csv", "time,x,v\n0,0,0\n1,0,0\n");
    std::fs::create_dir(folder.path("empty")).unwrap();
    refused(
        "empty",
        &["empty: a folder without problem.json", "or the folder of a problem"],
    );
    // A folder away from its set.
    let lost = folder.path("lost");
    std::fs::create_dir(&lost).unwrap();
    for entry in std::fs::read_dir(problem("01-launched-mass")).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, lost.join(path.file_name().unwrap())).unwrap();
    }
    refused(
        "lost",
        &["there is no set.toml beside it", "leave the folders of a set together"],
    );
    let again = "take this file from the set again";
    let statement = std::fs::read_to_string(lost.join("problem.json")).unwrap();
    let samples = std::fs::read_to_string(lost.join("samples.csv")).unwrap();
    let hostile = [
        ("problem.json", "{ \"set\": 1".to_owned()),
        (
            "problem.json",
            statement.replace("\"position\": \"x\"", "\"position\": \"y\""),
        ),
        (
            "problem.json",
            statement.replace("\"time_scale\": 1.0", "\"time_scale\": 0"),
        ),
        ("samples.csv", samples.lines().take(1).collect()),
        ("samples.csv", samples.replace("\n0.5,", "\nNaN,")),
        ("samples.csv", samples.replacen(",v", ",w", 1)),
        ("events.csv", "event,time,kind\n0,1,stick\n".to_owned()),
        ("summary.json", "[]".to_owned()),
    ];
    for (name, text) in hostile {
        let path = lost.join(name);
        let whole = std::fs::read_to_string(&path).unwrap();
        assert_ne!(whole, text, "{name}");
        std::fs::write(&path, text).unwrap();
        refused("lost", &[name, again]);
        std::fs::write(&path, whole).unwrap();
    }
}
