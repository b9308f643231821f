//! Rows are streamed: the memory of a run is bounded, however many samples it writes.
#![cfg(target_os = "linux")]

use crate::common::compare::{paper, rows_of};
use crate::common::unlocked;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;
use stickslip::results::ResultFile;

/// High-water mark of a process's resident memory, KiB; `None` after its end.
fn peak_memory(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().trim_end_matches("kB").trim().parse().ok()
}

/// High-water mark of a run into `target`, KiB.
fn peak_of_run(target: &Path, arguments: &[&str]) -> u64 {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stickslip"));
    command
        .args([
            "run",
            "paper",
            "--quiet",
            "--set",
            "output.window=[]",
            "--set",
            "output.around=none",
        ])
        .args(arguments)
        .arg("--output")
        .arg(target);
    peak_of(&mut command)
}

/// High-water mark of a program that must succeed, KiB.
fn peak_of(command: &mut Command) -> u64 {
    let mut child = command.stdout(Stdio::null()).spawn().unwrap();
    let mut peak = 0;
    let status = loop {
        peak = peak_memory(child.id()).unwrap_or(0).max(peak);
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    assert!(status.success());
    peak
}

/// More than a million samples of two dozen channels are 200 MiB. The program, its libraries and the buffers of the
/// result file take about twenty.
#[test]
fn regression_a_million_samples_take_less_than_64_mib() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("long.h5");
    let peak = peak_of_run(&target, &["--set", "output.interval=9.5 us"]);
    let samples = ResultFile::open(&target).unwrap().sample_count().unwrap();
    println!("{samples} samples, {peak} KiB");
    assert!(samples > 1_000_000, "{samples}");
    assert!(peak > 0 && peak < 64 * 1024, "{peak} KiB");
}

/// A heavy rotor that hardly slows down sticks and slips without end. An event with the states on both sides takes 216
/// bytes, a cycle 24. If they were kept, the longer run would take more by its share of both. At the end of the
/// shorter run, HDF5's cache of the file's structure has already reached its final size.
#[test]
#[ignore = "long: a run of many events"]
fn regression_long_events_are_not_kept_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let run = |end: &str| {
        let target = folder.path().join(format!("events-{end}.h5"));
        let end = format!("output.end_time={end}");
        let kick = "perturbation=[{kind=\"kick\",time=0.05,relative_velocity=1e-2}]";
        let settings = [
            "torsion.rotor_inertia=1e6",
            "initial.speed=0.3",
            "actuation.rise_time=0.01",
            "solver.max_events=1000000",
            kick,
            &end,
        ];
        let arguments: Vec<&str> = settings.into_iter().flat_map(|setting| ["--set", setting]).collect();
        let peak = peak_of_run(&target, &arguments);
        let count = ResultFile::open(&target).unwrap().events().unwrap().len() as u64;
        println!("{count} events, {peak} KiB");
        (count, peak)
    };
    let ((few, low), (many, high)) = (run("10"), run("20"));
    let kept = 216 * (many - few) / 1024;
    assert!(kept > 4 * 1024, "{few} and {many} events");
    assert!(high < low + kept / 4, "{low} KiB, {high} KiB, {kept} KiB of events");
    assert!(high < 64 * 1024, "{high} KiB");
}

/// Ten million samples of time and relative velocity are 160 MB. Ten times as many would be read in the same blocks:
/// the bound is a quarter of what 10^8 samples may take.
#[test]
fn regression_ten_million_samples_are_compared_in_less_than_64_mib() {
    const SAMPLES: usize = 10_000_000;
    let folder = tempfile::tempdir().unwrap();
    let candidate = folder.path().join("long.h5");
    let rows = rows_of(paper(), 6.966);
    let mut rows: Vec<_> = rows.into_iter().filter(|row| row.0 < 6.99).collect();
    // There may be no room between a sample and a neighbouring event.
    rows.dedup_by(|b, a| b.0 - a.0 < 1e-8);
    // On straight lines between the reference's samples, written in pieces to bound the memory of this test, too.
    let file = unlocked::create(&candidate).unwrap();
    let create = |name: &str| file.new_dataset::<f64>().shape(SAMPLES).create(name).unwrap();
    let (times, speeds) = (create("time"), create("relative_velocity"));
    let each = SAMPLES / (rows.len() - 1);
    let last = SAMPLES - each * (rows.len() - 2);
    let mut from = 0;
    for (k, pair) in rows.windows(2).enumerate() {
        let count = if k + 2 == rows.len() { last } else { each };
        let parts = || (0..count).map(|part| part as f64 / count as f64);
        let between = |a: f64, b: f64| parts().map(|x| a + (b - a) * x).collect::<Vec<f64>>();
        let range = from..from + count;
        times
            .write_slice(&between(pair[0].0, pair[1].0), range.clone())
            .unwrap();
        speeds.write_slice(&between(pair[0].1[5], pair[1].1[5]), range).unwrap();
        from += count;
    }
    drop((times, speeds, file));
    let mut command = Command::new(env!("CARGO_BIN_EXE_stickslip"));
    // The sequence is found in the straight lines as well.
    let require = [
        "--require",
        "missing<=0",
        "--require",
        "spurious<=0",
        "--require",
        "uncovered<=0",
    ];
    let peak = peak_of(command.arg("compare").arg(paper()).arg(&candidate).args(require));
    println!("{peak} KiB");
    assert!(peak > 0 && peak < 64 * 1024, "{peak} KiB");
}
