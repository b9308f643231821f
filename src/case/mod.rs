//! The case file: TOML with units, read into a system and the words for its places.
//!
//! A [`CaseSource`] is text and where it is from; [`Case::read`] turns it, with overrides, into a valid [`Case`] in SI or into a
//! [`CaseError`] that names every problem by file, line and key. A file has the short form, `[torsion]`, or the general one,
//! `[rotor]` and `[stator]`: two lists of keys for one system. Only this module knows which.
//!
//! | file | question |
//! |---|---|
//! | `source`, `builtin` | Where is the text from? |
//! | `document` | What is the text? A tree of values with their lines, and overrides in it |
//! | `schema` | Which keys are there? One row for each: path, form, default, kind, places of a case, description |
//! | `place` | What stands at a place of a case, and how is it set and written? |
//! | `quantity`, `motion` | What does a number measure, and in which unit? |
//! | `value`, `signals` | What does one value say: a number, a word, a list, a signal? |
//! | `reader` | What does the tree say? Every key by its row, and every problem |
//! | `chains`, `contact` | The same where keys depend on each other: parts of a chain, radius, pressing, law |
//! | `conditions` | Do the values go together? |
//! | `resolved` | The case as text in SI |
//! | `numbers`, `written` | Which numbers has a case, with how many digits, and what is it with another one? |
//! | `exact` | The system without rounding |
//! | `setting`, `case_keys` | What may vary in a study? |
//! | `words` | What are the names and units of the places of the system? |
//! | `error` | What is wrong, and where? |
//!
//! ```
//! use stickslip::case::{Case, CaseSource, Override};
//!
//! let source = CaseSource::built_in("paper")?;
//! let case = Case::read(&source, &[Override::parse("torsion.damping=200 lbf in s/rad")?])?;
//! assert_eq!(case.number("torsion.damping")?, 22.59696580552334);
//! # Ok::<(), stickslip::case::CaseError>(())
//! ```

pub mod builtin;
pub mod quantity;
pub mod schema;

mod case_keys;
mod chains;
mod conditions;
mod contact;
pub(crate) mod document;
mod error;
mod exact;
mod motion;
mod numbers;
mod place;
mod reader;
mod resolved;
mod setting;
mod signals;
mod source;
mod value;
mod words;
mod written;

pub(crate) use case_keys::CaseKeys;
pub use document::Override;
pub use error::{CaseError, Problem};
pub use exact::ExactCase;
pub use motion::Motion;
pub use numbers::CaseNumber;
pub use schema::train_keys;
pub(crate) use schema::{METHOD, key_of};
pub use setting::Setting;
pub(crate) use setting::Slot;
pub use source::{CaseSource, Origin};
pub(crate) use source::{toml_text, words};
pub use words::Words;
pub use written::WrittenCase;

use crate::friction::{Exponential, Parameters as _};
use crate::model::margin::twice_resistance;
use crate::model::system::{ContactLaw, End, Initial, Pressing, System, Train};
use crate::model::{Axial, BreakawayTest, Parameters};
use crate::signal::{Drive, Profile as _, Ramp};
use crate::simulation::{Following, OutputOptions, SolverOptions};

/// A case: what is computed, how, and what is recorded. Always valid when it comes from [`Case::read`].
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// A text for reports and figures.
    pub title: String,
    /// The system, SI.
    pub system: System,
    /// How it is computed.
    pub solver: SolverOptions,
    /// Which times are computed and recorded.
    pub output: OutputOptions,
    /// How the places of its system are called.
    pub words: Words,
    /// Sliding speed (rad/s) below which a contact without stick counts as stuck; 0 of others.
    pub threshold: f64,
}

impl Case {
    /// Reads a case and applies the overrides, in their order.
    ///
    /// # Errors
    /// All problems that were found, each with its place, its key and what to do.
    pub fn read(source: &CaseSource, overrides: &[Override]) -> Result<Case, CaseError> {
        reader::read(source, overrides).map(|read| read.case)
    }

    /// The system without rounding: decimals as written, units by their exact factors. A plain number is the shortest decimal of
    /// its double, which is what was written if that has at most 15 digits. A default that follows from other numbers follows from
    /// their exact values. The speed of an inertia that turns with an end driven by a sine or cosine is known to 2^-2400 of the
    /// amplitude, since it is no rational.
    ///
    /// # Errors
    /// As those of [`Case::read`].
    pub fn exact(source: &CaseSource, overrides: &[Override]) -> Result<ExactCase, CaseError> {
        exact::read(&reader::read(source, overrides)?)
    }

    /// The case as a TOML text in which every value is a number in SI, written so that it reads back as the identical case.
    /// Diameters of the contact have become the radius.
    pub fn resolved(&self) -> String {
        resolved::write(self)
    }

    /// The number at a dotted path of the resolved text, such as `torsion.damping` or `stator.speed.amplitude`, in the unit of its
    /// key.
    ///
    /// # Errors
    /// If the case has no number there: an unknown path, no such element, an option left to its default, a word.
    pub fn number(&self, path: &str) -> Result<f64, CaseError> {
        let root = document::read(&self.resolved(), &self.title)?;
        match root.at(path).map(|node| &node.value) {
            Some(document::Value::Float(number)) => Ok(*number),
            Some(document::Value::Integer(number)) => Ok(*number as f64),
            _ => Err(CaseError::one("", path, "the case has no number of that path")),
        }
    }

    /// The same case, written with `[rotor]` and `[stator]`.
    #[must_use]
    pub fn in_general_form(&self) -> Case {
        Case {
            words: Words::general(self.motion()),
            ..self.clone()
        }
    }

    /// Whether it is written in the short form: its words are, and it is a system that this form can say.
    fn is_short(&self) -> bool {
        self.words.short && Parameters::of(&self.system).is_some()
    }

    /// The defaults of the schema, and NaN for each number that has none. In the short form a rotor of surface and inertia on one
    /// shaft, free, and a surface on a shaft that ends in the ground.
    fn blank(title: String, words: Words) -> Case {
        let [rotor, stator] = if words.short { [2, 1] } else { [0, 0] };
        let train = |inertias: usize, end: End| Train {
            inertia: vec![f64::NAN; inertias],
            stiffness: vec![f64::NAN; inertias.min(1)],
            damping: vec![f64::NAN; inertias.min(1)],
            viscous: vec![0.0; inertias],
            end,
            torque: None,
        };
        Case {
            title,
            system: System {
                rotor: train(rotor, End::Free),
                stator: train(stator, End::Fixed),
                radius: f64::NAN,
                pressing: match words.short {
                    true => Case::axial_mode(),
                    false => Pressing::Force(Drive::Value(f64::NAN)),
                },
                breakaway: f64::NAN,
                breakaway_test: BreakawayTest::default(),
                law: Exponential::unset().into(),
                contact: ContactLaw::StickSlip,
                initial: Initial {
                    rotor_twist: vec![0.0; rotor.min(1)],
                    rotor_speed: vec![f64::NAN; rotor],
                    stator_twist: vec![0.0; stator],
                    stator_speed: vec![0.0; stator],
                },
                kicks: Vec::new(),
            },
            solver: SolverOptions::default(),
            output: OutputOptions {
                end_time: 10.0,
                interval: f64::NAN,
                windows: Vec::new(),
                steps: false,
                follow: Following::default(),
            },
            words,
            threshold: f64::NAN,
        }
    }

    /// An axial mode of which no number is known yet.
    fn axial_mode() -> Pressing {
        Pressing::Axial {
            axial: Axial {
                mass: f64::NAN,
                stiffness: f64::NAN,
                damping: f64::NAN,
                ringing_floor: Axial::RINGING_FLOOR,
            },
            actuation: Ramp::blank().into(),
        }
    }

    /// Leaves out what only tells which samples a run has: it then has none but those at its ends and its events.
    pub fn without_trajectory(&mut self) {
        self.output.interval = self.output.end_time;
        self.output.windows.clear();
        self.output.steps = false;
        self.output.follow = Following::default();
    }

    /// Whether sliding slows down by itself, to a stop: nothing drives the only train that is free.
    pub fn stops(&self) -> bool {
        twice_resistance(&self.system).is_some()
    }

    /// What its coordinates are.
    pub fn motion(&self) -> Motion {
        self.words.motion()
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
