//! A full disk ends a run with an error, and leaves what was saved before.
#![cfg(target_os = "linux")]

mod results_common;

use std::path::Path;
use std::process::Command;

use results_common::{Rows, bits, header, record, stick_slip};
use stickslip::results::{Overwrite, ResultFile, ResultWriter, Status, partial_path};

const FOLDER: &str = "STICKSLIP_TEST_FOLDER";

/// A file system of the given size, unmounted at the end; `None` where this user may not mount one.
struct SmallDisk(tempfile::TempDir);

impl SmallDisk {
    fn new(size: &str) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let options = format!("size={size}");
        let mount = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &options, "tmpfs"])
            .arg(folder.path())
            .output();
        if mount.is_ok_and(|output| output.status.success()) {
            Some(SmallDisk(folder))
        } else {
            println!("skipped: a small file system needs the right to mount one");
            None
        }
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(self.0.path()).status();
    }
}

/// Not a test: the run that meets the full disk, in a process of its own so that the file can be
/// seen as others see it.
#[test]
#[ignore = "run as another process by the tests of this file"]
fn child_that_fills_the_disk() {
    let folder = std::env::var_os(FOLDER).expect("a folder");
    let path = Path::new(&folder).join("run.h5");
    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header()).unwrap();
    let error = loop {
        if let Err(error) = record(&mut writer, 1_000_000) {
            break error.to_string();
        }
    };
    println!("recorder: {error}");
    // Nothing that follows panics or hangs, and nothing pretends that all is well.
    let again = writer.flush().unwrap_err();
    println!("flush: {again}");
    let partial = writer.finish(Status::Failed(error), &stick_slip(), 1.0).unwrap();
    println!("partial: {}", partial.display());
}

#[test]
fn full_disk_is_an_error_that_keeps_what_was_saved() {
    // The first is too small for the rows of one block, the others for the whole run.
    for size in ["1m", "3m", "5m", "8m", "11m"] {
        let Some(disk) = SmallDisk::new(size) else { return };
        let output = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "child_that_fills_the_disk", "--ignored", "--nocapture"])
            .env(FOLDER, disk.0.path())
            .output()
            .unwrap();
        let stdout = String::from_utf8_lossy(&output.stdout);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{size}: {stdout}{stderr}");
        assert!(stdout.contains("the disk is full"), "{size}: {stdout}");
        assert!(!stderr.contains("HDF5-DIAG"), "{stderr}");

        let path = disk.0.path().join("run.h5");
        assert!(!path.exists());
        let file = ResultFile::open(&partial_path(&path)).unwrap();
        assert_eq!(file.status(), &Status::Interrupted);
        let rows = file.sample_count().unwrap();
        println!("{size}: {rows} rows");
        let read = Rows {
            samples: file.samples(0..rows).unwrap(),
            ..Rows::default()
        };
        let mut written = Rows::default();
        record(&mut written, rows).unwrap();
        assert_eq!(bits(&read).0, bits(&written).0);
    }
}

/// With no space for even the empty file.
#[test]
fn full_disk_is_noticed_before_the_run() {
    let Some(disk) = SmallDisk::new("32k") else { return };
    let path = disk.0.path().join("run.h5");
    let error = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header())
        .unwrap_err()
        .to_string();
    assert!(error.contains("the disk is full"), "{error}");
    assert!(!partial_path(&path).exists());
}
