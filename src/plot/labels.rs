//! Axis labels for the variables of a result file.

use super::figure::Axis;
use stickslip_case::Motion;
use stickslip_files::schema;

/// Variable of /trajectory, its name, and the paper's symbol (empty if there is none).
pub const LABELS: &[(&str, &str, &str)] = &[
    ("time", "time", "t"),
    ("mode", "mode", ""),
    ("segment", "segment", ""),
    ("z", "axial displacement", "z"),
    ("z_dot", "axial velocity", "z′"),
    ("theta", "rotor angle", "θ"),
    ("theta_dot", "rotor speed", "θ′"),
    ("phi1", "stator surface angle", "φ₁"),
    ("phi1_dot", "stator surface speed", "φ₁′"),
    ("phi2", "rotor surface angle", "φ₂"),
    ("phi2_dot", "rotor surface speed", "φ₂′"),
    ("rotor_twist", "rotor twist", "θ − φ₂"),
    ("rotor_twist_rate", "rotor twist rate", "θ′ − φ₂′"),
    ("relative_velocity", "relative velocity", "ωᵣ"),
    ("slip_displacement", "slip displacement", "φ₂ − φ₁"),
    ("applied_force", "actuating force", "F"),
    ("normal_force", "contact force", "Fₙ"),
    ("friction_torque", "interface torque", "T"),
    ("transmitted_torque", "transmitted torque", "T_f"),
    ("energy_kinetic", "kinetic energy", ""),
    ("energy_elastic", "elastic energy", ""),
    ("work_applied", "work of the force", ""),
    ("work_perturbation", "work of the kicks", ""),
    ("dissipated_friction", "energy dissipated by friction", ""),
    ("dissipated_damping", "energy dissipated by damping", ""),
    ("energy_residual", "energy residual", ""),
];

pub(super) fn in_translation(words: &str) -> String {
    let words = words.replace("angle", "position").replace("Angle", "Position");
    words.replace("torque", "force").replace("Torque", "Force")
}

/// The axis of a variable of /trajectory. `one_shaft` means that the rotor is one shaft between two inertias.
pub fn of_variable(variable: &schema::Variable, motion: Motion, one_shaft: bool) -> Axis {
    let known = LABELS.iter().find(|label| label.0 == variable.name);
    let (mut name, mut symbol) = known.map_or_else(
        || (variable.name.replace('_', " "), String::new()),
        |&(_, name, symbol)| (name.to_owned(), symbol.to_owned()),
    );
    // The twist is that of the first shaft, whatever the length of the rotor.
    if !one_shaft && variable.name.starts_with("rotor_twist") {
        symbol.clear();
    }
    if motion == Motion::Translation {
        name = in_translation(&name);
        for (angular, linear) in [("φ", "x"), ("ω", "v"), ("θ", "x")] {
            symbol = symbol.replace(angular, linear);
        }
    }
    Axis::new(&name, &variable.units).with_symbol(&symbol)
}

/// A common axis for several channels, named with the words in which all names end.
pub fn common(axes: &[Axis]) -> Axis {
    let Some(first) = axes.first() else {
        return Axis::new("", "1");
    };
    if axes.len() == 1 {
        return first.clone();
    }
    let words: Vec<&str> = first.name.split(' ').collect();
    let shared = |n: usize| {
        let end = words[words.len() - n..].join(" ");
        axes.iter().all(|axis| axis.name.ends_with(&end)).then_some(end)
    };
    // If the names differ in a number only, the words before the number are used.
    let numbered = |axis: &Axis| {
        let (name, number) = axis.name.rsplit_once(' ')?;
        number.parse::<usize>().ok().map(|_| name.to_owned())
    };
    let alike = || numbered(first).filter(|name| axes.iter().all(|axis| numbered(axis).as_ref() == Some(name)));
    if let Some(name) = alike() {
        return Axis::new(&name, &first.unit);
    }
    let name = (1..=words.len()).rev().find_map(shared);
    let symbols: Vec<&str> = axes.iter().map(Axis::short).collect();
    Axis {
        symbol: symbols.join(", "),
        ..Axis::new(name.as_deref().unwrap_or(""), &first.unit)
    }
}
