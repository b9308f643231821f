//! Single values of the general form by their paths: what varies in a study.

use super::keys::{self, KEYS, PROFILES};
use super::signals::{self, dimension_of, keys_of};
use crate::case::document::{Node, Value};
use crate::case::quantity::Dimension;
use crate::case::schema::{self, Domain, Key, Kind};
use crate::case::setting::{Slot, Takes};
use crate::case::{Motion, key_of, suggest};
use crate::signal::SIGNALS;

/// The key of the general form that a path leads to or into, and what is left of the path.
fn key_at(path: &str) -> Option<(&'static Key, &str)> {
    KEYS.iter().find_map(|key| {
        if let Some((array, name)) = key.path.split_once("[].") {
            let (index, rest) = path.strip_prefix(array)?.strip_prefix('.')?.split_once('.')?;
            return (index.parse::<usize>().is_ok() && rest == name).then_some((key, ""));
        }
        match path.strip_prefix(key.path)? {
            "" => Some((key, "")),
            rest => rest.strip_prefix('.').map(|rest| (key, rest)),
        }
    })
}

/// What a path takes in the general form; `None` if there is no such key.
pub(in crate::case) fn slot(path: &str, motion: Motion) -> Option<Slot> {
    let Some((key, rest)) = key_at(path) else {
        return shared(path, motion);
    };
    let takes = match key.kind {
        _ if rest.is_empty() => Takes::Key(key, motion),
        Kind::List(..) if rest.parse::<usize>().is_ok() => Takes::Key(key, motion),
        Kind::Signal(dimension) => of_signal(rest, dimension, motion)?,
        _ => return None,
    };
    // Both chains have the same keys; what they mean is said of the rotor's.
    let about = match key.path.strip_prefix("stator.") {
        Some(name) => keys::find(&format!("rotor.{name}")),
        None => key,
    };
    Some(Slot {
        description: about.description,
        takes,
    })
}

/// A value inside a signal, at the rest of its path.
fn of_signal(path: &str, dimension: Dimension, motion: Motion) -> Option<Takes> {
    let mut parts = path.split('.');
    let mut name = parts.next()?;
    while name == SIGNALS {
        parts.next()?.parse::<usize>().ok()?;
        // A signal of a sum that is a number.
        name = match parts.next() {
            Some(name) => name,
            None => return Some(Takes::Number(motion.dimension(dimension), Domain::Any)),
        };
    }
    let rest: Vec<&str> = parts.collect();
    if name == "profile" && rest.is_empty() {
        return Some(Takes::Words(PROFILES));
    }
    let known = PROFILES.iter().any(|profile| keys_of(profile).contains(&name));
    let in_list = matches!(name, "time" | "value") && rest.len() == 1 && rest[0].parse::<usize>().is_ok();
    (known && (rest.is_empty() || in_list))
        .then(|| Takes::Number(dimension_of(name, dimension, motion), signals::domain_of(name)))
}

/// A key that the short form has as well.
fn shared(path: &str, motion: Motion) -> Option<Slot> {
    let key = key_of(path).filter(|key| keys::is_shared(key.path))?;
    let takes = match key.kind {
        _ if key.path == schema::FRICTION_LAW => Takes::Laws,
        Kind::Moment(_) => Takes::Number(Dimension::Time, Domain::NotNegative),
        _ => Takes::Key(key, motion),
    };
    Some(Slot {
        description: key.description,
        takes,
    })
}

/// Why the resolved case `root` has no single value at the path of a slot; `None` if it has, or may have.
pub(in crate::case) fn misplaced(root: &Node, path: &str) -> Option<String> {
    let (key, rest) = key_at(path)?;
    match key.kind {
        Kind::List(..) => in_list(root, key.path, rest),
        Kind::Signal(_) => in_signal(root, key.path, rest),
        _ => None,
    }
}

/// A list of the case, or of one of its signals: whether it has the element.
fn in_list(root: &Node, list: &str, index: &str) -> Option<String> {
    let count = match root.at(list).map(|node| &node.value) {
        Some(Value::Array(elements)) => elements.len(),
        _ => 0,
    };
    let elements = keys::elements(list, count);
    match index.parse::<usize>() {
        Ok(index) if index < count => None,
        Ok(_) => Some(format!("there is no {list}.{index}: {elements}")),
        // A number stands for a list of one.
        Err(_) if count == 1 => None,
        Err(_) => Some(format!("{list} is a list, and an axis varies one number: {elements}")),
    }
}

fn in_signal(root: &Node, signal: &str, rest: &str) -> Option<String> {
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
            (Some(Value::Array(_)), _) => return in_list(root, &at, part),
            (Some(Value::Table(_)), Some(Value::Text(profile))) => {
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
        Some(Value::Array(_)) => in_list(root, &at, ""),
        _ => None,
    }
}

/// The path into a signal that an unknown one most likely means.
pub(in crate::case) fn close_in_signal(path: &str) -> Option<String> {
    let (key, _) = key_at(path)?;
    let (before, last) = path.rsplit_once('.')?;
    let known = PROFILES.iter().flat_map(|profile| keys_of(profile).iter().copied());
    let close = suggest(last, known).filter(|_| matches!(key.kind, Kind::Signal(_)))?;
    Some(format!("{before}.{close}"))
}

/// Whether the path is that of a signal, or of one in a sum.
pub(in crate::case) fn is_signal(path: &str) -> bool {
    key_at(path).is_some_and(|(key, rest)| {
        let mut parts = rest.split('.').filter(|part| !part.is_empty());
        matches!(key.kind, Kind::Signal(_))
            && std::iter::from_fn(|| parts.next()).all(|part| part == SIGNALS || part.parse::<usize>().is_ok())
    })
}
