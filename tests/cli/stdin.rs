//! A case from standard input, errors as JSON, --strict, and help.

use crate::common::cli::{Folder, SHORT, json, output, refusal, says};
use crate::common::json::*;

fn short<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    arguments.iter().chain(SHORT).copied().collect()
}

#[test]
fn cli_run_reads_a_case_from_standard_input() {
    let folder = Folder::new();
    let text = folder.ok("case paper");
    output(
        folder
            .stickslip(&short(&["run", "-", "-q", "-o", "piped.h5"]))
            .write_stdin(text.clone()),
        0,
    );
    folder.write("mine.toml", &text);
    folder.ok(&short(&["run", "mine.toml", "-q"]));
    let (piped, mine) = (folder.result("piped.h5"), folder.result("mine.h5"));
    assert_eq!(piped.resolved().unwrap(), mine.resolved().unwrap());
    assert_eq!(piped.case_text().unwrap(), text);
    let found = piped.column("theta", 0..51).unwrap();
    assert_eq!(found, mine.column("theta", 0..51).unwrap());
    let (stdout, _) = output(folder.stickslip("modes - --json").write_stdin(text.clone()), 0);
    json(&stdout);
    // The case has no name after which its result could be named.
    for command in ["run", "certify"] {
        let stderr = refusal(folder.stickslip(&[command, "-"]).write_stdin(text.clone()));
        says(&stderr, &["standard input", "-o result.h5"]);
    }
    let broken = text.replace("breakaway = 0.6", "breakway = 0.6");
    let line = broken.lines().position(|line| line.starts_with("breakway")).unwrap() + 1;
    let stderr = refusal(folder.stickslip("run - -o x.h5").write_stdin(broken));
    assert!(
        stderr.contains(&format!("standard input:{line}: friction.breakway: unknown key")),
        "{stderr}"
    );
    let stderr = refusal(
        folder
            .stickslip("run - -o x.h5")
            .write_stdin(&b"\x89HDF\r\n\x1a\n\0"[..]),
    );
    assert!(stderr.contains("standard input: not a case file"), "{stderr}");
    assert_eq!(folder.names(), ["mine.h5", "mine.toml", "piped.h5"]);
}

/// No file is named "-" where users may expect a stream.
#[test]
fn cli_outputs_are_not_called_minus() {
    let folder = Folder::new();
    for arguments in [
        &["run", "-o", "-"][..],
        &["certify", "-o", "-"],
        &["sweep", "critical-curve", "-o", "-"],
        &["plot", "x.h5", "-o", "-"],
        &["plot", "x.h5", "--html", "-"],
        &["calibrate", "-o", "-"],
        &["work-precision", "-o", "-"],
        &["modes", "--figure", "-"],
        &["merge", "a.h5", "-o", "-"],
        &["export", "x.h5", "--benchmark", "-o", "-"],
        &["compare", "a.h5", "b.h5", "--report", "-"],
    ] {
        folder.refused(arguments, &["not written to standard output"]);
    }
    assert_eq!(folder.names(), [] as [&str; 0]);
}

/// One document is on standard output, and the text is on standard error as usual.
#[test]
fn cli_errors_are_json_where_json_is_asked_for() {
    let folder = Folder::new();
    let text = folder.ok("case paper");
    folder.write("broken.toml", text.replace("breakaway = 0.6", "breakway = 0.6"));
    let line = text.lines().position(|line| line.starts_with("breakaway")).unwrap() + 1;
    let error = |arguments: &[&str], status: i32| {
        let (stdout, stderr) = folder.ends(arguments, status);
        let document = json(&stdout);
        let error = document["error"].clone();
        assert_eq!(error["exit_status"], status, "{document}");
        let first = error["message"].text().lines().next().unwrap().to_owned();
        assert!(stderr.contains(&first), "{first} in {stderr}");
        error
    };
    let found = error(&["run", "broken.toml", "--json"], 2);
    assert_eq!(found["kind"], "input");
    let places = found["places"].list();
    let unknown = places.with("key", "friction.breakway");
    assert_eq!(unknown["file"], "broken.toml");
    assert_eq!(unknown["line"], line);
    let found = error(&["run", "--set", "solver.method=serise", "--json"], 2);
    assert_eq!(found["places"][0]["option"], "--set");
    assert_eq!(found["places"][0]["key"], "solver.method");
    assert!(found["message"].text().contains("did you mean \"series\"?"));
    let found = error(&["inspect", "missing.h5", "--json"], 2);
    assert_eq!(found["places"][0]["file"], "missing.h5");
    for arguments in [
        &["run", "--tolerance", "1", "--json"][..],
        &["--json", "serun"],
        &["plot", "--json"],
    ] {
        assert_eq!(error(arguments, 2)["kind"], "usage");
    }
    for command in "certify modes check plot compare sweep calibrate work-precision case".split(' ') {
        let mut arguments = vec![command, "./missing.x", "--json"];
        if command == "compare" {
            arguments.push("other.csv");
        }
        assert_eq!(error(&arguments, 2)["kind"], "input", "{command}");
    }
    // A failing run has its own document, and no second one.
    let failing = ["run", "--json", "--set", "solver.max_events=1", "-o", "failed.h5"];
    let (stdout, _) = folder.ends(&failing, 1);
    assert_eq!(json(&stdout)["status"], "failed");
}

/// For an onset that is amplified rounding the exit status is 0, or 1 if no warning is accepted.
#[test]
fn cli_strict_lets_no_warning_pass() {
    let folder = Folder::new();
    let (_, stderr) = folder.ends("run unperturbed", 0);
    assert!(stderr.contains("warning: "), "{stderr}");
    let (_, stderr) = folder.ends("run unperturbed --strict", 1);
    assert!(stderr.contains("--strict lets no warning pass"), "{stderr}");
    assert!(folder.path("unperturbed.h5").exists());
    let (stdout, _) = folder.ends("run unperturbed --strict --json -q", 1);
    assert!(!json(&stdout)["warnings"].list().is_empty());
    folder.ok("run paper --strict -q");
    folder.ends("certify unperturbed.h5 --strict -q", 1);
    folder.write(
        "study.toml",
        "case = 'paper'\n[set]\n'output.end_time' = 0.05\n[[axis]]\nkey = 'torsion.damping'\nvalues = [20, 30]\n",
    );
    folder.ok("sweep study.toml -q");
    let (_, stderr) = folder.ends("sweep study.toml -q --force --strict", 1);
    assert!(stderr.contains("of 2 points"), "{stderr}");
}

#[test]
fn cli_help_of_commands_and_what_a_misspelt_one_means() {
    let folder = Folder::new();
    let all = folder.ok("help");
    for command in ["run", "export", "work-precision", "help"] {
        assert!(
            all.lines().any(|line| line.trim_start().starts_with(command)),
            "{command} in {all}"
        );
    }
    let of_run = folder.ok("help run");
    assert_eq!(of_run, folder.ok("run --help"));
    let of_export = folder.ok("help export");
    let wide: Vec<&str> = of_export.lines().filter(|line| line.chars().count() > 80).collect();
    assert_eq!(wide, Vec::<&str>::new());
    folder.refused("comparre", "did you mean compare?");
    folder.refused("integrate", "the commands are run, certify,");
    folder.refused("run --method serise", &["did you mean \"series\"?"]);
}
