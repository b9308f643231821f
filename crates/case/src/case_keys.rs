//! Keys that the cases of a study have, one value for each, and messages about unknown keys.

use super::document::{self, CaseValue, PlacedValue};
use super::quantity::Dimension;
use super::schema::{self, Domain, Key, KeyKind};
use super::value::{PROFILES, keys_of, measure, single};
use super::{Case, CaseSource, Motion, Override, Words, suggest};
use serde::{Deserialize, Serialize};
use stickslip_system::quote::shown;
use stickslip_system::signal::SIGNALS;

/// The keys that the cases of a study have, including their lists and signals.
#[derive(Debug)]
pub struct CaseKeys {
    /// Names and units of the base case.
    pub words: Words,
    /// The resolved case in the general form, whose lists and signals decide on indices; `None` if it cannot be read.
    resolved: Option<PlacedValue>,
}

impl CaseKeys {
    /// Keys of the short form.
    pub const SHORT: CaseKeys = CaseKeys {
        words: Words::SHORT,
        resolved: None,
    };

    /// The keys of a base case with the settings of a study. The base case alone decides the form.
    pub fn of(base: &CaseSource, settings: &[Override]) -> CaseKeys {
        if Words::of(base, &[]).short {
            return CaseKeys::SHORT;
        }
        let case = Case::read(base, settings).ok();
        let words = case.as_ref().map(|case| case.words);
        CaseKeys {
            words: words.unwrap_or_else(|| Words::of(base, settings)),
            resolved: case.and_then(|case| document::read(&case.resolved(), "").ok()),
        }
    }

    /// The type of value at a path; `None` if no case of this form has such a key.
    pub fn slot(&self, path: &str) -> Option<Slot> {
        Slot::at(path, self.words)
    }

    /// Reason why this case has no value at a path that other cases of its form may have: an index beyond the list, a
    /// list without an index, or a key that the case's signal lacks.
    pub fn misplaced(&self, path: &str) -> Option<String> {
        if !self.words.short && path == "motion" {
            return Some("what is kept of the runs has one unit: make one study for each motion".to_owned());
        }
        let root = self.resolved.as_ref()?;
        let (key, _, inner) = schema::find(path, false).next()?;
        match key.kind {
            KeyKind::List(..) => in_list(root, key.path, inner),
            KeyKind::Signal(_) => in_signal(root, key.path, inner),
            _ => None,
        }
    }

    /// The paths of all keys, with `[]` for indices.
    pub fn known(&self) -> Vec<&'static str> {
        schema::known(self.words.short)
    }

    /// The known path that an unknown one most likely means.
    pub fn suggestion(&self, path: &str) -> Option<String> {
        let found = schema::find(path, self.words.short).find(|found| matches!(found.0.kind, KeyKind::Signal(_)));
        if let (Some(_), Some((before, last))) = (found, path.rsplit_once('.')) {
            let known = PROFILES.iter().flat_map(|profile| keys_of(profile));
            if let Some(close) = suggest(last, known) {
                return Some(format!("{before}.{close}"));
            }
        }
        let close = suggest(path, self.known().into_iter())?;
        let last = path.rsplit('.').next().unwrap_or_default();
        Some(match last.parse::<usize>() {
            Ok(index) if schema::is_list(close) => format!("{close}.{index}"),
            _ => close.replace("[]", ".0"),
        })
    }

    /// Whether a value at this path replaces a whole signal, alone or as a term of a sum.
    pub fn is_whole(&self, path: &str) -> bool {
        schema::find(path, self.words.short).any(|(key, _, inner)| {
            let mut parts = inner.split('.').filter(|part| !part.is_empty());
            matches!(key.kind, KeyKind::Signal(_)) && parts.all(|part| part == SIGNALS || part.parse::<usize>().is_ok())
        })
    }

    /// Message about a path that is no key of a case.
    pub fn unknown(&self, path: &str) -> String {
        let quoted = shown(path);
        if let Some(message) = of_other_form(path, self.words.short) {
            return format!("\"{quoted}\" {message}");
        }
        if let Some(close) = self.suggestion(path) {
            return format!("a case has no key \"{quoted}\"; did you mean {close}?");
        }
        match self.words.short {
            true => format!(
                "a case has no key \"{quoted}\"; its keys are dotted paths, such as friction.decay, torsion.damping or \
                 perturbation.0.relative_velocity"
            ),
            false => format!(
                "a case of trains has no key \"{quoted}\"; its keys are dotted paths, such as stator.damping.0, rotor.speed, \
                 rotor.speed.amplitude of a harmonic, contact.normal_force, friction.breakaway or initial.stator_twist.0"
            ),
        }
    }
}

/// Message about a key that only the other form has. It names the key's counterpart in this form.
pub(super) fn of_other_form(path: &str, short: bool) -> Option<String> {
    schema::find(path, !short)
        .next()
        .filter(|_| schema::find(path, short).next().is_none())?;
    let other = match short {
        true => "is a key of a case of trains, [rotor] and [stator], but the case is of the short form, [torsion]",
        false => "is a key of the short form, [torsion], but the case has [rotor] and [stator] instead",
    };
    let inside = |rest: &str| rest.is_empty() || rest.starts_with('.');
    let within = |general: &&str| general.strip_prefix(path).is_some_and(inside);
    let same = schema::SAME
        .iter()
        .filter(|same| same.0 == path || same.1.iter().any(&within));
    let own: Vec<&str> = match short {
        true => same.map(|same| same.0).collect(),
        false => same.flat_map(|same| same.1).copied().collect(),
    };
    Some(match own.is_empty() {
        true => other.to_owned(),
        false => format!("{other}; write {}", own.join(" and ")),
    })
}

fn in_list(root: &PlacedValue, list: &str, index: &str) -> Option<String> {
    let count = match root.at(list).map(|node| &node.value) {
        Some(CaseValue::Array(elements)) => elements.len(),
        _ => 0,
    };
    let elements = schema::elements(list, count);
    match index.parse::<usize>() {
        Ok(index) if index < count => None,
        Ok(_) => Some(format!("there is no {list}.{index}: {elements}")),
        // A number may replace a list with one element.
        Err(_) if count == 1 => None,
        Err(_) => Some(format!("{list} is a list, and an axis varies one number: {elements}")),
    }
}

fn in_signal(root: &PlacedValue, signal: &str, rest: &str) -> Option<String> {
    if rest.is_empty() {
        return None;
    }
    let mut at = signal.to_owned();
    let mut parts = rest.split('.').peekable();
    while let Some(part) = parts.next() {
        let node = root.at(&at);
        let profile = node.and_then(|node| node.at("profile")).map(|node| &node.value);
        match (node.map(|node| &node.value), profile) {
            (None, _) => {
                return Some(format!(
                    "this case has no {at}; give it one in [set], such as {at} = {{ profile = \"sine\", ... }}"
                ));
            }
            (Some(CaseValue::Array(_)), _) => return in_list(root, &at, part),
            (Some(CaseValue::Table(_)), Some(CaseValue::Text(profile))) => {
                let own = keys_of(profile);
                if part != "profile" && !own.contains(&part) {
                    let close = suggest(part, own.iter().copied());
                    return Some(format!(
                        "{at} is of profile \"{profile}\" in this case, which has {}{}",
                        own.join(", "),
                        close.map_or(String::new(), |close| format!("; did you mean {at}.{close}?"))
                    ));
                }
                at = format!("{at}.{part}");
                if part == SIGNALS
                    && let Some(index) = parts.next()
                {
                    if let Some(why) = in_list(root, &at, index) {
                        return Some(why);
                    }
                    at = format!("{at}.{index}");
                }
            }
            _ => {
                return Some(format!(
                    "{at} is a number in this case and has no {part}: vary {at} itself, or give it a profile in [set]"
                ));
            }
        }
    }
    match root.at(&at).map(|node| &node.value) {
        Some(CaseValue::Array(_)) => in_list(root, &at, ""),
        _ => None,
    }
}

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
    key: Key,
    motion: Motion,
}

impl Slot {
    fn at(path: &str, words: Words) -> Option<Slot> {
        let (key, _, inner) = schema::find(path, words.short).next()?;
        // Both chains have the same keys, and only the rotor's have descriptions.
        let rotor = key.path.strip_prefix("stator.").map(|name| format!("rotor.{name}"));
        let about = rotor.and_then(|path| schema::find(&path, false).next().map(|found| found.0));
        let mut slot = Slot {
            description: about.unwrap_or(key).description,
            key: *key,
            motion: words.motion(),
        };
        match key.kind {
            KeyKind::Signal(dimension) if !inner.is_empty() => {
                slot.key.kind = of_signal(inner, dimension, words.motion())?;
                // The dimension is that of the motion already.
                slot.motion = Motion::Rotation;
            }
            KeyKind::List(..) if !inner.is_empty() && inner.parse::<usize>().is_err() => return None,
            _ => {}
        }
        Some(slot)
    }

    /// Dimension of the number; `None` for other types.
    pub fn dimension(&self) -> Option<Dimension> {
        self.key.dimension().map(|dimension| self.motion.dimension(dimension))
    }

    /// SI unit of the number, `1` for a plain one; `None` for words and switches.
    pub fn unit(&self) -> Option<&'static str> {
        self.dimension().map(Dimension::unit)
    }

    /// Reads one value, and checks it without the rest of the case.
    pub fn read(&self, value: &CaseValue) -> Result<Setting, String> {
        single(&self.key, value, self.motion)
    }
}

/// The kind of value at a path in a signal.
fn of_signal(path: &str, dimension: Dimension, motion: Motion) -> Option<KeyKind> {
    let mut parts = path.split('.');
    let mut name = parts.next()?;
    while name == SIGNALS {
        parts.next()?.parse::<usize>().ok()?;
        // The path ends at a term of a sum, which can be a constant.
        name = match parts.next() {
            Some(name) => name,
            None => return Some(KeyKind::Number(motion.dimension(dimension), Domain::Any)),
        };
    }
    let rest: Vec<&str> = parts.collect();
    if name == "profile" && rest.is_empty() {
        return Some(KeyKind::Word(|| PROFILES.to_vec()));
    }
    let known = PROFILES.iter().any(|profile| keys_of(profile).contains(&name));
    let in_list = matches!(name, "time" | "value") && rest.len() == 1 && rest[0].parse::<usize>().is_ok();
    let (dimension, domain) = measure(name, dimension, motion);
    (known && (rest.is_empty() || in_list)).then_some(KeyKind::Number(dimension, domain))
}
