//! A case as TOML in SI, at full precision.

use std::fmt::Write;

use toml_edit::Value;

use super::Motion;
use super::draft::Draft;
use super::schema::{self, ARRAYS, Key, Kind};
use crate::model::KickTime;

/// Every value of the short form, in the order of the schema.
pub(super) fn write(draft: &Draft) -> String {
    let all = Only {
        wanted: |_| true,
        motion: Motion::Rotation,
    };
    keys(draft, all)
}

/// Which keys are written, by their paths, and what their numbers measure.
#[derive(Clone, Copy)]
pub(super) struct Only {
    pub(super) wanted: fn(&str) -> bool,
    pub(super) motion: Motion,
}

/// The values of some keys of the case, in the order of the schema.
pub(super) fn keys(case: &Draft, only: Only) -> String {
    let mut text = String::new();
    let mut heading = String::new();
    let wanted = || schema::keys().iter().filter(move |key| (only.wanted)(key.path));
    for key in wanted().filter(|key| schema::array_of(key).is_none()) {
        let (table, name) = key.path.split_once('.').unwrap_or(("", key.path));
        if let Some(value) = value(case, key, 0) {
            if table != heading {
                heading = table.to_owned();
                text.push_str(&format!("\n[{table}]\n"));
            }
            line(&mut text, key, only.motion, name, &value);
        }
    }
    let array_wanted =
        |path: &str| wanted().any(|key| schema::array_of(key).is_some_and(|(array, _)| array.path == path));
    for array in ARRAYS.iter().filter(|array| array_wanted(array.path)) {
        for index in 0..(array.length)(case) {
            text.push_str(&format!("\n[[{}]]\n", array.path));
            for key in wanted() {
                let Some((of, name)) = schema::array_of(key) else {
                    continue;
                };
                if of.path != array.path {
                    continue;
                }
                if let Some(value) = value(case, key, index) {
                    line(&mut text, key, only.motion, name, &value);
                }
            }
        }
    }
    text
}

/// A `String` takes whatever is written to it.
fn line(text: &mut String, key: &Key, motion: Motion, name: &str, value: &str) {
    let unit = key
        .dimension()
        .map(|dimension| motion.dimension(dimension).unit())
        .filter(|&unit| unit != "1")
        .map(|unit| format!(" [{unit}]"))
        .unwrap_or_default();
    let _ = writeln!(text, "{name} = {value} # {}{unit}", key.description);
}

/// When a kick comes, as a value of TOML.
pub(super) fn moment(time: KickTime) -> String {
    match time {
        KickTime::At(time) => format!("{time:?}"),
        KickTime::Instability => Value::from(schema::INSTABILITY).to_string(),
    }
}

fn value(case: &Draft, key: &Key, index: usize) -> Option<String> {
    let text = |text: &str| Value::from(text).to_string();
    match &key.kind {
        Kind::Text(access) => (access.get)(case, index).map(|value| text(&value)),
        Kind::Flag(access) => (access.get)(case, index).map(|value| value.to_string()),
        Kind::Count(access) => (access.get)(case, index).map(|value| value.to_string()),
        Kind::Choice(_, access) => (access.get)(case, index).map(text),
        // Debug prints the shortest decimal that reads back as the same double.
        Kind::Number(_, _, access) => (access.get)(case, index).map(|value| format!("{value:?}")),
        Kind::Moment(access) => (access.get)(case, index).map(moment),
        Kind::Series(_, access) => (access.get)(case, index).map(|values| format!("{values:?}")),
        _ => None,
    }
}
