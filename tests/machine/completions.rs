//! What shells propose, and the manual pages: each script in the shell that it is for, and the pages in man and mandoc.
//! Where one of them is not installed its test reports itself as ignored; with STICKSLIP_IGNORE_NONE set, as failed.

use std::path::Path;
use std::process::Command;

use crate::common::cli::Folder;
use crate::common::results::missing;
use libtest_mimic::{Completion, Failed, Trial};

pub fn tests() -> Vec<Trial> {
    vec![
        Trial::test("cli_completions_are_known_of_three_shells", known_shells),
        Trial::test("cli_man_writes_a_page_for_each_command", pages),
        Trial::ignorable_test("cli_bash_completes", in_bash),
        Trial::ignorable_test("cli_fish_completes", in_fish),
        Trial::ignorable_test("cli_zsh_completes", in_zsh),
        Trial::ignorable_test("cli_man_renders_the_pages", in_man),
        Trial::ignorable_test("cli_mandoc_finds_no_fault_in_the_pages", in_mandoc),
    ]
}

/// A folder with two files and a script of the shell.
fn folder_with_script(shell: &str) -> Folder {
    let folder = Folder::new();
    let script = folder.ok(&["completions", shell]);
    folder.write("script", script);
    folder.write("mine.toml", "");
    folder.write("mine.h5", "");
    folder.write("notes.txt", "");
    folder
}

/// What a program prints, with `stickslip` on its path; `None` where it is not installed.
fn printed(folder: &Folder, program: &str, arguments: &[&str]) -> Option<String> {
    let here = Path::new(env!("CARGO_BIN_EXE_stickslip")).parent().unwrap();
    let mut path = vec![here.to_owned()];
    path.extend(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()));
    let output = Command::new(program)
        .args(arguments)
        .current_dir(folder.path("."))
        .env("PATH", std::env::join_paths(path).unwrap())
        .env("HOME", folder.path("."))
        .env("LC_ALL", "C")
        .output()
        .ok()?;
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {arguments:?}: {error}");
    assert!(error.is_empty(), "{program} {arguments:?}: {error}");
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The last word of each line is being typed: some of what it can become, and some of what it cannot.
const EXPECTED: &[(&str, &[&str], &[&str])] = &[
    ("stickslip wor", &["work-precision"], &["run"]),
    ("stickslip run pap", &["paper", "paper-si"], &["release", "mine.toml"]),
    ("stickslip run mi", &["mine.toml", "mine.h5"], &["notes.txt"]),
    ("stickslip run --method ser", &["series"], &["erk"]),
    ("stickslip run --no-w", &["--no-witness"], &["--force"]),
    (
        "stickslip run --set torsion.dam",
        &["torsion.damping="],
        &["torsion.stiffness="],
    ),
    ("stickslip run --set stator.en", &["stator.end="], &[]),
    ("stickslip run --progress a", &["always", "auto"], &["never"]),
    ("stickslip sweep ", &["critical-curve"], &["paper", "mine.h5"]),
    (
        "stickslip plot --only stick-slip-t",
        &["stick-slip-transition"],
        &["friction-law"],
    ),
    ("stickslip plot --format p", &["pdf", "png"], &["svg"]),
    ("stickslip plot --channel relative", &["relative_velocity"], &["phi1"]),
    ("stickslip inspect ", &["mine.h5"], &["mine.toml", "paper"]),
    ("stickslip completions ", &["bash", "fish", "zsh"], &[]),
];

/// Holds what a shell proposes against [`EXPECTED`].
fn check(proposed: impl Fn(&str) -> Option<Vec<String>>) -> Result<Completion, Failed> {
    for &(line, some, none) in EXPECTED {
        let Some(words) = proposed(line) else {
            return missing("this shell is not installed");
        };
        let has = |word: &str| words.iter().any(|one| one == word);
        assert!(some.iter().all(|word| has(word)), "{line:?}: {words:?}");
        assert!(!none.iter().any(|word| has(word)), "{line:?}: {words:?}");
    }
    Ok(Completion::Completed)
}

/// By the function that the script has registered, as bash calls it.
fn in_bash() -> Result<Completion, Failed> {
    let folder = folder_with_script("bash");
    check(|line| {
        let drive = r#"
            source ./script
            read -ra COMP_WORDS <<<"$1"
            if [[ $1 == *' ' ]]; then COMP_WORDS+=(''); fi
            COMP_CWORD=$((${#COMP_WORDS[@]} - 1)) COMP_LINE=$1 COMP_POINT=${#1} COMP_TYPE=9
            registered=$(complete -p stickslip)
            function=${registered##*-F }
            "${function%% *}" stickslip "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD-1]}"
            printf '%s\n' "${COMPREPLY[@]}"
        "#;
        let text = printed(&folder, "bash", &["--norc", "-c", drive, "bash", line])?;
        Some(text.lines().map(str::to_owned).collect())
    })
}

/// By fish's own `complete --do-complete`.
fn in_fish() -> Result<Completion, Failed> {
    let folder = folder_with_script("fish");
    check(|line| {
        let drive = "source ./script; complete --do-complete $argv[1]";
        let text = printed(&folder, "fish", &["--no-config", "-c", drive, line])?;
        let words = text.lines().filter_map(|line| line.split('\t').next());
        Some(words.map(str::to_owned).collect())
    })
}

/// By the function that the script has registered; what it gives to `_describe`, which wants an editor, is printed.
fn in_zsh() -> Result<Completion, Failed> {
    let folder = folder_with_script("zsh");
    check(|line| {
        let drive = r#"
            function compdef { registered=$1 }
            function _describe { print -l -- ${${(P)argv[3]}%%:*} }
            source ./script
            words=(${(s: :)1})
            if [[ $1 == *' ' ]]; then words+=(''); fi
            CURRENT=$#words
            $registered
        "#;
        let text = printed(&folder, "zsh", &["--no-rcs", "-c", drive, "zsh", line])?;
        Some(text.lines().map(str::to_owned).collect())
    })
}

fn known_shells() -> Result<(), Failed> {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell", "nushell"] {
        let script = folder.ok(&["completions", shell]);
        // Nushell asks no program: its script has every command and option.
        let word = if shell == "nushell" {
            "export extern \"stickslip work-precision\""
        } else {
            "STICKSLIP_COMPLETE"
        };
        assert!(script.contains(word), "{script}");
        assert!(!script.contains("target/"), "{script}");
        assert_eq!(folder.json(&["completions", shell])["script"], script.as_str());
    }
    folder.refused("completions tcsh", &["bash, zsh, fish, powershell, nushell"]);
    Ok(())
}

/// The commands that the help lists.
fn commands(folder: &Folder) -> Vec<String> {
    let help = folder.ok("--help");
    let lines = help.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
    let names = lines.take_while(|line| !line.is_empty());
    let kept = names.filter_map(|line| line.split_whitespace().next());
    kept.filter(|name| *name != "help").map(str::to_owned).collect()
}

fn pages() -> Result<(), Failed> {
    let folder = Folder::new();
    let stdout = folder.ok("man share/man/man1");
    let commands = commands(&folder);
    assert!(commands.len() >= 15, "{commands:?}");
    let mut expected: Vec<String> = commands.iter().map(|name| format!("stickslip-{name}.1")).collect();
    expected.push("stickslip.1".to_owned());
    expected.sort();
    let mut written: Vec<String> = std::fs::read_dir(folder.path("share/man/man1"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    written.sort();
    assert_eq!(written, expected);
    assert!(expected.iter().all(|name| stdout.contains(name)), "{stdout}");
    // Again, over them.
    folder.ok("man share/man/man1 -q");
    // A page that cannot be written is named.
    std::fs::create_dir_all(folder.path("half/stickslip-run.1")).unwrap();
    let (_, stderr) = folder.ends("man half", 1);
    assert!(
        stderr.contains("half/stickslip-run.1: writing the manual pages failed"),
        "{stderr}"
    );
    // A folder that cannot be made, as there is a file of its name.
    folder.write("taken", "");
    let (_, stderr) = folder.ends("man taken", 1);
    assert!(stderr.contains("taken: writing the manual pages failed"), "{stderr}");
    Ok(())
}

/// Every option of every command's help is in its page, as man shows it.
fn in_man() -> Result<Completion, Failed> {
    let folder = Folder::new();
    folder.ok("man .");
    for command in commands(&folder) {
        let page = format!("./stickslip-{command}.1");
        let Some(text) = printed(&folder, "man", &["--warnings=w", "--local-file", &page]) else {
            return missing("man is not installed");
        };
        let help = folder.ok(&[&command, "--help"]);
        for heading in ["SYNOPSIS", "EXAMPLES", "EXIT STATUS", "SEE ALSO"] {
            assert!(text.contains(heading), "{command}: {heading}\n{text}");
        }
        if command == "run" {
            for words in [
                "[-o|--output FILE]",
                "Follow links from",
                "CASE.partial.h5",
                "Interrupted by Ctrl-C",
            ] {
                assert!(text.contains(words), "{words}\n{text}");
            }
        }
        for option in help
            .split_whitespace()
            .filter(|word| word.starts_with("--") && word.len() > 2)
        {
            let name = option.trim_end_matches(|c: char| !c.is_ascii_alphanumeric());
            assert!(text.contains(name), "{command}: {name}\n{text}");
        }
    }
    Ok(Completion::Completed)
}

fn in_mandoc() -> Result<Completion, Failed> {
    let folder = Folder::new();
    folder.ok("man .");
    let mut names: Vec<String> = folder.names();
    names.retain(|name| name.ends_with(".1"));
    assert!(!names.is_empty());
    let mut arguments = vec!["-T", "lint", "-W", "error"];
    arguments.extend(names.iter().map(String::as_str));
    match printed(&folder, "mandoc", &arguments) {
        Some(text) => assert_eq!(text, ""),
        None => return missing("mandoc is not installed"),
    }
    Ok(Completion::Completed)
}
