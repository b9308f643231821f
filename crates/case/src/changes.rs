//! What distinguishes one case from another, in words: differences between two texts, and overrides with their units.

use super::document::{self, CaseValue, Override, PlacedValue};
use super::quantity::Dimension;
use super::schema::Domain;
use super::{Case, CaseSource, Words, quantity, value, written};
use std::collections::{BTreeSet, HashMap};
use std::fmt;

/// A key with its values in two texts; `None` where a text does not set it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OtherSetting {
    /// Dotted path of the key.
    pub key: String,
    /// Value in the earlier text, with its unit.
    pub there: Option<String>,
    /// Value in the later text, with its unit.
    pub here: Option<String>,
}

impl fmt::Display for OtherSetting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let OtherSetting { key, there, here } = self;
        match (there, here) {
            (Some(there), Some(here)) => write!(f, "{key} = {there} there, {here} here"),
            (Some(there), None) => write!(f, "{key} = {there} there, not set here"),
            (None, Some(here)) => write!(f, "{key} = {here} here, not set there"),
            (None, None) => f.write_str(key),
        }
    }
}

/// Bounds the time that a run may take, and has no effect on its results.
const WITHOUT_EFFECT: &str = "solver.max_wall_time";

/// Keys whose values differ between two texts of cases or studies, in the order of `here`, then those that only
/// `there` has. A text that is not TOML has no keys. Units are those of the case `here`.
pub fn differences(there: &str, here: &str) -> Vec<OtherSetting> {
    if there == here {
        return Vec::new();
    }
    let words = Words::of(&CaseSource::text(here), &[]);
    let [before, after] = [there, here].map(|text| {
        let mut leaves = Vec::new();
        if let Ok(root) = document::read(text, "") {
            flatten(&root, "", &mut leaves);
        }
        leaves
    });
    let [before_by_key, after_by_key] = [&before, &after].map(|leaves| by_key(leaves));
    let mut seen = BTreeSet::new();
    let keys = after.iter().chain(&before).map(|(key, _)| key);
    keys.filter(|key| *key != WITHOUT_EFFECT && seen.insert(*key))
        .filter_map(|key| {
            let values = [&before_by_key, &after_by_key].map(|leaves| leaves.get(key.as_str()).copied());
            let numbers = values.map(|value| value.and_then(|value| number(key, value, words)));
            let [there, here] = values.map(|value| value.map(|value| in_words(key, value, words)));
            let is_same = match numbers {
                [Some(there), Some(here)] => there == here,
                _ => there == here,
            };
            (!is_same).then(|| OtherSetting {
                key: key.clone(),
                there,
                here,
            })
        })
        .collect()
}

/// A table of a signal may have many thousand leaves.
fn by_key(leaves: &[(String, CaseValue)]) -> HashMap<&str, &CaseValue> {
    leaves.iter().map(|(key, value)| (key.as_str(), value)).collect()
}

fn flatten(node: &PlacedValue, path: &str, leaves: &mut Vec<(String, CaseValue)>) {
    let within = |key: &str| match path {
        "" => key.to_owned(),
        path => format!("{path}.{key}"),
    };
    match &node.value {
        CaseValue::Table(entries) => entries
            .iter()
            .for_each(|(key, child)| flatten(child, &within(key), leaves)),
        CaseValue::Array(elements) if !elements.is_empty() => elements
            .iter()
            .enumerate()
            .for_each(|(index, child)| flatten(child, &within(&index.to_string()), leaves)),
        value => leaves.push((path.to_owned(), value.clone())),
    }
}

/// Overrides of a case in words, the last one of each key: `friction.decay = 4 s/rad`. Each is an argument of `--set`.
/// `settings` apply before them. The limit of the wall time, which has no effect on results, is left out, and so is an
/// override without which the case is the same.
pub fn changed(source: &CaseSource, settings: &[Override], overrides: &[Override]) -> Vec<String> {
    // The words are read from the whole text.
    if overrides.is_empty() {
        return Vec::new();
    }
    let all = [settings, overrides].concat();
    let words = Words::of(source, &all);
    let is_last =
        |(at, change): &(usize, &Override)| overrides[at + 1..].iter().all(|later| later.key() != change.key());
    let last = overrides.iter().enumerate().filter(is_last);
    let last = last.filter(|(_, change)| change.key() != WITHOUT_EFFECT);
    let case_of = |overrides: &[Override]| Case::read(source, overrides).map(|case| case.resolved()).ok();
    let whole = case_of(&all);
    let is_effective = |key: &str| {
        let others = overrides.iter().filter(|other| other.key() != key);
        let others: Vec<Override> = settings.iter().chain(others).cloned().collect();
        whole.is_none() || case_of(&others) != whole
    };
    last.filter(|(_, change)| is_effective(change.key()))
        .map(|(_, change)| {
            let key = change.key();
            format!("{key} = {}", in_words(key, change.set_value(), words))
        })
        .collect()
}

/// Overrides in one line, such as `changed: friction.decay = 4 s/rad`.
pub fn changed_line(changed: &[String]) -> String {
    format!("changed: {}", changed.join(", "))
}

/// A number in SI, also one that is written with a unit.
fn number(key: &str, value: &CaseValue, words: Words) -> Option<f64> {
    let dimension = written::dimension(key, words).unwrap_or(Dimension::Number);
    value::number(value, dimension, Domain::Any).ok()
}

/// A value with the unit of its key, if it is a number; a text without its quotes, with one blank before its unit.
fn in_words(key: &str, value: &CaseValue, words: Words) -> String {
    if let CaseValue::Text(text) = value {
        return match written::dimension(key, words) {
            Some(_) => quantity::spaced(text),
            None => text.clone(),
        };
    }
    let Some(number) = number(key, value, words) else {
        return value.toml();
    };
    let unit = written::dimension(key, words).map_or("", |dimension| dimension.unit());
    match unit {
        "" | "1" => plain(number),
        unit => format!("{} {unit}", plain(number)),
    }
}

/// The shortest decimal of a number: 4, 0.25, 1e-12.
fn plain(number: f64) -> String {
    match number.abs() {
        0.0 | 1e-4..1e15 => number.to_string(),
        _ => format!("{number:e}"),
    }
}
