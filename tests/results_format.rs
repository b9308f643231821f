//! What other programs see in a result file.

mod results_common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use results_common::{header, record, stick_slip, write};
use stickslip::results::{AttributeValue, MetaValue, Overwrite, ResultFile, ResultWriter, Status, schema};

/// The output of a program, or `None` with a message where it is not installed.
fn output_of(program: &str, arguments: &[&str], file: &Path) -> Option<String> {
    match Command::new(program).args(arguments).arg(file).output() {
        Ok(output) => {
            assert!(
                output.status.success(),
                "{program}: {}",
                String::from_utf8_lossy(&output.stderr)
            );
            Some(String::from_utf8_lossy(&output.stdout).into_owned())
        }
        Err(_) => {
            println!("skipped: {program} is not installed");
            None
        }
    }
}

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

/// When a flush comes must not be seen in the file, as it depends on the clock.
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

/// The bytes that differ between runs at different times are few, and lie in /meta and history.
#[test]
fn regression_only_meta_and_history_differ() {
    let folder = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for (name, second) in [("a.h5", "01"), ("b.h5", "59")] {
        let mut header = header();
        header.history = format!("2024-01-01T00:00:{second}Z stickslip run made-up.toml");
        header.meta.push((
            "started".to_owned(),
            MetaValue::Text(format!("2024-01-01T00:00:{second}Z")),
        ));
        let path = folder.path().join(name);
        let mut writer = ResultWriter::create(&path, Overwrite::OwnResults, &[], &header).unwrap();
        record(&mut writer, 9000).unwrap();
        writer
            .finish(Status::Complete, &stick_slip(), second.parse().unwrap())
            .unwrap();
        files.push(fs::read(path).unwrap());
    }
    let differing = files[0].iter().zip(&files[1]).filter(|(a, b)| a != b).count();
    assert_eq!(files[0].len(), files[1].len());
    // Two digits in each text, and the bytes of the wall time.
    assert!(differing <= 12, "{differing} bytes differ");
}

/// Against h5dump, which knows nothing of this program.
#[test]
fn h5dump_sees_plain_columns() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    write(&path, 5000);
    let Some(header) = output_of("h5dump", &["-H", "-p"], &path) else {
        return;
    };
    let columns = schema::tables()
        .iter()
        .map(|table| table.variables.len())
        .sum::<usize>();
    for (what, count) in [
        ("DATASET \"", columns + 3),
        ("CHECKSUM FLETCHER32", columns),
        ("PREPROCESSING SHUFFLE", columns),
    ] {
        assert_eq!(header.matches(what).count(), count, "{what}");
    }
    assert!(header.contains("COMPRESSION DEFLATE"));
    for line in output_of("h5dump", &["-H", "-A", "0"], &path).unwrap().lines() {
        assert!(
            !line.contains("H5T_VLEN") && !line.contains("H5T_COMPOUND") && !line.contains("H5T_VARIABLE"),
            "{line}"
        );
    }
    let times = output_of(
        "h5dump",
        &["-d", "/trajectory/time", "-s", "4998", "-c", "2", "-y", "-m", "%.17g"],
        &path,
    );
    let times = times.unwrap();
    for row in [4998, 4999] {
        let time = results_common::sample(row).time;
        assert!(times.contains(&format!("{time}")), "{time}: {times}");
    }
}

/// Against ncdump, of the netCDF library: dimensions are dimensions, with their variables.
#[test]
fn netcdf_sees_dimensions_and_flags() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    write(&path, 5000);
    let Some(header) = output_of("ncdump", &["-h"], &path) else {
        return;
    };
    for line in [
        "time = UNLIMITED ; // (5000 currently)",
        "event = UNLIMITED ; // (50 currently)",
        "segment = UNLIMITED ; // (50 currently)",
        "cycle = UNLIMITED ; // (3 currently)",
        "double time(time) ;",
        "byte mode(time) ;",
        "mode:flag_values = 0b, 1b, 2b, 3b ;",
        "string mode:flag_meanings = \"separated stick slip-forward slip-backward\" ;",
        "double theta_dot_after(event) ;",
        "double theta_dot_after:units",
        "int64 steps(segment) ;",
        "string case ;",
        ":format_version = 1 ;",
    ] {
        let line = line.replace(
            "double theta_dot_after:units",
            "string theta_dot_after:units = \"rad s-1\" ;",
        );
        assert!(header.contains(&line), "{line}\n{header}");
    }
    assert!(
        !header.contains("phony_dim") && !header.contains("_FillValue"),
        "{header}"
    );
}

/// Against the schema, through the reader.
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
            assert_eq!(info.units.as_deref(), Some(variable.units));
            assert_eq!(info.long_name.as_deref(), Some(variable.long_name.as_str()));
            assert_eq!(info.flags.len(), variable.flags.len());
            assert!(info.min <= info.max && info.min.is_some(), "{info:?}");
        }
    }
    assert_eq!(
        (listed["/trajectory/time"].min, listed["/trajectory/time"].max),
        (Some(0.0), Some(0.4999))
    );
    assert_eq!(listed["/input/case"].kind, "string");
    let status = contents
        .attributes
        .iter()
        .find(|attribute| attribute.name == "status")
        .unwrap();
    assert_eq!(status.value, AttributeValue::Text("complete".to_owned()));
    // Infinity, of which JSON knows nothing, is null there.
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

/// Against h5py, xarray and netCDF4, where STICKSLIP_PYTHON names a Python that has them.
#[test]
fn netcdf_python_readers_agree() {
    let Some(python) = std::env::var_os("STICKSLIP_PYTHON") else {
        println!("skipped: STICKSLIP_PYTHON names no Python with .ci/requirements.txt");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    for count in [0, 5000] {
        write(&path, count);
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/.ci/interop.py");
        let output = Command::new(&python).arg(script).arg(&path).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success() && text.contains(" 0 failed"),
            "{count} samples: {text}"
        );
        println!("{text}");
    }
}
