//! The physical parameters of a case, by dotted path. Sensitivities and searches vary them.

use super::document::{CaseValue, PlacedValue};
use super::place::Content;
use super::quantity::{self, Dimension};
use super::schema::{self, KeyKind};
use super::{Case, Words, signals};

/// A parameter of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseNumber {
    /// Dotted path, such as `torsion.damping`, `rotor.inertia.1` or `contact.normal_force.amplitude`. It has no index
    /// if one number replaces a list.
    pub path: String,
    /// SI unit, in the notation of the case file.
    pub unit: &'static str,
    /// Value in that unit.
    pub value: f64,
    /// Half a unit of the last written digit, in the unit of the value. Trailing zeros of a plain number do not
    /// count. `None` if the written form is unknown.
    pub half_last_digit: Option<f64>,
}

/// A longer list is a measured curve, whose numbers are no parameters.
const LONGEST_LIST: usize = 32;

const TABLES: &[&str] = &[
    "rotor",
    "stator",
    "axial",
    "actuation",
    "torsion",
    "contact",
    "friction",
    "initial",
    "perturbation",
];

/// Keys that are no parameters: they have no effect on events, or are whole numbers. The ringing floor is a
/// convention: it moves no event, but omits some. The first speed of a friction table is 0 by definition. The short
/// form lists whole numbers, too.
const APART: &[&str] = &[
    "rotor.torque_on",
    "stator.torque_on",
    "friction.exponent",
    schema::FIRST_SPEED,
    schema::AXIAL_RINGING_FLOOR,
];

/// All physical parameters in a tree of values, in its order. The general form omits zeros, which have no digits, and
/// lists of more than 32 elements. Defaults that follow from other parameters are not listed.
pub(super) fn of(root: &PlacedValue, words: Words) -> Vec<CaseNumber> {
    let mut numbers = Vec::new();
    for table in TABLES {
        if let Some(node) = root.at(table) {
            collect(node, table, words, &mut numbers);
        }
    }
    numbers
}

pub(super) fn half_last_digit(root: &PlacedValue, path: &str, words: Words) -> Option<f64> {
    printed(&root.at(path)?.value, dimension(path, words)?).map(|number| number.1)
}

/// The SI value of a written number, and half a unit of its last digit in SI. A plain number is in SI. Its digits are
/// those of its double's shortest decimal, so that trailing zeros are lost.
fn printed(value: &CaseValue, dimension: Dimension) -> Option<(f64, f64)> {
    let printed = match value {
        CaseValue::Integer(number) => quantity::printed(&number.to_string(), Dimension::Number),
        CaseValue::Float(number) => quantity::printed(&format!("{number:e}"), Dimension::Number),
        CaseValue::Text(text) => quantity::printed(text, dimension),
        _ => return None,
    };
    printed.ok()
}

fn collect(node: &PlacedValue, path: &str, words: Words, numbers: &mut Vec<CaseNumber>) {
    let apart = &APART[if words.short { 3 } else { 0 }..];
    match &node.value {
        CaseValue::Table(entries) => {
            for (name, entry) in entries {
                collect(entry, &format!("{path}.{name}"), words, numbers);
            }
        }
        CaseValue::Array(elements) if words.short || elements.len() <= LONGEST_LIST => {
            for (index, element) in elements.iter().enumerate() {
                collect(element, &format!("{path}.{index}"), words, numbers);
            }
        }
        _ if apart.contains(&path) => {}
        value => {
            if let Some(dimension) = dimension(path, words)
                && let Some((value, half_last_digit)) = printed(value, dimension)
                && (words.short || value != 0.0)
            {
                numbers.push(CaseNumber {
                    path: path.to_owned(),
                    unit: dimension.unit(),
                    value,
                    half_last_digit: Some(half_last_digit),
                });
            }
        }
    }
}

pub(super) fn dimension(path: &str, words: Words) -> Option<Dimension> {
    let motion = words.motion();
    let (key, _, inner) = schema::find(path, words.short).next()?;
    match key.kind {
        KeyKind::Signal(dimension) => Some(signals::measure(inner, dimension, motion).0),
        _ => key.dimension().map(|dimension| motion.dimension(dimension)),
    }
}

impl Case {
    /// Sets the number at `path` of either form, to form differences. The case may become invalid. Returns whether
    /// there is one.
    pub(super) fn put(&mut self, path: &str, value: f64, short: bool) -> bool {
        for (key, index, inner) in schema::find(path, short) {
            let mut places = (key.places)(self, index);
            let is_time = matches!(key.kind, KeyKind::Moment);
            let content = places.first().and_then(|place| place.get());
            let there = |content: &Content| is_time || content.number(inner).is_some();
            let Some(content) = content.filter(there) else { continue };
            for place in &mut places {
                place.set(content.clone().with_number(inner, value));
            }
            return true;
        }
        false
    }
}
