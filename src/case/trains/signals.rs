//! A signal from its value in a case: a number, or a table with a profile.

use super::keys::PROFILES;
use super::reader::SystemReader;
use crate::case::Motion;
use crate::case::conditions::{self, SHORTEST_RUN};
use crate::case::document::{Node, Value};
use crate::case::quantity::{self, Dimension};
use crate::case::schema::Domain;
use crate::case::suggest;
use crate::case::value::{choice, number};
use crate::signal::{Drive, Frequency, Ramp, SIGNALS, Shape, Signal, Table, Timeline, Wave};

/// Sums of sums of sums: a slip of the pen.
const DEEPEST: usize = 4;

/// The keys of a profile besides `profile`.
pub(super) fn keys_of(profile: &str) -> &'static [&'static str] {
    const WAVE: &[&str] = &[
        "mean",
        "amplitude",
        "frequency",
        "angular_frequency",
        "phase",
        "from",
        "to",
    ];
    match profile {
        "ramp" => &["value", "rise_time"],
        "table" => &["time", "value"],
        "sum" => &[SIGNALS],
        _ => WAVE,
    }
}

/// The dimension of a number of a signal, by the last part of its path, if that of the signal is `dimension`; whether it is one
/// of the coordinates of the case, which [`Motion`] changes.
pub(in crate::case) fn dimension_of(path: &str, dimension: Dimension, motion: Motion) -> Dimension {
    let name = path
        .rsplit('.')
        .find(|part| part.parse::<usize>().is_err())
        .unwrap_or("");
    match name {
        "rise_time" | "time" | "from" | "to" => Dimension::Time,
        "frequency" => Dimension::Frequency,
        "angular_frequency" => Dimension::AngularVelocity,
        "phase" => Dimension::Angle,
        _ => motion.dimension(dimension),
    }
}

/// The limits of a number of a signal, by its key.
pub(super) fn domain_of(name: &str) -> Domain {
    match name {
        "rise_time" | "from" | "to" => Domain::NotNegative,
        "frequency" | "angular_frequency" => Domain::Positive,
        _ => Domain::Any,
    }
}

impl SystemReader<'_> {
    /// The signal at `path`, which is there; `None` if it is wrong.
    pub(super) fn signal(&mut self, path: &str, dimension: Dimension) -> Option<Drive> {
        let node = self.reader.root.at(path)?.clone();
        let drive = self.drive(path, &node, dimension, 0)?;
        let timeline = Timeline::new(&[&drive]);
        let finite = |stretch: usize| {
            let start = timeline.start(stretch);
            timeline.value(0, stretch, start).is_finite() && timeline.slope(0, stretch, start).is_finite()
        };
        if drive.largest().is_finite() && (0..=timeline.corners().len()).all(finite) {
            Some(drive)
        } else {
            self.wrong(
                path,
                "its values or slopes are outside the range of double precision: make it smaller or slower",
            )
        }
    }

    fn drive(&mut self, path: &str, node: &Node, dimension: Dimension, depth: usize) -> Option<Drive> {
        let entries = match &node.value {
            Value::Table(entries) => entries,
            Value::Array(_) => {
                let expected = quantity::expectation(self.motion.dimension(dimension));
                let message = format!(
                    "expected {expected}, or a table with a profile, such as {{ profile = \"table\", time = [...], value = \
                     [...] }}, but got an array"
                );
                return self.wrong(path, message);
            }
            value => {
                let read = number(value, self.motion.dimension(dimension), Domain::Any);
                return match read {
                    Ok(value) => Some(Drive::Value(value)),
                    Err(message) => self.wrong(path, message),
                };
            }
        };
        if depth > DEEPEST {
            return self.wrong(
                path,
                format!("sums within sums, more than {DEEPEST} deep: write one sum of all"),
            );
        }
        let Some(profile) = node.at("profile") else {
            let message = format!(
                "missing: what the signal is; write profile = \"{}\", or a number instead of the table",
                PROFILES.join("\" or \"")
            );
            return self.wrong(&format!("{path}.profile"), message);
        };
        let profile = match choice(&profile.value, PROFILES) {
            Ok(profile) => profile,
            Err(message) => return self.wrong(&format!("{path}.profile"), message),
        };
        let before = self.reader.problems.len();
        for (name, _) in entries {
            if name != "profile" && !keys_of(profile).contains(&name.as_str()) {
                let segment = toml_edit::Key::new(name).to_string();
                self.reader
                    .report(&format!("{path}.{segment}"), foreign_key(name, profile));
            }
        }
        let drive = match profile {
            "ramp" => self.ramp(path, node, dimension),
            "table" => self.table(path, node, dimension),
            "sum" => self.sum(path, node, dimension, depth),
            "sine" => self.wave(Shape::Sine, path, node, dimension),
            _ => self.wave(Shape::Cosine, path, node, dimension),
        };
        drive.filter(|_| self.reader.problems.len() == before)
    }

    fn wrong<T>(&mut self, path: &str, message: impl Into<String>) -> Option<T> {
        self.reader.report(path, message);
        None
    }

    /// The number of a key in a signal; `None` if it is wrong, or there is none and no default.
    fn element(
        &mut self,
        (path, node): (&str, &Node),
        name: &str,
        dimension: Dimension,
        default: Option<f64>,
    ) -> Option<f64> {
        let path = format!("{path}.{name}");
        let (dimension, domain) = (dimension_of(name, dimension, self.motion), domain_of(name));
        match (node.at(name), default) {
            (Some(node), _) => match number(&node.value, dimension, domain) {
                Ok(number) => Some(number),
                Err(message) => self.wrong(&path, message),
            },
            (None, Some(default)) => Some(default),
            (None, None) => {
                let message = format!(
                    "missing; write {name} = a number in {} or \"{}\"",
                    dimension.unit(),
                    dimension.example()
                );
                self.wrong(&path, message)
            }
        }
    }

    fn ramp(&mut self, path: &str, node: &Node, dimension: Dimension) -> Option<Drive> {
        let at = (path, node);
        let value = self.element(at, "value", dimension, None);
        let rise_time = self.element(at, "rise_time", dimension, None)?;
        if rise_time > 0.0 && rise_time < SHORTEST_RUN {
            let message = format!("must be 0 (a step) or at least {SHORTEST_RUN:?} s, but is {rise_time:?} s");
            return self.wrong(&format!("{path}.rise_time"), message);
        }
        value.map(|value| Drive::Linear(Signal::Ramp(Ramp { value, rise_time })))
    }

    fn table(&mut self, path: &str, node: &Node, dimension: Dimension) -> Option<Drive> {
        let lists = ["time", "value"].map(|name| {
            let path = format!("{path}.{name}");
            let dimension = dimension_of(name, dimension, self.motion);
            match node.at(name).map(|node| node.value.clone()) {
                Some(Value::Array(elements)) => self.numbers(&path, &elements, dimension, Domain::Any),
                Some(other) => self.wrong(
                    &path,
                    format!("expected an array of numbers, but got {}", other.describe()),
                ),
                None => {
                    let message = format!("missing; write {name} = [...], numbers in {}", dimension.unit());
                    self.wrong(&path, message)
                }
            }
        });
        let [Some(time), Some(value)] = lists else {
            return None;
        };
        let mut found = Vec::new();
        let [time_path, value_path] = ["time", "value"].map(|name| format!("{path}.{name}"));
        conditions::points(
            &time_path,
            &time,
            (&value_path, "values", value.len()),
            &mut |path, with, message| found.push(conditions::Violation::new(path, with, message)),
        );
        if !found.is_empty() {
            found
                .into_iter()
                .for_each(|violation| self.reader.report_violation(violation));
            return None;
        }
        Some(Drive::Linear(Signal::Table(Table { time, value })))
    }

    fn wave(&mut self, shape: Shape, path: &str, node: &Node, dimension: Dimension) -> Option<Drive> {
        let at = (path, node);
        let mean = self.element(at, "mean", dimension, Some(0.0));
        let amplitude = self.element(at, "amplitude", dimension, None);
        let mut frequency = |name: &'static str| self.element(at, name, dimension, None);
        let frequency = match (node.at("frequency").is_some(), node.at("angular_frequency").is_some()) {
            (true, true) => {
                let message = "the frequency is given twice, with frequency: keep either frequency, in Hz, or \
                               angular_frequency, in rad/s";
                self.wrong(&format!("{path}.angular_frequency"), message)
            }
            (false, true) => frequency("angular_frequency").map(Frequency::Angular),
            (true, false) => frequency("frequency").map(Frequency::Cycles),
            (false, false) => {
                let message = "missing: how fast the signal is; write frequency = a number in Hz or \"50 Hz\", or \
                               angular_frequency = a number in rad/s";
                self.wrong(&format!("{path}.frequency"), message)
            }
        };
        let phase = self.element(at, "phase", dimension, Some(0.0));
        let mut time = |name: &str| match node.at(name) {
            Some(_) => self.element(at, name, dimension, None).map(Some),
            None => Some(None),
        };
        let (from, to) = (time("from")?, time("to")?);
        if let Some(to) = to
            && to <= from.unwrap_or(0.0)
        {
            let from = from.unwrap_or(0.0);
            let message = format!("must be after from: {to:?} s is not after {from:?} s");
            return self.wrong(&format!("{path}.to"), message);
        }
        Some(Drive::Wave(Wave {
            shape,
            mean: mean?,
            amplitude: amplitude?,
            frequency: frequency?,
            phase: phase?,
            from,
            to,
        }))
    }

    fn sum(&mut self, path: &str, node: &Node, dimension: Dimension, depth: usize) -> Option<Drive> {
        let path = format!("{path}.{SIGNALS}");
        let elements = match node.at(SIGNALS).map(|node| &node.value) {
            Some(Value::Array(elements)) if !elements.is_empty() => elements,
            Some(other) if !matches!(other, Value::Array(_)) => {
                return self.wrong(
                    &path,
                    format!("expected an array of signals, but got {}", other.describe()),
                );
            }
            _ => return self.wrong(&path, "missing: the signals that are added; write signals = [ ... ]"),
        };
        let terms: Vec<Option<Drive>> = (elements.iter().enumerate())
            .map(|(index, element)| self.drive(&format!("{path}.{index}"), element, dimension, depth + 1))
            .collect();
        terms.into_iter().collect::<Option<Vec<Drive>>>().map(Drive::Sum)
    }
}

/// What to say about a key that the profile does not have.
fn foreign_key(name: &str, profile: &str) -> String {
    let own = keys_of(profile);
    let owners: Vec<&str> = PROFILES
        .iter()
        .copied()
        .filter(|other| keys_of(other).contains(&name))
        .collect();
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
