//! A case of either form, and the keys that one has.

use super::document::{self, Node};
use super::setting::Slot;
use super::trains;
use super::{Case, CaseError, CaseSource, Form, Motion, Override, TrainCase, key_of, schema, suggest};
use crate::model::trains::margin::twice_resistance;
use crate::model::trains::{ExactTrains, Trains};
use crate::quote::shown;
use crate::simulation::{Following, OutputOptions, SolverOptions};
use num_rational::BigRational;
use std::borrow::Cow;

/// A case of either form.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyCase {
    /// A brake.
    Brake(Box<Case>),
    /// Two trains.
    Trains(Box<TrainCase>),
}

impl AnyCase {
    /// Reads a case of this form and applies the overrides, in their order.
    ///
    /// # Errors
    /// All problems that were found, each with its place, its key and what to do.
    pub fn parse(form: Form, source: &CaseSource, overrides: &[Override]) -> Result<AnyCase, CaseError> {
        match form {
            Form::Brake => Case::parse(source, overrides).map(|case| AnyCase::Brake(Box::new(case))),
            Form::Trains(_) => TrainCase::parse(source, overrides).map(|case| AnyCase::Trains(Box::new(case))),
        }
    }

    /// Reads a case of whichever form it has, as [`Self::parse`] does.
    ///
    /// # Errors
    /// All problems that were found.
    pub fn read(source: &CaseSource, overrides: &[Override]) -> Result<AnyCase, CaseError> {
        if TrainCase::is_one(source, overrides) {
            TrainCase::parse(source, overrides).map(|case| AnyCase::Trains(Box::new(case)))
        } else {
            Case::parse(source, overrides).map(|case| AnyCase::Brake(Box::new(case)))
        }
    }

    /// The numbers of a case without rounding.
    ///
    /// # Errors
    /// All problems that were found.
    pub fn exact(source: &CaseSource, overrides: &[Override]) -> Result<ExactCase, CaseError> {
        if TrainCase::is_one(source, overrides) {
            Ok(ExactCase {
                system: TrainCase::exact_parameters(source, overrides)?,
                threshold: TrainCase::exact_threshold(source, overrides)?,
            })
        } else {
            Ok(ExactCase {
                system: ExactTrains::from(&Case::exact_parameters(source, overrides)?),
                threshold: None,
            })
        }
    }

    /// The brake, if it is one.
    pub fn into_brake(self) -> Option<Case> {
        match self {
            AnyCase::Brake(case) => Some(*case),
            AnyCase::Trains(_) => None,
        }
    }

    /// How it is computed.
    pub fn solver(&self) -> &SolverOptions {
        CaseRef::from(self).solver()
    }

    pub(crate) fn options_mut(&mut self) -> (&mut SolverOptions, &mut OutputOptions) {
        match self {
            AnyCase::Brake(case) => (&mut case.solver, &mut case.output),
            AnyCase::Trains(case) => (&mut case.solver, &mut case.output),
        }
    }

    /// Leaves out what only tells which samples a run has: it then has none but those at its ends and its events.
    pub fn without_trajectory(&mut self) {
        let (_, output) = self.options_mut();
        output.interval = output.end_time;
        output.windows.clear();
        output.steps = false;
        output.follow = Following::default();
    }

    /// The case as a TOML text in SI, which reads back as the identical case.
    pub fn resolved(&self) -> String {
        CaseRef::from(self).resolved()
    }
}

/// What a case describes, without rounding: decimals as they are written, units by their exact factors.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactCase {
    /// The system.
    pub system: ExactTrains,
    /// The sliding speed (rad/s) below which a contact without stick counts as stuck; `None` of others.
    pub threshold: Option<BigRational>,
}

/// A case of either form, lent.
#[derive(Debug, Clone, Copy)]
pub enum CaseRef<'a> {
    /// A brake.
    Brake(&'a Case),
    /// Two trains.
    Trains(&'a TrainCase),
}

impl<'a> From<&'a Case> for CaseRef<'a> {
    fn from(case: &'a Case) -> Self {
        CaseRef::Brake(case)
    }
}

impl<'a> From<&'a TrainCase> for CaseRef<'a> {
    fn from(case: &'a TrainCase) -> Self {
        CaseRef::Trains(case)
    }
}

impl<'a> From<&'a AnyCase> for CaseRef<'a> {
    fn from(case: &'a AnyCase) -> Self {
        match case {
            AnyCase::Brake(case) => CaseRef::Brake(case),
            AnyCase::Trains(case) => CaseRef::Trains(case),
        }
    }
}

impl From<CaseRef<'_>> for AnyCase {
    fn from(case: CaseRef) -> Self {
        match case {
            CaseRef::Brake(case) => AnyCase::Brake(Box::new(case.clone())),
            CaseRef::Trains(case) => AnyCase::Trains(Box::new(case.clone())),
        }
    }
}

impl<'a> CaseRef<'a> {
    /// How it was written.
    pub fn form(self) -> Form {
        match self {
            CaseRef::Brake(_) => Form::Brake,
            CaseRef::Trains(case) => Form::Trains(case.motion),
        }
    }

    /// What its coordinates are.
    pub fn motion(self) -> Motion {
        self.form().motion()
    }

    /// The system that the file describes.
    pub fn system(self) -> Cow<'a, Trains> {
        match self {
            CaseRef::Brake(case) => Cow::Owned(Trains::from(&case.parameters)),
            CaseRef::Trains(case) => Cow::Borrowed(&case.parameters),
        }
    }

    /// Whether sliding slows down by itself, to a stop: nothing drives the only train that is free.
    pub fn stops(self) -> bool {
        twice_resistance(&self.system()).is_some()
    }

    /// The sliding speed (rad/s) below which a contact without stick counts as stuck; 0 of others.
    pub fn threshold(self) -> f64 {
        match self {
            CaseRef::Brake(_) => 0.0,
            CaseRef::Trains(case) => case.threshold.unwrap_or(0.0),
        }
    }

    /// A text for reports and figures.
    pub fn title(self) -> &'a str {
        match self {
            CaseRef::Brake(case) => &case.title,
            CaseRef::Trains(case) => &case.title,
        }
    }

    /// How it is computed.
    pub fn solver(self) -> &'a SolverOptions {
        match self {
            CaseRef::Brake(case) => &case.solver,
            CaseRef::Trains(case) => &case.solver,
        }
    }

    /// Which times are computed and recorded.
    pub fn output(self) -> &'a OutputOptions {
        match self {
            CaseRef::Brake(case) => &case.output,
            CaseRef::Trains(case) => &case.output,
        }
    }

    /// The case as a TOML text in SI, which reads back as the identical case.
    pub fn resolved(self) -> String {
        match self {
            CaseRef::Brake(case) => case.resolved(),
            CaseRef::Trains(case) => case.resolved(),
        }
    }
}

/// The keys that the cases of a study have: those of the form of its base case, and in its lists and signals.
#[derive(Debug)]
pub(crate) struct CaseKeys {
    /// Of the base case.
    pub(crate) form: Form,
    /// Of trains, the resolved case: what its lists and signals are. None of one that cannot be read.
    resolved: Option<Node>,
}

impl CaseKeys {
    /// Of a brake.
    pub(crate) const OF_BRAKES: CaseKeys = CaseKeys {
        form: Form::Brake,
        resolved: None,
    };

    /// Of a base case with what a study sets in it. The base case alone decides which form it is.
    pub(crate) fn of(base: &CaseSource, settings: &[Override]) -> CaseKeys {
        if !TrainCase::is_one(base, &[]) {
            return CaseKeys::OF_BRAKES;
        }
        let case = TrainCase::parse(base, settings).ok();
        let motion = case.as_ref().map(|case| case.motion);
        CaseKeys {
            form: Form::Trains(motion.unwrap_or_else(|| trains::motion_of(base, settings))),
            resolved: case.and_then(|case| document::read(&case.resolved(), "").ok()),
        }
    }

    /// What the path takes; `None` if no case of this form has such a key.
    pub(crate) fn slot(&self, path: &str) -> Option<Slot> {
        match self.form {
            Form::Brake => key_of(path).map(Slot::of_key),
            Form::Trains(motion) => trains::slot(path, motion),
        }
    }

    /// Why this case has no value at a path that cases of its form may have: an element beyond a list, a list without an
    /// index, a part that its signal has not.
    pub(crate) fn misplaced(&self, path: &str) -> Option<String> {
        match self.form {
            Form::Trains(_) if path == "motion" => {
                Some("what is kept of the runs has one unit: make one study for each motion".to_owned())
            }
            _ => trains::misplaced(self.resolved.as_ref()?, path),
        }
    }

    /// The paths of all keys, with `[]` for indices.
    pub(crate) fn known(&self) -> Vec<&'static str> {
        match self.form {
            Form::Brake => schema::keys().iter().map(|key| key.path).collect(),
            Form::Trains(_) => trains::known_keys(),
        }
    }

    /// The known path that an unknown one most likely means, as it is written.
    pub(crate) fn suggestion(&self, path: &str) -> Option<String> {
        if let Form::Trains(_) = self.form
            && let Some(close) = trains::close_in_signal(path)
        {
            return Some(close);
        }
        let close = suggest(path, self.known().into_iter())?;
        let last = path.rsplit('.').next().unwrap_or_default();
        Some(match last.parse::<usize>() {
            Ok(index) if trains::keys::is_list(close) => format!("{close}.{index}"),
            _ => close.replace("[]", ".0"),
        })
    }

    /// Whether a value at this path takes the place of all that the case has there: a signal.
    pub(crate) fn is_whole(&self, path: &str) -> bool {
        matches!(self.form, Form::Trains(_)) && trains::is_signal(path)
    }

    /// What to say about a path that is no key of a case.
    pub(crate) fn unknown(&self, path: &str) -> String {
        let quoted = shown(path);
        let first = path.split('.').next().unwrap_or(path);
        match self.form {
            Form::Brake if trains::slot(path, super::Motion::Rotation).is_some() => format!(
                "\"{quoted}\" is a key of a case of trains, [rotor] and [stator], but the base case is of the short form, \
                 [torsion]; its keys are dotted paths, such as friction.decay, torsion.damping or \
                 perturbation.0.relative_velocity"
            ),
            Form::Trains(_) if key_of(path).is_some() && first == "torsion" => {
                let name = path.strip_prefix("torsion.").unwrap_or(path);
                let close = match name {
                    "rotor_inertia" => "rotor.inertia.1",
                    "surface_inertia" => "rotor.inertia.0 and stator.inertia.0",
                    "stiffness" => "rotor.stiffness.0 and stator.stiffness.0",
                    _ => "rotor.damping.0 and stator.damping.0",
                };
                format!(
                    "\"{quoted}\" is a key of the short form, and the base case has [rotor] and [stator] instead; write {close}"
                )
            }
            _ => match (self.suggestion(path), self.form) {
                (Some(close), _) => format!("a case has no key \"{quoted}\"; did you mean {close}?"),
                (None, Form::Brake) => format!(
                    "a case has no key \"{quoted}\"; its keys are dotted paths, such as friction.decay, torsion.damping or \
                     perturbation.0.relative_velocity"
                ),
                (None, Form::Trains(_)) => format!(
                    "a case of trains has no key \"{quoted}\"; its keys are dotted paths, such as stator.damping.0, rotor.speed, \
                     rotor.speed.amplitude of a harmonic, contact.normal_force, friction.breakaway or initial.stator_twist.0"
                ),
            },
        }
    }
}
