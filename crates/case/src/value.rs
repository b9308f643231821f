//! Reads one value by the rules of its key: unit, limits, choices.

use super::conditions::Violation;
use super::document::{CaseValue, PlacedValue};
use super::place::INSTABILITY;
use super::quantity::{self, Dimension};
use super::schema::{Domain, Key, KeyKind, METHOD};
use super::{Motion, Setting, suggest};
use stickslip_engine::simulation::Method;
use stickslip_system::quote::shown;

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

pub(super) fn choice(value: &CaseValue, names: &[&'static str]) -> Result<&'static str, String> {
    let listed = || match names {
        [only] => format!("\"{only}\""),
        _ => format!("one of \"{}\"", names.join("\", \"")),
    };
    let CaseValue::Text(text) = value else {
        return Err(format!("expected {}, but got {}", listed(), value.describe()));
    };
    names.iter().find(|name| *name == text).copied().ok_or_else(|| {
        let hint = suggest(text, names.iter().copied()).map(|close| format!("; did you mean \"{close}\"?"));
        format!(
            "expected {}, but got \"{text}\"{}",
            listed(),
            hint.unwrap_or_default(),
            text = shown(text)
        )
    })
}
