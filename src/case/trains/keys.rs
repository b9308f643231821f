//! The keys that only a case of trains has, and those of the brake's schema that it shares.

use crate::case::Motion;
use crate::case::quantity::Dimension;
use crate::case::schema::{self, Domain};
use crate::friction::FrictionLaw;

/// One key of a case of trains.
#[derive(Debug)]
pub struct TrainKey {
    /// Dotted path; `[]` marks the elements of an array of tables.
    pub path: &'static str,
    /// One line, beginning with the symbol where there is one.
    pub description: &'static str,
    /// What it takes.
    pub kind: TrainKind,
    /// What happens if it is left out, in words; `None` if it is required.
    pub default: Option<&'static str>,
}

/// What a key of trains takes. Dimensions are those of rotation; [`Motion::dimension`] has those of translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TrainKind {
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A list of numbers, or one number for a list of one.
    List(Dimension),
    /// A number.
    Number(Dimension),
    /// A signal.
    Signal(Dimension),
    /// The place of an inertia, from 0 at the surface.
    Index,
}

const fn key(
    path: &'static str,
    description: &'static str,
    kind: TrainKind,
    default: Option<&'static str>,
) -> TrainKey {
    TrainKey {
        path,
        description,
        kind,
        default,
    }
}

use Dimension as D;
use TrainKind::{Choice, Index, List, Number, Signal};

/// The words of `end`.
pub(super) const ENDS: &[&str] = &["free", "fixed", "driven"];
/// The word of `friction.law` for bristles.
pub(super) const LUGRE: &str = "lugre";
/// The words of `friction.regularisation.function`.
pub(super) const SMOOTHINGS: &[&str] = &["tanh", "arctan"];
/// The words of `perturbation[].on`.
pub(super) const SIDES: &[&str] = &["both", "rotor", "stator"];
/// The profiles of a signal.
pub(super) const PROFILES: &[&str] = &["ramp", "table", "sine", "cosine", "sum"];
/// The keys of `[friction]` with bristles, and which of them are required.
pub(super) const OF_BRISTLES: &[(&str, bool)] = &[
    ("law", true),
    ("low_speed", true),
    ("high_speed", true),
    ("scale", true),
    ("exponent", false),
    ("bristle_stiffness", true),
    ("bristle_damping", false),
    ("viscous", false),
    ("breakaway", false),
    ("threshold", false),
];

/// Every key that only trains have.
pub(in crate::case) const KEYS: &[TrainKey] = &[
    key(
        "motion",
        "what the coordinates are: angles or positions",
        Choice(&["rotation", "translation"]),
        Some("\"rotation\""),
    ),
    key(
        "rotor.inertia",
        "moments of inertia from the contact outwards, the surface first; none if the surface is itself the far end",
        List(D::Inertia),
        Some("[]"),
    ),
    key(
        "rotor.stiffness",
        "stiffness of the shafts between the inertias, and of one more to an end that is fixed or driven",
        List(D::TorsionalStiffness),
        Some("[] where there is no shaft"),
    ),
    key(
        "rotor.damping",
        "damping of the same shafts",
        List(D::TorsionalDamping),
        Some("0"),
    ),
    key(
        "rotor.viscous",
        "damping of each inertia to the ground",
        List(D::TorsionalDamping),
        Some("0"),
    ),
    key("rotor.end", "what holds the far end", Choice(ENDS), None),
    key(
        "rotor.speed",
        "speed of a driven end",
        Signal(D::AngularVelocity),
        Some("none: required of a driven end"),
    ),
    key("rotor.torque", "external torque", Signal(D::Torque), Some("none")),
    key(
        "rotor.torque_on",
        "which inertia the torque acts on; 0 is the surface",
        Index,
        Some("the outermost"),
    ),
    key("stator.inertia", "as of the rotor", List(D::Inertia), Some("[]")),
    key(
        "stator.stiffness",
        "as of the rotor",
        List(D::TorsionalStiffness),
        Some("[] where there is no shaft"),
    ),
    key(
        "stator.damping",
        "as of the rotor",
        List(D::TorsionalDamping),
        Some("0"),
    ),
    key(
        "stator.viscous",
        "as of the rotor",
        List(D::TorsionalDamping),
        Some("0"),
    ),
    key("stator.end", "what holds the far end", Choice(ENDS), None),
    key(
        "stator.speed",
        "speed of a driven end",
        Signal(D::AngularVelocity),
        Some("none: required of a driven end"),
    ),
    key("stator.torque", "external torque", Signal(D::Torque), Some("none")),
    key(
        "stator.torque_on",
        "which inertia the torque acts on; 0 is the surface",
        Index,
        Some("the outermost"),
    ),
    key(
        "contact.normal_force",
        "F_n, where no [axial] and [actuation] give it",
        Signal(D::Force),
        Some("none: [axial] and [actuation]"),
    ),
    key(
        "friction.regularisation.function",
        "smooth function of omega_r over eps in the place of its sign: no stick",
        Choice(SMOOTHINGS),
        Some("none: stick and slip"),
    ),
    key(
        "friction.regularisation.speed",
        "eps, speed of the smooth function",
        Number(D::AngularVelocity),
        Some("none: required of a regularisation"),
    ),
    key(
        "friction.bristle_stiffness",
        "sigma_0, stiffness of bristles over the normal force",
        Number(D::InverseAngle),
        Some("none: required with law \"lugre\""),
    ),
    key(
        "friction.bristle_damping",
        "sigma_1, damping of bristles over the normal force",
        Number(D::FrictionDecay),
        Some("0"),
    ),
    key(
        "friction.threshold",
        "|omega_r| below which statistics count a stick, of a contact without one",
        Number(D::AngularVelocity),
        Some("10 regularisation.speed, or scale / 10 with law \"lugre\""),
    ),
    key(
        "initial.rotor_twist",
        "twist of each shaft of the rotor, outer less inner angle",
        List(D::Angle),
        Some("0"),
    ),
    key(
        "initial.rotor_speed",
        "speed of each inertia of the rotor",
        List(D::AngularVelocity),
        Some("0, or that of a driven end"),
    ),
    key(
        "initial.stator_twist",
        "twist of each shaft of the stator, inner less outer angle",
        List(D::Angle),
        Some("0"),
    ),
    key(
        "initial.stator_speed",
        "speed of each inertia of the stator",
        List(D::AngularVelocity),
        Some("0, or that of a driven end"),
    ),
    key(
        "perturbation[].on",
        "which surface takes the kick; both share it so that momentum is kept",
        Choice(SIDES),
        Some("\"both\""),
    ),
];

/// Whether a key of the brake's schema is one of trains as well.
pub(super) fn is_shared(path: &str) -> bool {
    !path.starts_with("torsion.")
}

/// The paths of all keys of a case of trains.
pub(in crate::case) fn known() -> Vec<&'static str> {
    let shared = schema::keys().iter().map(|key| key.path).filter(|path| is_shared(path));
    let own = KEYS.iter().map(|key| key.path);
    // A table's keys together, in the order in which a case is written: what messages list.
    let mut all: Vec<&str> = own.chain(shared).collect();
    let mut tables: Vec<&str> = Vec::new();
    for path in &all {
        let table = path.split(['.', '[']).next().unwrap_or(path);
        if !tables.contains(&table) {
            tables.push(table);
        }
    }
    all.sort_by_key(|path| {
        let table = path.split(['.', '[']).next().unwrap_or(path);
        tables.iter().position(|&other| other == table)
    });
    all
}

/// The key at a path of `KEYS`.
pub(in crate::case) fn find(path: &str) -> &'static TrainKey {
    KEYS.iter()
        .find(|key| key.path == path)
        .unwrap_or_else(|| unreachable!("{path} is a key of trains"))
}

/// Whether the key at a path takes a list, of which a case may give one element.
pub(in crate::case) fn is_list(path: &str) -> bool {
    KEYS.iter().any(|key| key.path == path && matches!(key.kind, List(_)))
}

/// Which elements a list has, for messages.
pub(in crate::case) fn elements(list: &str, count: usize) -> String {
    match count {
        0 => "in this case the list is empty".to_owned(),
        1 => format!("its one element is {list}.0"),
        2 => format!("its elements are {list}.0 and {list}.1"),
        _ => format!("its elements are {list}.0 to {list}.{}", count - 1),
    }
}

/// The limits of the numbers of a key of `KEYS`, but for those of a signal.
pub(super) fn domain_of(path: &str) -> Domain {
    match path.rsplit('.').next().unwrap_or(path) {
        "inertia" | "stiffness" | "bristle_stiffness" | "threshold" => Domain::Positive,
        "damping" | "viscous" | "bristle_damping" => Domain::NotNegative,
        "speed" if path.starts_with("friction.") => Domain::Positive,
        _ => Domain::Any,
    }
}

/// The words of `friction.law`.
pub(super) fn laws() -> Vec<&'static str> {
    FrictionLaw::NAMES.iter().copied().chain([LUGRE]).collect()
}

/// How a number is written, as the end of a message.
pub(super) fn written(name: &str, kind: TrainKind, motion: Motion) -> String {
    let of = |dimension: Dimension| motion.dimension(dimension);
    match kind {
        Choice(words) => format!("; write {name} = \"{}\"", words.join("\" or \"")),
        List(dimension) => format!("; write {name} = [...], numbers in {}", of(dimension).unit()),
        Number(dimension) | Signal(dimension) => format!(
            "; write {name} = a number in {} or \"{}\"",
            of(dimension).unit(),
            of(dimension).example()
        ),
        Index => String::new(),
    }
}
