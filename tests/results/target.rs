//! Files that a run may replace, and its messages otherwise.

use crate::common::unlocked;
use std::fs;
use std::path::{Path, PathBuf};

use crate::common::results::{header, record, stick_slip, write};
use stickslip::results::{
    Overwrite, Reason, ResultError, ResultFile, ResultWriter, Status, check_target, partial_path,
};

fn create(path: &Path, overwrite: Overwrite) -> Result<ResultWriter, ResultError> {
    ResultWriter::create(path, overwrite, &[], &header())
}

/// The words of a refusal. Every message names the file and a remedy.
fn refused(result: Result<ResultWriter, ResultError>, path: &Path) -> String {
    let message = result.expect_err("to be refused").to_string();
    assert!(message.starts_with(&path.display().to_string()), "{message}");
    assert!(message.contains("; "), "{message}");
    message
}

#[test]
fn atomic_name_appears_only_with_the_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paper.h5");
    let partial = folder.path().join("paper.partial.h5");
    assert_eq!(partial_path(&path), partial);
    let mut writer = create(&path, Overwrite::OwnResults).unwrap();
    assert_eq!(writer.partial(), partial);
    record(&mut writer, 5000).unwrap();
    assert!(partial.exists() && !path.exists());
    writer.finish(Status::Complete, &stick_slip(), 1.0).unwrap();
    assert_eq!(ResultFile::open(&path).unwrap().status(), &Status::Complete);
    // No other file is left, hidden or not.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn atomic_an_interrupted_run_leaves_the_earlier_result_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paper.h5");
    write(&path, 100);
    let before = fs::read(&path).unwrap();
    let mut writer = create(&path, Overwrite::OwnResults).unwrap();
    record(&mut writer, 10).unwrap();
    let partial = writer.finish(Status::Interrupted, &stick_slip(), 1.0).unwrap();
    assert_eq!(fs::read(&path).unwrap(), before);
    assert_eq!(ResultFile::open(&partial).unwrap().status(), &Status::Interrupted);
}

#[test]
fn interrupted_dropped_writer_leaves_all_rows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paper.h5");
    let mut writer = create(&path, Overwrite::OwnResults).unwrap();
    record(&mut writer, 5000).unwrap();
    drop(writer);
    let file = ResultFile::open(&partial_path(&path)).unwrap();
    assert_eq!(file.status(), &Status::Interrupted);
    assert_eq!(file.sample_count().unwrap(), 5000);
    assert!(file.stick_slip().unwrap().is_none());
    drop(file);
    // The next run replaces it.
    write(&path, 10);
    assert!(!partial_path(&path).exists());
}

#[test]
fn replaced_is_only_what_the_program_made() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paper.h5");
    write(&path, 10);
    write(&path, 20);
    assert_eq!(ResultFile::open(&path).unwrap().sample_count().unwrap(), 20);

    fs::write(&path, "notes").unwrap();
    assert!(refused(create(&path, Overwrite::OwnResults), &path).contains("--force"));
    assert_eq!(fs::read_to_string(&path).unwrap(), "notes");

    fs::remove_file(&path).unwrap();
    let file = unlocked::create(&path).unwrap();
    file.new_attr::<i32>().create("format").unwrap();
    assert!(refused(create(&path, Overwrite::OwnResults), &path).contains("--force"));

    let writer = create(&path, Overwrite::Force).unwrap();
    writer.finish(Status::Complete, &stick_slip(), 1.0).unwrap();
    assert!(ResultFile::open(&path).is_ok());
}

#[test]
fn replaced_is_no_protected_result() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paper.h5");
    write(&path, 10);
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    assert!(refused(create(&path, Overwrite::OwnResults), &path).contains("write-protected"));
}

#[test]
fn replaced_is_no_file_that_came_during_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paper.h5");
    let writer = create(&path, Overwrite::OwnResults).unwrap();
    fs::write(&path, "notes").unwrap();
    let error = writer.finish(Status::Complete, &stick_slip(), 1.0).unwrap_err();
    assert!(matches!(error.reason, Reason::Foreign), "{error}");
    assert_eq!(fs::read_to_string(&path).unwrap(), "notes");
    assert_eq!(
        ResultFile::open(&partial_path(&path)).unwrap().status(),
        &Status::Complete
    );
}

#[test]
fn replaced_is_no_foreign_file_with_the_partial_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paper.h5");
    fs::write(partial_path(&path), "notes").unwrap();
    assert!(refused(create(&path, Overwrite::OwnResults), &partial_path(&path)).contains("--force"));
}

/// The input is recognised by any name: relative, through a link, or as the partial file.
#[test]
fn refused_input_as_output() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("input.h5");
    write(&input, 10);
    let mut names = vec![input.clone(), folder.path().join(".").join("input.h5")];
    #[cfg(unix)]
    {
        names.push(folder.path().join("link.h5"));
        std::os::unix::fs::symlink(&input, &names[2]).unwrap();
        names.push(folder.path().join("hard.h5"));
        fs::hard_link(&input, &names[3]).unwrap();
    }
    for name in names {
        for overwrite in [Overwrite::OwnResults, Overwrite::Force] {
            let error = check_target(&name, overwrite, std::slice::from_ref(&input)).unwrap_err();
            assert!(matches!(error.reason, Reason::IsInput), "{error}");
        }
    }
    let partial = folder.path().join("run.partial.h5");
    fs::copy(&input, &partial).unwrap();
    let error = check_target(&folder.path().join("run.h5"), Overwrite::OwnResults, &[partial]).unwrap_err();
    assert!(matches!(error.reason, Reason::IsInput), "{error}");
}

#[test]
fn refused_folder_missing_folder_and_no_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    assert!(refused(create(path, Overwrite::Force), path).contains("folder"));
    let missing = path.join("missing/paper.h5");
    assert!(refused(create(&missing, Overwrite::Force), &missing).contains("does not exist"));
    fs::write(path.join("file"), "").unwrap();
    let below = path.join("file/paper.h5");
    assert!(refused(create(&below, Overwrite::Force), &below).contains("does not exist"));
    assert!(matches!(
        create(Path::new(""), Overwrite::Force),
        Err(ResultError {
            reason: Reason::NoFileName,
            ..
        })
    ));
    fs::create_dir(path.join("paper.partial.h5")).unwrap();
    assert!(create(&path.join("paper.h5"), Overwrite::Force).is_err());
}

#[test]
fn refused_second_run_into_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paper.h5");
    let mut first = create(&path, Overwrite::OwnResults).unwrap();
    let message = refused(create(&path, Overwrite::Force), &partial_path(&path));
    assert!(message.contains("another run"), "{message}");
    // The first run continues undisturbed.
    record(&mut first, 5000).unwrap();
    first.finish(Status::Complete, &stick_slip(), 1.0).unwrap();
    assert_eq!(ResultFile::open(&path).unwrap().sample_count().unwrap(), 5000);
    write(&path, 10);
}

/// HDF5 itself locks a file that it writes.
#[test]
fn refused_target_that_another_program_writes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paper.h5");
    write(&path, 10);
    let other = fs::File::open(&path).unwrap();
    other.lock().unwrap();
    let message = refused(create(&path, Overwrite::OwnResults), &path);
    assert!(message.contains("in use"), "{message}");
    let error = ResultFile::open(&path).unwrap_err();
    assert!(matches!(error.reason, Reason::InUse), "{error}");
}

#[test]
fn open_says_what_a_file_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| -> PathBuf { folder.path().join(name) };
    let open = |name: &str| ResultFile::open(&path(name)).unwrap_err();

    assert!(matches!(open("missing.h5").reason, Reason::NotFound));
    assert!(matches!(open("").reason, Reason::FolderIsNoResult));
    fs::write(path("empty.h5"), "").unwrap();
    assert!(matches!(open("empty.h5").reason, Reason::NotHdf5));
    fs::write(path("text.h5"), "time,theta\n").unwrap();
    assert!(matches!(open("text.h5").reason, Reason::NotHdf5));
    unlocked::create(path("other.h5")).unwrap();
    assert!(matches!(open("other.h5").reason, Reason::NotAResult { .. }));

    write(&path("good.h5"), 5000);
    let bytes = fs::read(path("good.h5")).unwrap();
    // HDF5 does not need the last line, which has 26 bytes.
    for length in [bytes.len() - 27, bytes.len() / 2, 1000, 48, 9] {
        fs::write(path("short.h5"), &bytes[..length]).unwrap();
        let error = open("short.h5");
        assert!(
            matches!(error.reason, Reason::Damaged { .. }),
            "{length} bytes: {error}"
        );
    }

    fs::write(path("newer.h5"), &bytes).unwrap();
    let file = unlocked::open_rw(path("newer.h5")).unwrap();
    file.attr("format_version").unwrap().write_scalar(&1000_i32).unwrap();
    drop(file);
    assert!(open("newer.h5").to_string().contains("newer version"));
}

#[test]
fn open_tolerates_additions() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    write(&path, 100);
    let file = unlocked::open_rw(&path).unwrap();
    let group = file.create_group("certificate").unwrap();
    group
        .new_dataset_builder()
        .with_data(&[1.0_f64, 2.0])
        .create("ladder")
        .unwrap();
    file.group("events")
        .unwrap()
        .new_dataset_builder()
        .with_data(&[1e-9_f64])
        .create("time_uncertainty")
        .unwrap();
    drop((group, file));
    let file = ResultFile::open(&path).unwrap();
    assert_eq!(file.events().unwrap().len(), 1);
    let contents = file.contents().unwrap();
    let mut variables = contents.variables.iter();
    let ladder = variables.find(|variable| variable.name == "ladder").unwrap();
    let found = (ladder.group.as_str(), ladder.min, ladder.max);
    assert_eq!(found, ("/certificate", Some(1.0), Some(2.0)));
    assert!(
        contents
            .variables
            .iter()
            .any(|variable| variable.name == "time_uncertainty")
    );
}
