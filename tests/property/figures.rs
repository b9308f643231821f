//! Figures: thinning keeps everything visible, and no text covers another text or the data.

use crate::common::cli::Folder;
use proptest::prelude::*;
use stickslip::case::builtin::TRAINS;
use stickslip::plot::branches::Branches;
use stickslip::plot::catalogue::{self, ENTRIES, ExponentialFit};
use stickslip::plot::entry::Subject;
use stickslip::plot::figure::{Cell, ColorKey, Map};
use stickslip::plot::studies::{self, Choice};
use stickslip::plot::thinning::{DecimatedPortrait, MinMax};
use stickslip::plot::{self, Axis, Curve, CurveStyle, Drawing, DrawnRun, ElementForm, Figure, Panel};
use tiny_skia::Rect;

fn curves() -> impl Strategy<Value = Vec<(f64, f64)>> {
    prop::collection::vec((0.0..1.0f64, -1e3..1e3f64), 1..2000).prop_map(|steps| {
        let mut x = 5.0;
        steps
            .into_iter()
            .map(|(dx, y)| {
                // Uneven spacing, with points that coincide.
                x += if dx < 0.2 { 0.0 } else { dx.powi(8) };
                (x, y)
            })
            .collect()
    })
}

proptest! {
    /// In each pixel the first, least, largest and last value are those of the whole curve. Nothing is added, moved or
    /// reordered, and the number of kept points is bounded.
    #[test]
    fn property_thinning_keeps_the_extremes_of_each_pixel(points in curves(), buckets in 1usize..200) {
        let (from, to) = (points[0].0, points[points.len() - 1].0);
        let mut thin = MinMax::new(from, to, buckets);
        points.iter().for_each(|&(x, y)| thin.push(x, y));
        let kept = thin.finish();
        prop_assert!(kept.len() <= 4 * buckets);
        let mut rest = points.iter();
        for point in &kept {
            prop_assert!(rest.any(|p| p == point), "{point:?} is not there, or out of order");
        }
        let pixel = |x: f64| if to > from {
            (((x - from) * (buckets as f64 / (to - from))) as usize).min(buckets - 1)
        } else {
            0
        };
        for bucket in 0..buckets {
            let inside = |list: &[(f64, f64)]| -> Vec<f64> {
                list.iter().filter(|p| pixel(p.0) == bucket).map(|p| p.1).collect()
            };
            let (all, few) = (inside(&points), inside(&kept));
            prop_assert_eq!(all.first(), few.first());
            prop_assert_eq!(all.last(), few.last());
            let largest = |v: &[f64]| v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let least = |v: &[f64]| v.iter().copied().fold(f64::INFINITY, f64::min);
            prop_assert_eq!((least(&all), largest(&all)), (least(&few), largest(&few)));
        }
    }

    /// Every point of a portrait has a drawn point within a cell, 1/900 of each range.
    #[test]
    fn property_portrait_is_drawn_within_a_cell(points in prop::collection::vec((-2.0..3.0f64, 1e-6..2e-6f64), 1..300)) {
        let mut portrait = DecimatedPortrait::new((-2.0, 3.0), (1e-6, 2e-6));
        // The path goes forth and back. Points that are already drawn are not drawn again.
        for &(x, y) in points.iter().chain(points.iter().rev()).chain(&points) {
            portrait.push(x, y);
        }
        let drawn: Vec<(f64, f64)> = portrait.finish().into_iter().flatten().collect();
        let passages = 2 * points.len().saturating_sub(1);
        prop_assert!(drawn.len() <= 2 * passages + 2, "{} of {}", drawn.len(), points.len());
        for (x, y) in points {
            let close = |&&(a, b): &&(f64, f64)| (a - x).abs() <= 5.0 / 900.0 && (b - y).abs() <= 1e-6 / 900.0;
            prop_assert!(drawn.iter().any(|p| close(&p)), "({x}, {y})");
        }
    }

    /// The fit finds an exponential of any factor. Other curves have R^2 below 1.
    #[test]
    fn analytic_exponential_fit(first in 1e-6..1e-3f64, factor in 0.8..1.3f64, count in 3i32..60) {
        let durations: Vec<f64> = (0..count).map(|k| first * factor.powi(k)).collect();
        let fit = ExponentialFit::of(&durations).unwrap();
        prop_assert!((fit.factor - factor).abs() < 1e-9 && (fit.first / first - 1.0).abs() < 1e-9, "{fit:?}");
        prop_assert!(fit.worst < 1e-9, "{fit:?}");
    }
}

/// Boxes of the texts, and of everything else except the white ground, in drawing order.
fn boxes(drawing: &Drawing) -> (Vec<(String, Rect)>, Vec<Rect>) {
    let (mut texts, mut rest) = (Vec::new(), Vec::new());
    for element in &drawing.elements[1..] {
        let place = element.outline().and_then(|outline| outline.compute_tight_bounds());
        match (&element.form, place) {
            (_, None) => {}
            // The ink: the box of the letters.
            (ElementForm::Text(text), Some(place)) => texts.push((text.words.clone(), place)),
            (_, Some(place)) => rest.push(place),
        }
    }
    (texts, rest)
}

/// Whether two boxes overlap by more than 1/20 mm in both directions.
fn overlap(a: &Rect, b: &Rect) -> bool {
    let slack = 5.0;
    a.left() + slack < b.right()
        && b.left() + slack < a.right()
        && a.top() + slack < b.bottom()
        && b.top() + slack < a.bottom()
}

fn assert_readable(figure: &Figure, width: f64) {
    let drawing = plot::draw(figure, width);
    let size = (drawing.size.0 as f32, drawing.size.1 as f32);
    let (texts, paths) = boxes(&drawing);
    let name = format!("{} at {width} mm", figure.name);
    assert!(texts.len() > 6, "{name}: {texts:?}");
    for (k, (words, place)) in texts.iter().enumerate() {
        assert!(!words.trim().is_empty(), "{name}: an empty text");
        let inside = place.left() >= 0.0 && place.top() >= 0.0 && place.right() <= size.0 && place.bottom() <= size.1;
        assert!(inside, "{name}: \"{words}\" leaves the picture: {place:?} in {size:?}");
        for (others, other) in &texts[k + 1..] {
            assert!(!overlap(place, other), "{name}: \"{words}\" covers \"{others}\"");
        }
        for path in &paths {
            assert!(
                !overlap(place, path),
                "{name}: \"{words}\" stands on a line or the ground: {path:?}"
            );
        }
    }
}

/// Samples of a brake with which every figure of the catalogue is drawn.
const WINDOWS: &str = "output.window=[{from=0.998,to=1.012,interval=2e-6},{from=6.96,to=6.992,interval=2.5e-6},\
                       {from=6.992,to=7.3,interval=5e-5}]";

/// Every figure of the catalogue at the width of a column and of a screen, for one run and two, as rendered.
#[test]
fn property_no_text_covers_another_or_the_data() {
    let folder = Folder::new();
    folder.ok(&["run", "-q", "--set", WINDOWS]);
    folder.ok("run paper-si -q");
    let runs = [folder.path("paper.h5"), folder.path("paper-si.h5")].map(|path| DrawnRun::open(&path).unwrap());
    for runs in [&runs[..1], &runs[..]] {
        let subject = Subject::new(runs).unwrap();
        for entry in ENTRIES {
            let figure = entry.build(&subject).unwrap().unwrap();
            for width in [60.0, 85.0, 300.0] {
                assert_readable(&figure, width);
            }
        }
    }
}

/// In every figure of two runs a colour is a run: each curve has the name and the colour of its own, and the line of the
/// second is never solid. Shades and event lines are named after the first run. A portrait shows of each run what its
/// own portrait shows.
#[test]
fn property_two_runs_are_told_apart() {
    let folder = Folder::new();
    folder.ok(&["run", "-q", "--set", WINDOWS]);
    folder.ok(&["run", "paper-si", "-q", "--set", WINDOWS]);
    let runs = [folder.path("paper.h5"), folder.path("paper-si.h5")].map(|path| DrawnRun::open(&path).unwrap());
    let subject = Subject::new(&runs).unwrap();
    let mut portraits = 0;
    for entry in ENTRIES {
        let figure = entry.build(&subject).unwrap().unwrap();
        let mut colors = [None; 2];
        for panel in &figure.panels {
            assert!(panel.modes.is_empty() || panel.shown_of == "paper", "{}", figure.name);
            let of_contact = panel.events.iter().any(|(_, kind)| kind.in_event_sequence());
            assert!(!of_contact, "{}", figure.name);
            for curve in &panel.curves {
                let own = usize::from(curve.label.starts_with("paper-si"));
                assert!(curve.label.starts_with("paper"), "{}: {}", figure.name, curve.label);
                let known = *colors[own].get_or_insert(curve.color);
                assert_eq!(known, curve.color, "{}: {}", figure.name, curve.label);
                let solid = curve.style == CurveStyle::Solid;
                assert!(!(own == 1 && solid), "{}: {}", figure.name, curve.label);
            }
        }
        assert_ne!(colors[0], colors[1], "{}", figure.name);
        if entry.name.starts_with("phase-") {
            let alone = entry.build(&Subject::new(&runs[1..]).unwrap()).unwrap().unwrap();
            let points = |figure: &Figure, label: Option<&str>| -> usize {
                let curves = figure.panels[0].curves.iter();
                let kept = curves.filter(|curve| label.map_or(curve.label != "start", |label| curve.label == label));
                kept.flat_map(Curve::points).count()
            };
            assert_eq!(
                points(&figure, Some("paper-si")),
                points(&alone, None),
                "{}",
                figure.name
            );
            portraits += 1;
        }
    }
    assert!(portraits >= 6, "{portraits}");
}

/// A figure for dark pages has no white and no black, and the same lines.
#[test]
fn property_a_dark_figure_is_the_same_in_other_colours() {
    let line = vec![(0.0, 1.0), (1.0, 3.0)];
    let axis = || Axis::new("x", "s");
    let curve = Curve::line("line", stickslip::plot::style::BLUE, line);
    let figure = Figure::new("one", "One", vec![Panel::new(axis(), axis(), vec![curve])]);
    let light = plot::draw(&figure, 85.0);
    let dark = light.clone().on_dark();
    assert_eq!(
        light.elements.len(),
        dark.elements.len() + 1,
        "the white ground is left out"
    );
    for (one, other) in light.elements[1..].iter().zip(&dark.elements) {
        assert_eq!(format!("{:?}", one.form), format!("{:?}", other.form));
        assert!(![[0; 3], [255; 3]].contains(&other.color), "{:?}", other.form);
        assert_ne!(one.color, other.color, "{:?}", one.form);
    }
}

/// The same for every built-in case outside the brakes, and for a case with so few samples that the titles state it.
#[test]
fn property_no_text_of_trains_covers_another_or_the_data() {
    let folder = Folder::new();
    let built_in = TRAINS.iter().map(|case| (case.name, None));
    let runs = built_in.chain([("belt-leine", Some(["output.interval=5.3", "output.around=none"]))]);
    for (name, sampling) in runs {
        let mut arguments = vec!["run", name, "-q", "--no-witness", "--force", "-o", "run.h5"];
        arguments.extend(sampling.iter().flatten().flat_map(|set| ["--set", set]));
        folder.ok(&arguments);
        let runs = [DrawnRun::open(&folder.path("run.h5")).unwrap()];
        let subject = Subject::new(&runs).unwrap();
        for entry in catalogue::of_run(&runs[0]) {
            let figure = match entry.build(&subject).unwrap() {
                Ok(figure) => figure,
                // A close-up without samples, which are requested.
                Err(absent) => {
                    assert!(sampling.is_some() && absent.window.is_some(), "{name}: {}", absent.why);
                    continue;
                }
            };
            let found = figure.title.contains("straight lines");
            let expected = sampling.is_some() && !["friction-law", "durations"].contains(&entry.name);
            assert_eq!(found, expected, "{name}: {}", figure.title);
            for width in [60.0, 85.0, 300.0] {
                assert_readable(&figure, width);
            }
        }
    }
}

/// Powers of ten over fifteen decades and over none, without an error, and without any data.
#[test]
fn property_work_precision_figures_are_readable() {
    use stickslip::analysis::work_precision::{Knob, Measurement, MethodErrors, PrecisionReference, StudyResult};
    use stickslip::simulation::Method;
    let run = |method, power: i32, error: Option<f64>| Measurement {
        method,
        knob: Knob::Tolerance(10f64.powi(power)),
        failure: None,
        errors: MethodErrors {
            onset: error,
            final_stick: error,
            largest: error,
        },
        events: 1,
        same_sequence: true,
        steps: 1,
        rhs_evaluations: 1000 * (1 << -power),
        jacobian_evaluations: 0,
        wall_time: 0.01 * f64::from(-power),
    };
    let many = Method::all().take(9).flat_map(|method| {
        [-4, -9, -12].map(|power| run(method, power, Some(if power == -12 { 0.0 } else { 10f64.powi(power) })))
    });
    for measurements in [
        many.collect(),
        vec![run(Method::Arkode, -6, Some(1e-9))],
        vec![run(Method::Paper, -6, None)],
        vec![],
    ] {
        let result = StudyResult {
            reference: PrecisionReference {
                description: String::new(),
                events: Vec::new(),
                uncertainties: Vec::new(),
            },
            uncertainty: MethodErrors {
                onset: Some(1e-14),
                final_stick: Some(1e-13),
                largest: Some(2e-13),
            },
            measurements,
            interrupted: false,
        };
        let figure = stickslip::plot::accuracy::work_precision_figure("What the accuracy of the events costs", &result);
        for width in [60.0, 85.0, 300.0] {
            assert_readable(&figure, width);
        }
    }
}

/// Maps with every kind of cell, with codes and with a scale over decades, and a plane of one cell.
#[test]
fn property_maps_are_readable() {
    let scale = |low: f64, high: f64, unit: &str| {
        ColorKey::Scale(Axis {
            range: Some((low, high)),
            logarithmic: low > 0.0 && high > 1e3 * low,
            ..Axis::new("a quantity with a name of several words", unit)
        })
    };
    let codes = [
        "periodic",
        "stuck",
        "not-periodic",
        "steady-slip",
        "steady-stick",
        "steady-separated",
    ];
    let codes = ColorKey::Codes((0..).zip(codes.map(str::to_owned)).collect());
    let cells = |columns: usize, rows: usize, value: &dyn Fn(usize) -> f64| -> Vec<Cell> {
        let cell = |k: usize| match k % 11 {
            3 => Cell::Failed,
            5 => Cell::Missing,
            7 => Cell::Nothing,
            _ => Cell::Value(value(k)),
        };
        (0..columns * rows).map(cell).collect()
    };
    let keys: [(ColorKey, &dyn Fn(usize) -> f64); 5] = [
        (codes, &|k| (k % 6) as f64),
        (scale(0.0, 563.0, "1"), &|k| (k * 7 % 564) as f64),
        (scale(6.9746, 6.9771, "s"), &|k| 6.9746 + 1e-5 * (k % 200) as f64),
        (scale(1e-14, 3e-2, "J"), &|k| 10f64.powf(-14.0 + 0.1 * (k % 110) as f64)),
        (scale(4.0, 4.0, "rad s-1"), &|_| 4.0),
    ];
    for (key, value) in keys {
        for (columns, rows) in [(1, 1), (13, 9), (90, 40)] {
            let edges = |count: usize| (0..=count).map(|k| 0.5 + k as f64).collect::<Vec<f64>>();
            let axis = |count: usize, name: &str, unit: &str| Axis {
                range: Some((0.5, 0.5 + count as f64)),
                ..Axis::new(name, unit).with_symbol("c_t")
            };
            let panel = |caption: &str| Panel {
                caption: caption.to_owned(),
                map: Some(Map {
                    x_edges: edges(columns),
                    y_edges: edges(rows),
                    cells: cells(columns, rows, value),
                    key: key.clone(),
                }),
                ..Panel::new(
                    axis(columns, "friction decay", "s/rad"),
                    axis(rows, "torsional damping", "N m s/rad"),
                    vec![],
                )
            };
            let captions: &[&str] = if rows == 9 {
                &["δ = 1e-8 rad/s", "δ = 1e-4 rad/s"]
            } else {
                &[""]
            };
            let figure = Figure {
                name: format!("map-{columns}-{rows}"),
                title: "A study with a title of its own: what is drawn of it".to_owned(),
                paper_figure: None,
                panels: captions.iter().map(|caption| panel(caption)).collect(),
            };
            for width in [60.0, 85.0, 300.0] {
                assert_readable(&figure, width);
            }
        }
    }
}

/// Every figure of files with many runs, and of a certificate.
#[test]
fn property_figures_of_studies_are_readable() {
    let folder = Folder::new();
    let short = "[set]\nsolver.method = \"series\"\ninitial.speed = 3\nactuation = { profile = \"ramp\", force = 2225, \
                 rise_time = 0.02 }\nperturbation = [{ kind = \"kick\", time = \"instability\", relative_velocity = 1e-4 }]\n";
    let axis = |key: &str, rest: &str| format!("[[axis]]\nkey = \"{key}\"\n{rest}\n");
    let decay = axis("friction.decay", "from = 1\nto = 60\ncount = 5\nspacing = \"log\"");
    let damping = axis("torsion.damping", "values = [18, 20, 22, 25]");
    let kick = axis("perturbation.0.relative_velocity", "values = [1e-6, 1e-4]");
    let sampled = "[sample]\nmethod = \"sobol\"\ncount = 16\n[[axis]]\nkey = \"friction.decay\"\nfrom = 4\nto = 6\n[[axis]]\n\
                   key = \"perturbation.0.relative_velocity\"\nfrom = 1e-7\nto = 1e-3\nspacing = \"log\"\n";
    for (name, study) in [
        ("line", decay.clone()),
        ("map", format!("{decay}{damping}{kick}")),
        ("sample", sampled.to_owned()),
    ] {
        folder.write(
            &format!("{name}.toml"),
            format!("title = \"{name}\"\ncase = \"paper\"\n{short}{study}"),
        );
        folder.ok(&["sweep", &format!("{name}.toml"), "-q", "-j", "1"]);
        let file = folder.sweep_file(&format!("{name}.h5"));
        let quantities = ["stick_count", "onset_time", "energy_residual"].map(str::to_owned);
        let choice = Choice {
            quantities: quantities.to_vec(),
            ..Choice::default()
        };
        for figure in studies::figures(&file, &choice).unwrap() {
            for width in [60.0, 85.0, 300.0] {
                assert_readable(&figure, width);
            }
        }
    }
    let calibration = "title = \"two inertias\"\ncase = \"paper\"\n[set]\noutput.end_time = 0.02\n\"actuation.rise_time\" = 0.01\n\
                       perturbation = []\n[[free]]\nkey = \"torsion.surface_inertia\"\nfrom = 0.005\nto = 0.03\n[[free]]\n\
                       key = \"torsion.stiffness\"\nfrom = 1e5\nto = 2e7\nspacing = \"log\"\n[[target]]\n\
                       quantity = \"natural_period\"\nvalue = \"0.00024 s\"\n[search]\npoints = 32\nstarts = 2\n";
    folder.write("two.toml", calibration);
    folder.ok("calibrate two.toml -q -j 1");
    let file = folder.sweep_file("two.h5");
    let mut figures = studies::figures(&file, &Choice::default()).unwrap();
    let study = "title = \"branches\"\ncase = \"belt-exponential\"\n[branch]\nof = [\"steady\", \"cycle\"]\npoints = 12\n\
                 step = 0.1\ncurves = [\"hopf\"]\n[[axis]]\nkey = \"rotor.speed\"\nfrom = 0.25\nto = 0.6\n[[axis]]\n\
                 key = \"stator.damping.0\"\nfrom = 0.6\nto = 2\n";
    folder.write("branches.toml", study);
    folder.ok("continue branches.toml -q");
    figures.extend(Branches::read(&folder.path("branches.h5")).unwrap().all().unwrap());
    folder.ok("certify belt-coulomb -q");
    let runs = [DrawnRun::open(&folder.path("belt-coulomb.certified.h5")).unwrap()];
    let subject = Subject::new(&runs).unwrap();
    for name in ["event-uncertainties", "error-bands"] {
        figures.push(catalogue::find(name).unwrap().build(&subject).unwrap().unwrap());
    }
    for figure in figures {
        for width in [60.0, 85.0, 300.0] {
            assert_readable(&figure, width);
        }
    }
}

/// Numbers with many digits, long names, characters that SVG reserves, and no data at all.
#[test]
fn property_odd_figures_are_readable_too() {
    let curve = |points: Vec<(f64, f64)>| Curve::line("a <&> b", stickslip::plot::style::BLUE, points);
    let ranges = [
        vec![(-1e-30, 5e300), (3e-30, 5.1e300)],
        vec![(1e9, 371.123456789), (1e9 + 1e-3, 371.12345679)],
        vec![(0.0, 0.0)],
        vec![(0.0, -0.0), (1.0, 0.0)],
        vec![],
    ];
    for points in ranges {
        for unit in ["1", "rad s-1", "N"] {
            let axis = || Axis::new("a quantity whose name is much longer than any axis", unit).with_symbol("Ω");
            let figure = Figure {
                name: "odd".to_owned(),
                title: "A title that needs more than one line at the width of a column: <svg> & \"co\"".to_owned(),
                paper_figure: Some(99),
                panels: vec![Panel::new(axis(), axis(), vec![curve(points.clone())])],
            };
            assert_readable(&figure, 85.0);
        }
    }
}
