//! The two forms of a case: the short one of the brake, `[torsion]`, and that of trains, `[rotor]` and `[stator]`.

use super::document::Node;

/// The commands that take a case of trains.
pub const COMMANDS_OF_TRAINS: &[&str] = &[
    "run",
    "certify",
    "modes",
    "compare",
    "work-precision",
    "plot",
    "case",
    "inspect",
    "check",
];

/// The first table of trains in a tree.
pub(super) fn table_of(root: &Node) -> Option<&'static str> {
    ["rotor", "stator"].into_iter().find(|train| root.at(train).is_some())
}

/// Why a case of trains is refused where only the short form is understood.
pub(super) fn not_here() -> String {
    format!(
        "a case of trains, [rotor] and [stator]: what was asked for works on the short form [torsion] only; trains are taken by \
         stickslip {}",
        COMMANDS_OF_TRAINS.join(", ")
    )
}
