//! Axis labels for the variables of a result file, and the events that a panel marks with lines.

use super::figure::Axis;
use stickslip_case::Motion;
use stickslip_files::schema;
use stickslip_system::record::{EventKind, channel};

pub(super) fn in_translation(words: &str) -> String {
    let words = words.replace("angle", "position").replace("Angle", "Position");
    words.replace("torque", "force").replace("Torque", "Force")
}

/// The axis of a variable of /trajectory. `one_shaft` means that the rotor is one shaft between two inertias.
pub fn of_variable(variable: &schema::Variable, motion: Motion, one_shaft: bool) -> Axis {
    let (mut name, mut symbol) = match channel::find(&variable.name) {
        Some(channel) => (channel.label.to_owned(), channel.symbol.to_owned()),
        None if variable.name == "time" => ("time".to_owned(), "t".to_owned()),
        None => (variable.name.replace('_', " "), String::new()),
    };
    // The twist is that of the first shaft, whatever the rotor's length.
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

/// Least distance between lines of one family, drawing units. If the closer half of the gaps is narrower, the lines
/// would hide the curve, and only the background shows the modes.
const CLOSEST: f64 = 150.0;
/// Least distance between lines of different families, drawing units.
const APART: f64 = 40.0;

/// Kinds that are shown or hidden together, the most important first.
const FAMILIES: [&[EventKind]; 5] = [
    &[EventKind::Stick, EventKind::Slip, EventKind::Reversal],
    &[EventKind::Separation, EventKind::Contact],
    &[EventKind::Corner],
    &[EventKind::Destabilised, EventKind::Restabilised],
    &[EventKind::Kick],
];

/// The marked events, by family. `place` gives the position of a time in drawing units.
pub fn marks(events: &[(f64, EventKind)], place: impl Fn(f64) -> f64) -> Vec<(f64, EventKind)> {
    let mut shown: Vec<(f64, EventKind)> = Vec::new();
    for family in FAMILIES {
        let of_family: Vec<_> = events.iter().filter(|e| family.contains(&e.1)).copied().collect();
        let gap = |pair: &[(f64, EventKind)]| place(pair[1].0) - place(pair[0].0);
        let mut gaps: Vec<f64> = of_family.windows(2).map(gap).collect();
        gaps.sort_by(f64::total_cmp);
        if gaps
            .get(gaps.len().saturating_sub(1) / 2)
            .is_some_and(|&gap| gap < CLOSEST)
        {
            continue;
        }
        let free = |e: &(f64, EventKind)| shown.iter().all(|other| (place(e.0) - place(other.0)).abs() >= APART);
        let free: Vec<_> = of_family.into_iter().filter(free).collect();
        shown.extend(free);
    }
    shown
}
