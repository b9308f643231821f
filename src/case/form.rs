//! The two forms of a case: the short one of the brake, `[torsion]`, and that of trains, `[rotor]` and `[stator]`.

use super::Motion;
use super::document::Node;

/// Which form a case has, and with it which keys there are and what a run comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// A brake: `[torsion]`.
    Brake,
    /// Two trains, and what their coordinates are.
    Trains(Motion),
}

impl Form {
    /// What the coordinates are.
    pub fn motion(self) -> Motion {
        match self {
            Form::Brake => Motion::Rotation,
            Form::Trains(motion) => motion,
        }
    }
}

/// The first table of trains in a tree.
pub(super) fn table_of(root: &Node) -> Option<&'static str> {
    ["rotor", "stator"].into_iter().find(|train| root.at(train).is_some())
}

/// Why a case of trains is refused where only the short form is understood.
pub(super) fn not_here() -> &'static str {
    "a case of trains, [rotor] and [stator]: what was asked for works on the short form [torsion] only"
}
