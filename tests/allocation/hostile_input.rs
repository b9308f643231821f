//! A file that the program did not write yields an error or a result, and nothing else: no panic, no hang, no memory
//! out of all proportion.
//!
//! Seeds of every kind of text input are damaged at random, the same way every time, and read. `cargo test` takes a few
//! hundred of each; `STICKSLIP_HOSTILE=10000 cargo test --release --test allocation hostile_input -- --nocapture` takes
//! so many of each and prints what they came to; `STICKSLIP_HOSTILE_KIND=case` takes one kind alone. What such campaigns have found stands among the seeds.

use crate::common::random_brakes::Random;
use crate::common::unlocked;
use crate::counting::Watch;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::Instant;

use stickslip::Run;
use stickslip::analysis::work_precision;
use stickslip::calibrate::{CALIBRATIONS, CalibrationStudy};
use stickslip::case::{Case, CaseSource, Origin, Override, builtin};
use stickslip::compare::{Mapping, Reference};
use stickslip::results::merge;
use stickslip::sweep::{Existing, Journal, PointOutcome, QUANTITIES, STUDIES, Study, StudySource};

/// Files of each kind, unless the environment says how many.
const FILES: u64 = 300;

/// No file may take longer to read, s: a machine under load needs a hundredth of it.
const LONGEST: f64 = 10.0;

/// Longest search for a cause, s: some hundred runs of the reference.
const LONGEST_CAUSE: f64 = 60.0;

/// Nor more memory than this, bytes.
const MOST_MEMORY: usize = 1 << 30;

/// What people and other programs put where it does not belong.
const WORDS: &[&[u8]] = &[
    b"0",
    b"-1",
    b"1e308",
    b"-1e-308",
    b"5e-324",
    b"1e200",
    b"nan",
    b"inf",
    b"-inf",
    b"4294967295",
    b"9223372036854775807",
    b"18446744073709551616",
    b"true",
    b"\"\"",
    b"[]",
    b"{}",
    b"[[",
    b"]]",
    b"=",
    b".",
    b",",
    b";",
    b"#",
    b"\"",
    b"'",
    b"\n",
    b"\r\n",
    b"\0",
    b"\x1b[2J",
    b"m s\xb2",
    b"\xff\xfe",
    b"\xe2\x80\xae",
    b"%b",
    b"/dev/zero",
    b"/etc/passwd",
    b"..",
    b" m",
    b"1e-12",
    b"100000000",
];

/// One seed with some damage.
fn damaged(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut bytes = seeds[random.below(seeds.len())].clone();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len() + 1);
        let length = random.below(40).min(bytes.len() - at);
        match random.below(9) {
            0 => bytes.truncate(at),
            1 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            2 if at < bytes.len() => bytes[at] = random.bits() as u8,
            3 => drop(bytes.drain(at..at + length)),
            4 => {
                let most = if random.below(50) == 0 { 5000 } else { 3 };
                let again = bytes[at..at + length].repeat(1 + random.below(most));
                bytes.splice(at..at, again);
            }
            5 => drop(bytes.splice(at..at, WORDS[random.below(WORDS.len())].iter().copied())),
            6 => drop(bytes.splice(at..at + length, WORDS[random.below(WORDS.len())].iter().copied())),
            // A value of a text, up to the end of its line.
            7 => {
                let places: Vec<usize> = (0..bytes.len())
                    .filter(|&k| bytes[k] == b'=' || bytes[k] == b',')
                    .collect();
                if !places.is_empty() {
                    let from = places[random.below(places.len())] + 1;
                    let stop = |byte: &u8| matches!(byte, b'\n' | b',' | b']' | b'}');
                    let to = bytes[from..].iter().position(stop).map_or(bytes.len(), |k| from + k);
                    bytes.splice(from..to, WORDS[random.below(WORDS.len())].iter().copied());
                }
            }
            _ => {
                let other = &seeds[random.below(seeds.len())];
                let from = random.below(other.len());
                let to = (from + random.below(200)).min(other.len());
                bytes.splice(at..at, other[from..to].iter().copied());
            }
        }
    }
    bytes
}

/// Reads damaged files of one kind by `read`, which says whether the file was refused.
fn campaign(kind: &str, seeds: &[Vec<u8>], read: impl Fn(&[u8]) -> Result<(), String>) {
    if std::env::var("STICKSLIP_HOSTILE_KIND").is_ok_and(|only| only != kind) {
        return;
    }
    let files = std::env::var("STICKSLIP_HOSTILE").map_or(FILES, |count| count.parse().expect("a number of files"));
    // Left behind by a crash.
    let kept = std::env::temp_dir().join(format!("stickslip-hostile-{kind}-{}", std::process::id()));
    let (mut refused, mut longest, mut peak) = (0, (0.0_f64, 0), 0);
    for number in 0..files + seeds.len() as u64 {
        let bytes = match seeds.get(number as usize) {
            Some(seed) => seed.clone(),
            None => damaged(seeds, &mut Random(number)),
        };
        std::fs::write(&kept, &bytes).unwrap();
        let (clock, watch) = (Instant::now(), Watch::start());
        let result = catch_unwind(AssertUnwindSafe(|| read(&bytes)));
        let (seconds, memory) = (clock.elapsed().as_secs_f64(), watch.most());
        let case = || format!("{kind} {number}, kept as {}", kept.display());
        let Ok(result) = result else {
            panic!("{}: panicked", case());
        };
        if let Err(message) = result {
            refused += 1;
            assert!(!message.is_empty(), "{}", case());
        }
        let most = if is_to_be_explained(&bytes) {
            LONGEST_CAUSE
        } else {
            LONGEST
        };
        assert!(seconds < most, "{}: {seconds} s", case());
        assert!(memory < MOST_MEMORY, "{}: {memory} bytes", case());
        if seconds > longest.0 {
            longest = (seconds, number);
        }
        peak = peak.max(memory);
    }
    std::fs::remove_file(&kept).unwrap();
    println!(
        "{kind}: {files} files, {refused} refused, at most {:.2} s (number {}) and {:.1} MB",
        longest.0,
        longest.1,
        peak as f64 / 1e6
    );
}

fn texts(texts: &[&str]) -> Vec<Vec<u8>> {
    texts.iter().map(|text| text.as_bytes().to_vec()).collect()
}

/// One after the other, as they share the count of memory.
#[test]
fn property_hostile_files_are_refused_or_read() {
    cases();
    studies();
    tables();
    archives();
    mappings();
    journals();
    shards();
}

/// A case is read, and if it is valid run for a moment.
fn cases() {
    let mut seeds: Vec<Vec<u8>> = builtin::CASES
        .iter()
        .map(|case| case.text.as_bytes().to_vec())
        .collect();
    let paper = builtin::CASES[0].text;
    // Found: an inertia beyond doubles panicked, and such speeds stood still or gave nothing but NaN.
    for damage in [
        "[torsion]\nrotor_inertia = 5e-324\n",
        "[initial]\nspeed = 1e200\n",
        "[initial]\nspeed = 1e-300\n",
    ] {
        let (table, line) = damage.split_once('\n').unwrap();
        let key = line.split_once(" =").unwrap().0;
        let lines = paper
            .lines()
            .map(|old| if old.starts_with(key) { line.trim_end() } else { old });
        assert!(paper.contains(table));
        seeds.push(lines.collect::<Vec<_>>().join("\n").into_bytes());
    }
    let limits: Vec<Override> = ["solver.max_steps=1000", "solver.max_wall_time=2"]
        .map(|text| Override::parse(text).unwrap())
        .into();
    campaign("case", &seeds, |bytes| {
        let text = String::from_utf8(bytes.to_vec()).map_err(|error| error.to_string())?;
        let source = CaseSource {
            text,
            origin: Origin::File(PathBuf::from("hostile.toml")),
        };
        let mut case = Case::read(&source, &limits).map_err(|error| error.to_string())?;
        // Samples by the million are meant by whoever asks for them.
        case.output.interval = case.output.interval.max(case.output.end_time / 1e5);
        case.output.windows.clear();
        let run = Run::new(&case).start();
        run.map(drop).map_err(|failure| failure.to_string())
    });
}

fn studies() {
    let mut seeds = texts(&[
        "title = \"a grid\"\ncase = \"paper\"\n[set]\ninitial.speed = \"900 rpm\"\n[[axis]]\nkey = \"friction.decay\"\n\
         values = [1, 2, 3]\n[[axis]]\nkey = [\"torsion.damping\"]\nfrom = 10\nto = 20\ncount = 5\nspacing = \"log\"\n\
         [keep]\nevents = true\n",
        "case = \"paper-si\"\n[sample]\nmethod = \"latin-hypercube\"\ncount = 20\nseed = 3\n[[axis]]\nkey = \"friction.decay\"\n\
         from = 1\nto = 5\n[[axis]]\nkey = \"solver.method\"\nvalues = [\"auto\", \"series\"]\n",
        "case = \"paper\"\n[sample]\nmethod = \"sobol\"\ncount = 100000000\n[[axis]]\nkey = \"friction.decay\"\nfrom = 1\nto = 5\n",
        "case = \"paper\"\n[sample]\nmethod = \"latin-hypercube\"\ncount = 100000000\n[[axis]]\nkey = \"friction.decay\"\n\
         from = 1\nto = 5\n",
        "case = \"paper\"\npoints = \"/dev/zero\"\n",
        "case = \"paper\"\npoints = \"/etc/passwd\"\n",
    ]);
    seeds.extend(STUDIES.iter().map(|study| study.text.as_bytes().to_vec()));
    seeds.extend(CALIBRATIONS.iter().map(|study| study.text.as_bytes().to_vec()));
    seeds.extend(
        work_precision::STUDIES
            .iter()
            .map(|study| study.text.as_bytes().to_vec()),
    );
    // Found: tens of thousands of runs, each a case to be read.
    let many = format!(
        "case = \"paper\"\n[[series]]\nmethods = [\"auto\", \"erk\", \"series\"]\ntolerances = [1e-4{}]\n",
        ", 1e-5".repeat(13_000)
    );
    let refusal = work_precision::PrecisionStudy::parse(StudySource::text("hostile", &many)).unwrap_err();
    assert!(refusal.to_string().contains("more than 10000 runs"), "{refusal}");
    seeds.push(many.into_bytes());
    campaign("study", &seeds, |bytes| {
        let text = String::from_utf8(bytes.to_vec()).map_err(|error| error.to_string())?;
        let source = StudySource::text("hostile", &text);
        let sweep = Study::parse(source.clone(), &[]).map(drop);
        let calibration = CalibrationStudy::parse(source.clone(), &[]).map(drop);
        let precision = work_precision::PrecisionStudy::parse(source).map(drop);
        sweep.or(calibration).or(precision).map_err(|error| error.to_string())
    });
}

/// A short run to hold tables against.
fn reference() -> (tempfile::TempDir, Reference) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("reference.h5");
    crate::common::compare::run(
        &path,
        "release",
        &["output.window=[]", "output.around=none", "output.interval=1e-3"],
    );
    let reference = Reference::open(&path).unwrap();
    (folder, reference)
}

/// Rows of a candidate that has nothing to do with the reference.
fn rows() -> impl Iterator<Item = [f64; 3]> {
    (0..200).map(|k| {
        let t = f64::from(k) * 6e-3;
        [t, 1.0 - t, 1e-4 * t]
    })
}

/// Whether a cause is sought of a file of this content. What a file says is read from all of them; a cause, which takes
/// seconds, is sought for one in sixteen.
fn is_to_be_explained(bytes: &[u8]) -> bool {
    bytes.len().is_multiple_of(16)
}

fn mapping_of(bytes: &[u8]) -> Mapping {
    Mapping {
        quick: !is_to_be_explained(bytes),
        ..Mapping::default()
    }
}

fn compared(reference: &Reference, folder: &tempfile::TempDir, name: &str, bytes: &[u8]) -> Result<(), String> {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let compared = reference.compare(&path, &mapping_of(bytes));
    compared.map(drop).map_err(|error| error.to_string())
}

fn tables() {
    let (folder, reference) = reference();
    let mut table = "time [s],relative_velocity [rad/s],rotor_twist\n".to_owned();
    let mut blanks = "# t w\n".to_owned();
    for [t, w, u] in rows() {
        table += &format!("{t},{w},{u}\n");
        blanks += &format!("{t}  {w}\n");
    }
    let events = "time,kind\n0.1,stick\n0.2,slip\n0.3,separation\n".to_owned();
    // Found: a unit of 5 kB took four seconds.
    let unit = table.replace("[s]", &format!("[{}]", "N m ".repeat(1300)));
    let seeds = texts(&[&table, &blanks, &events, &unit]);
    campaign("csv", &seeds, |bytes| {
        compared(&reference, &folder, "hostile.csv", bytes)
    });
}

/// One array as NumPy writes it.
fn npy(version: u8, shape: &str, values: &[f64]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    match version {
        1 => bytes.extend((header.len() as u16).to_le_bytes()),
        _ => bytes.extend((header.len() as u32).to_le_bytes()),
    }
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes
}

fn archive(members: &[(&str, Vec<u8>)], method: zip::CompressionMethod) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in members {
        let options = zip::write::SimpleFileOptions::default().compression_method(method);
        archive.start_file(format!("{name}.npy"), options).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

fn archives() {
    use zip::CompressionMethod::{Deflated, Stored};
    let (folder, reference) = reference();
    let [t, w]: [Vec<f64>; 2] = std::array::from_fn(|k| rows().map(|row| row[k]).collect());
    let whole = [
        ("time", npy(1, "(200,)", &t)),
        ("relative_velocity", npy(1, "(200,)", &w)),
    ];
    let wrapping = [
        ("time", npy(1, "(4294967296, 4294967296)", &t)),
        ("relative_velocity", npy(1, "(200,)", &w)),
    ];
    let mut endless = npy(2, "(200,)", &t);
    endless[8..12].fill(0xff);
    let endless = [("time", endless), ("relative_velocity", npy(2, "(200,)", &w))];
    let seeds = [&whole, &wrapping, &endless];
    let seeds: Vec<Vec<u8>> = seeds
        .iter()
        .flat_map(|members| [archive(&members[..], Stored), archive(&members[..], Deflated)])
        .collect();
    for bytes in &seeds[2..] {
        let refusal = compared(&reference, &folder, "hostile.npz", bytes).unwrap_err();
        assert!(refusal.contains("time"), "{refusal}");
    }
    // Records in records, and an array in the other order.
    let record = "[('a', '<f8'), ('b', [('c', '<i4'), ('d', '|u1')], (2, 3)), (('t', 'x'), '|b1')]";
    let mut seeds = seeds;
    let text = |array: Vec<u8>, from: &str, to: &str| {
        let header = String::from_utf8(array[10..array.len() - 1600].to_vec())
            .unwrap()
            .replace(from, to);
        let length = (header.len() as u16).to_le_bytes();
        [&array[..8], &length, header.as_bytes(), &array[array.len() - 1600..]].concat()
    };
    let other = [
        ("time", text(npy(1, "(200, 1)", &t), "False", "True")),
        ("relative_velocity", npy(3, "(200,)", &w)),
        ("phi1", text(npy(1, "(2,)", &w), "'<f8'", record)),
    ];
    compared(&reference, &folder, "hostile.npz", &archive(&other, Stored)).unwrap();
    seeds.push(archive(&other, Stored));
    flipped_bits(&reference, &folder);
    // A last member that says it unpacks to 4 GB less two bytes, with what the first has taken too much.
    let mut bomb = archive(&whole, Deflated);
    // Its size stands in the directory and in front of the member.
    for (header, size) in [(b"PK\x01\x02", 24), (b"PK\x03\x04", 22)] {
        let at = bomb.windows(4).rposition(|bytes| bytes == header).unwrap() + size;
        bomb[at..at + 4].copy_from_slice(&0xFFFF_FFFE_u32.to_le_bytes());
    }
    let refusal = compared(&reference, &folder, "hostile.npz", &bomb).unwrap_err();
    assert!(refusal.contains("more than 4 GB"), "{refusal}");
    campaign("npz", &seeds, |bytes| {
        compared(&reference, &folder, "hostile.npz", bytes)
    });
    // A damaged archive is refused by its checksums: an array is damaged before it is put into one, too.
    let arrays: Vec<Vec<u8>> = other.iter().map(|(_, array)| array.clone()).collect();
    campaign("npy", &arrays, |bytes| {
        let members = [whole[0].clone(), whole[1].clone(), ("phi1", bytes.to_vec())];
        // Most have other numbers alone, whose cause is not sought.
        let path = folder.path().join("hostile.npz");
        std::fs::write(&path, archive(&members, Stored)).unwrap();
        let mapping = Mapping {
            quick: true,
            ..Mapping::default()
        };
        let compared = reference.compare(&path, &mapping);
        compared.map(drop).map_err(|error| error.to_string())
    });
}

/// Every single bit of a small archive. Most of those that are accepted are dates, permissions and versions, of which nothing is read.
fn flipped_bits(reference: &Reference, folder: &tempfile::TempDir) {
    use zip::CompressionMethod::{Deflated, Stored};
    let quick = Mapping {
        quick: true,
        ..Mapping::default()
    };
    let outcome = |bytes: &[u8]| {
        let path = folder.path().join("flipped.npz");
        std::fs::write(&path, bytes).unwrap();
        let compared = reference.compare(&path, &quick).map_err(|error| error.to_string())?;
        Ok::<String, String>(format!("{compared:?}"))
    };
    let columns = ["time", "relative_velocity", "phi1"].map(|name| {
        let values: Vec<f64> = (1..6).map(|k| 0.01 * f64::from(k)).collect();
        (name, npy(1, "(5,)", &values))
    });
    for method in [Stored, Deflated] {
        let mut bytes = archive(&columns, method);
        let sound = outcome(&bytes).unwrap();
        for bit in 0..8 * bytes.len() {
            bytes[bit / 8] ^= 1 << (bit % 8);
            match outcome(&bytes) {
                Ok(compared) => assert_eq!(compared, sound, "{method}: bit {bit} changes what is read"),
                Err(refusal) => assert!(refusal.contains("flipped.npz"), "{refusal}"),
            }
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

fn mappings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hostile.toml");
    let seeds = texts(&[
        "time = { name = \"t\", unit = \"ms\" }\n[channels]\nrelative_velocity = \"w\"\nrotor_twist = { name = \"u\", unit = \
         \"urad\" }\n[events]\ntime = \"te\"\nkind = \"what\"\n[events.kinds]\nS = \"stick\"\n[detection]\n\
         velocity_tolerance = 1e-9\nhysteresis = 3\n",
    ]);
    campaign("mapping", &seeds, |bytes| {
        std::fs::write(&path, bytes).unwrap();
        Mapping::default()
            .with_file(&path)
            .map(drop)
            .map_err(|error| error.to_string())
    });
}

fn journals() {
    const DIGEST: &str = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hostile.journal");
    let outcomes: Vec<PointOutcome> = (0..8)
        .map(|number| PointOutcome {
            // Found: memory was asked for by the largest number.
            number: if number == 7 { 1 << 60 } else { number },
            result: match number % 3 {
                0 => Err(format!("point {number} failed")),
                _ => Ok(vec![0.5; QUANTITIES.len()]),
            },
            events: Vec::new(),
        })
        .collect();
    let mut journal = Journal::open(&path, DIGEST, Existing::Discard).unwrap();
    journal.append(&outcomes).unwrap();
    drop(journal);
    let seeds = [std::fs::read(&path).unwrap()];
    campaign("journal", &seeds, |bytes| {
        std::fs::write(&path, bytes).unwrap();
        let mut journal = Journal::open(&path, DIGEST, Existing::Resume).map_err(|error| error.to_string())?;
        let mut found = 0;
        for number in (0..8).chain([1 << 60, u64::MAX]) {
            found += u64::from(journal.read(number).map_err(|error| error.to_string())?.is_some());
        }
        assert!(found <= journal.points());
        Ok(())
    });
}

/// What a shard says of its study, by which `merge` makes the whole: the attributes of its root.
fn shards() {
    const STUDY: &str = "case = \"paper\"\n[set]\noutput.end_time = 0.005\n[[axis]]\nkey = \"torsion.damping\"\nvalues = [20, \
                         21]\n[[axis]]\nkey = \"solver.method\"\nvalues = [\"series\", \"auto\"]\n";
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("study.toml"), STUDY).unwrap();
    for shard in ["1", "2"] {
        let (part, file) = (format!("{shard}/2"), format!("{shard}.h5"));
        let swept = std::process::Command::new(env!("CARGO_BIN_EXE_stickslip"))
            .args(["sweep", "study.toml", "-q", "--shard", &part, "-o", &file])
            .current_dir(folder.path())
            .status();
        assert!(swept.unwrap().success());
    }
    let whole = std::fs::read(path("1.h5")).unwrap();
    let names = [
        "shard",
        "shard_count",
        "study_shape",
        "study_layout",
        "study_axes",
        "study_variables",
        "study_meta",
        "digest",
        "title",
        "format",
        "source",
    ];
    // One of them a file: its name, and then its value.
    let seeds: Vec<Vec<u8>> = {
        let file = unlocked::open_rw(path("1.h5")).unwrap();
        let seed = |name: &&str| {
            let attribute = file.attr(name).ok()?;
            let value = match attribute.read_raw::<i64>() {
                Ok(numbers) => numbers.iter().map(|number| format!("{number} ")).collect(),
                Err(_) => attribute
                    .read_scalar::<hdf5::types::VarLenUnicode>()
                    .ok()?
                    .as_str()
                    .to_owned(),
            };
            Some(format!("{name}\n{value}").into_bytes())
        };
        names.iter().filter_map(seed).collect()
    };
    assert!(seeds.len() >= 8, "{}", seeds.len());
    campaign("shard", &seeds, |bytes| {
        let text = String::from_utf8_lossy(bytes).replace('\0', " ");
        let (name, value) = text.split_once('\n').unwrap_or(("", &text));
        let name = names
            .into_iter()
            .find(|known| *known == name)
            .unwrap_or(names[bytes.len() % names.len()]);
        std::fs::write(path("bad.h5"), &whole).unwrap();
        {
            let file = unlocked::open_rw(path("bad.h5")).unwrap();
            let numbers: Result<Vec<i64>, _> = value.split_whitespace().map(str::parse).collect();
            let _ = file.delete_attr(name);
            match numbers {
                Ok(numbers) if name == "study_shape" => {
                    file.new_attr_builder().with_data(&numbers[..]).create(name).unwrap();
                }
                Ok(numbers) if numbers.len() == 1 => {
                    file.new_attr::<i64>()
                        .create(name)
                        .unwrap()
                        .write_scalar(&numbers[0])
                        .unwrap();
                }
                // More does not fit into an attribute of HDF5.
                _ => {
                    let short: String = value.chars().take(10_000).collect();
                    let short: hdf5::types::VarLenUnicode = short.parse().unwrap();
                    let made = file.new_attr::<hdf5::types::VarLenUnicode>().create(name);
                    made.unwrap().write_scalar(&short).unwrap();
                }
            }
        }
        let _ = std::fs::remove_file(path("merged.h5"));
        let merged = merge(&[path("bad.h5"), path("2.h5")], &path("merged.h5"), false);
        merged.map(drop).map_err(|error| error.to_string())
    });
}
