//! `stickslip plot` with files of many runs, and with certified files: the drawings show the values of the file.

use crate::common::cli::{Folder, says};
use crate::common::json::*;
use crate::common::page::{document, doubles};
use std::collections::BTreeMap;
use std::path::Path;
use stickslip::plot::figure::{Cell, ColorKey};
use stickslip::plot::studies::{self, Choice, StudyData};
use stickslip::plot::style::{self, RGBColor};
use stickslip::results::{ResultFile, StudyFile};

/// Sticks after a stop from a low speed, which take milliseconds to compute. The two lowest frictions are invalid.
const MAP: &str = r#"
title = "a map"
case = "base.toml"
set = { solver.method = "series", "actuation.rise_time" = "20 ms",
    perturbation = [{ kind = "kick", time = "instability", relative_velocity = 1e-4 }] }
axis = [
    { key = "friction.decay", from = 0.5, to = 80, count = 7, spacing = "log" },
    { key = ["friction.low_speed", "friction.breakaway"], values = [0.6, 0.45, 0.5] },
    { key = "torsion.damping", values = [22.606] },
]
"#;

/// A step of an axis is printed as its decimal: 0.1 + 2 (0.4 - 0.1)/3 differs from 0.3 by rounding.
#[test]
fn cli_titles_of_studies_have_short_numbers() {
    let folder = Folder::new();
    let study = "case = \"belt-leine\"\nset = { output.end_time = 20, solver.method = \"series\" }\naxis = [\n\
                 { key = \"rotor.speed\", from = 0.1, to = 0.4, count = 4 },\n{ key = \"stator.stiffness\", values = [0.9, 1.1] },\n]\n";
    folder.write("belt.toml", study);
    folder.ok("sweep belt.toml -q");
    for underscored in ["map-stick_count", "map-stick-count"] {
        let drawn = folder.json(&format!("plot belt.h5 --quantity stick-count --only {underscored}"));
        assert_eq!(drawn["files"][0]["figure"], "map-stick_count");
    }
    let drawn = folder.json("plot belt.h5 --at rotor.speed=0.3 --quantity stick_count -o x.svg");
    let title = drawn["files"][0]["title"].as_str().unwrap();
    assert!(title.ends_with(", at rotor speed = 0.3 m/s"), "{title}");
}

/// Runs the study with the base case from a lower speed.
fn with_map(folder: &Folder, study: &str) -> StudyFile {
    let case = folder.ok("case paper");
    let line = |line| {
        if str::starts_with(line, "speed") {
            "speed = 3"
        } else {
            line
        }
    };
    let lines: Vec<&str> = case.lines().map(line).collect();
    folder.write("base.toml", lines.join("\n"));
    folder.write("map.toml", study);
    folder.ok("sweep map.toml -q -j 1");
    folder.sweep_file("map.h5")
}

type Rectangle = (f64, f64, f64, f64, String);

fn rectangles(svg: &str) -> Vec<Rectangle> {
    let rectangle = |rest: &str| {
        let part = |name: &str| {
            let value = rest.split_once(&format!("{name}=\"")).unwrap().1;
            value.split_once('"').unwrap().0.to_owned()
        };
        let [x, y, width, height] = ["x", "y", "width", "height"].map(|name| part(name).parse().unwrap());
        (x, y, width, height, part("fill"))
    };
    svg.split("<rect ").skip(1).map(rectangle).collect()
}

fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02X}{g:02X}{b:02X}")
}

/// The cells of the figure have the values of the file, and the drawn rectangles have the colours of these values.
/// The colour is looked up at the middle of each cell.
#[test]
fn cli_a_map_has_the_values_of_the_file() {
    let folder = Folder::new();
    let file = with_map(&folder, MAP);
    // The first stick has a different time in each run, while many runs have equally many sticks.
    let [default] = &studies::figures(&file, &Choice::default()).unwrap()[..] else {
        panic!("one figure");
    };
    assert_eq!(default.name, "map-onset_time");
    let title = &default.title;
    assert!(
        title.ends_with(", the quantity that tells most points apart"),
        "{title}"
    );
    let of_sticks = folder.json("plot map.h5 -o map.svg --quantity stick_count");
    assert_eq!(of_sticks["files"][0]["figure"], "map-stick_count");
    let choice = Choice {
        quantities: vec!["stick_count".to_owned()],
        ..Choice::default()
    };
    let [figure] = &studies::figures(&file, &choice).unwrap()[..] else {
        panic!("one figure");
    };
    let title = &figure.title;
    assert!(title.ends_with(": number of sticks"), "{title}");
    let [panel] = &figure.panels[..] else {
        panic!("one panel")
    };
    let map = panel.map.as_ref().unwrap();
    let counts = file.numbers("stick_count").unwrap();
    let frictions = file.numbers("friction_low_speed").unwrap();
    assert!(counts.iter().any(|count| *count != counts[0]), "{counts:?}");
    assert_eq!(frictions, [0.6, 0.45, 0.5]);
    assert_eq!((map.x_edges.len(), map.y_edges.len()), (8, 4));
    // The rows are in the order of their values, whatever their order in the file.
    for (row, level) in [(0, 1), (1, 2), (2, 0)] {
        for column in 0..7 {
            let found = map.cells[7 * row + column];
            assert_eq!(found, Cell::Value(counts[3 * column + level]), "{row} {column}");
        }
    }
    // The edges are midway between the levels, or between their logarithms if these are evenly spaced.
    let decay = file.numbers("friction_decay").unwrap();
    assert!((map.x_edges[1] - (decay[0] * decay[1]).sqrt()).abs() < 1e-9);
    assert!((map.y_edges[1] - 0.475).abs() < 1e-12);
    let ColorKey::Scale(axis) = &map.key else {
        panic!("{:?}", map.key)
    };
    let (low, high) = axis.range.unwrap();
    let least = counts.iter().copied().fold(f64::INFINITY, f64::min);
    assert_eq!((low, high), (least, counts.iter().copied().fold(0.0, f64::max)));
    // The picture. The colour bar has 256 steps, all of which are lower than the map.
    let svg = folder.text("map.svg");
    let all = rectangles(&svg);
    let bar = all.iter().filter(|r| r.3 < 250.0 && r.3 > 150.0).count();
    assert!(bar >= 256, "{bar}");
    let kept = all.iter().filter(|r| r.3 > 250.0 && r.4 != "#FFFFFF" && r.4 != "none");
    let cells: Vec<_> = kept.collect();
    let edge = |part: &dyn Fn(&Rectangle) -> f64, least: bool| {
        let values = cells.iter().map(|r| part(r));
        let start = if least { f64::INFINITY } else { 0.0 };
        values.fold(start, if least { f64::min } else { f64::max })
    };
    let (left, right) = (edge(&|r| r.0, true), edge(&|r| r.0 + r.2, false));
    let (top, bottom) = (edge(&|r| r.1, true), edge(&|r| r.1 + r.3, false));
    for row in 0..3 {
        for column in 0..7 {
            let x = left + (column as f64 + 0.5) / 7.0 * (right - left);
            let (from, to) = (map.y_edges[row], map.y_edges[row + 1]);
            let (low_edge, high_edge) = (map.y_edges[0], map.y_edges[3]);
            let y = bottom - (0.5 * (from + to) - low_edge) / (high_edge - low_edge) * (bottom - top);
            let inside = |r: &&&Rectangle| r.0 <= x && x <= r.0 + r.2 && r.1 <= y && y <= r.1 + r.3;
            // The rectangle that is drawn last is visible.
            let drawn = &cells.iter().rfind(inside).unwrap().4;
            let Cell::Value(value) = map.cells[7 * row + column] else {
                panic!("no value")
            };
            let step = ((value - low) / (high - low) * 256.0).floor().min(255.0);
            let shade = hex(style::shade((step + 0.5) / 256.0));
            assert_eq!(*drawn, shade, "{row} {column}: {value}");
        }
    }
}

/// Failed points are crossed out, and points without a value are grey. The legend says so; neither depends on colour.
#[test]
fn cli_a_map_shows_what_has_no_value() {
    let folder = Folder::new();
    // Cases with a breakaway below the high-speed coefficient are invalid. Without a second stick there is no period.
    let study = MAP.replace("[0.6, 0.45, 0.5]", "[0.6, 0.1, 0.31]");
    let both = "key = [\"friction.low_speed\", \"friction.breakaway\"]";
    let file = with_map(&folder, &study.replace(both, "key = \"friction.breakaway\""));
    assert!(!file.failures().unwrap().is_empty());
    folder.ok("plot map.h5 --quantity first_period -o map.svg");
    let svg = folder.text("map.svg");
    assert!(svg.contains("failed"), "the legend names what is crossed out");
    let data = StudyData::read(&file).unwrap();
    let failed = data.status.iter().filter(|status| **status == 1.0).count();
    let crossed = svg.matches("<polyline").count();
    assert!(crossed >= 2 * failed, "{crossed} lines for {failed} points");
}

/// The command for a clicked point, composed as on the page, runs the point: same sticks, same times.
#[cfg(unix)]
#[test]
fn cli_the_command_of_a_point_runs_it() {
    let folder = Folder::new();
    let dampings = "key = \"torsion.damping\", values = [22.606]";
    let study = MAP.replace(dampings, "key = \"solver.method\", values = [\"series\", \"auto\"]");
    let study = study.replace("solver.method = \"series\"", "title = \"it's \\\"quoted\\\"\"");
    let file = with_map(&folder, &study);
    folder.ok("plot map.h5 --html map.html");
    let page = folder.text("map.html");
    let data = document(&page);
    // Parameters are exact; results have the digits of the tolerance, 1e-8.
    let digits = |name: &str| {
        let columns = data["columns"].list();
        columns.with("name", name)["digits"].clone()
    };
    let found = (digits("friction_decay"), digits("onset_time"));
    assert_eq!(found, (serde_json::Value::Null, 8.into()));
    let command = data["commands"][0]["start"].text();
    assert!(command.starts_with("stickslip run base.toml --set "), "{command}");
    assert!(!command.contains("rtol"), "the method is an axis: {command}");
    let own = Path::new(env!("CARGO_BIN_EXE_stickslip")).parent().unwrap();
    let path = format!("{}:{}", own.display(), std::env::var("PATH").unwrap());
    let [counts, onsets] = ["stick_count", "onset_time"].map(|name| file.numbers(name).unwrap());
    for point in [0, 9, 22, counts.len() - 1] {
        let mut whole = command.to_owned();
        let options = data["commands"][0]["options"].list();
        // The last one names the file, which is another one here.
        for option in &options[..options.len() - 1] {
            let text = option[0].text();
            let Some((key, column)) = text.strip_suffix('}').and_then(|text| text.split_once('{')) else {
                let expected = serde_json::json!([2, [0, 1]]);
                assert_eq!(option[1], expected, "the tolerance of the methods of the axis");
                whole += &format!(" {text}");
                continue;
            };
            let column = &data["columns"][column.parse::<usize>().unwrap()];
            let value = doubles(&column["low"])[point];
            let words = column["words"].list();
            let value = match words.iter().find(|word| word[0] == value as i64) {
                Some(word) => format!("\"{}\"", word[1].text()),
                None => value.to_string(),
            };
            whole += &format!(" --set '{}{value}'", key.strip_prefix("--set ").unwrap());
        }
        whole += " -q --no-witness --force -o point.h5";
        let mut shell = std::process::Command::new("sh");
        shell
            .args(["-c", &whole])
            .current_dir(folder.path(""))
            .env("PATH", &path);
        assert!(shell.status().unwrap().success(), "{whole}");
        let run = ResultFile::open(&folder.path("point.h5")).unwrap();
        let table = run.stick_slip().unwrap().unwrap();
        assert_eq!(table.value("stick_count"), Some(counts[point]), "{whole}");
        let onset = table.value("onset_time").unwrap_or(f64::NAN);
        // Samples are no ends of steps in any engine, so that the steps and therefore the times are the same.
        let expected = onsets[point];
        let same = (onset - expected).abs() <= 1e-13 || onset.is_nan() && expected.is_nan();
        assert!(same, "{onset} {expected} by {whole}");
    }
}

/// With more than two axes there is a panel for each value of the others, or the others are held. For unknown names
/// the known ones are listed.
#[test]
fn cli_more_axes_are_panels_or_held() {
    let folder = Folder::new();
    let study = MAP.replace("values = [22.606]", "values = [18, 20, 22]");
    with_map(&folder, &study);
    folder.ok("plot map.h5 -o all.svg");
    let svg = folder.text("all.svg");
    says(&svg, &[" = 18 N", " = 20 N", " = 22 N"]);
    folder.ok("plot map.h5 --at torsion.damping=20 -o held.svg");
    let svg = folder.text("held.svg");
    assert!(svg.contains(" = 20 N") && !svg.contains(" = 18 N"));
    let line = "plot map.h5 -o line.svg --quantity onset_time --at torsion.damping=20 --at friction.low_speed=0.5";
    assert_eq!(folder.json(line)["files"][0]["figure"], "curves-onset_time");
    folder.ok("plot map.h5 --axes torsion.damping friction_decay -o axes.svg");
    folder.refuses(
        r#"
        plot map.h5 --quantity stick_cont                | no quantity "stick_cont" & stick_count
        plot map.h5 --at torsion.damping=21              | no point has torsion.damping=21 & 18
        plot map.h5 --at torsion.damping                 | AXIS=VALUE
        plot map.h5 --at torsion.damping=inf             | no point has torsion.damping=inf
        plot map.h5 --axes friction.decay nonsense       | no axis "nonsense" & torsion.damping
        plot map.h5 --axes friction.decay friction.decay | name two axes
        plot map.h5 --only curves                        | no figure curves & map-onset_time
        plot map.h5 --channel theta                      | no channels & --quantity
        plot map.h5 map.h5                               | drawn by itself
    "#,
    );
}

const ENSEMBLE: &str = r#"
title = "an ensemble"
case = "base.toml"
set = { solver.method = "series", "actuation.rise_time" = "20 ms",
    perturbation = [{ kind = "kick", time = "instability", relative_velocity = 1e-4 }] }
sample = { method = "sobol", count = 64, seed = 3 }
axis = [
    { key = "friction.decay", from = 4, to = 6 },
    { key = "perturbation.0.relative_velocity", from = 1e-7, to = 1e-3, spacing = "log" },
]
"#;

/// Percentiles and bars are those of the file's column: on the terminal, in JSON, and at the end of the sweep.
#[test]
fn cli_a_sample_has_its_distribution() {
    let folder = Folder::new();
    let file = with_map(&folder, ENSEMBLE);
    let mut onsets = file.numbers("onset_time").unwrap();
    onsets.sort_by(f64::total_cmp);
    assert!(onsets.iter().all(|time| time.is_finite()), "{onsets:?}");
    let document = folder.json("plot map.h5");
    for name in ["samples-onset_time", "plane-onset_time"] {
        document["files"].with("figure", name);
    }
    let own = &document["distributions"][0];
    let found = (&own["quantity"], &own["count"], &own["without"]);
    assert_eq!(found, (&"onset_time".into(), &64.into(), &0.into()));
    let close = |value: &serde_json::Value, expected: f64| (value.number() / expected - 1.0).abs() < 1e-14;
    // The median of 64 values is the mean of the two in the middle.
    let quarter = onsets[15] + 0.75 * (onsets[16] - onsets[15]);
    for (percentile, value) in [("50", 0.5 * (onsets[31] + onsets[32])), ("25", quarter)] {
        assert!(close(&own["percentiles"][percentile], value), "{own}");
    }
    assert!(close(&own["least"], onsets[0]) && close(&own["largest"], onsets[63]));
    let bars = own["bars"].list();
    for bar in bars {
        let (from, to) = (bar[0].number(), bar[1].number());
        let inside = onsets.iter().filter(|time| (from..to).contains(time)).count() as u64;
        assert!(bar[2].whole().abs_diff(inside) <= 1, "{bar}: {inside}");
    }
    assert_eq!(bars.iter().map(|bar| bar[2].whole()).sum::<u64>(), 64);
    let text = folder.ok("plot map.h5 -v");
    let report = folder.ok("sweep map.toml -j 1 -v");
    for said in [&text, &report] {
        says(said, &["onset_time (s): 64 runs", "50 %", "####"]);
    }
}

/// The dots inside the region are the runs that meet the required targets, and the optimum is that of the file.
#[test]
fn cli_a_calibration_has_its_region() {
    let folder = Folder::new();
    let study = "title = \"two inertias\"\ncase = \"paper\"\n[set]\noutput.end_time = 0.02\n\"actuation.rise_time\" = 0.01\n\
                 perturbation = []\n[[free]]\nkey = \"torsion.surface_inertia\"\nfrom = 0.005\nto = 0.03\n[[free]]\n\
                 key = \"torsion.stiffness\"\nfrom = 1e6\nto = 2e7\n[[target]]\nquantity = \"natural_period\"\n\
                 value = \"0.00024 s\"\n[search]\npoints = 64\nstarts = 2\n";
    folder.write("two.toml", study);
    folder.ok("calibrate two.toml -q -j 1");
    assert_eq!(folder.json("plot two.h5 -o two.svg")["files"][0]["figure"], "region");
    let file = folder.sweep_file("two.h5");
    let numbers = |name: &str| file.numbers(name).unwrap();
    let places = numbers("torsion_surface_inertia")
        .into_iter()
        .zip(numbers("torsion_stiffness"));
    let holds = |period: &f64| ((period - 0.00024) / 0.000005).abs() <= 1.0;
    let held = places
        .zip(numbers("natural_period"))
        .filter(|(_, period)| holds(period));
    let held: Vec<(f64, f64)> = held.map(|(place, _)| place).collect();
    let figures = studies::figures(&file, &Choice::default()).unwrap();
    let curve = |name: &str| {
        let mut curves = figures[0].panels[0].curves.iter();
        curves.find(|curve| curve.label == name).unwrap()
    };
    let drawn: Vec<(f64, f64)> = curve("all held targets hold").points().collect();
    assert!(held.len() > 50, "{}", held.len());
    assert_eq!(drawn.len(), held.len());
    assert!(held.iter().all(|place| drawn.contains(place)));
    let optimum = file.numbers("calibration/optimum").unwrap();
    let found = curve("optimum").points().collect::<Vec<_>>();
    assert_eq!(found, [(optimum[0], optimum[1])]);
    // The page opens on the region, with the groups of the figure, and marks the optimum.
    folder.ok("plot two.h5 --html two.html");
    let page = document(&folder.text("two.html"));
    let first = &page["columns"][page["first"][2].whole() as usize];
    assert_eq!(first["name"], "held_targets");
    let labels: Vec<&str> = (0..3).map(|code| first["words"][code][1].text()).collect();
    let drawn: Vec<usize> = labels.iter().map(|label| curve(label).points().count()).collect();
    let groups = doubles(&first["low"]);
    let count = |code: f64| groups.iter().filter(|group| **group == code).count();
    assert_eq!([0.0, 1.0, 2.0].map(count).to_vec(), drawn);
    assert_eq!(drawn[0], held.len());
    assert_eq!(first["colours"], serde_json::json!(["blue", "orange", "grey"]));
    let residuals = doubles(&page["columns"].with("name", "largest_residual")["low"]);
    assert_eq!(residuals.into_iter().filter(|one| *one <= 1.0).count(), held.len());
    assert_eq!(page["overlays"][0]["region"], true);
    let marked = &page["overlays"][0]["curves"][0];
    assert_eq!(marked["pieces"], serde_json::json!([[[optimum[0], optimum[1]]]]));
    // One parameter alone has its residual; and other quantities of the runs can be drawn.
    folder.ok("plot two.h5 --quantity natural_period -o runs");
}

/// The figure of the file equals that of the study which has just run, to the last byte.
#[test]
fn cli_a_work_precision_file_is_drawn_without_a_run() {
    let folder = Folder::new();
    let study = "title = \"A small one\"\ncase = \"paper-si\"\nset = [\"output.end_time=7\"]\n\n[[series]]\n\
                 methods = [\"auto\", \"paper\"]\ntolerances = [1e-6]\n\n[[series]]\nmethods = [\"erk\"]\n\
                 steps = [\"20 us\"]\n";
    folder.write("small.toml", study);
    let arguments = ["work-precision", "small.toml", "--figure", "ran", "-q"];
    folder.ok(&arguments);
    let read = folder.json("plot small.h5 -o read");
    assert_eq!(read["files"][0]["figure"], "work-precision");
    for name in ["small-work-precision.svg", "small-work-precision.png"] {
        let read = |place: &str| std::fs::read(folder.path(place).join(name)).unwrap();
        assert!(read("ran") == read("read"), "{name}");
    }
    folder.refused("plot small.h5 --html page.html", &["has no page"]);
}

/// Each event of a certified file is drawn at its uncertainty. Without a certificate the message says how to get one.
#[test]
fn cli_a_certified_file_has_its_uncertainties() {
    let folder = Folder::new();
    folder.ok("certify belt-coulomb -q");
    let name = "belt-coulomb.certified.h5";
    let document = folder.json(&["plot", name]);
    for figure in ["event-uncertainties", "error-bands"] {
        document["files"].with("figure", figure);
    }
    let runs = [stickslip::plot::DrawnRun::open(&folder.path(name)).unwrap()];
    let subject = stickslip::plot::entry::Subject::new(&runs).unwrap();
    let entry = stickslip::plot::catalogue::find("event-uncertainties").unwrap();
    let figure = entry.build(&subject).unwrap().unwrap();
    // By the exact solution the uncertainty is the true error: one dot, not two. Values below the axis have another mark.
    let curves = || figure.panels[0].curves.iter();
    let drawn = |label: &str| -> BTreeMap<usize, f64> {
        let named = curves().filter(|curve| curve.label == label);
        let points = named.flat_map(|curve| curve.points());
        points.map(|(k, value)| (k as usize, value)).collect()
    };
    let stored = folder.result(name).event_column("time_uncertainty").unwrap();
    let (above, below) = (drawn("uncertainty = true error"), drawn("below 10⁻¹⁶ s"));
    let finite = stored.iter().filter(|value| value.is_finite()).count();
    assert_eq!(above.len() + below.len(), finite);
    let fits = |(k, value): (&usize, &f64)| *value == stored[*k] && *value >= 1e-16;
    assert!(above.iter().all(fits), "{above:?}");
    let is_small = |k: &usize| stored[*k] < 1e-16 && !above.contains_key(k);
    assert!(below.keys().all(is_small), "{below:?}");
    assert!(curves().all(|curve| curve.label != "true error, by the exact solver"));
    folder.ok("run belt-coulomb -q --no-witness");
    folder.refused("plot belt-coulomb.h5 --only event-uncertainties", "stickslip certify");
}

#[test]
fn cli_other_files_say_what_can_be_drawn() {
    let folder = Folder::new();
    let file = with_map(&folder, MAP);
    drop(file);
    folder.ok("sweep map.toml -q --shard 1/2 -o shard.h5");
    folder.refused("plot shard.h5", &["one shard", "stickslip merge"]);
    folder.ok_short("-q -o run.h5");
    folder.refused("plot run.h5 --quantity stick_count", &["--quantity", "--channel"]);
}

#[test]
fn cli_case_lists_studies_and_prints_them() {
    let folder = Folder::new();
    let listed = folder.json("case --list");
    for (name, takes) in [
        ("paper", "run"),
        ("critical-curve", "sweep"),
        ("paper-decay", "calibrate"),
        ("work-precision", "work-precision"),
    ] {
        assert_eq!(listed.with("name", name)["command"], takes, "{name}");
        let text = folder.ok(&["case", name]);
        assert!(text.contains("title ="), "{name}: {text}");
    }
}

#[test]
fn cli_the_default_quantity_is_what_the_study_asks_for() {
    let folder = Folder::new();
    let small = "case = \"paper\"\nset = { output.end_time = 0.01 }\naxis = [{ key = \"torsion.damping\", values = [10, 20] }]\n";
    let show = "show = [\"growth_exponent\", \"onset_time\"]";
    folder.write("map.toml", format!("{show}\n{small}"));
    folder.ok("sweep map.toml -q");
    let document = folder.json("plot map.h5 -o f --format svg");
    assert_eq!(document["files"][0]["figure"], "curves-growth_exponent");
    assert_eq!(document["files"][1]["figure"], "curves-onset_time");
    folder.write("wrong.toml", format!("show = \"onset\"\n{small}"));
    folder.refused("sweep wrong.toml", &["wrong.toml:1: show: ", "onset_time"]);
}
