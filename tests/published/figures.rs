//! Data of the figures, compared with the paper's statements about its own.

use crate::common::cli::Folder;
use std::sync::OnceLock;
use stickslip::analysis::stability::Modes;
use stickslip::friction::Law;
use stickslip::model::system::Pressing;
use stickslip::plot::catalogue::{ENTRIES, ExponentialFit, find};
use stickslip::plot::entry::Subject;
use stickslip::plot::figure::CurveStyle;
use stickslip::plot::portraits::Turns;
use stickslip::plot::portraits::turn_amplitudes;
use stickslip::plot::{Curve, DrawnRun, Figure, own};
use stickslip::signal::{Ramp, Signal};

/// The paper's run, with dense samples at the plateau, in the stick-slip and in the last stick.
fn file() -> &'static std::path::Path {
    static FILE: OnceLock<(Folder, std::path::PathBuf)> = OnceLock::new();
    let (_, path) = FILE.get_or_init(|| {
        let folder = Folder::new();
        folder.ok("run -q");
        let path = folder.path("paper.h5");
        (folder, path)
    });
    path
}

fn figure(name: &str) -> Figure {
    let runs = [DrawnRun::open(file()).unwrap()];
    let subject = Subject::new(&runs).unwrap();
    find(name).unwrap().build(&subject).unwrap().unwrap()
}

fn points(figure: &Figure, label: &str) -> Vec<(f64, f64)> {
    let curves = &figure.panels[0].curves;
    let found = curves.iter().find(|curve| curve.label.starts_with(label));
    found
        .map(|curve| curve.points().collect())
        .unwrap_or_else(|| panic!("no curve {label}"))
}

/// Fig. 4: 0.6 at rest, falling to 0.3 at high speed.
#[test]
fn published_friction_law() {
    let law = points(&figure("4"), "sliding");
    assert_eq!(law[0], (0.0, 0.6));
    assert!((law[law.len() - 1].1 - 0.3).abs() < 1e-3);
    assert!(law.windows(2).all(|p| p[1].1 < p[0].1));
}

/// Fig. 5: a ramp to a plateau at 0.0402 mm. The oscillation after the end of the ramp has 13 nm.
#[test]
fn published_axial_plateau() {
    let z = points(&figure("5"), "");
    let plateau: Vec<f64> = z.iter().filter(|p| p.0 > 1.02).map(|p| p.1).collect();
    assert!(plateau.len() > 50);
    for value in plateau {
        assert_eq!(format!("{:.4}", -value * 1e3), "0.0402");
    }
    // The ramp is a straight line except for the lag c_a/k_e of 0.16 ms.
    let half = z
        .iter()
        .min_by(|a, b| (a.0 - 0.5).abs().total_cmp(&(b.0 - 0.5).abs()))
        .unwrap();
    assert!((half.1 * 1e3 + 0.0201).abs() < 2e-5, "{half:?}");
}

/// Rotor speed: at the plateau of the force and the high-speed value of friction, rotor and rotor surface slow down
/// uniformly by mu_d r F_0/(I + J).
#[test]
fn analytic_rotor_speed_falls_evenly() {
    let speed = points(&figure("rotor-speed"), "");
    let between: Vec<(f64, f64)> = speed.into_iter().filter(|p| p.0 > 2.0 && p.0 < 6.0).collect();
    let (first, last) = (between[0], between[between.len() - 1]);
    let system = DrawnRun::open(file()).unwrap().system;
    let Pressing::Axial {
        actuation: Signal::Ramp(Ramp { value: force, .. }),
        ..
    } = system.pressing
    else {
        panic!("the paper's case has a ramp");
    };
    let inertia: f64 = system.rotor.inertia.iter().sum();
    let expected = system.law.as_exponential().unwrap().high_speed * system.radius * force / inertia;
    let slope = (first.1 - last.1) / (last.0 - first.0);
    // From 7.7 rad/s on, the exponential of the friction law is below 2e-17. The run's tolerance of 1e-10 remains.
    assert!((slope / expected - 1.0).abs() < 1e-9, "{slope} {expected}");
    for p in &between {
        let line = first.1 - slope * (p.0 - first.0);
        assert!((p.1 - line).abs() < 1e-9 * first.1, "{p:?} {line}");
    }
}

/// Between the first and the last stick, the drawn relative velocity is 0 in stick, and falls from slip to slip.
#[test]
fn property_stick_slip_is_drawn_with_falling_slips() {
    let velocity = points(&figure("stick-slip-transition"), "");
    let run = DrawnRun::open(file()).unwrap();
    let mut largest = f64::INFINITY;
    let cycles = &run.cycles;
    let mut start = run.stick_slip.onset_time.unwrap();
    for cycle in cycles {
        let (slip, end) = (start + cycle.stick_duration, start + cycle.period);
        let within = |from: f64, to: f64| velocity.iter().filter(move |p| p.0 > from && p.0 < to).map(|p| p.1);
        // Rounding of phi_2' - phi_1' at speeds of 0.5 rad/s.
        assert!(within(start, slip).count() > 5 && within(start, slip).all(|w| w.abs() < 1e-15));
        let peak = within(slip, end).fold(0.0, f64::max);
        assert!(peak > 0.0 && peak < largest, "{peak} after {largest}");
        (start, largest) = (end, peak);
    }
    assert_eq!(cycles.len(), 47);
}

/// The interface torque jumps at the start of a stick. In a portrait, slip shows only the friction law, and no line
/// leads from it to the holding torque.
#[test]
fn analytic_torque_in_slip_is_the_friction_law() {
    let runs = [DrawnRun::open(file()).unwrap()];
    let axes = ("relative_velocity", "friction_torque");
    let figure = own::phase(&runs, "law", "law", axes, (6.97, 6.99)).unwrap();
    let system = &runs[0].system;
    let force = runs[0].curves(&["normal_force"], (6.97, 6.99)).unwrap()[0][0].1;
    let slip = points(&figure, "slip-forward");
    assert!(slip.len() > 100);
    for (velocity, torque) in slip {
        let law = system.law.coefficient(velocity) * system.radius * force;
        // Rounding of the contact force, some of its digits at the plateau.
        assert!((torque - law).abs() < 1e-9 * law, "{torque} at {velocity}, not {law}");
    }
    // Sticks have zero velocity, and torques from the one after a stop to the limit.
    assert!(points(&figure, "stick").iter().all(|p| p.0.abs() < 1e-15));
    // A window that ends with an event shows the state at this event.
    let onset = runs[0].stick_slip.onset_time.unwrap();
    let figure = own::phase(&runs, "law", "law", axes, (6.97, onset)).unwrap();
    let mut curves = figure.panels[0].curves.iter();
    let end = curves.find(|curve| curve.style == CurveStyle::Solid);
    let end = end.and_then(|curve| curve.points().last()).unwrap().0;
    assert!(end.abs() < 1e-12, "{end}");
}

/// The manual names every figure.
#[test]
fn property_the_manual_names_every_figure() {
    let text = include_str!("../../docs/reference/figures.md");
    for entry in ENTRIES {
        assert!(text.contains(&format!("`{}`", entry.name)), "{}", entry.name);
    }
}

/// Fig. 15: slips are constant within 10 %, and sticks grow from the second one. The cycles are those of the file.
#[test]
fn published_durations() {
    let figure = figure("15");
    let (sticks, slips) = (points(&figure, "sticks"), points(&figure, "slips"));
    assert_eq!((sticks.len(), slips.len()), (47, 47));
    let mean = slips.iter().map(|p| p.1).sum::<f64>() / 47.0;
    assert!(slips.iter().all(|p| (p.1 / mean - 1.0).abs() < 0.1));
    assert!(sticks[1..].windows(2).all(|pair| pair[1].1 > pair[0].1));
    // The paper's values: first stick 0.05 ms, slips 0.19 ms.
    assert_eq!(format!("{:.2}", sticks[0].1 * 1e3), "0.05");
    assert_eq!(format!("{:.2}", slips[0].1 * 1e3), "0.19");
    // "Almost exponentially": the last sticks grow faster than an exponential that fits all.
    let exponential = points(&figure, "exponential");
    let off = |k: usize| sticks[k].1 / exponential[k].1 - 1.0;
    assert!(off(46) > 0.5);
    // A single exponential fits the second to the thirtieth stick.
    let durations: Vec<f64> = sticks[1..30].iter().map(|p| p.1).collect();
    let fit = ExponentialFit::of(&durations).unwrap();
    assert!(fit.worst < 0.05 && fit.r_squared > 0.98, "{fit:?}");
}

/// Amplitude of each turn in the drawn points of a portrait.
fn drawn_amplitudes(figure: &Figure) -> Vec<f64> {
    let mut turns = Turns::default();
    figure.panels[0]
        .curves
        .iter()
        .filter(|curve| curve.style == CurveStyle::Solid)
        .flat_map(Curve::points)
        .for_each(|p| turns.push(p.1));
    // Turns smaller than a point of the picture are thinned out.
    let amplitudes = turns.amplitudes();
    let largest = amplitudes.iter().fold(0.0, |a: f64, &b| a.max(b));
    amplitudes.into_iter().filter(|a| *a > 1e-4 * largest).collect()
}

fn assert_spiral(name: &str, least_turns: usize, grows: bool) {
    let figure = figure(name);
    let amplitudes = drawn_amplitudes(&figure);
    assert!(amplitudes.len() >= least_turns, "{name}: {amplitudes:?}");
    for pair in amplitudes.windows(2) {
        assert_eq!(pair[1] > pair[0], grows, "{name}: {amplitudes:?}");
    }
    assert!(
        figure.title.contains(if grows { "diverges" } else { "converges" }),
        "{}",
        figure.title
    );
}

/// Fig. 17 converges after the force has reached its plateau, Fig. 19 diverges before the first stick, and Fig. 22
/// converges in the last stick.
#[test]
fn published_spirals_converge_diverge_converge() {
    assert_spiral("phase-axial", 2, false);
    for surface in ["stator", "rotor"] {
        assert_spiral(&format!("phase-growth-{surface}"), 5, true);
        assert_spiral(&format!("phase-final-stick-{surface}"), 15, false);
    }
}

/// Within the last stick, the swing decays as given by the slow mode of stick, exp(2 pi Re lambda/Im lambda) per turn,
/// after the first turns, in which the mode of the surfaces decays.
#[test]
fn analytic_last_stick_decays_as_its_mode() {
    let run = DrawnRun::open(file()).unwrap();
    let start = run.stick_slip.final_stick_time.unwrap() + 0.02;
    let amplitudes = turn_amplitudes(&run, "phi1_dot", (start, start + 0.1)).unwrap();
    let states = Modes::linear(&run.system).states;
    let modes = &states.iter().find(|state| state.state == "stick").unwrap().modes;
    let slowest = modes.iter().filter(|mode| mode.frequency.is_some());
    let rotor = slowest
        .min_by(|a, b| a.frequency.unwrap().total_cmp(&b.frequency.unwrap()))
        .unwrap();
    let natural = std::f64::consts::TAU * rotor.frequency.unwrap();
    let damped = (natural * natural - rotor.decay * rotor.decay).sqrt();
    let expected = (-std::f64::consts::TAU * rotor.decay / damped).exp();
    let factor = stickslip::plot::portraits::factor_per_turn(&amplitudes).unwrap();
    // A hundred samples per turn meet the extremes within (pi/100)^2/2, over 18 turns.
    assert!((factor - expected).abs() < 1e-4, "{factor} {expected}");
}
