//! A full disk ends a run with an error, and leaves what was saved before; a folder that may not be written is named.
//! Where this user may not mount a small disk, the test reports itself as ignored.

use std::path::Path;
use std::process::Command;

use crate::common::results::{Rows, bits, header, missing, record, stick_slip};
use libtest_mimic::{Completion, Failed, Trial};
use stickslip::record::{Event, Recorder, RecorderError, Sample, Segment};
use stickslip::results::{Overwrite, ResultFile, ResultWriter, Status, partial_path};

const FOLDER: &str = "STICKSLIP_TEST_FOLDER";

type Test = fn() -> Result<Completion, Failed>;

const CLOSED: &str = "STICKSLIP_TEST_CLOSED_FOLDER";

/// The user and group that own nothing, by their usual number.
#[cfg(unix)]
const NOBODY: u32 = 65534;

const NO_MOUNT: &str = "a small file system needs the right to mount one";

/// Does what a test of this file wants of another process; `false` in the test program itself.
pub fn is_child() -> bool {
    if std::env::var_os(FOLDER).is_some() {
        child_that_fills_the_disk();
        return true;
    }
    if let Some(folder) = std::env::var_os(CLOSED) {
        child_that_may_not_write(Path::new(&folder));
        return true;
    }
    false
}

pub fn tests() -> Vec<Trial> {
    let limited: [(&str, Test); 5] = [
        (
            "full_disk_is_an_error_that_keeps_what_was_saved",
            full_disk_is_an_error_that_keeps_what_was_saved,
        ),
        (
            "full_disk_by_a_limit_on_files_is_an_error_that_keeps_what_was_saved",
            full_disk_by_a_limit_on_files_is_an_error_that_keeps_what_was_saved,
        ),
        (
            "full_disk_by_a_limit_on_files_ends_a_run_with_an_error",
            full_disk_by_a_limit_on_files_ends_a_run_with_an_error,
        ),
        (
            "full_disk_leaves_no_part_of_a_file_and_is_named",
            full_disk_leaves_no_part_of_a_file_and_is_named,
        ),
        (
            "full_disk_is_noticed_before_the_run",
            full_disk_is_noticed_before_the_run,
        ),
    ];
    let mut tests: Vec<Trial> = limited
        .into_iter()
        .map(|(name, test)| {
            Trial::ignorable_test(name, move || {
                if cfg!(target_os = "linux") {
                    test()
                } else {
                    missing("small disks and limits on files are those of Linux")
                }
            })
        })
        .collect();
    tests.push(Trial::ignorable_test(
        "refused_folder_without_permission",
        refused_folder_without_permission,
    ));
    tests
}

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
            None
        }
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(self.0.path()).status();
    }
}

/// Counts the rows that the writer has taken.
struct Counting<'a>(&'a mut ResultWriter, usize);

impl Recorder for Counting<'_> {
    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        self.0.sample(sample)?;
        self.1 += 1;
        Ok(())
    }
    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        self.0.event(event)
    }
    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        self.0.segment(segment)
    }
}

/// Not a test: the run that meets the full disk, in a process of its own so that the file can be
/// seen as others see it.
fn child_that_fills_the_disk() {
    let folder = std::env::var_os(FOLDER).expect("a folder");
    let path = Path::new(&folder).join("run.h5");
    let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header()).unwrap();
    let mut counting = Counting(&mut writer, 0);
    let error = record(&mut counting, 1_000_000).unwrap_err().to_string();
    println!("taken: {}", counting.1);
    println!("recorder: {error}");
    println!("saved: {}", writer.saved().samples);
    // Nothing that follows panics or hangs, and nothing pretends that all is well.
    let again = writer.flush().unwrap_err();
    println!("flush: {again}");
    let partial = writer.finish(Status::Failed(error), &stick_slip(), 1.0).unwrap();
    println!("partial: {}", partial.display());
}

/// Runs the child by `command`, and holds what is left against what was written.
fn check(name: &str, mut command: Command, folder: &Path, words: &str) -> usize {
    let output = command.env(FOLDER, folder).output().unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {stdout}{stderr}");
    assert!(stdout.contains(words), "{name}: {stdout}");
    assert!(!stderr.contains("HDF5-DIAG"), "{stderr}");
    let number = |key: &str| -> usize {
        let line = stdout
            .lines()
            .find_map(|line| line.split_once(key))
            .expect("the line")
            .1;
        line.trim().parse().unwrap()
    };

    let path = folder.join("run.h5");
    assert!(!path.exists());
    let file = ResultFile::open(&partial_path(&path)).unwrap();
    assert_eq!(file.status(), &Status::Interrupted);
    let rows = file.sample_count().unwrap();
    let taken = number("taken: ");
    println!("{name}: {rows} rows of {taken}");
    assert_eq!(rows, number("saved: "), "{name}");
    // Not yet saved are at most a block that is filled, one that is written, and a quarter of what is.
    assert!(taken <= rows + rows / 4 + 2 * 4096, "{name}: {rows} rows of {taken}");
    let read = Rows {
        samples: file.samples(0..rows).unwrap(),
        ..Rows::default()
    };
    let mut written = Rows::default();
    record(&mut written, rows).unwrap();
    assert_eq!(bits(&read).0, bits(&written).0);
    // An event and a segment for every hundred rows, up to the same time.
    assert_eq!(file.events().unwrap().len(), rows / 100, "{name}");
    assert_eq!(file.segments().unwrap().len(), rows / 100, "{name}");
    rows
}

fn full_disk_is_an_error_that_keeps_what_was_saved() -> Result<Completion, Failed> {
    // The first is too small for the rows of one block, the others for the whole run.
    for size in ["1m", "3m", "5m", "8m", "11m"] {
        let Some(disk) = SmallDisk::new(size) else {
            return missing(NO_MOUNT);
        };
        let child = Command::new(std::env::current_exe().unwrap());
        let rows = check(size, child, disk.0.path(), "the disk is full");
        assert!(size == "1m" || rows > 0, "{size}");
    }
    Ok(Completion::Completed)
}

/// The same where no file may become larger, which takes no right to mount anything.
fn full_disk_by_a_limit_on_files_is_an_error_that_keeps_what_was_saved() -> Result<Completion, Failed> {
    // Blocks of 512 or of 1024 bytes, as the shell has it.
    for blocks in ["6000", "12000", "20000"] {
        let folder = tempfile::tempdir().unwrap();
        let mut child = Command::new("sh");
        child
            .args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\""), "sh"])
            .arg(std::env::current_exe().unwrap());
        let rows = check(blocks, child, folder.path(), "grow no further");
        assert!(rows > 0, "{blocks}");
    }
    Ok(Completion::Completed)
}

/// The program itself under such a limit, whose signal would end it without a word.
fn full_disk_by_a_limit_on_files_ends_a_run_with_an_error() -> Result<Completion, Failed> {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new("sh")
        .args([
            "-c",
            "ulimit -f 1500; exec \"$@\"",
            "sh",
            env!("CARGO_BIN_EXE_stickslip"),
        ])
        .args(["run", "--json", "-o", "x.h5"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("grow no further"), "{stderr}");
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["status"], "failed");
    let file = ResultFile::open(&folder.path().join("x.partial.h5")).unwrap();
    assert_eq!(file.status(), &Status::Interrupted);
    let (samples, events) = (file.sample_count().unwrap(), file.events().unwrap().len());
    assert!(samples > 0);
    assert_eq!(document["saved"]["samples"], samples);
    assert_eq!(document["saved"]["events"], events);
    Ok(Completion::Completed)
}

/// With no space for even the empty file.
fn full_disk_is_noticed_before_the_run() -> Result<Completion, Failed> {
    let Some(disk) = SmallDisk::new("32k") else {
        return missing(NO_MOUNT);
    };
    let path = disk.0.path().join("run.h5");
    let error = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header())
        .unwrap_err()
        .to_string();
    assert!(error.contains("the disk is full"), "{error}");
    assert!(!partial_path(&path).exists());
    Ok(Completion::Completed)
}

/// Whatever a command writes there is whole or not there, and the message has the name that was given.
fn full_disk_leaves_no_part_of_a_file_and_is_named() -> Result<Completion, Failed> {
    let Some(disk) = SmallDisk::new("40k") else {
        return missing(NO_MOUNT);
    };
    let place = disk.0.path().display().to_string();
    let said = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_stickslip"))
            .args(arguments)
            .current_dir(std::env::temp_dir())
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let text = said(&["man", &place]);
    assert!(text.contains(&format!("{place}/stickslip")), "{text}");
    assert!(text.contains("No space"), "{text}");
    for entry in std::fs::read_dir(disk.0.path()).unwrap() {
        let page = std::fs::read_to_string(entry.unwrap().path()).unwrap();
        assert!(page.starts_with(".ie"), "{page}");
    }
    let elsewhere = tempfile::tempdir().unwrap();
    let certified = elsewhere.path().join("belt.h5").display().to_string();
    let made = Command::new(env!("CARGO_BIN_EXE_stickslip"))
        .args([
            "certify",
            "belt-leine",
            "--set",
            "output.end_time=30",
            "-q",
            "-o",
            &certified,
        ])
        .status();
    assert!(made.unwrap().success());
    let text = said(&["export", &certified, "--benchmark", "-o", &format!("{place}/bench")]);
    assert!(text.contains(&format!("{place}/bench")), "{text}");
    // Not a byte is left: this is said before the many runs of the search.
    let mut filler = std::fs::File::create(disk.0.path().join("filler")).unwrap();
    while std::io::Write::write_all(&mut filler, &[0; 4096]).is_ok() {}
    let text = said(&[
        "calibrate",
        "paper-decay",
        "--progress",
        "never",
        "-o",
        &format!("{place}/x.h5"),
    ]);
    assert!(text.contains("the disk is full"), "{text}");
    assert!(text.contains("x.partial.h5"), "{text}");
    Ok(Completion::Completed)
}

/// A folder that may not be written is named. The superuser may write everywhere, and asks another user.
#[cfg(unix)]
fn refused_folder_without_permission() -> Result<Completion, Failed> {
    use std::os::unix::fs::PermissionsExt;
    use std::os::unix::process::CommandExt;
    let allow = |path: &Path, mode| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let closed = folder.path().join("closed");
    std::fs::create_dir(&closed).unwrap();
    allow(folder.path(), 0o755);
    allow(&closed, 0o555);
    let mut child = Command::new(std::env::current_exe().unwrap());
    child.env(CLOSED, &closed);
    if std::fs::write(closed.join("probe"), "").is_ok() {
        child.uid(NOBODY).gid(NOBODY).current_dir("/");
    }
    let Ok(output) = child.output() else {
        return missing("this user may write everywhere, and another may not start this test");
    };
    let message = String::from_utf8_lossy(&output.stdout);
    // The place, the reason and a remedy.
    assert!(message.starts_with(&closed.display().to_string()), "{message}");
    assert!(message.contains("permission"), "{message}");
    assert!(message.contains("; "), "{message}");
    // Every command names the file that was asked for, and a remedy.
    let program = env!("CARGO_BIN_EXE_stickslip");
    let run = folder.path().join("run.h5");
    let made = Command::new(program)
        .args(["run", "-q", "--end-time", "0.02", "-o"])
        .arg(&run)
        .status();
    assert!(made.unwrap().success());
    for (arguments, name) in [
        ("run -o", "x.h5"),
        ("certify -o", "x.h5"),
        ("sweep critical-curve -o", "x.h5"),
        ("plot RUN --channel z -o", "x.svg"),
        ("plot RUN --channel z -o", "figures"),
        ("plot RUN --html", "x.html"),
        ("export RUN -o", "x.csv"),
        ("export RUN -o", "x.npz"),
        ("compare RUN RUN --quick --report", "x.html"),
        ("modes --figure", "x.svg"),
        ("calibrate --case", "x.toml"),
        ("case paper -o", "x.toml"),
        ("man", "pages"),
    ] {
        let target = closed.join(name);
        let words = arguments
            .split(' ')
            .map(|word| if word == "RUN" { run.as_os_str() } else { word.as_ref() });
        let mut command = Command::new(program);
        command.args(words).arg(&target).current_dir("/");
        if std::fs::write(closed.join("probe"), "").is_ok() {
            command.uid(NOBODY).gid(NOBODY);
        }
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
        let (target, closed) = (target.display(), closed.display());
        for words in [
            format!("{target}: no permission to write there"),
            format!("change the permissions of {closed}, or choose another"),
        ] {
            assert!(said.contains(&words), "{arguments}: {said}");
        }
    }
    Ok(Completion::Completed)
}

/// Not a test: what a user without permission is told.
fn child_that_may_not_write(folder: &Path) {
    let created = ResultWriter::create(&folder.join("paper.h5"), Overwrite::Force, &[], &header());
    println!("{}", created.expect_err("to be refused"));
}

#[cfg(not(unix))]
fn refused_folder_without_permission() -> Result<Completion, Failed> {
    missing("permissions are those of Unix")
}
