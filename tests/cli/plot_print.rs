//! Figures for print, curves that are exact at events, and figures of a candidate with its reference.

use crate::common::cli::{Folder, says};
use crate::common::compare::{csv, paper, rows_of};
use std::process::Command;
use stickslip::plot::DrawnRun;
use stickslip::record::EventKind;

fn with_run() -> Folder {
    let folder = Folder::new();
    std::fs::copy(paper(), folder.path("paper.h5")).unwrap();
    folder
}

fn text_of(folder: &Folder, name: &str) -> String {
    String::from_utf8_lossy(&folder.read(name)).into_owned()
}

fn size(text: &str, key: &str) -> (f64, f64) {
    let numbers = text.split_once(key).unwrap().1.trim_start_matches([' ', '[']);
    let split = numbers.split([' ', ']', '\n']).filter(|word| !word.is_empty());
    let numbers: Vec<f64> = split.take(4).map(|word| word.parse().unwrap()).collect();
    (numbers[2], numbers[3])
}

/// 84 mm are 238.11 points in each format. Letters are outlines, and a second drawing has the same bytes.
#[test]
fn cli_plot_for_print_has_the_size_that_is_asked_for() {
    let folder = with_run();
    let draw = |name: &str, more: &[&str]| {
        let arguments = [
            "plot",
            "paper.h5",
            "--only",
            "stick-slip-close-up",
            "--width",
            "84mm",
            "--font-size",
            "8pt",
        ];
        folder.ok(&[&arguments[..], more, &["-o", name]].concat());
        folder.read(name)
    };
    for name in ["a.pdf", "a.svg", "a.png"] {
        assert!(draw(name, &["--no-title"]) == draw(name, &["--no-title"]), "{name}");
    }
    let (pdf, svg) = (text_of(&folder, "a.pdf"), text_of(&folder, "a.svg"));
    // A unit of the drawing is 0.03 points.
    let (width, height) = size(&pdf, "/MediaBox");
    assert!((width - 84.0 / 25.4 * 72.0).abs() < 0.05, "{width}");
    assert!(svg.contains("width=\"84mm\""), "{svg}");
    assert!(pdf.starts_with("%PDF-1.4") && !pdf.contains("/Font"));
    // The title is only in the document's description. With a drawn title the figure is higher.
    assert_eq!(svg.matches("First sticks: relative velocity").count(), 1);
    draw("b.pdf", &[]);
    assert!(size(&text_of(&folder, "b.pdf"), "/MediaBox").1 > height + 5.0);
    folder.write("mine.pdf", "%PDF drawn by hand");
    folder.refused("plot paper.h5 --only 4 -o mine.pdf", &["--force"]);
}

/// If Ghostscript is installed, it must find everything inside the page, and the page filled.
#[test]
fn cli_plot_for_print_is_read_by_another_program() {
    let folder = with_run();
    folder.ok("plot paper.h5 --only durations -o a.pdf");
    let arguments = ["-q", "-dNOPAUSE", "-dBATCH", "-dSAFER", "-sDEVICE=bbox"];
    let Ok(found) = Command::new("gs").args(arguments).arg(folder.path("a.pdf")).output() else {
        assert!(
            std::env::var_os("STICKSLIP_IGNORE_NONE").is_none(),
            "Ghostscript is missing"
        );
        return;
    };
    assert!(found.status.success(), "{found:?}");
    let ink = size(&String::from_utf8_lossy(&found.stderr), "%%HiResBoundingBox: ");
    let (width, height) = size(&text_of(&folder, "a.pdf"), "/MediaBox");
    // White background and margins are no ink.
    assert!(
        ink.0 > 0.9 * width && ink.0 <= width && ink.1 > 0.9 * height && ink.1 <= height,
        "{ink:?}"
    );
}

#[test]
fn cli_plot_refuses_sizes_without_room() {
    let folder = with_run();
    for (arguments, words) in [
        (&["--width", "84furlong"][..], &["84mm", "240pt"][..]),
        (&["--width", "2in"], &["60.0mm"]),
        (&["--font-size", "40"], &["from 4 to 24"]),
        (&["--width", "84mm", "--font-size", "12pt"], &["no room", "102.9mm"]),
    ] {
        folder.refused(&[&["plot", "paper.h5"], arguments].concat(), words);
    }
    // Smaller letters need less width.
    folder.ok("plot paper.h5 --only 4 --width 2in --font-size 5pt -o a.svg");
}

/// Symbols and powers are typeset, names are not. Only figures of the paper's own case have the paper's numbers.
#[test]
fn cli_plot_sets_symbols_and_knows_the_papers_case() {
    let folder = with_run();
    folder.ok("run paper-si -q -o a_b.h5");
    folder.ok("plot paper.h5 --only stick-slip-close-up -o a.svg");
    let svg = text_of(&folder, "a.svg");
    assert!(svg.contains("T<tspan") && !svg.contains("T_f"), "{svg}");
    for (file, number) in [("paper.h5", true), ("a_b.h5", false)] {
        folder.ok(&["plot", file, "--only", "15", "-o", "a.svg", "--force"]);
        assert_eq!(text_of(&folder, "a.svg").contains("(paper, Fig. 15)"), number, "{file}");
    }
}

/// In a file without dense samples the torque of the interface reaches mu_0 r F_n at every breakaway, as in the
/// file's internal_force, and its jumps are vertical.
#[test]
fn property_curves_go_through_the_states_at_events() {
    let folder = Folder::new();
    let sparse = [
        "run",
        "-q",
        "--set",
        "output.window=[]",
        "--set",
        "output.around=none",
        "--set",
        "output.interval=1e-3",
        "-o",
        "sparse.h5",
    ];
    folder.ok(&sparse);
    let run = DrawnRun::open(&folder.path("sparse.h5")).unwrap();
    let radius = run.system.radius;
    let curve = run.curves(&["friction_torque"], (6.9745, 6.9905)).unwrap().remove(0);
    let (mut slips, mut upright) = (0, 0);
    for event in &run.events {
        let kept = curve.iter().filter(|point| point.0 == event.time);
        let here: Vec<f64> = kept.map(|point| point.1).collect();
        if event.kind == EventKind::Slip {
            let peak = event.internal_force * radius;
            // Both are sums of the same terms. The friction belongs to the next state, at 1e-9 rad/s at most.
            assert!(
                here.iter().any(|torque| (torque / peak - 1.0).abs() < 1e-7),
                "{peak} {here:?}"
            );
            assert!((peak - 69.91).abs() < 0.01, "{peak}");
            slips += 1;
        } else if event.kind == EventKind::Stick {
            upright += usize::from(here.len() == 2 && here[0] != here[1]);
        }
    }
    assert_eq!((slips, upright), (47, 48));
    // The curve between two sparse samples is marked.
    let arguments = [
        "plot",
        "sparse.h5",
        "--channel",
        "relative_velocity",
        "--from",
        "6.974",
        "--to",
        "6.978",
    ];
    folder.ok(&[&arguments[..], &["-o", "a.svg"]].concat());
    let svg = text_of(&folder, "a.svg");
    assert!(svg.contains("too few samples"), "{svg}");
    assert!(svg.contains("straight lines for"), "{svg}");
    // With the built-in windows nothing is marked.
    let folder = with_run();
    folder.ok("plot paper.h5 --only stick-slip-transition -o a.svg");
    assert!(!text_of(&folder, "a.svg").contains("too few samples"));
}

/// The candidate misses a stick. The figures of the report and of `plot --candidate` agree, and show the place.
#[test]
fn cli_a_comparison_is_something_to_look_at() {
    let folder = with_run();
    // The candidate is late by a microsecond from the start.
    let rows = rows_of(paper(), 6.966).into_iter().map(|(t, row)| (t + 1e-6, row));
    let rows = rows.collect::<Vec<_>>();
    folder.write("mine.csv", csv(&rows));
    folder.ok("compare paper.h5 mine.csv -q --quick --report a.html");
    let page = text_of(&folder, "a.html");
    assert_eq!(page.matches("<svg").count(), 4);
    says(&page, &["largest error", "Error of the time of each event"]);
    let before = folder.names();
    folder.ok("compare paper.h5 mine.csv -q --quick --report a.md");
    let report = text_of(&folder, "a.md");
    let names = folder.names().into_iter().filter(|name| !before.contains(name));
    let new: Vec<String> = names.collect();
    assert_eq!(new.len(), 5, "{new:?}");
    assert!(
        new.iter()
            .filter(|name| name.ends_with(".svg"))
            .all(|name| report.contains(name.as_str())),
        "{report}"
    );
    // Its own figures are replaced, those of another comparison are not.
    folder.ok("compare paper.h5 mine.csv -q --quick --report a.md");
    let listed = folder.ok("plot paper.h5 --candidate mine.csv --format svg -o drawn");
    assert_eq!(listed.lines().count(), 4, "{listed}");
    let channel = [
        "plot",
        "paper.h5",
        "--candidate",
        "mine.csv",
        "--channel",
        "phi1_dot",
        "--from",
        "6.974",
        "--to",
        "6.976",
    ];
    folder.ok(&[&channel[..], &["-o", "own.svg"]].concat());
    let own = text_of(&folder, "own.svg");
    says(&own, &[">\nmine\n<", "|error| at the same time"]);
    // The candidate is dashed over the reference: both colours are seen where both agree.
    let dashed = own
        .lines()
        .filter(|line| line.starts_with("<polyline") && line.contains("stroke-dasharray"));
    assert!(
        dashed.clone().count() > 0 && dashed.clone().all(|line| line.contains("#D55E00")),
        "{own}"
    );
    let lacking = ["plot", "paper.h5", "--candidate", "mine.csv", "--channel", "z"];
    folder.refused(&lacking, &["mine.csv", "relative_velocity"]);
    // A table of events has no curve.
    let table = "kind,time\nstick,6.975\nslip,6.97505\n";
    folder.write("events.csv", table);
    let listed = folder.ok("plot paper.h5 --candidate events.csv --format svg -o table");
    assert_eq!(listed.lines().count(), 1, "{listed}");
}
