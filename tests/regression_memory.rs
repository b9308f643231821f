//! Rows stream: a run holds a bounded amount of memory, however many samples it writes.
#![cfg(target_os = "linux")]

use std::process::{Command, Stdio};
use std::time::Duration;
use stickslip::results::ResultFile;

/// High-water mark of a process's resident memory, KiB; `None` once it has ended.
fn peak_memory(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().trim_end_matches("kB").trim().parse().ok()
}

/// More than a million samples of two dozen channels are 200 MiB; the program itself, its libraries and the buffers of
/// the result file take some twenty.
#[test]
fn regression_a_million_samples_take_less_than_64_mib() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("long.h5");
    let mut child = Command::new(env!("CARGO_BIN_EXE_stickslip"))
        .args(["run", "paper", "--quiet"])
        .args(["--set", "output.interval=9.5 us", "--set", "output.window=[]"])
        .arg("--output")
        .arg(&target)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut peak = 0;
    let status = loop {
        peak = peak_memory(child.id()).unwrap_or(0).max(peak);
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    assert!(status.success());
    let samples = ResultFile::open(&target).unwrap().sample_count().unwrap();
    println!("{samples} samples, {peak} KiB");
    assert!(samples > 1_000_000, "{samples}");
    assert!(peak > 0 && peak < 64 * 1024, "{peak} KiB");
}
