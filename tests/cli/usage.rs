//! What the program says about itself, its cases and its files, and about wrong usage.

use crate::common::cli::{Folder, says};
use crate::common::json::*;
use crate::common::rows;
use predicates::prelude::*;

#[test]
fn cli_version_names_the_libraries() {
    let folder = Folder::new();
    for flag in ["--version", "-V"] {
        let stdout = folder.clean(&[flag]);
        // The commit of the build, which the build script provides for this package only.
        let (version, commit) = (env!("CARGO_PKG_VERSION"), env!("STICKSLIP_COMMIT"));
        assert!(
            stdout.starts_with(&format!("stickslip {version} ({commit})\n")),
            "{stdout}"
        );
        let libraries = predicate::str::is_match(r"\nSUNDIALS 7\.\d+\.\d+\nHDF5 \d+\.\d+\.\d+\n$").unwrap();
        assert!(libraries.eval(&stdout), "{stdout}");
    }
}

#[test]
fn cli_help_is_on_standard_output() {
    let folder = Folder::new();
    for arguments in "--help, run --help, work-precision -h, plot -h, modes -h, inspect -h, case -h".split(", ") {
        let stdout = folder.clean(arguments);
        assert!(stdout.contains("Usage: stickslip"), "{stdout}");
        let wide: Vec<&str> = stdout.lines().filter(|line| line.chars().count() > 80).collect();
        assert_eq!(wide, Vec::<&str>::new(), "{arguments:?}");
    }
}

#[test]
fn cli_wrong_usage_is_status_2_and_says_so_on_standard_error() {
    let folder = Folder::new();
    for arguments in [
        "",
        "integrate",
        "run paper paper-si",
        "run --set",
        "run --tolerance 1",
        "plot",
        "plot paper.h5 --html page.html --width 85",
        "plot a.h5 b.h5 --html page.html",
        "plot a.h5 b.h5 c.h5 --html page.html",
        "inspect",
        "case",
        "case paper --list",
    ] {
        let stderr = folder.refused(arguments, "");
        let helps = stderr.contains("stickslip") || stderr.contains("--help");
        assert!(helps, "{arguments}: {stderr}");
    }
}

/// The printed text is a case file that runs like the built-in case.
#[test]
fn cli_case_prints_a_case_to_start_from() {
    let folder = Folder::new();
    let text = folder.clean("case paper");
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
        let starts = |line: &str| line.trim_start().starts_with(name);
        assert!(stdout.lines().any(starts), "{stdout}");
        says(&stdout, listed.with("name", name)["title"].text());
    }
}

#[test]
fn cli_unknown_case_names_those_that_exist() {
    let folder = Folder::new();
    for command in ["case papper", "run papper"] {
        folder.refused(command, "\"papper\" & did you mean paper? & unperturbed");
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
    let title = "摩擦 Bremse μ₀ 🛑";
    let own = "Two-disk brake, the paper's parameters in US units";
    folder.write("摩擦.toml", folder.ok("case paper").replace(own, title));
    let stdout = folder.ok_short("摩擦.toml");
    says(&stdout, &[title, "摩擦.h5"]);
    assert_eq!(folder.result("摩擦.h5").title(), title);
}

#[test]
fn cli_inspect_shows_every_variable_with_unit_and_meaning() {
    let folder = Folder::new();
    folder.ok_short("-q -o x.h5");
    let stdout = folder.clean("inspect x.h5 -v");
    says(
        &stdout,
        "stickslip-result & complete & natural_period & relative velocity omega_r & rad s-1 & 2 slip-forward &
         1e-10",
    );
    assert!(stdout.lines().all(|line| line == line.trim_end()), "{stdout:?}");
    let document = folder.json("inspect x.h5");
    let variables = document["variables"].list();
    let is_time = |one: &&serde_json::Value| one["group"] == "/trajectory" && one["name"] == "time";
    let time = variables.iter().find(is_time).unwrap();
    assert_eq!(time["units"], "s");
    assert_eq!(time["shape"], serde_json::json!([51]));
    assert_eq!(time["max"], 0.05);
    assert_eq!(document["attributes"].with("name", "status")["value"], "complete");
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

/// The value's own error, whatever sign or size it has, and where to look it up.
#[test]
fn cli_numbers_of_options_have_their_own_errors() {
    let folder = Folder::new();
    for (arguments, words) in [
        (
            "run --rtol 1e400",
            "solver.rtol: \"1e400\" is too large for double precision",
        ),
        ("run --rtol -1e-8", "solver.rtol: must be & but is -1e-8"),
        ("run --end-time 1e400", "output.end_time: \"1e400\" is too large"),
        ("run --end-time -1e-3", "output.end_time: must be greater than 0"),
        ("run --interval -1ms", "output.interval: must be greater than 0"),
        ("run --max-wall-time -1", "solver.max_wall_time: must be greater than 0"),
        (
            "sweep critical-curve -j -1",
            "from 1 to 4096 & `stickslip sweep --help`",
        ),
        (
            "certify --digits -1",
            "give a whole number, 0 or more & `stickslip certify --help`",
        ),
        (
            "compare a.h5 b.h5 --hysteresis 1e400",
            "\"1e400\" is too large & `stickslip compare --help`",
        ),
        (
            "cycle block --period -1e-3",
            "greater than 0 & `stickslip cycle --help`",
        ),
        (
            "cycle block --periods -1",
            "-1 is not in 1..= & `stickslip cycle --help`",
        ),
        ("cycle b.h5 --branch -1 --point 0", "give a whole number, 0 or more"),
        ("export a.h5 --rate -1e3", "greater than 0 & `stickslip export --help`"),
        ("export a.h5 --window 1e400:2", "\"1e400\" is too large"),
        (
            "plot a.h5 --dpi -1",
            "give a number from 30 to 2400 & `stickslip plot --help`",
        ),
        ("plot a.h5 --width -1", "from 60 to 1000 mm"),
        ("plot a.h5 --font-size -1", "from 4 to 24"),
        ("plot a.h5 --channel z --to 1e400", "\"1e400\" is too large"),
        (
            "run --set friction.decay=-1",
            "`stickslip case --keys friction.decay` says more",
        ),
        (
            "run --set output.window.0.from=-1 --set output.window.0.to=1",
            "`stickslip case --keys output.window[].from` says more",
        ),
        (
            "run belt-leine --set rotor.speed.profile=x",
            "`stickslip case --keys rotor.speed` says more",
        ),
        (
            "run --set axial.mass=-1 --set torsion.stiffness=0",
            "`stickslip case --keys KEY` says more",
        ),
    ] {
        let said = folder.refused(arguments, words);
        assert!(
            !said.contains("`stickslip --help`") && !said.contains("no such option"),
            "{said}"
        );
    }
    // What an error names is there.
    says(&folder.ok("case --keys output.window[].from"), "start of a stretch");
    folder.write(
        "large.toml",
        folder.ok("case paper").replace("decay = \"5 s/rad\"", "decay = 1e400"),
    );
    folder.refused("run large.toml", "large.toml: & overflowed");
}

/// The options for single keys give what `--set` gives: the same case, the same errors.
#[test]
fn cli_options_for_keys_are_those_of_set() {
    let folder = Folder::new();
    folder.ok("run -q --rtol 1e-9 --end-time '50 ms' --interval 1e-3 -o short.h5");
    folder.ok("run -q --set solver.rtol=1e-9 --set 'output.end_time=50 ms' --set output.interval=1e-3 -o long.h5");
    let [short, long] = ["short.h5", "long.h5"].map(|name| folder.result(name).resolved().unwrap());
    assert_eq!(short, long);
    assert!(short.contains("end_time = 0.05"), "{short}");
    for (option, key, value) in [
        ("--rtol", "solver.rtol", "-1"),
        ("--end-time", "output.end_time", "2 kg"),
        ("--interval", "output.interval", "0"),
    ] {
        for command in ["run", "certify", "modes", "cycle", "calibrate", "continue"] {
            let more = if command == "cycle" { " belt-leine" } else { "" };
            let short = folder.refused(&format!("{command}{more} {option} '{value}'"), key);
            assert_eq!(
                short,
                folder.refused(&format!("{command}{more} --set '{key}={value}'"), "")
            );
        }
    }
    folder.refused(
        "certify short.h5 --rtol 1e-12",
        "--set changes a case, not a result file",
    );
    folder.refused("run --end-time 0,05", "--set output.end_time & write 0.05 with a point");
}

#[test]
fn cli_unknown_options_name_what_was_meant() {
    let folder = Folder::new();
    for [arguments, words] in rows(
        r#"
        run --decay 4 | --decay: no such option; --set friction.decay=... changes that key
        sweep critical-curve --decay 4 | --set friction.decay=... changes that key
        run --normal-force 4 | --set contact.normal_force=... changes that key
        run --methd cvode | --methd: no such option; did you mean --method?
        run --end_time 20 | --end_time: no such option; did you mean --end-time?
        run belt-leine --set stator.mass=2 | did you mean stator.inertia?
        inspect x.h5 --decay 4 | --decay: stickslip inspect has no such option & `stickslip inspect --help`
        case paper --rtol 1 | --rtol: stickslip case has no such option
        plot a.h5 --widht 85 | did you mean --width?
        run paper block | "block": stickslip run takes no further argument
        export a.h5 -o x.csv --format parquet | pandas
    "#,
    ) {
        let said = folder.refused(arguments, words);
        assert!(said.starts_with("stickslip: "), "{said}");
        for noise in ["as a value", "-- --", "error:"] {
            assert!(!said.contains(noise), "{said}");
        }
    }
}

#[test]
fn cli_unknown_commands_name_what_was_meant() {
    let folder = Folder::new();
    folder.write("mine.toml", folder.ok("case clutch"));
    folder.write("map.toml", folder.ok("case critical-curve"));
    folder.refuses(
        r#"
        rnu           | there is no command "rnu"; did you mean run?
        help rum      | did you mean run?
        papre         | did you mean stickslip run paper?
        paper         | "paper" is a built-in case, not a command: stickslip run paper
        mine.toml     | is a case, not a command: stickslip run mine.toml
        map.toml      | is a study, not a command: stickslip sweep map.toml
        belt-branches | stickslip continue belt-branches
        integrate     | the commands are run, certify, compare
    "#,
    );
}

/// One sentence with the command, not the unknown keys of a study that is read as a case.
#[test]
fn cli_a_study_is_no_case_and_a_case_no_study() {
    let folder = Folder::new();
    folder.write("mine.toml", folder.ok("case clutch"));
    for (study, command) in [
        ("critical-curve", "sweep"),
        ("paper-decay", "calibrate"),
        ("belt-branches", "continue"),
        ("work-precision", "work-precision"),
    ] {
        let file = &*format!("{study}.toml");
        folder.write(file, folder.ok(&format!("case {study}")));
        for wrong in ["run", "certify", "modes", "cycle"] {
            for (name, what) in [(study, "a built-in study"), (file, "a study")] {
                let words = format!("stickslip: {name} is {what}: stickslip {command} {name}\n");
                assert_eq!(folder.refused(&[wrong, name], ""), words);
            }
        }
        for wrong in ["sweep", "calibrate", "continue", "work-precision"] {
            // The axes of a continuation may be those of a sweep whose points were forgotten.
            if wrong == command || (wrong, command) == ("sweep", "continue") {
                continue;
            }
            let words = format!("{file} is a study for another command: stickslip {command} {file}");
            folder.refused(&[wrong, file], &[words]);
            folder.refused(&[wrong, "mine.toml"], "mine.toml is a case: stickslip run mine.toml");
            folder.refused(&[wrong, "paper"], "paper is a built-in case: stickslip run paper");
        }
    }
}

#[test]
fn cli_a_result_that_was_not_computed_names_its_command() {
    let folder = Folder::new();
    folder.write("mine.toml", folder.ok("case clutch"));
    folder.write("map.toml", folder.ok("case critical-curve"));
    folder.refuses(
        "
        plot map.h5 | map.h5: no such file; `stickslip sweep map.toml` writes it
        inspect paper.h5 | paper.h5: no such file; `stickslip run paper` writes it
        export mine.certified.h5 -o x.csv | `stickslip certify mine.toml` writes it
        check belt-leine.cycle.h5 | `stickslip cycle belt-leine` writes it
        compare out/paper.h5 x.csv | `stickslip run paper -o out/paper.h5` writes it
        certify clutch.h5 | `stickslip run clutch` writes it
        plot map.toml | map.toml: a study, not a result; `stickslip sweep map.toml` writes map.h5
        plot paper | paper: a built-in case, not a result; `stickslip run paper` writes paper.h5
        plot other.h5 | other.h5: no such file; check the name
    ",
    );
}

#[test]
fn cli_compare_says_that_its_arguments_are_swapped() {
    let folder = Folder::new();
    folder.ok_short("-q");
    folder.ok("export paper.h5 -o mine.csv");
    let words = "the reference comes first: stickslip compare paper.h5 mine.csv";
    folder.refused("compare mine.csv paper.h5", words);
}

#[test]
fn cli_a_decimal_comma_is_named() {
    let folder = Folder::new();
    folder.refuses(
        "
        run --set 'initial.speed=0,2 rad/s'               | write 0.2 rad/s with a point
        run --set friction.breakaway=0,6                  | write 0.6 with a point
        run --set 'axial.mass=1,000 kg'                   | write 1.000 kg with a point, or 1000 kg without a comma
        export paper.h5 -o x.csv --window '6,97 s:6.98 s' | write 6.97 s with a point
    ",
    );
}

#[test]
fn cli_an_unknown_method_is_answered_without_the_whole_list() {
    let folder = Folder::new();
    let said = folder.refused("run --method rk44", "there is no \"rk44\"; did you mean \"rk4\"?");
    assert!(!said.contains("erk-"), "{said}");
    let said = folder.refused("run --method foo", "\"cvode\" & \"series\" & \"rk4\" and");
    assert!(said.len() < 250, "{said}");
    says(&said, "(`stickslip case --keys solver.method` lists them)");
}

#[test]
fn cli_case_names_studies_too() {
    let said = Folder::new().refused("case nope", "the cases are paper, & the studies are critical-curve,");
    assert!(!said.contains("path"), "{said}");
    Folder::new().refused("case critical-curv", "did you mean critical-curve?");
}

/// Every line of the examples is one that the program accepts; the short help has no rare options.
#[test]
fn cli_help_has_examples_that_parse() {
    use clap::Parser;
    let folder = Folder::new();
    let help = folder.ok("--help");
    says(&help, "Manual: docs/");
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands = commands.take_while(|line| !line.is_empty());
    let mut commands: Vec<&str> = commands.filter_map(|line| line.split_whitespace().next()).collect();
    commands.retain(|name| *name != "help");
    assert!(commands.len() >= 17, "{commands:?}");
    for command in commands {
        let (short, long) = (folder.ok(&[command, "-h"]), folder.ok(&[command, "--help"]));
        for (option, shown) in [("--follow-external", false), ("--progress", false), ("--json", true)] {
            assert_eq!(short.contains(option), shown, "{command}: {option}");
            assert!(long.contains(option), "{command}: {option}");
        }
        assert!(!long.contains("erk-"), "{command}");
        let examples = short.lines().skip_while(|line| *line != "Examples:").skip(1);
        let lines: Vec<&str> = examples.filter(|line| line.starts_with("  stickslip ")).collect();
        assert!(!lines.is_empty() && lines.len() <= 4, "{command}: {lines:?}");
        for line in lines {
            assert!(line.chars().count() <= 80, "{line}");
            let line = line.trim().split("  ").next().unwrap();
            let words = line.split_whitespace().take_while(|word| *word != ">");
            let parsed = stickslip::cli::Arguments::try_parse_from(words);
            assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
        }
    }
}

/// What the program prints in a terminal.
#[cfg(target_os = "linux")]
fn in_terminal(folder: &Folder, line: &str, no_color: bool) -> String {
    let line = format!("stty cols 100 rows 24; exec {} {line}", env!("CARGO_BIN_EXE_stickslip"));
    let mut script = std::process::Command::new("script");
    script.args(["-qec", &line, "/dev/null"]).current_dir(folder.path("."));
    script.env_remove("NO_COLOR").env("TERM", "xterm");
    if no_color {
        script.env("NO_COLOR", "1");
    }
    String::from_utf8(script.output().unwrap().stdout).unwrap()
}

/// Errors of the arguments and of the commands begin alike, with a colour on a terminal only.
#[cfg(target_os = "linux")]
#[test]
fn cli_errors_have_one_voice() {
    let folder = Folder::new();
    for wrong in [
        "run nope",
        "run --nope",
        "nope",
        "run --method",
        "run --set solver.rtol=-1",
    ] {
        let said = folder.refused(wrong, "");
        assert!(said.starts_with("stickslip: ") && !said.contains('\u{1b}'), "{said}");
        let coloured = in_terminal(&folder, wrong, false);
        assert!(
            coloured.starts_with("\u{1b}[31m\u{1b}[1mstickslip:\u{1b}[0m "),
            "{coloured:?}"
        );
        let plain = in_terminal(&folder, wrong, true);
        assert!(
            plain.starts_with("stickslip: ") && !plain.contains('\u{1b}'),
            "{plain:?}"
        );
    }
    let warned = in_terminal(&folder, "run unperturbed", false);
    says(&warned, "stickslip: \u{1b}[33m\u{1b}[1mwarning:\u{1b}[0m");
}

/// A run of a fraction of a second draws no bar on a terminal.
#[cfg(target_os = "linux")]
#[test]
fn cli_progress_does_not_flash() {
    let folder = Folder::new();
    folder.write("quick.toml", crate::sweep::QUICK);
    let said = in_terminal(&folder, "sweep quick.toml --progress always", false);
    assert!(said.contains(" of ") && !said.contains(" of 0 "), "{said:?}");
    // A machine under load may need more than that for the first ones.
    for _ in 0..20 {
        let start = std::time::Instant::now();
        let said = in_terminal(&folder, "run --end-time 0.01 --interval 1e-3 --no-witness", false);
        if start.elapsed() < std::time::Duration::from_millis(500) {
            assert!(
                said.contains("Two-disk brake") && !said.contains(" of 0.01 s"),
                "{said:?}"
            );
            return;
        }
    }
    panic!("no run of less than half a second");
}

/// A file of another origin at the place of a manual page stays, and no page is written.
#[test]
fn cli_man_replaces_its_own_pages_only() {
    let folder = Folder::new();
    folder.ok("man pages -q");
    folder.ok("man pages -q");
    std::fs::create_dir(folder.path("other")).unwrap();
    folder.write("other/stickslip-run.1", "mine");
    let (_, stderr) = folder.ends("man other", 2);
    assert!(stderr.contains("other/stickslip-run.1: there already"), "{stderr}");
    assert_eq!(folder.read("other/stickslip-run.1"), b"mine");
    assert!(!folder.path("other/stickslip.1").exists());
}
