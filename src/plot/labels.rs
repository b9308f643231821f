//! Axis labels for the variables of a result file.

use super::figure::Axis;
use stickslip_case::Motion;
use stickslip_files::schema;
use stickslip_system::record::channel;

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
