//! What does the text say? A case file is TOML with units. The crate reads it into a system, and into names and units
//! for the system's places.
//!
//! A [`CaseSource`] is a text with its origin. [`Case::read`] applies overrides to it, and returns a valid [`Case`]
//! in SI or a [`CaseError`] that names every problem by file, line and key. A file has the short form, `[torsion]`,
//! or the general form, `[rotor]` and `[stator]`. Both describe the same system, and only this crate distinguishes
//! them.
//!
//! | file | question |
//! |---|---|
//! | `source`, `builtin` | Where is the text from? |
//! | `document` | What is the text? A tree of values with their lines, overrides applied to it, and problems with their places |
//! | `changes` | What distinguishes one case from another? Differences of two texts, and overrides, in words with units |
//! | `schema` | Which keys are there? One row for each: path, form, default, kind, places in a case, description |
//! | `place` | What is the value at a place of a case, and how is it set and written? The case as text in SI |
//! | `quantity` | What does a number measure, and in which unit? |
//! | `value` | What does one value mean: a number, a word, a list, a signal? |
//! | `reader` | What does the tree mean? Reads every key by its row, and collects all problems |
//! | `chains` | What do keys mean that depend on each other: bodies of a chain, radius, normal force, law? |
//! | `conditions` | Are the values consistent? |
//! | `written` | Which parameters has a case, with how many digits, and what is the case with another value? |
//! | `exact` | What is the system without rounding? |
//! | `case_keys` | What may vary in a study? |
//! | `words` | What are the names and units of the places of the system? |
//!
//! ```
//! use stickslip_case::{Case, CaseSource, Override};
//!
//! let source = CaseSource::built_in("paper")?;
//! let case = Case::read(&source, &[Override::parse("torsion.damping=200 lbf in s/rad")?])?;
//! assert_eq!(case.number("torsion.damping")?, 22.59696580552334);
//! # Ok::<(), stickslip_case::CaseError>(())
//! ```
//!
//! `stickslip_engine::Run` runs a [`Case`]. This crate runs nothing, and reads neither study files
//! (`stickslip-analysis` does) nor results.

pub mod builtin;
pub mod quantity;
pub mod schema;

mod case_keys;
mod chains;
mod changes;
mod conditions;
pub mod document;
mod exact;
pub mod input;
mod place;
mod reader;
mod source;
mod value;
pub mod words;
mod written;

pub use case_keys::{CaseKeys, Setting, Slot};
pub use changes::{OtherSetting, changed, changed_line, differences};
pub use document::{CaseError, CaseProblem, Override};
pub use exact::ExactCase;
pub use quantity::Motion;
pub use schema::{METHOD, key_of, train_keys};
pub use source::{CaseSource, Origin, toml_text, words};
pub use value::{PROFILES, SIGNAL_KEYS, SignalKey};
pub use words::Words;
pub use written::{CaseNumber, WrittenCase};

use stickslip_engine::Runnable;
use stickslip_engine::simulation::{Following, OutputOptions, SolverOptions};
use stickslip_system::friction::{Exponential, LawParameters as _};
use stickslip_system::model::margin::twice_resistance;
use stickslip_system::model::system::{ContactLaw, End, Initial, Pressing, System, Train};
use stickslip_system::model::{Axial, BreakawayTest, Parameters};
use stickslip_system::signal::{Drive, Profile as _, Ramp};

/// A case: system, solver and output. A case from [`Case::read`] is valid.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Title for reports and figures.
    pub title: String,
    /// The system, SI.
    pub system: System,
    /// Solver options.
    pub solver: SolverOptions,
    /// Times to compute and to record.
    pub output: OutputOptions,
    /// Names and units of the system's places.
    pub words: Words,
    /// Sliding speed (rad/s) below which a contact without stick counts as stuck; 0 with stick and slip.
    pub threshold: f64,
}

impl Case {
    /// Reads a case, after applying the overrides in order.
    ///
    /// # Errors
    /// All problems, each with its place, its key and a remedy.
    pub fn read(source: &CaseSource, overrides: &[Override]) -> Result<Case, CaseError> {
        reader::read(source, overrides).map(|read| read.case)
    }

    /// The system without rounding: decimals are exact as written, and units have exact factors. A plain number is
    /// the shortest decimal of its double, which equals the written number up to 15 digits. Defaults follow from
    /// exact values. Only the speed of an inertia that turns with an end driven by a sine or cosine is irrational.
    /// Its error is at most 2^-2400 of the amplitude.
    ///
    /// # Errors
    /// Errors of [`Case::read`].
    pub fn exact(source: &CaseSource, overrides: &[Override]) -> Result<ExactCase, CaseError> {
        exact::read(&reader::read(source, overrides)?)
    }

    /// The case as TOML with every number in SI. Reading it gives the identical case. The radius replaces the
    /// diameters of the contact.
    pub fn resolved(&self) -> String {
        place::resolved(self)
    }

    /// The number at a dotted path of the resolved text, like `torsion.damping` or `stator.speed.amplitude`, in the
    /// unit of its key.
    ///
    /// # Errors
    /// The path has no number: it is unknown, an index beyond its list, an option left to its default, or a word.
    pub fn number(&self, path: &str) -> Result<f64, CaseError> {
        let root = document::read(&self.resolved(), &self.title)?;
        match root.at(path).map(|node| &node.value) {
            Some(document::CaseValue::Float(number)) => Ok(*number),
            Some(document::CaseValue::Integer(number)) => Ok(*number as f64),
            _ => Err(CaseError::one("", path, "the case has no number of that path")),
        }
    }

    /// This case in the general form, with `[rotor]` and `[stator]`.
    #[must_use]
    pub fn in_general_form(&self) -> Case {
        Case {
            words: Words::general(self.motion()),
            ..self.clone()
        }
    }

    fn is_short(&self) -> bool {
        self.words.short && Parameters::of(&self.system).is_some()
    }

    /// A case with the defaults of the schema, and NaN for numbers without default. In the short form it has a free
    /// rotor (the surface and an inertia on one shaft), and a surface on a shaft to the ground.
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

    /// Removes all samples except those at start, end and events.
    pub fn without_trajectory(&mut self) {
        self.output.interval = self.output.end_time;
        self.output.windows.clear();
        self.output.steps = false;
        self.output.follow = Following::default();
    }

    /// Whether sliding slows down to a stop by itself, because nothing drives the only free train.
    pub fn stops(&self) -> bool {
        twice_resistance(&self.system).is_some()
    }

    /// Kind of coordinates: angles or positions.
    pub fn motion(&self) -> Motion {
        self.words.motion()
    }
}

/// The most similar known name, ignoring case; `None` if no name is close.
pub fn suggest<'a>(unknown: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // With a lower similarity, suggestions for misspelt keys are more often wrong than right.
    const CLOSE: f64 = 0.8;
    // A word of this length with one letter too many, too few, wrong, or in the wrong place is close, too.
    const SHORTEST: usize = 3;
    // No name is longer, and a comparison costs more for a longer text.
    const LONGEST: usize = 100;
    if unknown.len() > LONGEST {
        return None;
    }
    let unknown = unknown.to_lowercase();
    let similarity = |name: &str| {
        let slip = unknown.len() >= SHORTEST && strsim::osa_distance(&unknown, name) == 1;
        let similarity = strsim::jaro_winkler(&unknown, name);
        if slip { similarity.max(CLOSE) } else { similarity }
    };
    known
        .map(|name| (name, similarity(&name.to_lowercase())))
        .filter(|&(_, similarity)| similarity >= CLOSE)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(name, _)| name)
}

impl Runnable for Case {
    fn system(&self) -> &System {
        &self.system
    }

    fn threshold(&self) -> f64 {
        self.threshold
    }

    fn numbers_parts(&self) -> bool {
        self.words.numbers_parts()
    }

    fn solver(&self) -> &SolverOptions {
        &self.solver
    }

    fn output(&self) -> &OutputOptions {
        &self.output
    }
}
