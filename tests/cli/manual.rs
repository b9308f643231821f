//! The commands of the manual as they are written there, run one after the other in one folder for each document.

use crate::common::cli::{Folder, json, text};
use std::path::Path;
use std::process::Command;

/// A code block of a document: its language and lines, and the paragraph before it.
struct Block {
    language: String,
    lines: Vec<String>,
    before: String,
}

fn blocks(document: &str) -> Vec<Block> {
    let (mut found, mut open): (Vec<Block>, Option<Block>) = (Vec::new(), None);
    let mut paragraph = String::new();
    for line in document.lines() {
        match (&mut open, line.strip_prefix("```")) {
            (None, Some(language)) => {
                open = Some(Block {
                    language: language.to_owned(),
                    lines: Vec::new(),
                    before: std::mem::take(&mut paragraph),
                });
            }
            (Some(_), Some(_)) => found.extend(open.take()),
            (Some(block), None) => block.lines.push(line.to_owned()),
            (None, None) if line.starts_with('#') => paragraph.clear(),
            (None, None) => paragraph += &format!("{line}\n"),
        }
    }
    found
}

/// Files that the reader has, by document: a command that makes them, and the beginning of the manual's command
/// before which it is run.
const GIVEN: &[(&str, &str, &str)] = &[
    (
        "calibration.md",
        "stickslip calibrate STUDY",
        "stickslip case paper-decay > STUDY.toml",
    ),
    (
        "clusters.md",
        "stickslip sweep STUDY",
        "printf 'case = \"paper\"\\nset = { output.end_time = 0.02, solver.method = \"series\" }\\n\
         axis = [{ key = \"torsion.damping\", from = 10, to = 30, count = 8 }]\\n' > STUDY.toml",
    ),
    (
        "clusters.md",
        "stickslip merge",
        "for k in 2 3 4; do stickslip sweep STUDY.toml --shard $k/4 -q; done",
    ),
    (
        "gallery.md",
        "stickslip plot paper.h5 other.h5",
        "stickslip run -q --set friction.decay=4.99 -o other.h5",
    ),
    (
        "installing.md",
        "stickslip completions",
        "mkdir -p ~/.local/share/bash-completion/completions ~/.config/fish/completions ~/.zfunc",
    ),
    (
        "parameter-studies.md",
        "stickslip sweep STUDY",
        "printf 'case = \"paper\"\\naxis = [{ key = \"torsion.damping\", from = 10, to = 30, count = 3 }]\\n' > STUDY.toml",
    ),
    (
        "validate-your-solver.md",
        "stickslip compare belt-leine.h5",
        "stickslip export belt-leine.h5 -o mine.csv --force",
    ),
    (
        "validate-your-solver.md",
        "stickslip compare paper.h5 rk4",
        "cp mine.csv rk4.csv",
    ),
    (
        "validate-your-solver.md",
        "stickslip compare paper-si.h5 octave",
        "stickslip export paper-si.h5 -o octave.csv",
    ),
    (
        "validate-your-solver.md",
        "stickslip compare benchmarks",
        "stickslip run -q benchmarks/cases/09-belt-coulomb.toml -o 09.h5 && stickslip export 09.h5 -o mine.csv --table events --force",
    ),
    (
        "validate-your-solver.md",
        "stickslip compare paper.h5 mine.csv --column",
        "stickslip export paper.h5 --channels relative_velocity -o own.csv && \
         (echo clock,w; tail -n +2 own.csv | awk -F, '{ printf \"%.17g,%.17g\\n\", 1000*$1, $2*30/3.14159265358979 }') > mine.csv",
    ),
    (
        "validate-your-solver.md",
        "stickslip compare paper.h5 mine.csv --report",
        "stickslip export paper.h5 -o mine.csv --force",
    ),
    (
        "README.md",
        "stickslip compare benchmarks",
        "stickslip run -q benchmarks/cases/09-belt-coulomb.toml -o 09.h5 && stickslip export 09.h5 -o mine.csv --force",
    ),
];

/// Commands on files that neither the repository nor the reader has.
const NOT_RUN: &[&str] = &["stickslip compare paper.h5 brakeT01.csv"];

fn shell(folder: &Folder, line: &str) -> (i32, String, String) {
    let program = Path::new(env!("CARGO_BIN_EXE_stickslip")).parent().unwrap();
    let path = std::env::var("PATH").unwrap();
    let output = Command::new("sh")
        .args(["-c", line])
        .current_dir(folder.path("."))
        .env("PATH", format!("{}:{path}", program.display()))
        .env("HOME", folder.path("."))
        .output()
        .unwrap();
    (
        output.status.code().unwrap_or(-1),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// Runs the commands of a document, whose reader has a run of the paper's brake, and samples of it as a candidate.
/// Returns the commands that fail, with their output.
fn run_all(document: &str) -> Vec<String> {
    let mut failed = Vec::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = match document {
        "README.md" => root.join(document),
        _ => root.join("docs").join(document),
    };
    let name = path.file_name().unwrap().to_str().unwrap();
    let folder = Folder::new();
    let shell = |line: &str| shell(&folder, line);
    for linked in ["benchmarks", "examples"] {
        std::os::unix::fs::symlink(root.join(linked), folder.path(linked)).unwrap();
    }
    let found = shell("stickslip run -q && stickslip export -q paper.h5 -o mine.csv").0;
    assert_eq!(found, 0);
    let mut refusal = None;
    for block in blocks(&std::fs::read_to_string(&path).unwrap()) {
        let whole = block.lines.join("\n");
        match block.language.as_str() {
            "toml" => {
                let named = block
                    .before
                    .split_once("This is `")
                    .and_then(|(_, rest)| rest.split('`').next());
                named.map(|named| folder.write(named, &whole));
            }
            // The JSON is the output of the command before it.
            "json" => assert_eq!(refusal.take(), Some(json(&whole)), "{name}"),
            "sh" | "text" => {
                let commands = block.lines.iter().map(|line| line.trim_start_matches("$ "));
                for command in commands.filter(|line| line.starts_with("stickslip ")) {
                    let command = command.split("  #").next().unwrap().trim();
                    if NOT_RUN.iter().any(|other| command.starts_with(other)) {
                        continue;
                    }
                    for (_, _, make) in GIVEN
                        .iter()
                        .filter(|(of, before, _)| *of == name && command.starts_with(before))
                    {
                        let (status, _, stderr) = shell(make);
                        assert_eq!(status, 0, "{name}: {make}: {stderr}");
                    }
                    let (status, stdout, stderr) = shell(command);
                    if status == 2 && command.ends_with("--json") {
                        refusal = Some(json(&stdout));
                        continue;
                    }
                    if status != 0 {
                        failed.push(format!("{name}: {command}: {stderr}"));
                    }
                }
            }
            _ => {}
        }
    }
    assert_eq!(refusal, None, "{name}");
    failed
}

#[test]
fn cli_the_commands_of_the_first_pages_run() {
    for document in ["README.md", "commands.md", "page.md"] {
        assert_eq!(run_all(document), Vec::<String>::new());
    }
}

#[test]
#[ignore = "minutes: studies, calibrations and certificates"]
fn cli_the_long_commands_of_the_manual_run() {
    let docs = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs")).unwrap();
    let mut names: Vec<String> = docs
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.retain(|name| name.ends_with(".md") && !["commands.md", "page.md"].contains(&name.as_str()));
    names.sort();
    let failed: Vec<String> = names.iter().flat_map(|name| run_all(name)).collect();
    assert!(failed.is_empty(), "{failed:#?}");
}
