//! `stickslip modes` of two trains.

use super::arguments::{Common, ModesOptions};
use super::input::Given;
use super::{CommandError, End, print, print_json, terminal, wants_json, wants_text};
use crate::analysis::trains::Verdict;
use crate::analysis::trains::modes::{OperatingPoint, Search, TrainMode, TrainModes};
use crate::case::{Case, Motion};
use serde::Serialize;
use std::f64::consts::TAU;
use std::fmt::Write as _;

/// The JSON document of the modes.
#[derive(Serialize)]
struct ModesDocument<'a> {
    /// Where the case is from.
    case: String,
    title: &'a str,
    /// "rotation" or "translation".
    motion: &'static str,
    #[serde(flatten)]
    modes: &'a TrainModes,
}

/// The rounding of an eigenvalue, as a share of the largest.
const ROUNDING: f64 = 1e-13;

/// Digits of critical values: those by eigenvalues of stiff bristles have no more.
const CRITICAL: usize = 8;

/// What quantities are called in the units of a motion.
struct Units {
    angle: &'static str,
    speed: &'static str,
    torque: &'static str,
}

impl Units {
    fn of(motion: Motion) -> Units {
        match motion {
            Motion::Rotation => Units {
                angle: "rad",
                speed: "rad/s",
                torque: "N m",
            },
            Motion::Translation => Units {
                angle: "m",
                speed: "m/s",
                torque: "N",
            },
        }
    }
}

/// Computes the modes of a case of trains and reports them.
pub(super) fn modes(given: &Given, case: &Case, options: &ModesOptions, common: &Common) -> Result<End, CommandError> {
    if options.figure.is_some() {
        return Err(CommandError::Input(
            "--figure draws the effective damping of a brake, [torsion], over its sliding speed; a case of trains has no such \
             figure: leave it out"
                .to_owned(),
        ));
    }
    let modes = TrainModes::of_case(&case.system);
    if wants_json(common) {
        print_json(&ModesDocument {
            case: given.source.label(),
            title: &case.title,
            motion: case.motion().name(),
            modes: &modes,
        })?;
    }
    if wants_text(common) {
        print(&report(case, &modes))?;
    }
    Ok(End::Done)
}

/// A number with so many significant digits, without zeros behind them.
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

fn report(case: &Case, modes: &TrainModes) -> String {
    let units = Units::of(case.motion());
    let mut text = format!("{}\n\n{}\n", case.title, driving(modes, &units));
    for (k, point) in modes.operating_points.iter().enumerate() {
        if k > 0 {
            text.push('\n');
        }
        text += &operating(point, &units);
    }
    let _ = writeln!(text, "\n{}", states(modes, &units));
    text += &stability(modes, &units);
    if !modes.absent.is_empty() {
        text += "\nnot there:\n";
    }
    for absent in &modes.absent {
        let _ = writeln!(text, "{}: {}", absent.what, absent.why);
    }
    text
}

fn driving(modes: &TrainModes, units: &Units) -> String {
    let mut table = terminal::table(&[]);
    for driven in &modes.driving {
        let unit = match driven.key {
            "rotor.speed" | "stator.speed" => units.speed,
            "rotor.torque" | "stator.torque" => units.torque,
            _ => "N",
        };
        let name = match driven.key {
            "contact.normal_force" => "normal force",
            "actuation" => "actuating force",
            "rotor.speed" => "driven speed of the rotor",
            "stator.speed" => "driven speed of the stator",
            "rotor.torque" => "torque on the rotor",
            _ => "torque on the stator",
        };
        let value = format!("{} {unit} ({})", significant(driven.value, 9), driven.taken);
        table.add_row([name.to_owned(), value]);
    }
    terminal::show(&table)
}

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Stable => "stable",
        Verdict::Neutral => "neither stable nor unstable to first order",
        Verdict::Unstable => "unstable",
    }
}

fn operating(point: &OperatingPoint, units: &Units) -> String {
    let mut table = terminal::table(&[]);
    let speed = |w: f64| format!("{} {}", significant(w, 9), units.speed);
    let steady = if point.steady {
        "steady sliding at"
    } else {
        "sliding, not steady, at"
    };
    let verdict = word(point.stability).to_owned();
    table.add_row([steady.to_owned(), speed(point.relative_velocity)]);
    table.add_row(["stability".to_owned(), verdict]);
    for (name, value) in [
        ("rotor turns with", point.rotor_speed),
        ("stator turns with", point.stator_speed),
    ] {
        if let Some(value) = value {
            let name = if units.angle == "m" {
                name.replace("turns", "moves")
            } else {
                name.to_owned()
            };
            table.add_row([name, speed(value)]);
        }
    }
    let interface = if units.angle == "m" {
        "friction force"
    } else {
        "friction torque"
    };
    table.add_row([
        interface.to_owned(),
        format!("{} {}", significant(point.interface_torque, 9), units.torque),
    ]);
    for (name, twist) in [
        ("rotor twist", &point.rotor_twist),
        ("stator twist", &point.stator_twist),
    ] {
        if !twist.is_empty() {
            let all: Vec<String> = twist.iter().map(|&q| significant(q, 9)).collect();
            table.add_row([name.to_owned(), format!("{} {}", all.join(", "), units.angle)]);
        }
    }
    terminal::show(&table)
}

fn states(modes: &TrainModes, units: &Units) -> String {
    let mut table = terminal::table(&["state", "omega_r", "Hz", "damping", "decay 1/s", "moves most"]);
    for state in &modes.states {
        let size = |mode: &TrainMode| mode.frequency.map_or(mode.decay.abs(), |f| TAU * f);
        let largest = state.modes.iter().map(size).fold(0.0, f64::max);
        for mode in &state.modes {
            // Rounding is a share of the state's fastest eigenvalue.
            let digits = |most: usize| ((mode.decay.abs() / (ROUNDING * largest)).log10().max(1.0) as usize).min(most);
            table.add_row([
                state.state.to_owned(),
                state.relative_velocity.map(|w| significant(w, 6)).unwrap_or_default(),
                mode.frequency.map_or_else(|| "-".to_owned(), |f| significant(f, 6)),
                mode.damping_ratio
                    .map_or_else(|| "-".to_owned(), |d| significant(d, digits(4))),
                significant(mode.decay, digits(6)),
                mode.moves.clone().unwrap_or_default(),
            ]);
        }
    }
    terminal::align_right(&mut table, [1, 2, 3, 4]);
    format!(
        "omega_r in {}; Hz without damping; decay: -Re of the eigenvalue, negative where\nthe mode grows; inertia 0 is the \
         surface\n{}",
        units.speed,
        terminal::show(&table)
    )
}

/// A bound of a range, roughly.
fn rough(value: f64) -> String {
    if value.abs() >= 1e6 {
        format!("{value:.1e}")
    } else {
        significant(value, 3)
    }
}

/// Where stability changes, a row for each place.
fn stability(modes: &TrainModes, units: &Units) -> String {
    let mut table = terminal::table(&["critical", "value", "unstable", "Hz", "at omega_r", "searched"]);
    let mut say = |what: String, search: &Search| {
        let range = format!("{} to {}", rough(search.from), rough(search.to));
        if search.changes.is_empty() {
            let holds = match search.throughout {
                Some(Verdict::Unstable) => "everywhere",
                Some(Verdict::Neutral) => "nowhere (neutral)",
                _ => "nowhere",
            };
            table.add_row([&what, "none", holds, "", "", &range]);
        }
        for change in &search.changes {
            table.add_row([
                what.clone(),
                significant(change.value, CRITICAL),
                if change.unstable_above { "above" } else { "below" }.to_owned(),
                change.frequency.map_or_else(|| "0".to_owned(), |f| significant(f, 6)),
                significant(change.relative_velocity, 6),
                range.clone(),
            ]);
        }
    };
    say(format!("omega_r, {}", units.speed), &modes.critical_relative_velocities);
    let others = [
        ("normal force, N", &modes.critical_normal_forces),
        ("rotor damping x", &modes.critical_rotor_damping),
        ("stator damping x", &modes.critical_stator_damping),
    ];
    for (what, search) in others {
        if let Some(search) = search {
            say(what.to_owned(), search);
        }
    }
    terminal::align_right(&mut table, [1, 3, 4, 5]);
    format!(
        "Where steady sliding loses its stability, and the frequency that then grows (0: it\ncreeps away); damping: all \
         shafts of a train, times this\n{}",
        terminal::show(&table)
    )
}
