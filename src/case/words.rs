//! How the places of a system are called where people see them.

use super::document::{self, Node};
use super::value::choice;
use super::{CaseSource, Motion, Override};

/// The names and units of the places of a system, and the layout of its files. Both follow from how the case is written; the
/// equations do not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Words {
    /// Whether the case is in the short form, `[torsion]`.
    pub(super) short: bool,
    motion: Motion,
}

/// Root attribute `references` of files about two disks.
const THE_PAPER: &str = "Vibrational Interaction of Two Rotors with Friction Coupling, Advances in Acoustics and \
                         Vibration, 2016, article 9275147";

/// The same of systems whose equations this program's own documents give.
const OWN_DOCUMENTS: &str = "stickslip, docs/model.md: Trains";

impl Words {
    pub(super) const SHORT: Words = Words {
        short: true,
        motion: Motion::Rotation,
    };

    pub(super) const fn general(motion: Motion) -> Words {
        Words { short: false, motion }
    }

    /// Of a case that may be wrong in other respects.
    pub fn of(source: &CaseSource, overrides: &[Override]) -> Words {
        let Ok(mut root) = document::read(&source.text, &source.label()) else {
            return Words::SHORT;
        };
        for change in overrides {
            // What does not fit is reported by whoever reads the case.
            let _ = document::apply(&mut root, change);
        }
        match is_general(&root) {
            true => Words::general(named_motion(&root).ok().flatten().unwrap_or_default()),
            false => Words::SHORT,
        }
    }

    /// What the coordinates are.
    pub fn motion(self) -> Motion {
        self.motion
    }

    /// Whether places have the letters of the paper: phi1, phi2, theta. Else the parts of the chains are numbered.
    pub fn has_letters(self) -> bool {
        self.short
    }

    /// Whether files list how perturbations grow up to the first stick. Else they list what the motion repeats.
    pub fn lists_growth(self) -> bool {
        self.short
    }

    /// Whether rows have a column for every part of the chains, beside the columns that all files have.
    pub fn numbers_parts(self) -> bool {
        !self.short
    }

    /// Whether files say which tolerances each phase was solved with.
    pub(crate) fn lists_tolerances(self) -> bool {
        self.short
    }

    /// Root attribute `references` of files.
    pub(crate) fn references(self) -> &'static str {
        match self.short {
            true => THE_PAPER,
            false => OWN_DOCUMENTS,
        }
    }

    /// The motion as an attribute of /meta; `None` of files that do not have it.
    pub(crate) fn motion_attribute(self) -> Option<&'static str> {
        (!self.short).then(|| self.motion.name())
    }
}

/// Whether a tree has a table of the general form.
pub(super) fn is_general(root: &Node) -> bool {
    ["rotor", "stator"].iter().any(|chain| root.at(chain).is_some())
}

/// The motion that a tree names; `None` if it names none.
///
/// # Errors
/// The value is no motion.
pub(super) fn named_motion(root: &Node) -> Result<Option<Motion>, String> {
    let Some(node) = root.at("motion") else {
        return Ok(None);
    };
    let name = choice(&node.value, &Motion::ALL.map(Motion::name))?;
    Ok(Motion::ALL.into_iter().find(|motion| motion.name() == name))
}
