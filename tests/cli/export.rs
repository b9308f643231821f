//! `stickslip export`: exports that can be read back, and refusals.

use crate::common::cli::{Folder, json, output, refusal, text};
use crate::common::json::*;
use crate::common::rows;
use std::collections::BTreeMap;
use stickslip::case::{Case, CaseSource};

/// A run of the paper's brake past its first sticks, with samples around them.
const TO_THE_STICKS: &[&str] = &[
    "run",
    "-q",
    "--no-witness",
    "--set",
    "output.end_time=6.977",
    "-o",
    "run.h5",
];

fn with_run() -> Folder {
    let folder = Folder::new();
    folder.ok(TO_THE_STICKS);
    folder
}

/// Columns of a CSV text, by name without unit.
fn columns(text: &str) -> BTreeMap<String, Vec<String>> {
    let mut lines = text.lines();
    let names: Vec<String> = lines
        .next()
        .unwrap()
        .split(',')
        .map(|name| name.split(" [").next().unwrap().to_owned())
        .collect();
    let mut found: BTreeMap<String, Vec<String>> = names.iter().map(|name| (name.clone(), Vec::new())).collect();
    for line in lines {
        for (name, cell) in names.iter().zip(line.split(',')) {
            found.get_mut(name).unwrap().push(cell.to_owned());
        }
    }
    found
}

fn numbers(cells: &[String]) -> Vec<f64> {
    cells.iter().map(|cell| cell.parse().unwrap()).collect()
}

/// Every sample is exported with all digits, with units in the header, and `compare` reads the file back.
#[test]
fn cli_export_csv_reads_back_bit_for_bit() {
    let folder = with_run();
    folder.ok("export run.h5 -o x.csv");
    let text = folder.text("x.csv");
    assert!(text.starts_with("time [s],mode,segment,"), "{}", &text[..80]);
    assert!(text.contains("relative_velocity [rad s-1]"));
    let found = columns(&text);
    let file = folder.result("run.h5");
    let rows = file.sample_count().unwrap();
    for name in ["time", "rotor_twist", "energy_residual", "relative_velocity"] {
        let bits = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect::<Vec<_>>();
        let got = bits(numbers(&found[name]));
        assert_eq!(got, bits(file.column(name, 0..rows).unwrap()), "{name}");
    }
    assert!(found["mode"].iter().any(|mode| mode == "stick"));
    let stdout = folder.ok("compare run.h5 x.csv --json");
    assert!(stdout.contains("relative_velocity"), "{stdout}");
    // Standard output receives the same text.
    let stdout = folder.ok("export run.h5 -o -");
    assert_eq!(stdout, text);
}

/// An evaluated trajectory equals the samples at their times, and closer samples between them. The oracle is the same
/// run with half the interval.
#[test]
fn regression_export_evaluates_between_samples_as_the_run_goes() {
    let folder = with_run();
    folder.ok("export run.h5 -o dense.csv --window 6.975:6.977 --interval 1.1e-6 --channels relative_velocity,transmitted_torque,mode");
    let dense = columns(&folder.text("dense.csv"));
    assert_eq!(dense.len(), 4, "the time comes by itself");
    let times = numbers(&dense["time"]);
    assert_eq!(times[0], 6.975);
    assert_eq!(times.len(), 1819, "2 ms in steps of 1.1 us");
    // A run with samples at exactly these times.
    let window = "output.window=[{from=6.975, to=6.977, interval=1.1e-6}]";
    folder.ok(&["run", "run.h5", "-q", "--no-witness", "-o", "exact.h5", "--set", window]);
    folder.ok("export exact.h5 -o exact.csv --window 6.975:6.977");
    let exact = columns(&folder.text("exact.csv"));
    let exact_times = numbers(&exact["time"]);
    let mut compared = 0;
    for (row, time) in times.iter().enumerate() {
        let Some(other) = exact_times.iter().position(|other| (other - time).abs() < 1e-12) else {
            continue;
        };
        compared += 1;
        // The polynomials have an error of 2e-12 of an oscillation of 1 rad/s and 100 N m. The times of both grids
        // have rounding errors of 1e-15 s at slopes of 1e5 1/s. Both are far below the error of a straight line
        // between samples, 1e-3.
        for (name, tolerance) in [("relative_velocity", 1e-8), ("transmitted_torque", 1e-6)] {
            let (a, b) = (
                numbers(&dense[name][row..=row])[0],
                numbers(&exact[name][other..=other])[0],
            );
            assert!((a - b).abs() < tolerance, "{name} at {time}: {a} and {b}");
        }
    }
    assert!(compared > 1000, "{compared} times in common");
}

#[test]
fn cli_export_says_that_a_window_goes_beyond_the_run() {
    let folder = with_run();
    for more in [&[][..], &["--rate", "1e3"]] {
        let arguments = ["export", "run.h5", "-o", "-", "--channels", "theta", "--window"];
        let window = |window: &'static str| {
            let all: Vec<&str> = arguments
                .into_iter()
                .chain([window])
                .chain(more.iter().copied())
                .collect();
            folder.ends(&all, 0)
        };
        let ((beyond, warned), (inside, silent)) = (window("6.97:8"), window("6.97:"));
        assert_eq!(beyond, inside);
        assert!(warned.contains("goes from 0.0 to 6.977 s"), "{warned} {silent}");
        assert!(silent.is_empty(), "{warned} {silent}");
    }
}

/// A list of times and a rate give the same values. Columns that only samples have are named, and refused if
/// requested.
#[test]
fn cli_export_at_given_times() {
    let folder = with_run();
    folder.write("times.csv", "n,time [s]\n1,0.25\n2,1.5\n3,6.9761\n");
    let run = |more: &[&str]| {
        let arguments: Vec<&str> = ["export", "run.h5", "-o", "-"].iter().chain(more).copied().collect();
        let stdout = folder.ok(&arguments);
        columns(&stdout)
    };
    let at = run(&["--at", "times.csv"]);
    assert_eq!(numbers(&at["time"]), [0.25, 1.5, 6.9761]);
    assert!(!at.contains_key("energy_residual") && at.contains_key("normal_force"));
    let force = run(&["--rate", "4", "--window", "0.25:0.5", "--channels", "applied_force"]);
    let file = folder.result("run.h5");
    let (times, forces) = (
        file.column("time", 0..file.sample_count().unwrap()).unwrap(),
        file.column("applied_force", 0..file.sample_count().unwrap()).unwrap(),
    );
    // The ramp is a straight line, also between two samples.
    let row = times.partition_point(|time| *time < 0.5);
    let share = (0.5 - times[row - 1]) / (times[row] - times[row - 1]);
    let line = forces[row - 1] + share * (forces[row] - forces[row - 1]);
    assert!((numbers(&force["applied_force"])[1] - line).abs() <= 1e-12 * line);
    let (_, stderr) = folder.ends("export run.h5 -o - --rate 1", 0);
    assert!(stderr.contains("energy_residual"), "{stderr}");
    assert!(!stderr.contains("applied_force"), "{stderr}");
    let rate = run(&["--rate", "4", "--window", "0.25:1.5"]);
    assert_eq!(numbers(&rate["time"]), [0.25, 0.5, 0.75, 1.0, 1.25, 1.5]);
    assert_eq!(rate["theta_dot"][0], at["theta_dot"][0]);
    let document = folder.json("export run.h5 -o a.npz --at times.csv");
    assert_eq!(document["rows"], 3);
    assert!(document["evaluated"].text().contains("equations of motion"));
    let left_out = document["left_out"].list();
    assert!(left_out.iter().any(|name| name == "energy_residual"), "{left_out:?}");
    for [arguments, words] in rows(
        "
        --channels energy_residual --rate 10 | at the samples of the run alone
        --table events --rate 10             | evaluate a trajectory
        --window 8:9 --rate 10               | no part of the run
        --window 8:9                             | the run, which goes from 0.0 to 6.977 s
        --window 8:9 --table events          | no part of the run
        --rate -5                                | give a number greater than 0
        --interval -1e-3                         | give a number greater than 0
        --rate 1e12                              | more than the 1e9
        --channels relative_velocty              | did you mean relative_velocity?
    ",
    ) {
        folder.refused(&format!("export run.h5 -o b.csv {arguments}"), words);
    }
    folder.write("late.csv", "0.5\n99\n");
    folder.write("mixed.csv", "0.5\n0.25\n");
    for (name, words) in [("late.csv", "asks for t = 99.0 s"), ("mixed.csv", "mixed.csv:2: ")] {
        folder.refused(&["export", "run.h5", "-o", "b.csv", "--at", name], &[words]);
    }
    assert!(!folder.path("b.csv").exists());
}

/// Between samples the values follow from the equations' series. Columns that only a drive moves are left out.
#[test]
fn cli_export_of_trains() {
    let folder = Folder::new();
    folder.ok("run belt-leine -q --no-witness");
    let stdout = folder.ok("export belt-leine.h5 -o - --interval 0.5 --channels mode,phi1,relative_velocity");
    let found = columns(&stdout);
    assert_eq!(found["time"].len(), 201);
    assert!(found["mode"].iter().any(|mode| mode == "stick"));
    // In a stick the block moves with the belt.
    for (mode, velocity) in found["mode"].iter().zip(numbers(&found["relative_velocity"])) {
        assert!(mode != "stick" || velocity.abs() < 1e-12, "{velocity}");
    }
    let stdout = folder.ok("export belt-leine.h5 -o - --table events");
    assert!(stdout.starts_with("event,time [s],kind,"), "{stdout}");
}

/// Every format begins as its readers expect. Its contents are checked by .ci/interop.py.
#[test]
fn cli_export_writes_each_format_and_replaces_its_own() {
    let folder = with_run();
    for (name, magic) in [("x.npz", &b"PK\x03\x04"[..]), ("x.mat", b"MATLAB 5.0 MAT-file")] {
        for _ in 0..2 {
            folder.ok(&["export", "run.h5", "-o", name, "--table", "events"]);
            assert!(folder.read(name).starts_with(magic), "{name}");
        }
    }
    folder.ok("export run.h5 -o data --format csv --table segments");
    folder.ok("export run.h5 -o data --format csv --table segments");
    // A file of another origin is not replaced.
    for name in ["own.csv", "own.npz", "own.mat"] {
        folder.write(name, "time,x\n0,1\n");
        folder.refused(&["export", "run.h5", "-o", name], &["--force"]);
        assert_eq!(folder.read(name), b"time,x\n0,1\n");
        folder.ok(&["export", "run.h5", "-o", name, "--force", "--table", "stick_slip"]);
    }
    for [arguments, words] in rows(
        "
        run.h5 -o run.h5                                        | names no format
        run.h5 -o x.parquet                                     | to_parquet
        run.h5 -o x --format parquet                        | to_parquet
        run.h5 -o run.h5 --format csv --force             | the file to be exported
        run.h5 -o - --format npz                            | a file only
        run.h5 -o - --json                                    | leave one of them out
        run.h5 -o none/x.csv                                    | the folder none does not exist
        run.h5 -o x.csv --table stick_slip --window 1:2 | have none
        missing.h5 -o x.csv                                     | no such file
    ",
    ) {
        let (stdout, stderr) = folder.ends(&format!("export {arguments}"), 2);
        let found = stdout.is_empty();
        assert_eq!(found, !arguments.contains("--json"), "{arguments:?}: {stdout}");
        assert!(stderr.contains(words), "{arguments:?}: {stderr}");
    }
}

/// Times and rates with units equal those in SI units.
#[test]
fn cli_export_takes_units() {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    let rows = |arguments: &[&str]| folder.ok(&[&["export", "run.h5", "-o", "-", "-q"], arguments].concat());
    let plain = rows(&["--window", "0.01:0.02", "--rate", "48000"]);
    assert_eq!(plain.lines().count(), 482);
    for (window, rate) in [
        ("0.01 s:20 ms", "48 kHz"),
        ("10ms : 20000 us", "48e3 Hz"),
        ("0.01:20 ms", "0.048MHz"),
    ] {
        assert_eq!(rows(&["--window", window, "--rate", rate]), plain);
    }
    let interval = rows(&["--window", ":0.02 s", "--interval", "0.5 ms"]);
    assert_eq!(interval, rows(&["--window", ":0.02", "--interval", "5e-4"]));
    for (option, value, word) in [
        ("--rate", "48 kg", "a frequency in Hz"),
        ("--rate", "0 Hz", "greater than 0"),
        ("--interval", "-1 ms", "greater than 0"),
        ("--window", "0 s 1 s", "a colon"),
        ("--window", "0 Hz:1 s", "a time in s"),
    ] {
        folder.refused(&["export", "run.h5", "-o", "-", option, value], word);
    }
}

/// The sections that a package takes from the manual exist, and have no links to pages that the package lacks.
#[track_caller]
fn sections_of_the_manual(page: &str, headings: &[&str]) {
    for heading in headings {
        let (_, section) = page.split_once(&format!("{heading}\n")).expect(heading);
        assert!(section.len() > 800, "{heading}: {section}");
    }
    assert!(!page.contains("]("), "{page}");
}

#[test]
fn cli_export_benchmark_is_a_package() {
    let folder = with_run();
    folder.refused(
        "export run.h5 --benchmark -o bench",
        "no certificate & stickslip certify",
    );
    assert!(!folder.path("bench").exists());
    folder.ok("certify run.h5 -q -o certified.h5");
    let make = |more: &[&str]| -> Vec<&str> {
        let all = ["export", "certified.h5", "--benchmark", "-o", "bench"];
        all.iter()
            .chain(more)
            .map(|one| Box::leak(one.to_string().into_boxed_str()) as &str)
            .collect()
    };
    folder.ok(&make(&[]));
    let stdout = folder.ok(&make(&["--author", "A. Name", "--license", "CC-BY-4.0", "--json"]));
    let files = json(&stdout)["files"].clone();
    let read = |name: &str| std::fs::read_to_string(folder.path("bench").join(name)).unwrap();
    let mut there: Vec<String> = std::fs::read_dir(folder.path("bench"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    let as_array = files.list();
    let mut listed: Vec<String> = as_array.iter().map(|name| name.text().to_owned()).collect();
    there.sort();
    listed.sort();
    assert_eq!(there, listed);
    let package = json(&read("datapackage.json"));
    for resource in package["resources"].list() {
        let bytes = std::fs::metadata(folder.path("bench").join(resource["path"].text()))
            .unwrap()
            .len();
        assert_eq!(resource["bytes"], bytes, "{resource}");
    }
    assert_eq!(package["licenses"][0]["name"], "CC-BY-4.0");
    let events = columns(&read("events.csv"));
    let file = folder.result("certified.h5");
    let found = numbers(&events["time_uncertainty"]);
    assert_eq!(found, file.event_column("time_uncertainty").unwrap());
    assert!(events.contains_key("verdict") && events.contains_key("phi1_after"));
    let readme = read("README.md");
    assert!(readme.contains("A. Name") && readme.contains("SHA-256"), "{readme}");
    let parameters = json(&read("parameters.json"));
    let as_array = parameters["parameters"].list();
    let damping = as_array.with("key", "torsion.damping");
    assert_eq!(damping["unit"], "N m s/rad");
    assert_eq!(damping["value"], 22.59696580552334);
    let equations = read("equations.md");
    assert!(equations.contains("rotor surface  J phi_2''"));
    sections_of_the_manual(&equations, &["## The brake", "## Friction laws"]);
    // The script solves the system in either form of the case.
    let case = Case::read(&CaseSource::text(&file.resolved().unwrap()), &[]).unwrap();
    folder.write("general.toml", case.in_general_form().resolved());
    folder.ok("run general.toml -q -o general.h5");
    folder.ok("certify general.h5 -q -o certified-general.h5");
    folder.ok("export certified-general.h5 --benchmark -o general");
    assert_eq!(folder.read("general/example.py"), folder.read("bench/example.py"));
    assert!(text(&folder.read("general/parameters.json")).contains("rotor.inertia"));
    let equations = text(&folder.read("general/equations.md"));
    sections_of_the_manual(
        &equations,
        &["## Trains", "### Contacts without stick", "## Friction laws"],
    );
    // A folder with other contents is left alone.
    std::fs::create_dir(folder.path("mine")).unwrap();
    folder.write("mine/thesis.tex", "x");
    folder.refused("export certified.h5 --benchmark -o mine", &["not a benchmark package"]);
    folder.refused(&make(&["--license", "none of yours"]), &["SPDX"]);
}

/// If the samples of a run are too far apart for other times, the message contains a command that helps.
#[test]
fn regression_export_says_how_a_run_has_every_time() {
    let folder = Folder::new();
    folder.ok("run lugre-slider -q");
    let export = |file: &str| folder.stickslip(&["export", file, "-q", "--interval", "0.001", "-o", "x.csv"]);
    let refused = refusal(&mut export("lugre-slider.h5"));
    let (_, command) = refused.trim().split_once("stickslip run").unwrap();
    let arguments: Vec<&str> = command.split_whitespace().collect();
    let expected = ["lugre-slider.h5", "--set", "output.dense=true"];
    assert_eq!(arguments, expected, "{refused}");
    folder.ok(&[&["run"][..], &arguments, &["-q", "-o", "dense.h5"]].concat());
    output(&mut export("dense.h5"), 0);
    let rows = columns(&folder.text("x.csv"))["time"].len();
    assert_eq!(rows, 30_001);
}

/// A kill leaves no file, and neither does a full disk, which is reported in one line.
#[cfg(target_os = "linux")]
#[test]
fn cli_an_export_that_does_not_end_leaves_nothing() {
    let folder = Folder::new();
    folder.ok("run paper -q -o run.h5 --set output.interval=1e-4");
    for (format, wait) in [("csv", 100), ("csv", 300), ("npz", 100), ("mat", 100)] {
        let mut child = folder.start(&format!("export run.h5 -o x.{format}"));
        std::thread::sleep(std::time::Duration::from_millis(wait));
        let _ = child.kill();
        if child.wait().unwrap().success() {
            std::fs::remove_file(folder.path(&format!("x.{format}"))).unwrap();
        }
        assert_eq!(folder.names(), ["run.h5"], "{format}, {wait} ms");
    }
    let program = env!("CARGO_BIN_EXE_stickslip");
    for format in ["csv", "npz", "mat"] {
        let limited = std::process::Command::new("bash")
            .args([
                "-c",
                &format!("ulimit -f 64; exec {program} export run.h5 -o x.{format}"),
            ])
            .current_dir(folder.path("."))
            .output()
            .unwrap();
        let stderr = String::from_utf8(limited.stderr).unwrap();
        assert_eq!(limited.status.code(), Some(1), "{stderr}");
        assert!(
            stderr.starts_with(&format!("stickslip: x.{format}: writing failed")),
            "{stderr}"
        );
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        assert_eq!(folder.names(), ["run.h5"]);
    }
}
