//! Page of modes: frequencies, damping and the loss of stability.

use super::{NumberFormat, Page, PageTable, Report, below_changes, fixed, significant};
use serde::Serialize;
use std::f64::consts::TAU;
use stickslip_analysis::GivenCase;
use stickslip_analysis::analysis::Modes;
use stickslip_analysis::analysis::headline::or_none;
use stickslip_analysis::analysis::stability::SlidingVerdict;
use stickslip_analysis::analysis::stability::modes::{
    Instability, OnsetDecision, OperatingPoint, SlowingModes, Stability, StabilityChange, SystemMode, SystemState,
};
use stickslip_case::quantity::Dimension;
use stickslip_case::{Case, Motion, Override};

/// Rounding of an eigenvalue, relative to the largest one.
const ROUNDING: f64 = 1e-13;

const OF_SHAPES: &str =
    "damping as a ratio; 1/s: Re of the eigenvalue, positive where\nthe mode grows; then the velocities of its shape";
const OF_STATES: &str =
    "Hz without damping; decay: -Re of the eigenvalue, negative where\nthe mode grows; inertia 0 is the surface";
const OF_CHANGES: &str = "Where steady sliding loses its stability, and the frequency that then grows (0: it\ncreeps away); damping: \
                          all shafts of a train, times this";
const BRIEF: &str = "The unstable window is shorter than one oscillation: nothing can swing up in it, and a\nrate or a number of \
                     e-folds of its growth would say nothing.";

/// Report on the modes of a case.
#[derive(Debug, Serialize)]
pub struct ModesReport<'a> {
    /// Origin of the case.
    case: String,
    title: &'a str,
    /// Overrides of the case, in words.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    changed: Vec<String>,
    #[serde(serialize_with = "name")]
    motion: Motion,
    #[serde(flatten)]
    modes: &'a Modes,
}

impl<'a> ModesReport<'a> {
    /// Report on the modes of a case, which is `given` with these changes.
    pub fn new(given: &GivenCase, changes: &[Override], case: &'a Case, modes: &'a Modes) -> ModesReport<'a> {
        ModesReport {
            case: given.source.label(),
            title: &case.title,
            changed: given.changed(changes),
            motion: case.motion(),
            modes,
        }
    }
}

fn name<S: serde::Serializer>(motion: &Motion, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(motion.name())
}

fn unit(motion: Motion, dimension: Dimension) -> &'static str {
    motion.dimension(dimension).unit()
}

fn speed_unit(motion: Motion) -> &'static str {
    unit(motion, Dimension::AngularVelocity)
}

fn speed(motion: Motion, digits: NumberFormat, value: f64) -> String {
    format!("{} {}", digits.print(value), speed_unit(motion))
}

impl Report for ModesReport<'_> {
    fn page(&self) -> Page {
        let (modes, motion) = (self.modes, self.motion);
        let page = Page::new(self.title, below_changes(&self.changed, ""));
        let Some(slowing) = &self.modes.slowing else {
            return page
                .with_all(modes.operating_points.iter().map(|point| operating(point, motion)))
                .with(changes_of_stability(modes, motion))
                .details([driving(modes, motion), mode_table(modes, motion)])
                .details(absent(modes));
        };
        let page = page.with(headline(slowing, motion));
        let page = match (&slowing.instability, kept(slowing.stability)) {
            (_, Some(sentence)) => page.with(sentence),
            (Some(lost), None) => page
                .with(loss(lost, slowing, motion))
                .below(is_brief(slowing).then_some(BRIEF)),
            (None, None) => page,
        };
        page.details([shape_table(slowing, modes, motion), damping_table(slowing, motion)])
    }
}

fn headline(modes: &SlowingModes, motion: Motion) -> PageTable {
    let critical = match (modes.critical_speed, modes.critical_speeds.as_slice()) {
        (None, _) => "none".to_owned(),
        (Some(x), []) => speed(motion, fixed(6), x),
        (_, several) => {
            let all: Vec<String> = several.iter().map(|x| format!("{x:.6}")).collect();
            format!("{} {}", all.join(", "), speed_unit(motion))
        }
    };
    let of_surface = match motion {
        Motion::Rotation => "torsional frequency sqrt(k_t/J)",
        Motion::Translation => "frequency of a surface sqrt(k/m)",
    };
    let axial = modes
        .axial_frequency
        .zip(modes.axial_damping_ratio)
        .map(|(frequency, ratio)| {
            [
                ("axial frequency sqrt(k_e/m)", hertz(frequency)),
                ("axial damping ratio c_a/(2 sqrt(k_e m))", format!("{ratio:.4}")),
            ]
        });
    let main = [
        (of_surface, hertz(modes.torsional_frequency)),
        ("natural period T_n", period(modes.natural_period)),
        ("contact force", format!("{:.1} N", modes.normal_force)),
        ("critical speed under that force", critical),
    ];
    let count = main.len();
    PageTable::pairs(main.into_iter().chain(axial.into_iter().flatten())).brief(count)
}

/// A mode with its state.
type OfState<'a> = (&'a SystemState, &'a SystemMode);

fn with_states<'a>(states: impl Iterator<Item = &'a SystemState>) -> impl Iterator<Item = OfState<'a>> {
    states.flat_map(|state| state.modes.iter().map(move |mode| (state, mode)))
}

/// Table of the modes with the velocities of all inertias. The separated state is omitted: its modes are those of
/// slip under friction that does not fall.
fn shape_table(slowing: &SlowingModes, modes: &Modes, motion: Motion) -> PageTable {
    let states = || modes.states.iter().filter(|state| state.state != "separated");
    let of_chains = states().filter(|state| state.state != "axial");
    let parts = of_chains
        .flat_map(|state| &state.modes)
        .next()
        .map_or(&[][..], |mode| &mode.shape);
    let table = PageTable::of(with_states(states()))
        .text("state", |(state, _)| state.state)
        .number("omega_r", "", fixed(3).or(""), |(state, _)| state.relative_velocity)
        .text("mode", |(_, mode)| &mode.name)
        .number("Hz", "", fixed(1).or("-"), |(_, mode)| mode.frequency)
        .number("damping", "", fixed(4).or("-"), |(_, mode)| mode.damping_ratio)
        .count("1/s", |(state, mode)| {
            growth(slowing, state.relative_velocity, mode.growth_rate)
        });
    let table = parts.iter().fold(table, |table, part| {
        let letter = part.coordinate.replace("phi", "phi_");
        table.count(&letter, |(_, mode)| shape(mode, &part.coordinate))
    });
    table
        .done()
        .titled(format!("omega_r in {}; {OF_SHAPES}", speed_unit(motion)))
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
    let part = mode.shape.iter().find(|part| part.coordinate == coordinate);
    let hundredths = part.map(|part| (100.0 * part.amplitude * part.phase.cos()).round());
    // Adding zero drops the sign of -0.
    fixed(2)
        .or("")
        .print(hundredths.map(|hundredths| hundredths / 100.0 + 0.0))
}

fn damping_table(modes: &SlowingModes, motion: Motion) -> PageTable {
    let curve = &modes.effective_damping;
    let damping = unit(motion, Dimension::TorsionalDamping);
    PageTable::of((0..=8).map(|k| &curve[k * (curve.len() - 1) / 8]))
        .number(&format!("omega_r {}", speed_unit(motion)), "", fixed(4), |point| {
            point.relative_velocity
        })
        .number(&format!("effective damping {damping}"), "", fixed(4), |point| {
            point.damping
        })
        .number("ratio", "", fixed(4), |point| point.damping_ratio)
        .count("growth 1/s", |point| {
            growth(modes, Some(point.relative_velocity), point.growth_rate)
        })
        .done()
}

/// Why sliding keeps its stability.
fn kept(stability: Stability) -> Option<&'static str> {
    Some(match stability {
        Stability::Lost => return None,
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
    })
}

fn loss(lost: &Instability, modes: &SlowingModes, motion: Motion) -> PageTable {
    let counted = |folds: f64| match is_brief(modes) {
        true => "not counted: no oscillation fits in".to_owned(),
        false => format!("{folds:.2}"),
    };
    let time_and_speed = |time: f64, x: f64| format!("{time:.9} s, at {}", speed(motion, fixed(6), x));
    let crossing = lost
        .eigenvalue_crossing
        .as_ref()
        .map(|c| time_and_speed(c.time, c.relative_velocity));
    let died = lost.kick_above_noise.is_some_and(|above| above < 0.0);
    let decided = match lost.onset_decided_by {
        OnsetDecision::Perturbation => "the perturbation",
        OnsetDecision::Rounding => "rounding and solver error: this onset does not converge",
        OnsetDecision::FrictionPoints if lost.kick_above_noise.is_none() => "the points of the friction table",
        OnsetDecision::FrictionPoints => {
            "the perturbation or the points of the friction table: a run without a perturbation tells"
        }
        OnsetDecision::SmoothSliding => "neither perturbation nor rounding: smooth sliding stops by itself",
    };
    let window = lost.window();
    PageTable::pairs([
        (
            "loss of stability (zero of the margin)",
            time_and_speed(lost.time, lost.relative_velocity),
        ),
        ("first stick", or_none(lost.onset_time, |t| format!("{t:.9} s"))),
        ("growth exponent G", counted(lost.growth_exponent)),
        (
            "kick above rounding, e-folds",
            fixed(2).print(lost.kick_above_noise) + if died { ", it has died out" } else { "" },
        ),
        ("the onset is decided by", decided.to_owned()),
        (
            "eigenvalue crossing",
            crossing.unwrap_or_else(|| "none nearby".to_owned()),
        ),
        ("growth rate at the loss", format!("{:.4} 1/s", lost.growth_rate)),
        (
            "unstable until smooth sliding stops",
            format!("{window:.3e} s, {:.3} T_n", window / modes.natural_period),
        ),
        ("growth up to the first stick", counted(lost.growth_to_onset)),
        ("e-folds gained from the kick", fixed(2).print(lost.e_folds_gained)),
    ])
    .brief(5)
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

fn driving(modes: &Modes, motion: Motion) -> PageTable {
    PageTable::pairs(modes.driving.iter().map(|driven| {
        let (name, unit) = match driven.key {
            "contact.normal_force" => ("normal force", "N"),
            "actuation" => ("actuating force", "N"),
            "rotor.speed" => ("driven speed of the rotor", speed_unit(motion)),
            "stator.speed" => ("driven speed of the stator", speed_unit(motion)),
            "rotor.torque" => ("torque on the rotor", unit(motion, Dimension::Torque)),
            _ => ("torque on the stator", unit(motion, Dimension::Torque)),
        };
        (
            name,
            format!("{} {unit} ({})", significant(9).print(driven.value), driven.taken),
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

fn operating(point: &OperatingPoint, motion: Motion) -> PageTable {
    let speed = |w: f64| speed(motion, significant(9), w);
    let [of_rotor, of_stator, interface] = match motion {
        Motion::Rotation => ["rotor turns with", "stator turns with", "friction torque"],
        Motion::Translation => ["rotor moves with", "stator moves with", "friction force"],
    };
    let steady = match point.steady {
        true => "steady sliding at",
        false => "sliding, not steady, at",
    };
    let torque = format!(
        "{} {}",
        significant(9).print(point.interface_torque),
        unit(motion, Dimension::Torque)
    );
    let twist = |twist: &[f64]| {
        let all: Vec<String> = twist.iter().map(|&q| significant(9).print(q)).collect();
        (!all.is_empty()).then(|| format!("{} {}", all.join(", "), unit(motion, Dimension::Angle)))
    };
    let rows = [
        (steady, Some(speed(point.relative_velocity))),
        ("stability", Some(word(point.stability).to_owned())),
        (interface, Some(torque)),
        (of_rotor, point.rotor_speed.map(speed)),
        (of_stator, point.stator_speed.map(speed)),
        ("rotor twist", twist(&point.rotor_twist)),
        ("stator twist", twist(&point.stator_twist)),
    ];
    PageTable::pairs(rows.into_iter().filter_map(|(name, value)| Some((name, value?)))).brief(2)
}

fn mode_table(modes: &Modes, motion: Motion) -> PageTable {
    let size = |mode: &SystemMode| mode.frequency.map_or(mode.decay.abs(), |f| TAU * f);
    // Rounding is a share of the state's fastest eigenvalue.
    let digits = move |(state, mode): OfState, most: usize| {
        let largest = state.modes.iter().map(size).fold(0.0, f64::max);
        let digits = ((mode.decay.abs() / (ROUNDING * largest)).log10().max(1.0) as usize).min(most);
        significant(digits)
    };
    PageTable::of(with_states(modes.states.iter()))
        .text("state", |(state, _)| state.state)
        .number("omega_r", "", significant(6).or(""), |(state, _)| {
            state.relative_velocity
        })
        .number("Hz", "", significant(6).or("-"), |(_, mode)| mode.frequency)
        .count("damping", |(state, mode)| {
            digits((state, mode), 4).or("-").print(mode.damping_ratio)
        })
        .count("decay 1/s", |(state, mode)| digits((state, mode), 6).print(mode.decay))
        .text("moves most", |(_, mode)| mode.moves.clone().unwrap_or_default())
        .done()
        .titled(format!("omega_r in {}; {OF_STATES}", speed_unit(motion)))
}

fn changes_of_stability(modes: &Modes, motion: Motion) -> PageTable {
    /// Number of digits of critical values. Eigenvalues of stiff bristles have no more.
    const CRITICAL: NumberFormat = significant(8).or("none");
    let of_speed = format!("omega_r, {}", speed_unit(motion));
    let searches = [
        (&*of_speed, Some(&modes.critical_relative_velocities)),
        ("normal force, N", modes.critical_normal_forces.as_ref()),
        ("rotor damping x", modes.critical_rotor_damping.as_ref()),
        ("stator damping x", modes.critical_stator_damping.as_ref()),
    ];
    let searches = searches.iter().filter_map(|(what, search)| Some((*what, (*search)?)));
    let rows = searches.flat_map(|(what, search)| {
        let none = search.changes.is_empty().then_some(None);
        let changes = none.into_iter().chain(search.changes.iter().map(Some));
        changes.map(move |change| (what, search, change))
    });
    let unstable = |change: Option<&StabilityChange>, throughout| match (change, throughout) {
        (Some(change), _) if change.unstable_above => "above",
        (Some(_), _) => "below",
        (None, Some(SlidingVerdict::Unstable)) => "everywhere",
        (None, Some(SlidingVerdict::Neutral)) => "nowhere (neutral)",
        (None, _) => "nowhere",
    };
    let frequency = |change: &StabilityChange| significant(6).or("0").print(change.frequency);
    PageTable::of(rows)
        .text("critical", |(what, ..)| what)
        .number("value", "", CRITICAL, |(.., change)| change.map(|change| change.value))
        .text("unstable", |(_, search, change)| unstable(change, search.throughout))
        .count("Hz", |(.., change)| change.map_or_else(String::new, frequency))
        .number("at omega_r", "", significant(6).or(""), |(.., change)| {
            change.map(|change| change.relative_velocity)
        })
        .count("searched", |(_, search, _)| {
            format!("{} to {}", rough(search.from), rough(search.to))
        })
        .done()
        .titled(OF_CHANGES)
}

fn rough(value: f64) -> String {
    if value.abs() >= 1e6 {
        format!("{value:.1e}")
    } else {
        significant(3).print(value)
    }
}

fn absent(modes: &Modes) -> Option<String> {
    let rows = modes
        .absent
        .iter()
        .map(|absent| format!("{}: {}", absent.what, absent.why));
    let rows: Vec<String> = std::iter::once("not there:".to_owned()).chain(rows).collect();
    (rows.len() > 1).then(|| rows.join("\n"))
}
