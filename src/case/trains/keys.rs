//! The keys that only the general form has, and those of the schema that it shares.

use crate::case::quantity::Dimension;
use crate::case::schema::{self, Domain, Key, Kind, Presence, key};
use crate::friction::FrictionLaw;

use Dimension as D;
use Domain::{Any, NotNegative, Positive};
use Kind::{Index, List, Plain, Signal, Word};
use Presence::{Default, Required};

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

/// Every key that only the general form has.
pub(in crate::case) const KEYS: &[Key] = &[
    key(
        "motion",
        "what the coordinates are: angles or positions",
        Default("\"rotation\""),
        Word(&["rotation", "translation"]),
    ),
    key(
        "rotor.inertia",
        "moments of inertia from the contact outwards, the surface first; none if the surface is itself the far end",
        Default("[]"),
        List(D::Inertia, Positive),
    ),
    key(
        "rotor.stiffness",
        "stiffness of the shafts between the inertias, and of one more to an end that is fixed or driven",
        Default("[] where there is no shaft"),
        List(D::TorsionalStiffness, Positive),
    ),
    key(
        "rotor.damping",
        "damping of the same shafts",
        Default("0"),
        List(D::TorsionalDamping, NotNegative),
    ),
    key(
        "rotor.viscous",
        "damping of each inertia to the ground",
        Default("0"),
        List(D::TorsionalDamping, NotNegative),
    ),
    key("rotor.end", "what holds the far end", Required, Word(ENDS)),
    key(
        "rotor.speed",
        "speed of a driven end",
        Default("none: required of a driven end"),
        Signal(D::AngularVelocity),
    ),
    key("rotor.torque", "external torque", Default("none"), Signal(D::Torque)),
    key(
        "rotor.torque_on",
        "which inertia the torque acts on; 0 is the surface",
        Default("the outermost"),
        Index,
    ),
    key(
        "stator.inertia",
        "as of the rotor",
        Default("[]"),
        List(D::Inertia, Positive),
    ),
    key(
        "stator.stiffness",
        "as of the rotor",
        Default("[] where there is no shaft"),
        List(D::TorsionalStiffness, Positive),
    ),
    key(
        "stator.damping",
        "as of the rotor",
        Default("0"),
        List(D::TorsionalDamping, NotNegative),
    ),
    key(
        "stator.viscous",
        "as of the rotor",
        Default("0"),
        List(D::TorsionalDamping, NotNegative),
    ),
    key("stator.end", "what holds the far end", Required, Word(ENDS)),
    key(
        "stator.speed",
        "speed of a driven end",
        Default("none: required of a driven end"),
        Signal(D::AngularVelocity),
    ),
    key("stator.torque", "external torque", Default("none"), Signal(D::Torque)),
    key(
        "stator.torque_on",
        "which inertia the torque acts on; 0 is the surface",
        Default("the outermost"),
        Index,
    ),
    key(
        "contact.normal_force",
        "F_n, where no [axial] and [actuation] give it",
        Default("none: [axial] and [actuation]"),
        Signal(D::Force),
    ),
    key(
        "friction.regularisation.function",
        "smooth function of omega_r over eps in the place of its sign: no stick",
        Default("none: stick and slip"),
        Word(SMOOTHINGS),
    ),
    key(
        "friction.regularisation.speed",
        "eps, speed of the smooth function",
        Default("none: required of a regularisation"),
        Plain(D::AngularVelocity, Positive),
    ),
    key(
        "friction.bristle_stiffness",
        "sigma_0, stiffness of bristles over the normal force",
        Default("none: required with law \"lugre\""),
        Plain(D::InverseAngle, Positive),
    ),
    key(
        "friction.bristle_damping",
        "sigma_1, damping of bristles over the normal force",
        Default("0"),
        Plain(D::FrictionDecay, NotNegative),
    ),
    key(
        "friction.threshold",
        "|omega_r| below which statistics count a stick, of a contact without one",
        Default("10 regularisation.speed, or scale / 10 with law \"lugre\""),
        Plain(D::AngularVelocity, Positive),
    ),
    key(
        "initial.rotor_twist",
        "twist of each shaft of the rotor, outer less inner angle",
        Default("0"),
        List(D::Angle, Any),
    ),
    key(
        "initial.rotor_speed",
        "speed of each inertia of the rotor",
        Default("0, or that of a driven end"),
        List(D::AngularVelocity, Any),
    ),
    key(
        "initial.stator_twist",
        "twist of each shaft of the stator, inner less outer angle",
        Default("0"),
        List(D::Angle, Any),
    ),
    key(
        "initial.stator_speed",
        "speed of each inertia of the stator",
        Default("0, or that of a driven end"),
        List(D::AngularVelocity, Any),
    ),
    key(
        "perturbation[].on",
        "which surface takes the kick; both share it so that momentum is kept",
        Default("\"both\""),
        Word(SIDES),
    ),
];

/// Whether a key of the schema is one of the general form as well.
pub(super) fn is_shared(path: &str) -> bool {
    !path.starts_with("torsion.")
}

/// The paths of all keys of the general form.
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
pub(in crate::case) fn find(path: &str) -> &'static Key {
    KEYS.iter()
        .find(|key| key.path == path)
        .unwrap_or_else(|| unreachable!("{path} is a key of the general form"))
}

/// What the numbers of a key measure in rotation, and their limits.
pub(in crate::case) fn measure(path: &str) -> (Dimension, Domain) {
    match KEYS
        .iter()
        .chain(schema::keys())
        .find(|key| key.path == path)
        .map(|key| &key.kind)
    {
        Some(Plain(dimension, domain) | List(dimension, domain) | Kind::Number(dimension, domain, _)) => {
            (*dimension, *domain)
        }
        Some(Signal(dimension)) => (*dimension, Any),
        _ => unreachable!("{path} takes numbers"),
    }
}

/// Whether the key at a path takes a list, of which a case may give one element.
pub(in crate::case) fn is_list(path: &str) -> bool {
    KEYS.iter().any(|key| key.path == path && matches!(key.kind, List(..)))
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

/// The words of `friction.law`.
pub(in crate::case) fn laws() -> Vec<&'static str> {
    FrictionLaw::NAMES.iter().copied().chain([LUGRE]).collect()
}
