//! `stickslip check`: a file is as the program wrote it, or the difference is named.

use crate::common::cli::{Folder, json};
use crate::common::json::*;
use crate::common::unlocked;

const STUDY: &str = r#"
case = "paper"
set = { output.end_time = 0.02, actuation.rise_time = 0.01 }
axis = [
    { key = "torsion.damping", from = 10, to = 30, count = 4 },
    { key = "solver.method", values = ["series", "arkode"] },
]
keep = { events = true }
"#;

fn sound(folder: &Folder, name: &str) {
    let stdout = folder.ok(&["check", name]);
    assert!(stdout.contains("all checksums agree"), "{stdout}");
}

/// The places that `check` reports.
fn wrong(folder: &Folder, name: &str) -> Vec<(String, String)> {
    let (stdout, stderr) = folder.ends(&["check", name, "--json"], 1);
    assert!(stderr.contains("problem"), "{stderr}");
    let report = json(&stdout);
    let text = |value: &serde_json::Value| value.text().to_owned();
    let problems = report["problems"].list();
    problems.iter().map(|p| (text(&p["place"]), text(&p["what"]))).collect()
}

#[test]
fn cli_every_run_passes() {
    let folder = Folder::new();
    for method in ["arkode", "series", "paper"] {
        folder.ok(&["run", "--force", "--method", method, "-o", "run.h5", "-q"]);
        sound(&folder, "run.h5");
    }
    folder.ok("run release -o run.h5 -q --force --set output.steps=true");
    sound(&folder, "run.h5");
    let end = ["--set", "solver.max_events=20"];
    folder.ends(&["run", "-o", "some.h5", "-q", end[0], end[1]], 1);
    sound(&folder, "some.partial.h5");
}

/// The additional columns have the units of the motion in `inspect`.
#[test]
fn cli_files_of_every_motion_are_sound() {
    let folder = Folder::new();
    for case in ["belt-leine", "drill-string", "groan", "lugre-slider"] {
        folder.ok(&["run", case, "-q"]);
        let file = format!("{case}.h5");
        sound(&folder, &file);
        assert_eq!(folder.ends(&["check", &file], 0).1, "", "{case}");
    }
    let unit_of = |file: &str, name: &str| {
        let stdout = folder.ok(&["inspect", file, "-v"]);
        let row = stdout.lines().find(|line| line.split_whitespace().next() == Some(name));
        let row = row.unwrap_or_else(|| panic!("{name} in {stdout}")).to_owned();
        row.split("  ")
            .map(str::trim)
            .filter(|cell| !cell.is_empty())
            .nth(2)
            .unwrap()
            .to_owned()
    };
    for (file, name, unit) in [
        ("belt-leine.h5", "stator_twist_0", "m"),
        ("belt-leine.h5", "stator_speed_0", "m s-1"),
        ("belt-leine.h5", "friction_torque", "N"),
        ("drill-string.h5", "rotor_twist_0", "rad"),
        ("drill-string.h5", "rotor_twist_rate_0", "rad s-1"),
        ("drill-string.h5", "rotor_speed_1", "rad s-1"),
        ("drill-string.h5", "friction_torque", "N m"),
        ("lugre-slider.h5", "bristle_deflection", "m"),
    ] {
        assert_eq!(unit_of(file, name), unit, "{name} of {file}");
    }
}

#[test]
fn cli_sweeps_and_their_shards_pass() {
    let folder = Folder::new();
    folder.write("study.toml", STUDY);
    folder.ok("sweep study.toml -o sweep.h5 -q");
    sound(&folder, "sweep.h5");
    let names = ["50% 1.h5", "%b.h5"];
    for (shard, name) in ["1/2", "2/2"].into_iter().zip(names) {
        folder.ok(&["sweep", "study.toml", "--shard", shard, "-o", name, "-q"]);
        sound(&folder, name);
    }
    folder.ok(&["merge", names[0], names[1], "-o", "merged.h5"]);
    sound(&folder, "merged.h5");
    assert_eq!(folder.read("merged.h5"), folder.read("sweep.h5"));
}

#[test]
fn cli_what_was_changed_is_named() {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    let change = |change: &dyn Fn(&hdf5::File)| {
        std::fs::copy(folder.path("run.h5"), folder.path("bad.h5")).unwrap();
        let opened = unlocked::open_rw(folder.path("bad.h5"));
        change(&opened.unwrap());
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
    let segment = |file: &hdf5::File| {
        let column = file.dataset("trajectory/segment").unwrap();
        column.write_slice(&[-1], 7..8).unwrap();
    };
    only(change(&segment), "/", "row 7 of /trajectory/segment, but -1");
    let steps = |file: &hdf5::File| {
        let column = file.dataset("segments/steps").unwrap();
        column.write_slice(&[-5_i64], 0..1).unwrap();
    };
    only(change(&steps), "/", "row 0 of /segments/steps, but -5");
    let status = |text: Option<&'static str>| {
        move |file: &hdf5::File| {
            file.delete_attr("status").unwrap();
            if let Some(text) = text {
                let text: hdf5::types::VarLenUnicode = text.parse().unwrap();
                let made = file.new_attr::<hdf5::types::VarLenUnicode>().create("status");
                made.unwrap().write_scalar(&text).unwrap();
            }
        }
    };
    only(change(&status(Some("complete\n"))), "/", "status");
    only(change(&status(None)), "/", "status is missing");
    let text = |file: &hdf5::File| {
        let input = file.group("input").unwrap();
        input.unlink("case").unwrap();
        let made = input.new_dataset::<hdf5::types::VarLenUnicode>().create("case");
        made.unwrap()
            .write_scalar(&"a".parse::<hdf5::types::VarLenUnicode>().unwrap())
            .unwrap();
    };
    only(change(&text), "/input/case", "fixed length");
    let unlink = |file: &hdf5::File| file.unlink("events/kind").unwrap();
    only(change(&unlink), "/events/kind", "missing");
    let short = |file: &hdf5::File| file.dataset("trajectory/phi1").unwrap().resize([3]).unwrap();
    only(change(&short), "/trajectory/phi1", "3 rows");
    let count = |file: &hdf5::File| {
        let group = file.group("stick_slip").unwrap();
        group.attr("stick_count").unwrap().write_scalar(&17_i64).unwrap();
    };
    only(change(&count), "/stick_slip", "/events has 0");
    let unit = |file: &hdf5::File| {
        let unit: hdf5::types::VarLenUnicode = "rpm".parse().unwrap();
        let dataset = file.dataset("trajectory/theta_dot").unwrap();
        dataset.attr("units").unwrap().write_scalar(&unit).unwrap();
    };
    only(change(&unit), "/trajectory/theta_dot", "units is \"rpm\"");
}

/// A run that is killed between two flushes may leave segments without their events. The file is sound up to there.
#[test]
fn cli_events_that_lag_behind_segments_are_those_of_a_killed_run() {
    let folder = Folder::new();
    folder.ok("run -o run.h5 -q");
    let count = folder.result("run.h5").events().unwrap().len();
    for lost in [1, 2, 7, count - 1, count] {
        folder.write("killed.h5", folder.read("run.h5"));
        let file = unlocked::open_rw(folder.path("killed.h5")).unwrap();
        let status: hdf5::types::VarLenUnicode = "interrupted".parse().unwrap();
        file.attr("status").unwrap().write_scalar(&status).unwrap();
        let events = file.group("events").unwrap();
        for name in events.member_names().unwrap() {
            let column = events.dataset(&name).unwrap();
            // The times of the witness do not grow.
            let _ = column.resize([count - lost]);
        }
        drop(events);
        file.close().unwrap();
        let stdout = folder.ok("check killed.h5");
        assert!(stdout.contains("interrupted"), "{stdout}");
        assert_eq!(folder.result("killed.h5").events().unwrap().len(), count - lost);
    }
}

#[test]
fn cli_a_change_of_mode_without_its_event_is_named() {
    let folder = Folder::new();
    folder.ok("run -o run.h5 -q");
    let kinds = folder.result("run.h5").events().unwrap();
    let first = |kind: &str| kinds.iter().position(|event| event.kind.name() == kind).unwrap();
    let (stick, corner) = (first("stick"), first("corner"));
    for (column, row, code, place, words) in [
        // A slip replaces the first stick, which leads from slip to stick.
        (
            "events/kind",
            stick,
            1_i8,
            format!("row {stick} of /events"),
            "a slip does not lead",
        ),
        (
            "events/kind",
            stick,
            5,
            format!("row {stick} of /events"),
            "a kick does not lead",
        ),
        (
            "events/mode_after",
            stick,
            3,
            format!("row {stick} of /events"),
            "a stick does not lead",
        ),
        (
            "events/mode_after",
            corner,
            1,
            format!("row {corner} of /events"),
            "a corner does not lead",
        ),
        (
            "segments/mode",
            1,
            3,
            "row 1 of /segments".to_owned(),
            "after what comes before it",
        ),
    ] {
        std::fs::copy(folder.path("run.h5"), folder.path("bad.h5")).unwrap();
        let opened = unlocked::open_rw(folder.path("bad.h5"));
        let dataset = opened.unwrap().dataset(column).unwrap();
        dataset.write_slice(&[code], row..row + 1).unwrap();
        drop(dataset);
        let problems = wrong(&folder, "bad.h5");
        assert!(
            problems.iter().any(|p| p.0 == place && p.1.contains(words)),
            "{column}, {place}: {problems:?}"
        );
    }
}

#[test]
fn property_a_changed_byte_of_a_text_or_of_numbers_is_found() {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    let sound = folder.read("run.h5");
    let file = unlocked::open(folder.path("run.h5")).unwrap();
    let chunk = file.dataset("trajectory/theta").unwrap().chunk_info(0).unwrap();
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

/// HDF5 has no checksum for the index of chunks, and reads lost chunks as zeros. The seal finds any changed bit of a
/// key.
#[test]
fn property_a_changed_bit_of_the_index_of_chunks_is_found() {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    let sound = folder.read("run.h5");
    let read = |name: &str| {
        let opened = unlocked::open(folder.path(name));
        opened.unwrap().dataset("trajectory/theta").unwrap()
    };
    let chunk = read("run.h5").chunk_info(0).unwrap();
    // A key (bytes of the chunk, filters left out, first row, 0), followed by the address of the chunk.
    let address = (0..sound.len())
        .find(|&at| {
            sound[at..].starts_with(&chunk.addr.to_le_bytes()) && at >= 24 && {
                let size = u32::from_le_bytes(*sound[at - 24..].first_chunk().unwrap());
                u64::from(size) == chunk.size
            }
        })
        .unwrap();
    for bit in 0..8 * 24 {
        let mut bad = sound.clone();
        bad[address - 24 + bit / 8] ^= 1 << (bit % 8);
        folder.write("bad.h5", &bad);
        let checked = folder.stickslip("check bad.h5").output().unwrap();
        match checked.status.code() {
            Some(1) => {}
            code => panic!("bit {bit}: status {code:?}"),
        }
    }
}

/// HDF5 ignores bytes after its end. Only the seal shows them.
#[test]
fn regression_bytes_after_the_seal_are_damage() {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    let sealed = folder.read("run.h5");
    for appended in [&b"x"[..], b"\n", b"stickslip CRC-32 00000000\n", &[0; 100_000]] {
        folder.write("bad.h5", [&sealed, appended].concat());
        let problems = wrong(&folder, "bad.h5");
        assert!(problems.iter().any(|p| p.1.contains("follow")), "{problems:?}");
        folder.refused("run bad.h5 -o again.h5", &["bad.h5", "damaged"]);
    }
}

/// Files of earlier versions have checksums that are no longer compared. They are read as before. A certified copy
/// drops the checksums, because an earlier version would miss the certificate among them.
#[test]
fn regression_checksums_of_earlier_versions_are_ignored() {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    {
        let file = unlocked::open_rw(folder.path("run.h5")).unwrap();
        let kind = hdf5::types::TypeDescriptor::FixedUnicode(12);
        let meta = file.group("meta").unwrap();
        meta.new_dataset_builder().empty_as(&kind).create("checksums").unwrap();
    }
    let stdout = folder.ok("check run.h5");
    assert!(stdout.contains("there is none of all bytes"), "{stdout}");
    assert!(folder.ok("inspect run.h5 -v").contains("checksums"));
    folder.ok("certify run.h5 -o certified.h5 -q");
    sound(&folder, "certified.h5");
    assert!(!folder.ok("inspect certified.h5 -v").contains("checksums"));
}

#[test]
fn cli_what_is_no_file_of_this_program_is_wrong_input() {
    let folder = Folder::new();
    folder.write("text.h5", "time,theta\n");
    unlocked::create(folder.path("other.h5")).unwrap();
    for name in ["text.h5", "other.h5", "none.h5"] {
        folder.ends(&["check", name], 2);
    }
}
