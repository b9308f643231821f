//! HDF5 files that this program did not write, or that were changed later. Each must give an error or a result.

use crate::common::cli::{Arguments, Folder, Words, json, says, text};
use crate::common::hostile::{damage, survive};
use crate::common::json::*;
use crate::common::random_brakes::Random;
use crate::common::unlocked::{self, create, open_rw, store};
use hdf5::types::{TypeDescriptor, VarLenAscii, VarLenUnicode};
use std::path::Path;

const STUDY: &str = r#"
case = "paper"
set = { output.end_time = 0.02, actuation.rise_time = 0.01, solver.method = "series" }
axis = [{ key = "torsion.damping", from = 10, to = 30, count = 6 }]
keep = { events = true }
"#;

fn with_run() -> Folder {
    let folder = Folder::new();
    folder.ok_short("-q -o run.h5");
    folder
}

/// The variables of a candidate.
const OWN: [&str; 2] = ["time", "relative_velocity"];

fn write_candidate(path: &Path) -> hdf5::File {
    let file = create(path).unwrap();
    let times: Vec<f64> = (0..100).map(|k| f64::from(k) * 5e-4).collect();
    for name in OWN {
        store(&file, name, &times);
    }
    file
}

/// Replaces all occurrences of `from` in a file by the same number of other bytes.
fn patch(path: &Path, from: &[u8], to: &[u8]) {
    let mut bytes = std::fs::read(path).unwrap();
    let places: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at..].starts_with(from)).collect();
    assert!(!places.is_empty());
    for at in places {
        bytes[at..at + to.len()].copy_from_slice(to);
    }
    std::fs::write(path, bytes).unwrap();
}

/// Runs a command on hostile input, which must end with status 2 and these words.
#[track_caller]
fn refused(folder: &Folder, arguments: impl Arguments, words: impl Words) {
    let (code, _, stderr) = survive(&folder.path(""), arguments);
    assert_eq!(code, 2, "{stderr}");
    says(&stderr, words);
}

/// Standard output of a command on hostile input, which must end with status 0.
#[track_caller]
fn survived(folder: &Folder, arguments: impl Arguments) -> String {
    let (code, stdout, stderr) = survive(&folder.path(""), arguments);
    assert_eq!(code, 0, "{stderr}");
    stdout
}

#[test]
fn regression_texts_of_another_encoding_are_shown_with_replacements() {
    let folder = with_run();
    {
        let file = write_candidate(&folder.path("latin.h5"));
        let time = file.dataset("time").unwrap();
        let unit = VarLenAscii::from_ascii("sXYZ").unwrap();
        time.new_attr::<VarLenAscii>()
            .create("units")
            .unwrap()
            .write_scalar(&unit)
            .unwrap();
    }
    patch(&folder.path("latin.h5"), b"sXYZ", b"s\xb2\xff\xb2");
    refused(&folder, "compare run.h5 latin.h5", "unit & \u{fffd}");
    patch(&folder.path("run.h5"), b"axial displacement", b"axial \xb2isplacement");
    let stdout = survived(&folder, "inspect --json run.h5");
    assert!(stdout.contains("axial \u{fffd}isplacement"));
}

#[test]
fn regression_a_title_that_is_not_unicode_is_no_reason_to_fail() {
    let folder = with_run();
    patch(&folder.path("run.h5"), b"Two-disk", b"Two\xb2disk");
    assert_eq!(survive(&folder.path(""), "inspect run.h5").0, 0);
    // The case will be parsed, so that it must be unchanged.
    refused(&folder, "run run.h5 -o again.h5", "run.h5");
}

/// Nobody can request objects with these names. They are shown, and the rest is read.
#[test]
fn regression_names_of_another_encoding_are_listed() {
    let folder = with_run();
    folder.write("sound.h5", folder.read("run.h5"));
    {
        let file = open_rw(folder.path("run.h5")).unwrap();
        store(&file, "zusatz_XYZ", &[1.0, 2.0]);
        let attribute = file.new_attr::<i64>().create("zusatz_UVW").unwrap();
        attribute.write_scalar(&1_i64).unwrap();
        let other = write_candidate(&folder.path("other.h5"));
        store(&other, "zusatz_XYZ", &[1.0, 2.0]);
    }
    for name in ["run.h5", "other.h5"] {
        patch(&folder.path(name), b"zusatz_XYZ", b"zusatz_\xb2\xff\xb2");
    }
    patch(&folder.path("run.h5"), b"zusatz_UVW", b"zusatz_U\xfcW");
    let stdout = survived(&folder, "inspect run.h5 -v");
    says(&stdout, &["zusatz_\u{fffd}", "zusatz_U\u{fffd}W", "not UTF-8", "time"]);
    let (code, stdout, _) = survive(&folder.path(""), "check run.h5");
    assert!(code == 1 && stdout.contains("is not UTF-8"), "{stdout}");
    // Another program has written to the reference, and thereby removed its seal. It is accepted as it is.
    for reference in ["run.h5", "sound.h5"] {
        survived(&folder, &["compare", reference, "other.h5", "--quick"]);
    }
}

#[test]
fn regression_links_that_lead_back_are_followed_once() {
    let folder = with_run();
    {
        let file = open_rw(folder.path("run.h5")).unwrap();
        file.link_soft("/", "whole").unwrap();
        file.group("events").unwrap().link_hard("/", "whole").unwrap();
        let other = write_candidate(&folder.path("cycle.h5"));
        let inner = other.create_group("a/b/c").unwrap();
        inner.link_soft("/a", "back").unwrap();
        inner.link_hard("/", "root").unwrap();
        inner.link_soft("/a/b/c/self", "self").unwrap();
    }
    let listed = json(&survived(&folder, "inspect run.h5 --json"));
    let variables = listed["variables"].list();
    let times = variables.iter().filter(|v| v["name"] == "time");
    assert_eq!(times.filter(|v| v["group"] == "/trajectory").count(), 1);
    let values = variables.iter().map(|v| format!("{}/{}", v["group"], v["name"]));
    let mut places: Vec<String> = values.collect();
    let count = places.len();
    places.sort();
    places.dedup();
    assert_eq!(places.len(), count);
    let once = |place: &String| place.matches("whole").count() <= 1;
    assert!(places.iter().all(once), "{places:?}");
    survived(&folder, "compare run.h5 cycle.h5 --quick");
}

#[test]
fn regression_groups_within_groups_have_an_end() {
    let folder = with_run();
    {
        let file = open_rw(folder.path("run.h5")).unwrap();
        let mut group = file.create_group("deep").unwrap();
        for _ in 0..20_000 {
            group = group.create_group("g").unwrap();
        }
    }
    refused(
        &folder,
        "inspect run.h5",
        "32 groups within each other & docs/reference/limits.md",
    );
    refused(&folder, "compare run.h5 run.h5", "32 groups within each other");
}

#[test]
fn regression_values_that_are_not_stored_are_not_read() {
    let folder = with_run();
    {
        let file = open_rw(folder.path("run.h5")).unwrap();
        let empty = file.new_dataset::<f64>().chunk(1024).shape((1_usize << 40)..);
        empty.create("empty").unwrap();
        let other = create(folder.path("wide.h5")).unwrap();
        let wide = other.new_dataset::<f64>().shape([1, 1 << 40]);
        wide.create("time").unwrap();
        wide.create("relative_velocity").unwrap();
    }
    refused(&folder, "inspect run.h5", "/empty & 1099511627776 & stores 0");
    refused(&folder, "compare run.h5 wide.h5", "1099511627776");
}

#[test]
fn regression_a_long_text_is_refused_before_memory_is_asked_for() {
    let folder = with_run();
    {
        let file = open_rw(folder.path("run.h5")).unwrap();
        let input = file.group("input").unwrap();
        for name in ["case", "resolved"] {
            input.unlink(name).unwrap();
            let kind = TypeDescriptor::FixedUnicode(u32::MAX as usize);
            input.new_dataset_builder().empty_as(&kind).create(name).unwrap();
        }
    }
    for command in ["run run.h5 -o again.h5", "certify run.h5", "compare run.h5 run.h5"] {
        refused(&folder, command, "4294967295 bytes");
    }
}

#[test]
fn regression_more_events_than_are_stored_are_an_error() {
    let folder = with_run();
    {
        let file = open_rw(folder.path("run.h5")).unwrap();
        // The times of the witness keep the length with which they were written.
        let names = file.group("events").unwrap().member_names().unwrap();
        for name in names.iter().filter(|name| *name != "witness_time") {
            let dataset = file.dataset(&format!("events/{name}")).unwrap();
            dataset.resize([1_usize << 34]).unwrap();
        }
    }
    for command in [
        "plot run.h5 -o figures",
        "compare run.h5 run.h5",
        "certify run.h5",
        "inspect run.h5",
    ] {
        refused(&folder, command, "17179869184");
    }
}

fn merge_changed(folder: &Folder, words: &str, change: impl Fn(&hdf5::File)) {
    std::fs::copy(folder.path("1.h5"), folder.path("changed.h5")).unwrap();
    change(&open_rw(folder.path("changed.h5")).unwrap());
    refused(folder, "merge changed.h5 2.h5 -o merged.h5", words);
    assert!(!folder.path("merged.h5").exists());
}

/// A folder with the study and its halves, 1.h5 and 2.h5.
fn with_two_shards() -> Folder {
    let folder = Folder::new();
    folder.write("study.toml", STUDY);
    for shard in [1, 2] {
        folder.ok(&format!("sweep study.toml --shard {shard}/2 -o {shard}.h5 -q"));
    }
    folder
}

/// A copy of a file without its last line, as HDF5 leaves a file that it has changed.
fn unseal(folder: &Folder, from: &str, to: &str) {
    let bytes = folder.read(from);
    let text = String::from_utf8_lossy(&bytes[bytes.len() - 26..]);
    assert!(text.starts_with("stickslip CRC-32 ") && text.ends_with('\n'), "{text}");
    folder.write(to, &bytes[..bytes.len() - 26]);
}

/// Changes a bit of the first row of a variable's first chunk in the index of chunks. HDF5 then no longer finds the
/// chunk, and reads its fill value.
fn lose_chunk(folder: &Folder, name: &str, variable: &str) {
    let chunk = unlocked::open(folder.path(name)).unwrap();
    let chunk = chunk.dataset(variable).unwrap().chunk_info(0).unwrap();
    let mut bytes = folder.read(name);
    // A key (bytes of the chunk, filters left out, first row, 0), followed by the address of the chunk.
    let is_key = |at: &usize| {
        let size = bytes[at - 24..].first_chunk().map(|size| u32::from_le_bytes(*size));
        bytes[*at..].starts_with(&chunk.addr.to_le_bytes()) && size.map(u64::from) == Some(chunk.size)
    };
    let address = (24..bytes.len()).find(is_key).unwrap();
    bytes[address - 14] ^= 1;
    folder.write(name, &bytes);
}

/// Nothing new is made from a file with a broken seal. Each command refuses it like `check`.
#[test]
fn regression_nothing_is_made_from_a_damaged_file() {
    const WORDS: &str = "some bytes are not those that were written";
    let folder = with_two_shards();
    folder.ok_short("-q -o run.h5");
    folder.ok("sweep study.toml -o sweep.h5 -q");
    folder.write("other.csv", "time,relative_velocity\n0,1\n0.01,1\n0.02,1\n");
    folder.write("base.toml", STUDY.replace("\"paper\"", "\"bad.h5\""));
    let free = "[[free]]\nkey = \"torsion.damping\"\nfrom = 10\nto = 30\n[[target]]\nquantity = \"onset_time\"\nvalue = \"1 s\"\n";
    folder.write("calibration.toml", format!("case = \"bad.h5\"\n{free}"));
    let before = folder.names().len();
    let of_run = [
        "run bad.h5 -o new.h5",
        "certify bad.h5 -o new.h5",
        "modes bad.h5",
        "export bad.h5 -o new.csv",
        "export bad.h5 -o new.csv --rate 1000",
        "sweep base.toml -o new.h5",
        "calibrate calibration.toml -o new.h5",
        "compare bad.h5 run.h5",
        "compare run.h5 bad.h5 --report new.md",
        "compare run.h5 other.csv --events bad.h5",
        "plot bad.h5 -o new",
        "plot run.h5 bad.h5 -o new",
        "plot bad.h5 --html new.html",
        "plot run.h5 --candidate bad.h5 -o new",
    ];
    let resume = "sweep study.toml --resume -q -o bad.h5";
    let of_shard = ["merge bad.h5 2.h5 -o new.h5", &format!("{resume} --shard 1/2")];
    let of_sweep = [resume, "plot bad.h5 -o new", "plot bad.h5 --html new.html"];
    for (file, variable, commands) in [
        ("1.h5", "energy_residual", &of_shard[..]),
        ("sweep.h5", "energy_residual", &of_sweep),
        ("run.h5", "trajectory/theta", &of_run),
    ] {
        folder.write("bad.h5", folder.read(file));
        lose_chunk(&folder, "bad.h5", variable);
        for command in commands {
            refused(&folder, *command, &["bad.h5", WORDS]);
        }
        // It is shown, with a warning.
        let (code, _, stderr) = survive(&folder.path(""), "inspect bad.h5");
        assert!(code == 0 && stderr.contains("bad.h5: damaged"), "{stderr}");
        let (_, stdout, _) = survive(&folder.path(""), "inspect --json bad.h5");
        let damage = json(&stdout)["damage"].to_string();
        assert!(damage.contains(WORDS), "{damage}");
        // The files that `survive` writes, and the damaged file itself.
        assert_eq!(folder.names().len(), before + 3, "{:?}", folder.names());
    }
}

#[test]
fn regression_a_damaged_result_is_no_foreign_candidate() {
    let folder = with_run();
    folder.write("bad.h5", folder.read("run.h5"));
    patch(&folder.path("bad.h5"), b"stickslip-result", b"stickslip-resulu");
    refused(&folder, "compare run.h5 bad.h5", "bad.h5");
    refused(&folder, "compare bad.h5 run.h5", "bad.h5");
    let (_, stdout, _) = survive(&folder.path(""), "inspect --json run.h5");
    assert!(json(&stdout)["damage"].is_null());
}

/// `check` finds any changed bit, wherever HDF5 keeps it, and whatever HDF5 makes of it. The sum over all bytes
/// covers every bit. Without it, about one changed file in a hundred passed.
#[test]
fn property_any_changed_bit_is_found() {
    let folder = with_run();
    let sound = folder.read("run.h5");
    // A changed letter passed in these places: the links of dimensions, and the attributes of /meta.
    let names = ["DIMENSION_LIST", "REFERENCE_LIST", "command_line"];
    let at = |name: &str| {
        let found = |at: &usize| sound[*at..].starts_with(name.as_bytes());
        (0..sound.len()).find(found).unwrap()
    };
    let mut places: Vec<usize> = names.into_iter().map(at).collect();
    let mut dice = Random(0);
    places.extend((0..40).map(|_| dice.below(sound.len())));
    // The last line, too.
    places.extend([sound.len() - 26, sound.len() - 2]);
    let found = |bad: &[u8], what: &str| {
        folder.write("bad.h5", bad);
        let (code, stdout, stderr) = survive(&folder.path(""), "check bad.h5");
        assert_ne!(code, 0, "{what}: {stdout}{stderr}");
    };
    for at in places {
        let mut bad = sound.clone();
        bad[at] ^= 1 << dice.below(8);
        found(&bad, &format!("byte {at}"));
    }
    // HDF5 does not need the end of the last line.
    for lost in [1, 20] {
        found(&sound[..sound.len() - lost], &format!("{lost} bytes lost"));
    }
}

#[test]
fn regression_a_file_without_the_sum_of_its_bytes_is_sound() {
    let folder = with_run();
    unseal(&folder, "run.h5", "earlier.h5");
    let (code, stdout, _) = survive(&folder.path(""), "check earlier.h5");
    assert!(code == 0 && stdout.contains("there is none of all bytes"), "{stdout}");
    for arguments in [
        "run earlier.h5 -o again.h5 -q",
        "certify earlier.h5 -o certified.h5 -q",
        "compare earlier.h5 earlier.h5 -q --json",
        "plot earlier.h5 -o figures -q",
        "inspect earlier.h5 -q --json",
    ] {
        survived(&folder, arguments);
    }
    // HDF5 cuts the line off when it changes a file. The output of certify has one again.
    let file = open_rw(folder.path("run.h5")).unwrap();
    file.new_attr::<i64>().create("mine").unwrap();
    drop(file);
    let (_, stdout, _) = survive(&folder.path(""), "check --json run.h5");
    assert_eq!(json(&stdout)["sealed"], false);
    let certified = json(&survived(&folder, "check --json certified.h5"));
    assert_eq!(certified["sealed"], true);
}

#[test]
fn regression_a_shard_that_lies_about_its_study_is_refused() {
    let folder = with_two_shards();
    let number = |name: &'static str, value: i64| {
        move |file: &hdf5::File| file.attr(name).unwrap().write_scalar(&value).unwrap()
    };
    merge_changed(&folder, "shard_count", number("shard_count", 1 << 40));
    merge_changed(&folder, "shard_count", number("shard_count", -1));
    merge_changed(&folder, "shard", number("shard", 1 << 40));
    let shape = |shape: &'static [i64]| {
        move |file: &hdf5::File| {
            file.delete_attr("study_shape").unwrap();
            file.new_attr_builder().with_data(shape).create("study_shape").unwrap();
        }
    };
    merge_changed(&folder, "study_shape", shape(&[1 << 32, 1 << 32]));
    merge_changed(&folder, "study_shape", shape(&[1 << 40, 1 << 40]));
    merge_changed(&folder, "division", shape(&[2, 3]));
    merge_changed(&folder, "study_shape", shape(&[0]));
    merge_changed(&folder, "point", shape(&[1 << 36]));
    for name in ["study_axes", "study_variables"] {
        merge_changed(&folder, name, |file| {
            let empty = VarLenUnicode::new();
            file.attr(name).unwrap().write_scalar(&empty).unwrap();
        });
    }
    for name in ["events/point", "point"] {
        merge_changed(&folder, name, |file| {
            file.unlink(name).unwrap();
            file.new_dataset::<i64>().create(name).unwrap();
        });
    }
}

#[test]
fn regression_other_files_are_read_only_on_demand() {
    let folder = with_run();
    {
        drop(write_candidate(&folder.path("secret.h5")));
        let links = create(folder.path("links.h5")).unwrap();
        let file = open_rw(folder.path("run.h5")).unwrap();
        file.unlink("events").unwrap();
        file.link_external("secret.h5", "/", "events").unwrap();
        std::fs::write(folder.path("numbers"), [0; 800]).unwrap();
        let external = create(folder.path("external.h5")).unwrap();
        for name in OWN {
            links.link_external("secret.h5", name, name).unwrap();
            let stored = external.new_dataset::<f64>().shape([100]).external("numbers", 0, 800);
            stored.create(name).unwrap();
        }
        let secret = folder.path("secret.h5");
        write_virtual(&folder.path("virtual.h5"), secret.to_str().unwrap(), OWN);
    }
    for name in ["links.h5", "external.h5", "virtual.h5"] {
        std::fs::copy(folder.path("secret.h5"), folder.path("reference")).unwrap();
        refused(&folder, &["compare", "run.h5", name], &["--follow-external"]);
    }
    for command in ["inspect", "certify", "plot"] {
        refused(&folder, &[command, "run.h5"], &["/events", "--follow-external"]);
    }
    folder.ok_short("-q -o run2.h5");
    for name in ["links.h5", "virtual.h5"] {
        survived(&folder, &["compare", "run2.h5", name, "--quick", "--follow-external"]);
    }
}

/// They are refused like times that do not increase.
#[test]
fn regression_a_reference_with_values_that_are_none_is_refused() {
    for (name, value) in [("theta", f64::NAN), ("phi1_dot", f64::INFINITY)] {
        let folder = with_run();
        std::fs::copy(folder.path("run.h5"), folder.path("sound.h5")).unwrap();
        let file = open_rw(folder.path("run.h5")).unwrap();
        let column = file.dataset(&format!("trajectory/{name}")).unwrap();
        column.write_slice(&[value], 5..6).unwrap();
        // The change is written when nothing holds the file open.
        drop((column, file));
        let words = ["row 5", name];
        refused(&folder, "compare run.h5 sound.h5", &words);
        refused(&folder, "certify run.h5 -o certified.h5", &words);
        assert!(!folder.path("certified.h5").exists());
    }
}

/// An unreadable column is reported where it is missing, and is no reason to refuse the rest.
#[test]
fn regression_a_column_that_is_left_out_is_said_to_be() {
    let folder = with_run();
    let columns = |names: [&str; 2], long: &str| {
        let file = create(folder.path("other.h5")).unwrap();
        let times: Vec<f64> = (0..100).map(|k| f64::from(k) * 5e-4).collect();
        for name in names {
            store(&file, name, &times);
        }
        let empty = file.new_dataset::<f64>().chunk(1024).shape((1_usize << 40)..);
        empty.create(long).unwrap();
        file.link_external("secret.h5", "z", "z").unwrap();
    };
    columns(["other", "relative_velocity"], "time");
    let words = "no column of times & left out & 1099511627776";
    refused(&folder, "compare run.h5 other.h5", words);
    columns(["time", "relative_velocity"], "other");
    survived(&folder, "compare run.h5 other.h5 --quick");
}

/// Writes a file whose two variables are virtual, with the variables `names` of another file as sources.
fn write_virtual(path: &Path, source: &str, names: [&str; 2]) {
    let file = create(path).unwrap();
    for (name, from) in OWN.into_iter().zip(names) {
        let made = file.new_dataset::<f64>().shape([100]);
        let made = made.virtual_map(source, from, [100], .., [100], ..);
        made.create(name).unwrap();
    }
}

/// Links of the file system lead out of the folder without being visible in a name.
#[cfg(unix)]
#[test]
fn regression_links_of_the_file_system_lead_to_no_other_file() {
    let folder = with_run();
    std::fs::create_dir(folder.path("shared")).unwrap();
    drop(write_candidate(&folder.path("secret.h5")));
    std::os::unix::fs::symlink("../secret.h5", folder.path("shared/link.h5")).unwrap();
    std::os::unix::fs::symlink("..", folder.path("shared/up")).unwrap();
    drop(write_candidate(&folder.path("shared/beside0.h5")));
    std::os::unix::fs::symlink("beside0.h5", folder.path("shared/near.h5")).unwrap();
    let compare = "compare run.h5 shared/virtual.h5";
    for source in ["link.h5", "up/secret.h5"] {
        write_virtual(&folder.path("shared/virtual.h5"), source, OWN);
        refused(&folder, compare, &[source, "--follow-external"]);
    }
    write_virtual(&folder.path("shared/virtual.h5"), "near.h5", OWN);
    survived(&folder, "compare run.h5 shared/virtual.h5 --quick");
    // The file itself may be named by a link.
    std::os::unix::fs::symlink("shared/virtual.h5", folder.path("named.h5")).unwrap();
    survived(&folder, "compare run.h5 named.h5 --quick");
}

/// A name with a pattern stands for any number of files, which are not listed anywhere. The two files are written by
/// h5py (HDF5 2.0.0), because the binding has no virtual dataset without end: `time` and `relative_velocity` of
/// `beside%b.h5`, and `time%b` and `relative_velocity%b` of `beside0.h5`.
#[test]
fn regression_a_pattern_of_names_leads_to_no_other_file() {
    let folder = with_run();
    folder.write("file.h5", include_bytes!("../common/hostile/pattern-file.h5"));
    folder.write("name.h5", include_bytes!("../common/hostile/pattern-name.h5"));
    for (name, source) in [("file.h5", "beside%b.h5"), ("name.h5", "beside0.h5")] {
        let _ = std::fs::remove_file(folder.path("beside0.h5"));
        let compare = ["compare", "run.h5", name];
        refused(&folder, &compare, &[source, "--follow-external"]);
        drop(write_candidate(&folder.path("beside0.h5")));
        refused(&folder, &compare, &[source, "--follow-external"]);
    }
    survived(&folder, "compare run.h5 file.h5 --quick --follow-external");
}

/// HDF5 reads missing sources as fill values.
#[test]
fn regression_a_missing_source_of_a_virtual_variable_is_an_error() {
    let folder = with_run();
    drop(write_candidate(&folder.path("near.h5")));
    write_virtual(&folder.path("virtual.h5"), "near.h5", OWN);
    let compare = "compare run.h5 virtual.h5 --quick";
    survived(&folder, compare);
    let wrong = |words: &str| {
        refused(&folder, compare, words);
        refused(&folder, &format!("{compare} --follow-external"), words);
    };
    std::fs::rename(folder.path("near.h5"), folder.path("away.h5")).unwrap();
    wrong("near.h5 & not there");
    #[cfg(unix)]
    {
        folder.pipe("near.h5");
        wrong("near.h5 & no plain file");
        std::fs::remove_file(folder.path("near.h5")).unwrap();
    }
    drop(create(folder.path("near.h5")).unwrap());
    wrong("near.h5 & has no");
    folder.write("near.h5", "\u{89}HDF");
    wrong("near.h5 & cannot be read");
}

#[cfg(unix)]
#[test]
fn regression_a_pipe_is_no_result() {
    let folder = with_run();
    folder.pipe("pipe.h5");
    refused(&folder, "inspect pipe.h5", "pipe.h5");
    refused(&folder, "plot pipe.h5", "pipe.h5");
}

/// A lock must be a plain file. Opening a pipe for reading could block for ever.
#[cfg(unix)]
#[test]
fn regression_a_pipe_in_place_of_a_lock_is_not_waited_for() {
    let folder = with_run();
    for lock in [".run.h5.lock", ".new.partial.h5.lock"] {
        folder.pipe(lock);
    }
    survived(&folder, "inspect run.h5");
    let words = ".new.partial.h5.lock & not a result of this program";
    refused(&folder, "run -q -o new.h5 --set output.end_time=0.01", words);
}

/// Processes whose parents end become children of this process. There must be none.
#[cfg(target_os = "linux")]
#[test]
fn regression_no_probing_process_is_left() {
    let folder = with_run();
    unseal(&folder, "run.h5", "unsealed.h5");
    rustix::process::set_child_subreaper(Some(rustix::process::getpid())).unwrap();
    let own = std::process::id().to_string();
    for arguments in [
        "inspect unsealed.h5",
        "compare run.h5 unsealed.h5",
        "compare unsealed.h5 missing.h5",
    ] {
        survive(&folder.path(""), arguments);
        for process in std::fs::read_dir("/proc").unwrap() {
            let stat = process.unwrap().path().join("stat");
            let Ok(stat) = std::fs::read_to_string(stat) else {
                continue;
            };
            let (name, rest) = stat.rsplit_once(") ").unwrap();
            let (id, name) = name.split_once(" (").unwrap();
            let fields: Vec<&str> = rest.split(' ').collect();
            // Only probing processes lead a process group.
            let is_left = name == "stickslip" && fields[1] == own && fields[2] == id;
            assert!(!is_left, "{arguments:?}: {stat}");
        }
    }
}

/// If a probing process is ended or stopped from outside, the file is not blamed. A process that neither computes nor
/// reads, for example because its disk does not answer, is abandoned.
#[cfg(target_os = "linux")]
#[test]
fn regression_the_end_of_a_probe_from_outside_is_not_blamed_on_the_file() {
    use hdf5::plist::dataset_create::{AllocTime, FillTime};
    use rustix::process::{Pid, Signal, kill_process};
    let folder = with_run();
    {
        // A file that takes a second to read, and no space on the disk.
        let file = write_candidate(&folder.path("long.h5"));
        let long = file.new_dataset::<f64>().alloc_time(Some(AllocTime::Early));
        let long = long.fill_time(FillTime::Never).shape([1 << 28]);
        long.create("long").unwrap();
    }
    let probe_of = |parent: u32| {
        for _ in 0..20_000 {
            let processes = std::fs::read_dir("/proc").unwrap().filter_map(|process| {
                let folder = process.ok()?.path();
                let stat = std::fs::read_to_string(folder.join("stat")).ok()?;
                let command = std::fs::read(folder.join("cmdline")).ok()?;
                let rest = stat.rsplit_once(") ")?.1;
                let is_probe = command.split(|&byte| byte == 0).nth(1) == Some(b"--probe-hdf5");
                let is_child = rest.split(' ').nth(1) == Some(&parent.to_string());
                (is_probe && is_child).then(|| folder.file_name()?.to_str()?.parse().ok())?
            });
            if let Some(process) = processes.into_iter().next() {
                return Pid::from_raw(process).unwrap();
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        panic!("no probe");
    };
    for (signal, words) in [
        (Signal::KILL, "ended from outside, with signal 9"),
        (Signal::STOP, "neither computed nor read"),
    ] {
        let compare = folder.start("compare run.h5 long.h5");
        kill_process(probe_of(compare.id()), signal).unwrap();
        let output = compare.wait_with_output().unwrap();
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        says(&stderr, &["long.h5", words]);
        assert!(!stderr.contains("damaged"), "{stderr}");
    }
}

/// A file without an intact seal is not opened before it is probed. Here none can be started, because the program no
/// longer exists.
#[cfg(target_os = "linux")]
#[test]
fn regression_an_unsealed_file_is_not_opened_without_a_probe() {
    let folder = with_run();
    unseal(&folder, "run.h5", "unsealed.h5");
    let mut bad = folder.read("run.h5");
    let middle = bad.len() / 2;
    bad[middle] ^= 1;
    folder.write("bad.h5", bad);
    for (name, code) in [("run.h5", 0), ("unsealed.h5", 1), ("bad.h5", 1)] {
        std::fs::copy(env!("CARGO_BIN_EXE_stickslip"), folder.path("program")).unwrap();
        let command = "exec 3<program && rm program && exec /proc/self/fd/3 inspect \"$1\"";
        let mut inspect = std::process::Command::new("sh");
        inspect.args(["-c", command, "sh", name]).current_dir(folder.path(""));
        let output = inspect.output().unwrap();
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{name}: {stderr}");
        assert!(code == 0 || stderr.contains("did not start"), "{name}: {stderr}");
    }
}

/// A file that a run is writing is read in the state of its last flush, every time. Each reading takes longer than
/// the one before, and the run takes minutes, so that a few seconds of reading suffice.
#[test]
fn regression_a_growing_file_can_be_read_at_any_time() {
    let folder = Folder::new();
    let steps =
        "--set output.end_time=100 --set output.interval=1e-4 --set solver.max_step=1e-7 --set output.steps=true";
    let mut run = folder.start(&format!("run -q -o grows.h5 {steps}"));
    let partial = folder.path("grows.partial.h5");
    while !partial.exists() {
        assert!(run.try_wait().unwrap().is_none(), "the run has ended");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let mut rows = Vec::new();
    let begun = std::time::Instant::now();
    while rows.len() < 12 && begun.elapsed().as_secs() < 3 {
        let (code, stdout, stderr) = survive(&folder.path(""), "inspect --json grows.partial.h5");
        assert!(code == 0 && stderr.contains("still being written"), "{stderr}");
        let listed = json(&stdout);
        assert_eq!(listed["growing"], true);
        let variables = listed["variables"].list();
        let time = variables
            .iter()
            .find(|v| v["group"] == "/trajectory" && v["name"] == "time")
            .unwrap();
        rows.push(time["shape"][0].whole());
    }
    run.kill().unwrap();
    run.wait().unwrap();
    assert!(rows.is_sorted(), "{rows:?}");
    let (code, stdout, _) = survive(&folder.path(""), "inspect --json grows.partial.h5");
    // A kill during a flush may leave the file unreadable.
    assert!(code == 2 || json(&stdout)["growing"] == false);
}

/// Changes the length of a variable: a growing one in place, any other by creating it again without its attributes.
fn change_length(path: &Path, variable: &str, length: usize) {
    let file = open_rw(path).unwrap();
    let old = file.dataset(variable).unwrap();
    let mut shape = old.shape();
    shape[0] = length;
    if old.resize(shape.clone()).is_err() {
        let kind = old.dtype().unwrap().to_descriptor().unwrap();
        drop(old);
        file.unlink(variable).unwrap();
        let new = file.new_dataset_builder().empty_as(&kind).shape(shape);
        new.create(variable).unwrap();
    }
    file.close().unwrap();
}

/// The variables of all tables in a file, with their numbers of rows.
fn columns(path: &Path) -> Vec<(String, usize)> {
    fn below(group: &hdf5::Group, at: &str, found: &mut Vec<(String, usize)>) {
        for name in group.member_names().unwrap() {
            let path = format!("{at}{name}");
            if let Ok(dataset) = group.dataset(&name) {
                found.extend(dataset.shape().first().map(|&rows| (path, rows)));
            } else if let Ok(group) = group.group(&name) {
                below(&group, &format!("{path}/"), found);
            }
        }
    }
    let (file, mut found) = (unlocked::open(path).unwrap(), Vec::new());
    below(&file, "", &mut found);
    found
}

/// In every kind of file, if a column is longer or shorter than its table, `check` and every command that reads the
/// table refuse the file, and name the table. One column in `each` is changed, and additionally those on which a
/// command once panicked.
fn columns_of_other_lengths(each: usize) {
    const KNOWN: [&str; 3] = ["branches/parent", "runs/method", "targets/half_width"];
    let folder = with_two_shards();
    folder.ok_short("-q -o run.h5");
    folder.ok("certify run.h5 -q -o certified.h5");
    folder.ok("sweep study.toml -o sweep.h5 -q");
    folder.write("inertia.toml", crate::calibrate::QUICK);
    folder.ok("calibrate inertia.toml -q");
    folder.write("belt.toml", crate::plot_branches::STUDY);
    folder.ok("continue belt.toml -q");
    let series = "series = [{ methods = [\"series\", \"erk\"], tolerances = [1e-6, 1e-8] }]\n";
    folder.write("few.toml", format!("title = \"few\"\ncase = \"block\"\n{series}"));
    folder.ok("work-precision few.toml -q");
    let plot = "plot bad.h5 -o new";
    let html = "plot bad.h5 --html new.html";
    let csv = "export bad.h5 -o new.csv";
    let events = "export bad.h5 -o new.csv --table events";
    let cycle = "cycle bad.h5 --branch 1 --point 3";
    let merge = "merge bad.h5 2.h5 -o new.h5";
    let mut dice = Random(7);
    for (seed, commands) in [
        ("run.h5", &[plot, html, csv, events][..]),
        ("certified.h5", &[plot, html, events]),
        ("sweep.h5", &[plot, html]),
        ("1.h5", &[merge]),
        ("inertia.h5", &[plot, html]),
        ("belt.h5", &[plot, html, cycle]),
        ("few.h5", &[plot]),
    ] {
        let all = columns(&folder.path(seed));
        let group = |variable: &str| variable.rsplit_once('/').map(|(group, _)| group.to_owned());
        for (variable, rows) in &all {
            if dice.below(each) > 0 && !KNOWN.contains(&variable.as_str()) {
                continue;
            }
            let length = [0, rows + 1, rows.saturating_sub(1), 2 * rows + 7][dice.below(4)];
            let group_of = group(variable);
            // A group with several dimensions does not say to which of them a changed column belonged.
            let fits = |(other, rows): &(String, usize)| group(other) == group_of && length == *rows;
            // An axis of a shard has its own length.
            if variable.starts_with("axes/") || all.iter().any(fits) {
                continue;
            }
            folder.write("bad.h5", folder.read(seed));
            change_length(&folder.path("bad.h5"), variable, length);
            let (code, stdout, stderr) = survive(&folder.path(""), "check bad.h5");
            let said = format!("{seed}, {variable} of {length} rows: {stdout}{stderr}");
            assert_ne!(code, 0, "{said}");
            let words = format!("the table /{} differ in length", group_of.unwrap_or_default());
            assert!(said.contains(&words), "{said}");
            for arguments in commands {
                refused(&folder, *arguments, &["bad.h5", &words]);
            }
        }
    }
}

#[test]
fn property_a_table_whose_columns_differ_in_length_is_refused() {
    columns_of_other_lengths(12);
}

#[test]
#[ignore = "a minute or more: every column of every kind of file"]
fn property_long_every_table_whose_columns_differ_in_length_is_refused() {
    columns_of_other_lengths(1);
}

/// The seeds of the campaign: files of the program, and one of another program.
fn seeds(folder: &Folder) -> Vec<(&'static str, Vec<u8>)> {
    folder.ok_short("-q -o reference.h5");
    folder.ok("sweep study.toml -o sweep.h5 -q");
    {
        let file = write_candidate(&folder.path("candidate.h5"));
        let kinds = ["stick", "slip"].map(|kind| kind.parse::<VarLenUnicode>().unwrap());
        let events = file.create_group("events").unwrap();
        store(&events, "kind", &kinds);
        store(&events, "time", &[0.01, 0.02]);
        let unit = file.dataset("time").unwrap().new_attr::<VarLenUnicode>();
        let s: VarLenUnicode = "s".parse().unwrap();
        unit.create("units").unwrap().write_scalar(&s).unwrap();
    }
    let names = ["reference.h5", "sweep.h5", "1.h5", "candidate.h5"];
    names.map(|name| (name, folder.read(name))).to_vec()
}

/// The commands that get a damaged copy of a seed, `bad.h5`.
fn commands(seed: &str) -> &'static [&'static str] {
    match seed {
        "reference.h5" => &[
            "inspect bad.h5",
            "inspect bad.h5 --json",
            "compare bad.h5 reference.h5",
            "compare reference.h5 bad.h5",
            "plot bad.h5 -o figures --force",
            "plot bad.h5 --html page.html --force",
            "run bad.h5 -o again.h5 --force -q",
            "run reference.h5 -o bad.h5 -q",
            "modes bad.h5",
        ],
        "1.h5" => &[
            "merge bad.h5 2.h5 -o merged.h5 --force",
            "inspect bad.h5",
            "sweep study.toml --shard 1/2 --resume -o bad.h5 -q",
        ],
        "sweep.h5" => &[
            "inspect bad.h5",
            "plot bad.h5 -o figures --force",
            "sweep study.toml --resume -o bad.h5 -q",
        ],
        _ => &["compare reference.h5 bad.h5"],
    }
}

/// Damages several copies of every seed, and gives each copy to `check` and to one of its commands. A case that fails
/// leaves its file in the temporary folder, and prints its number, with which [`damage`] can make the file again.
fn campaign(first: u64, cases: u64) {
    let folder = with_two_shards();
    let seeds = seeds(&folder);
    for case in first..first + cases {
        let (seed, sound) = &seeds[case as usize % seeds.len()];
        let mut dice = Random(case);
        let mut bad = sound.clone();
        damage(&mut bad, &mut dice);
        folder.write("bad.h5", &bad);
        let choices = commands(seed);
        let arguments = choices[dice.below(choices.len())];
        let survived = std::panic::catch_unwind(|| {
            if bad != *sound {
                // It never reports that all checksums of a damaged file agree.
                let (code, stdout, _) = survive(&folder.path(""), "check bad.h5");
                assert!(code != 0 || !stdout.contains("all checksums agree"), "case {case}");
            }
            survive(&folder.path(""), arguments)
        });
        if survived.is_err() {
            let kept = std::env::temp_dir().join(format!("stickslip-hostile-{case}.h5"));
            std::fs::write(&kept, &bad).unwrap();
            let kept = kept.display();
            panic!("case {case} of the campaign, a damaged {seed}, kept as {kept}");
        }
    }
}

/// `STICKSLIP_HOSTILE_CASES` sets the number of cases, `STICKSLIP_HOSTILE_FIRST` the first one.
#[test]
fn property_damaged_files_are_an_error_or_a_result() {
    let asked = |name: &str, otherwise| std::env::var(name).map_or(otherwise, |text| text.parse().unwrap());
    let (first, cases) = ("STICKSLIP_HOSTILE_FIRST", "STICKSLIP_HOSTILE_CASES");
    campaign(asked(first, 0), asked(cases, 20));
}
