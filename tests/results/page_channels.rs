//! The interactive page of two trains contains the data of the result file, with the words and units of its motion.

use crate::common::cases::parsed;
use crate::common::json::*;
use crate::common::unlocked;
use std::path::{Path, PathBuf};

use crate::common::page::{Page, assert_decoded, doubles};
use stickslip::analysis::SavedRun;
use stickslip::analysis::headline::{headline, of_file};
use stickslip::case::{Case, CaseSource, Origin, Override};
use stickslip::plot::page::{self, SIZE_LIMIT};
use stickslip::results::ResultFile;
use tempfile::TempDir;

/// A case of two trains whose contact opens, because the normal force is negative for half of the time.
const OPENING: &str = r#"motion = "translation"

[rotor]
end = "driven"
speed = "0.2 m/s"

[stator]
inertia = [1.0, 2.0]
stiffness = [40.0, 60.0]
damping = [0.1, 0.1]
end = "fixed"

[contact]
normal_force = { profile = "cosine", amplitude = 10.0, angular_frequency = 3.0 }

[friction]
law = "coulomb"
breakaway = 0.4
kinetic = 0.3

[[perturbation]]
time = 0.2
relative_velocity = 1e-3
on = "stator"

[output]
end_time = 10
"#;

fn source(name: &str) -> CaseSource {
    match name {
        "opening" => CaseSource {
            text: OPENING.to_owned(),
            origin: Origin::File(PathBuf::from("opening.toml")),
        },
        name => CaseSource::built_in(name).unwrap(),
    }
}

fn page_of(folder: &TempDir, name: &str, overrides: &[&str]) -> (Case, ResultFile, Page) {
    let overrides = parsed(overrides);
    let case = Case::read(&source(name), &overrides).unwrap_or_else(|error| panic!("{error}"));
    let path = folder.path().join(format!("{name}.h5"));
    SavedRun::new(&case, &path).start().unwrap();
    let (file, page) = read(&path);
    (case, file, page)
}

fn read(path: &Path) -> (ResultFile, Page) {
    let file = ResultFile::open(path).unwrap();
    let target = path.with_extension("html");
    page::write(&file, None, &target, false).unwrap_or_else(|error| panic!("{error}"));
    (file, Page::read(&target))
}

/// Columns of a file's trajectory that its page omits, because another column repeats them or they are always zero.
const LEFT_OUT: [&str; 9] = [
    "time",
    "mode",
    "segment",
    "rotor_twist",
    "rotor_twist_rate",
    "z",
    "z_dot",
    "applied_force",
    "work_perturbation",
];

/// Every column of the file is on the page sample by sample, in a panel, and on both sides of every event.
#[test]
fn results_page_of_trains_has_every_channel() {
    let folder = tempfile::tempdir().unwrap();
    for (name, overrides, motion) in [
        ("drill-string", &["output.end_time=40"][..], "rotation"),
        ("belt-leine", &["output.end_time=30"], "translation"),
        ("lugre-slider", &["output.end_time=10"], "translation"),
        ("groan", &["output.end_time=0.6"], "rotation"),
        ("opening", &[], "translation"),
    ] {
        let (case, file, page) = page_of(&folder, name, overrides);
        assert_eq!(case.motion().name(), motion);
        let rows = file.sample_count().unwrap();
        let channels = page.channel_names();
        for variable in file.contents().unwrap().variables {
            let Some(name) = variable.name.trim_start_matches("/").strip_prefix("trajectory/") else {
                continue;
            };
            let kick = name == "work_perturbation" && !case.system.kicks.is_empty();
            let expected = kick || !LEFT_OUT.contains(&name);
            assert_eq!(channels.iter().any(|channel| channel == name), expected, "{name}");
        }
        for channel in page.trajectory["channels"].list() {
            let name = channel["name"].text();
            let stored = file.column(name, 0..rows).unwrap();
            assert_decoded(name, &page.channel(name).0, &stored, page.block());
            let panels = page.run["panels"].list();
            let mut curves = panels.iter().flat_map(|panel| panel["curves"].list());
            assert!(curves.any(|curve| curve["name"] == name), "{name} is in no panel");
            let unit = channel["unit"].text();
            let wanted = motion == "rotation" && !["N", "J", "W"].contains(&unit);
            assert_eq!(unit.contains("rad") || unit == "N m", wanted, "{name}: {unit}");
        }
        let states = page.run["events"]["states"].list();
        assert!(states.len() > 5);
        for state in states {
            let name = state["name"].text();
            // By the equations, for the states that the file has.
            let forces = ["normal_force", "friction_torque", "transmitted_torque", "contact_power"];
            if forces.contains(&name) || name.starts_with("energy_") {
                assert_eq!(doubles(&state["before"]).len(), file.events().unwrap().len(), "{name}");
                continue;
            }
            for side in ["before", "after"] {
                let stored = file.event_column(&format!("{name}_{side}")).unwrap();
                assert_eq!(doubles(&state[side]), stored, "{name}");
            }
        }
        let further = ["rotor_speed_1", "stator_twist_1", "bristle_deflection"];
        let kept = further.iter().filter(|name| channels.iter().any(|c| c == **name));
        let present: Vec<&&str> = kept.collect();
        let expected: &[&str] = match name {
            "drill-string" | "groan" => &["rotor_speed_1"],
            "lugre-slider" => &["bristle_deflection"],
            "opening" => &["stator_twist_1"],
            _ => &[],
        };
        assert!(present.iter().copied().eq(expected.iter()), "{name}: {present:?}");
        assert_eq!(page.html.matches("<script").count(), 3);
        assert!(page.html.len() < SIZE_LIMIT);
    }
}

/// The table contains the numbers that `run` prints, with the digits that are known.
#[test]
fn results_page_of_trains_says_what_the_run_comes_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("belt-leine.h5");
    let case = Case::read(&source("belt-leine"), &[]).unwrap();
    let report = SavedRun::new(&case, &path).start().unwrap();
    let (_, page) = read(&path);
    let said = headline(&case, &report.run.summary);
    let as_array = page.run["headline"].list().iter();
    let shown: Vec<(&str, &str)> = as_array.map(|row| (row["name"].text(), row["value"].text())).collect();
    let said: Vec<(&str, &str)> = said.iter().map(|row| (row.name, row.value.as_str())).collect();
    assert_eq!(shown, said);
    let value = |name: &str| shown.iter().find(|row| row.0 == name).unwrap().1;
    // Published with twelve digits: the period and the largest position. The period of `auto` is 8e-12 s too long, so
    // that its last digit is rounded up.
    assert_eq!(&value("period")[..13], "12.0010312948");
    assert!(
        value("position over a period").contains("1.133944676442 m (stator)"),
        "{}",
        value("position over a period")
    );
    assert_eq!(value("sticks in a period"), "1");
    // A cycle is a stick and the slip after it.
    let cycles = &page.run["cycles"];
    let (sticks, slips) = (doubles(&cycles["stick_duration"]), doubles(&cycles["slip_duration"]));
    assert_eq!(sticks.len(), 7);
    // Published: 7.705031769350 and 4.295999525480. A run is within 1e-9 s of the exact solution.
    assert!(sticks.iter().all(|d| (d - 7.705031769350).abs() < 1e-9), "{sticks:?}");
    assert!(slips.iter().all(|d| (d - 4.295999525480).abs() < 1e-9), "{slips:?}");
    for absent in ["Axial displacement", "T_r + T_s", "growth exponent"] {
        assert!(!page.html.contains(absent), "{absent}");
    }
    assert!(!page.trajectory.to_string().contains("rad"));
    assert_eq!(page.run["beside_paper"], false);
}

/// With bristles there is no stick. A bounce across the threshold is counted, and the table says so.
#[test]
fn results_page_of_bristles_counts_falls_below_the_threshold() {
    let folder = tempfile::tempdir().unwrap();
    let (.., page) = page_of(&folder, "lugre-slider", &[]);
    let rows = page.run["headline"].list();
    let value = |name: &str| {
        rows.iter()
            .find(|row| row["name"] == name)
            .map(|row| row["value"].text())
    };
    assert_eq!(value("sticks in a period"), None);
    // A stop of 3.43 s, followed by one bounce across the threshold.
    assert_eq!(value("falls below the threshold in a period"), Some("2"));
    assert!(value("counted as a stick").unwrap().contains("each fall"));
    assert!(page.run["breakaway_arms"].is_null());
}

/// The orbit is the last period, from samples and the states at events. It is closed, and passes through these
/// states.
#[test]
fn results_page_of_trains_shows_one_period() {
    let folder = tempfile::tempdir().unwrap();
    // Sparse samples: some thirty in a period, none of them at an event.
    let (_, file, page) = page_of(&folder, "belt-leine", &["output.interval=0.4001", "output.around=none"]);
    let orbit = &page.run["orbit"];
    let period = orbit["period"].number();
    assert!((period - 12.00103129483).abs() < 1e-9, "{period}");
    let span = orbit["to"].number() - orbit["from"].number();
    assert!(span >= period && span <= period + 0.41, "{span}");
    assert_eq!(orbit["x"]["unit"], "m");
    assert_eq!(orbit["y"]["unit"], "m s-1");
    let lines = orbit["lines"].list();
    let points: Vec<(f64, f64)> = lines
        .iter()
        .flat_map(|line| doubles(&line["x"]).into_iter().zip(doubles(&line["y"])))
        .collect();
    // The last breakaway and the last stop are on the orbit, as in the file.
    let (x, v) = ("phi1_after", "relative_velocity_after");
    let (x, v) = (file.event_column(x).unwrap(), file.event_column(v).unwrap());
    for k in x.len() - 2..x.len() {
        // To within a cell of the portrait, 1/900 of the range.
        assert!(
            points
                .iter()
                .any(|p| (p.0 - x[k]).abs() < 2e-3 && (p.1 - v[k]).abs() < 2e-3),
            "event {k} at ({}, {})",
            x[k],
            v[k]
        );
    }
    // Published: the restick is at x = -0.541006353870.
    assert!(
        points
            .iter()
            .any(|p| (p.0 + 0.541006353870).abs() < 1e-6 && p.1.abs() < 1e-9)
    );
    assert!(page.html.contains("joined by straight lines"));
    // One that does not repeat itself has no such view.
    let (.., page) = page_of(&folder, "groan", &["output.end_time=0.6"]);
    assert!(page.run["orbit"]["period"].is_null());
}

/// 20,000 cycles in 200,000 samples: the page stays below its limit, says what it omits, and has the last period
/// unchanged.
#[test]
fn results_page_of_a_long_driven_run_is_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let overrides = [
        "output.end_time=13425",
        "output.interval=0.067",
        "output.around=none",
        "solver.max_events=1000000",
    ];
    let (_, file, page) = page_of(&folder, "belt-coulomb", &overrides);
    assert!(page.html.len() < SIZE_LIMIT, "{}", page.html.len());
    let listed = doubles(&page.run["events"]["time"]).len();
    let states = page.run["events"]["states"].list().len();
    assert!(listed <= 5_000, "{listed} events, {states} states");
    assert!(listed * states <= 100_000, "{listed} events, {states} states");
    let notes = format!("{}{}", page.run["notes"], page.trajectory["notes"]);
    let events = file.events().unwrap().len();
    assert!(events >= 40_000, "{notes}");
    assert!(notes.contains(&format!("first {listed} of {events} events")), "{notes}");
    assert!(notes.contains("and those of the last period"), "{notes}");
    let rows = file.sample_count().unwrap();
    let times = file.column("time", 0..rows).unwrap();
    let entries = page.entries(&times);
    assert_eq!(entries.last().unwrap().0.end, rows);
    let last_period = times[rows - 1] - 0.6712388980384691;
    for (range, bucket) in &entries {
        assert!(
            !bucket || times[range.end - 1] < last_period,
            "a band at {}",
            times[range.start]
        );
    }
    let (low, high) = page.channel("relative_velocity");
    // Every extreme is there. Exact for this belt: v_max = v + sqrt(v^2 + (w D/k)^2).
    let all = file.column("relative_velocity", 0..rows).unwrap();
    let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let shown = low.iter().chain(&high).copied().fold(f64::NEG_INFINITY, f64::max);
    assert!((most - shown).abs() <= 1e-7 * most, "{most} {shown}");
}

/// A file of a version without the extremes of the relative velocity is shown without them.
#[test]
fn results_page_of_a_file_without_later_attributes() {
    let folder = tempfile::tempdir().unwrap();
    let (case, file, _) = page_of(&folder, "belt-leine", &["output.end_time=60"]);
    let rows = of_file(&file, Some(&case), &file.events().unwrap()).unwrap();
    assert!(rows.iter().any(|row| row.name == "relative velocity over a period"));
    let path = file.path().to_owned();
    drop(file);
    let open = unlocked::open_rw(&path).unwrap();
    let group = open.group("stick_slip").unwrap();
    for end in ["min", "max"] {
        group
            .delete_attr(&format!("attractor_relative_velocity_{end}"))
            .unwrap();
    }
    drop((group, open));
    let (_, page) = read(&path);
    let rows = page.run["headline"].list();
    assert!(rows.iter().all(|row| row["name"] != "relative velocity over a period"));
    assert!(rows.iter().any(|row| row["name"] == "period"));
}

/// The texts on a brake's page are unchanged.
#[test]
fn regression_page_of_a_brake_has_its_words() {
    let folder = tempfile::tempdir().unwrap();
    let case = stickslip::case::Case::read(
        &CaseSource::built_in("paper").unwrap(),
        &[
            Override::parse("output.end_time=0.01").unwrap(),
            Override::parse("output.window=[]").unwrap(),
            Override::parse("output.around=none").unwrap(),
        ],
    )
    .unwrap();
    let path = folder.path().join("paper.h5");
    SavedRun::new(&case, &path).start().unwrap();
    let (_, page) = read(&path);
    let panels = page.run["panels"].list();
    // Title, curves as (channel, legend, colour, limit), and the initial state of the panel.
    let said = |number: usize| {
        let (panel, curves) = (&panels[number], panels[number]["curves"].list());
        let curve = |curve: &serde_json::Value| {
            let text = |key: &str| curve[key].text().to_owned();
            format!(
                "{}: {}, {}, {}",
                text("name"),
                text("label"),
                text("colour"),
                curve["limit"]
            )
        };
        let (title, shown, change) = (panel["title"].text(), &panel["shown"], &panel["change"]);
        format!(
            "{title}; {}; {shown}, {change}",
            curves.iter().map(curve).collect::<Vec<_>>().join("; ")
        )
    };
    assert_eq!(
        said(0),
        "Speed; theta_dot: rotor, blue, false; phi2_dot: rotor surface, vermillion, false; phi1_dot: stator surface, green, false; \
         true, false"
    );
    assert!(
        said(3).ends_with("; breakaway_torque_backward: −μ₀ r F_n, purple, true; true, false"),
        "{}",
        said(3)
    );
    assert!(
        said(5).ends_with("; work_applied: work of F, purple, false; true, true"),
        "{}",
        said(5)
    );
    // A channel whose panel has no place of its own comes last.
    let expected = "Contact power; contact_power: heat of friction, vermillion, false; false, false";
    assert_eq!(said(panels.len() - 1), expected);
    let expected = "Slip displacement; slip_displacement: φ₂ − φ₁, blue, false; false, false";
    assert_eq!(said(panels.len() - 2), expected);
    let friction = &page.run["portraits"][2];
    let found = (&friction["x"]["name"], &friction["x"]["label"]);
    assert_eq!(found, (&"relative_velocity".into(), &"ωᵣ".into()));
    let found = (&friction["y"]["label"], &friction["y"]["jumps"]);
    assert_eq!(found, (&"torque".into(), &true.into()));
    assert_eq!(page.run["portraits"][1]["heading"], "Rotor twist");
    assert_eq!(page.run["torque_unit"], "N m");
    assert!(page.run["orbit"].is_null() && !page.html.contains("{{"));
    for words in ["\"slip-backward\": \"backward\", ", "--backward: #f4e2ec;"] {
        assert!(page.html.contains(words), "{words}");
    }
}
