//! `stickslip plot` with runs of two trains.

use crate::common::cli::{Folder, json, says};
use crate::common::json::*;

fn svg(folder: &Folder, arguments: &[&str]) -> String {
    let drawn: Vec<&str> = [arguments, &["-q", "-o", "figure.svg", "--force"]].concat();
    folder.ok(&[&["plot"][..], &drawn].concat());
    folder.text("figure.svg")
}

/// The figures in --list are those that the run has, and all of them can be drawn.
#[test]
fn cli_plot_of_trains_draws_its_figures() {
    let folder = Folder::new();
    folder.ok("run belt-leine -q");
    let listed = folder.json("plot belt-leine.h5 --list");
    let values = listed.list().iter().map(|e| e["figure"].text());
    let names: Vec<&str> = values.collect();
    let expected = [
        "friction-law",
        "surface-speeds",
        "surface-speeds-close-up",
        "relative-velocity",
        "stick-slip-transition",
        "stick-slip-close-up",
        "stick-slip-end",
        "durations",
        "phase-stick-slip-stator",
        "phase-stick-slip-torque",
        "phase-portrait",
    ];
    assert_eq!(names, expected);
    assert_eq!(listed[5]["title"], "First sticks: relative velocity and forces");
    let document = folder.clean("plot belt-leine.h5 --format svg --json");
    let document = json(&document);
    assert_eq!(document["not_drawn"], serde_json::json!([]));
    let files = document["files"].list();
    assert_eq!(files.len(), names.len());
    for file in files {
        let text = folder.text(file["file"].text());
        let name = file["figure"].text();
        // Names of figures are the same for every run.
        let words = text.replace(name, "").to_lowercase();
        assert!(!words.contains("rad") && !words.contains("torque"), "{name}");
        assert!(text.contains("m/s") || name == "durations", "{name}");
    }
    let law = svg(&folder, &["belt-leine.h5", "--only", "friction-law"]);
    assert!(!law.contains("paper"), "{law}");
    // The period is known, so that the portrait shows the last one.
    let portrait = svg(&folder, &["belt-leine.h5", "--only", "phase-portrait"]);
    assert!(portrait.contains("last period"), "{portrait}");
    assert!(portrait.contains("stator surface position"), "{portrait}");
}

/// Channels of every shaft and inertia have axes with the units of the motion.
#[test]
fn cli_plot_of_trains_draws_any_channel() {
    let folder = Folder::new();
    folder.ok("run drill-string -q --set output.end_time=10");
    let speeds = svg(
        &folder,
        &[
            "drill-string.h5",
            "--channel",
            "rotor_speed_0",
            "--channel",
            "rotor_speed_1",
        ],
    );
    assert!(speeds.contains("rad/s") && speeds.contains("rotor speed 1"), "{speeds}");
    // The common words of both channels are the name of the axis.
    assert!(speeds.contains("rotor speed ("), "{speeds}");
    let phase = svg(
        &folder,
        &["drill-string.h5", "--phase", "rotor_twist_0", "rotor_speed_0"],
    );
    assert!(phase.contains("rotor twist 0") && phase.contains("(rad)"), "{phase}");
    // Ten seconds are fewer than two cycles, so that the portrait shows the whole run.
    let portrait = svg(&folder, &["drill-string.h5", "--only", "phase-portrait"]);
    assert!(!portrait.contains("last period"), "{portrait}");
    folder.refused(
        "plot drill-string.h5 --channel rotor_speed_2",
        "rotor_speed_1 & did you mean",
    );
}

/// Figures that the run cannot have are refused by name, with the reason. Runs without common axes are refused, too.
#[test]
fn cli_plot_of_trains_says_what_it_has_not() {
    let folder = Folder::new();
    folder.ok("run belt-coulomb -q");
    folder.ok("run clutch -q");
    folder.ok("run -q --set output.end_time=0.05 --set output.window=[] --set output.around=none");
    for (figure, words) in [
        ("axial-settling", "axial mode"),
        ("relative-velocity-growth", "stickslip modes"),
        ("surface-speeds-stop", "does not slow down"),
        ("phase-final-stick-stator", "does not slow down"),
        ("phase-plateau", "axial mode"),
        ("phase-stick-slip-rotor", "no shaft"),
        ("rotor-speed", "as it is driven"),
    ] {
        folder.refused(
            &["plot", "belt-coulomb.h5", "--only", figure],
            &[figure, words, "phase-portrait"],
        );
    }
    folder.refused("plot paper.h5 --only phase-portrait", &["slows down by itself"]);
    let both = |first| ["plot", first, "clutch.h5", "--channel", "relative_velocity"];
    folder.refused(&both("belt-coulomb.h5"), &["no axes in common"]);
    // The form of a case is no reason for a refusal.
    let drawn = [&both("paper.h5")[..], &["-q", "-o", "both.svg"]].concat();
    folder.ok(&drawn);
}

/// The page is made with the same command as for a brake, in the units of its motion, with its certificate.
#[test]
fn cli_plot_of_trains_makes_a_page() {
    let folder = Folder::new();
    folder.ok("run clutch -q");
    let (stdout, stderr) = folder.ends("plot clutch.h5 --html page.html", 0);
    assert_eq!((stdout.as_str(), stderr.as_str()), ("page.html\n", ""));
    let page = folder.text("page.html");
    assert!(page.contains("\"certificate\":null") && page.contains("\"N m\""));
    folder.ok("certify clutch.h5 -q");
    let document = folder.json("plot clutch.certified.h5 --html page.html --force");
    assert_eq!(document["page"]["samples"], document["page"]["samples_kept"]);
    let page = folder.text("page.html");
    assert!(page.contains("\"certificate\":{\"attributes\":[["), "no certificate");
}

/// The message names what the samples miss: slips without a sample, and a period with few samples.
#[test]
fn cli_plot_of_trains_says_what_the_samples_miss() {
    let folder = Folder::new();
    folder.ok("run belt-leine -q");
    let speed = svg(&folder, &["belt-leine.h5", "--only", "relative-velocity"]);
    assert!(!speed.contains("straight lines"), "{speed}");
    // A slip takes 4.3 s, so that seven of eight have no sample.
    let sparse = |interval: &str| {
        let interval = format!("output.interval={interval}");
        let far = [
            "run",
            "belt-leine",
            "-q",
            "--force",
            "--set",
            "output.around=none",
            "--set",
            &interval,
        ];
        folder.ok(&far);
    };
    // Two samples in a slip are also too few, because its motion has a period of 6.3 s. A stick is a straight line.
    sparse("2");
    let speed = svg(&folder, &["belt-leine.h5", "--only", "relative-velocity"]);
    says(&speed, &["8 of 8", "\ntoo few samples\n"]);
    sparse("11.9");
    let speed = svg(&folder, &["belt-leine.h5", "--only", "relative-velocity"]);
    assert!(speed.contains("two events with too few samples"), "{speed}");
    let portrait = svg(&folder, &["belt-leine.h5", "--only", "phase-portrait"]);
    assert!(portrait.contains("joined by straight lines"), "{portrait}");
    // A corner belongs to a signal, whatever the signal drives.
    folder.ok("run clutch -q");
    let speed = svg(&folder, &["clutch.h5", "--only", "relative-velocity"]);
    assert!(speed.contains("corner of a signal"), "{speed}");
    assert!(!speed.contains("F(t)"), "{speed}");
}

/// Curves pass through the states at events: here at a restick between a sample in slip and one in stick.
#[test]
fn cli_plot_of_trains_goes_through_events() {
    let folder = Folder::new();
    // Published: belt-leine first sticks at 9.295999525480 s, which is no sample.
    folder.ok("run belt-leine -q --set output.interval=1 --set output.around=none");
    let window = ["--from", "8.5", "--to", "10.5"];
    let draw = |channel: &str| {
        svg(
            &folder,
            &[&["belt-leine.h5", "--channel", channel][..], &window].concat(),
        )
    };
    let points = |text: &str| {
        let lines = text
            .split("points=\"")
            .skip(1)
            .map(|rest| rest.split('"').next().unwrap());
        lines.map(|line| line.split_whitespace().count()).max().unwrap()
    };
    // Samples at 9 and 10 s, and the restick, twice at the same place.
    let (through, past) = (points(&draw("relative_velocity")), points(&draw("dissipated_friction")));
    assert!(through > past, "{through} points, {past} without the event");
}

/// The source of the equations is named for these systems, too. It is not the paper on the brake.
#[test]
fn cli_results_of_trains_cite_their_own_source() {
    let folder = Folder::new();
    folder.ok("run clutch -q");
    let said = folder.ok("inspect clutch.h5 --json");
    assert!(said.contains("docs/theory.md") && !said.contains("9275147"), "{said}");
}

#[test]
fn regression_the_first_wrong_event_of_a_candidate_is_enlarged() {
    let folder = Folder::new();
    folder.ok("run belt-leine -q");
    // With a stiffer spring a cycle is shorter by some hundredths of a second, and the errors of eight cycles add up.
    folder.ok("run belt-leine -q -o mine.h5 --set stator.stiffness=1.003");
    let compared = &folder.json("compare belt-leine.h5 mine.h5")["comparisons"][0];
    let events = compared["event_errors"]["events"].list();
    let error = |event: &serde_json::Value| event["error"].number().abs();
    // A hundredth of the period of the mass on its spring, 2 pi s, or of the time scale of the comparison.
    let scale = compared["time_scale"]["period"].number();
    let wrong = events.iter().find(|event| error(event) > 0.01 * scale).unwrap();
    assert!(wrong["position"] != events.last().unwrap()["position"] && error(wrong) < error(events.last().unwrap()));
    let drawn = [
        "plot",
        "belt-leine.h5",
        "--candidate",
        "mine.h5",
        "--format",
        "svg",
        "-q",
        "-o",
        "drawn",
    ];
    folder.ok(&drawn);
    let figures = |name: &str| {
        let found = std::fs::read_dir(folder.path("drawn")).unwrap();
        let mut paths = found.map(|entry| entry.unwrap().path());
        paths.find(|path| path.to_string_lossy().contains(name))
    };
    let text = std::fs::read_to_string(figures("first-wrong-event").unwrap()).unwrap();
    let title = format!(
        "First wrong event: event {}, a {}",
        wrong["position"],
        wrong["kind"].text()
    );
    assert!(text.contains(&title), "{title}");
    assert!(figures("largest-error").is_none());
}
