//! Runs that are stopped by Ctrl-C or a termination signal.
#![cfg(unix)]

use crate::common::cli::{Folder, LONG, json, says, send, text};
use crate::common::unlocked;
use std::process::{Child, Command, Output};
use std::time::{Duration, Instant};
use stickslip::results::Status;

/// Starts a long run, and sends it a signal during the run.
fn interrupted(folder: &Folder, signal: &str, arguments: &[&str]) -> Output {
    let mut child = folder.start(&[arguments, LONG].concat());
    wait_until_under_way(folder, &mut child);
    send(signal, child.id());
    let sent = Instant::now();
    let deadline = sent + Duration::from_secs(20);
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > deadline {
            child.kill().unwrap();
            panic!("no end 20 s after {signal}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().unwrap();
    assert!(sent.elapsed() < Duration::from_secs(5), "{:?}", sent.elapsed());
    output
}

fn wait_until_under_way(folder: &Folder, child: &mut Child) {
    folder.wait_for(child, "paper.partial.h5", 0);
    // Some samples later.
    std::thread::sleep(Duration::from_millis(500));
}

#[test]
fn cli_signals_leave_a_readable_file() {
    for signal in ["INT", "TERM"] {
        let folder = Folder::new();
        let output = interrupted(&folder, signal, &["run"]);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{signal}: {stderr}");
        says(&stderr, &["interrupted at t = 0.", "saved in paper.partial.h5"]);
        // Nothing else remains, not even a lock.
        assert_eq!(folder.names(), ["paper.partial.h5"]);
        let file = folder.result("paper.partial.h5");
        assert_eq!(file.status(), &Status::Interrupted);
        let count = file.sample_count().unwrap();
        assert!(count > 1);
        let times = file.column("time", 0..count).unwrap();
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
        let end = file.segments().unwrap().last().unwrap().end;
        assert!(stderr.contains(&format!("t = {end:.9} s")), "{end} in {stderr}");
        assert!(*times.last().unwrap() <= end);
    }
}

#[test]
fn cli_signals_and_json() {
    let folder = Folder::new();
    let output = interrupted(&folder, "INT", &["run", "--json"]);
    assert_eq!(output.status.code(), Some(130));
    let document = json(&text(&output.stdout));
    assert_eq!(document["status"], "interrupted");
    assert_eq!(document["file"], "paper.partial.h5");
    assert_eq!(document["summary"]["interrupted"], true);
}

#[test]
fn cli_signals_and_quiet() {
    let folder = Folder::new();
    let output = interrupted(&folder, "TERM", &["run", "-q"]);
    assert_eq!(output.status.code(), Some(130));
    let found = (text(&output.stdout), text(&output.stderr));
    assert_eq!(found, (String::new(), String::new()));
}

#[test]
fn cli_signals_interrupted_run_can_be_repeated() {
    let folder = Folder::new();
    interrupted(&folder, "INT", &["run", "-q"]);
    let whole = ["--set", "solver.max_step=1", "--set", "output.interval=0.1"];
    let mut again = folder.stickslip("run paper.partial.h5 -q -o whole.h5");
    crate::common::cli::output(again.args(whole), 0);
    assert_eq!(folder.result("whole.h5").status(), &Status::Complete);
}

/// An interruption also works during the first run, whose file is temporary and removed.
#[test]
fn cli_signals_end_a_certificate_without_a_trace() {
    let folder = Folder::new();
    let mut child = folder.start(&[&["certify", "-q"], LONG].concat());
    let deadline = Instant::now() + Duration::from_secs(30);
    while !folder.names().iter().any(|name| name.contains("uncertified")) {
        assert!(Instant::now() < deadline && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    send("INT", child.id());
    let sent = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if sent.elapsed() > Duration::from_secs(20) {
            child.kill().unwrap();
            panic!("no end 20 s after INT");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    assert_eq!(folder.names(), [""; 0]);
}

fn ended(mut child: Child) -> Output {
    let sent = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if sent.elapsed() > Duration::from_secs(20) {
            child.kill().unwrap();
            panic!("no end 20 s after the signal");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

fn wait_for(folder: &Folder, child: &mut Child, name: &dyn Fn(&str) -> bool) {
    let deadline = Instant::now() + Duration::from_secs(30);
    while !folder.names().iter().any(|found| name(found)) {
        assert!(Instant::now() < deadline && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The message names the stage and what is kept. Of the run and the ladder this is nothing.
#[test]
fn cli_signals_a_certificate_says_where_it_was_interrupted() {
    let folder = Folder::new();
    let mut child = folder.start(&[&["certify"], LONG].concat());
    wait_for(&folder, &mut child, &|name| name.contains("uncertified"));
    send("INT", child.id());
    let output = ended(child);
    assert_eq!(output.status.code(), Some(130));
    let expected = "stickslip: interrupted during the run that was to be certified; no certificate was written\n";
    assert_eq!(text(&output.stderr), expected);
    let slow = "certify --set solver.max_step=1e-5 --set 'output={end_time=2, interval=0.1}'";
    let mut child = folder.start(slow);
    wait_for(&folder, &mut child, &|name| name.ends_with(".uncertified.h5"));
    send("INT", child.id());
    let output = ended(child);
    assert_eq!(output.status.code(), Some(130));
    let expected = "stickslip: interrupted during the ladder of independent runs; no certificate was written\n";
    assert_eq!(text(&output.stderr), expected);
    assert_eq!(folder.names(), [""; 0]);
}

#[test]
fn cli_signals_an_interrupted_oracle_leaves_the_certificate() {
    use std::io::{BufRead, BufReader, Read};
    let folder = Folder::new();
    let mut child = folder.start(
        r#"certify paper-si -v --oracle --digits 80 --set initial.speed=3
        --set 'actuation={profile="ramp", force=2225, rise_time=0.02}'
        --set 'perturbation=[{time="instability", relative_velocity=1e-4}]'
        --set 'output={end_time=0.4, interval=0.01}'"#,
    );
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("the exact solver begins") {
        line.clear();
        assert!(stderr.read_line(&mut line).unwrap() > 0, "it ended before");
    }
    send("INT", child.id());
    let output = ended(child);
    let mut rest = String::new();
    stderr.read_to_string(&mut rest).unwrap();
    assert_eq!(output.status.code(), Some(130), "{rest}");
    let words =
        "interrupted while the exact solver computed; paper-si.certified.h5 has the certificate, without exact events";
    assert!(rest.contains(words), "{rest}");
    assert_eq!(folder.names(), ["paper-si.certified.h5"]);
    let file = unlocked::open(folder.path("paper-si.certified.h5")).unwrap();
    assert!(file.link_exists("certificate/verdict") && !file.link_exists("certificate/oracle"));
    assert!(file.link_exists("sensitivity/shift_plus"));
}

/// Starts a comparison with a candidate from a pipe, up to the point where it waits for data. Its temporary folder is
/// its own.
fn waiting_comparison(folder: &Folder) -> (Child, std::fs::File) {
    crate::common::cli::output(&mut folder.short_run("-q -o run.h5"), 0);
    std::fs::create_dir(folder.path("temporary")).unwrap();
    folder.pipe("pipe.csv");
    let child = Command::new(env!("CARGO_BIN_EXE_stickslip"))
        .current_dir(folder.path(""))
        .args(["compare", "run.h5", "pipe.csv"])
        .env("TMPDIR", folder.path("temporary"))
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // It exists as soon as the pipe has been opened for reading.
    let pipe = std::fs::File::options()
        .write(true)
        .open(folder.path("pipe.csv"))
        .unwrap();
    (child, pipe)
}

/// Data that have come through a pipe are not left in the folder for temporary files.
#[test]
fn cli_signals_end_a_comparison_without_a_trace() {
    use std::io::Write;
    let folder = Folder::new();
    let (child, mut pipe) = waiting_comparison(&folder);
    // More data than a pipe can hold, so that some of them have been read.
    pipe.write_all(&b"time,relative_velocity\n0,0\n".repeat(10_000))
        .unwrap();
    send("TERM", child.id());
    let output = ended(child);
    assert_eq!(output.status.code(), None);
    assert_eq!(std::fs::read_dir(folder.path("temporary")).unwrap().count(), 0);
}

/// Of 9e8 points some thousands are finished. At an interruption only these are written.
#[test]
fn cli_signals_end_a_huge_study_in_the_time_of_what_is_done() {
    let folder = Folder::new();
    folder.write(
        "huge.toml",
        "title = \"huge\"\ncase = \"belt-exponential\"\nset = { solver.method = \"series\", output.end_time = 0.1 }\n\
         axis = [{ key = \"rotor.speed\", from = 0.1, to = 0.8, count = 30000 }, \
         { key = \"stator.damping.0\", from = 0.1, to = 3, count = 30000 }]\n",
    );
    let mut child = folder.start("sweep huge.toml -j1 -q");
    folder.wait_for(&mut child, "huge.journal", 2000);
    send("INT", child.id());
    let output = ended(child);
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    let file = folder.sweep_file("huge.partial.h5");
    let numbers = file.numbers("point").unwrap();
    assert!(!numbers.is_empty() && numbers.len() < 1_000_000, "{}", numbers.len());
    assert!(file.numbers("status").unwrap().iter().all(|status| *status < 2.0));
    assert_eq!(file.numbers("rotor_speed").unwrap(), vec![0.1; numbers.len()]);
    folder.ok("check huge.partial.h5");
}

/// If the folder was removed in the meantime, no journal exists from which to continue.
#[test]
fn cli_signals_after_the_folder_was_removed_name_no_journal() {
    for command in ["continue sliding-bifurcations", "sweep groan-speed -j1"] {
        let folder = Folder::new();
        std::fs::create_dir(folder.path("sub")).unwrap();
        let mut child = folder.start(&format!("{command} -q -o sub/b.h5"));
        wait_for(&folder, &mut child, &|name| {
            name == "sub" && folder.path("sub/b.journal").exists()
        });
        std::fs::remove_dir_all(folder.path("sub")).unwrap();
        send("INT", child.id());
        let output = ended(child);
        let stderr = text(&output.stderr);
        assert!([Some(1), Some(2)].contains(&output.status.code()), "{stderr}");
        says(&stderr, "sub/");
        assert!(!stderr.contains("journal"), "{stderr}");
    }
}

/// The first signal ends the run, whose report nobody reads. The second signal ends the program without waiting.
#[test]
fn cli_signals_a_second_one_ends_the_program_at_once() {
    use std::io::Write;
    let folder = Folder::new();
    // A full pipe.
    let (_reader, writer) = std::io::pipe().unwrap();
    let mut filler = writer.try_clone().unwrap();
    std::thread::spawn(move || while filler.write_all(&[0; 4096]).is_ok() {});
    let mut child = Command::new(env!("CARGO_BIN_EXE_stickslip"))
        .current_dir(folder.path("."))
        .args([&["run"], LONG].concat())
        .stdout(writer)
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    wait_until_under_way(&folder, &mut child);
    send("INT", child.id());
    while folder.names() != ["paper.partial.h5"] {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(child.try_wait().unwrap().is_none());
    send("INT", child.id());
    assert_eq!(ended(child).status.code(), Some(130));
}
