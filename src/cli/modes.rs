//! `stickslip modes`.

use super::arguments::{Common, DPI, Format, ModesOptions};
use super::input::{Given, bad_case, overrides};
use super::plot::{bad, check_target, save};
use super::{CommandError, End, complain, print, print_json, terminal, train_modes, wants_json, wants_text};
use crate::analysis::Modes;
use crate::analysis::modes::{EffectiveDamping, Eigenmode, Instability, OnsetDecision, Stability};
use crate::case::Case;
use crate::model::Parameters;
use crate::plot::target::Product;
use crate::plot::{style, svg};
use serde::Serialize;
use std::path::Path;

/// As `--figure` names it.
pub(super) const FIGURE: Product = Product::Figure("--figure");

/// The JSON document of the modes.
#[derive(Serialize)]
struct ModesDocument<'a> {
    /// Where the case is from.
    case: String,
    title: &'a str,
    #[serde(flatten)]
    modes: &'a Modes,
}

/// Computes the modes of a case and reports them.
pub(super) fn modes(options: &ModesOptions, common: &Common) -> Result<End, CommandError> {
    let given = Given::read(&options.case)?;
    let changes = overrides(&options.set, None).map_err(bad_case)?;
    let case = Case::read(&given.source, &changes).map_err(bad_case)?;
    let Some(disks) = Parameters::of(&case.system).filter(|_| case.words().lists_growth()) else {
        return train_modes::modes(&given, &case, options, common);
    };
    let Given { source, files, .. } = given;
    let target = options
        .figure
        .as_deref()
        .map(|path| figure_target(path, options.force, &files))
        .transpose()?;
    let modes = Modes::of_case(&disks, &case.solver, case.output.end_time);
    if wants_json(common) {
        print_json(&ModesDocument {
            case: source.label(),
            title: &case.title,
            modes: &modes,
        })?;
    }
    if wants_text(common) {
        print(&report(&case.title, &modes))?;
    }
    if let Some((path, format)) = target {
        let figure = crate::plot::modes::figure(&case.title, &modes);
        let text = svg::svg(&figure, style::COLUMN_WIDTH).map_err(bad)?;
        save(path, FIGURE, &text, &figure.full_title(), format, DPI).map_err(bad)?;
    }
    if let (Some(failure), false) = (&modes.run_failure, common.quiet) {
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

fn report(title: &str, modes: &Modes) -> String {
    format!(
        "{title}\n\n{}\n{}\n{}\n{}",
        headline(modes),
        mode_table(modes),
        damping_table(modes),
        stability(modes)
    )
}

fn headline(modes: &Modes) -> String {
    let mut table = terminal::table(&[]);
    let critical = match (modes.critical_speed, modes.critical_speeds.as_slice()) {
        (None, _) => "none".to_owned(),
        (Some(x), []) => format!("{x:.6} rad/s"),
        (_, several) => {
            let all: Vec<String> = several.iter().map(|x| format!("{x:.6}")).collect();
            format!("{} rad/s", all.join(", "))
        }
    };
    for (name, value) in [
        ("axial frequency sqrt(k_e/m)", hertz(modes.axial_frequency)),
        (
            "axial damping ratio c_a/(2 sqrt(k_e m))",
            format!("{:.4}", modes.axial_damping_ratio),
        ),
        ("torsional frequency sqrt(k_t/J)", hertz(modes.torsional_frequency)),
        ("natural period T_n", format!("{:.2} us", modes.natural_period * 1e6)),
        (
            "contact force of the slip below",
            format!("{:.1} N", modes.normal_force),
        ),
        ("critical speed under that force", critical),
    ] {
        table.add_row([name.to_owned(), value]);
    }
    terminal::show(&table)
}

fn mode_table(modes: &Modes) -> String {
    let mut table = terminal::table(&[
        "state", "omega_r", "mode", "Hz", "damping", "1/s", "theta", "phi_2", "phi_1",
    ]);
    for state in &modes.states {
        for mode in &state.modes {
            let part = |coordinate| shape(mode, coordinate);
            table.add_row([
                state.state.to_owned(),
                state.relative_velocity.map(|x| format!("{x:.3}")).unwrap_or_default(),
                mode.name.to_owned(),
                mode.natural_frequency
                    .map_or_else(|| "-".to_owned(), |f| format!("{f:.1}")),
                mode.damping_ratio.map_or_else(|| "-".to_owned(), |d| format!("{d:.4}")),
                growth(modes, state.relative_velocity, mode.growth_rate),
                part("theta"),
                part("phi2"),
                part("phi1"),
            ]);
        }
    }
    terminal::align_right(&mut table, [1, 3, 4, 5, 6, 7, 8]);
    format!(
        "omega_r in rad/s; damping as a ratio; 1/s: Re of the eigenvalue, positive where\n\
         the mode grows; then the velocities of its shape\n{}",
        terminal::show(&table)
    )
}

/// Whether sliding is unstable for less than one oscillation. Quasi-steady friction, along which growth is counted, means
/// nothing over a fraction of one.
fn is_brief(modes: &Modes) -> bool {
    let lost = modes.instability.as_ref();
    lost.is_some_and(|lost| lost.window() < modes.natural_period)
}

/// A growth rate (1/s) at a sliding speed; none of an instability that the speed falls through before anything can swing.
fn growth(modes: &Modes, speed: Option<f64>, rate: f64) -> String {
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
fn shape(mode: &Eigenmode, coordinate: &str) -> String {
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
fn damping_table(modes: &Modes) -> String {
    let mut table = terminal::table(&["omega_r rad/s", "effective damping N m s/rad", "ratio", "growth 1/s"]);
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

fn stability(modes: &Modes) -> String {
    let sentence = match modes.stability {
        Stability::Lost => {
            let lost = modes.instability.as_ref();
            return lost.map(|lost| loss(lost, modes)).unwrap_or_default();
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

fn loss(lost: &Instability, modes: &Modes) -> String {
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
    let speed = |x: f64| format!("{x:.6} rad/s");
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
