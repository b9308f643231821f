//! The keys that a case has.

use super::document::{self, Node};
use super::setting::Slot;
use super::{Case, CaseSource, Motion, Override, Words, key_of, schema, suggest, trains};
use crate::quote::shown;

/// The keys that the cases of a study have: those of the form of its base case, and in its lists and signals.
#[derive(Debug)]
pub(crate) struct CaseKeys {
    /// Of the base case.
    pub(crate) words: Words,
    /// Of the general form, the resolved case: what its lists and signals are. None of one that cannot be read.
    resolved: Option<Node>,
}

impl CaseKeys {
    /// Of the short form.
    pub(crate) const SHORT: CaseKeys = CaseKeys {
        words: Words::SHORT,
        resolved: None,
    };

    /// Of a base case with what a study sets in it. The base case alone decides which form it is.
    pub(crate) fn of(base: &CaseSource, settings: &[Override]) -> CaseKeys {
        if Words::of(base, &[]).short {
            return CaseKeys::SHORT;
        }
        let case = Case::read(base, settings).ok();
        let words = case.as_ref().map(|case| case.words);
        CaseKeys {
            words: words.unwrap_or_else(|| Words::of(base, settings)),
            resolved: case.and_then(|case| document::read(&case.resolved(), "").ok()),
        }
    }

    /// What the path takes; `None` if no case of this form has such a key.
    pub(crate) fn slot(&self, path: &str) -> Option<Slot> {
        match self.words.short {
            true => key_of(path).map(Slot::of_key),
            false => trains::slot(path, self.words.motion()),
        }
    }

    /// Why this case has no value at a path that cases of its form may have: an element beyond a list, a list without an
    /// index, a part that its signal has not.
    pub(crate) fn misplaced(&self, path: &str) -> Option<String> {
        if !self.words.short && path == "motion" {
            return Some("what is kept of the runs has one unit: make one study for each motion".to_owned());
        }
        trains::misplaced(self.resolved.as_ref()?, path)
    }

    /// The paths of all keys, with `[]` for indices.
    pub(crate) fn known(&self) -> Vec<&'static str> {
        match self.words.short {
            true => schema::keys().iter().map(|key| key.path).collect(),
            false => trains::keys::known(),
        }
    }

    /// The known path that an unknown one most likely means, as it is written.
    pub(crate) fn suggestion(&self, path: &str) -> Option<String> {
        if !self.words.short
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
        !self.words.short && trains::is_signal(path)
    }

    /// What to say about a path that is no key of a case.
    pub(crate) fn unknown(&self, path: &str) -> String {
        let quoted = shown(path);
        let first = path.split('.').next().unwrap_or(path);
        match self.words.short {
            true if trains::slot(path, Motion::Rotation).is_some() => format!(
                "\"{quoted}\" is a key of a case of trains, [rotor] and [stator], but the base case is of the short form, \
                 [torsion]; its keys are dotted paths, such as friction.decay, torsion.damping or \
                 perturbation.0.relative_velocity"
            ),
            false if key_of(path).is_some() && first == "torsion" => {
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
            _ => match (self.suggestion(path), self.words.short) {
                (Some(close), _) => format!("a case has no key \"{quoted}\"; did you mean {close}?"),
                (None, true) => format!(
                    "a case has no key \"{quoted}\"; its keys are dotted paths, such as friction.decay, torsion.damping or \
                     perturbation.0.relative_velocity"
                ),
                (None, false) => format!(
                    "a case of trains has no key \"{quoted}\"; its keys are dotted paths, such as stator.damping.0, rotor.speed, \
                     rotor.speed.amplitude of a harmonic, contact.normal_force, friction.breakaway or initial.stator_twist.0"
                ),
            },
        }
    }
}
