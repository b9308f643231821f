//! `stickslip modes`.

use super::arguments::{Common, DPI, Format, ModesOptions};
use super::input::{Given, bad_case, overrides};
use super::plot::{bad, check_target, save};
use super::{CommandError, End, complain, print, print_json, terminal, wants_json, wants_text};
use crate::analysis::Modes;
use crate::analysis::stability::Verdict;
use crate::analysis::stability::modes::{EffectiveDamping, Instability, OnsetDecision, SlowingModes, Stability};
use crate::analysis::stability::states::{OperatingPoint, Search, SystemMode, SystemModes};
use crate::case::{Case, Motion};
use crate::model::margin;
use crate::plot::target::Product;
use crate::plot::{style, svg};
use serde::Serialize;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

/// As `--figure` names it.
pub(super) const FIGURE: Product = Product::Figure("--figure");

/// The rounding of an eigenvalue, as a share of the largest.
const ROUNDING: f64 = 1e-13;

/// Digits of critical values: those by eigenvalues of stiff bristles have no more.
const CRITICAL: usize = 8;

/// The JSON document of the modes.
#[derive(Serialize)]
struct ModesDocument<'a> {
    /// Where the case is from.
    case: String,
    title: &'a str,
    /// "rotation" or "translation".
    motion: &'static str,
    #[serde(flatten)]
    modes: &'a Modes,
}

/// What quantities are called in the units of a motion.
struct Units {
    angle: &'static str,
    speed: &'static str,
    torque: &'static str,
    damping: &'static str,
    /// The frequency of a surface on its shaft.
    frequency: &'static str,
}

impl Units {
    fn of(motion: Motion) -> Units {
        match motion {
            Motion::Rotation => Units {
                angle: "rad",
                speed: "rad/s",
                torque: "N m",
                damping: "N m s/rad",
                frequency: "torsional frequency sqrt(k_t/J)",
            },
            Motion::Translation => Units {
                angle: "m",
                speed: "m/s",
                torque: "N",
                damping: "N s/m",
                frequency: "frequency of a surface sqrt(k/m)",
            },
        }
    }
}

/// Computes the modes of a case and reports them.
pub(super) fn modes(options: &ModesOptions, common: &Common) -> Result<End, CommandError> {
    let given = Given::read(&options.case)?;
    let changes = overrides(&options.set, None).map_err(bad_case)?;
    let case = Case::read(&given.source, &changes).map_err(bad_case)?;
    let (system, title) = (&case.system, &case.title);
    if let (Some(_), Err(reason)) = (&options.figure, margin::resistance(system)) {
        return Err(CommandError::Input(format!(
            "--figure draws the effective damping of sliding that slows down by itself over its speed, and this case has no such \
             sliding: {reason}; leave it out"
        )));
    }
    let target = options
        .figure
        .as_deref()
        .map(|path| figure_target(path, options.force, &given.files))
        .transpose()?;
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
        print(&report(title, &modes, &Units::of(case.motion())))?;
    }
    let Some(slowing) = &modes.slowing else {
        return Ok(End::Done);
    };
    if let Some((path, format)) = target {
        let figure = crate::plot::modes::figure(title, case.motion(), slowing);
        let text = svg::svg(&figure, style::COLUMN_WIDTH).map_err(bad)?;
        save(path, FIGURE, &text, &figure.full_title(), format, DPI).map_err(bad)?;
    }
    if let (Some(failure), false) = (&slowing.run_failure, common.quiet) {
        complain(&format!(
            "warning: the run that looks for the loss of stability failed before its first stick, so only what came \
             before is known: {failure}"
        ));
    }
    Ok(End::Done)
}

/// The file of the figure, checked before anything is computed.
pub(super) fn figure_target<'a>(
    path: &'a Path,
    force: bool,
    inputs: &[std::path::PathBuf],
) -> Result<(&'a Path, Format), CommandError> {
    let format = Format::of_path(path).ok_or_else(|| {
        CommandError::Input(format!(
            "{}: a figure is an SVG, PNG, PDF or EPS file; give it the extension .svg, .png, .pdf or .eps",
            path.display()
        ))
    })?;
    check_target(path, FIGURE, inputs, force)?;
    Ok((path, format))
}

fn report(title: &str, modes: &Modes, units: &Units) -> String {
    match &modes.slowing {
        Some(slowing) => format!(
            "{title}\n\n{}\n{}\n{}\n{}",
            headline(slowing, units),
            shape_table(slowing, &modes.general, units),
            damping_table(slowing, units),
            loss_of_stability(slowing, units)
        ),
        None => {
            let general = &modes.general;
            let points: Vec<String> = general
                .operating_points
                .iter()
                .map(|point| operating(point, units))
                .collect();
            format!(
                "{title}\n\n{}\n{}\n{}\n{}{}",
                driving(general, units),
                points.join("\n"),
                mode_table(general, units),
                changes_of_stability(general, units),
                absent(general)
            )
        }
    }
}

fn headline(modes: &SlowingModes, units: &Units) -> String {
    let mut table = terminal::table(&[]);
    let critical = match (modes.critical_speed, modes.critical_speeds.as_slice()) {
        (None, _) => "none".to_owned(),
        (Some(x), []) => format!("{x:.6} {}", units.speed),
        (_, several) => {
            let all: Vec<String> = several.iter().map(|x| format!("{x:.6}")).collect();
            format!("{} {}", all.join(", "), units.speed)
        }
    };
    if let (Some(frequency), Some(ratio)) = (modes.axial_frequency, modes.axial_damping_ratio) {
        table.add_row(["axial frequency sqrt(k_e/m)", &hertz(frequency)]);
        table.add_row(["axial damping ratio c_a/(2 sqrt(k_e m))", &format!("{ratio:.4}")]);
    }
    for (name, value) in [
        (units.frequency, hertz(modes.torsional_frequency)),
        ("natural period T_n", period(modes.natural_period)),
        (
            "contact force of the slip below",
            format!("{:.1} N", modes.normal_force),
        ),
        ("critical speed under that force", critical),
    ] {
        table.add_row([name, &value]);
    }
    terminal::show(&table)
}

/// The modes with the velocities of the rotor's outermost inertia and of both surfaces. Without contact they are those of slip at a
/// speed at which friction does not fall.
fn shape_table(slowing: &SlowingModes, modes: &SystemModes, units: &Units) -> String {
    let mut table = terminal::table(&[
        "state", "omega_r", "mode", "Hz", "damping", "1/s", "theta", "phi_2", "phi_1",
    ]);
    for state in modes.states.iter().filter(|state| state.state != "separated") {
        for mode in &state.modes {
            let part = |coordinate| shape(mode, coordinate);
            table.add_row([
                state.state.to_owned(),
                state.relative_velocity.map(|x| format!("{x:.3}")).unwrap_or_default(),
                mode.name.clone(),
                mode.frequency.map_or_else(|| "-".to_owned(), |f| format!("{f:.1}")),
                mode.damping_ratio.map_or_else(|| "-".to_owned(), |d| format!("{d:.4}")),
                growth(slowing, state.relative_velocity, mode.growth_rate),
                part("theta"),
                part("phi2"),
                part("phi1"),
            ]);
        }
    }
    terminal::align_right(&mut table, [1, 3, 4, 5, 6, 7, 8]);
    format!(
        "omega_r in {}; damping as a ratio; 1/s: Re of the eigenvalue, positive where\n\
         the mode grows; then the velocities of its shape\n{}",
        units.speed,
        terminal::show(&table)
    )
}

/// Whether sliding is unstable for less than one oscillation. Quasi-steady friction, along which growth is counted, means
/// nothing over a fraction of one.
fn is_brief(modes: &SlowingModes) -> bool {
    let lost = modes.instability.as_ref();
    lost.is_some_and(|lost| lost.window() < modes.natural_period)
}

/// A growth rate (1/s) at a sliding speed; none of an instability that the speed falls through before anything can swing.
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

/// The real part of the velocity in phase with the largest one.
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

/// Rows of the curve beside the fractions of the critical speed that matter.
fn damping_table(modes: &SlowingModes, units: &Units) -> String {
    let [speed, damping] = [
        format!("omega_r {}", units.speed),
        format!("effective damping {}", units.damping),
    ];
    let mut table = terminal::table(&[&speed, &damping, "ratio", "growth 1/s"]);
    let count = modes.effective_damping.len();
    for k in 0..=8 {
        let EffectiveDamping {
            relative_velocity,
            damping,
            damping_ratio,
            growth_rate,
        } = modes.effective_damping[k * (count - 1) / 8];
        table.add_row([
            format!("{relative_velocity:.4}"),
            format!("{damping:.4}"),
            format!("{damping_ratio:.4}"),
            growth(modes, Some(relative_velocity), growth_rate),
        ]);
    }
    terminal::align_right(&mut table, 0..4);
    terminal::show(&table)
}

fn loss_of_stability(modes: &SlowingModes, units: &Units) -> String {
    let sentence = match modes.stability {
        Stability::Lost => {
            let lost = modes.instability.as_ref();
            return lost.map(|lost| loss(lost, modes, units)).unwrap_or_default();
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

fn loss(lost: &Instability, modes: &SlowingModes, units: &Units) -> String {
    let natural_period = modes.natural_period;
    let counted = |folds: f64| {
        if is_brief(modes) {
            "not counted: no oscillation fits in".to_owned()
        } else {
            format!("{folds:.2}")
        }
    };
    let mut table = terminal::table(&[]);
    let folds = |x: Option<f64>| x.map_or_else(|| "none".to_owned(), |x| format!("{x:.2}"));
    let speed = |x: f64| format!("{x:.6} {}", units.speed);
    let crossing = lost.eigenvalue_crossing.map_or_else(
        || "none nearby".to_owned(),
        |c| format!("{:.9} s, at {}", c.time, speed(c.relative_velocity)),
    );
    let onset = lost
        .onset_time
        .map_or_else(|| "none".to_owned(), |t| format!("{t:.9} s"));
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
    for (name, value) in [
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
        ("first stick", onset),
        ("growth up to the first stick", counted(lost.growth_to_onset)),
        ("e-folds gained from the kick", folds(lost.e_folds_gained)),
        ("kick above rounding, e-folds", above),
        ("the onset is decided by", decided.to_owned()),
    ] {
        table.add_row([name.to_owned(), value]);
    }
    let note = if is_brief(modes) {
        "The unstable window is shorter than one oscillation: nothing can swing up in it, and a\n\
         rate or a number of e-folds of its growth would say nothing.\n"
    } else {
        ""
    };
    format!("{}{note}", terminal::show(&table))
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

fn driving(modes: &SystemModes, units: &Units) -> String {
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

/// The modes with the inertia that moves most.
fn mode_table(modes: &SystemModes, units: &Units) -> String {
    let mut table = terminal::table(&["state", "omega_r", "Hz", "damping", "decay 1/s", "moves most"]);
    for state in &modes.states {
        let size = |mode: &SystemMode| mode.frequency.map_or(mode.decay.abs(), |f| TAU * f);
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
fn changes_of_stability(modes: &SystemModes, units: &Units) -> String {
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

/// What the case does not have.
fn absent(modes: &SystemModes) -> String {
    let mut text = String::new();
    for (k, absent) in modes.absent.iter().enumerate() {
        let heading = if k == 0 { "\nnot there:\n" } else { "" };
        let _ = writeln!(text, "{heading}{}: {}", absent.what, absent.why);
    }
    text
}
