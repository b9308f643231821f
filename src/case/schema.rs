//! The keys of a case file: the one place that knows their paths, units, limits and defaults.
//!
//! Reading, writing, unknown-key detection, sweeps and the documentation are driven by [`keys`].

use super::draft::Draft;
use super::quantity::Dimension;
use crate::friction::{FrictionLaw, Interpolation};
use crate::model::{BreakawayTest, Kick, KickTime};
use crate::signal::{Profile as _, Ramp, Signal, Table};
use crate::simulation::{Around, Method, OutputWindow};

/// One key of the case file.
#[derive(Debug)]
pub struct Key {
    /// Dotted path; `[]` marks the elements of an array of tables, as in `perturbation[].time`.
    pub path: &'static str,
    /// One line, beginning with the paper's symbol where there is one.
    pub description: &'static str,
    /// What happens if it is absent.
    pub presence: Presence,
    pub(super) kind: Kind,
}

/// What happens if a key is absent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Presence {
    /// There is no default.
    Required,
    /// Required with, and only allowed with, this `actuation.profile`.
    Profile(&'static str),
    /// A parameter of friction laws: allowed with, and only with, those that have it (`FrictionLaw::keys_of`), and required
    /// there unless it has a default, in words.
    Law {
        /// What happens if it is left out.
        default: Option<&'static str>,
    },
    /// One of the two ways to give the radius: `contact.radius`, or the diameters and the wear.
    Alternative,
    /// Takes this default, in words.
    Default(&'static str),
}

/// The limits of a number. Every number must be finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Domain {
    /// Every finite number.
    Any,
    /// Above 0.
    Positive,
    /// 0 or more.
    NotNegative,
    /// From ten roundings of a double (2e-15) to 0.1: below, step control fights with rounding and fails.
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

/// How a value of a key is read from a case and put into it; the index is that of the array element.
pub(super) struct Access<T> {
    /// `None` if the case has no such value: an option left to its default, another profile, no such element.
    pub(super) get: fn(&Draft, usize) -> Option<T>,
    /// Does nothing if the case has no place for the value.
    pub(super) set: fn(&mut Draft, usize, T),
}

impl<T> std::fmt::Debug for Access<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Access")
    }
}

#[derive(Debug)]
pub(super) enum Kind {
    Text(Access<String>),
    Flag(Access<bool>),
    Count(Access<usize>),
    Choice(fn() -> Vec<&'static str>, Access<&'static str>),
    Number(Dimension, Domain, Access<f64>),
    /// Only ever turned into another value of the case.
    Source(Dimension, Domain),
    SourceChoice(&'static [&'static str]),
    Moment(Access<KickTime>),
    Series(Dimension, Access<Vec<f64>>),
    /// Of the general form, which reads it without a draft: one of these words.
    Word(&'static [&'static str]),
    /// Of the general form: a number.
    Plain(Dimension, Domain),
    /// Of the general form: a list of numbers, or one number for a list of one.
    List(Dimension, Domain),
    /// Of the general form: a signal.
    Signal(Dimension),
    /// Of the general form: the place of an inertia, from 0 at the surface.
    Index,
}

impl Key {
    /// The SI unit of a number, `1` if it is a plain number; `None` for text, choices and switches.
    pub fn unit(&self) -> Option<&'static str> {
        self.dimension().map(Dimension::unit)
    }

    /// What its number measures; `None` if it takes none.
    pub fn dimension(&self) -> Option<Dimension> {
        match self.kind {
            Kind::Number(dimension, ..) | Kind::Source(dimension, _) | Kind::Series(dimension, _) => Some(dimension),
            Kind::Plain(dimension, _) | Kind::List(dimension, _) | Kind::Signal(dimension) => Some(dimension),
            Kind::Moment(_) => Some(Dimension::Time),
            Kind::Count(_) | Kind::Index => Some(Dimension::Number),
            Kind::Text(_) | Kind::Flag(_) | Kind::Choice(..) | Kind::SourceChoice(_) | Kind::Word(_) => None,
        }
    }

    /// The names that the key accepts, if it takes one of a list.
    pub fn choices(&self) -> Vec<&'static str> {
        match self.kind {
            Kind::Choice(names, _) => names(),
            Kind::SourceChoice(names) | Kind::Word(names) => names.to_vec(),
            Kind::Moment(_) => vec![INSTABILITY],
            _ => Vec::new(),
        }
    }
}

/// Every key, in the order in which a case is written.
pub fn keys() -> &'static [Key] {
    KEYS
}

/// The word for a kick at the loss of stability.
pub(crate) const INSTABILITY: &str = "instability";
/// A convention of the model, and no number of the brake: it has no digits that could be uncertain.
pub(crate) const AXIAL_RINGING_FLOOR: &str = "axial.ringing_floor";
/// The first speed of a friction table, which is 0.
pub(crate) const FIRST_SPEED: &str = "friction.speed.0";
/// The key that says around which events samples are dense, and the word for none.
pub(super) const AROUND: &str = "output.around";
const NOTHING: &str = "none";
/// Which law friction has in slip.
pub(super) const FRICTION_LAW: &str = "friction.law";
pub(super) const KICK: &str = "kick";
pub(super) const UNIFORM_WEAR: &str = "uniform-wear";
pub(super) const UNIFORM_PRESSURE: &str = "uniform-pressure";

/// Access to a field that is always there.
macro_rules! field {
    ($($field:tt)+) => {
        Access { get: |case, _| Some(case.$($field)+.clone()), set: |case, _, value| case.$($field)+ = value }
    };
}

/// Access to an optional field.
macro_rules! optional {
    ($($field:tt)+) => {
        Access { get: |case, _| case.$($field)+, set: |case, _, value| case.$($field)+ = Some(value) }
    };
}

/// Access to a field of an array element.
macro_rules! element {
    ($field:ident in $($array:tt)+) => {
        Access {
            get: |case, index| case.$($array)+.get(index).map(|element| element.$field),
            set: |case, index, value| {
                if let Some(element) = case.$($array)+.get_mut(index) {
                    element.$field = value;
                }
            },
        }
    };
}

/// Access to a parameter of the friction laws that have one of this key.
macro_rules! law {
    ($key:literal) => {
        Access {
            get: |case, _| case.parameters.friction.law.number($key),
            set: |case, _, value| case.parameters.friction.law.set_number($key, value),
        }
    };
}

/// Access to a field of one profile of the actuation.
macro_rules! profile {
    ($profile:ident . $field:ident) => {
        Access {
            get: |case, _| match &case.parameters.actuation {
                Signal::$profile(profile) => Some(profile.$field.clone()),
                _ => None,
            },
            set: |case, _, value| {
                if let Signal::$profile(profile) = &mut case.parameters.actuation {
                    profile.$field = value;
                }
            },
        }
    };
}

pub(super) const fn key(path: &'static str, description: &'static str, presence: Presence, kind: Kind) -> Key {
    Key {
        path,
        description,
        presence,
        kind,
    }
}

use Dimension as D;
use Domain::{Any, NotNegative, Positive};
use Presence::{Alternative, Default, Profile, Required};

const KEYS: &[Key] = &[
    key(
        "title",
        "what the case is, for people",
        Default("the name of the case"),
        Kind::Text(field!(title)),
    ),
    key(
        "axial.mass",
        "m, the rotor mass",
        Required,
        Kind::Number(D::Mass, Positive, field!(parameters.axial.mass)),
    ),
    key(
        "axial.stiffness",
        "k_e, equivalent axial stiffness",
        Required,
        Kind::Number(D::Stiffness, Positive, field!(parameters.axial.stiffness)),
    ),
    key(
        "axial.damping",
        "c_a, axial damping",
        Required,
        Kind::Number(D::Damping, NotNegative, field!(parameters.axial.damping)),
    ),
    key(
        AXIAL_RINGING_FLOOR,
        "amplitude below which a ringing open contact stays open while F does not press",
        Default("1e-9 m"),
        Kind::Number(D::Length, Positive, field!(parameters.axial.ringing_floor)),
    ),
    key(
        "actuation.profile",
        "whether the force is a ramp that then holds, or a table",
        Required,
        Kind::Choice(
            || Signal::NAMES.to_vec(),
            Access {
                get: |case, _| Some(case.parameters.actuation.name()),
                set: |case, _, name| {
                    if let Some(blank) = Signal::blank(name) {
                        case.parameters.actuation = blank;
                    }
                },
            },
        ),
    ),
    key(
        "actuation.force",
        "F_0, actuating force at the end of the ramp; positive presses the disks together",
        Profile(<Ramp>::NAME),
        Kind::Number(D::Force, Any, profile!(Ramp.value)),
    ),
    key(
        "actuation.rise_time",
        "t_0, application time; 0 is a step at t = 0",
        Profile(<Ramp>::NAME),
        Kind::Number(D::Time, NotNegative, profile!(Ramp.rise_time)),
    ),
    key(
        "actuation.time",
        "times of the corners of F(t), increasing; the first and last force hold outside",
        Profile(<Table>::NAME),
        Kind::Series(D::Time, profile!(Table.time)),
    ),
    key(
        "actuation.force",
        "F at these times, linear in between; positive presses the disks together",
        Profile(<Table>::NAME),
        Kind::Series(D::Force, profile!(Table.value)),
    ),
    key(
        "torsion.rotor_inertia",
        "I, the rotor inertia",
        Required,
        Kind::Number(D::Inertia, Positive, field!(parameters.torsion.rotor_inertia)),
    ),
    key(
        "torsion.surface_inertia",
        "J, inertia of each contact surface",
        Required,
        Kind::Number(D::Inertia, Positive, field!(parameters.torsion.surface_inertia)),
    ),
    key(
        "torsion.stiffness",
        "k_t, torsional contact stiffness of each disk",
        Required,
        Kind::Number(D::TorsionalStiffness, Positive, field!(parameters.torsion.stiffness)),
    ),
    key(
        "torsion.damping",
        "c_t, torsional contact damping of each disk",
        Required,
        Kind::Number(D::TorsionalDamping, NotNegative, field!(parameters.torsion.damping)),
    ),
    key(
        "contact.radius",
        "r, effective friction radius",
        Alternative,
        Kind::Number(D::Length, Positive, field!(parameters.contact.radius)),
    ),
    key(
        "contact.outer_diameter",
        "D, outer diameter of the contact, with inner_diameter and wear instead of radius",
        Alternative,
        Kind::Source(D::Length, Positive),
    ),
    key(
        "contact.inner_diameter",
        "d, inner diameter of the contact",
        Alternative,
        Kind::Source(D::Length, NotNegative),
    ),
    key(
        "contact.wear",
        "which formula gives r: uniform wear (6) or uniform pressure (7)",
        Alternative,
        Kind::SourceChoice(&[UNIFORM_WEAR, UNIFORM_PRESSURE]),
    ),
    key(
        "contact.breakaway_test",
        "the torque held against mu_0 r F_n: T_f, or the paper's T_s or T_r alone",
        Default("transmitted"),
        Kind::Choice(
            || BREAKAWAY_TESTS.iter().map(|&(name, _)| name).collect(),
            Access {
                get: |case, _| {
                    let test = case.parameters.contact.breakaway_test;
                    BREAKAWAY_TESTS
                        .iter()
                        .find(|entry| entry.1 == test)
                        .map(|entry| entry.0)
                },
                set: |case, _, name| {
                    if let Some(entry) = BREAKAWAY_TESTS.iter().find(|entry| entry.0 == name) {
                        case.parameters.contact.breakaway_test = entry.1;
                    }
                },
            },
        ),
    ),
    key(
        FRICTION_LAW,
        "how friction depends on the sliding speed",
        Default("exponential"),
        Kind::Choice(
            || FrictionLaw::NAMES.to_vec(),
            Access {
                // The default is not written: a case is the same with and without it.
                get: |case, _| Some(case.parameters.friction.law.name()).filter(|&name| name != FrictionLaw::NAMES[0]),
                set: |case, _, name| {
                    if let Some(law) = FrictionLaw::unset(name) {
                        case.parameters.friction.law = law;
                    }
                },
            },
        ),
    ),
    key(
        "friction.breakaway",
        "mu_0, friction coefficient at rest; at least low_speed",
        Required,
        Kind::Number(D::Number, NotNegative, field!(parameters.friction.breakaway)),
    ),
    key(
        "friction.low_speed",
        "mu_s, friction coefficient at vanishing sliding speed",
        Presence::Law { default: None },
        Kind::Number(D::Number, NotNegative, law!("low_speed")),
    ),
    key(
        "friction.high_speed",
        "mu_d, friction coefficient at high sliding speed",
        Presence::Law { default: None },
        Kind::Number(D::Number, NotNegative, law!("high_speed")),
    ),
    key(
        "friction.decay",
        "alpha, decay of the friction coefficient with sliding speed",
        Presence::Law { default: None },
        Kind::Number(D::FrictionDecay, NotNegative, law!("decay")),
    ),
    key(
        "friction.scale",
        "x_s, sliding speed over which the friction coefficient falls",
        Presence::Law { default: None },
        Kind::Number(D::AngularVelocity, Positive, law!("scale")),
    ),
    key(
        "friction.exponent",
        "delta, power of the sliding speed over the scale in the exponential; 1, 2, 3 or 4",
        Presence::Law { default: Some("2") },
        Kind::Number(D::Number, Positive, law!("exponent")),
    ),
    key(
        "friction.viscous",
        "mu_v, rise of the friction coefficient with sliding speed",
        Presence::Law { default: Some("0") },
        Kind::Number(D::FrictionDecay, NotNegative, law!("viscous")),
    ),
    key(
        "friction.linear",
        "c_1, slope of the friction coefficient at vanishing sliding speed",
        Presence::Law { default: None },
        Kind::Number(D::FrictionDecay, Any, law!("linear")),
    ),
    key(
        "friction.quadratic",
        "c_2, coefficient of the square of the sliding speed",
        Presence::Law { default: Some("0") },
        Kind::Number(D::FrictionCurvature, Any, law!("quadratic")),
    ),
    key(
        "friction.cubic",
        "c_3, coefficient of the cube of the sliding speed",
        Presence::Law { default: Some("0") },
        Kind::Number(D::FrictionThird, Any, law!("cubic")),
    ),
    key(
        "friction.valid_below",
        "sliding speed up to which the polynomial is given; a run that gets there ends with an error",
        Presence::Law { default: None },
        Kind::Number(D::AngularVelocity, Positive, law!("valid_below")),
    ),
    key(
        "friction.speed",
        "sliding speeds of the points, increasing from 0; above the last its coefficient holds",
        Presence::Law { default: None },
        Kind::Series(
            D::AngularVelocity,
            Access {
                get: |case, _| case.parameters.friction.law.list("speed").map(<[f64]>::to_vec),
                set: |case, _, values| case.parameters.friction.law.set_list("speed", values),
            },
        ),
    ),
    key(
        "friction.coefficient",
        "friction coefficients at these speeds",
        Presence::Law { default: None },
        Kind::Series(
            D::Number,
            Access {
                get: |case, _| case.parameters.friction.law.list("coefficient").map(<[f64]>::to_vec),
                set: |case, _, values| case.parameters.friction.law.set_list("coefficient", values),
            },
        ),
    ),
    key(
        "friction.interpolation",
        "what goes through the points",
        Presence::Law {
            default: Some("monotone-cubic"),
        },
        Kind::Choice(
            || Interpolation::ALL.map(Interpolation::name).to_vec(),
            Access {
                get: |case, _| case.parameters.friction.law.word("interpolation"),
                set: |case, _, word| case.parameters.friction.law.set_word("interpolation", word),
            },
        ),
    ),
    key(
        "friction.kinetic",
        "mu_d, friction coefficient at every sliding speed",
        Presence::Law { default: None },
        Kind::Number(D::Number, NotNegative, law!("kinetic")),
    ),
    key(
        "initial.speed",
        "omega_0, initial speed of the rotor and of its surface",
        Required,
        Kind::Number(D::AngularVelocity, Any, field!(parameters.initial.speed)),
    ),
    key(
        "perturbation[].kind",
        "what the perturbation is: a jump of the relative velocity",
        Default("kick"),
        Kind::Choice(
            || vec![KICK],
            Access {
                get: |case, index| case.parameters.perturbations.get(index).map(|_| KICK),
                set: |_, _, _| {},
            },
        ),
    ),
    key(
        "perturbation[].time",
        "when the kick comes: a time, or \"instability\"",
        Required,
        Kind::Moment(element!(time in parameters.perturbations)),
    ),
    key(
        "perturbation[].relative_velocity",
        "delta, jump of omega_r, half on each surface",
        Required,
        Kind::Number(
            D::AngularVelocity,
            Any,
            element!(relative_velocity in parameters.perturbations),
        ),
    ),
    key(
        "solver.method",
        "integration method",
        Default("auto"),
        Kind::Choice(
            || Method::all().map(Method::name).collect(),
            Access {
                get: |case, _| Some(case.solver.method.name()),
                set: |case, _, name| {
                    if let Some(method) = Method::from_name(name) {
                        case.solver.method = method;
                    }
                },
            },
        ),
    ),
    key(
        "solver.rtol",
        "relative tolerance; smaller is more accurate in every phase",
        Default("1e-10"),
        Kind::Number(D::Number, Domain::Tolerance, field!(solver.rtol)),
    ),
    key(
        "solver.atol_twist",
        "absolute tolerance of the twists",
        Default("rtol times a tenth of the static twist under friction"),
        Kind::Number(D::Angle, Positive, optional!(solver.atol_twist)),
    ),
    key(
        "solver.atol_rate",
        "absolute tolerance of the twist rates",
        Default("rtol times a tenth of the speed of an oscillation by that twist"),
        Kind::Number(D::AngularVelocity, Positive, optional!(solver.atol_rate)),
    ),
    key(
        "solver.atol_speed",
        "absolute tolerance of the rotor speed",
        Default("rtol times that speed"),
        Kind::Number(D::AngularVelocity, Positive, optional!(solver.atol_speed)),
    ),
    key(
        "solver.max_step",
        "upper bound of every step",
        Default("a twentieth of the natural period where the fast mode is resolved, else none"),
        Kind::Number(D::Time, Positive, optional!(solver.max_step)),
    ),
    key(
        "solver.fixed_step",
        "length of every step, without control of the error; for erk and erk-NAME",
        Default("steps by the tolerances"),
        Kind::Number(D::Time, Positive, optional!(solver.fixed_step)),
    ),
    key(
        "solver.max_events",
        "transitions after which a run is ended with an error",
        Default("100000"),
        Kind::Count(field!(solver.max_events)),
    ),
    key(
        "solver.max_steps",
        "steps after which a run is ended with an error",
        Default("none, but a run that foresees 3e7 steps in a segment is ended"),
        Kind::Count(optional!(solver.max_steps)),
    ),
    key(
        "solver.max_wall_time",
        "wall time after which a run is ended with an error",
        Default("none"),
        Kind::Number(D::Time, Positive, optional!(solver.max_wall_time)),
    ),
    key(
        "output.end_time",
        "when the run ends",
        Default("10 s"),
        Kind::Number(D::Time, Positive, field!(output.end_time)),
    ),
    key(
        "output.interval",
        "sampling interval outside the windows",
        Default("end_time / 1000"),
        Kind::Number(D::Time, Positive, field!(output.interval)),
    ),
    key(
        "output.steps",
        "whether every step of the integrator is recorded too",
        Default("false"),
        Kind::Flag(field!(output.steps)),
    ),
    key(
        AROUND,
        "which events have dense samples around them: all, those of the stick-slip, the first stick, or none",
        Default("\"events\" of a case without windows, else \"none\""),
        Kind::Choice(
            || {
                Around::ALL
                    .iter()
                    .map(|around| around.name())
                    .chain([NOTHING])
                    .collect()
            },
            Access {
                // Windows mean none, unless the case says otherwise.
                get: |case, _| match case.output.follow.around {
                    Some(around) => Some(around.name()),
                    None => case.output.windows.is_empty().then_some(NOTHING),
                },
                set: |case, _, name| {
                    case.output.follow.around = Around::ALL.into_iter().find(|around| around.name() == name);
                },
            },
        ),
    ),
    key(
        "output.margin",
        "how far before and after each of these events the dense samples reach",
        Default("20 natural periods"),
        Kind::Number(D::Time, Positive, optional!(output.follow.margin)),
    ),
    key(
        "output.samples_per_period",
        "dense samples in a natural period",
        Default("100"),
        Kind::Number(D::Number, Positive, optional!(output.follow.samples_per_period)),
    ),
    key(
        "output.dense",
        "whether polynomials are recorded that give every channel at every time",
        Default("false"),
        Kind::Flag(Access {
            get: |case, _| case.output.follow.dense.then_some(true),
            set: |case, _, dense| case.output.follow.dense = dense,
        }),
    ),
    key(
        "output.window[].from",
        "start of a stretch that is sampled more densely",
        Required,
        Kind::Number(D::Time, NotNegative, element!(from in output.windows)),
    ),
    key(
        "output.window[].to",
        "end of that stretch",
        Required,
        Kind::Number(D::Time, Positive, element!(to in output.windows)),
    ),
    key(
        "output.window[].interval",
        "sampling interval there",
        Default("(to - from) / 1000"),
        Kind::Number(D::Time, Positive, element!(interval in output.windows)),
    ),
];

const BREAKAWAY_TESTS: [(&str, BreakawayTest); 3] = [
    ("transmitted", BreakawayTest::Transmitted),
    ("stator", BreakawayTest::Stator),
    ("rotor", BreakawayTest::Rotor),
];

pub(super) const NEW_KICK: Kick = Kick {
    time: KickTime::At(f64::NAN),
    relative_velocity: f64::NAN,
};

pub(super) const NEW_WINDOW: OutputWindow = OutputWindow {
    from: f64::NAN,
    to: f64::NAN,
    interval: f64::NAN,
};

/// The arrays of tables: their path, how long they are in a case, and how to make room for `n` new elements.
pub(super) struct ArrayOfTables {
    pub(super) path: &'static str,
    pub(super) length: fn(&Draft) -> usize,
    pub(super) resize: fn(&mut Draft, usize),
}

pub(super) const ARRAYS: &[ArrayOfTables] = &[
    ArrayOfTables {
        path: "perturbation",
        length: |case| case.parameters.perturbations.len(),
        resize: |case, count| case.parameters.perturbations = vec![NEW_KICK; count],
    },
    ArrayOfTables {
        path: "output.window",
        length: |case| case.output.windows.len(),
        resize: |case, count| case.output.windows = vec![NEW_WINDOW; count],
    },
];

/// The path of a number of the actuation, by its field's name in [`crate::signal`].
pub(super) fn actuation_path(field: &str) -> String {
    format!("actuation.{}", if field == "value" { "force" } else { field })
}

/// The actuation of a profile as a template.
pub(super) fn whole_actuation(profile: &'static str) -> String {
    let mut text = format!("actuation={{profile=\"{profile}\"");
    for key in KEYS.iter().filter(|key| key.presence == Presence::Profile(profile)) {
        let name = key.path.trim_start_matches("actuation.");
        let value = if matches!(key.kind, Kind::Series(..)) {
            "[...]"
        } else {
            "..."
        };
        text.push_str(&format!(", {name}={value}"));
    }
    text + "}"
}

/// The array of tables that a key is in, and the key's name there.
pub(super) fn array_of(key: &Key) -> Option<(&'static ArrayOfTables, &'static str)> {
    let (path, name) = key.path.split_once("[].")?;
    let array = ARRAYS.iter().find(|array| array.path == path)?;
    Some((array, name))
}

/// The path of a key in a case: `perturbation[].time` with index 2 is `perturbation.2.time`.
pub(super) fn concrete(key: &Key, index: usize) -> String {
    key.path.replace("[]", &format!(".{index}"))
}
