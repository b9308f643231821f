//! A case with the numbers that it is written with, each of which can be moved: for derivatives, reruns and searches.

use super::error::CaseError;
use super::quantity::Dimension;
use super::{Case, CaseNumber, CaseSource, Origin, Override, Words, conditions, document, numbers, reader, schema};
use crate::model::system::System;

/// A case with its physical numbers: of a short form every one that the case holds, of the general form those that are written and
/// not zero. Numbers that no event depends on are none of them, nor are those of lists with more than 32 elements in the general form.
#[derive(Debug, Clone)]
pub struct WrittenCase {
    case: Case,
    /// In the order of the text, or of the keys.
    numbers: Vec<CaseNumber>,
    /// What is read again with a number moved, and its overrides. In the short form it is the resolved text, which has every number.
    text: (CaseSource, Vec<Override>),
}

impl WrittenCase {
    /// Reads a case, and how its numbers are written.
    ///
    /// # Errors
    /// All problems that were found in the case.
    pub fn read(source: &CaseSource, overrides: &[Override]) -> Result<WrittenCase, CaseError> {
        let reader::Read { case, written } = reader::read(source, overrides)?;
        if !case.is_short() {
            return Ok(WrittenCase {
                numbers: numbers::of(&written, case.words),
                text: (source.clone(), overrides.to_vec()),
                case,
            });
        }
        let mut read = WrittenCase::of(&case);
        for number in &mut read.numbers {
            number.half_last_digit = numbers::half_last_digit(&written, &number.path, case.words);
        }
        Ok(read)
    }

    /// Of a case whose text is not known, nor how its numbers were written.
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
        let mut numbers = root.map_or_else(|_| Vec::new(), |root| numbers::of(&root, words));
        numbers.iter_mut().for_each(|number| number.half_last_digit = None);
        WrittenCase {
            case: case.clone(),
            numbers,
            text: (text, Vec::new()),
        }
    }

    /// The same, with the last digits that the numbers of the same value have in another text: that which a resolved case was made
    /// of. Those of other numbers are not known.
    #[must_use]
    pub fn digits_of(mut self, given: &CaseSource) -> WrittenCase {
        let given = WrittenCase::read(given, &[]).map_or_else(|_| Vec::new(), |given| given.numbers);
        for number in &mut self.numbers {
            // One number may stand for a list of one.
            let same = |other: &&CaseNumber| {
                let of_list = number.path.strip_suffix(".0");
                (other.path == number.path || of_list == Some(&other.path)) && other.value == number.value
            };
            number.half_last_digit = given.iter().find(same).and_then(|other| other.half_last_digit);
        }
        self
    }

    /// The same, where half a unit of the last digit of a number is this much, in its unit.
    #[must_use]
    pub fn with_half_last_digit(mut self, path: &str, half: f64) -> WrittenCase {
        let found = self.numbers.iter_mut().filter(|number| number.path == path);
        found.for_each(|number| number.half_last_digit = Some(half));
        self
    }

    /// The case as it is.
    pub fn case(&self) -> &Case {
        &self.case
    }

    /// Its physical numbers.
    pub fn numbers(&self) -> &[CaseNumber] {
        &self.numbers
    }

    /// The number at a path.
    pub fn number(&self, path: &str) -> Option<&CaseNumber> {
        self.numbers.iter().find(|number| number.path == path)
    }

    /// The case with another number at a path, in the unit of its key.
    ///
    /// # Errors
    /// If there is no place for a number at this path, or the case would not be valid.
    pub fn with(&self, path: &str, value: f64) -> Result<Case, CaseError> {
        self.with_all(&[(path, value)])
    }

    /// The case with other numbers at some paths.
    ///
    /// # Errors
    /// Those of [`Self::with`].
    pub fn with_all(&self, changes: &[(&str, f64)]) -> Result<Case, CaseError> {
        let (source, overrides) = &self.text;
        let mut overrides = overrides.clone();
        overrides.extend(changes.iter().map(|(path, value)| Override::number(path, *value)));
        Case::read(source, &overrides)
    }

    /// The system with another number at a path, and the sliding speed (rad/s) below which a contact without stick counts as stuck:
    /// for differences. The short form says what it is beyond the limits of a valid case, too; `None` where there is no system. A time
    /// of zero cannot be moved: before t = 0 nothing happens, and later it is a corner more.
    pub(crate) fn moved(&self, path: &str, value: f64) -> Option<(System, f64)> {
        let is_time = |number: &&CaseNumber| number.path == path && number.unit == Dimension::Time.unit();
        if self
            .numbers
            .iter()
            .find(is_time)
            .is_some_and(|number| number.value == 0.0)
        {
            return None;
        }
        self.moved_all(&[(path, value)])
    }

    /// As [`Self::moved`], with other numbers at some paths.
    pub(crate) fn moved_all(&self, changes: &[(&str, f64)]) -> Option<(System, f64)> {
        if self.case.is_short() {
            let mut case = self.case.clone();
            let strange: Vec<_> = changes
                .iter()
                .filter(|(path, value)| !case.put(path, *value, true))
                .collect();
            // A place of the system that the short form has no key for, such as a bearing: then the case has to be valid.
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
        let case = self.with_all(changes).ok()?;
        Some((case.system, case.threshold))
    }
}
