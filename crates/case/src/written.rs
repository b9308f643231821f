//! A case with its written parameters, each of which can be changed for derivatives, reruns and searches.

use super::document::{self, CaseError, CaseValue, PlacedValue};
use super::place::Content;
use super::quantity::{self, Dimension};
use super::schema::{self, KeyKind};
use super::{Case, CaseSource, Origin, Override, Words, conditions, reader, value};
use stickslip_system::model::system::System;

/// A case with its physical parameters: all of them in the short form, the written ones that are not zero in the
/// general form. Parameters without effect on events are omitted; the general form also omits lists beyond 32
/// elements.
#[derive(Debug, Clone)]
pub struct WrittenCase {
    case: Case,
    numbers: Vec<CaseNumber>,
    /// Text and overrides with which a changed case is read. In the short form the text is the resolved one, which
    /// lists every parameter.
    text: (CaseSource, Vec<Override>),
}

impl WrittenCase {
    /// Reads a case, and the written form of its parameters.
    ///
    /// # Errors
    /// All problems in the case.
    pub fn read(source: &CaseSource, overrides: &[Override]) -> Result<WrittenCase, CaseError> {
        let reader::ReadCase { case, written } = reader::read(source, overrides)?;
        if !case.is_short() {
            return Ok(WrittenCase {
                numbers: numbers_of(&written, case.words),
                text: (source.clone(), overrides.to_vec()),
                case,
            });
        }
        let mut read = WrittenCase::of(&case);
        for number in &mut read.numbers {
            number.half_last_digit = half_last_digit(&written, &number.path, case.words);
        }
        Ok(read)
    }

    /// Makes one from a case without text: the written form of the parameters is unknown.
    pub fn of(case: &Case) -> WrittenCase {
        let text = CaseSource {
            text: case.resolved(),
            origin: Origin::BuiltIn(case.title.clone()),
        };
        let words = match case.is_short() {
            true => case.words,
            false => Words::general(case.motion()),
        };
        let root = document::read(&text.text, "");
        let mut numbers = root.map_or_else(|_| Vec::new(), |root| numbers_of(&root, words));
        numbers.iter_mut().for_each(|number| number.half_last_digit = None);
        WrittenCase {
            case: case.clone(),
            numbers,
            text: (text, Vec::new()),
        }
    }

    /// Takes the last digits of parameters from the text from which a resolved case was made, if the values are
    /// equal. The digits of all other parameters are unknown.
    #[must_use]
    pub fn digits_of(mut self, given: &CaseSource) -> WrittenCase {
        let given = WrittenCase::read(given, &[]).map_or_else(|_| Vec::new(), |given| given.numbers);
        for number in &mut self.numbers {
            // A number may replace a list with one element.
            let same = |other: &&CaseNumber| {
                let of_list = number.path.strip_suffix(".0");
                (other.path == number.path || of_list == Some(&other.path)) && other.value == number.value
            };
            number.half_last_digit = given.iter().find(same).and_then(|other| other.half_last_digit);
        }
        self
    }

    /// Sets half a unit of a parameter's last digit, in the parameter's unit.
    #[must_use]
    pub fn with_half_last_digit(mut self, path: &str, half: f64) -> WrittenCase {
        let found = self.numbers.iter_mut().filter(|number| number.path == path);
        found.for_each(|number| number.half_last_digit = Some(half));
        self
    }

    /// The unchanged case.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// The physical parameters.
    pub fn numbers(&self) -> &[CaseNumber] {
        &self.numbers
    }

    /// The parameter at a path.
    pub fn number(&self, path: &str) -> Option<&CaseNumber> {
        self.numbers.iter().find(|number| number.path == path)
    }

    /// The case with another value of one parameter, in the unit of its key.
    ///
    /// # Errors
    /// There is no parameter at this path, or the case becomes invalid.
    pub fn with(&self, path: &str, value: f64) -> Result<Case, CaseError> {
        self.with_all(&[(path, value)])
    }

    /// The case with other values of several parameters, in the units of their keys.
    ///
    /// # Errors
    /// Errors of [`Self::with`].
    pub fn with_all<P: AsRef<str>>(&self, changes: &[(P, f64)]) -> Result<Case, CaseError> {
        let (source, overrides) = &self.text;
        let mut overrides = overrides.clone();
        overrides.extend(
            changes
                .iter()
                .map(|(path, value)| Override::number(path.as_ref(), *value)),
        );
        Case::read(source, &overrides)
    }

    /// The system with another value of a parameter, and the sliding speed (rad/s) below which a contact without
    /// stick counts as stuck. It serves to form differences: in the short form the value may lie beyond the limits of
    /// a valid case. `None` if there is no such system. A time of zero cannot be moved: before t = 0 nothing happens,
    /// and a later time adds a corner to the run.
    pub fn moved(&self, path: &str, value: f64) -> Option<(System, f64)> {
        let is_time = |number: &CaseNumber| number.unit == Dimension::Time.unit() && number.value == 0.0;
        match self.number(path).is_some_and(is_time) {
            true => None,
            false => self.moved_all(&[(path, value)]),
        }
    }

    /// Like [`Self::moved`], for several parameters.
    pub fn moved_all<P: AsRef<str>>(&self, changes: &[(P, f64)]) -> Option<(System, f64)> {
        let changes: Vec<(&str, f64)> = changes.iter().map(|(path, value)| (path.as_ref(), *value)).collect();
        if self.case.is_short() {
            let mut case = self.case.clone();
            let strange = changes.iter().filter(|(path, value)| !case.put(path, *value, true));
            let strange: Vec<_> = strange.collect();
            // The short form has no key for this place, such as a bearing. The value there must be valid.
            let fits = |(path, value): &(&str, f64)| {
                let key = [true, false]
                    .into_iter()
                    .find_map(|short| schema::find(path, short).next());
                key.is_some_and(|(key, ..)| key.domain().complaint(*value).is_none())
            };
            let found = strange.iter().all(|(path, value)| case.put(path, *value, false));
            let valid = strange.is_empty() || changes.iter().all(fits) && conditions::violated(&case).is_empty();
            return (found && valid).then_some((case.system, 0.0));
        }
        let case = self.with_all(&changes).ok()?;
        Some((case.system, case.threshold))
    }
}

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
    /// Half a unit of the last written digit, in the unit of the value; 0 for a number that was written as an integer,
    /// which is exact. Trailing zeros of a plain number do not count. `None` if the written form is unknown.
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
fn numbers_of(root: &PlacedValue, words: Words) -> Vec<CaseNumber> {
    let mut numbers = Vec::new();
    for table in TABLES {
        if let Some(node) = root.at(table) {
            collect(node, table, words, &mut numbers);
        }
    }
    numbers
}

fn half_last_digit(root: &PlacedValue, path: &str, words: Words) -> Option<f64> {
    printed(&root.at(path)?.value, dimension(path, words)?).map(|number| number.1)
}

/// The SI value of a written number, and half a unit of its last digit in SI, 0 for an integer. A plain number is in SI.
/// Its digits are those of its double's shortest decimal, so that trailing zeros are lost.
fn printed(value: &CaseValue, dimension: Dimension) -> Option<(f64, f64)> {
    let printed = match value {
        CaseValue::Integer(number) => return Some((*number as f64, 0.0)),
        CaseValue::Float(number) => quantity::printed(&format!("{number:e}"), Dimension::Number),
        CaseValue::Text(text) if is_integer(text) => quantity::printed(text, dimension).map(|(value, _)| (value, 0.0)),
        CaseValue::Text(text) => quantity::printed(text, dimension),
        _ => return None,
    };
    printed.ok()
}

/// Whether the number at the start of a text has neither a point nor an exponent.
fn is_integer(text: &str) -> bool {
    let number = text.trim().trim_start_matches(['+', '-']);
    !number
        .trim_start_matches(|c: char| c.is_ascii_digit())
        .starts_with(['.', 'e', 'E'])
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
        KeyKind::Signal(dimension) => Some(value::measure(inner, dimension, motion).0),
        _ => key.dimension().map(|dimension| motion.dimension(dimension)),
    }
}

impl Case {
    /// Sets the number at `path` of either form, to form differences. The case may become invalid. Returns whether
    /// there is one.
    pub(super) fn put(&mut self, path: &str, value: f64, short: bool) -> bool {
        for (key, index, inner) in schema::find(path, short) {
            let mut places = key.places(self, index);
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
