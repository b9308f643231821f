//! A case with the numbers that it is written with, each of which can be moved: for derivatives, reruns and searches.

use super::any::{AnyCase, CaseRef};
use super::error::CaseError;
use super::quantity::Dimension;
use super::{Case, CaseSource, Origin, Override, TrainCase, schema};
use crate::model::trains::Trains;

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

/// A case with its physical numbers: of a short form every one that the case holds, of the general form those that are written and
/// not zero. Numbers that no event depends on are none of them, nor are those of lists with more than 32 elements in the general form.
#[derive(Debug, Clone)]
pub struct WrittenCase {
    case: AnyCase,
    /// In the order of the text, or of the keys.
    numbers: Vec<CaseNumber>,
    /// Of the general form, what is read again with a number moved.
    text: Option<(CaseSource, Vec<Override>)>,
}

impl WrittenCase {
    /// Reads a case, and how its numbers are written.
    ///
    /// # Errors
    /// All problems that were found in the case.
    pub fn read(source: &CaseSource, overrides: &[Override]) -> Result<WrittenCase, CaseError> {
        match AnyCase::read(source, overrides)? {
            AnyCase::Brake(case) => {
                let halves = Case::half_last_digits(source, overrides)?;
                let half = |path: &str| Some(halves.iter().find(|half| half.0 == path)?.1);
                Ok(WrittenCase {
                    numbers: numbers_of(&case, half),
                    case: AnyCase::Brake(case),
                    text: None,
                })
            }
            case @ AnyCase::Trains(_) => Ok(WrittenCase {
                case,
                numbers: TrainCase::numbers(source, overrides)?,
                text: Some((source.clone(), overrides.to_vec())),
            }),
        }
    }

    /// Of a case whose text is not known, nor how its numbers were written.
    pub fn of(case: CaseRef<'_>) -> WrittenCase {
        match case {
            CaseRef::Brake(case) => WrittenCase {
                case: AnyCase::Brake(Box::new(case.clone())),
                numbers: numbers_of(case, |_| None),
                text: None,
            },
            CaseRef::Trains(case) => {
                let source = CaseSource {
                    text: case.resolved(),
                    origin: Origin::BuiltIn(case.title.clone()),
                };
                let mut numbers = TrainCase::numbers(&source, &[]).unwrap_or_default();
                numbers.iter_mut().for_each(|number| number.half_last_digit = None);
                WrittenCase {
                    case: AnyCase::Trains(Box::new(case.clone())),
                    numbers,
                    text: Some((source, Vec::new())),
                }
            }
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
    pub fn case(&self) -> CaseRef<'_> {
        CaseRef::from(&self.case)
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
    pub fn with(&self, path: &str, value: f64) -> Result<AnyCase, CaseError> {
        self.with_all(&[(path, value)])
    }

    /// The case with other numbers at some paths.
    ///
    /// # Errors
    /// Those of [`Self::with`].
    pub fn with_all(&self, changes: &[(&str, f64)]) -> Result<AnyCase, CaseError> {
        let mut case = self.case.clone();
        match (&mut case, &self.text) {
            (AnyCase::Brake(case), _) => {
                for (path, value) in changes {
                    case.set_number(path, *value)?;
                }
            }
            (AnyCase::Trains(case), None) => {
                for (path, value) in changes {
                    **case = case.with_number(path, *value)?;
                }
            }
            (AnyCase::Trains(case), Some((source, overrides))) => {
                let mut overrides = overrides.clone();
                overrides.extend(changes.iter().map(|(path, value)| Override::number(path, *value)));
                **case = TrainCase::parse(source, &overrides)?;
            }
        }
        Ok(case)
    }

    /// The system with another number at a path, and the sliding speed (rad/s) below which a contact without stick counts as stuck:
    /// for differences. The short form says what it is beyond the limits of a valid case, too; `None` where there is no system. A time
    /// of zero cannot be moved: before t = 0 nothing happens, and later it is a corner more.
    pub(crate) fn moved(&self, path: &str, value: f64) -> Option<(Trains, f64)> {
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
    pub(crate) fn moved_all(&self, changes: &[(&str, f64)]) -> Option<(Trains, f64)> {
        match &self.case {
            AnyCase::Brake(case) => {
                let mut case = case.clone();
                for (path, value) in changes {
                    case.parameters = case.parameters_with(path, *value);
                }
                Some((Trains::from(&case.parameters), 0.0))
            }
            AnyCase::Trains(_) => {
                let case = self.with_all(changes).ok()?;
                let case = CaseRef::from(&case);
                Some((case.system().into_owned(), case.threshold()))
            }
        }
    }
}

/// The physical numbers of the short form.
fn numbers_of(case: &Case, half: impl Fn(&str) -> Option<f64>) -> Vec<CaseNumber> {
    // The floor of a ringing contact is a convention: it moves no event, it leaves some out. The first speed of a friction
    // table is standstill, and no other.
    let physical = |path: &str| {
        !path.starts_with("solver.")
            && !path.starts_with("output.")
            && ![schema::AXIAL_RINGING_FLOOR, schema::FIRST_SPEED].contains(&path)
    };
    let numbers = case.number_paths().into_iter().filter(|(path, _)| physical(path));
    numbers
        .filter_map(|(path, key)| {
            Some(CaseNumber {
                unit: key.dimension().map_or("1", |dimension| dimension.unit()),
                value: case.number(&path).ok()?,
                half_last_digit: half(&path),
                path,
            })
        })
        .collect()
}
