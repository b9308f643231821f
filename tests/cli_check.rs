//! `stickslip check`: a file is as the program wrote it, or it says what is not.

mod cli_common;

use cli_common::{Folder, json, output};
use stickslip::results::SweepFile;

const STUDY: &str = r#"
case = "paper"
[set]
output.end_time = 0.02
actuation.rise_time = 0.01
[[axis]]
key = "torsion.damping"
from = 10
to = 30
count = 4
[[axis]]
key = "solver.method"
values = ["series", "auto"]
[keep]
events = true
"#;

/// The file is sound, and has checksums.
fn sound(folder: &Folder, name: &str) {
    let (stdout, _) = output(&mut folder.stickslip(&["check", name]), 0);
    assert!(stdout.contains("all checksums agree"), "{stdout}");
}

/// The places that are wrong.
fn wrong(folder: &Folder, name: &str) -> Vec<(String, String)> {
    let (stdout, stderr) = output(&mut folder.stickslip(&["check", name, "--json"]), 1);
    assert!(stderr.contains("problem"), "{stderr}");
    let report = json(&stdout);
    let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    let problems = report["problems"].as_array().unwrap();
    problems.iter().map(|p| (text(&p["place"]), text(&p["what"]))).collect()
}

#[test]
fn cli_every_run_passes() {
    let folder = Folder::new();
    for method in ["auto", "series", "paper"] {
        output(
            &mut folder.stickslip(&["run", "--method", method, "-o", "run.h5", "-q"]),
            0,
        );
        sound(&folder, "run.h5");
    }
    output(
        &mut folder.stickslip(&["run", "release", "-o", "run.h5", "-q", "--set", "output.steps=true"]),
        0,
    );
    sound(&folder, "run.h5");
    let end = ["--set", "solver.max_events=20"];
    output(
        &mut folder.stickslip(&["run", "-o", "some.h5", "-q", end[0], end[1]]),
        1,
    );
    sound(&folder, "some.partial.h5");
}

#[test]
fn cli_sweeps_and_their_shards_pass() {
    let folder = Folder::new();
    folder.write("study.toml", STUDY);
    output(
        &mut folder.stickslip(&["sweep", "study.toml", "-o", "sweep.h5", "-q"]),
        0,
    );
    sound(&folder, "sweep.h5");
    // A per cent sign begins a pattern of names in HDF5.
    let names = ["50% 1.h5", "%b.h5"];
    for (shard, name) in ["1/2", "2/2"].into_iter().zip(names) {
        output(
            &mut folder.stickslip(&["sweep", "study.toml", "--shard", shard, "-o", name, "-q"]),
            0,
        );
        sound(&folder, name);
    }
    output(
        &mut folder.stickslip(&["merge", names[0], names[1], "-o", "merged.h5"]),
        0,
    );
    sound(&folder, "merged.h5");
    assert_eq!(
        std::fs::read(folder.path("merged.h5")).unwrap(),
        std::fs::read(folder.path("sweep.h5")).unwrap()
    );
    output(
        &mut folder.stickslip(&["merge", names[0], names[1], "-o", "virtual.h5", "--virtual"]),
        0,
    );
    sound(&folder, "virtual.h5");
    let status = |name: &str| SweepFile::open(&folder.path(name)).unwrap().numbers("status").unwrap();
    assert_eq!(status("virtual.h5"), status("sweep.h5"));
}

#[test]
fn cli_what_was_changed_is_named() {
    let folder = Folder::new();
    output(&mut folder.short_run(&["-q", "-o", "run.h5"]), 0);
    let change = |change: &dyn Fn(&hdf5::File)| {
        std::fs::copy(folder.path("run.h5"), folder.path("bad.h5")).unwrap();
        let unlocked = hdf5::File::with_options()
            .with_fapl(|access| access.file_locking(false))
            .open_rw(folder.path("bad.h5"));
        change(&unlocked.unwrap());
        wrong(&folder, "bad.h5")
    };
    let set = |name: &'static str, row: usize, value: f64| {
        move |file: &hdf5::File| file.dataset(name).unwrap().write_slice(&[value], row..row + 1).unwrap()
    };
    let only = |problems: Vec<(String, String)>, place: &str, what: &str| {
        assert!(
            problems.iter().any(|p| p.0 == place && p.1.contains(what)),
            "{problems:?}"
        );
    };
    only(
        change(&set("trajectory/time", 7, 0.0)),
        "row 7 of /trajectory",
        "comes after",
    );
    only(
        change(&set("trajectory/z", 5, f64::NAN)),
        "row 5 of /trajectory",
        "z is NaN",
    );
    only(change(&set("segments/end", 0, -1.0)), "row 0 of /segments", "goes from");
    let unlink = |file: &hdf5::File| file.unlink("events/kind").unwrap();
    only(change(&unlink), "/events/kind", "missing");
    only(change(&unlink), "/events/kind", "checksum");
    let short = |file: &hdf5::File| file.dataset("trajectory/phi1").unwrap().resize([3]).unwrap();
    only(change(&short), "/trajectory/phi1", "3 rows");
    let count = |file: &hdf5::File| {
        file.group("stick_slip")
            .unwrap()
            .attr("stick_count")
            .unwrap()
            .write_scalar(&17_i64)
            .unwrap();
    };
    only(change(&count), "/stick_slip", "/events has 0");
    only(change(&count), "/stick_slip", "checksum");
    let unit = |file: &hdf5::File| {
        let unit: hdf5::types::VarLenUnicode = "rpm".parse().unwrap();
        file.dataset("trajectory/theta_dot")
            .unwrap()
            .attr("units")
            .unwrap()
            .write_scalar(&unit)
            .unwrap();
    };
    only(change(&unit), "/trajectory/theta_dot", "units is \"rpm\"");
}

/// Whatever byte of a text is changed, and whatever byte of a chunk of numbers, it is found.
#[test]
fn property_a_changed_byte_of_a_text_or_of_numbers_is_found() {
    let folder = Folder::new();
    output(&mut folder.short_run(&["-q", "-o", "run.h5"]), 0);
    let sound = std::fs::read(folder.path("run.h5")).unwrap();
    let chunk = hdf5::File::open(folder.path("run.h5"))
        .unwrap()
        .dataset("trajectory/theta")
        .unwrap()
        .chunk_info(0)
        .unwrap();
    let text = b"rotor_inertia";
    let text = (0..sound.len()).find(|&at| sound[at..].starts_with(text)).unwrap();
    for at in (chunk.addr as usize..(chunk.addr + chunk.size) as usize)
        .step_by(chunk.size as usize / 4)
        .chain([text + 3])
    {
        let mut bad = sound.clone();
        bad[at] ^= 0x10;
        folder.write("bad.h5", &bad);
        assert!(!wrong(&folder, "bad.h5").is_empty(), "byte {at}");
    }
}

#[test]
fn cli_what_is_no_file_of_this_program_is_wrong_input() {
    let folder = Folder::new();
    folder.write("text.h5", "time,theta\n");
    hdf5::File::create(folder.path("other.h5")).unwrap();
    for name in ["text.h5", "other.h5", "none.h5"] {
        output(&mut folder.stickslip(&["check", name]), 2);
    }
}
