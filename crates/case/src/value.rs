//! Reads one value by the rules of its key: a number or a list in its unit and limits, a word, a signal. A signal is a
//! number, or a table with a profile.

use super::conditions::{SHORTEST_RUN, Violation, below_shortest, points, too_short};
use super::document::{CaseValue, PlacedValue};
use super::place::INSTABILITY;
use super::quantity::{self, Dimension};
use super::schema::{Domain, Key, KeyKind, METHOD};
use super::{Motion, Setting, suggest};
use stickslip_engine::simulation::Method;
use stickslip_system::quote::shown;
use stickslip_system::signal::{Drive, Frequency, HarmonicShape, Ramp, SIGNALS, Signal, TimeTable, Timeline, Wave};

pub(super) fn numbers(
    path: &str,
    elements: &[PlacedValue],
    dimension: Dimension,
    domain: Domain,
) -> Result<Vec<f64>, Vec<Violation>> {
    let mut wrong = Vec::new();
    let mut read = Vec::with_capacity(elements.len());
    for (index, element) in elements.iter().enumerate() {
        match number(&element.value, dimension, domain) {
            Ok(number) => read.push(number),
            Err(message) => wrong.push(Violation::new(&format!("{path}.{index}"), &[], message)),
        }
    }
    if wrong.is_empty() { Ok(read) } else { Err(wrong) }
}

/// Reads one value for a key, and checks it without the rest of the case. For a list or a signal it is one number.
pub(super) fn single(key: &Key, value: &CaseValue, motion: Motion) -> Result<Setting, String> {
    let whole = |least: i64, expected: &str| match value {
        CaseValue::Integer(count) if *count >= least => {
            Ok(Setting::Count(usize::try_from(*count).unwrap_or(usize::MAX)))
        }
        other => Err(format!(
            "expected a whole number{expected}, but got {}",
            other.describe()
        )),
    };
    match (key.kind, value) {
        (KeyKind::Text, CaseValue::Text(text)) => Ok(Setting::Text(text.clone())),
        (KeyKind::Text, other) => Err(format!("expected text in quotes, but got {}", other.describe())),
        (KeyKind::Flag, CaseValue::Flag(flag)) => Ok(Setting::Flag(*flag)),
        (KeyKind::Flag, other) => Err(format!("expected true or false, but got {}", other.describe())),
        (KeyKind::Count, _) => whole(1, " of at least 1"),
        (KeyKind::Index, _) => whole(0, ", 0 or more"),
        (KeyKind::Word(_), CaseValue::Text(name)) if key.path == METHOD && name == Method::FORMER_DEFAULT => {
            Ok(Setting::Text(Method::default().name().to_owned()))
        }
        (KeyKind::Word(words), _) => choice(value, &words()).map(|name| Setting::Text(name.to_owned())),
        (KeyKind::Moment, CaseValue::Text(word)) if word == INSTABILITY => Ok(Setting::Text(word.clone())),
        (KeyKind::Moment, CaseValue::Text(word)) if !word.contains(|c: char| c.is_ascii_digit()) => Err(format!(
            "expected a time, s, or \"{}\", but got \"{}\"",
            INSTABILITY,
            shown(word)
        )),
        _ => {
            let dimension = motion.dimension(key.dimension().unwrap_or(Dimension::Number));
            number(value, dimension, key.domain()).map(Setting::Number)
        }
    }
}

pub(super) fn number(value: &CaseValue, dimension: Dimension, domain: Domain) -> Result<f64, String> {
    let number = match value {
        CaseValue::Integer(number) => *number as f64,
        CaseValue::Float(number) => *number,
        CaseValue::Text(text) => quantity::parse(text, dimension)?,
        other => {
            return Err(format!(
                "expected {}, but got {}",
                quantity::expectation(dimension),
                other.describe()
            ));
        }
    };
    match domain.complaint(number) {
        None => Ok(number),
        Some(complaint) => Err(format!("{complaint}, but is {}", written(value, number, dimension))),
    }
}

fn written(value: &CaseValue, number: f64, dimension: Dimension) -> String {
    match value {
        CaseValue::Text(text) => format!("\"{text}\", {number:?} {}", dimension.unit(), text = shown(text)),
        _ => format!("{number:?}"),
    }
}

/// Most words that a message lists.
const MOST_LISTED: usize = 9;

pub(super) fn choice(value: &CaseValue, names: &[&'static str]) -> Result<&'static str, String> {
    let listed = || match names {
        [only] => format!("\"{only}\""),
        _ if names.len() <= MOST_LISTED => format!("one of \"{}\"", names.join("\", \"")),
        _ => {
            let (first, rest) = names.split_at(MOST_LISTED);
            let first = first.join("\", \"");
            format!(
                "one of \"{first}\" and {} more (`stickslip case --keys KEY` lists them)",
                rest.len()
            )
        }
    };
    let CaseValue::Text(text) = value else {
        return Err(format!("expected {}, but got {}", listed(), value.describe()));
    };
    names.iter().find(|name| *name == text).copied().ok_or_else(|| {
        let hint = suggest(text, names.iter().copied()).map(|close| format!("; did you mean \"{close}\"?"));
        let (text, hint) = (shown(text), hint.unwrap_or_default());
        match names.len() > MOST_LISTED && !hint.is_empty() {
            true => format!("there is no \"{text}\"{hint}"),
            false => format!("expected {}, but got \"{text}\"{hint}", listed()),
        }
    })
}

/// The profiles of a signal.
pub const PROFILES: &[&str] = &["ramp", "table", "sine", "cosine", "chirp", "sum"];

/// Deeper nesting of sums is a typing error.
const DEEPEST: usize = 4;

/// A key of signals besides `profile`.
#[derive(Debug, Clone, Copy)]
pub struct SignalKey {
    /// Name in the table of the signal.
    pub name: &'static str,
    /// Profiles that have it.
    pub profiles: &'static [&'static str],
    /// Dimension if it differs from the signal's.
    pub dimension: Option<Dimension>,
    domain: Domain,
    /// Default in words; empty for a required key.
    pub default: &'static str,
    /// One line about the key.
    pub description: &'static str,
}

impl SignalKey {
    /// Type of the value: "number", "number or list", "signals".
    pub fn takes(&self) -> &'static str {
        match self.name {
            SIGNALS => "list of signals",
            "value" => "number or list",
            "time" => "list",
            _ => "number",
        }
    }
}

const WAVES: &[&str] = &["sine", "cosine"];
const WITH_CHIRP: &[&str] = &["sine", "cosine", "chirp"];
const CHIRP: &[&str] = &["chirp"];

macro_rules! signal_keys {
    ($($name:expr, $profiles:expr, $dimension:expr, $domain:ident, $default:literal, $about:literal;)*) => {
        /// The keys of signals besides `profile`.
        pub const SIGNAL_KEYS: &[SignalKey] = &[$(SignalKey {
            name: $name,
            profiles: $profiles,
            dimension: $dimension,
            domain: Domain::$domain,
            default: $default,
            description: $about,
        }),*];
    };
}

signal_keys! {
    "time", &["table"], Some(Dimension::Time), Any, "",
        "times of the points, in order; two equal ones at a step";
    "value", &["ramp", "table"], None, Any, "",
        "value after the ramp; or the values at the times, linear in between, the first and last beyond";
    "rise_time", &["ramp"], Some(Dimension::Time), NotNegative, "",
        "length of the ramp, which starts from 0 at t = 0; 0 is a step";
    "mean", WITH_CHIRP, None, Any, "0", "mean of the harmonic";
    "amplitude", WITH_CHIRP, None, Any, "", "amplitude of the harmonic";
    "frequency", WAVES, Some(Dimension::Frequency), Positive, "angular_frequency", "cycles per second";
    "angular_frequency", WAVES, Some(Dimension::AngularVelocity), Positive, "frequency", "angular frequency omega";
    "start_frequency", CHIRP, Some(Dimension::Frequency), Positive, "", "frequency at t = 0, cycles per second";
    "end_frequency", CHIRP, Some(Dimension::Frequency), Positive, "", "frequency from the end of the sweep on";
    "duration", CHIRP, Some(Dimension::Time), Positive, "",
        "length of the sweep, which starts at t = 0: the frequency changes linearly, then stays";
    "phase", WITH_CHIRP, Some(Dimension::Angle), Any, "0",
        "phase: mean + amplitude sin(omega t + phase), t from the start of the run; chirp: the integral of omega instead of omega t";
    "from", WAVES, Some(Dimension::Time), NotNegative, "0", "start of the harmonic; before it the mean alone";
    "to", WAVES, Some(Dimension::Time), NotNegative, "none", "end of the harmonic; after it the mean alone";
    SIGNALS, &["sum"], None, Any, "", "signals that are added";
}

pub(super) fn keys_of(profile: &str) -> Vec<&'static str> {
    let own = SIGNAL_KEYS.iter().filter(|key| key.profiles.contains(&profile));
    own.map(|key| key.name).collect()
}

/// Dimension and limits of the number at `path` in a signal. `dimension` is that of the signal in rotation.
/// [`Motion`] changes the signal's dimension only.
pub(super) fn measure(path: &str, dimension: Dimension, motion: Motion) -> (Dimension, Domain) {
    let name = path.rsplit('.').find(|part| part.parse::<usize>().is_err());
    let key = SIGNAL_KEYS.iter().find(|key| Some(key.name) == name);
    let own = key.and_then(|key| key.dimension);
    (
        own.unwrap_or(motion.dimension(dimension)),
        key.map_or(Domain::Any, |key| key.domain),
    )
}

pub(super) fn signal(
    path: &str,
    node: &PlacedValue,
    dimension: Dimension,
    motion: Motion,
) -> Result<Drive, Vec<Violation>> {
    let mut reader = Signals {
        dimension,
        motion,
        wrong: Vec::new(),
    };
    reader.whole(path, node).ok_or(reader.wrong)
}

type SignalPlace<'a> = (&'a str, &'a PlacedValue);

struct Signals {
    dimension: Dimension,
    motion: Motion,
    wrong: Vec<Violation>,
}

impl Signals {
    fn whole(&mut self, path: &str, node: &PlacedValue) -> Option<Drive> {
        let drive = self.drive(path, node, 0).filter(|_| self.wrong.is_empty())?;
        let timeline = Timeline::new(&[&drive]);
        let finite = |stretch: usize| {
            let start = timeline.start(stretch);
            timeline.value(0, stretch, start).is_finite() && timeline.slope(0, stretch, start).is_finite()
        };
        if drive.largest().is_finite() && (0..=timeline.corners().len()).all(finite) {
            return Some(drive);
        }
        self.wrong(
            path,
            "its values or slopes are outside the range of double precision: make it smaller or slower",
        )
    }

    fn drive(&mut self, path: &str, node: &PlacedValue, depth: usize) -> Option<Drive> {
        let at = (path, node);
        let dimension = self.motion.dimension(self.dimension);
        let entries = match &node.value {
            CaseValue::Table(entries) => entries,
            CaseValue::Array(_) => {
                let message = format!(
                    "expected {}, or a table with a profile, such as {{ profile = \"table\", time = [...], value = [...] }}, but \
                     got an array",
                    quantity::expectation(dimension)
                );
                return self.wrong(path, message);
            }
            value => return self.fits(path, number(value, dimension, Domain::Any)).map(Drive::Value),
        };
        if depth > DEEPEST {
            let message = format!("sums within sums, more than {DEEPEST} deep: write one sum of all");
            return self.wrong(path, message);
        }
        let profile_path = format!("{path}.profile");
        let Some(profile) = node.at("profile") else {
            let message = format!(
                "missing: what the signal is; write profile = \"{}\", or a number instead of the table",
                PROFILES.join("\" or \"")
            );
            return self.wrong(&profile_path, message);
        };
        let profile = self.fits(&profile_path, choice(&profile.value, PROFILES))?;
        for (name, _) in entries {
            if name != "profile" && !keys_of(profile).contains(&name.as_str()) {
                let segment = toml_edit::Key::new(name).to_string();
                self.wrong::<()>(&format!("{path}.{segment}"), foreign_key(name, profile));
            }
        }
        match profile {
            "ramp" => self.ramp(at),
            "table" => self.table(at),
            "sum" => self.sum(at, depth),
            harmonic => self.wave(harmonic, at),
        }
    }

    fn wrong<T>(&mut self, path: &str, message: impl Into<String>) -> Option<T> {
        self.wrong.push(Violation::new(path, &[], message.into()));
        None
    }

    fn fits<T>(&mut self, path: &str, read: Result<T, String>) -> Option<T> {
        read.map_err(|message| self.wrong::<()>(path, message)).ok()
    }

    fn element(&mut self, (path, node): SignalPlace<'_>, name: &str, default: Option<f64>) -> Option<f64> {
        let path = format!("{path}.{name}");
        let (dimension, domain) = measure(name, self.dimension, self.motion);
        match node.at(name) {
            Some(node) => self.fits(&path, number(&node.value, dimension, domain)),
            None if default.is_some() => default,
            None => self.wrong(&path, format!("missing; write {name} = {}", dimension.number())),
        }
    }

    fn ramp(&mut self, at: SignalPlace<'_>) -> Option<Drive> {
        let value = self.element(at, "value", None);
        let rise_time = self.element(at, "rise_time", None)?;
        if rise_time > 0.0 && rise_time < SHORTEST_RUN {
            return self.wrong(&format!("{}.rise_time", at.0), too_short(rise_time));
        }
        value.map(|value| Drive::Linear(Signal::Ramp(Ramp { value, rise_time })))
    }

    fn table(&mut self, (path, node): SignalPlace<'_>) -> Option<Drive> {
        let paths = ["time", "value"].map(|name| format!("{path}.{name}"));
        let lists = [("time", &paths[0]), ("value", &paths[1])].map(|(name, path)| {
            let (dimension, _) = measure(name, self.dimension, self.motion);
            match node.at(name).map(|node| &node.value) {
                Some(CaseValue::Array(elements)) => {
                    let numbers = numbers(path, elements, dimension, Domain::Any);
                    numbers.map_err(|wrong| self.wrong.extend(wrong)).ok()
                }
                Some(other) => self.wrong(
                    path,
                    format!("expected an array of numbers, but got {}", other.describe()),
                ),
                None => self.wrong(
                    path,
                    format!("missing; write {name} = [...], numbers in {}", dimension.unit()),
                ),
            }
        });
        let [Some(time), Some(value)] = lists else {
            return None;
        };
        self.wrong
            .extend(points(&paths[0], &time, (&paths[1], "values", value.len())));
        Some(Drive::Linear(Signal::TimeTable(TimeTable { time, value })))
    }

    fn wave(&mut self, profile: &str, at: SignalPlace<'_>) -> Option<Drive> {
        let mean = self.element(at, "mean", Some(0.0));
        let amplitude = self.element(at, "amplitude", None);
        let frequency = match profile {
            "chirp" => self.sweep(at),
            _ => self.frequency(at),
        };
        let phase = self.element(at, "phase", Some(0.0));
        let mut time = |name: &str| match at.1.at(name) {
            Some(_) => self.element(at, name, None).map(Some),
            None => Some(None),
        };
        let (from, to) = (time("from")?, time("to")?);
        let start = from.unwrap_or(0.0);
        if let Some(to) = to.filter(|to| *to <= start) {
            let message = format!("must be after from: {to:?} s is not after {start:?} s");
            return self.wrong(&format!("{}.to", at.0), message);
        }
        Some(Drive::Wave(Wave {
            shape: match profile {
                "cosine" => HarmonicShape::Cosine,
                _ => HarmonicShape::Sine,
            },
            mean: mean?,
            amplitude: amplitude?,
            frequency: frequency?,
            phase: phase?,
            from,
            to,
        }))
    }

    fn frequency(&mut self, at: SignalPlace<'_>) -> Option<Frequency> {
        let (path, node) = at;
        match (node.at("frequency").is_some(), node.at("angular_frequency").is_some()) {
            (true, true) => {
                let message = "the frequency is given twice, with frequency: keep either frequency, in Hz, or \
                               angular_frequency, in rad/s";
                self.wrong(&format!("{path}.angular_frequency"), message)
            }
            (false, true) => self.element(at, "angular_frequency", None).map(Frequency::Angular),
            (true, false) => self.element(at, "frequency", None).map(Frequency::Cycles),
            (false, false) => {
                let message = "missing: how fast the signal is; write frequency = a number in Hz or \"50 Hz\", or \
                               angular_frequency = a number in rad/s";
                self.wrong(&format!("{path}.frequency"), message)
            }
        }
    }

    fn sweep(&mut self, at: SignalPlace<'_>) -> Option<Frequency> {
        let start = self.element(at, "start_frequency", None);
        let end = self.element(at, "end_frequency", None);
        let duration = self.element(at, "duration", None)?;
        if duration < SHORTEST_RUN {
            return self.wrong(&format!("{}.duration", at.0), below_shortest(duration));
        }
        Some(Frequency::Sweep {
            start: start?,
            end: end?,
            duration,
        })
    }

    fn sum(&mut self, (path, node): SignalPlace<'_>, depth: usize) -> Option<Drive> {
        let path = format!("{path}.{SIGNALS}");
        match node.at(SIGNALS).map(|node| &node.value) {
            Some(CaseValue::Array(elements)) if !elements.is_empty() => {
                let elements = elements.iter().enumerate();
                let terms: Vec<Option<Drive>> = elements
                    .map(|(index, element)| self.drive(&format!("{path}.{index}"), element, depth + 1))
                    .collect();
                terms.into_iter().collect::<Option<Vec<Drive>>>().map(Drive::Sum)
            }
            None | Some(CaseValue::Array(_)) => {
                self.wrong(&path, "missing: the signals that are added; write signals = [ ... ]")
            }
            Some(other) => self.wrong(
                &path,
                format!("expected an array of signals, but got {}", other.describe()),
            ),
        }
    }
}

fn foreign_key(name: &str, profile: &str) -> String {
    let own = keys_of(profile);
    let owners = PROFILES.iter().copied().filter(|other| keys_of(other).contains(&name));
    let owners: Vec<&str> = owners.collect();
    if !owners.is_empty() {
        return format!(
            "belongs to profile \"{}\", but the profile is \"{profile}\": remove it, or change the profile",
            owners.join("\" or \"")
        );
    }
    match suggest(name, own.iter().copied().chain(["profile"])) {
        Some(close) => format!("unknown key; did you mean {close}?"),
        None => format!("unknown key; a signal of profile \"{profile}\" has {}", own.join(", ")),
    }
}
