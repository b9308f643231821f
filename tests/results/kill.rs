//! A partial file can be read while it is written, and after a kill.
#![cfg(unix)]

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::results::{header, record};
use stickslip::results::{Overwrite, ResultError, ResultFile, ResultWriter, Status, partial_path};

const TARGET: &str = "STICKSLIP_TEST_TARGET";

/// Not a test, but the run that the tests below kill. It never stops writing.
#[test]
#[ignore = "run as another process by the tests of this file"]
fn child_that_never_finishes() {
    let target = PathBuf::from(std::env::var_os(TARGET).expect("a target"));
    let mut writer = ResultWriter::create(&target, Overwrite::OwnResults, &[], &header()).unwrap();
    record(&mut writer, usize::MAX).unwrap();
}

fn start_child(target: &Path) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "results::kill::child_that_never_finishes", "--ignored"])
        .env(TARGET, target)
        .stdout(Stdio::null())
        .spawn()
        .unwrap()
}

/// Waits until the partial file contains some rows, and returns their number.
fn wait_for_rows(partial: &Path) -> usize {
    let deadline = Instant::now() + Duration::from_secs(60);
    loop {
        match ResultFile::open(partial).and_then(|file| file.sample_count()) {
            Ok(rows) if rows > 0 => return rows,
            _ if Instant::now() > deadline => panic!("no rows after a minute"),
            _ => std::thread::sleep(Duration::from_millis(10)),
        }
    }
}

#[test]
fn interrupted_killed_run_leaves_a_readable_file_that_the_next_run_replaces() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("run.h5");
    let partial = partial_path(&target);
    let rounds: u64 = std::env::var("STICKSLIP_TEST_KILLS").map_or(5, |rounds| rounds.parse().unwrap());
    let mut unreadable = 0;
    for round in 0..rounds {
        if round % 2 == 0 && round > 0 {
            std::fs::remove_file(&partial).unwrap();
        }
        let mut child = start_child(&target);
        wait_for_rows(&partial);
        // At arbitrary moments of the next blocks.
        std::thread::sleep(Duration::from_micros(round * 7919 % 600_000));
        child.kill().unwrap();
        child.wait().unwrap();
        let copy = folder.path().join("copy.h5");
        std::fs::copy(&partial, &copy).unwrap();
        let read = || -> Result<usize, ResultError> {
            let file = ResultFile::open(&copy)?;
            assert_eq!(file.status(), &Status::Interrupted);
            assert!(file.stick_slip()?.is_none());
            let rows = file.sample_count()?;
            let samples = file.samples(0..rows)?;
            file.events()?;
            file.segments()?;
            for (row, sample) in samples.iter().enumerate() {
                assert_eq!(sample.time, crate::common::results::sample(row).time, "round {round}");
                let expected = crate::common::results::sample(row).channels.values().map(f64::to_bits);
                let found = sample.channels.values().map(f64::to_bits);
                assert_eq!(found, expected, "round {round} row {row} of {rows}");
            }
            Ok(rows)
        };
        if let Err(error) = read() {
            println!("round {round}: {error}");
            unreadable += 1;
        }
    }
    // A flush takes half a millisecond and is not atomic. While blocks are written without a pause, about one of a
    // hundred kills comes during a flush.
    assert!(unreadable <= 1 + rounds / 50, "{unreadable} of {rounds}");
}
