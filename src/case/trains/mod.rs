//! Cases of two trains at one contact: `[rotor]` and `[stator]` in the place of `[torsion]`.
//!
//! What such a case shares with the brake's (`[axial]`, `[actuation]`, `[contact]`, `[friction]`, `[[perturbation]]`, `[solver]`,
//! `[output]`) is read through the same keys, into a [`Case`] that is thrown away; the keys of trains are in `keys`.

mod conditions;
mod exact;
pub(super) mod keys;
mod numbers;
mod places;
mod reader;
mod resolved;
mod signals;

use num_rational::BigRational;

use super::document::{self, Value};
use super::form::table_of;
use super::{CaseError, CaseSource, Motion, Override};
use crate::model::trains::{ExactTrains, Trains};
use crate::simulation::{OutputOptions, SolverOptions};

pub use keys::{TrainKey, TrainKind};

pub(super) use places::{close_in_signal, is_signal, misplaced, slot};
pub(super) use reader::motion_of;

/// The paths of all keys of a case of trains, with `[]` for indices.
pub(super) fn known_keys() -> Vec<&'static str> {
    keys::known()
}

/// Every key that only a case of trains has. The others of such a case are those of [`super::schema::keys`], but for
/// `[torsion]`.
pub fn train_keys() -> &'static [TrainKey] {
    keys::KEYS
}

/// A case of two trains. Always valid when it comes from [`TrainCase::parse`].
#[derive(Debug, Clone, PartialEq)]
pub struct TrainCase {
    /// A text for reports and figures.
    pub title: String,
    /// What its coordinates are.
    pub motion: Motion,
    /// The trains, SI.
    pub parameters: Trains,
    /// How it is computed.
    pub solver: SolverOptions,
    /// Which times are computed and recorded.
    pub output: OutputOptions,
    /// |omega_r| (rad/s) below which statistics count a stick, of a contact that has none.
    pub threshold: Option<f64>,
}

impl TrainCase {
    /// Whether a text with these overrides is a case of trains. A text that is no TOML is none.
    pub fn is_one(source: &CaseSource, overrides: &[Override]) -> bool {
        let Ok(mut root) = document::read(&source.text, &source.label()) else {
            return false;
        };
        for change in overrides {
            // What does not fit is reported by whoever reads the case.
            let _ = document::apply(&mut root, change);
        }
        table_of(&root).is_some()
    }

    /// Reads a case and applies the overrides, in their order.
    ///
    /// # Errors
    /// All problems that were found, each with its place, its key and what to do.
    pub fn parse(source: &CaseSource, overrides: &[Override]) -> Result<TrainCase, CaseError> {
        reader::read(source, overrides).map(|read| read.case)
    }

    /// The trains without rounding, as [`super::Case::exact_parameters`]. A default that follows from other numbers follows from
    /// their exact values. The speed of an inertia that turns with an end driven by a sine or cosine is known to 2^-2400 of the
    /// amplitude, since it is no rational.
    ///
    /// # Errors
    /// As those of [`TrainCase::parse`].
    pub fn exact_parameters(source: &CaseSource, overrides: &[Override]) -> Result<ExactTrains, CaseError> {
        let reader::Read { case, of_law, written } = reader::read(source, overrides)?;
        exact::read(&case, &of_law, &written)
    }

    /// [`Self::threshold`] without rounding, rad/s.
    ///
    /// # Errors
    /// As those of [`TrainCase::parse`].
    pub fn exact_threshold(source: &CaseSource, overrides: &[Override]) -> Result<Option<BigRational>, CaseError> {
        let reader::Read { case, of_law, written } = reader::read(source, overrides)?;
        exact::threshold(&case, &of_law, &written)
    }

    /// The case as a TOML text in which every value is a number in SI, written so that it reads back as the identical case.
    pub fn resolved(&self) -> String {
        resolved::write(self)
    }

    /// The number at a dotted path of the resolved text, such as `rotor.inertia.0` or `stator.speed.amplitude`, in the unit of
    /// its key.
    ///
    /// # Errors
    /// If the case has no number there.
    pub fn number(&self, path: &str) -> Result<f64, CaseError> {
        let root = document::read(&self.resolved(), &self.title)?;
        match root.at(path).map(|node| &node.value) {
            Some(Value::Float(number)) => Ok(*number),
            Some(Value::Integer(number)) => Ok(*number as f64),
            _ => Err(CaseError::one("", path, "the case has no number of that path")),
        }
    }

    /// The same with another number at such a path.
    ///
    /// # Errors
    /// If the case has no number there, or would no longer be valid.
    pub fn with_number(&self, path: &str, value: f64) -> Result<TrainCase, CaseError> {
        self.number(path)?;
        let source = CaseSource {
            text: self.resolved(),
            origin: super::Origin::BuiltIn(self.title.clone()),
        };
        TrainCase::parse(&source, &[Override::number(path, value)])
    }
}
