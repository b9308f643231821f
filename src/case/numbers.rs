//! The physical numbers of a case, by dotted path: what sensitivities and searches move.

use super::document::{Node, Value};
use super::place::Content;
use super::quantity::{self, Dimension};
use super::schema::{self, Kind};
use super::{Case, Words, signals};

/// A number of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseNumber {
    /// Dotted path, such as `torsion.damping`, `rotor.inertia.1` or `contact.normal_force.amplitude`; without an index where one
    /// number stands for a list.
    pub path: String,
    /// SI, in the notation of the case file.
    pub unit: &'static str,
    /// In that unit.
    pub value: f64,
    /// Half a unit of its last written digit, in that unit. Of a plain number zeros at its end do not count. `None` where it is
    /// not known how the number was written.
    pub half_last_digit: Option<f64>,
}

/// A list with more numbers than this is a measured curve, of which no single number is looked at.
const LONGEST_LIST: usize = 32;

/// The tables that define the physical problem.
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

/// Numbers that no event depends on, or that are whole. The floor of a ringing contact is a convention: it moves no event, it leaves
/// some out. The first speed of a friction table is standstill, and no other. The short form lists whole numbers too.
const APART: &[&str] = &[
    "rotor.torque_on",
    "stator.torque_on",
    "friction.exponent",
    schema::FIRST_SPEED,
    schema::AXIAL_RINGING_FLOOR,
];

/// Every physical number of a tree of values, in its order. Of the general form not those that are zero, which have no digits, and
/// of lists none with more than 32 elements. What follows from a number by default, such as a speed at t = 0 from that of a driven
/// end, is no number of its own.
pub(super) fn of(root: &Node, words: Words) -> Vec<CaseNumber> {
    let mut numbers = Vec::new();
    for table in TABLES {
        if let Some(node) = root.at(table) {
            collect(node, table, words, &mut numbers);
        }
    }
    numbers
}

/// Half a unit of the last digit with which the number of a path is written in a tree.
pub(super) fn half_last_digit(root: &Node, path: &str, words: Words) -> Option<f64> {
    printed(&root.at(path)?.value, dimension(path, words)?).map(|number| number.1)
}

/// A number as it is written, and half a unit of its last digit, SI. A plain number is in SI, whatever it stands for; it counts as
/// the shortest decimal of its double: zeros at its end are not told from none.
fn printed(value: &Value, dimension: Dimension) -> Option<(f64, f64)> {
    let printed = match value {
        Value::Integer(number) => quantity::printed(&number.to_string(), Dimension::Number),
        Value::Float(number) => quantity::printed(&format!("{number:e}"), Dimension::Number),
        Value::Text(text) => quantity::printed(text, dimension),
        _ => return None,
    };
    printed.ok()
}

fn collect(node: &Node, path: &str, words: Words, numbers: &mut Vec<CaseNumber>) {
    let apart = &APART[if words.short { 3 } else { 0 }..];
    match &node.value {
        Value::Table(entries) => {
            for (name, entry) in entries {
                collect(entry, &format!("{path}.{name}"), words, numbers);
            }
        }
        Value::Array(elements) if words.short || elements.len() <= LONGEST_LIST => {
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

/// What the number at a path measures; `None` of a word.
pub(super) fn dimension(path: &str, words: Words) -> Option<Dimension> {
    let motion = words.motion();
    let (key, _, inner) = schema::find(path, words.short).next()?;
    match key.kind {
        Kind::Signal(dimension) => Some(signals::measure(inner, dimension, motion).0),
        _ => key.dimension().map(|dimension| motion.dimension(dimension)),
    }
}

impl Case {
    /// With another number at `path` of either form, whether or not that makes a valid case: for differences. Whether there is
    /// such a place.
    pub(super) fn put(&mut self, path: &str, value: f64, short: bool) -> bool {
        for (key, index, inner) in schema::find(path, short) {
            let mut places = (key.places)(self, index);
            let is_time = matches!(key.kind, Kind::Moment);
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
