//! Names and units for the places of a system, and the layout of its files.

use super::document::{self, PlacedValue};
use super::value::choice;
use super::{CaseError, CaseProblem, CaseSource, Motion, Override};

/// Names and units for the places of a system, and the layout of its files. They follow from the form of the case,
/// not from the equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Words {
    pub(super) short: bool,
    motion: Motion,
}

const THE_PAPER: &str = "Vibrational Interaction of Two Rotors with Friction Coupling, Advances in Acoustics and \
                         Vibration, 2016, article 9275147";

const OWN_DOCUMENTS: &str = "stickslip, docs/theory.md: Trains";

impl Words {
    pub(super) const SHORT: Words = Words {
        short: true,
        motion: Motion::Rotation,
    };

    pub(super) const fn general(motion: Motion) -> Words {
        Words { short: false, motion }
    }

    /// Names and units for a case, which may contain errors elsewhere.
    pub fn of(source: &CaseSource, overrides: &[Override]) -> Words {
        match form_of(source, overrides) {
            Ok((root, false, _)) => Words::general(named_motion(&root).ok().flatten().unwrap_or_default()),
            _ => Words::SHORT,
        }
    }

    /// Kind of coordinates: angles or positions.
    pub fn motion(self) -> Motion {
        self.motion
    }

    /// Whether places have the paper's letters: phi1, phi2, theta. Otherwise the bodies of the chains are numbered.
    pub fn has_letters(self) -> bool {
        self.short
    }

    /// Whether files list the growth of perturbations up to the first stick, instead of the motion's cycle.
    pub fn lists_growth(self) -> bool {
        self.short
    }

    /// Whether rows have a column for every body of the chains, in addition to the common columns.
    pub fn numbers_parts(self) -> bool {
        !self.short
    }

    /// Root attribute `references` of files.
    pub fn references(self) -> &'static str {
        match self.short {
            true => THE_PAPER,
            false => OWN_DOCUMENTS,
        }
    }

    /// The motion as an attribute of /meta; `None` for files without this attribute.
    pub fn motion_attribute(self) -> Option<&'static str> {
        (!self.short).then(|| self.motion.name())
    }
}

/// The tree of a case with its overrides, whether the case has the short form, and the problems of the overrides. An
/// override cannot change the form if the file alone determines it.
///
/// # Errors
/// The text is not TOML.
pub(super) fn form_of(
    source: &CaseSource,
    overrides: &[Override],
) -> Result<(PlacedValue, bool, Vec<CaseProblem>), CaseError> {
    let is_short = |root: &PlacedValue| match ["rotor", "stator"].iter().any(|chain| root.at(chain).is_some()) {
        true => Some(false),
        false => root.at("torsion").map(|_| true),
    };
    let mut root = document::read(&source.text, &source.label())?;
    let said = is_short(&root);
    let wrong = overrides
        .iter()
        .filter_map(|change| document::apply(&mut root, change).err());
    let wrong = wrong.collect();
    let short = said.or_else(|| is_short(&root)).unwrap_or(true);
    Ok((root, short, wrong))
}

/// The motion that a tree names; `None` if it names none.
///
/// # Errors
/// The value is not a motion.
pub(super) fn named_motion(root: &PlacedValue) -> Result<Option<Motion>, String> {
    let Some(node) = root.at("motion") else {
        return Ok(None);
    };
    let name = choice(&node.value, &Motion::ALL.map(Motion::name))?;
    Ok(Motion::ALL.into_iter().find(|motion| motion.name() == name))
}
