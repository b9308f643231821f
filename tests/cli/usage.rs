//! What the program says about itself, its cases and its files, and about wrong usage.

use crate::common::cli::{Folder, says};
use predicates::prelude::*;

#[test]
fn cli_version_names_the_libraries() {
    let folder = Folder::new();
    for flag in ["--version", "-V"] {
        let (stdout, stderr) = folder.ends(&[flag], 0);
        assert_eq!(stderr, "");
        // The commit of the build, which the build script provides for this package only.
        let build = concat!(
            "stickslip ",
            env!("CARGO_PKG_VERSION"),
            " (",
            env!("STICKSLIP_COMMIT"),
            ")\n"
        );
        assert!(stdout.starts_with(build), "{stdout}");
        let libraries = predicate::str::is_match(r"\nSUNDIALS 7\.\d+\.\d+\nHDF5 \d+\.\d+\.\d+\n$").unwrap();
        assert!(libraries.eval(&stdout), "{stdout}");
    }
}

#[test]
fn cli_help_is_on_standard_output() {
    let folder = Folder::new();
    for arguments in [
        &["--help"][..],
        &["run", "--help"],
        &["work-precision", "-h"],
        &["plot", "-h"],
        &["modes", "-h"],
        &["inspect", "-h"],
        &["case", "-h"],
    ] {
        let (stdout, stderr) = folder.ends(arguments, 0);
        assert_eq!(stderr, "");
        assert!(stdout.contains("Usage: stickslip"), "{stdout}");
        let wide: Vec<&str> = stdout.lines().filter(|line| line.chars().count() > 80).collect();
        assert_eq!(wide, Vec::<&str>::new(), "{arguments:?}");
    }
}

#[test]
fn cli_wrong_usage_is_status_2_and_says_so_on_standard_error() {
    let folder = Folder::new();
    for arguments in [
        &[][..],
        &["integrate"],
        &["run", "paper", "paper-si"],
        &["run", "--set"],
        &["run", "--tolerance", "1"],
        &["plot"],
        &["plot", "paper.h5", "--html", "page.html", "--width", "85"],
        &["plot", "a.h5", "b.h5", "--html", "page.html"],
        &["plot", "a.h5", "b.h5", "c.h5", "--html", "page.html"],
        &["inspect"],
        &["case"],
        &["case", "paper", "--list"],
    ] {
        let stderr = folder.refused(arguments, "");
        assert!(
            stderr.contains("stickslip") || stderr.contains("--help"),
            "{arguments:?}: {stderr}"
        );
    }
}

/// The printed text is a case file that runs like the built-in case.
#[test]
fn cli_case_prints_a_case_to_start_from() {
    let folder = Folder::new();
    let (text, stderr) = folder.ends("case paper", 0);
    assert_eq!(stderr, "");
    folder.write("mine.toml", &text);
    folder.ok_short("mine.toml -q");
    folder.ok_short("paper -q");
    let found = folder.result("mine.h5").resolved().unwrap();
    assert_eq!(found, folder.result("paper.h5").resolved().unwrap());
    assert_eq!(folder.json("case paper")["text"], text.as_str());
}

#[test]
fn cli_case_lists_the_built_in_cases() {
    let folder = Folder::new();
    // Figures of the study may lie in a folder with its name.
    std::fs::create_dir(folder.path("critical-curve")).unwrap();
    let stdout = folder.ok("case --list");
    let listed = folder.json("case --list");
    for name in ["paper", "paper-si", "unperturbed", "release"] {
        assert!(
            stdout.lines().any(|line| line.trim_start().starts_with(name)),
            "{stdout}"
        );
        let case = listed.as_array().unwrap().iter().find(|case| case["name"] == name);
        assert!(stdout.contains(case.unwrap()["title"].as_str().unwrap()), "{stdout}");
    }
}

#[test]
fn cli_unknown_case_names_those_that_exist() {
    let folder = Folder::new();
    for command in ["case", "run"] {
        let stderr = folder.refused(&[command, "papper"], "");
        let said = predicate::str::contains("\"papper\"")
            .and(predicate::str::contains("did you mean paper?"))
            .and(predicate::str::contains("unperturbed"));
        assert!(said.eval(&stderr), "{stderr}");
    }
}

#[test]
fn cli_case_errors_name_file_line_and_key() {
    let folder = Folder::new();
    let text = folder.ok("case paper-si");
    let line = |part: &str| text.lines().position(|line| line.starts_with(part)).unwrap() + 1;
    let broken = text
        .replace("mass = \"4.54 kg\"", "mass = -1")
        .replace("breakaway = 0.6 ", "breakway = 0.6 ")
        .replace("radius = \"0.052388 m\"", "radius = \"0.05 kg\"");
    folder.write("broken.toml", broken);
    let stderr = folder.refused("run broken.toml", "");
    says(
        &stderr,
        &[
            format!("broken.toml:{}: axial.mass: must be greater than 0", line("mass")),
            format!("broken.toml:{}: friction.breakway: unknown key", line("breakaway")),
            format!("broken.toml:{}: contact.radius: expected a length", line("radius")),
        ],
    );
    assert_eq!(folder.names(), ["broken.toml"]);
}

/// Inputs that a user may give by mistake. None of them may crash the program, and each gets a clear message.
#[test]
fn cli_run_refuses_what_is_no_case() {
    let folder = Folder::new();
    folder.write("empty.toml", "");
    folder.write("junk.toml", [0u8, 159, 146, 150, 255, 254, 7]);
    folder.write("syntax.toml", "[axial\nmass = 1");
    folder.write("fake.h5", b"\x89HDF\r\n\x1a\nand nothing else");
    std::fs::create_dir(folder.path("folder")).unwrap();
    folder.ok_short("-q -o whole.h5");
    let whole = folder.read("whole.h5");
    folder.write("half.h5", &whole[..whole.len() / 2]);
    let before = folder.names();
    for (name, words) in [
        ("empty.toml", "axial.mass: missing"),
        ("junk.toml", "UTF-8"),
        ("syntax.toml", "syntax.toml:1"),
        ("fake.h5", "truncated or damaged"),
        ("half.h5", "truncated or damaged"),
        ("folder", "folder: "),
        ("missing.toml", "missing.toml: "),
        ("./missing", "./missing: "),
        ("", "no built-in case"),
    ] {
        folder.refused(&["run", name], &[words]);
    }
    assert_eq!(folder.names(), before);
}

/// Letters of all alphabets, in names and titles, are stored unchanged.
#[test]
fn cli_run_takes_unicode() {
    let folder = Folder::new();
    let text = folder.ok("case paper");
    let title = "摩擦 Bremse μ₀ 🛑";
    folder.write(
        "摩擦.toml",
        text.replace("Two-disk brake, the paper's parameters in US units", title),
    );
    let stdout = folder.ok_short("摩擦.toml");
    says(&stdout, &[title, "摩擦.h5"]);
    assert_eq!(folder.result("摩擦.h5").title(), title);
}

#[test]
fn cli_inspect_shows_every_variable_with_unit_and_meaning() {
    let folder = Folder::new();
    folder.ok_short("-q -o x.h5");
    let (stdout, stderr) = folder.ends("inspect x.h5", 0);
    assert_eq!(stderr, "");
    says(
        &stdout,
        "stickslip-result & complete & natural_period & relative velocity omega_r & rad s-1 & 2 slip-forward &
         1e-10",
    );
    assert!(stdout.lines().all(|line| line == line.trim_end()), "{stdout:?}");
    let document = folder.json("inspect x.h5");
    let variables = document["variables"].as_array().unwrap();
    let time = variables
        .iter()
        .find(|variable| variable["group"] == "/trajectory" && variable["name"] == "time")
        .unwrap();
    assert_eq!(time["units"], "s");
    assert_eq!(time["shape"], serde_json::json!([51]));
    assert_eq!(time["max"], 0.05);
    let attributes = document["attributes"].as_array().unwrap();
    assert!(
        attributes
            .iter()
            .any(|attribute| attribute["name"] == "status" && attribute["value"] == "complete")
    );
}

#[test]
fn cli_inspect_refuses_what_is_no_result() {
    let folder = Folder::new();
    folder.write("text.h5", "not HDF5");
    std::fs::create_dir(folder.path("folder")).unwrap();
    for (name, words) in [
        ("text.h5", "not an HDF5 file"),
        ("folder", "folder: this is a folder"),
        ("missing.h5", "no such file"),
    ] {
        let stderr = folder.refused(&["inspect", name], &[words]);
        assert!(!stderr.contains("with -o"), "{stderr}");
    }
}
