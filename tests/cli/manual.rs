//! The commands of the manual as they are written there, run one after the other in one folder for each document.

use crate::common::cli::{Folder, json, text};
use std::path::{Path, PathBuf};
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

/// Files that the reader has: the beginning of the manual's command, and a command that makes them before it.
const GIVEN: &[(&str, &str)] = &[
    (
        "stickslip sweep STUDY",
        "printf 'case = \"paper\"\\nset = { output.end_time = 0.02, solver.method = \"series\" }\\n\
         axis = [{ key = \"torsion.damping\", from = 10, to = 30, count = 8 }]\\n' > STUDY.toml",
    ),
    (
        "stickslip merge",
        "for k in 2 3 4; do stickslip sweep STUDY.toml --shard $k/4 -q; done",
    ),
    (
        "stickslip completions",
        "mkdir -p ~/.local/share/bash-completion/completions ~/.config/fish/completions ~/.zfunc",
    ),
    (
        "stickslip export paper.certified.h5 --benchmark",
        "stickslip certify -q paper.h5",
    ),
    (
        "stickslip compare belt-leine.h5 mine.csv --velocity",
        "stickslip run -q belt-leine && stickslip export belt-leine.h5 -o mine.csv --force",
    ),
    ("stickslip compare paper.h5 rk4", "cp mine.csv rk4.csv"),
    (
        "stickslip compare paper-si.h5 octave",
        "stickslip export paper-si.h5 -o octave.csv",
    ),
    (
        "stickslip compare benchmarks",
        "stickslip run -q benchmarks/cases/09-belt-coulomb.toml -o 09.h5 && stickslip export 09.h5 -o mine.csv --table events --force",
    ),
    (
        "stickslip compare paper.h5 mine.csv --column",
        "stickslip export paper.h5 --channels relative_velocity -o own.csv && \
         (echo clock,w; tail -n +2 own.csv | awk -F, '{ printf \"%.17g,%.17g\\n\", 1000*$1, $2*30/3.14159265358979 }') > mine.csv",
    ),
    (
        "stickslip compare paper.h5 mine.csv --re",
        "stickslip export paper.h5 -o mine.csv --force",
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

/// Whether a printed line is that of the manual. Blanks count as one. Times of the machine may differ, and errors below
/// 1e-8 up to a factor of ten. ` ...` at the end of the manual's line stands for the rest of a line.
fn is_as_written(manual: &str, printed: &str) -> bool {
    let (manual, open) = match manual.strip_suffix(" ...") {
        Some(beginning) => (beginning, true),
        None => (manual, false),
    };
    let manual: Vec<&str> = manual.split_whitespace().collect();
    let printed: Vec<&str> = printed.split_whitespace().collect();
    let number = |word: &str| word.trim_end_matches([',', ';', ':']).parse::<f64>().ok();
    let alike = |at: usize| {
        let next = |ahead: usize| *manual.get(at + ahead).unwrap_or(&"");
        let (Some(one), Some(other)) = (number(manual[at]), number(printed[at])) else {
            return false;
        };
        let of_machine = (at > 0 && manual[at - 1] == "in" && next(1).starts_with('s')) || next(2) == "second";
        let error = |value: f64| value != 0.0 && value.abs() < 1e-8;
        of_machine || (error(one) && error(other) && (0.1..=10.0).contains(&(one / other)))
    };
    (manual.len() == printed.len() || (open && manual.len() < printed.len()))
        && (0..manual.len()).all(|at| manual[at] == printed[at] || alike(at))
}

/// The first line of the manual that the program does not print where it should. A line `...` stands for any lines.
fn first_difference<'a>(manual: &[&'a str], printed: &str) -> Option<&'a str> {
    let printed: Vec<&str> = printed.lines().collect();
    let (mut next, mut skips) = (0, false);
    for line in manual {
        if *line == "..." {
            skips = true;
            continue;
        }
        let is_it = |printed: &&str| is_as_written(line, printed);
        let reach = if skips {
            printed.len()
        } else {
            printed.len().min(next + 1)
        };
        match printed[next..reach].iter().position(is_it) {
            Some(at) => next += at + 1,
            None => return Some(line),
        }
        skips = false;
    }
    (!skips && next < printed.len()).then_some("(the end)")
}

/// The commands of a block, each with the lines that it prints, as far as the manual has them.
fn commands(block: &Block) -> Vec<(&str, Option<Vec<&str>>)> {
    let is_session = block.language == "text" && block.lines.first().is_some_and(|line| line.starts_with("$ "));
    let mut found: Vec<(&str, Option<Vec<&str>>)> = Vec::new();
    for line in &block.lines {
        match (is_session, line.strip_prefix("$ ")) {
            (true, Some(command)) => found.push((command, Some(Vec::new()))),
            (true, None) => found.last_mut().unwrap().1.as_mut().unwrap().push(line),
            (false, _) if block.language == "sh" && line.starts_with("stickslip ") => {
                found.push((line.split("  #").next().unwrap().trim(), None));
            }
            (false, _) => {}
        }
    }
    found
}

/// Runs the commands of a document, whose reader has a run of the paper's brake, and samples of it as a candidate.
/// Returns the commands that fail or print something else than the manual says, with their output.
fn run_all(document: &str) -> Vec<String> {
    let mut failed = Vec::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = Folder::new();
    let shell = |line: &str| shell(&folder, line);
    for linked in ["benchmarks", "examples"] {
        std::os::unix::fs::symlink(root.join(linked), folder.path(linked)).unwrap();
    }
    let found = shell("stickslip run -q && stickslip export -q paper.h5 -o mine.csv").0;
    assert_eq!(found, 0);
    let mut refusal = None;
    for block in blocks(&std::fs::read_to_string(root.join(document)).unwrap()) {
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
            "json" => assert_eq!(refusal.take(), Some(json(&whole)), "{document}"),
            _ => {}
        }
        for (command, lines) in commands(&block) {
            if NOT_RUN.iter().any(|other| command.starts_with(other)) {
                continue;
            }
            for (_, make) in GIVEN.iter().filter(|(before, _)| command.starts_with(before)) {
                let (status, _, stderr) = shell(make);
                assert_eq!(status, 0, "{document}: {make}: {stderr}");
            }
            let (status, stdout, stderr) = shell(command);
            if status == 2 && command.ends_with("--json") {
                refusal = Some(json(&stdout));
                continue;
            }
            // What the manual shows may be an error.
            let Some(lines) = lines else {
                if status != 0 {
                    failed.push(format!("{document}: {command}: {stderr}"));
                }
                continue;
            };
            let printed = stdout + &stderr;
            if let Some(line) = first_difference(&lines, &printed) {
                failed.push(format!("{document}: {command}: not there: {line}\n{printed}"));
            }
        }
    }
    assert_eq!(refusal, None, "{document}");
    failed
}

/// Documents whose commands take seconds.
const SHORT: &[&str] = &[
    "README.md",
    "docs/1-first-run.md",
    "docs/2-your-case.md",
    "docs/reference/commands.md",
];

#[test]
fn cli_the_commands_of_the_first_pages_run() {
    let failed: Vec<String> = SHORT.iter().flat_map(|document| run_all(document)).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
#[ignore = "minutes: studies, calibrations and certificates"]
fn cli_the_long_commands_of_the_manual_run() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut names = Vec::new();
    for folder in ["docs", "docs/reference"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            names.push(format!(
                "{folder}/{}",
                entry.unwrap().file_name().into_string().unwrap()
            ));
        }
    }
    names.retain(|name| name.ends_with(".md") && !SHORT.contains(&name.as_str()));
    names.sort();
    let failed: Vec<String> = names.iter().flat_map(|name| run_all(name)).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// The documents in these folders, each with its path.
fn documents() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [
        "",
        "docs",
        "docs/developer",
        "docs/reference",
        "docs/validation",
        "benchmarks",
    ];
    let entries = folders
        .iter()
        .flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap());
    let paths = entries.map(|entry| entry.unwrap().path());
    let is_document = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "md");
    let paths = paths.filter(is_document);
    paths
        .map(|path| (path.clone(), std::fs::read_to_string(path).unwrap()))
        .collect()
}

/// Each picture that a document shows exists, and each picture of the manual is shown.
#[test]
fn cli_the_pictures_of_the_manual_are_there_and_used() {
    let is_picture = |name: &str| [".svg", ".png"].iter().any(|ending| name.ends_with(ending));
    let mut shown = Vec::new();
    for (path, text) in documents() {
        // Addresses in Markdown and in HTML.
        let names = text
            .split(['(', ')', '"'])
            .filter(|name| is_picture(name) && !name.contains([' ', ':', '`']));
        shown.extend(names.map(|name| (path.clone(), name.to_owned())));
    }
    assert!(shown.len() > 10, "{shown:?}");
    let places: Vec<PathBuf> = shown
        .iter()
        .map(|(path, name)| {
            let place = path.parent().unwrap().join(name).canonicalize();
            place.unwrap_or_else(|error| panic!("{}: {name}: {error}", path.display()))
        })
        .collect();
    for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/figures")).unwrap() {
        let picture = entry.unwrap().path();
        let name = picture.to_string_lossy();
        assert!(
            !is_picture(&name) || places.contains(&picture.canonicalize().unwrap()),
            "{name} is not shown"
        );
    }
}

/// Every built-in case and study that a command of a document names exists.
#[test]
fn cli_the_cases_of_the_manual_are_built_in() {
    let listed = Folder::new().json("case --list");
    let known: Vec<&str> = listed
        .as_array()
        .unwrap()
        .iter()
        .map(|case| case["name"].as_str().unwrap())
        .collect();
    let commands = [
        "run",
        "certify",
        "modes",
        "cycle",
        "case",
        "sweep",
        "calibrate",
        "continue",
        "work-precision",
    ];
    let mut found = 0;
    for (path, text) in documents() {
        for (at, _) in text.match_indices("stickslip ") {
            let is_code = at == 0 || text[..at].ends_with(['`', '\n']) || text[..at].ends_with("$ ");
            let line = text[at..].split(['\n', '`']).next().unwrap_or_default();
            let mut words = line.split_whitespace().skip(1);
            let takes_case = words.next().is_some_and(|command| commands.contains(&command));
            let name = words.next().unwrap_or_default();
            let is_name = !name.is_empty()
                && name
                    .chars()
                    .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-');
            if is_code && takes_case && is_name && !name.starts_with('-') {
                assert!(known.contains(&name), "{}: there is no {name}", path.display());
                found += 1;
            }
        }
    }
    assert!(found > 10, "{found}");
}

#[test]
fn cli_the_comparison_of_printed_lines_sees_differences() {
    let printed = "title\nt = 0 to 10 s in 0.148 s of wall time\n\nonset  6.975001494 s\nall within 2.1e-12 s\nlast\n";
    let differs = |manual: &'static str| first_difference(&manual.lines().collect::<Vec<_>>(), printed);
    assert_eq!(
        differs("title\n...\nonset 6.975001494 s\nall within 1.9e-12 s\nlast"),
        None
    );
    assert_eq!(differs("title\nt = 0 to 10 s in 9 s of wall time\n..."), None);
    assert_eq!(differs("tit...\n..."), Some("tit..."));
    assert_eq!(differs("title\nt = 0 ...\n..."), None);
    assert_eq!(differs("...\nonset 6.975001493 s\n..."), Some("onset 6.975001493 s"));
    assert_eq!(differs("title\n..."), None);
    assert_eq!(differs("title"), Some("(the end)"));
    assert_eq!(differs("...\nall within 2.1e-10 s\n..."), Some("all within 2.1e-10 s"));
    assert_eq!(differs("...\nlast\ntitle"), Some("title"));
}
