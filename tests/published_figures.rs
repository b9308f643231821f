//! The data of the figures against what the paper says of its own.

mod cli_common;

use cli_common::{Folder, output};
use std::sync::OnceLock;
use stickslip::plot::catalogue::{ExponentialFit, Story, find};
use stickslip::plot::portraits::turn_amplitudes;
use stickslip::plot::spiral::Turns;
use stickslip::plot::{Curve, Figure, Run};

/// The paper's run, whose samples are close at the plateau, the stick-slip and the last stick.
fn file() -> &'static std::path::Path {
    static FILE: OnceLock<(Folder, std::path::PathBuf)> = OnceLock::new();
    let (_, path) = FILE.get_or_init(|| {
        let folder = Folder::new();
        output(&mut folder.stickslip(&["run", "-q"]), 0);
        let path = folder.path("paper.h5");
        (folder, path)
    });
    path
}

fn figure(name: &str) -> Figure {
    let runs = [Run::open(file()).unwrap()];
    let story = Story::new(&runs).unwrap();
    find(name).unwrap().build(&story).unwrap().unwrap()
}

fn points(figure: &Figure, label: &str) -> Vec<(f64, f64)> {
    let curves = &figure.panels[0].curves;
    let found = curves.iter().find(|curve| curve.label.starts_with(label));
    found
        .map(|curve| curve.points().collect())
        .unwrap_or_else(|| panic!("no curve {label}"))
}

/// Fig. 4: 0.6 at rest, 0.3 at high speed, falling.
#[test]
fn published_friction_law() {
    let law = points(&figure("4"), "sliding");
    assert_eq!(law[0], (0.0, 0.6));
    assert!((law[law.len() - 1].1 - 0.3).abs() < 1e-3);
    assert!(law.windows(2).all(|p| p[1].1 < p[0].1));
}

/// Fig. 5: a ramp to a plateau at 0.0402 mm. What rings on at the end of the ramp is 13 nm.
#[test]
fn published_axial_plateau() {
    let z = points(&figure("5"), "");
    let plateau: Vec<f64> = z.iter().filter(|p| p.0 > 1.02).map(|p| p.1).collect();
    assert!(plateau.len() > 50);
    for value in plateau {
        assert_eq!(format!("{:.4}", -value * 1e3), "0.0402");
    }
    // The ramp is a straight line but for the lag c_a/k_e of 0.16 ms.
    let half = z
        .iter()
        .min_by(|a, b| (a.0 - 0.5).abs().total_cmp(&(b.0 - 0.5).abs()))
        .unwrap();
    assert!((half.1 * 1e3 + 0.0201).abs() < 2e-5, "{half:?}");
}

/// Fig. 15: slips flat within 10 %, sticks that grow from the second on; the cycles are those of the file.
#[test]
fn published_durations() {
    let figure = figure("15");
    let (sticks, slips) = (points(&figure, "sticks"), points(&figure, "slips"));
    assert_eq!((sticks.len(), slips.len()), (47, 47));
    let mean = slips.iter().map(|p| p.1).sum::<f64>() / 47.0;
    assert!(slips.iter().all(|p| (p.1 / mean - 1.0).abs() < 0.1));
    assert!(sticks[1..].windows(2).all(|pair| pair[1].1 > pair[0].1));
    // The paper: first stick 0.05 ms, slips 0.19 ms.
    assert_eq!(format!("{:.2}", sticks[0].1 * 1e3), "0.05");
    assert_eq!(format!("{:.2}", slips[0].1 * 1e3), "0.19");
    // "Almost exponentially": the last sticks grow faster than an exponential that fits all.
    let exponential = points(&figure, "exponential");
    let off = |k: usize| sticks[k].1 / exponential[k].1 - 1.0;
    assert!(off(46) > 0.5);
    // From the second to the thirtieth one exponential does.
    let durations: Vec<f64> = sticks[1..30].iter().map(|p| p.1).collect();
    let fit = ExponentialFit::of(&durations).unwrap();
    assert!(fit.worst < 0.05 && fit.r_squared > 0.98, "{fit:?}");
}

/// Amplitude turn by turn of what a portrait shows, from its drawn points.
fn drawn_amplitudes(figure: &Figure) -> Vec<f64> {
    let mut turns = Turns::default();
    figure.panels[0]
        .curves
        .iter()
        .flat_map(Curve::points)
        .for_each(|p| turns.push(p.1));
    turns.amplitudes()
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

/// Fig. 17 converges, Fig. 19 diverges, Fig. 22 converges: after the force has come to its plateau, before the first
/// stick, in the last stick.
#[test]
fn published_spirals_converge_diverge_converge() {
    assert_spiral("phase-axial", 2, false);
    for surface in ["stator", "rotor"] {
        assert_spiral(&format!("phase-growth-{surface}"), 5, true);
        assert_spiral(&format!("phase-final-stick-{surface}"), 15, false);
    }
}

/// Within the last stick the swing decays by what the stick's slow mode says: exp(2 pi Re lambda/Im lambda) a turn,
/// after its first turns, in which the surfaces' own mode dies away.
#[test]
fn analytic_last_stick_decays_as_its_mode() {
    let run = Run::open(file()).unwrap();
    let start = run.stick_slip.final_stick_time.unwrap() + 0.02;
    let amplitudes = turn_amplitudes(&run, "phi1_dot", (start, start + 0.1)).unwrap();
    let model = stickslip::model::torsion::TorsionModel::new(&run.parameters);
    let modes = stickslip::analysis::modes::stick_modes(&model).modes;
    let rotor = modes.iter().find(|mode| mode.name == "rotor").unwrap();
    let expected = (std::f64::consts::TAU * rotor.growth_rate / rotor.angular_frequency).exp();
    let factor = stickslip::plot::spiral::factor_per_turn(&amplitudes).unwrap();
    // A hundred samples in a turn meet its extremes to (pi/100)^2/2, over 18 turns.
    assert!((factor - expected).abs() < 1e-4, "{factor} {expected}");
}
