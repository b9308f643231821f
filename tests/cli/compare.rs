//! `stickslip compare` from the user's side: formats, mappings, reports, requirements, and unusable files.

use crate::common::cli::{Folder, output, refusal, says, text};
use crate::common::compare::{csv, events_csv, paper, rows_of, word_of};
use crate::common::json::*;
use crate::common::rows;
use crate::common::unlocked::{self, store};
use std::io::Write;

pub fn with_reference() -> Folder {
    let folder = Folder::new();
    std::fs::copy(paper(), folder.path("paper.h5")).unwrap();
    folder
}

/// The samples of the reference from the kick on.
fn series() -> String {
    csv(&rows_of(paper(), 6.966))
}

pub fn compared(folder: &Folder, arguments: &[&str]) -> serde_json::Value {
    let all = [&["compare", "paper.h5"], arguments].concat();
    folder.json(&all)["comparisons"][0].clone()
}

pub fn agrees(c: &serde_json::Value) {
    let found = (&c["missing"], &c["spurious"]);
    assert_eq!(found, (&0.into(), &0.into()), "{}", c["verdict"]);
    assert_eq!(c["event_errors"]["matched"], 95, "{}", c["verdict"]);
}

/// Writes an NPZ archive, with or without compression.
fn npz(path: &std::path::Path, arrays: &[(&str, Vec<f64>)], compressed: bool) {
    let bytes = |values: &Vec<f64>| values.iter().flat_map(|value| value.to_le_bytes()).collect();
    let array = |(name, values): &(&str, Vec<f64>)| (name.to_string(), "'<f8'", vec![values.len()], bytes(values));
    npz_of(path, &arrays.iter().map(array).collect::<Vec<_>>(), compressed);
}

/// An array of an archive: name, type, shape and values.
type OfArchive<'a> = (String, &'a str, Vec<usize>, Vec<u8>);

/// Like [`npz`], for arrays of any type.
fn npz_of(path: &std::path::Path, arrays: &[OfArchive<'_>], compressed: bool) {
    let mut archive = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    let method = match compressed {
        true => zip::CompressionMethod::Deflated,
        false => zip::CompressionMethod::Stored,
    };
    let options = zip::write::SimpleFileOptions::default().compression_method(method);
    for (name, kind, shape, values) in arrays {
        archive.start_file(format!("{name}.npy"), options).unwrap();
        let shape: String = shape.iter().map(|n| format!("{n},")).collect();
        let mut header = format!("{{'descr': {kind}, 'fortran_order': False, 'shape': ({shape}), }}");
        while (header.len() + 11) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        archive.write_all(b"\x93NUMPY\x01\x00").unwrap();
        archive.write_all(&(header.len() as u16).to_le_bytes()).unwrap();
        archive.write_all(header.as_bytes()).unwrap();
        archive.write_all(values).unwrap();
    }
    archive.finish().unwrap();
}

#[test]
fn cli_every_format_is_read() {
    let folder = with_reference();
    let rows = rows_of(paper(), 6.966);
    let time: Vec<f64> = rows.iter().map(|row| row.0).collect();
    let velocity: Vec<f64> = rows.iter().map(|row| row.1[5]).collect();

    // Also as numpy.savetxt writes it by default, and as programs that align columns write it.
    let numbers = series().split_once('\n').unwrap().1.replace(',', " ");
    let header = format!("# time,{}\n", crate::common::compare::NAMES.join(","));
    let mut latin = b"# Gr\xf6\xdfen\n".to_vec();
    latin.extend(series().bytes());
    let spread = series().replace(',', "   ").replace('\n', "\n  ");
    for (name, text) in [
        ("series.csv", series().into_bytes()),
        (
            "semicolons.csv",
            format!("# a comment\n{}", series().replace(',', ";")).into_bytes(),
        ),
        ("savetxt.txt", format!("# a comment\n{header}{numbers}").into_bytes()),
        ("aligned.txt", format!("  {spread}").into_bytes()),
        ("latin.csv", latin),
    ] {
        folder.write(name, text);
        agrees(&compared(&folder, &[name]));
    }
    folder.write("events.csv", events_csv(&word_of(paper())));
    let c = compared(&folder, &["events.csv"]);
    agrees(&c);
    let found = (c["format"].as_str(), c["event_errors"]["max"].as_f64());
    assert_eq!(found, (Some("events table"), Some(0.0)));
    let c = compared(&folder, &["series.csv", "--events", "events.csv"]);
    let found = (&c["detection"], c["event_errors"]["max"].as_f64());
    assert_eq!(found, (&serde_json::Value::Null, Some(0.0)));

    for compressed in [false, true] {
        let arrays = [("t", time.clone()), ("omega_r", velocity.clone())];
        npz(&folder.path("series.npz"), &arrays, compressed);
        agrees(&compared(&folder, &["series.npz"]));
    }

    // Names of events in HDF5, as h5py writes a list of texts.
    let word = word_of(paper());
    let file = unlocked::create(folder.path("named.h5")).unwrap();
    let times: Vec<f64> = word.iter().map(|event| event.0).collect();
    let unicode = |text: &String| text.parse::<hdf5::types::VarLenUnicode>().unwrap();
    let texts: Vec<_> = word.iter().map(|event| unicode(&event.1)).collect();
    let group = file.create_group("events").unwrap();
    store(&group, "time", &times);
    store(&group, "kind", &texts);
    drop((group, file));
    let c = compared(&folder, &["named.h5"]);
    agrees(&c);
    assert_eq!(c["event_errors"]["max"], 0.0);

    let file = unlocked::create(folder.path("other.h5")).unwrap();
    let group = file.create_group("run/3").unwrap();
    store(&group, "clock", &time);
    // As solve_ivp stores it, one component in each row; and as most other programs do.
    let values = rows.iter().map(|row| row.1[4]);
    let flat: Vec<f64> = values.chain(velocity.iter().copied()).collect();
    let flat = ndarray::Array2::from_shape_vec((2, time.len()), flat).unwrap();
    store(&group, "y", flat.view());
    let transposed = flat.t();
    let rows_of_file = transposed.as_standard_layout();
    store(&group, "table", rows_of_file.view());
    drop((group, file));
    for slice in ["run/3/y[1]", "y[1,:]", "table[1]", "run/3/table[:,1]"] {
        let column = format!("relative_velocity={slice}:rad/s");
        let options = ["other.h5", "--column", "time=clock", "--column", &column];
        agrees(&compared(&folder, &options));
    }
}

/// The bar is on standard error if it is requested, and names the candidate. It ends with the pass over the states.
#[test]
fn cli_compare_has_a_progress_bar() {
    let folder = with_reference();
    std::fs::copy(paper(), folder.path("mine.h5")).unwrap();
    for (choice, shown) in [("always", true), ("auto", false), ("never", false)] {
        let (stdout, stderr) = folder.ends(&["compare", "paper.h5", "mine.h5", "--progress", choice], 0);
        assert_eq!(stderr.contains("mine.h5: states, t = "), shown, "{choice}: {stderr}");
        assert!(!stdout.contains("states, t = "), "{choice}");
    }
}

#[test]
fn cli_names_and_units_come_from_a_mapping_or_from_headers() {
    let folder = with_reference();
    let rows = rows_of(paper(), 6.966);
    let rpm = 30.0 / std::f64::consts::PI;
    let mut text = "ms,w (rpm)\n".to_owned();
    let mut headed = "time [ms],relative_velocity [rpm]\n".to_owned();
    for (time, values) in &rows {
        let line = format!("{:?},{:?}\n", 1e3 * time, rpm * values[5]);
        text += &line;
        headed += &line;
    }
    folder.write("mine.csv", &text);
    folder.write("headed.csv", headed);
    agrees(&compared(&folder, &["headed.csv"]));
    let columns = ["mine.csv", "--column", "time=ms:ms", "--column", "relative_velocity=w"];
    agrees(&compared(&folder, &columns));
    let map = "time = { name = \"ms\", unit = \"ms\" }\n[channels]\nrelative_velocity = { name = \"w\", unit = \"rpm\" }\n\
               [detection]\nvelocity_tolerance = \"1e-7 rad/s\"\nhysteresis = 3\n";
    folder.write("map.toml", map);
    let c = compared(&folder, &["mine.csv", "--map", "map.toml"]);
    agrees(&c);
    assert_eq!(c["detection"]["velocity_tolerance"], 1e-7);
    assert_eq!(c["detection"]["hysteresis"], 3.0);
    // The opposite sign, with and without a unit, and of a column whose own unit is read.
    let flipped = |name: &str, factor: f64| {
        let line = |(time, values): &(f64, [f64; 6])| format!("{time:?},{:?}\n", -factor * values[5]);
        let lines: String = rows.iter().map(line).collect();
        folder.write(&format!("{name}.csv"), format!("time,{name}\n{lines}"));
    };
    flipped("w", 1.0);
    flipped("v [rpm]", rpm);
    for (file, column) in [("w", "-w"), ("w", "-w:rad/s"), ("v [rpm]", "- v")] {
        let option = format!("relative_velocity={column}");
        agrees(&compared(&folder, &[&format!("{file}.csv"), "--column", &option]));
    }
    let sign = "channels.relative_velocity = { name = \"-w\", unit = \"rad/s\" }\n";
    folder.write("sign.toml", sign);
    agrees(&compared(&folder, &["w.csv", "--map", "sign.toml"]));
    folder.write("kinds.csv", "time,kind\n6.975001494461,0\n6.975049781418,free\n");
    folder.write("kinds.toml", "[events.kinds]\nfree = \"slip\"\n");
    let c = compared(&folder, &["kinds.csv", "--map", "kinds.toml", "--quick"]);
    assert_eq!((&c["missing"], &c["spurious"]), (&93.into(), &0.into()));
}

#[test]
fn cli_requirements_make_a_gate() {
    let folder = with_reference();
    folder.write("series.csv", series());
    let require = |requirements: &str, status: i32| {
        let mut all = vec!["compare", "paper.h5", "series.csv", "-q"];
        requirements.split(' ').for_each(|one| all.extend(["--require", one]));
        folder.ends(&all, status)
    };
    require("onset<1e-6 missing<=0 events<1e-6 scd>=2", 0);
    require(
        "score_position<1e-3 score_period<1e-6 score_rest<1e-3 score_creep<1e-6",
        0,
    );
    let (_, stderr) = require("score_position<0", 1);
    assert!(stderr.contains("score_position<0"), "{stderr}");
    let (stdout, stderr) = require("onset<1e-6 onset<0 scd>17", 1);
    assert_eq!(stdout, "");
    says(&stderr, "onset<0 & scd>17");
    assert!(!stderr.contains("onset<1e-6"), "{stderr}");
    for wrong in ["onset", "onset<", "onset<x", "nonsense<1", "onset=1"] {
        folder.refused(&["compare", "paper.h5", "series.csv", "--require", wrong], &[wrong]);
    }
}

/// Times that the candidate does not cover are neither right nor wrong.
#[test]
fn cli_requirements_are_not_met_by_what_is_not_covered() {
    let folder = with_reference();
    let lines = |from: f64, to: f64| {
        let line = |k: u32| format!("{},1.0\n", from + (to - from) * f64::from(k) / 50.0);
        format!("time,relative_velocity\n{}", (0..50).map(line).collect::<String>())
    };
    folder.write("before.csv", lines(0.0, 1.0));
    folder.write("after.csv", lines(50.0, 60.0));
    for name in ["before.csv", "after.csv"] {
        let c = compared(&folder, &[name, "--quick"]);
        assert_eq!((&c["reference_events"], &c["uncovered"]), (&0.into(), &95.into()));
        says(c["verdict"].text(), "covers none of the reference's 95 events");
        for metric in "missing<=0 spurious<=0 uncovered<=0 events<1 onset<1 sticks<=0 last_period<1".split(' ') {
            let arguments = ["compare", "paper.h5", name, "-q", "--quick", "--require", metric];
            let (_, stderr) = folder.ends(&arguments, 1);
            assert!(stderr.contains(metric), "{stderr}");
        }
    }
    let rows: Vec<_> = rows_of(paper(), 6.966).into_iter().filter(|row| row.0 < 6.98).collect();
    folder.write("half.csv", csv(&rows));
    let half = |metric: &str, status: i32| {
        let arguments = ["compare", "paper.h5", "half.csv", "--require", metric];
        folder.ends(&arguments, status).0
    };
    let stdout = half("missing<=0", 0);
    assert!(stdout.contains(" of 95 events."), "{stdout}");
    half("onset<1e-6", 0);
    half("uncovered<=0", 1);
    half("final_stick<1", 1);
}

/// A pipe whose other end nobody opens does not block the command.
#[cfg(unix)]
#[test]
fn regression_a_report_waits_for_no_pipe() {
    let folder = Folder::new();
    folder.pipe("report.md");
    for force in [None, Some("--force")] {
        let arguments = ["compare", "none.h5", "none.csv", "--report", "report.md"];
        let refused = refusal(folder.stickslip(&arguments).args(force));
        says(&refused, &["a pipe or a device", "another name with --report"]);
    }
}

#[test]
fn cli_reports_are_written_and_nothing_else_is_replaced() {
    let folder = with_reference();
    // The name of a file cannot become markup.
    let candidate = "a&b<img>|c\n# d.csv";
    folder.write(candidate, events_csv(&word_of(paper())));
    for name in ["report.html", "report.md"] {
        folder.ok(&["compare", "paper.h5", candidate, "-q", "--report", name]);
        let text = folder.text(name);
        says(&text, &["the event sequences agree", "final stick"]);
        // The report contains every event. It also replaces an earlier report.
        assert!(text.matches("slip").count() > 47);
        let printed = folder.ok(&["compare", "paper.h5", candidate, "--report", name]);
        assert!(printed.lines().any(|line| line == name), "{printed}");
    }
    let html = folder.text("report.html");
    assert!(html.contains("a&amp;b&lt;img&gt;|c") && !html.contains("<img") && !html.contains("http"));
    let markdown = folder.text("report.md");
    assert!(markdown.contains("b\\<img\\>\\|c"), "{markdown}");
    assert!(!markdown.contains("\n# d"), "{markdown}");
    folder.write("mine.md", "my notes");
    for (name, words) in [
        ("mine.md", "--force"),
        ("report.pdf", ".html or .md"),
        ("nowhere/report.md", "folder"),
    ] {
        folder.refused(&["compare", "paper.h5", candidate, "--report", name], words);
    }
    assert_eq!(folder.text("mine.md"), "my notes");
}

#[test]
fn cli_malformed_candidates_are_refused_with_place_and_remedy() {
    let folder = with_reference();
    let good = "time,relative_velocity\n0.0,1.0\n0.1,0.9\n0.2,0.8\n";
    let line = |n: usize, new: &str| {
        let mut lines: Vec<&str> = good.lines().collect();
        lines[n - 1] = new;
        lines.join("\n") + "\n"
    };
    let refused = |name: &str, text: String, words: &str| {
        folder.write(name, text);
        let error = folder.refused(&["compare", "paper.h5", name], words);
        says(&error, name);
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    };
    for [name, number, new, words] in rows(
        r#"
        ragged.csv      | 3 | 0.1                        | line 3 & 1 fields & 2
        nan.csv         | 3 | 0.1,nan                    | row 1 & relative_velocity & NaN
        words.csv       | 4 | 0.2,fast                   | line 4 & fast & 1.5e-3
        decreasing.csv  | 4 | 0.05,0.8                   | row 2 & 0.05 & 0.1 & sort
        no-time.csv     | 1 | a,relative_velocity        | times & --column time=NAME
        no-velocity.csv | 1 | time,theta_dot             | relative velocity & phi1_dot
        nothing.csv     | 1 | time,speeed                | speeed & --column
        unit.csv        | 1 | time,relative_velocity [N] | unit & N & --column
        units.csv       | 1 | phi1 [rad],phi1 [deg]      | line 1 & columns 1 and 2 & "phi1"
        alias.csv       | 1 | omega_r,relative_velocity  | relative_velocity, omega_r & --column relative_velocity=NAME
        letters.csv     | 1 | TIME,Time                  | no column is known & TIME, Time
    "#,
    ) {
        refused(name, line(number.parse().unwrap(), new), words);
    }
    let same_names = line(1, "relative_velocity,relative_velocity");
    let twice = "line 3 & columns 1 and 2 & \"relative_velocity\" & a name of its own";
    refused("twice.csv", format!("\n# a note\n{same_names}"), twice);
    refused("empty.csv", String::new(), "no line of data");
    for (name, text, words) in [
        ("header.csv", "time,relative_velocity\n", "no samples"),
        (
            "events.csv",
            "time,kind\n1.0,stick\n2.0,jump\n",
            "row 1 & jump & events.kinds",
        ),
        ("order.csv", "time,kind\n2.0,stick\n1.0,slip\n", "row 1 & sort"),
        (
            "twice.txt",
            "# time phi1 phi1\n0.0 1.0 2.0\n0.1 0.9 1.0\n",
            "line 1 & columns 2 and 3 & \"phi1\"",
        ),
        (
            "times.csv",
            "time,t,relative_velocity\n0.0,0.0,1.0\n",
            "several & time, t & --column time=NAME",
        ),
        ("binary.csv", "\0\0\u{1}\0", "HDF5, NPZ or CSV"),
        ("false.npz", "PK not really", "NPZ & numpy.savez"),
    ] {
        refused(name, text.to_owned(), words);
    }
}

#[test]
fn cli_damaged_files_are_refused() {
    let folder = with_reference();
    let whole = folder.read("paper.h5");
    for part in [9, 600, whole.len() / 2, whole.len() - 1000] {
        folder.write("cut.h5", &whole[..part]);
        folder.refused("compare paper.h5 cut.h5", &["cut.h5"]);
        folder.refused("compare cut.h5 paper.h5", &["cut.h5"]);
    }
    let rows = rows_of(paper(), 6.97);
    let columns = [
        ("time", rows.iter().map(|r| r.0).collect()),
        ("relative_velocity", rows.iter().map(|r| r.1[5]).collect::<Vec<f64>>()),
    ];
    npz(&folder.path("whole.npz"), &columns, false);
    let whole = folder.read("whole.npz");
    folder.write("cut.npz", &whole[..whole.len() / 2]);
    folder.refused("compare paper.h5 cut.npz", &["cut.npz", "numpy.savez"]);
    // One bit of the last value in the first array, which is not compressed, is changed: the member's CRC-32 differs.
    let mut flipped = whole.clone();
    let second = b"relative_velocity.npy";
    let at = (0..whole.len()).find(|&at| whole[at..].starts_with(second)).unwrap() - 30 - 8;
    flipped[at] ^= 1;
    folder.write("flipped.npz", &flipped);
    folder.refused("compare paper.h5 flipped.npz", "flipped.npz & time: Invalid checksum");
    let npz_with = |name: &str, more: &[(&str, Vec<f64>)]| {
        let arrays = [&columns[..1], more].concat();
        npz(&folder.path(name), &arrays, false);
    };
    npz_with("uneven.npz", &[("relative_velocity", vec![1.0; 5])]);
    folder.refused("compare paper.h5 uneven.npz", &["5 rows"]);
    // Two members with the same name, and a member whose name was damaged.
    npz_with("twice.npz", &[columns[1].clone(), ("timf", vec![1.0; 5])]);
    let mut twice = folder.read("twice.npz");
    for at in 0..twice.len() - 8 {
        if twice[at..].starts_with(b"timf.npy") {
            twice[at + 3] = b'e';
        }
    }
    folder.write("twice.npz", &twice);
    let words = "twice.npz & duplicate file names & numpy.savez";
    folder.refused("compare paper.h5 twice.npz", words);
    let mut renamed = whole.clone();
    let at = (0..whole.len()).rfind(|&at| whole[at..].starts_with(second)).unwrap();
    renamed[at] = b's';
    folder.write("renamed.npz", &renamed);
    folder.refused("compare paper.h5 renamed.npz", "renamed.npz & damaged & numpy.savez");
    // The file of another model: HDF5 without any known variable.
    let file = unlocked::create(folder.path("weather.h5")).unwrap();
    store(&file, "rain", &[1.0, 2.0]);
    drop(file);
    folder.refused("compare paper.h5 weather.h5", &["rain", "--column"]);
    for pair in [
        "nowhere.h5 paper.h5",
        "paper.h5 nowhere.csv",
        "paper.h5 .",
        "weather.h5 paper.h5",
    ] {
        folder.refused(&format!("compare {pair}"), "");
    }
}

/// An unreadable column is an error if it is needed. Otherwise it is named next to the comparison.
#[test]
fn cli_columns_of_types_that_are_not_read_are_named() {
    let folder = with_reference();
    let path = folder.path("types.npz");
    let times: Vec<f64> = (0..20).map(|k| 6.966 + 1e-4 * f64::from(k)).collect();
    let bytes = |values: &[f64]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let time = ("time".to_owned(), "'<f8'", vec![20], bytes(&times));
    let named = |name: &str, (_, kind, shape, values): &OfArchive<'static>| {
        (name.to_owned(), *kind, shape.clone(), values.clone())
    };
    let speed = named("relative_velocity", &time);
    let array =
        |kind: &'static str, shape: &[usize], bytes: usize| (String::new(), kind, shape.to_vec(), vec![0; bytes]);
    for (array, words) in [
        (array("'<c16'", &[20], 320), ["complex numbers (<c16)", "NAME.real"]),
        (array("'|O'", &[20], 20), ["Python objects (|O)", "NAME.astype(float)"]),
        (array("'<f16'", &[20], 320), ["not read (<f16)", "NAME.astype(float)"]),
        (array("'<M8[s]'", &[20], 160), ["dates or times", "seconds"]),
        (array("[('a', '<f8'), ('b', '<f8')]", &[20], 320), ["records", "fields"]),
        (array("'<U3'", &[20], 240), ["texts", "numbers"]),
        (array("'<f8'", &[2, 20], 320), ["shape [2, 20]", "y[2]"]),
        (array("'<f8'", &[], 8), ["single number", "row"]),
    ] {
        let refused = |arrays: &[OfArchive<'_>], column: &str, name: &str| {
            npz_of(&path, arrays, false);
            let words = words.map(|word| word.replace("NAME", name));
            folder.refused(&["compare", "paper.h5", "types.npz", "--column", column], &words);
        };
        let other = named("other", &array);
        refused(&[time.clone(), speed.clone(), other], "phi1=other", "other");
        refused(&[speed.clone(), time.clone(), named("t2", &array)], "time=t2", "t2");
        // Known by its name; needed in one case, not needed in the other.
        npz_of(&path, &[named("time", &array), speed.clone()], true);
        let left_out = ["no column of times", "left out: time", words[0]];
        folder.refused("compare paper.h5 types.npz", &left_out);
        npz_of(&path, &[time.clone(), speed.clone(), named("phi1", &array)], true);
        let c = compared(&folder, &["types.npz", "--quick"]);
        assert_eq!(c["absent"][0]["what"], "phi1", "{c}");
        assert!(c["absent"][0]["why"].text().contains(words[0]), "{c}");
        let report = folder.ok("compare paper.h5 types.npz --quick -v");
        says(&report, &["not compared: phi1", words[0]]);
    }

    let file = unlocked::create(folder.path("types.h5")).unwrap();
    let written = |name: &str| file.new_dataset_builder().with_data(&times).create(name).unwrap();
    let _ = ["time", "relative_velocity"].map(written);
    let flags = vec![true; 20];
    file.new_dataset_builder().with_data(&flags).create("phi1").unwrap();
    file.new_dataset::<f64>().create("theta_dot").unwrap();
    for path in ["one/phi1_dot", "two/phi1_dot"] {
        let builder = file.new_dataset_builder().with_data(&times);
        file.create_group(path.split('/').next().unwrap()).unwrap();
        builder.create(path).unwrap();
    }
    drop(file);
    let c = compared(&folder, &["types.h5", "--quick"]);
    let absent = c["absent"].to_string();
    says(&absent, &["enumeration", "single number", "one/phi1_dot, two/phi1_dot"]);
    for [column, words] in rows(
        "
        phi1=phi1      | phi1 & enumeration & floats
        phi1=theta_dot | theta_dot & single number
        phi1=phi1_dot  | one/phi1_dot, two/phi1_dot
    ",
    ) {
        folder.refused(&["compare", "paper.h5", "types.h5", "--column", column], words);
    }
}

/// The squares of such values exceed the largest double.
#[test]
fn cli_values_beyond_the_root_of_the_largest_number_have_errors() {
    let folder = with_reference();
    folder.write("events.csv", events_csv(&word_of(paper())));
    let rows = rows_of(paper(), 6.966);
    let name = "phi1";
    for large in [1e100, 1e155, 1e200, 1e308] {
        let table = rows.iter().step_by(50).map(|row| format!("{:?},{large:e}\n", row.0));
        let table: String = table.collect();
        folder.write("large.csv", format!("time,{name}\n{table}"));
        let c = compared(&folder, &["large.csv", "--events", "events.csv", "--quick"]);
        let channels = c["channels"].list();
        let own: Vec<_> = channels.iter().filter(|row| row["channel"] == name).collect();
        assert!(!own.is_empty());
        for row in own {
            let [max, rms] = ["max", "rms"].map(|key| row[key].number());
            assert!((max / large - 1.0).abs() < 1e-12, "{row}");
            assert!((rms / large - 1.0).abs() < 1e-12, "{row}");
            assert!(row["scd"].number() < -90.0, "{row}");
            assert!(row["mescd"].number() < -90.0, "{row}");
        }
        says(c["verdict"].text(), &["states do not agree", name]);
    }
    folder.write("overflow.csv", format!("time [min],{name}\n1e308,1.0\n"));
    let words = "row 0 & beyond the largest number & unit";
    folder.refused("compare paper.h5 overflow.csv --events events.csv", words);
}

#[test]
fn cli_wrong_mappings_are_refused_by_line_and_name() {
    let folder = with_reference();
    folder.write("series.csv", series());
    for (text, words) in [
        ("time = 3\n", "line 1 & name"),
        ("\n[channels]\nrelative_velocty = \"w\"\n", "relative_velocity?"),
        ("[channels]\nphi1 = { name = \"phi1\", unit = \"N\" }\n", "phi1 & force"),
        ("[channels]\nphi1 = \"phi_one\"\n", "phi_one"),
        ("[detection]\nvelocity_tolerance = -1\n", "at least 0"),
        ("colour = 1\n", "colour"),
        ("time = \n", "line 1 & TOML"),
    ] {
        folder.write("map.toml", text);
        folder.refused("compare paper.h5 series.csv --map map.toml", words);
    }
    for option in [
        "--column phi1",
        "--column nonsense=x",
        "--column time=time:N",
        "--column phi1=phi_one",
        "--velocity-tolerance=wide",
        "--velocity-tolerance=-1",
        "--hysteresis=0.5",
    ] {
        let error = folder.refused(&format!("compare paper.h5 series.csv {option}"), "");
        assert!(!error.is_empty(), "{option}");
    }
}

/// The candidate is not blamed for a temporary folder that is missing or full. Both names are reported.
#[cfg(unix)]
#[test]
fn cli_a_temporary_folder_that_fails_is_named() {
    let folder = with_reference();
    let rows = rows_of(paper(), 6.966);
    let times = rows.iter().map(|row| row.0).collect();
    let speeds = rows.iter().map(|row| row.1[5]).collect();
    let arrays = [("time", times), ("relative_velocity", speeds)];
    npz(&folder.path("packed.npz"), &arrays, true);
    folder.ok("compare paper.h5 packed.npz -q --quick");
    let words = "the folder for temporary files & TMPDIR";
    let compare = "compare paper.h5 packed.npz --quick";
    says(&refusal(folder.stickslip(compare).env("TMPDIR", "/none")), words);
    let mut export = folder.stickslip("export paper.h5 -o x.csv --rate 1e4");
    says(&output(export.env("TMPDIR", "/none"), 1).1, words);
    // A full disk.
    let program = env!("CARGO_BIN_EXE_stickslip");
    let limit = format!("ulimit -f 0; exec {program} {compare}");
    let mut limited = std::process::Command::new("sh");
    limited.args(["-c", &limit]).current_dir(folder.path("."));
    let stderr = text(&limited.output().unwrap().stderr);
    says(&stderr, words);
    assert!(!stderr.contains("damaged"), "{stderr}");
}

/// With a velocity tolerance above all speeds of the reference, every slip would count as a stick.
#[test]
fn cli_a_velocity_tolerance_above_all_speeds_is_refused() {
    let folder = with_reference();
    folder.write("mine.csv", series());
    for tolerance in ["1e99", "1e3", "'1e9 rpm'"] {
        let compare = format!("compare paper.h5 mine.csv --quick --velocity-tolerance {tolerance}");
        folder.refused(
            &compare,
            "velocity tolerance & every slip is a stick & never faster than",
        );
    }
    folder.ok("compare paper.h5 mine.csv --quick -q --velocity-tolerance 1e-3");
}

#[test]
fn cli_a_header_below_many_comments_is_found() {
    let folder = with_reference();
    folder.write("mine.csv", "# said by my solver\n".repeat(5000) + &series());
    agrees(&compared(&folder, &["mine.csv", "--quick"]));
}

#[test]
fn cli_a_search_for_causes_takes_a_limit_of_time() {
    let folder = with_reference();
    folder.write("mine.csv", series());
    agrees(&compared(&folder, &["mine.csv", "--max-wall-time", "5 min"]));
    for wrong in ["soon", "0", "-1", "3 kg"] {
        let option = format!("--max-wall-time={wrong}");
        folder.refused(&["compare", "paper.h5", "mine.csv", &option], "--max-wall-time");
    }
}
