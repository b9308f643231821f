//! The physical numbers of a case of trains as they are written: for sensitivities.

use super::keys::{self, TrainKind};
use super::signals::dimension_of;
use super::{TrainCase, reader};
use crate::case::document::{Node, Override, Value};
use crate::case::key_of;
use crate::case::quantity::{self, Dimension};
use crate::case::schema;
use crate::case::{CaseError, CaseNumber, CaseSource, Motion};

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

impl TrainCase {
    /// Every physical number that is written in a case of trains with these overrides, in the order of the text; not those that
    /// are zero, which have no digits, and of lists none with more than 32 elements. What follows from a number by default, such
    /// as a speed at t = 0 from that of a driven end, is no number of its own.
    ///
    /// # Errors
    /// As those of [`TrainCase::parse`].
    pub fn numbers(source: &CaseSource, overrides: &[Override]) -> Result<Vec<CaseNumber>, CaseError> {
        let reader::Read { case, written, .. } = reader::read(source, overrides)?;
        let mut numbers = Vec::new();
        for table in TABLES {
            if let Some(node) = written.at(table) {
                collect(node, table, case.motion, &mut numbers);
            }
        }
        Ok(numbers)
    }
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
            // A plain number is in SI, whatever it stands for.
            let printed = match value {
                Value::Integer(number) => quantity::printed(&number.to_string(), Dimension::Number),
                Value::Float(number) => quantity::printed(&format!("{number:e}"), Dimension::Number),
                Value::Text(text) => quantity::printed(text, dimension),
                _ => return,
            };
            if let Ok((value, half_last_digit)) = printed
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
    let of_trains = keys::KEYS.iter().find(|key| {
        let rest = path.strip_prefix(key.path);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    });
    match of_trains.map(|key| key.kind) {
        Some(TrainKind::List(dimension) | TrainKind::Number(dimension)) => Some(motion.dimension(dimension)),
        Some(TrainKind::Signal(dimension)) => Some(dimension_of(path, dimension, motion)),
        Some(TrainKind::Choice(_) | TrainKind::Index) => None,
        None => key_of(path)?.dimension().map(|dimension| motion.dimension(dimension)),
    }
}
