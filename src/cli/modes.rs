//! `stickslip modes`: reports frequencies, damping and the loss of stability.

use super::arguments::{Common, ModesOptions};
use super::input::{GivenCase, overrides};
use super::plot::{draw, figure_target};
use super::terminal::{self, or_none, pairs};
use super::{CommandEnd, CommandError, complain, print, print_json, wants_json, wants_text};
use serde::Serialize;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use stickslip_analysis::analysis::Modes;
use stickslip_analysis::analysis::stability::SlidingVerdict;
use stickslip_analysis::analysis::stability::modes::{
    Instability, OnsetDecision, OperatingPoint, SlowingModes, Stability, SystemMode,
};
use stickslip_case::quantity::Dimension;
use stickslip_case::{Case, Motion};
use stickslip_system::model::margin;

/// Rounding of an eigenvalue, relative to the largest one.
const ROUNDING: f64 = 1e-13;

/// Number of digits of critical values. Eigenvalues of stiff bristles have no more.
const CRITICAL: usize = 8;

#[derive(Serialize)]
struct ModesDocument<'a> {
    /// Origin of the case.
    case: String,
    title: &'a str,
    /// "rotation" or "translation".
    motion: &'static str,
    #[serde(flatten)]
    modes: &'a Modes,
}

fn speed_unit(motion: Motion) -> &'static str {
    motion.dimension(Dimension::AngularVelocity).unit()
}

fn torque_unit(motion: Motion) -> &'static str {
    motion.dimension(Dimension::Torque).unit()
}

pub(super) fn modes(options: &ModesOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let given = GivenCase::read(&options.case)?;
    let changes = overrides(&options.set, None)?;
    let case = Case::read(&given.source, &changes)?;
    let (system, title) = (&case.system, &case.title);
    if let (Some(_), Err(reason)) = (&options.figure, margin::resistance(system)) {
        return Err(CommandError::input(format!(
            "--figure draws the effective damping of sliding that slows down by itself over its speed, and this case has no such \
             sliding: {reason}; leave it out"
        )));
    }
    let target = figure_target(options.figure.as_deref(), options.force, &given.files)?;
    let modes = Modes::of_case(system, &case.solver, case.output.end_time);
    if wants_json(common) {
        print_json(&ModesDocument {
            case: given.source.label(),
            title,
            motion: case.motion().name(),
            modes: &modes,
        })?;
    }
    if wants_text(common) {
        print(&report(title, &modes, case.motion()))?;
    }
    let Some(slowing) = &modes.slowing else {
        return Ok(CommandEnd::Done);
    };
    if let Some(target) = target {
        draw(
            &crate::plot::modes::figure(title, case.motion(), slowing),
            target,
            String::new(),
        )?;
    }
    if let (Some(failure), false) = (&slowing.run_failure, common.quiet) {
        complain(&format!(
            "warning: the run that looks for the loss of stability failed before its first stick, so only what came \
             before is known: {failure}"
        ));
    }
    Ok(CommandEnd::Done)
}

fn report(title: &str, modes: &Modes, motion: Motion) -> String {
    match &modes.slowing {
        Some(slowing) => format!(
            "{title}\n\n{}\n{}\n{}\n{}",
            headline(slowing, motion),
            shape_table(slowing, modes, motion),
            damping_table(slowing, motion),
            loss_of_stability(slowing, motion)
        ),
        None => {
            let points = modes.operating_points.iter().map(|point| operating(point, motion));
            format!(
                "{title}\n\n{}\n{}\n{}\n{}{}",
                driving(modes, motion),
                points.collect::<Vec<_>>().join("\n"),
                mode_table(modes, motion),
                changes_of_stability(modes, motion),
                absent(modes)
            )
        }
    }
}

fn headline(modes: &SlowingModes, motion: Motion) -> String {
    let critical = match (modes.critical_speed, modes.critical_speeds.as_slice()) {
        (None, _) => "none".to_owned(),
        (Some(x), []) => format!("{x:.6} {}", speed_unit(motion)),
        (_, several) => {
            let all: Vec<String> = several.iter().map(|x| format!("{x:.6}")).collect();
            format!("{} {}", all.join(", "), speed_unit(motion))
        }
    };
    let of_surface = match motion {
        Motion::Rotation => "torsional frequency sqrt(k_t/J)",
        Motion::Translation => "frequency of a surface sqrt(k/m)",
    };
    let mut rows = Vec::new();
    if let (Some(frequency), Some(ratio)) = (modes.axial_frequency, modes.axial_damping_ratio) {
        rows.push(("axial frequency sqrt(k_e/m)", hertz(frequency)));
        rows.push(("axial damping ratio c_a/(2 sqrt(k_e m))", format!("{ratio:.4}")));
    }
    rows.extend([
        (of_surface, hertz(modes.torsional_frequency)),
        ("natural period T_n", period(modes.natural_period)),
        (
            "contact force of the slip below",
            format!("{:.1} N", modes.normal_force),
        ),
        ("critical speed under that force", critical),
    ]);
    pairs(rows)
}

/// Table of the modes with the velocities of all inertias. The separated state is omitted: its modes are those of
/// slip under friction that does not fall.
fn shape_table(slowing: &SlowingModes, modes: &Modes, motion: Motion) -> String {
    let states = || modes.states.iter().filter(|state| state.state != "separated");
    let of_chains = states()
        .filter(|state| state.state != "axial")
        .flat_map(|state| &state.modes);
    let parts: Vec<&str> = of_chains
        .take(1)
        .flat_map(|mode| mode.shape.iter().map(|part| &*part.coordinate))
        .collect();
    let mut header = vec!["state", "omega_r", "mode", "Hz", "damping", "1/s"];
    let letters: Vec<String> = parts.iter().map(|part| part.replace("phi", "phi_")).collect();
    header.extend(letters.iter().map(String::as_str));
    let rows = states()
        .flat_map(|state| state.modes.iter().map(move |mode| (state, mode)))
        .map(|(state, mode)| {
            let mut row = vec![
                state.state.to_owned(),
                state.relative_velocity.map(|x| format!("{x:.3}")).unwrap_or_default(),
                mode.name.clone(),
                or_dash(mode.frequency, |f| format!("{f:.1}")),
                or_dash(mode.damping_ratio, |d| format!("{d:.4}")),
                growth(slowing, state.relative_velocity, mode.growth_rate),
            ];
            row.extend(parts.iter().map(|coordinate| shape(mode, coordinate)));
            row
        });
    format!(
        "omega_r in {}; damping as a ratio; 1/s: Re of the eigenvalue, positive where\n\
         the mode grows; then the velocities of its shape\n{}",
        speed_unit(motion),
        terminal::lines(
            &header,
            rows,
            (0..header.len()).filter(|column| ![0, 2].contains(column))
        )
    )
}

fn or_dash(number: Option<f64>, text: impl Fn(f64) -> String) -> String {
    number.map_or_else(|| "-".to_owned(), text)
}

/// Whether sliding is unstable for less than one oscillation. Growth rates assume quasi-steady friction, and are
/// meaningless over a fraction of an oscillation.
fn is_brief(modes: &SlowingModes) -> bool {
    let lost = modes.instability.as_ref();
    lost.is_some_and(|lost| lost.window() < modes.natural_period)
}

/// A growth rate (1/s) at a sliding speed; none if the instability is over before one oscillation.
fn growth(modes: &SlowingModes, speed: Option<f64>, rate: f64) -> String {
    let unstable = speed.is_some_and(|x| match (modes.critical_speed, modes.critical_speeds.as_slice()) {
        (Some(critical), []) => x < critical,
        (_, several) => several.iter().filter(|&&critical| x < critical).count() % 2 == 1,
    });
    if unstable && rate > 0.0 && is_brief(modes) {
        "-".to_owned()
    } else {
        format!("{rate:.2}")
    }
}

/// Component of the velocity in phase with the largest one.
fn shape(mode: &SystemMode, coordinate: &str) -> String {
    mode.shape
        .iter()
        .find(|part| part.coordinate == coordinate)
        .map(|part| {
            let hundredths = (100.0 * part.amplitude * part.phase.cos()).round();
            // Adding zero drops the sign of -0.
            format!("{:.2}", hundredths / 100.0 + 0.0)
        })
        .unwrap_or_default()
}

fn damping_table(modes: &SlowingModes, motion: Motion) -> String {
    let speed = format!("omega_r {}", speed_unit(motion));
    let damping = format!(
        "effective damping {}",
        motion.dimension(Dimension::TorsionalDamping).unit()
    );
    let curve = &modes.effective_damping;
    let rows = (0..=8).map(|k| &curve[k * (curve.len() - 1) / 8]).map(|point| {
        vec![
            format!("{:.4}", point.relative_velocity),
            format!("{:.4}", point.damping),
            format!("{:.4}", point.damping_ratio),
            growth(modes, Some(point.relative_velocity), point.growth_rate),
        ]
    });
    terminal::lines(&[&speed, &damping, "ratio", "growth 1/s"], rows, 0..4)
}

fn loss_of_stability(modes: &SlowingModes, motion: Motion) -> String {
    let sentence = match modes.stability {
        Stability::Lost => {
            let lost = modes.instability.as_ref();
            return lost.map(|lost| loss(lost, modes, motion)).unwrap_or_default();
        }
        Stability::FrictionDoesNotFall => {
            "Steady sliding is stable at every speed and force: friction does not fall with speed ([friction] \
             of the case)."
        }
        Stability::DampingSuffices => {
            "Steady sliding is stable at every speed: the damping outweighs the fall of the friction even at rest, \
             under the largest force."
        }
        Stability::NotReached => {
            "Steady sliding would lose its stability below the critical speed, but the run sticks or ends before."
        }
    };
    format!("{sentence}\n")
}

fn loss(lost: &Instability, modes: &SlowingModes, motion: Motion) -> String {
    let natural_period = modes.natural_period;
    let counted = |folds: f64| {
        if is_brief(modes) {
            "not counted: no oscillation fits in".to_owned()
        } else {
            format!("{folds:.2}")
        }
    };
    let folds = |x: Option<f64>| or_none(x, |x| format!("{x:.2}"));
    let speed = |x: f64| format!("{x:.6} {}", speed_unit(motion));
    let crossing = lost.eigenvalue_crossing.map_or_else(
        || "none nearby".to_owned(),
        |c| format!("{:.9} s, at {}", c.time, speed(c.relative_velocity)),
    );
    let died = lost.kick_above_noise.is_some_and(|above| above < 0.0);
    let above = folds(lost.kick_above_noise) + if died { ", it has died out" } else { "" };
    let decided = match lost.onset_decided_by {
        OnsetDecision::Perturbation => "the perturbation",
        OnsetDecision::Rounding => "rounding and solver error: this onset does not converge",
        OnsetDecision::FrictionPoints if lost.kick_above_noise.is_none() => "the points of the friction table",
        OnsetDecision::FrictionPoints => {
            "the perturbation or the points of the friction table: a run without a perturbation tells"
        }
        OnsetDecision::SmoothSliding => "neither perturbation nor rounding: smooth sliding stops by itself",
    };
    let table = pairs([
        (
            "loss of stability (zero of the margin)",
            format!("{:.9} s, at {}", lost.time, speed(lost.relative_velocity)),
        ),
        ("eigenvalue crossing", crossing),
        ("growth rate at the loss", format!("{:.4} 1/s", lost.growth_rate)),
        (
            "unstable until smooth sliding stops",
            format!("{:.3e} s, {:.3} T_n", lost.window(), lost.window() / natural_period),
        ),
        ("growth exponent G", counted(lost.growth_exponent)),
        ("first stick", or_none(lost.onset_time, |t| format!("{t:.9} s"))),
        ("growth up to the first stick", counted(lost.growth_to_onset)),
        ("e-folds gained from the kick", folds(lost.e_folds_gained)),
        ("kick above rounding, e-folds", above),
        ("the onset is decided by", decided.to_owned()),
    ]);
    let note = if is_brief(modes) {
        "The unstable window is shorter than one oscillation: nothing can swing up in it, and a\n\
         rate or a number of e-folds of its growth would say nothing.\n"
    } else {
        ""
    };
    table + note
}

fn hertz(frequency: f64) -> String {
    if frequency < 1e3 {
        format!("{frequency:.2} Hz")
    } else {
        format!("{:.4} kHz", frequency / 1e3)
    }
}

fn period(seconds: f64) -> String {
    if seconds < 1e-2 {
        format!("{:.2} us", seconds * 1e6)
    } else {
        format!("{seconds:.6} s")
    }
}

fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..9.0).contains(&magnitude) {
        return format!("{value:.*e}", digits - 1);
    }
    let decimals = (digits as f64 - 1.0 - magnitude).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

fn driving(modes: &Modes, motion: Motion) -> String {
    pairs(modes.driving.iter().map(|driven| {
        let (name, unit) = match driven.key {
            "contact.normal_force" => ("normal force", "N"),
            "actuation" => ("actuating force", "N"),
            "rotor.speed" => ("driven speed of the rotor", speed_unit(motion)),
            "stator.speed" => ("driven speed of the stator", speed_unit(motion)),
            "rotor.torque" => ("torque on the rotor", torque_unit(motion)),
            _ => ("torque on the stator", torque_unit(motion)),
        };
        (
            name,
            format!("{} {unit} ({})", significant(driven.value, 9), driven.taken),
        )
    }))
}

fn word(verdict: SlidingVerdict) -> &'static str {
    match verdict {
        SlidingVerdict::Stable => "stable",
        SlidingVerdict::Neutral => "neither stable nor unstable to first order",
        SlidingVerdict::Unstable => "unstable",
    }
}

fn operating(point: &OperatingPoint, motion: Motion) -> String {
    let speed = |w: f64| format!("{} {}", significant(w, 9), speed_unit(motion));
    let [of_rotor, of_stator, interface] = match motion {
        Motion::Rotation => ["rotor turns with", "stator turns with", "friction torque"],
        Motion::Translation => ["rotor moves with", "stator moves with", "friction force"],
    };
    let steady = match point.steady {
        true => "steady sliding at",
        false => "sliding, not steady, at",
    };
    let torque = format!("{} {}", significant(point.interface_torque, 9), torque_unit(motion));
    let twist = |twist: &[f64]| {
        let all: Vec<String> = twist.iter().map(|&q| significant(q, 9)).collect();
        let unit = motion.dimension(Dimension::Angle).unit();
        (!all.is_empty()).then(|| format!("{} {unit}", all.join(", ")))
    };
    let rows = [
        (steady, Some(speed(point.relative_velocity))),
        ("stability", Some(word(point.stability).to_owned())),
        (of_rotor, point.rotor_speed.map(speed)),
        (of_stator, point.stator_speed.map(speed)),
        (interface, Some(torque)),
        ("rotor twist", twist(&point.rotor_twist)),
        ("stator twist", twist(&point.stator_twist)),
    ];
    pairs(rows.into_iter().filter_map(|(name, value)| Some((name, value?))))
}

fn mode_table(modes: &Modes, motion: Motion) -> String {
    let header = ["state", "omega_r", "Hz", "damping", "decay 1/s", "moves most"];
    let rows = modes.states.iter().flat_map(|state| {
        let size = |mode: &SystemMode| mode.frequency.map_or(mode.decay.abs(), |f| TAU * f);
        let largest = state.modes.iter().map(size).fold(0.0, f64::max);
        state.modes.iter().map(move |mode| {
            // Rounding is a share of the state's fastest eigenvalue.
            let digits = |most: usize| ((mode.decay.abs() / (ROUNDING * largest)).log10().max(1.0) as usize).min(most);
            vec![
                state.state.to_owned(),
                state.relative_velocity.map(|w| significant(w, 6)).unwrap_or_default(),
                or_dash(mode.frequency, |f| significant(f, 6)),
                or_dash(mode.damping_ratio, |d| significant(d, digits(4))),
                significant(mode.decay, digits(6)),
                mode.moves.clone().unwrap_or_default(),
            ]
        })
    });
    format!(
        "omega_r in {}; Hz without damping; decay: -Re of the eigenvalue, negative where\nthe mode grows; inertia 0 is the \
         surface\n{}",
        speed_unit(motion),
        terminal::lines(&header, rows, 1..5)
    )
}

fn rough(value: f64) -> String {
    if value.abs() >= 1e6 {
        format!("{value:.1e}")
    } else {
        significant(value, 3)
    }
}

fn changes_of_stability(modes: &Modes, motion: Motion) -> String {
    let of_speed = format!("omega_r, {}", speed_unit(motion));
    let searches = [
        (&*of_speed, Some(&modes.critical_relative_velocities)),
        ("normal force, N", modes.critical_normal_forces.as_ref()),
        ("rotor damping x", modes.critical_rotor_damping.as_ref()),
        ("stator damping x", modes.critical_stator_damping.as_ref()),
    ];
    let mut rows = Vec::new();
    for (what, search) in searches.into_iter().filter_map(|(what, search)| Some((what, search?))) {
        let range = format!("{} to {}", rough(search.from), rough(search.to));
        if search.changes.is_empty() {
            let holds = match search.throughout {
                Some(SlidingVerdict::Unstable) => "everywhere",
                Some(SlidingVerdict::Neutral) => "nowhere (neutral)",
                _ => "nowhere",
            };
            rows.push([what, "none", holds, "", "", &range].map(str::to_owned).to_vec());
        }
        rows.extend(search.changes.iter().map(|change| {
            vec![
                what.to_owned(),
                significant(change.value, CRITICAL),
                if change.unstable_above { "above" } else { "below" }.to_owned(),
                change.frequency.map_or_else(|| "0".to_owned(), |f| significant(f, 6)),
                significant(change.relative_velocity, 6),
                range.clone(),
            ]
        }));
    }
    let header = ["critical", "value", "unstable", "Hz", "at omega_r", "searched"];
    format!(
        "Where steady sliding loses its stability, and the frequency that then grows (0: it\ncreeps away); damping: all \
         shafts of a train, times this\n{}",
        terminal::lines(&header, rows, [1, 3, 4, 5])
    )
}

fn absent(modes: &Modes) -> String {
    let mut text = String::new();
    for (k, absent) in modes.absent.iter().enumerate() {
        let heading = if k == 0 { "\nnot there:\n" } else { "" };
        let _ = writeln!(text, "{heading}{}: {}", absent.what, absent.why);
    }
    text
}
