//! The TOML case file: units, validation, overrides.
//!
//! A [`CaseSource`] is text and where it is from; [`Case::read`] turns it, with overrides, into a valid [`Case`]
//! in SI or into a [`CaseError`] that names every problem by file, line and key. The keys are those of
//! [`schema::keys`] and [`train_keys`], the units those of [`quantity::UNITS`], the built-in cases [`builtin::CASES`].
//!
//! A file has the short form, `[torsion]`, or the general one, `[rotor]` and `[stator]`. Only this module knows which: a case is
//! a system, and the words for its places.
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
mod conditions;
pub(crate) mod document;
mod draft;
mod error;
mod exact;
mod motion;
mod numbers;
mod reader;
mod resolved;
mod setting;
mod short_form;
mod source;
mod trains;
mod value;
mod words;
mod written;

pub(crate) use case_keys::CaseKeys;
pub use document::Override;
pub use error::{CaseError, Problem};
pub use exact::ExactCase;
pub use motion::Motion;
pub use numbers::CaseNumber;
pub use setting::Setting;
pub(crate) use setting::{Slot, key_of};
pub use source::{CaseSource, Origin};
pub(crate) use source::{toml_text, words};
pub use trains::train_keys;
pub use words::Words;
pub use written::WrittenCase;

use draft::Draft;

use crate::model::margin::twice_resistance;
use crate::model::system::System;
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
    words: Words,
    /// Sliding speed (rad/s) below which statistics count a stick, of a contact that has none.
    threshold: f64,
}

impl Case {
    /// Reads a case and applies the overrides, in their order.
    ///
    /// # Errors
    /// All problems that were found, each with its place, its key and what to do.
    pub fn read(source: &CaseSource, overrides: &[Override]) -> Result<Case, CaseError> {
        read(source, overrides).map(|read| read.case)
    }

    /// The system without rounding: decimals as written, units by their exact factors. A plain number is the shortest decimal of
    /// its double, which is what was written if that has at most 15 digits. A default that follows from other numbers follows from
    /// their exact values. The speed of an inertia that turns with an end driven by a sine or cosine is known to 2^-2400 of the
    /// amplitude, since it is no rational.
    ///
    /// # Errors
    /// As those of [`Case::read`].
    pub fn exact(source: &CaseSource, overrides: &[Override]) -> Result<ExactCase, CaseError> {
        exact::read(&read(source, overrides)?)
    }

    /// The case as a TOML text in which every value is a number in SI, written so that it reads back as the identical case.
    /// Diameters of the contact have become the radius.
    pub fn resolved(&self) -> String {
        match Draft::short(self) {
            Some(draft) => resolved::write(&draft),
            // A system that the short form cannot say, or one that is written in the general form.
            None => trains::resolved::write(self),
        }
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

    /// How the places of its system are called.
    pub fn words(&self) -> Words {
        self.words
    }

    /// The sliding speed (rad/s) below which a contact without stick counts as stuck; 0 of others.
    pub fn threshold(&self) -> f64 {
        self.threshold
    }

    /// The system.
    pub fn system(&self) -> &System {
        &self.system
    }

    /// A text for reports and figures.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// How it is computed.
    pub fn solver(&self) -> &SolverOptions {
        &self.solver
    }

    /// Which times are computed and recorded.
    pub fn output(&self) -> &OutputOptions {
        &self.output
    }
}

/// Reads a case in whichever form it has, with the tree of its values.
fn read(source: &CaseSource, overrides: &[Override]) -> Result<reader::Read, CaseError> {
    let mut root = document::read(&source.text, &source.label())?;
    let mut problems = Vec::new();
    for change in overrides {
        if let Err(problem) = document::apply(&mut root, change) {
            problems.push((usize::MAX, problem));
        }
    }
    match words::is_general(&root) {
        true => trains::read(source, root, problems),
        false => short_form::read(source, root, problems),
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
