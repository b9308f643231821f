//! `stickslip plot` and `stickslip modes --figure`.

use crate::common::cases::built_in;
use crate::common::cli::{Folder, json, says};
use crate::common::json::*;
use crate::common::rows;
use crate::common::unlocked;
use std::fmt::Arguments;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;
use stickslip::results::{Header, Overwrite, ResultWriter, Status};
use stickslip::{Run, Watch, go_on_unless};

fn with_run() -> Folder {
    let folder = Folder::new();
    folder.ok("run -q");
    folder
}

/// Points of the polylines in an SVG figure, in drawing units.
fn polylines(svg: &str) -> Vec<Vec<(f64, f64)>> {
    let lines = svg.split("<polyline").skip(1);
    lines
        .filter_map(|rest| rest.split("points=\"").nth(1)?.split('"').next())
        .map(|points| {
            let pairs = points.split_whitespace().map(|pair| {
                let (x, y) = pair.split_once(',').unwrap();
                (x.parse().unwrap(), y.parse().unwrap())
            });
            pairs.collect()
        })
        .collect()
}

fn png_size(bytes: &[u8]) -> (u32, u32) {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
    (number(16), number(20))
}

/// Every figure that the run has is drawn in both formats, under the name in --list. The others have a reason. A
/// second command replaces the figures without a question, and they are the same to the last byte.
#[test]
fn cli_plot_draws_the_catalogue_twice_alike() {
    let folder = with_run();
    let started = Instant::now();
    let (stdout, stderr) = folder.ends("plot paper.h5 --json", 0);
    // On an idle machine twenty figures in two formats take less than two seconds. Tests share their machine.
    assert!(started.elapsed().as_secs_f64() < 20.0, "{:?}", started.elapsed());
    assert_eq!(stderr, "");
    let document = json(&stdout);
    let listed = folder.json("plot --list");
    let (files, absent) = (document["files"].list(), document["not_drawn"].list());
    // Figures of other kinds of files are listed, too.
    let of_runs = listed.list().iter().filter(|entry| entry["of"] == "run");
    assert_eq!(files.len() / 2 + absent.len(), of_runs.count());
    assert!(files.len() >= 30, "{document}");
    let contents: Vec<Vec<u8>> = files
        .iter()
        .map(|file| {
            let name = file["file"].text();
            let bytes = folder.read(name);
            if name.ends_with(".png") {
                // 85 mm at 300 dots per inch.
                assert_eq!(png_size(&bytes).0, 1004, "{name}");
            } else {
                let text = String::from_utf8(bytes.clone()).unwrap();
                says(&text, &["width=\"85mm\"", file["title"].text()]);
            }
            bytes
        })
        .collect();
    folder.ok("plot paper.h5 -q");
    for (file, before) in files.iter().zip(contents) {
        assert!(
            std::fs::read(folder.path(file["file"].text())).unwrap() == before,
            "{file}"
        );
    }
}

#[test]
fn cli_plot_says_which_samples_are_missing() {
    let folder = Folder::new();
    folder.ok("run -q --set output.window=[] --set output.around=none");
    let document = folder.json("plot paper.h5");
    let sampling = document["sampling"].text();
    folder.ok(&["run", "paper.h5", "-q", "--set", sampling]);
    assert_eq!(
        folder.json("plot paper.repeat.h5 -o all")["not_drawn"],
        serde_json::json!([])
    );
    folder.refused("plot paper.h5 --only phase-axial", &["too far apart", "output.window="]);
}

/// The drawn line of a channel covers the height from its least to its largest value in the file.
#[test]
fn cli_plot_of_a_channel_draws_all_of_it() {
    let folder = with_run();
    let arguments = [
        "plot",
        "paper.h5",
        "--channel",
        "relative_velocity",
        "--from",
        "6.97",
        "--to",
        "6.99",
    ];
    folder.ok(&[&arguments[..], &["-o", "own.svg"]].concat());
    let text = folder.text("own.svg");
    let line = polylines(&text).into_iter().max_by_key(Vec::len).unwrap();
    // 8001 samples are reduced to at most four points in each of the 1200 buckets.
    assert!(line.len() > 1200 && line.len() <= 4800, "{}", line.len());
    assert!(line.windows(2).all(|p| p[0].0 <= p[1].0));
    let file = folder.result("paper.h5");
    let all = 0..file.sample_count().unwrap();
    let (t, w) = (
        file.column("time", all.clone()).unwrap(),
        file.column("relative_velocity", all).unwrap(),
    );
    let kept = t.iter().zip(&w).filter(|(t, _)| (6.97..=6.99).contains(*t));
    let inside: Vec<f64> = kept.map(|(_, w)| *w).collect();
    let bounds = |v: &mut dyn Iterator<Item = f64>| v.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    let (low, high) = bounds(&mut inside.iter().copied());
    let (top, bottom) = bounds(&mut line.iter().map(|p| p.1));
    // y falls as the value rises. First and last sample are at the places that follow from the range, up to the
    // rounding of the drawing.
    let place = |value: f64| bottom - (value - low) / (high - low) * (bottom - top);
    assert!((line[0].1 - place(inside[0])).abs() <= 1.5, "{:?}", line[0]);
    assert!((line[line.len() - 1].1 - place(inside[inside.len() - 1])).abs() <= 1.5);
}

#[test]
fn cli_plot_of_ones_own_in_every_form() {
    let folder = with_run();
    folder.ok("run paper-si -q");
    for [arguments, file, words] in rows(
        "
        --phase phi1 phi1_dot               | paper-phi1-dot-against-phi1          | stator surface speed
        --channel z --x normal_force      | paper-z-against-normal-force         | contact force
        --channel phi1_dot --channel mode | paper-channel-phi1-dot-mode          | mode
        paper-si.h5 --channel theta_dot     | paper-and-paper-si-channel-theta-dot | paper-si
    ",
    ) {
        let stdout = folder.ok(&format!("plot paper.h5 --format svg {arguments}"));
        assert_eq!(stdout, format!("figures/{file}.svg\n"));
        let text = folder.text(&format!("figures/{file}.svg"));
        assert!(text.contains(words), "{file}: {words}");
    }
}

/// All figures of two runs are drawn without a message, whatever they contain. No title has findings about a single
/// run.
#[test]
fn cli_plot_of_two_runs_is_silent() {
    let folder = with_run();
    folder.ok("run paper-si -q");
    let document = folder.clean("plot paper.h5 paper-si.h5 --json");
    let document = json(&document);
    let as_array = document["files"].list();
    let mut titles = as_array.iter().map(|f| f["title"].text());
    assert!(titles.all(|title| !title.contains("verges")), "{document}");
    // Straight pieces without length.
    let constant = ["plot", "paper.h5", "--channel", "mode", "--x", "time", "-o", "mode.png"];
    assert_eq!(folder.ends(&constant, 0).1, "");
}

/// The program replaces only its own figures, and never an input.
#[test]
fn cli_plot_spares_other_files() {
    let folder = with_run();
    for name in ["mine.svg", "mine.png"] {
        folder.write(name, "<svg>drawn by hand</svg>");
        let arguments = ["plot", "paper.h5", "--only", "4", "-o", name];
        folder.refused(&arguments, &[name, "--force"]);
        assert_eq!(folder.read(name), b"<svg>drawn by hand</svg>");
        folder.ok(&[&arguments[..], &["--force"]].concat());
        // Now it is one of the program's own.
        folder.ok(&arguments);
    }
    std::fs::rename(folder.path("paper.h5"), folder.path("run.svg")).unwrap();
    folder.refused(
        "plot run.svg --only 4 -o run.svg --force",
        "this is the file to be drawn",
    );
    folder.result("run.svg");
}

/// Figures are named after their files, so that those of two files have two names. Those of files with one name do not
/// replace each other, wherever they are drawn: each names its files.
#[test]
fn cli_plot_spares_the_figures_of_another_file() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("a b")).unwrap();
    for name in ["a b/b.h5", "b.h5", "c.h5"] {
        folder.ok_short(&["-q", "-o", name]);
    }
    for format in ["svg", "png", "pdf"] {
        let named = |files: &[&'static str], more: &[&'static str]| -> Vec<&str> {
            [&["plot", "--channel", "z", "--format", format], files, more].concat()
        };
        folder.ok(&named(&["a b/b.h5"], &[]));
        let name = format!("figures/b-channel-z.{format}");
        let first = folder.read(&name);
        folder.refused(&named(&["b.h5"], &[]), &[name.as_str(), "a b/b.h5", "-o", "--force"]);
        assert_eq!(folder.read(&name), first);
        // Other files have figures of other names.
        let both = folder.ok(&named(&["b.h5", "c.h5"], &[]));
        assert_eq!(both, format!("figures/b-and-c-channel-z.{format}\n"));
        // The same file by another form of its name, another folder, and force.
        folder.ok(&named(&["./a b/b.h5"], &[]));
        folder.ok(&named(&["b.h5"], &["-o", "other"]));
        folder.ok(&named(&["b.h5"], &["--force"]));
        assert_ne!(folder.read(&name), first);
        // A name that the user chose.
        let own = format!("own.{format}");
        folder.ok(&["plot", "--channel", "z", "b.h5", "-o", &own]);
        folder.ok(&["plot", "--channel", "z", "b.h5", "-o", &own]);
        folder.refused(
            &["plot", "--channel", "z", "c.h5", "-o", &own],
            &[own.as_str(), "b.h5", "-o", "--force"],
        );
    }
    folder.ok("plot b.h5 --html page.html");
    folder.ok("plot b.h5 --html page.html");
    folder.refused(
        "plot c.h5 --html page.html",
        "page.html & the page of b.h5 & --html & --force",
    );
    folder.ok("plot c.h5 --html page.html --force");
}

#[test]
fn cli_plot_refuses_with_the_remedy() {
    let folder = with_run();
    folder.write("text.h5", "no HDF5");
    {
        // The block ends the handle, which holds the file open.
        let sweep = unlocked::create(folder.path("sweep.h5")).unwrap();
        let format: hdf5::types::VarLenUnicode = "stickslip-study".parse().unwrap();
        let attribute = sweep.new_attr::<hdf5::types::VarLenUnicode>().create("format").unwrap();
        attribute.write_scalar(&format).unwrap();
    }
    std::fs::copy(folder.path("paper.h5"), folder.path("bare.h5")).unwrap();
    let bare = unlocked::open_rw(folder.path("bare.h5")).unwrap();
    bare.unlink("trajectory").unwrap();
    bare.close().unwrap();
    for [arguments, words] in rows(
        r#"
        missing.h5 | missing.h5 & no such file
        text.h5 | text.h5 & not an HDF5 file
        paper.h5 --only 25 | critical curve & sweep
        paper.h5 --only 17 | 17 & --list
        paper.h5 --only duration | did you mean durations?
        paper.h5 --channel thetadot | did you mean theta_dot? & relative_velocity, slip_displacement
        paper.h5 --phase z w | "w" & z_dot
        paper.h5 --channel z --from 5 --to 4 | --from 5 & --to 4
        sweep.h5 | sweep.h5 & format is "stickslip-study" & stickslip run
        bare.h5 | bare.h5 & /trajectory & there are: & events & stick_slip
        paper.h5 --channel z --from 11 | from 11 & from 0 to 10 s
        paper.h5 --channel z --from nan | --from & a time in s
        paper.h5 --only 4 -o one.html | one.html & .svg, .png or .pdf
        paper.h5 --from 1 | --channel
        paper.h5 -o one.svg | one.svg & folder
        paper.h5 --only 4 -o one.tiff | one.tiff & .svg, .png or .pdf
        paper.h5 --only 4 -o one.eps | one.eps & pdftops -eps
        paper.h5 --format eps | pdftops -eps
        paper.h5 --only 4 -o no/one.svg | no/one.svg & does not exist
        paper.h5 -o text.h5 | text.h5 & folder
        paper.h5 --width 1 | --width & 60
        paper.h5 --only 4 --width 1000 --dpi 2400 | too large & --dpi
    "#,
    ) {
        folder.refused(&format!("plot {arguments}"), words);
    }
    folder.refused("plot", "<FILE>");
}

fn header() -> Header {
    let case = built_in("paper", &[]);
    Header {
        resolved: case.resolved(),
        ..crate::common::results::header()
    }
}

/// Ends a run after this time, s.
struct Until(f64);

impl Watch for Until {
    fn stopped(&self) -> bool {
        false
    }

    fn at(&self, done: f64, _: f64, _: Arguments<'_>) -> ControlFlow<()> {
        go_on_unless(done > self.0)
    }
}

/// Writes the state of a run of the paper's brake that was interrupted at `stop` (s).
fn interrupted(path: &Path, stop: f64) -> std::path::PathBuf {
    let case = built_in("paper", &[]);
    let mut writer = ResultWriter::create(path, Overwrite::OwnResults, &[], &header()).unwrap();
    Run::new(&case).record(&mut writer).watch(&Until(stop)).start().unwrap();
    writer
        .finish(Status::Interrupted, &crate::common::results::stick_slip(), 0.1)
        .unwrap()
}

/// The existing part is drawn, and a message says how far the run goes. The runs end in the stick-slip, and before
/// it.
#[test]
fn cli_plot_of_an_interrupted_run_draws_what_is_there() {
    let folder = Folder::new();
    for (stop, has_sticks) in [(6.98, true), (3.0, false)] {
        interrupted(&folder.path("cut.h5"), stop);
        let (document, stderr) = folder.ends("plot cut.partial.h5 --json", 0);
        says(&stderr, &["was interrupted", "up to t = "]);
        let drawn = |name: &str| {
            let document = json(&document);
            let files = document["files"].list();
            files.iter().any(|file| file["figure"] == name)
        };
        assert!(drawn("rotor-speed") && drawn("friction-law"));
        assert_eq!(drawn("durations"), has_sticks);
        assert_eq!(drawn("stick-slip-transition"), has_sticks);
        assert!(!drawn("phase-final-stick-stator"));
    }
}

/// A failed run leaves its partial file. A file without samples has nothing to draw.
#[test]
fn cli_plot_of_failed_and_empty_runs() {
    let folder = Folder::new();
    let chattering = ["run", "-q", "--set", "contact.breakaway_test=\"stator\""];
    folder.ends(&chattering, 1);
    let (_, stderr) = folder.ends("plot paper.partial.h5 --only 5 -o z.png", 0);
    assert!(stderr.contains("this run failed"), "{stderr}");
    let writer = ResultWriter::create(&folder.path("empty.h5"), Overwrite::OwnResults, &[], &header()).unwrap();
    writer
        .finish(Status::Interrupted, &crate::common::results::stick_slip(), 0.0)
        .unwrap();
    folder.refused("plot empty.partial.h5", &["has no trajectory", "stickslip run"]);
}

#[test]
fn cli_modes_draws_its_figure() {
    let folder = Folder::new();
    for name in ["modes.svg", "modes.png"] {
        folder.ok(&["modes", "-q", "--figure", name]);
        folder.ok(&["modes", "-q", "--figure", name]);
    }
    let text = folder.text("modes.svg");
    assert!(text.contains("0.5478 rad/s"), "the critical speed stands in it");
    assert_eq!(png_size(&folder.read("modes.png")).0, 1004);
    folder.write("mine.svg", "mine");
    for name in ["mine.svg", "modes.jpg"] {
        folder.refused(&["modes", "--figure", name], &[name]);
    }
}

/// Many figures are counted and named in a few lines; `-v` lists their files.
#[test]
fn cli_plot_names_many_figures_in_few_lines() {
    let folder = with_run();
    let short = folder.ok("plot paper.h5 --format svg");
    let listed = folder.json("plot paper.h5 --format svg");
    let count = listed["files"].list().len();
    let first = format!("{count} figures in figures/, as SVG: paper-");
    let paragraph = short.split("\n\n").next().unwrap();
    assert!(paragraph.starts_with(&first), "{short}");
    assert!(paragraph.lines().count() <= 5, "{short}");
    assert!(!short.contains(".svg"), "{short}");
    let long = folder.ok("plot paper.h5 --format svg -v");
    for file in listed["files"].list() {
        let file = file["file"].text();
        assert!(long.lines().any(|line| line == file), "{file}: {long}");
    }
}
