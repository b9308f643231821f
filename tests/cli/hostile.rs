//! Hostile and broken input, and failing systems: each gives a clear error, whatever the command.

use crate::common::cli::{Folder, json, output, refusal, says};
use crate::common::json::*;
use crate::common::unlocked;
use stickslip::results::Status;

/// The message of a run that fails, which contains its time and its mode.
fn failure(folder: &Folder, arguments: &[&str]) -> String {
    let mut command = folder.stickslip("run -q -o x.h5");
    let (_, stderr) = output(command.args(arguments), 1);
    says(&stderr, &["at t = ", "in mode "]);
    assert!(matches!(folder.result("x.partial.h5").status(), Status::Failed(_)));
    stderr
}

#[test]
fn cli_a_run_that_makes_no_progress_ends_by_itself() {
    let folder = Folder::new();
    for arguments in [
        &["--method", "series", "--set", "friction.decay=1e12"][..],
        &["paper-si", "--method", "erk", "--set", "torsion.damping=1e8"],
        &["paper-si", "--method", "series", "--set", "torsion.damping=1e7"],
    ] {
        let said = failure(&folder, arguments);
        assert!(said.contains("stands still") || said.contains("no progress"), "{said}");
        assert!(said.contains("solver.method"), "{said}");
        // A failed run does not fill the disk.
        let size = std::fs::metadata(folder.path("x.partial.h5")).unwrap().len();
        assert!(size < 4_000_000, "{size}");
    }
}

/// A contact that rings 7e8 times a second, and may open each time, is not searched to the end of the run at once.
#[test]
fn cli_the_search_for_a_change_of_contact_keeps_to_the_budget() {
    let folder = Folder::new();
    let ringing = ["axial.stiffness=1e20", "axial.damping=1e-3", "actuation.rise_time=0"];
    let ringing = ringing.map(|setting| ["--set", setting]).concat();
    for more in [
        &[][..],
        &["--max-wall-time", "0.2"],
        &["--method", "series", "--max-wall-time", "0.2"],
    ] {
        failure(&folder, &[&ringing[..], more].concat());
    }
}

#[test]
fn cli_budgets_of_steps_and_time_end_a_run() {
    let folder = Folder::new();
    for method in ["arkode", "series", "paper"] {
        let said = failure(&folder, &["--method", method, "--set", "solver.max_steps=20"]);
        says(&said, &["budget of 20 steps", "solver.max_steps"]);
        let slow = [
            "--method",
            method,
            "--set",
            "solver.max_step=1e-6",
            "--max-wall-time",
            "20 ms",
        ];
        let said = failure(&folder, &slow);
        says(&said, &["0.02 s of wall time", "--max-wall-time"]);
    }
    // The budget also holds over samples that take long. Doubles of this size leave few values between two samples.
    let mut fast = folder.stickslip("run -q -o f.h5 --set initial.speed=9e18");
    let (_, said) = output(fast.args(["--max-wall-time", "20 ms"]), 1);
    assert!(said.contains("0.02 s of wall time"), "{said}");
    folder.refused("run --max-wall-time soon", &["solver.max_wall_time"]);
}

#[test]
fn cli_a_stuck_point_of_a_sweep_is_a_failed_point() {
    let folder = Folder::new();
    let study = "case = \"paper\"\n[set]\nsolver.method = \"series\"\nsolver.max_step = 1e-6\noutput.end_time = 2\n[[axis]]\nkey = \"initial.speed\"\n\
                 values = [0, 100]\n";
    folder.write("s.toml", study);
    let arguments = ["sweep", "s.toml", "--json", "--max-wall-time", "3", "-j", "1"];
    let stdout = folder.ok(&arguments);
    let document = json(&stdout);
    let found = (&document["points"], &document["failed"]);
    assert_eq!(found, (&2.into(), &1.into()), "{document}");
    let message = document["failures"][0]["message"].text();
    says(message, &["wall time", "in mode"]);
}

#[test]
fn cli_a_value_that_is_not_finite_fails_the_run() {
    let folder = Folder::new();
    for arguments in [
        &["--method", "series", "--set", "initial.speed=1e200"][..],
        &["--method", "paper", "--set", "initial.speed=1e200"],
        &["--set", "initial.speed=1e200"],
        &["--set", "torsion.rotor_inertia=5e-324"],
        &["--set", "torsion.rotor_inertia=1e308"],
    ] {
        failure(&folder, arguments);
    }
}

fn with_times(folder: &Folder, name: &str, time: impl Fn(usize) -> f64) {
    std::fs::copy(folder.path("good.h5"), folder.path(name)).unwrap();
    let file = unlocked::open_rw(folder.path(name)).unwrap();
    let times = file.dataset("trajectory/time").unwrap();
    let changed: Vec<f64> = (0..times.size()).map(time).collect();
    times.write(&changed).unwrap();
}

/// Nine in ten intervals are equal and so short that the rows between the others cannot be counted.
#[test]
fn cli_a_candidate_with_countless_rows_in_a_gap_is_compared() {
    use std::fmt::Write;
    let folder = Folder::new();
    folder.ok("run belt-exponential -q -o belt.h5");
    let mut csv = "time [s],phi1 [m],phi1_dot [m s-1],relative_velocity [m s-1]\n".to_owned();
    let short = (1..=1000).map(|row| f64::from(row) * 1e-20);
    for time in short.chain((1..=90).map(|row| f64::from(row) * 0.01)) {
        writeln!(csv, "{time:e},0.008,0.309,0.014").unwrap();
    }
    std::fs::write(folder.path("countless.csv"), csv).unwrap();
    let mut command = folder.stickslip("compare belt.h5 countless.csv");
    let status = command.output().unwrap().status;
    assert!(matches!(status.code(), Some(0..=2)), "{status}");
}

#[test]
fn cli_a_reference_whose_times_are_none_is_refused() {
    let folder = Folder::new();
    folder.ok_short("-q -o good.h5");
    with_times(&folder, "constant.h5", |_| 0.01);
    with_times(&folder, "reversed.h5", |row| 1.0 - row as f64 * 1e-3);
    with_times(&folder, "nan.h5", |_| f64::NAN);
    for name in ["constant.h5", "reversed.h5", "nan.h5"] {
        for arguments in [
            &["compare", name, "good.h5"][..],
            &["plot", name, "--html", "page.html"],
            &["plot", name, "--only", "5", "-o", "x.svg"],
        ] {
            folder.refused(arguments, &[name, "/trajectory/time"]);
        }
    }
    assert!(!folder.path("page.html").exists());
}

#[test]
fn cli_sizes_in_studies_are_refused_before_memory_is_asked_for() {
    let folder = Folder::new();
    let axis = "[[axis]]\nkey = \"friction.decay\"\nfrom = 1\nto = 2\n";
    let drawn = |method| format!("[sample]\nmethod = \"{method}\"\ncount = 100000000\n{axis}");
    for (text, place) in [
        (drawn("latin-hypercube"), "s.toml:4: sample.count"),
        (drawn("sobol"), "s.toml:4: sample.count"),
        (format!("{axis}count = 4000001\n"), "s.toml:6: axis.0.count"),
        ("points = \"/dev/zero\"\n".to_owned(), "s.toml:2: points"),
    ] {
        folder.write("s.toml", format!("case = \"paper\"\n{text}"));
        folder.refused("sweep s.toml", &[place]);
    }
    folder.refused("run /dev/zero", &["larger than 8 MB"]);
}

#[test]
fn cli_errors_quote_little_and_nothing_of_files_that_are_no_input() {
    let folder = Folder::new();
    folder.write("secret", "root:$6$verysecret:19000:0:99999:7:::\nuser:$6$other,1,2\n");
    folder.write("s.toml", "case = \"paper\"\npoints = \"secret\"\n");
    let said = folder.refused("sweep s.toml", "");
    assert!(said.contains("secret:1") && !said.contains("verysecret"), "{said}");
    // A misspelt key is quoted, as in other messages.
    folder.write("points.csv", "friction.deccay\n1\n");
    folder.write("s.toml", "case = \"paper\"\npoints = \"points.csv\"\n");
    folder.refused("sweep s.toml", &["did you mean friction.decay"]);

    let long = format!("friction.decay=5 {}", "N m ".repeat(1300));
    let key = format!("{}=1", "k".repeat(5000));
    for setting in [
        long.as_str(),
        &key,
        "title",
        "\u{1b}[2J=1",
        "friction.decay=\u{1b}[31m1",
    ] {
        let said = folder.refused(&["run", "--set", setting], "");
        assert!(said.len() < 600 && !said.contains('\u{1b}'), "{said:?}");
    }
    folder.ok_short("-q -o x.h5 --set title=\"a\\u001b[2Jb\"");
    for arguments in [&["inspect", "x.h5"][..], &["run", "x.h5", "-o", "y.h5"]] {
        let stdout = folder.ok(arguments);
        assert!(stdout.contains("a\\u{1b}[2Jb"), "{stdout:?}");
    }
    // Figures and pages do not contain the control character, either.
    for arguments in [
        &["modes", "x.h5", "-q", "--figure", "x.svg"][..],
        &["plot", "x.h5", "--html", "x.html"],
    ] {
        folder.ok(arguments);
        let text = folder.text(arguments[arguments.len() - 1]);
        assert!(text.contains("a\\u{1b}[2Jb"), "{arguments:?}");
        assert!(
            !text.chars().any(|c| c.is_control() && !"\n\r\t".contains(c)),
            "{arguments:?}"
        );
    }
}

#[test]
fn cli_what_is_wrong_in_a_study_has_its_line() {
    let folder = Folder::new();
    let axis = "[[axis]]\nkey = \"torsion.damping\"\nvalues = [1]\n";
    for (text, place) in [
        (
            format!("[set]\nfriction.decay = -1\n{axis}"),
            "s.toml:3: set.friction.decay: no point",
        ),
        (
            format!("[set]\nsolver = {{ rtol = \"a\" }}\n{axis}"),
            "s.toml:3: set.solver.rtol: ",
        ),
        ("[[axis]]\nvalues = [1]\n".to_owned(), "s.toml:2: axis.0.key: missing"),
        (
            "[sample]\nmethod = \"sobol\"\n".to_owned() + axis,
            "s.toml:2: sample.count: missing",
        ),
    ] {
        folder.write("s.toml", format!("case = \"paper\"\n{text}"));
        folder.refused("sweep s.toml", &[place]);
    }
    folder.write("s.toml", b"case = \"paper\"\ntitle = \"m s\xb2\"\n");
    for command in ["run", "sweep", "calibrate", "work-precision"] {
        folder.refused(&[command, "s.toml"], &["s.toml:2: ", "UTF-8"]);
    }
}

#[cfg(unix)]
#[test]
fn cli_a_candidate_may_come_through_a_pipe() {
    let folder = Folder::new();
    folder.ok_short("-q -o r.h5");
    let rows: String = (0..100)
        .map(|k| format!("{},{}\n", f64::from(k) * 5e-4, 100 - k))
        .collect();
    folder.write("c.csv", format!("time,relative_velocity\n{rows}"));
    let first = |text: &str| text.lines().skip(1).map(str::to_owned).collect::<Vec<_>>();
    let plain = folder.ok("compare r.h5 c.csv --quick");
    let table = folder.read("c.csv");
    let mut command = folder.stickslip("compare r.h5 /dev/stdin --quick");
    let (piped, _) = output(command.write_stdin(table), 0);
    assert_eq!(first(&piped), first(&plain));
}

#[test]
fn cli_names_that_a_sweep_needs_are_refused_first() {
    let folder = Folder::new();
    let study =
        "case = \"paper\"\n[set]\noutput.end_time = 0.01\n[[axis]]\nkey = \"torsion.damping\"\nvalues = [20, 21]\n";
    let files = "[keep]\ntrajectory = true\n";
    for (name, keep) in [("a.journal", ""), ("a.journal", files), ("a.runs", files)] {
        folder.write("s.toml", format!("{study}{keep}"));
        folder.refused(&["sweep", "s.toml", "-o", name], &[name, "-o"]);
        assert_eq!(folder.names(), ["s.toml"]);
    }
}

#[cfg(unix)]
#[test]
fn cli_names_that_are_not_utf8_are_said_to_be() {
    use std::os::unix::ffi::OsStrExt;
    let folder = Folder::new();
    let name = std::ffi::OsStr::from_bytes(b"a\xff.h5");
    let mut command = folder.stickslip("run -o");
    let said = refusal(command.arg(name));
    assert!(said.contains("UTF-8") && !said.contains("disk"), "{said}");
}

#[cfg(unix)]
#[test]
fn cli_a_link_at_the_name_of_a_lock_is_not_followed() {
    let folder = Folder::new();
    std::os::unix::fs::symlink(folder.path("elsewhere"), folder.path(".x.partial.h5.lock")).unwrap();
    folder.refused_short("-o x.h5", &[".x.partial.h5.lock"]);
    assert!(!folder.path("elsewhere").exists());
}

/// The signal of a limit on file sizes would end a program silently.
#[cfg(target_os = "linux")]
#[test]
fn cli_a_limit_on_files_is_an_error_of_every_command() {
    let folder = Folder::new();
    folder.ok("run -q -o r.h5");
    let axis = "[[axis]]\nkey = \"torsion.damping\"\nvalues = [20, 21]\n";
    folder.write(
        "s.toml",
        format!("case = \"paper\"\n[set]\noutput.end_time = 0.01\n{axis}"),
    );
    for (shard, name) in [("1/2", "1.h5"), ("2/2", "2.h5")] {
        folder.ok(&["sweep", "s.toml", "-q", "--shard", shard, "-o", name]);
    }
    let target =
        "[[target]]\nquantity = \"natural_period\"\nvalue = \"0.00024 s\"\n[search]\npoints = 16\nstarts = 1\n";
    let free = "[[free]]\nkey = \"torsion.surface_inertia\"\nfrom = 0.005\nto = 0.03\n";
    folder.write(
        "c.toml",
        format!("case = \"paper\"\n[set]\noutput.end_time = 0.01\nperturbation = []\n{free}{target}"),
    );
    let series = "[[series]]\nmethods = [\"auto\", \"series\"]\ntolerances = [1e-6, 1e-7]\n";
    folder.write(
        "w.toml",
        format!("case = \"paper-si\"\nset = [\"output.end_time=6.98\"]\n{series}"),
    );
    let before = folder.names();
    let commands: &[&[&str]] = &[
        &["calibrate", "c.toml", "-o", "out.h5"],
        &["work-precision", "w.toml", "-o", "out.h5"],
        &["sweep", "s.toml", "-o", "out.h5"],
        &["merge", "1.h5", "2.h5", "-o", "out.h5"],
        &["plot", "r.h5", "--only", "rotor-speed", "-o", "out.svg"],
        &["plot", "r.h5", "--html", "out.html"],
        &["certify", "r.h5", "-o", "out.h5"],
        &["compare", "r.h5", "r.h5", "--report", "out.html"],
    ];
    for arguments in commands {
        let limited = std::process::Command::new("sh")
            .args(["-c", "ulimit -f 4; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_stickslip")])
            .args(*arguments)
            .arg("-q")
            .current_dir(folder.path(""))
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&limited.stderr);
        assert_eq!(limited.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stderr.contains("out"), "{arguments:?}: {stderr}");
        // The journal of a sweep remains, as after any other failure. --force starts again.
        let mut left = folder.names();
        left.retain(|name| name != "out.journal");
        assert_eq!(left, before, "{arguments:?}");
        let again: Vec<&str> = arguments.iter().copied().chain(["-q", "--force"]).collect();
        folder.ok(&again);
        for name in folder.names().iter().filter(|name| name.starts_with("out")) {
            std::fs::remove_file(folder.path(name)).unwrap();
        }
    }
}
