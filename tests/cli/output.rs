//! Places of results, files that they may replace, and places that cannot be written.

use crate::common::cli::{Folder, SHORT, json, output, refusal, says};
use std::process::Stdio;
use stickslip::results::Status;

const FOREIGN: &str = "someone's thesis";

#[test]
fn cli_output_replaces_a_result_of_other_settings_by_force() {
    let folder = Folder::new();
    folder.ok_short("-q --set initial.speed=50");
    folder.refused_short(
        "-q --set initial.speed=60",
        "initial.speed = 50 rad/s there, 60 rad/s here",
    );
    folder.ok_short("-q --set initial.speed=60 --force");
    assert_eq!(folder.names(), ["paper.h5"]);
    assert_eq!(folder.result("paper.h5").column("theta_dot", 0..1).unwrap(), [60.0]);
}

#[test]
fn cli_output_replaces_a_foreign_file_only_by_force() {
    let folder = Folder::new();
    let path = folder.write("paper.h5", FOREIGN);
    folder.refused_short("", &["paper.h5: ", "--force"]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), FOREIGN);
    assert_eq!(folder.names(), ["paper.h5"]);
    folder.ok_short("--force");
    assert_eq!(folder.result("paper.h5").status(), &Status::Complete);
}

/// The same for the name that the file has while it is written.
#[test]
fn cli_output_spares_a_foreign_partial_file() {
    let folder = Folder::new();
    let path = folder.write("paper.partial.h5", FOREIGN);
    folder.refused_short("", &["paper.partial.h5"]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), FOREIGN);
}

#[test]
fn cli_output_is_never_the_input() {
    let folder = Folder::new();
    let text = folder.ok("case paper");
    let case = folder.write("brake.toml", &text);
    for arguments in [
        &["brake.toml", "-o", "brake.toml"][..],
        &["brake.toml", "-o", "./brake.toml", "--force"],
    ] {
        folder.refused_short(arguments, &["input"]);
    }
    assert_eq!(std::fs::read_to_string(&case).unwrap(), text);

    folder.ok_short("-q -o first.h5");
    let first = folder.read("first.h5");
    for arguments in [
        &["first.h5", "-o", "first.h5"][..],
        &["first.h5", "-o", "first.h5", "--force"],
    ] {
        folder.refused_short(arguments, &["input"]);
    }
    assert_eq!(folder.read("first.h5"), first);
}

#[test]
fn cli_output_needs_a_folder_and_a_name() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("results")).unwrap();
    for (output, words) in [
        ("missing/x.h5", "the folder missing does not exist"),
        ("results", "this is a folder"),
        ("new/", "this is a folder"),
        (".", "this is a folder"),
    ] {
        folder.refused_short(&["-o", output], &[words]);
    }
    assert_eq!(folder.names(), ["results"]);
    folder.ok_short("-q -o results/x.h5");
    assert!(folder.path("results/x.h5").is_file());
}

/// A result named like another format would be HDF5, which other programs would take for that format.
#[test]
fn cli_output_is_not_named_like_another_format() {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    for command in [
        "run paper",
        "certify run.h5",
        "sweep critical-curve",
        "continue",
        "calibrate",
        "work-precision",
        "cycle block",
    ] {
        for name in ["x.csv", "x.NPZ", "x.mat", "x.png"] {
            for force in ["", " --force"] {
                let said = folder.refused(&format!("{command} -o {name}{force}"), "-o x.h5 & stickslip export");
                assert!(said.contains(name), "{said}");
            }
        }
    }
    assert_eq!(folder.names(), ["run.h5"]);
    // A name without the extension of another format is accepted.
    for name in ["x", "x.nc", "x.2026"] {
        folder.ok_short(&["-q", "-o", name]);
        assert_eq!(&folder.read(name)[..4], b"\x89HDF");
    }
}

/// A name that makes the names of accompanying files too long is refused before anything is computed.
#[cfg(target_os = "linux")]
#[test]
fn cli_output_with_a_name_that_is_too_long_is_refused_at_once() {
    let folder = Folder::new();
    let named = |length: usize| format!("{}.h5", "a".repeat(length - 3));
    folder.ok_short("-q -o run.h5");
    for length in [242, 243, 244, 245, 250, 255, 300] {
        for command in [
            "run paper",
            "sweep critical-curve",
            "continue",
            "calibrate",
            "work-precision",
            "certify run.h5",
        ] {
            folder.refused(&format!("{command} -o {}", named(length)), "too long & -o");
        }
    }
    // The same for a folder that no longer exists.
    for command in [
        "sweep critical-curve",
        "continue",
        "calibrate",
        "work-precision",
        "cycle block",
    ] {
        folder.refused(
            &format!("{command} -o gone/x.h5"),
            "the folder gone does not exist & -o",
        );
    }
    assert_eq!(folder.names(), ["run.h5"]);
    folder.write("quick.toml", crate::sweep::QUICK);
    folder.ok(&format!("sweep quick.toml -q -o {}", named(241)));
    folder.ok_short(&["-q", "-o", &named(240)]);
}

/// Of two simultaneous runs into one file, the second is refused and the first is complete.
#[cfg(unix)]
#[test]
fn cli_output_of_two_runs_at_once() {
    let folder = Folder::new();
    let mut first = folder.start(&[&["run", "-o", "x.h5", "-q"], crate::common::cli::LONG].concat());
    folder.wait_for(&mut first, "x.partial.h5", 0);
    folder.refused_short("-o x.h5", &["another run is writing this file"]);
    first.kill().unwrap();
    first.wait().unwrap();
    // The lock of the killed run has been released.
    folder.ok_short("-q -o x.h5");
    assert_eq!(folder.names(), ["x.h5"]);
}

#[cfg(unix)]
#[test]
fn cli_output_replaces_no_pipe() {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    for (name, arguments) in [
        ("p.h5", &["run", "paper", "-o", "p.h5"][..]),
        ("p.csv", &["export", "run.h5", "-o", "p.csv"]),
        ("p.svg", &["plot", "run.h5", "-o", "p.svg", "--only", "rotor-speed"]),
        ("p.html", &["plot", "run.h5", "--html", "p.html"]),
    ] {
        folder.pipe(name);
        for force in [None, Some("--force")] {
            let said = refusal(folder.stickslip(arguments).args(force));
            says(&said, &[name, "a pipe or a device"]);
        }
        let kind = std::fs::metadata(folder.path(name)).unwrap().file_type();
        assert!(std::os::unix::fs::FileTypeExt::is_fifo(&kind), "{name}");
    }
}

/// A place below a file is a wrong place, for every command that writes.
#[cfg(unix)]
#[test]
fn cli_output_below_a_file_is_wrong_input() {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    for (arguments, remedy) in [
        ("run -o run.h5/x.h5", "-o"),
        ("plot run.h5 --channel z -o run.h5/x", "-o"),
        ("plot run.h5 --channel z -o run.h5/x.svg", "-o"),
        ("plot run.h5 --html run.h5/x.html", "--html"),
        ("export run.h5 -o run.h5/x.csv", "-o"),
        ("compare run.h5 run.h5 --quick --report run.h5/x.md", "--report"),
        ("modes --figure run.h5/x.svg", "--figure"),
        ("work-precision --figure run.h5/x", "--figure"),
        ("calibrate --case run.h5/x.toml", "--case"),
        ("case paper -o run.h5/x.toml", "-o"),
        ("man run.h5/x", "DIR"),
    ] {
        let said = folder.refused(
            arguments,
            "run.h5/x & the folder run.h5 does not exist & choose another with",
        );
        assert!(said.trim_end().ends_with(remedy), "{said}");
    }
}

/// A folder that exists but accepts no file.
#[cfg(target_os = "linux")]
#[test]
fn cli_output_that_cannot_be_created_names_a_remedy() {
    let folder = Folder::new();
    for arguments in [
        &["run", "paper", "-o", "/proc/x.h5"][..],
        &["certify", "paper", "-o", "/proc/x.h5"],
        &["sweep", "critical-curve", "-o", "/proc/x.h5"],
    ] {
        let (_, stderr) = folder.ends(arguments, 1);
        assert!(stderr.contains("no file can be created there"), "{stderr}");
        assert!(stderr.trim_end().ends_with("choose another folder with -o"), "{stderr}");
    }
}

/// A limit on file sizes, which stands for a full disk, gives an error, and the saved part is readable.
#[cfg(target_os = "linux")]
#[test]
fn cli_output_to_a_full_disk_is_an_error() {
    let folder = Folder::new();
    let program = env!("CARGO_BIN_EXE_stickslip");
    // The units are 1024 bytes, as in bash.
    for kilobytes in [64, 900] {
        let script = format!("ulimit -f {kilobytes}; trap '' XFSZ; exec {program} run --json");
        let (stdout, stderr) = output(
            assert_cmd::Command::new("bash")
                .args(["-c", &script])
                .current_dir(folder.path("."))
                .timeout(std::time::Duration::from_secs(300)),
            1,
        );
        says(&stderr, &["paper.partial.h5: ", "choose another folder"]);
        assert!(!folder.path("paper.h5").exists());
        if kilobytes == 64 {
            // The run has not begun, so that there is only the error.
            assert_eq!(json(&stdout)["error"]["exit_status"], 1);
        } else {
            assert_eq!(json(&stdout)["status"], "failed");
            assert_eq!(folder.result("paper.partial.h5").status(), &Status::Interrupted);
        }
    }
    // When there is space again, the failed run is replaced.
    folder.ok("run -q");
    assert_eq!(folder.names(), ["paper.h5"]);
}

/// A reader that closes the pipe, as `| head` does, is no error and loses no result.
#[test]
fn cli_output_without_a_reader() {
    let folder = Folder::new();
    folder.ok_short("-q -o x.h5");
    // Without the kick, which such a short run would not reach, and would warn about.
    let short = |name| ["run", "-o", name, SHORT[0], SHORT[1], "--set", "perturbation=[]"];
    for arguments in [
        &["case", "paper"][..],
        &["inspect", "x.h5"],
        &short("y.h5"),
        &[&short("z.h5")[..], &["--json"]].concat(),
    ] {
        let mut child = folder.start(arguments);
        drop(child.stdout.take());
        let end = child.wait_with_output().unwrap();
        assert_eq!(end.status.code(), Some(0), "{arguments:?}");
        assert_eq!(crate::common::cli::text(&end.stderr), "", "{arguments:?}");
    }
    assert_eq!(folder.result("y.h5").status(), &Status::Complete);
    assert_eq!(folder.result("z.h5").status(), &Status::Complete);
}

/// A standard output that cannot be written is an error, although the result exists.
#[cfg(target_os = "linux")]
#[test]
fn cli_output_to_a_full_device() {
    let folder = Folder::new();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let end = std::process::Command::new(env!("CARGO_BIN_EXE_stickslip"))
        .current_dir(folder.path("."))
        .args(["run"])
        .args(SHORT)
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(end.status.code(), Some(1));
    assert!(crate::common::cli::text(&end.stderr).contains("standard output"));
    assert_eq!(folder.result("paper.h5").status(), &Status::Complete);
}

/// Tables in a terminal that does not know its width, or that has no room for a word.
#[cfg(target_os = "linux")]
#[test]
fn cli_output_in_a_terminal_without_columns_is_in_lines() {
    let folder = Folder::new();
    let program = env!("CARGO_BIN_EXE_stickslip");
    for columns in [0, 1, 3, 20] {
        let line = format!("stty cols {columns} rows 24; exec {program} case --list");
        let script = std::process::Command::new("script")
            .args(["-qec", &line, "/dev/null"])
            .current_dir(folder.path("."))
            .output()
            .unwrap();
        let stdout = String::from_utf8(script.stdout).unwrap();
        assert!(
            stdout.contains("Mass on a belt, Coulomb friction"),
            "{columns}: {stdout}"
        );
    }
}
