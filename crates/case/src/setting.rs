//! One value for one key, checked on its own, as on the axis of a study.

use super::document::{CaseValue, Override};
use super::quantity::Dimension;
use super::schema::{self, Domain, Key, KeyKind};
use super::signals::{self, PROFILES};
use super::value::{choice, number, single};
use super::{Motion, Words};
use serde::{Deserialize, Serialize};
use stickslip_system::signal::SIGNALS;

/// One value for a key. A number is in the key's SI unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Setting {
    /// A number in SI.
    Number(f64),
    /// A whole number, 0 or more.
    Count(usize),
    /// True or false.
    Flag(bool),
    /// A name or a text.
    Text(String),
}

impl Setting {
    /// The value of a number or a count; `None` for a flag or a text.
    pub fn as_number(&self) -> Option<f64> {
        match self {
            Setting::Number(number) => Some(*number),
            Setting::Count(count) => Some(*count as f64),
            Setting::Flag(_) | Setting::Text(_) => None,
        }
    }

    /// The value as text, for messages and codes.
    pub fn word(&self) -> String {
        match self {
            Setting::Number(number) => format!("{number:?}"),
            Setting::Count(count) => count.to_string(),
            Setting::Flag(flag) => flag.to_string(),
            Setting::Text(text) => text.clone(),
        }
    }
}

impl Override {
    /// Sets a key to one value of an axis.
    pub fn setting(path: &str, value: &Setting) -> Override {
        let value = match value {
            Setting::Number(number) => CaseValue::Float(*number),
            Setting::Count(count) => CaseValue::Integer(i64::try_from(*count).unwrap_or(i64::MAX)),
            Setting::Flag(flag) => CaseValue::Flag(*flag),
            Setting::Text(text) => CaseValue::Text(text.clone()),
        };
        Override::value(path, value)
    }
}

/// The type of value at a concrete path of a case.
#[derive(Debug, Clone, Copy)]
pub struct Slot {
    /// One line about the key.
    pub description: &'static str,
    takes: Takes,
}

#[derive(Debug, Clone, Copy)]
enum Takes {
    Key(&'static Key, Motion),
    Number(Dimension, Domain),
    Profile,
}

impl Slot {
    pub(super) fn at(path: &str, words: Words) -> Option<Slot> {
        let (key, _, inner) = schema::find(path, words.short).next()?;
        let takes = match key.kind {
            KeyKind::Signal(dimension) if !inner.is_empty() => of_signal(inner, dimension, words.motion())?,
            KeyKind::List(..) if !inner.is_empty() && inner.parse::<usize>().is_err() => return None,
            _ => Takes::Key(key, words.motion()),
        };
        // Both chains have the same keys, and only the rotor's have descriptions.
        let rotor = key.path.strip_prefix("stator.").map(|name| format!("rotor.{name}"));
        let about = rotor.and_then(|path| schema::find(&path, false).next().map(|found| found.0));
        Some(Slot {
            description: about.unwrap_or(key).description,
            takes,
        })
    }

    /// Dimension of the number; `None` for other types.
    pub fn dimension(&self) -> Option<Dimension> {
        match self.takes {
            Takes::Key(key, motion) => key.dimension().map(|dimension| motion.dimension(dimension)),
            Takes::Number(dimension, _) => Some(dimension),
            Takes::Profile => None,
        }
    }

    /// SI unit of the number, `1` for a plain one; `None` for words and switches.
    pub fn unit(&self) -> Option<&'static str> {
        self.dimension().map(Dimension::unit)
    }

    /// Reads one value, and checks it without the rest of the case.
    pub fn read(&self, value: &CaseValue) -> Result<Setting, String> {
        match self.takes {
            Takes::Key(key, motion) => single(key, value, motion),
            Takes::Number(dimension, domain) => number(value, dimension, domain).map(Setting::Number),
            Takes::Profile => choice(value, PROFILES).map(|name| Setting::Text(name.to_owned())),
        }
    }
}

fn of_signal(path: &str, dimension: Dimension, motion: Motion) -> Option<Takes> {
    let mut parts = path.split('.');
    let mut name = parts.next()?;
    while name == SIGNALS {
        parts.next()?.parse::<usize>().ok()?;
        // The path ends at a term of a sum, which can be a constant.
        name = match parts.next() {
            Some(name) => name,
            None => return Some(Takes::Number(motion.dimension(dimension), Domain::Any)),
        };
    }
    let rest: Vec<&str> = parts.collect();
    if name == "profile" && rest.is_empty() {
        return Some(Takes::Profile);
    }
    let known = PROFILES.iter().any(|profile| signals::keys_of(profile).contains(&name));
    let in_list = matches!(name, "time" | "value") && rest.len() == 1 && rest[0].parse::<usize>().is_ok();
    let (dimension, domain) = signals::measure(name, dimension, motion);
    let takes = Takes::Number(dimension, domain);
    (known && (rest.is_empty() || in_list)).then_some(takes)
}
