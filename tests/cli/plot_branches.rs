//! `stickslip plot` with the file of a continuation: the diagrams and the page contain what the file contains.

use crate::common::cli::{Folder, json, says};
use crate::common::json::*;
use crate::common::page::{codes, document, doubles};
use std::path::Path;
use stickslip::continuation::{Special, Stored};
use stickslip::cycle::CycleStability;
use stickslip::plot::branches::{Branches, quantity};
use stickslip::plot::figure::{Curve, CurveStyle, Figure};

/// Belt speed at which steady sliding of belt-exponential has no damping: ln(10)/5 m/s.
const HOPF: f64 = 0.460_517_018_598_809_1;

/// A study with few points, which takes about a second.
pub const STUDY: &str = "title = \"Branches of a belt\"\ncase = \"belt-exponential\"\n[[axis]]\nkey = \"rotor.speed\"\n\
                         from = 0.25\nto = 0.6\n[branch]\nof = [\"steady\", \"cycle\"]\npoints = 20\nstep = 0.1\nfollow = []\n";

pub fn with_branches() -> Folder {
    let folder = Folder::new();
    folder.write("belt.toml", STUDY);
    folder.ok("continue belt.toml -q");
    folder
}

fn figure(path: &Path, name: &str) -> Figure {
    let figures = Branches::read(path).unwrap().all().unwrap();
    let named = figures.iter().find(|figure| figure.name == name);
    named.unwrap_or_else(|| panic!("{name}")).clone()
}

fn curves(figure: &Figure) -> &[Curve] {
    &figure.panels[0].curves
}

/// Every pair of neighbouring points in the file belongs to one line, with its kind of motion and its stability.
/// Nothing else is drawn.
#[test]
fn cli_a_diagram_has_the_branches_of_the_file() {
    let folder = with_branches();
    let names: Vec<String> = folder.json("plot belt.h5")["files"]
        .list()
        .iter()
        .map(|file| file["figure"].text().to_owned())
        .collect();
    for name in ["branches-amplitude", "branches-relative_velocity", "branches-period"] {
        assert!(names.iter().any(|one| one == name), "{names:?}");
    }
    assert!(folder.path("figures/belt-branches-amplitude.png").exists());
    let path = folder.path("belt.h5");
    let stored = Stored::read(&path).unwrap();
    let drawn = figure(&path, "branches-amplitude");
    let links = |curve: &Curve| -> usize { curve.pieces.iter().map(|piece| piece.len() - 1).sum() };
    let lines = || curves(&drawn).iter().filter(|curve| curve.label.contains(", "));
    let expected: usize = stored.branches.iter().map(|branch| branch.points.len() - 1).sum();
    assert_eq!(lines().map(links).sum::<usize>(), expected);
    for curve in lines() {
        let (what, stability) = curve.label.split_once(", ").unwrap();
        let style = match stability {
            "stable" => CurveStyle::Solid,
            "unstable" => CurveStyle::Dashed,
            _ => CurveStyle::Dotted,
        };
        assert_eq!(curve.style, style, "{}", curve.label);
        let branches = stored.branches.iter();
        let of_kind = branches.filter(|branch| branch.steady == (what == "steady sliding"));
        let points: Vec<_> = of_kind.flat_map(|branch| &branch.points).collect();
        for (x, y) in curve.points() {
            let found = points
                .iter()
                .find(|point| point.value == x && (point.position.1 - point.position.0) / 2.0 == y);
            let point = found.unwrap_or_else(|| panic!("{x} {y} is in the file"));
            let changes = point.special.is_some() || point.stability == CycleStability::Neutral;
            assert!(changes || point.stability.name() == stability, "{x}: {stability}");
        }
    }
}

/// Steady sliding is unstable below the Hopf point and stable above it. Both lines end there, at its mark.
#[test]
fn analytic_lines_are_broken_at_the_hopf_point() {
    let folder = with_branches();
    let drawn = figure(&folder.path("belt.h5"), "branches-position");
    let curve = |label: &str| {
        let found = curves(&drawn).iter().find(|curve| curve.label == label);
        found.unwrap_or_else(|| panic!("{label}"))
    };
    let xs = |label: &str| curve(label).points().map(|point| point.0).collect::<Vec<_>>();
    let largest = xs("steady sliding, unstable").into_iter().fold(0.0, f64::max);
    let least = xs("steady sliding, stable").into_iter().fold(f64::INFINITY, f64::min);
    assert!((largest - HOPF).abs() < 1e-9 && least == largest, "{largest} {least}");
    let marks = xs("Hopf");
    assert!(marks.iter().all(|x| *x == largest) && !marks.is_empty(), "{marks:?}");
    assert!(matches!(curve("Hopf").style, CurveStyle::Marks(_)));
    folder.ok("plot belt.h5 --quantity position -o position.svg --width 120 --no-title");
    let svg = folder.text("position.svg");
    says(&svg, "Hopf & steady sliding, unstable & cycles, stable & rotor speed");
}

/// There is a line for each quantity of the points. For unknown names the known ones are listed; options of sweeps
/// are refused.
#[test]
fn cli_a_diagram_is_chosen_by_its_quantity() {
    let folder = with_branches();
    let listed = folder.ok("plot belt.h5 --list");
    for one in quantity::QUANTITIES.iter().filter(|one| one.name != "margin") {
        says(&listed, &[format!("branches-{}", one.name)]);
    }
    says(&folder.ok("plot --list"), "branches & special-points & continuation");
    let stdout = folder.ok("plot belt.h5 --only branches-growth_rate -o rate.pdf --json");
    assert_eq!(json(&stdout)["files"][0]["figure"], "branches-growth_rate");
    folder.refused(
        "plot belt.h5 --quantity amplitud",
        "no quantity \"amplitud\" & did you mean amplitude? & period",
    );
    folder.refused("plot belt.h5 --only map", "has no figure map & branches-amplitude");
    folder.refused(
        "plot belt.h5 --axes rotor.speed rotor.speed",
        "leave out --axes and --at",
    );
    folder.refused("plot belt.h5 belt.h5", "drawn by itself");
    folder.refused("plot belt.h5 --channel theta", "no channels");
}

/// The runs of a sweep over the belt's speed go to the stable cycle: their points lie on its branch. The order of the files
/// does not matter, and a sweep over another key is refused.
#[test]
fn cli_runs_of_a_sweep_lie_on_the_branches() {
    let folder = with_branches();
    let sweep = |key: &str, values: &str| {
        format!("title = \"Runs\"\ncase = \"belt-exponential\"\n[[axis]]\nkey = \"{key}\"\nvalues = [{values}]\n")
    };
    folder.write("runs.toml", sweep("rotor.speed", "0.3, 0.35, 0.4"));
    folder.ok("sweep runs.toml -q");
    let file = folder.sweep_file("runs.h5");
    let path = folder.path("belt.h5");
    let figures = Branches::read(&path).unwrap().with_runs(&file).unwrap().all().unwrap();
    for name in ["branches-amplitude", "branches-period"] {
        let drawn = figures.iter().find(|figure| figure.name == name).unwrap();
        let named = |label: &str| curves(drawn).iter().find(|curve| curve.label == label).unwrap();
        let (runs, branch) = (named("runs of runs"), named("cycles, stable"));
        assert_eq!(runs.points().count(), 3);
        for (x, y) in runs.points() {
            let between = branch
                .pieces
                .iter()
                .flat_map(|piece| piece.windows(2))
                .find_map(|pair| {
                    let share = (x - pair[0].0) / (pair[1].0 - pair[0].0);
                    (0.0..=1.0)
                        .contains(&share)
                        .then(|| pair[0].1 + share * (pair[1].1 - pair[0].1))
                });
            // A straight line between points of the branch.
            let between = between.unwrap();
            assert!((y / between - 1.0).abs() < 0.01, "{name} {x}: {y} {between}");
        }
    }
    let drawn = folder.ok("plot runs.h5 belt.h5 --only branches-amplitude -o a.svg");
    assert_eq!(drawn, "a.svg\n");
    says(
        &String::from_utf8_lossy(&folder.read("a.svg")),
        "runs of runs & cycles, stable",
    );
    // Runs that end before they repeat themselves have no motion to draw, and the legend counts them.
    let ends = "[[axis]]\nkey = \"output.end_time\"\nvalues = [1, 8]\n";
    folder.write("short.toml", sweep("rotor.speed", "0.3, 0.35, 0.4") + ends);
    folder.ok("sweep short.toml -q");
    let file = folder.sweep_file("short.h5");
    let figures = Branches::read(&path).unwrap().with_runs(&file).unwrap().all().unwrap();
    let drawn = figures.iter().find(|figure| figure.name == "branches-period").unwrap();
    let label = "runs of short (without 3 that do not repeat themselves)";
    assert!(curves(drawn).iter().any(|curve| curve.label == label));
    folder.write("other.toml", sweep("stator.damping.0", "1, 2"));
    folder.ok("sweep other.toml -q");
    folder.refused("plot belt.h5 other.h5", "no axis rotor.speed & stator.damping.0");
}

/// The growth rate of steady sliding is half of the missing damping divided by the mass of 1 kg: (alpha (mu_s - mu_d)
/// F_n exp(-alpha v) - c)/2.
#[test]
fn analytic_growth_rates_are_those_of_the_mass() {
    let folder = with_branches();
    let drawn = figure(&folder.path("belt.h5"), "branches-growth_rate");
    let of_steady = curves(&drawn).iter().filter(|curve| curve.label.starts_with("steady"));
    let mut count = 0;
    for (speed, rate) in of_steady.flat_map(Curve::points) {
        let expected = 0.5 * (10.0 * (-5.0 * speed).exp() - 1.0);
        assert!((rate - expected).abs() < 1e-9, "{speed}: {rate} {expected}");
        count += 1;
    }
    assert!(count > 5, "{count}");
}

/// In the plane of belt speed and damping, steady sliding loses its stability on the line v = ln(10/c)/5.
#[test]
fn analytic_the_curve_of_hopf_points_is_the_closed_form() {
    let folder = Folder::new();
    let study = STUDY
        .replace(
            "[branch]",
            "[[axis]]\nkey = \"stator.damping.0\"\nfrom = 0.6\nto = 2\n[branch]\ncurves = [\"hopf\"]",
        )
        .replace("of = [\"steady\", \"cycle\"]", "of = \"steady\"");
    folder.write("two.toml", study);
    folder.ok("continue two.toml -q");
    let figures = Branches::read(&folder.path("two.h5")).unwrap().figures(&[]).unwrap();
    let names: Vec<String> = figures.into_iter().map(|figure| figure.name).collect();
    assert_eq!(names, ["branches-position", "branches-growth_rate", "special-points"]);
    let drawn = figure(&folder.path("two.h5"), "special-points");
    let [curve] = curves(&drawn) else { panic!("one curve") };
    assert_eq!(curve.label, "Hopf");
    let (mut least, mut largest) = (f64::INFINITY, 0.0f64);
    for (speed, damping) in curve.points() {
        assert!((speed - (10.0 / damping).ln() / 5.0).abs() < 1e-9, "{speed} {damping}");
        (least, largest) = (least.min(damping), largest.max(damping));
    }
    assert!(least < 0.61 && largest > 1.99, "{least} {largest}");
    folder.ok("plot two.h5 --only special-points -o plane.svg");
    let svg = folder.text("plane.svg");
    says(&svg, "stator damping & N s/m");
}

/// The page contains every point, and the command of a clicked point computes it.
#[test]
fn cli_the_page_of_branches_has_the_points_and_their_commands() {
    let folder = with_branches();
    folder.ok("plot belt.h5 --html belt.html");
    let page = folder.text("belt.html");
    // The name of the SVG namespace is no address.
    let addresses = |text: &str| page.matches(text).count();
    let found = addresses("http://");
    assert_eq!(found, addresses("http://www.w3.org/2000/svg"), "nothing is loaded");
    assert!(!page.contains("src="), "nothing is loaded");
    let data = document(&page);
    let stored = Stored::read(&folder.path("belt.h5")).unwrap();
    let points: Vec<_> = stored.branches.iter().flat_map(|branch| &branch.points).collect();
    let values: Vec<f64> = points.iter().map(|point| point.value).collect();
    let columns = data["columns"].list();
    assert_eq!(columns[0]["name"], "rotor_speed");
    assert_eq!(doubles(&columns[0]["low"]), values);
    let specials: Vec<Option<Special>> = points.iter().map(|point| point.special).collect();
    let column = &columns[data["marks"][0].whole() as usize];
    let special = |code: &f64| (!code.is_nan()).then(|| Special::ALL[*code as usize]);
    let found = doubles(&column["low"]).iter().map(special).collect::<Vec<_>>();
    assert_eq!(found, specials);
    // Every pair of neighbours of a branch is in one line, and nothing else is.
    let as_array = data["groups"].list();
    let groups: Vec<usize> = as_array.iter().map(|one| one.whole() as usize).collect();
    let mut expected = Vec::new();
    for (branch, first) in stored.branches.iter().zip(groups) {
        assert_eq!(values[first], branch.points[0].value);
        expected.extend((first + 1..first + branch.points.len()).map(|k| (values[k - 1], values[k])));
    }
    let mut drawn = Vec::new();
    for piece in data["lines"].list().iter().flat_map(|line| line["pieces"].list()) {
        let piece = piece.list();
        let piece: Vec<f64> = piece.iter().map(|k| values[k.whole() as usize]).collect();
        drawn.extend(piece.windows(2).map(|pair| (pair[0], pair[1])));
    }
    let sorted = |pairs: Vec<(f64, f64)>| {
        let mut pairs: Vec<_> = pairs.into_iter().map(|(a, b)| (a.min(b), a.max(b))).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        pairs
    };
    assert_eq!(sorted(drawn), sorted(expected));
    // As the page puts it together.
    let command = &data["commands"][1];
    assert_eq!(codes(&data["which"])[0], 1);
    assert_eq!(command["options"][0][0], "--set rotor.speed={0}");
    let modes = command["start"].text().strip_prefix("stickslip ").unwrap();
    let speed = values[0];
    let said = folder.json(&format!("{modes} --set rotor.speed={speed:?}"));
    assert_eq!(said["title"], "Damped mass on a belt, exponential friction");
    // Earlier pages are replaced, other files are not. A single requested quantity is shown first.
    folder.ok("plot belt.h5 --html belt.html --quantity period");
    folder.write("mine.html", "mine");
    folder.refused("plot belt.h5 --html mine.html", "--force");
}
