//! The keys of a case file: the one home of their paths, units, limits, defaults and places in a case.
//!
//! The table `KEYS` drives reading, writing, parameters, unknown-key detection, sweeps and the documentation.

use std::sync::LazyLock;

use super::Case;
use super::place::{Place, at};
use super::quantity::Dimension;
use stickslip_engine::simulation::{Around, Method, OutputWindow};
use stickslip_system::friction::{FrictionLaw, LawParameter, LawValue};
use stickslip_system::model::system::{
    Bristles, ContactLaw, End, Kick, KickSide, Pressing, Regularisation, Smoothing, Train,
};
use stickslip_system::model::{Axial, BreakawayTest, KickTime};
use stickslip_system::signal::{Drive, Profile as _, Ramp, Signal, TimeTable};

/// The key of the integration method.
pub const METHOD: &str = "solver.method";

/// One key of the case file.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Dotted path; `[]` marks the elements of an array of tables, as in `perturbation[].time`.
    pub path: &'static str,
    /// One line, beginning with the paper's symbol if there is one.
    pub description: &'static str,
    /// Default, or condition of its presence.
    pub presence: Presence,
    pub(super) form: Form,
    pub(super) kind: KeyKind,
    /// All places of a case that the key sets, by the index of the array element. Empty if the case has no such place:
    /// another profile or friction law, no such element.
    places: for<'a> fn(&Key, &'a mut Case, usize) -> Vec<Place<'a>>,
}

/// Default of a key, or condition of its presence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Presence {
    /// No default.
    Required,
    /// Required with, and only allowed with, this `actuation.profile`.
    Profile(&'static str),
    /// A parameter of friction laws: only allowed with a law that has it (`law_has`), and required there unless it
    /// has a default.
    Law {
        /// Default in words.
        default: Option<&'static str>,
    },
    /// Required with, and only allowed with, this `solver.method`.
    Method(&'static str),
    /// One of two ways to give the radius: `contact.radius`, or diameters and wear.
    Alternative,
    /// Default in words.
    Default(&'static str),
}

/// Forms of a case: `[torsion]` is the short form, `[rotor]` and `[stator]` the general one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Form {
    Both,
    Short,
    General,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum KeyKind {
    Text,
    Flag,
    Count,
    /// Index of an inertia, 0 at the surface.
    Index,
    Word(fn() -> Vec<&'static str>),
    Number(Dimension, Domain),
    /// A time, or [`super::place::INSTABILITY`].
    Moment,
    Series(Dimension),
    /// An array with a number for each part of a chain. One number may replace an array of one.
    List(Dimension, Domain),
    Signal(Dimension),
}

/// Limits of a number. Every number must be finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Domain {
    Any,
    Positive,
    NotNegative,
    /// 2e-15 (ten roundings of a double) to 0.1: below, step control fights rounding and fails.
    Tolerance,
}

impl Domain {
    pub(super) fn complaint(self, value: f64) -> Option<&'static str> {
        let (fits, complaint) = match self {
            Domain::Any => (true, ""),
            Domain::Positive => (value > 0.0, "must be greater than 0"),
            Domain::NotNegative => (value >= 0.0, "must not be negative"),
            Domain::Tolerance => ((2e-15..=0.1).contains(&value), "must be from 2e-15 to 0.1"),
        };
        match (value.is_finite(), fits) {
            (false, _) => Some("must be finite"),
            (true, false) => Some(complaint),
            (true, true) => None,
        }
    }
}

impl Key {
    pub(super) fn places<'a>(&self, case: &'a mut Case, index: usize) -> Vec<Place<'a>> {
        (self.places)(self, case, index)
    }

    /// Dimension of its number in rotation; `None` for other types.
    pub fn dimension(&self) -> Option<Dimension> {
        match self.kind {
            KeyKind::Number(dimension, _) | KeyKind::Series(dimension) => Some(dimension),
            KeyKind::List(dimension, _) | KeyKind::Signal(dimension) => Some(dimension),
            KeyKind::Moment => Some(Dimension::Time),
            KeyKind::Count | KeyKind::Index => Some(Dimension::Number),
            KeyKind::Text | KeyKind::Flag | KeyKind::Word(_) => None,
        }
    }

    pub(super) fn domain(&self) -> Domain {
        match self.kind {
            KeyKind::Number(_, domain) | KeyKind::List(_, domain) => domain,
            KeyKind::Moment => Domain::NotNegative,
            _ => Domain::Any,
        }
    }

    /// Words that the key takes; empty for other types.
    pub fn choices(&self) -> Vec<&'static str> {
        match self.kind {
            KeyKind::Word(words) => words(),
            _ => Vec::new(),
        }
    }

    /// Type of the value: "number", "list", "signal", "text" and so on.
    pub fn takes(&self) -> &'static str {
        match self.kind {
            KeyKind::Text => "text",
            KeyKind::Flag => "true or false",
            KeyKind::Count | KeyKind::Index => "whole number",
            KeyKind::Word(_) => "word",
            KeyKind::Number(..) => "number",
            KeyKind::Moment => "number or \"instability\"",
            KeyKind::Series(_) | KeyKind::List(..) => "list",
            KeyKind::Signal(_) => "signal",
        }
    }

    /// Whether cases of the short form have the key, and cases of the general form.
    pub fn forms(&self) -> (bool, bool) {
        (self.is_of(true), self.is_of(false))
    }

    /// Default, or the condition under which the key is required.
    pub fn default_in_words(&self) -> String {
        let of_laws = || {
            let name = self.split().1;
            let laws = laws(!self.is_of(false)).into_iter().filter(|law| law_has(law, name));
            laws.collect::<Vec<_>>().join(", ")
        };
        match self.presence {
            Presence::Required => "required".to_owned(),
            Presence::Profile(profile) => format!("required with profile {profile}"),
            Presence::Method(method) => format!("required with method {method}"),
            Presence::Alternative => "radius, or both diameters and wear".to_owned(),
            Presence::Law { default: None } => format!("required with law {}", of_laws()),
            Presence::Law { default: Some(default) } => format!("{default}, with law {}", of_laws()),
            Presence::Default(text) => text.to_owned(),
        }
    }

    pub(super) fn is_of(&self, short: bool) -> bool {
        self.form != if short { Form::General } else { Form::Short }
    }

    pub(super) fn split(&self) -> (&'static str, &'static str) {
        self.path.rsplit_once('.').unwrap_or(("", self.path))
    }

    /// Path in a case: `perturbation[].time` with index 2 is `perturbation.2.time`.
    pub(super) fn concrete(&self, index: usize) -> String {
        self.path.replace("[]", &format!(".{index}"))
    }

    /// Number of values that a case has room for: one, or one per element of an array of tables.
    pub(super) fn count(&self, case: &Case) -> usize {
        self.path.split_once("[].").map_or(1, |(array, _)| length(case, array))
    }

    /// Index of the array element and rest of `path`, if the path leads to the key or to a value in its list or signal.
    fn matches<'p>(&self, path: &'p str) -> Option<(usize, &'p str)> {
        let (index, name, path) = match self.path.split_once("[].") {
            None => (0, self.path, path),
            Some((array, name)) => {
                let (index, rest) = path.strip_prefix(array)?.strip_prefix('.')?.split_once('.')?;
                (index.parse().ok()?, name, rest)
            }
        };
        let rest = path.strip_prefix(name)?;
        let inner = rest.strip_prefix('.').unwrap_or(rest);
        let fits = match self.kind {
            _ if rest.is_empty() => true,
            KeyKind::Series(_) => inner.parse::<usize>().is_ok(),
            KeyKind::List(..) | KeyKind::Signal(_) => true,
            _ => false,
        };
        (fits && (rest.is_empty() || rest.starts_with('.'))).then_some((index, inner))
    }
}

/// A key, the index of its array element, and the path of a value in its list or signal.
pub(super) type FoundKey<'p> = (&'static Key, usize, &'p str);

/// The keys of a concrete path. `perturbation.0.time` is `perturbation[].time`, `actuation.force.3` an element of
/// `actuation.force` of a table, and `rotor.speed.amplitude` a value in the signal `rotor.speed`.
pub(super) fn find(path: &str, short: bool) -> impl Iterator<Item = FoundKey<'_>> {
    let own = KEYS.iter().filter(move |key| key.is_of(short));
    own.filter_map(move |key| key.matches(path).map(|(index, inner)| (key, index, inner)))
}

/// The key of the short form at a concrete path.
pub fn key_of(path: &str) -> Option<&'static Key> {
    find(path, true).next().map(|found| found.0)
}

/// Every key of the short form, in the order of messages.
pub fn keys() -> impl Iterator<Item = &'static Key> {
    KEYS.iter().filter(|key| key.is_of(true))
}

/// Every key that only the general form has, except the second entry of `friction.law`.
pub fn train_keys() -> impl Iterator<Item = &'static Key> {
    KEYS.iter()
        .filter(|key| key.form == Form::General && key.path != FRICTION_LAW)
}

/// Every key of both forms; `friction.law` has an entry for each.
pub fn all_keys() -> impl Iterator<Item = &'static Key> {
    KEYS.iter()
}

/// The keys of a form, in the order of a written case.
pub(super) fn in_order(short: bool) -> &'static [&'static Key] {
    /// Tables of the two forms, after the keys outside tables; arrays end with `[]`.
    const TABLES: [&str; 2] = [
        "rotor stator contact axial actuation friction friction.regularisation initial perturbation[] solver output output.window[]",
        "axial actuation torsion contact friction initial solver output perturbation[] output.window[]",
    ];
    static SORTED: LazyLock<[Vec<&'static Key>; 2]> = LazyLock::new(|| {
        [false, true].map(|short| {
            let mut keys: Vec<&Key> = KEYS.iter().filter(|key| key.is_of(short)).collect();
            let tables = TABLES[usize::from(short)].split(' ');
            keys.sort_by_key(|key| tables.clone().position(|table| table == key.split().0));
            keys
        })
    });
    &SORTED[usize::from(short)]
}

/// The paths of all keys of a form, with `[]` for indices, in the order of messages.
pub(super) fn known(short: bool) -> Vec<&'static str> {
    match short {
        true => keys().map(|key| key.path).collect(),
        false => in_order(short).iter().map(|key| key.path).collect(),
    }
}

pub(super) fn is_list(path: &str) -> bool {
    KEYS.iter()
        .any(|key| key.path == path && matches!(key.kind, KeyKind::List(..)))
}

pub(super) fn elements(list: &str, count: usize) -> String {
    match count {
        0 => "in this case the list is empty".to_owned(),
        1 => format!("its one element is {list}.0"),
        2 => format!("its elements are {list}.0 and {list}.1"),
        _ => format!("its elements are {list}.0 to {list}.{}", count - 1),
    }
}

/// Keys of the short form, and the paths of the general form that they set.
pub(super) const SAME: &[(&str, &[&str])] = &[
    ("torsion.rotor_inertia", &["rotor.inertia.1"]),
    ("torsion.surface_inertia", &["rotor.inertia.0", "stator.inertia.0"]),
    ("torsion.stiffness", &["rotor.stiffness.0", "stator.stiffness.0"]),
    ("torsion.damping", &["rotor.damping.0", "stator.damping.0"]),
];

/// A convention of the model, not a property of the brake: it has no uncertain digits.
pub(crate) const AXIAL_RINGING_FLOOR: &str = "axial.ringing_floor";
pub(crate) const FIRST_SPEED: &str = "friction.speed.0";
pub(super) const AROUND: &str = "output.around";
const NOTHING: &str = "none";
pub(super) const FRICTION_LAW: &str = "friction.law";
pub(super) const LUGRE: &str = "lugre";
const KICK: &str = "kick";
const UNIFORM_WEAR: &str = "uniform-wear";
pub(super) const UNIFORM_PRESSURE: &str = "uniform-pressure";

pub(super) fn laws(short: bool) -> Vec<&'static str> {
    let further = (!short).then_some(LUGRE);
    FrictionLaw::NAMES.iter().copied().chain(further).collect()
}

/// Whether a law has the parameter `key` of `[friction]`. `breakaway` belongs to every law.
pub(super) fn law_has(law: &str, key: &str) -> bool {
    let of_bristles = ["bristle_stiffness", "bristle_damping", "bristle_deflection"];
    match law {
        LUGRE => law_has("stribeck", key) || of_bristles.contains(&key),
        _ => FrictionLaw::parameters_of(law)
            .iter()
            .any(|parameter| parameter.key() == key),
    }
}

type FormWords<T> = [(&'static str, T)];

const BREAKAWAY_TESTS: &FormWords<BreakawayTest> = &[
    ("transmitted", BreakawayTest::Transmitted),
    ("stator", BreakawayTest::Stator),
    ("rotor", BreakawayTest::Rotor),
];
const SIDES: &FormWords<KickSide> = &[
    ("both", KickSide::Both),
    ("rotor", KickSide::Rotor),
    ("stator", KickSide::Stator),
];
const SMOOTHINGS: &FormWords<Smoothing> = &[("tanh", Smoothing::Tanh), ("arctan", Smoothing::Arctan)];

fn names<T>(words: &FormWords<T>) -> Vec<&'static str> {
    words.iter().map(|word| word.0).collect()
}

fn word<'a, T: Copy + PartialEq>(field: &'a mut T, words: &'static FormWords<T>) -> Place<'a> {
    let now = words.iter().find(|word| word.1 == *field).map(|word| word.0);
    Place::word(now, move |name| {
        if let Some(word) = words.iter().find(|word| word.0 == name) {
            *field = word.1;
        }
    })
}

fn around_names() -> Vec<&'static str> {
    let events = Around::ALL.iter().map(|around| around.name());
    events.chain([NOTHING]).collect()
}

fn said(word: Option<&'static str>) -> Place<'static> {
    Place::word(word, |_| {})
}

/// A reference to a part of one enum variant.
macro_rules! part {
    ($of:expr, $variant:pat => $part:expr) => {
        match $of {
            $variant => Some($part),
            _ => None,
        }
    };
}

fn axial(case: &mut Case) -> Option<&mut Axial> {
    part!(&mut case.system.pressing, Pressing::Axial { axial, .. } => axial)
}

fn actuation(case: &mut Case) -> Option<&mut Signal> {
    part!(&mut case.system.pressing, Pressing::Axial { actuation, .. } => actuation)
}

fn ramp(case: &mut Case) -> Option<&mut Ramp> {
    part!(actuation(case)?, Signal::Ramp(ramp) => ramp)
}

fn table(case: &mut Case) -> Option<&mut TimeTable> {
    part!(actuation(case)?, Signal::TimeTable(table) => table)
}

fn bristles(case: &mut Case) -> Option<&mut Bristles> {
    part!(&mut case.system.contact, ContactLaw::Bristles(bristles) => bristles)
}

fn regularisation(case: &mut Case) -> Option<&mut Regularisation> {
    part!(&mut case.system.contact, ContactLaw::Regularised(regularisation) => regularisation)
}

fn end(train: &mut Train) -> Place<'_> {
    let now = match &train.end {
        End::Free => "free",
        End::Fixed => "fixed",
        End::Driven(_) => "driven",
    };
    Place::word(Some(now), |name| {
        train.end = match name {
            "free" => End::Free,
            "fixed" => End::Fixed,
            _ => End::Driven(Drive::Value(f64::NAN)),
        };
    })
}

/// The friction law. The default is not written, so a case is the same with and without it.
fn friction_law(case: &mut Case) -> Place<'_> {
    let now = match &case.system.contact {
        ContactLaw::Bristles(_) => LUGRE,
        _ => case.system.law.name(),
    };
    Place::word(Some(now).filter(|&name| name != FrictionLaw::NAMES[0]), |name| {
        if let Some(law) = FrictionLaw::unset(if name == LUGRE { "stribeck" } else { name }) {
            case.system.law = law;
        }
        if name == LUGRE {
            case.system.contact = ContactLaw::Bristles(Bristles {
                stiffness: f64::NAN,
                damping: 0.0,
                viscous: 0.0,
                deflection: 0.0,
            });
        }
    })
}

fn law_places<'a>(key: &Key, case: &'a mut Case, _: usize) -> Vec<Place<'a>> {
    let key = key.split().1;
    if let (ContactLaw::Bristles(bristles), "viscous") = (&mut case.system.contact, key) {
        return vec![at(&mut bristles.viscous)];
    }
    let law = &mut case.system.law;
    let has = law_has(law.name(), key);
    has.then_some(Place::Law(law, key)).into_iter().collect()
}

/// The key of a parameter of friction laws.
fn law_key(parameter: &LawParameter) -> Key {
    let dimension = match parameter.speed {
        1 => D::AngularVelocity,
        0 => D::Number,
        -1 => D::FrictionDecay,
        -2 => D::FrictionCurvature,
        _ => D::FrictionThird,
    };
    Key {
        path: parameter.path,
        description: parameter.about,
        presence: Presence::Law {
            default: parameter.default,
        },
        form: Form::Both,
        kind: match parameter.value {
            LawValue::Any => Number(dimension, Any),
            LawValue::NotNegative => Number(dimension, NotNegative),
            LawValue::Positive => Number(dimension, Positive),
            LawValue::List => Series(dimension),
            LawValue::Word(words) => Word(words),
        },
        places: law_places,
    }
}

const STATOR: [&str; 8] = [
    "stator.inertia",
    "stator.stiffness",
    "stator.damping",
    "stator.viscous",
    "stator.end",
    "stator.speed",
    "stator.torque",
    "stator.torque_on",
];

/// The train of a key of `[rotor]` or `[stator]`.
fn train<'a>(key: &Key, case: &'a mut Case) -> &'a mut Train {
    match key.split().0 {
        "rotor" => &mut case.system.rotor,
        _ => &mut case.system.stator,
    }
}

/// All keys: those below, after those of the rotor the same of the stator, and after `friction.breakaway` the parameters
/// of the laws, each once.
static KEYS: LazyLock<Vec<Key>> = LazyLock::new(|| {
    let mut keys = OWN_KEYS.to_vec();
    let of_rotor = |key: &Key| key.split().0 == "rotor";
    let rotor: Vec<Key> = keys.iter().copied().filter(of_rotor).collect();
    let after = keys.iter().rposition(of_rotor).map_or(0, |last| last + 1);
    let stator = STATOR.into_iter().zip(rotor).map(|(path, rotor)| Key {
        path,
        description: match rotor.kind {
            KeyKind::List(..) => "as of the rotor",
            _ => rotor.description,
        },
        ..rotor
    });
    keys.splice(after..after, stator);
    let before = keys.iter().position(|key| key.path == "friction.breakaway");
    let mut next = before.map_or(0, |before| before + 1);
    let names = FrictionLaw::NAMES.iter();
    for parameter in names.flat_map(|name| FrictionLaw::parameters_of(name)) {
        if keys.iter().all(|key| key.path != parameter.path) {
            keys.insert(next, law_key(parameter));
            next += 1;
        }
    }
    keys
});

fn both<'a>(one: &'a mut [f64], other: &'a mut [f64]) -> impl Iterator<Item = Place<'a>> {
    one.first_mut().into_iter().chain(other.first_mut()).map(at)
}

macro_rules! keys {
    (|$key:ident, $case:ident, $index:ident| $($path:literal, $form:ident, $presence:expr, $kind:expr => $places:expr, $about:literal;)*) => {
        const OWN_KEYS: &[Key] = &[$(Key {
            path: $path,
            description: $about,
            presence: $presence,
            form: Form::$form,
            kind: $kind,
            places: |$key, $case, $index| {
                let _ = ($key, &$case, $index);
                Vec::from_iter($places)
            },
        }),*];
    };
}

use Dimension as D;
use Domain::{Any, NotNegative, Positive, Tolerance};
use KeyKind::{Count, Flag, Index, List, Moment, Number, Series, Text, Word};
use Presence::{Alternative, Default, Profile, Required};

const OF_LAW: Presence = Presence::Law { default: None };

const fn of_law(default: &'static str) -> Presence {
    Presence::Law { default: Some(default) }
}

keys! { |key, case, index|
    "title", Both, Default("the name of the case"), Text => [at(&mut case.title)],
        "title of the case";
    "motion", General, Default("rotation"), Word(|| vec!["rotation", "translation"])
        => [said(Some(case.motion().name()).filter(|&name| name != "rotation"))],
        "kind of coordinates: angles or positions";
    "rotor.inertia", General, Default("[]"), List(D::Inertia, Positive) => [at(&mut train(key, case).inertia)],
        "moments of inertia from the contact outwards, the surface first; none if the surface is itself the far end";
    "rotor.stiffness", General, Default("[] where there is no shaft"), List(D::TorsionalStiffness, Positive)
        => [at(&mut train(key, case).stiffness)],
        "stiffness of the shafts between the inertias, and of one more to an end that is fixed or driven";
    "rotor.damping", General, Default("0"), List(D::TorsionalDamping, NotNegative)
        => [at(&mut train(key, case).damping)],
        "damping of the same shafts";
    "rotor.viscous", General, Default("0"), List(D::TorsionalDamping, NotNegative)
        => [at(&mut train(key, case).viscous)],
        "damping of each inertia to the ground";
    "rotor.end", General, Required, Word(|| vec!["free", "fixed", "driven"]) => [end(train(key, case))],
        "what holds the far end";
    "rotor.speed", General, Default("required if the end is driven"), KeyKind::Signal(D::AngularVelocity)
        => part!(&mut train(key, case).end, End::Driven(speed) => at(speed)),
        "speed of a driven end";
    "rotor.torque", General, Default("none"), KeyKind::Signal(D::Torque)
        => train(key, case).torque.as_mut().map(|torque| at(&mut torque.signal)),
        "external torque";
    "rotor.torque_on", General, Default("the outermost"), Index
        => train(key, case).torque.as_mut().map(|torque| at(&mut torque.on)),
        "which inertia the torque acts on; 0 is the surface";
    "axial.mass", Both, Required, Number(D::Mass, Positive) => axial(case).map(|axial| at(&mut axial.mass)),
        "m, the rotor mass";
    "axial.stiffness", Both, Required, Number(D::Stiffness, Positive)
        => axial(case).map(|axial| at(&mut axial.stiffness)),
        "k_e, equivalent axial stiffness";
    "axial.damping", Both, Required, Number(D::Damping, NotNegative) => axial(case).map(|axial| at(&mut axial.damping)),
        "c_a, axial damping";
    "axial.ringing_floor", Both, Default("1e-9 m"), Number(D::Length, Positive)
        => axial(case).map(|axial| at(&mut axial.ringing_floor)),
        "amplitude below which a ringing open contact stays open while F does not press";
    "actuation.profile", Both, Required, Word(|| Signal::NAMES.to_vec())
        => actuation(case).map(|actuation| Place::word(Some(actuation.name()), |name| {
            if let Some(blank) = Signal::blank(name) {
                *actuation = blank;
            }
        })),
        "whether the force is a ramp that then holds, or a table";
    "actuation.force", Both, Profile(<Ramp>::NAME), Number(D::Force, Any) => ramp(case).map(|ramp| at(&mut ramp.value)),
        "F_0, actuating force at the end of the ramp; positive presses the disks together";
    "actuation.rise_time", Both, Profile(<Ramp>::NAME), Number(D::Time, NotNegative)
        => ramp(case).map(|ramp| at(&mut ramp.rise_time)),
        "t_0, application time; 0 is a step at t = 0";
    "actuation.time", Both, Profile(<TimeTable>::NAME), Series(D::Time) => table(case).map(|table| at(&mut table.time)),
        "times of the corners of F(t), in order, two equal ones at a step; the first and last force hold outside";
    "actuation.force", Both, Profile(<TimeTable>::NAME), Series(D::Force) => table(case).map(|table| at(&mut table.value)),
        "F at these times, linear in between; positive presses the disks together";
    "torsion.rotor_inertia", Short, Required, Number(D::Inertia, Positive)
        => case.system.rotor.inertia.get_mut(1).map(at),
        "I, the rotor inertia";
    "torsion.surface_inertia", Short, Required, Number(D::Inertia, Positive)
        => both(&mut case.system.rotor.inertia, &mut case.system.stator.inertia),
        "J, inertia of each contact surface";
    "torsion.stiffness", Short, Required, Number(D::TorsionalStiffness, Positive)
        => both(&mut case.system.rotor.stiffness, &mut case.system.stator.stiffness),
        "k_t, torsional contact stiffness of each disk";
    "torsion.damping", Short, Required, Number(D::TorsionalDamping, NotNegative)
        => both(&mut case.system.rotor.damping, &mut case.system.stator.damping),
        "c_t, torsional contact damping of each disk";
    "contact.radius", Both, Alternative, Number(D::Length, Positive) => [at(&mut case.system.radius)],
        "r, effective friction radius";
    "contact.outer_diameter", Both, Alternative, Number(D::Length, Positive) => None::<Place>,
        "D, outer diameter of the contact, with inner_diameter and wear instead of radius";
    "contact.inner_diameter", Both, Alternative, Number(D::Length, NotNegative) => None::<Place>,
        "d, inner diameter of the contact";
    "contact.wear", Both, Alternative, Word(|| vec![UNIFORM_WEAR, UNIFORM_PRESSURE]) => None::<Place>,
        "which formula gives r: uniform wear (6) or uniform pressure (7)";
    "contact.breakaway_test", Both, Default("transmitted"), Word(|| names(BREAKAWAY_TESTS))
        => [word(&mut case.system.breakaway_test, BREAKAWAY_TESTS)],
        "the torque that is compared with mu_0 r F_n: T_f, or the paper's T_s or T_r alone";
    "contact.normal_force", General, Default("from [axial] and [actuation]"), KeyKind::Signal(D::Force)
        => part!(&mut case.system.pressing, Pressing::Force(force) => at(force)),
        "F_n, where no [axial] and [actuation] give it";
    "friction.law", Short, Default("exponential"), Word(|| laws(true)) => [friction_law(case)],
        "how friction depends on the sliding speed";
    "friction.law", General, Default("exponential"), Word(|| laws(false)) => [friction_law(case)],
        "how friction depends on the sliding speed";
    "friction.breakaway", Both, Required, Number(D::Number, NotNegative) => [at(&mut case.system.breakaway)],
        "mu_0, friction coefficient at rest; at least low_speed";
    "friction.bristle_stiffness", General, OF_LAW, Number(D::InverseAngle, Positive)
        => bristles(case).map(|bristles| at(&mut bristles.stiffness)),
        "sigma_0, stiffness of bristles over the normal force";
    "friction.bristle_damping", General, of_law("0"), Number(D::FrictionDecay, NotNegative)
        => bristles(case).map(|bristles| at(&mut bristles.damping)),
        "sigma_1, damping of bristles over the normal force";
    "friction.bristle_deflection", General, of_law("0"), Number(D::Angle, Any)
        => bristles(case).map(|bristles| at(&mut bristles.deflection)),
        "z, deflection of the bristles at t = 0";
    "friction.threshold", General, Default("10 regularisation.speed, or scale / 10 with law \"lugre\""),
        Number(D::AngularVelocity, Positive)
        => (case.system.contact != ContactLaw::StickSlip).then_some(at(&mut case.threshold)),
        "|omega_r| below which a contact that cannot stick counts as stuck in statistics";
    "friction.regularisation.function", General, Default("none: stick and slip"), Word(|| names(SMOOTHINGS))
        => regularisation(case).map(|smooth| word(&mut smooth.function, SMOOTHINGS)),
        "smooth function of omega_r/eps instead of its sign: no stick";
    "friction.regularisation.speed", General, Default("required with regularisation.function"),
        Number(D::AngularVelocity, Positive) => regularisation(case).map(|smooth| at(&mut smooth.speed)),
        "eps, speed of the smooth function";
    "initial.speed", Both, Required, Number(D::AngularVelocity, Any)
        => case.system.initial.rotor_speed.iter_mut().map(at),
        "omega_0, initial speed of the rotor and of its surface";
    "initial.rotor_twist", General, Default("0"), List(D::Angle, Any) => [at(&mut case.system.initial.rotor_twist)],
        "twist of each shaft of the rotor, outer less inner angle";
    "initial.rotor_speed", General, Default("0, or that of a driven end"), List(D::AngularVelocity, Any)
        => [at(&mut case.system.initial.rotor_speed)],
        "speed of each inertia of the rotor";
    "initial.stator_twist", General, Default("0"), List(D::Angle, Any) => [at(&mut case.system.initial.stator_twist)],
        "twist of each shaft of the stator, inner less outer angle";
    "initial.stator_speed", General, Default("0, or that of a driven end"), List(D::AngularVelocity, Any)
        => [at(&mut case.system.initial.stator_speed)],
        "speed of each inertia of the stator";
    "perturbation[].kind", Both, Default("kick"), Word(|| vec![KICK]) => [said(Some(KICK))],
        "kind of perturbation: a jump of the relative velocity";
    "perturbation[].time", Both, Required, Moment => case.system.kicks.get_mut(index).map(|kick| at(&mut kick.time)),
        "when the kick comes: a time, or \"instability\"";
    "perturbation[].relative_velocity", Both, Required, Number(D::AngularVelocity, Any)
        => case.system.kicks.get_mut(index).map(|kick| at(&mut kick.relative_velocity)),
        "delta, jump of omega_r, half on each surface";
    "perturbation[].on", General, Default("both"), Word(|| names(SIDES))
        => case.system.kicks.get_mut(index).map(|kick| word(&mut kick.on, SIDES)),
        "which surface takes the kick; both share it so that momentum is kept";
    "solver.method", Both, Default("cvode"), Word(|| Method::all().map(Method::name).collect())
        => [Place::word(Some(case.solver.method.name()), |name| {
            if let Some(method) = Method::from_name(name) {
                case.solver.method = method;
            }
        })],
        "integration method";
    "solver.rtol", Both, Default("1e-10"), Number(D::Number, Tolerance) => [at(&mut case.solver.rtol)],
        "relative tolerance; smaller is more accurate in every phase";
    "solver.atol_twist", Both, Default("rtol times a tenth of the static twist under friction"), Number(D::Angle, Positive)
        => [at(&mut case.solver.atol_twist)],
        "absolute tolerance of the twists";
    "solver.atol_rate", Both, Default("rtol times a tenth of the speed of an oscillation by that twist"),
        Number(D::AngularVelocity, Positive) => [at(&mut case.solver.atol_rate)],
        "absolute tolerance of the twist rates";
    "solver.atol_speed", Both, Default("rtol times that speed"), Number(D::AngularVelocity, Positive)
        => [at(&mut case.solver.atol_speed)],
        "absolute tolerance of the rotor speed";
    "solver.max_step", Both, Default("a twentieth of the natural period where the fast mode is resolved, else none"),
        Number(D::Time, Positive) => [at(&mut case.solver.max_step)],
        "upper bound of every step";
    "solver.fixed_step", Both, Default("steps by the tolerances"), Number(D::Time, Positive)
        => (case.solver.method != Method::Rk4).then_some(at(&mut case.solver.fixed_step)),
        "length of every step, without control of the error; for erk and erk-NAME";
    "solver.step", Both, Presence::Method("rk4"), Number(D::Time, Positive)
        => (case.solver.method == Method::Rk4).then_some(at(&mut case.solver.fixed_step)),
        "length of every step of method \"rk4\", without control of the error";
    "solver.max_events", Both, Default("100000"), Count => [at(&mut case.solver.max_events)],
        "transitions after which a run is ended with an error";
    "solver.max_steps", Both, Default("none, but a run that foresees 3e7 steps in a segment is ended"), Count
        => [at(&mut case.solver.max_steps)],
        "steps after which a run is ended with an error";
    "solver.max_wall_time", Both, Default("none"), Number(D::Time, Positive) => [at(&mut case.solver.max_wall_time)],
        "wall time after which a run is ended with an error";
    "output.end_time", Both, Default("10 s"), Number(D::Time, Positive) => [at(&mut case.output.end_time)],
        "when the run ends";
    "output.interval", Both, Default("end_time / 1000"), Number(D::Time, Positive) => [at(&mut case.output.interval)],
        "sampling interval outside the windows";
    "output.steps", Both, Default("false"), Flag => [at(&mut case.output.steps)],
        "whether every step of the integrator is recorded too";
    "output.around", Both, Default("events; none with windows"), Word(around_names)
        // The default is "none" with windows.
        => [Place::word(match case.output.follow.around {
            Some(around) => Some(around.name()),
            None => case.output.windows.is_empty().then_some(NOTHING),
        }, |name| case.output.follow.around = Around::ALL.into_iter().find(|around| around.name() == name))],
        "which events have dense samples around them: all, those of the stick-slip, the first stick, or none";
    "output.margin", Both, Default("20 natural periods"), Number(D::Time, Positive)
        => [at(&mut case.output.follow.margin)],
        "time before and after each of these events with dense samples";
    "output.samples_per_period", Both, Default("100"), Number(D::Number, Positive)
        => [at(&mut case.output.follow.samples_per_period)],
        "dense samples in a natural period";
    "output.dense", Both, Default("false"), Flag => [at(&mut case.output.follow.dense)],
        "whether polynomials are recorded that give every channel at every time";
    "output.window[].from", Both, Required, Number(D::Time, NotNegative)
        => case.output.windows.get_mut(index).map(|window| at(&mut window.from)),
        "start of a stretch that is sampled more densely";
    "output.window[].to", Both, Required, Number(D::Time, Positive)
        => case.output.windows.get_mut(index).map(|window| at(&mut window.to)),
        "end of that stretch";
    "output.window[].interval", Both, Default("(to - from) / 1000"), Number(D::Time, Positive)
        => case.output.windows.get_mut(index).map(|window| at(&mut window.interval)),
        "sampling interval there";
}

pub(super) const ARRAYS: [&str; 2] = ["perturbation", "output.window"];

pub(super) fn length(case: &Case, array: &str) -> usize {
    match array {
        "perturbation" => case.system.kicks.len(),
        _ => case.output.windows.len(),
    }
}

/// Resizes an array of tables; new elements are unset.
pub(super) fn resize(case: &mut Case, array: &str, count: usize) {
    let kick = Kick {
        time: KickTime::At(f64::NAN),
        relative_velocity: f64::NAN,
        on: KickSide::Both,
    };
    let window = OutputWindow {
        from: f64::NAN,
        to: f64::NAN,
        interval: f64::NAN,
    };
    match array {
        "perturbation" => case.system.kicks = vec![kick; count],
        _ => case.output.windows = vec![window; count],
    }
}
