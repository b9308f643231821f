//! A run that is stopped: Ctrl-C, a termination signal.
#![cfg(unix)]

mod cli_common;

use cli_common::{Folder, LONG, json, text};
use std::process::{Child, Command, Output};
use std::time::{Duration, Instant};
use stickslip::results::Status;

/// Starts a long run, and sends it a signal while it is under way.
fn interrupted(folder: &Folder, signal: &str, arguments: &[&str]) -> Output {
    let mut child = folder.start(&[arguments, LONG].concat());
    wait_until_under_way(folder, &mut child);
    send(signal, &child);
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
    let deadline = Instant::now() + Duration::from_secs(30);
    while !folder.path("paper.partial.h5").exists() {
        assert!(Instant::now() < deadline && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    // Some samples on.
    std::thread::sleep(Duration::from_millis(500));
}

fn send(signal: &str, child: &Child) {
    let status = Command::new("kill")
        .args([format!("-{signal}"), child.id().to_string()])
        .status();
    assert!(status.unwrap().success());
}

#[test]
fn cli_signals_leave_a_readable_file() {
    for signal in ["INT", "TERM"] {
        let folder = Folder::new();
        let output = interrupted(&folder, signal, &["run"]);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{signal}: {stderr}");
        assert!(stderr.contains("interrupted at t = 0."), "{stderr}");
        assert!(stderr.contains("saved in paper.partial.h5"), "{stderr}");
        // Nothing else is left, no lock either.
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
    assert_eq!(
        (text(&output.stdout), text(&output.stderr)),
        (String::new(), String::new())
    );
}

/// An interrupted run can be repeated from its partial file, and then completed.
#[test]
fn cli_signals_interrupted_run_can_be_repeated() {
    let folder = Folder::new();
    interrupted(&folder, "INT", &["run", "-q"]);
    let whole = ["--set", "solver.max_step=1", "--set", "output.interval=0.1"];
    let mut again = folder.stickslip(&["run", "paper.partial.h5", "-q", "-o", "whole.h5"]);
    cli_common::output(again.args(whole), 0);
    assert_eq!(folder.result("whole.h5").status(), &Status::Complete);
}

/// Also during its first run, whose file is nobody's and goes again.
#[test]
fn cli_signals_end_a_certificate_without_a_trace() {
    let folder = Folder::new();
    let mut child = folder.start(&[&["certify", "-q"], LONG].concat());
    let deadline = Instant::now() + Duration::from_secs(30);
    while !folder.names().iter().any(|name| name.contains("uncertified")) {
        assert!(Instant::now() < deadline && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    send("INT", &child);
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
