//! The physical numbers of a case, by dotted path: what sensitivities and searches move.

use super::document::{Node, Value};
use super::draft::Draft;
use super::quantity::{self, Dimension};
use super::reader::Read;
use super::schema::{self, Key, Kind, Presence};
use super::trains::keys;
use super::trains::signals;
use super::{Motion, key_of};
use crate::model::KickTime;

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
    "contact",
    "friction",
    "initial",
    "perturbation",
];

/// Numbers that no event depends on, or that are whole.
const APART: &[&str] = &[
    "rotor.torque_on",
    "stator.torque_on",
    "friction.exponent",
    schema::FIRST_SPEED,
    schema::AXIAL_RINGING_FLOOR,
];

/// Every physical number that is written in a case of the general form, in the order of the text; not those that are zero, which
/// have no digits, and of lists none with more than 32 elements. What follows from a number by default, such as a speed at t = 0
/// from that of a driven end, is no number of its own.
pub(super) fn written(read: &Read) -> Vec<CaseNumber> {
    let mut numbers = Vec::new();
    for table in TABLES {
        if let Some(node) = read.written.at(table) {
            collect(node, table, read.case.motion(), &mut numbers);
        }
    }
    numbers
}

/// Every physical number of the short form, with the last digits that it has in the tree of its values.
pub(super) fn of_short_form(draft: &Draft, written: Option<&Node>) -> Vec<CaseNumber> {
    // The floor of a ringing contact is a convention: it moves no event, it leaves some out. The first speed of a friction
    // table is standstill, and no other.
    let physical = |path: &str| {
        !path.starts_with("solver.")
            && !path.starts_with("output.")
            && ![schema::AXIAL_RINGING_FLOOR, schema::FIRST_SPEED].contains(&path)
    };
    let paths = draft.number_paths().into_iter();
    let number = |(path, key): (String, &Key)| {
        let dimension = key.dimension().unwrap_or(Dimension::Number);
        let value = draft.number(&path)?;
        let written = written.and_then(|root| printed(&root.at(&path)?.value, dimension));
        Some(CaseNumber {
            unit: dimension.unit(),
            value,
            half_last_digit: written.map(|(_, half)| half),
            path,
        })
    };
    paths.filter(|(path, _)| physical(path)).filter_map(number).collect()
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

fn collect(node: &Node, path: &str, motion: Motion, numbers: &mut Vec<CaseNumber>) {
    match &node.value {
        Value::Table(entries) => {
            for (name, entry) in entries {
                collect(entry, &format!("{path}.{name}"), motion, numbers);
            }
        }
        Value::Array(elements) if elements.len() <= LONGEST_LIST => {
            for (index, element) in elements.iter().enumerate() {
                collect(element, &format!("{path}.{index}"), motion, numbers);
            }
        }
        _ if APART.contains(&path) => {}
        value => {
            let Some(dimension) = dimension(path, motion) else {
                return;
            };
            if let Some((value, half_last_digit)) = printed(value, dimension)
                && value != 0.0
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
fn dimension(path: &str, motion: Motion) -> Option<Dimension> {
    let general = keys::KEYS.iter().find(|key| {
        let rest = path.strip_prefix(key.path);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    });
    let key = general.or_else(|| key_of(path))?;
    match key.kind {
        Kind::Signal(dimension) => Some(signals::dimension_of(path, dimension, motion)),
        Kind::Index => None,
        _ => key.dimension().map(|dimension| motion.dimension(dimension)),
    }
}

/// A number of a draft: its key, the index of its array element, and its index in a series.
struct Target {
    key: &'static Key,
    index: usize,
    element: usize,
}

impl Draft {
    /// The number at a dotted path; `None` of an option left to its default, and of a kick at the instability.
    fn number(&self, path: &str) -> Option<f64> {
        self.target(path).and_then(|target| self.get(&target))
    }

    /// With another number at `path`, whether or not that makes a valid case: for differences. Whether there is such a path.
    pub(super) fn put(&mut self, path: &str, value: f64) -> bool {
        let Some(target) = self.target(path) else { return false };
        match &target.key.kind {
            Kind::Number(_, _, access) => (access.set)(self, target.index, value),
            Kind::Moment(access) => (access.set)(self, target.index, KickTime::At(value)),
            Kind::Series(_, access) => {
                if let Some(mut series) = (access.get)(self, target.index) {
                    series[target.element] = value;
                    (access.set)(self, target.index, series);
                }
            }
            _ => {}
        }
        true
    }

    /// The dotted path of every number that it holds, with its key.
    fn number_paths(&self) -> Vec<(String, &'static Key)> {
        let mut paths = Vec::new();
        for key in schema::keys() {
            let count = schema::array_of(key).map_or(1, |(array, _)| (array.length)(self));
            for index in 0..count {
                let path = schema::concrete(key, index);
                match &key.kind {
                    Kind::Series(_, access) => {
                        let length = (access.get)(self, index).map_or(0, |series| series.len());
                        paths.extend((0..length).map(|element| (format!("{path}.{element}"), key)));
                    }
                    _ if self.number(&path).is_some() => paths.push((path, key)),
                    _ => {}
                }
            }
        }
        paths
    }

    /// What a path means; `None` if no number can be there.
    fn target(&self, path: &str) -> Option<Target> {
        schema::keys().iter().find_map(|key| {
            let found = |index, element| Some(Target { key, index, element });
            match &key.kind {
                Kind::Number(_, _, access) if schema::array_of(key).is_none() => {
                    // A key of the other profile, or of another friction law, takes part in nothing.
                    let optional = matches!(key.presence, Presence::Profile(_) | Presence::Law { .. });
                    let present = !optional || (access.get)(self, 0).is_some();
                    (path == key.path && present).then(|| found(0, 0)).flatten()
                }
                Kind::Number(..) | Kind::Moment(_) => {
                    let (array, name) = schema::array_of(key)?;
                    let index = path.strip_prefix(array.path)?.strip_prefix('.')?.strip_suffix(name)?;
                    let index: usize = index.strip_suffix('.')?.parse().ok()?;
                    (index < (array.length)(self)).then(|| found(index, 0)).flatten()
                }
                Kind::Series(_, access) => {
                    let element: usize = path.strip_prefix(key.path)?.strip_prefix('.')?.parse().ok()?;
                    let length = (access.get)(self, 0)?.len();
                    (element < length).then(|| found(0, element)).flatten()
                }
                _ => None,
            }
        })
    }

    fn get(&self, target: &Target) -> Option<f64> {
        match &target.key.kind {
            Kind::Number(_, _, access) => (access.get)(self, target.index),
            Kind::Moment(access) => match (access.get)(self, target.index)? {
                KickTime::At(time) => Some(time),
                KickTime::Instability => None,
            },
            Kind::Series(_, access) => (access.get)(self, target.index)?.get(target.element).copied(),
            _ => None,
        }
    }
}
