//! The TOML case file: units, validation, overrides.
//!
//! A [`CaseSource`] is text and where it is from; [`Case::parse`] turns it, with overrides, into a valid [`Case`]
//! in SI or into a [`CaseError`] that names every problem by file, line and key. The keys are those of
//! [`schema::keys`], the units those of [`quantity::UNITS`], the built-in cases [`builtin::CASES`].
//!
//! ```
//! use stickslip::case::{Case, CaseSource, Override};
//!
//! let source = CaseSource::built_in("paper")?;
//! let case = Case::parse(&source, &[Override::parse("torsion.damping=200 lbf in s/rad")?])?;
//! assert_eq!(case.number("torsion.damping")?, 22.59696580552334);
//! # Ok::<(), stickslip::case::CaseError>(())
//! ```

pub mod builtin;
pub mod quantity;
pub mod schema;

mod any;
mod conditions;
pub(crate) mod document;
mod error;
mod exact;
mod form;
mod motion;
mod numbers;
mod reader;
mod resolved;
mod setting;
mod source;
mod trains;
mod value;
mod written;

pub(crate) use any::CaseKeys;
pub use any::{AnyCase, CaseRef, ExactCase};
pub use document::Override;
pub use error::{CaseError, Problem};
pub use form::Form;
pub use motion::Motion;
pub use setting::Setting;
pub(crate) use setting::{Slot, key_of};
pub use source::{CaseSource, Origin};
pub(crate) use source::{toml_text, words};
pub use trains::{TrainCase, TrainKey, TrainKind, train_keys};
pub(crate) use value::number_of;
pub use written::{CaseNumber, WrittenCase};

use crate::friction::{Exponential, Friction, Parameters as _};
use crate::model::{Axial, BreakawayTest, Contact, ExactParameters, Initial, Parameters, Torsion};
use crate::signal::{Profile, Ramp, Signal};
use crate::simulation::{Following, OutputOptions, SolverOptions};

/// A case: what is computed, how, and what is recorded. Always valid when it comes from [`Case::parse`].
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// A text for reports and figures.
    pub title: String,
    /// The brake, SI.
    pub parameters: Parameters,
    /// How it is computed.
    pub solver: SolverOptions,
    /// Which times are computed and recorded.
    pub output: OutputOptions,
}

impl Case {
    /// Reads a case and applies the overrides, in their order.
    ///
    /// # Errors
    /// All problems that were found, each with its place, its key and what to do.
    pub fn parse(source: &CaseSource, overrides: &[Override]) -> Result<Case, CaseError> {
        reader::read(source, overrides)
    }

    /// The physical parameters without rounding: decimals as written, units by their exact factors. A plain number is the
    /// shortest decimal of its double, which is what was written if that has at most 15 digits.
    ///
    /// # Errors
    /// As those of [`Case::parse`].
    pub fn exact_parameters(source: &CaseSource, overrides: &[Override]) -> Result<ExactParameters, CaseError> {
        exact::read(source, overrides)
    }

    /// Half a unit of the last digit that is written of each number, in the SI unit of its key, by dotted path. Of a plain
    /// number zeros at its end do not count.
    ///
    /// # Errors
    /// As those of [`Case::parse`].
    pub fn half_last_digits(source: &CaseSource, overrides: &[Override]) -> Result<Vec<(String, f64)>, CaseError> {
        exact::half_last_digits(source, overrides)
    }

    /// The case as a TOML text in which every value is a number in SI, written so that it reads back as the
    /// identical case. Diameters of the contact have become the radius.
    pub fn resolved(&self) -> String {
        resolved::write(self)
    }

    /// A case with the defaults of the schema, and NaN for what has none.
    fn blank(title: String) -> Case {
        Case {
            title,
            parameters: Parameters {
                axial: Axial {
                    mass: f64::NAN,
                    stiffness: f64::NAN,
                    damping: f64::NAN,
                    ringing_floor: Axial::RINGING_FLOOR,
                },
                actuation: Signal::Ramp(Ramp::blank()),
                torsion: Torsion {
                    rotor_inertia: f64::NAN,
                    surface_inertia: f64::NAN,
                    stiffness: f64::NAN,
                    damping: f64::NAN,
                },
                contact: Contact {
                    radius: f64::NAN,
                    breakaway_test: BreakawayTest::default(),
                },
                friction: Friction {
                    breakaway: f64::NAN,
                    law: Exponential::unset().into(),
                },
                initial: Initial { speed: f64::NAN },
                perturbations: Vec::new(),
            },
            solver: SolverOptions::default(),
            output: OutputOptions {
                end_time: 10.0,
                interval: f64::NAN,
                windows: Vec::new(),
                steps: false,
                follow: Following::default(),
            },
        }
    }
}

/// The known name that an unknown one most likely means, if any is close; upper and lower case are alike.
pub(crate) fn suggest<'a>(unknown: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // Below this similarity, suggestions on misspelt keys are more often wrong than right.
    const CLOSE: f64 = 0.8;
    // No name is as long; and what it costs to compare grows with the length.
    const LONGEST: usize = 100;
    if unknown.len() > LONGEST {
        return None;
    }
    let unknown = unknown.to_lowercase();
    known
        .map(|name| (name, strsim::jaro_winkler(&unknown, &name.to_lowercase())))
        .filter(|&(_, similarity)| similarity >= CLOSE)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(name, _)| name)
}
