//! Places of a case that a key sets, the values there, and the case as text in SI.

use toml_edit::Value;

use super::schema::{self, FRICTION_LAW, Key};
use super::{Case, Motion, Setting};
use stickslip_system::friction::FrictionLaw;
use stickslip_system::model::KickTime;
use stickslip_system::model::system::ContactLaw;
use stickslip_system::signal::{Drive, Frequency, HarmonicShape, SIGNALS, Signal, TimeTable};

pub(super) const INSTABILITY: &str = "instability";

pub(super) enum Place<'a> {
    Text(&'a mut String),
    Flag(&'a mut bool),
    Count(&'a mut usize),
    OptionalCount(&'a mut Option<usize>),
    Number(&'a mut f64),
    OptionalNumber(&'a mut Option<f64>),
    Moment(&'a mut KickTime),
    List(&'a mut Vec<f64>),
    Signal(&'a mut Drive),
    Law(&'a mut FrictionLaw, &'static str),
    Word(Option<&'static str>, Box<dyn FnMut(&str) + 'a>),
}

#[derive(Debug, Clone)]
pub(super) enum Content {
    One(Setting),
    List(Vec<f64>),
    Signal(Drive),
}

macro_rules! of_fields {
    ($($place:ident: $field:ty,)*) => {
        $(impl<'a> From<&'a mut $field> for Place<'a> {
            fn from(field: &'a mut $field) -> Self {
                Place::$place(field)
            }
        })*
    };
}

of_fields! {
    Text: String,
    Flag: bool,
    Count: usize,
    OptionalCount: Option<usize>,
    Number: f64,
    OptionalNumber: Option<f64>,
    Moment: KickTime,
    List: Vec<f64>,
    Signal: Drive,
}

pub(super) fn at<'a, T>(field: &'a mut T) -> Place<'a>
where
    Place<'a>: From<&'a mut T>,
{
    field.into()
}

impl<'a> Place<'a> {
    pub(super) fn word(now: Option<&'static str>, set: impl FnMut(&str) + 'a) -> Place<'a> {
        Place::Word(now, Box::new(set))
    }

    pub(super) fn get(&self) -> Option<Content> {
        Some(Content::One(match self {
            Place::Text(text) => Setting::Text(text.to_string()),
            Place::Flag(flag) => Setting::Flag(**flag),
            Place::Count(count) => Setting::Count(**count),
            Place::OptionalCount(count) => Setting::Count((**count)?),
            Place::Number(number) => Setting::Number(**number),
            Place::OptionalNumber(number) => Setting::Number((**number)?),
            Place::Moment(KickTime::At(time)) => Setting::Number(*time),
            Place::Moment(KickTime::Instability) => Setting::Text(INSTABILITY.to_owned()),
            Place::List(numbers) => return Some(Content::List(numbers.to_vec())),
            Place::Signal(drive) => return Some(Content::Signal((*drive).clone())),
            Place::Law(law, key) => match (law.number(key), law.list(key)) {
                (Some(number), _) => Setting::Number(number),
                (None, Some(list)) => return Some(Content::List(list.to_vec())),
                (None, None) => Setting::Text(law.word(key)?.to_owned()),
            },
            Place::Word(now, _) => Setting::Text((*now)?.to_owned()),
        }))
    }

    pub(super) fn set(&mut self, content: Content) {
        match (self, content) {
            (Place::Text(text), Content::One(Setting::Text(new))) => **text = new,
            (Place::Flag(flag), Content::One(Setting::Flag(new))) => **flag = new,
            (Place::Count(count), Content::One(Setting::Count(new))) => **count = new,
            (Place::OptionalCount(count), Content::One(Setting::Count(new))) => **count = Some(new),
            (Place::Number(number), Content::One(Setting::Number(new))) => **number = new,
            (Place::OptionalNumber(number), Content::One(Setting::Number(new))) => **number = Some(new),
            (Place::Moment(time), Content::One(Setting::Number(new))) => **time = KickTime::At(new),
            (Place::Moment(time), Content::One(Setting::Text(_))) => **time = KickTime::Instability,
            (Place::List(numbers), Content::List(new)) => **numbers = new,
            (Place::Signal(drive), Content::Signal(new)) => **drive = new,
            (Place::Law(law, key), Content::One(Setting::Number(new))) => law.set_number(key, new),
            (Place::Law(law, key), Content::One(Setting::Text(new))) => law.set_word(key, &new),
            (Place::Law(law, key), Content::List(new)) => law.set_list(key, new),
            (Place::Word(_, set), Content::One(Setting::Text(new))) => set(&new),
            (_, content) => unreachable!("{content:?} is not of the kind of its key"),
        }
    }
}

impl Content {
    pub(super) fn number(&self, inner: &str) -> Option<f64> {
        match self {
            Content::One(Setting::Number(number)) if inner.is_empty() => Some(*number),
            Content::One(_) => None,
            Content::List(numbers) => numbers.get(inner.parse::<usize>().ok()?).copied(),
            Content::Signal(Drive::Value(value)) if inner.is_empty() => Some(*value),
            Content::Signal(_) => None,
        }
    }

    pub(super) fn with_number(self, inner: &str, new: f64) -> Content {
        match self {
            Content::One(_) => Content::One(Setting::Number(new)),
            Content::List(mut numbers) => {
                if let Some(number) = inner.parse().ok().and_then(|index: usize| numbers.get_mut(index)) {
                    *number = new;
                }
                Content::List(numbers)
            }
            Content::Signal(_) => Content::Signal(Drive::Value(new)),
        }
    }

    /// The value as TOML. `Debug` prints the shortest decimal that reads back as the same double.
    pub(super) fn toml(&self) -> String {
        match self {
            Content::One(Setting::Text(text)) => Value::from(text).to_string(),
            Content::One(other) => other.word(),
            Content::List(numbers) => format!("{numbers:?}"),
            Content::Signal(drive) => signal(drive),
        }
    }
}

fn signal(drive: &Drive) -> String {
    match drive {
        Drive::Value(value) => format!("{value:?}"),
        Drive::Linear(Signal::Ramp(ramp)) => format!(
            "{{ profile = \"ramp\", value = {:?}, rise_time = {:?} }}",
            ramp.value, ramp.rise_time
        ),
        Drive::Linear(Signal::TimeTable(TimeTable { time, value })) => {
            format!("{{ profile = \"table\", time = {time:?}, value = {value:?} }}")
        }
        Drive::Wave(wave) => {
            let shape = match (wave.frequency, wave.shape) {
                (Frequency::Sweep { .. }, _) => "chirp",
                (_, HarmonicShape::Sine) => "sine",
                (_, HarmonicShape::Cosine) => "cosine",
            };
            let frequency = match wave.frequency {
                Frequency::Cycles(frequency) => format!("frequency = {frequency:?}"),
                Frequency::Angular(frequency) => format!("angular_frequency = {frequency:?}"),
                Frequency::Sweep { start, end, duration } => {
                    format!("start_frequency = {start:?}, end_frequency = {end:?}, duration = {duration:?}")
                }
            };
            let time =
                |name: &str, time: Option<f64>| time.map_or(String::new(), |time| format!(", {name} = {time:?}"));
            format!(
                "{{ profile = \"{shape}\", mean = {:?}, amplitude = {:?}, {frequency}, phase = {:?}{}{} }}",
                wave.mean,
                wave.amplitude,
                wave.phase,
                time("from", wave.from),
                time("to", wave.to)
            )
        }
        Drive::Sum(terms) => {
            let terms: Vec<String> = terms.iter().map(signal).collect();
            format!("{{ profile = \"sum\", {SIGNALS} = [{}] }}", terms.join(", "))
        }
    }
}

/// The case as TOML in SI, at full precision.
pub(super) fn resolved(case: &Case) -> String {
    let mut case = case.clone();
    let short = case.is_short();
    let mut text = String::new();
    let keys = schema::in_order(short);
    for table in keys.chunk_by(|one, other| one.split().0 == other.split().0) {
        let name = table[0].split().0;
        let array = name.strip_suffix("[]");
        for index in 0..table[0].count(&case) {
            let mut heading = match array {
                Some(array) => format!("\n[[{array}]]\n"),
                None if name.is_empty() => String::new(),
                None => format!("\n[{name}]\n"),
            };
            for key in table {
                if let Some(value) = written(&mut case, key, index, short) {
                    text += &std::mem::take(&mut heading);
                    text += &format!("{} = {value} # {}\n", key.split().1, about(&case, key, short));
                }
            }
        }
    }
    text
}

fn written(case: &mut Case, key: &Key, index: usize, short: bool) -> Option<String> {
    let is_written = match key.path {
        "contact.radius" => case.motion() == Motion::Rotation,
        "contact.breakaway_test" => case.system.contact == ContactLaw::StickSlip,
        "initial.speed" | "perturbation[].kind" => short,
        "output.dense" => case.output.follow.dense,
        _ => true,
    };
    let value = key.places(case, index).first().filter(|_| is_written)?.get()?.toml();
    (value != "[]").then_some(value)
}

fn about(case: &Case, key: &Key, short: bool) -> String {
    let bristles = matches!(case.system.contact, ContactLaw::Bristles(_));
    let description = match key.path {
        FRICTION_LAW if bristles => "bristles; below, the law g of their limits",
        "friction.viscous" if bristles => "sigma_2, rise of the friction coefficient with sliding speed",
        "perturbation[].time" if !short => "when the kick comes",
        "perturbation[].relative_velocity" if !short => "delta, jump of omega_r",
        _ => key.description,
    };
    match key
        .dimension()
        .map(|dimension| case.motion().dimension(dimension).unit())
    {
        None | Some("1") => description.to_owned(),
        Some(unit) => format!("{description} [{unit}]"),
    }
}
