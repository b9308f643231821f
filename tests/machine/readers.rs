//! What other programs see in a result file: h5dump, ncdump, and the readers of Python. Where one of them is not
//! installed its test reports itself as ignored; with STICKSLIP_IGNORE_NONE set, as the project's checks do, as failed.

use std::path::Path;
use std::process::Command;

use crate::common::results::{missing, write};
use libtest_mimic::{Completion, Failed, Trial};
use stickslip::results::schema;

pub fn tests() -> Vec<Trial> {
    vec![
        Trial::ignorable_test("h5dump_sees_plain_columns", h5dump_sees_plain_columns),
        Trial::ignorable_test("netcdf_sees_dimensions_and_flags", netcdf_sees_dimensions_and_flags),
        Trial::ignorable_test("netcdf_python_readers_agree", netcdf_python_readers_agree),
    ]
}

/// The output of a program, or `None` where it is not installed.
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
        Err(_) => None,
    }
}

/// Against h5dump, which knows nothing of this program.
fn h5dump_sees_plain_columns() -> Result<Completion, Failed> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    write(&path, 5000);
    let Some(header) = output_of("h5dump", &["-H", "-p"], &path) else {
        return missing("h5dump is not installed");
    };
    let columns = schema::tables()
        .iter()
        .map(|table| table.variables.len())
        .sum::<usize>();
    for (what, count) in [
        // With the two texts of /input.
        ("DATASET \"", columns + 2),
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
        let time = crate::common::results::sample(row).time;
        assert!(times.contains(&format!("{time}")), "{time}: {times}");
    }
    Ok(Completion::Completed)
}

/// Against ncdump, of the netCDF library: dimensions are dimensions, with their variables.
fn netcdf_sees_dimensions_and_flags() -> Result<Completion, Failed> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    write(&path, 5000);
    let Some(header) = output_of("ncdump", &["-h"], &path) else {
        return missing("ncdump is not installed");
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
    assert!(!header.contains("phony_dim"), "{header}");
    assert!(!header.contains("_FillValue"), "{header}");
    Ok(Completion::Completed)
}

/// Against h5py, xarray and netCDF4, where STICKSLIP_PYTHON names a Python that has them.
fn netcdf_python_readers_agree() -> Result<Completion, Failed> {
    let Some(python) = std::env::var_os("STICKSLIP_PYTHON") else {
        return missing("STICKSLIP_PYTHON names no Python with .ci/requirements.txt");
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    for count in [0, 5000] {
        write(&path, count);
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/.ci/interop.py");
        let output = Command::new(&python).arg(script).arg(&path).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{count} samples: {text}");
        assert!(text.contains(" 0 failed"), "{count} samples: {text}");
        println!("{text}");
    }
    Ok(Completion::Completed)
}
