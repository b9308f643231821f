//! The bytes of a result file, and its own list of contents. `machine/readers` tests what other programs see.

use std::collections::BTreeMap;
use std::fs;

use crate::common::results::{header, record, stick_slip, write};
use stickslip::results::{AttributeValue, Overwrite, ResultFile, ResultWriter, Status, schema};

#[test]
fn regression_identical_runs_give_identical_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["a.h5", "b.h5"].map(|name| folder.path().join(name));
    for path in &paths {
        write(path, 30_000);
        // Modification times, if they were stored, would differ.
        std::thread::sleep(std::time::Duration::from_millis(1100));
    }
    let [a, b] = paths.map(|path| fs::read(path).unwrap());
    assert!(a == b);
}

/// The times of flushes depend on the clock, and must not be visible in the file.
#[test]
fn regression_slow_and_fast_runs_give_identical_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["a.h5", "b.h5"].map(|name| folder.path().join(name));
    for (path, pause) in paths.iter().zip([0, 600]) {
        let mut writer = ResultWriter::create(path, Overwrite::OwnResults, &[], &header()).unwrap();
        for _ in 0..4 {
            record(&mut writer, 5000).unwrap();
            std::thread::sleep(std::time::Duration::from_millis(pause));
        }
        writer.finish(Status::Complete, &stick_slip(), 0.25).unwrap();
    }
    let [a, b] = paths.map(|path| fs::read(path).unwrap());
    assert!(a == b);
}

/// Few bytes differ between runs at different times, and they are in /meta and history.
#[test]
fn regression_only_meta_and_history_differ() {
    let folder = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for (name, second) in [("a.h5", "01"), ("b.h5", "59")] {
        let mut header = header();
        header.history = format!("2024-01-01T00:00:{second}Z stickslip run made-up.toml");
        header.meta.push((
            "started".to_owned(),
            AttributeValue::Text(format!("2024-01-01T00:00:{second}Z")),
        ));
        let path = folder.path().join(name);
        let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header).unwrap();
        record(&mut writer, 9000).unwrap();
        writer
            .finish(Status::Complete, &stick_slip(), second.parse().unwrap())
            .unwrap();
        files.push(fs::read(path).unwrap());
    }
    assert_eq!(files[0].len(), files[1].len());
    // Without the last line, which is the CRC-32 of everything else.
    let [first, second] = [0, 1].map(|k| &files[k][..files[k].len() - 26]);
    let differing = first.iter().zip(second).filter(|(a, b)| a != b).count();
    // Two digits in each text, and the bytes of the wall time.
    assert!(differing <= 12, "{differing} bytes differ");
}

/// Compared with the schema, through the reader.
#[test]
fn contents_lists_every_variable_with_units_and_range() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    write(&path, 5000);
    let contents = ResultFile::open(&path).unwrap().contents().unwrap();
    let listed: BTreeMap<_, _> = contents
        .variables
        .iter()
        .map(|variable| (format!("{}/{}", variable.group, variable.name), variable))
        .collect();
    for table in schema::tables() {
        for variable in &table.variables {
            let info = listed[&format!("/{}/{}", table.group, variable.name)];
            assert_eq!(info.units.as_deref(), Some(variable.units.as_str()));
            assert_eq!(info.long_name.as_deref(), Some(variable.long_name.as_str()));
            assert_eq!(info.flags.len(), variable.flags.len());
            assert!(info.min <= info.max && info.min.is_some(), "{info:?}");
        }
    }
    let found = (listed["/trajectory/time"].min, listed["/trajectory/time"].max);
    assert_eq!(found, (Some(0.0), Some(0.4999)));
    assert_eq!(listed["/input/case"].kind, "string");
    let mut attributes = contents.attributes.iter();
    let status = attributes.find(|attribute| attribute.name == "status").unwrap();
    assert_eq!(status.value, AttributeValue::Text("complete".to_owned()));
    // JSON has no infinity, and gets null instead.
    let json = serde_json::to_value(&contents).unwrap();
    assert_eq!(json["variables"][0]["name"], "time");
    assert_eq!(json["variables"][0]["type"], "float64");
}

#[test]
fn schema_names_are_unique_and_flags_are_single_words() {
    for table in schema::tables() {
        let mut names: Vec<_> = table.variables.iter().map(|variable| variable.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), table.variables.len(), "{}", table.group);
        for (_, meaning) in table.variables.iter().flat_map(|variable| &variable.flags) {
            assert!(!meaning.contains(' '), "{meaning}");
        }
    }
}
