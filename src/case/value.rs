//! One value by the rules of its key: its unit, its limits, its choices.

use super::document::Value;
use super::quantity::{self, Dimension};
use super::schema::Domain;
use super::suggest;
use crate::quote::shown;

pub(super) fn number(value: &Value, dimension: Dimension, domain: Domain) -> Result<f64, String> {
    let number = match value {
        Value::Integer(number) => *number as f64,
        Value::Float(number) => *number,
        Value::Text(text) => quantity::parse(text, dimension)?,
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

/// The value as written, and in SI if it was written in another unit.
fn written(value: &Value, number: f64, dimension: Dimension) -> String {
    match value {
        Value::Text(text) => format!("\"{text}\", {number:?} {}", dimension.unit(), text = shown(text)),
        _ => format!("{number:?}"),
    }
}

pub(super) fn choice(value: &Value, names: &[&'static str]) -> Result<&'static str, String> {
    let listed = || match names {
        [only] => format!("\"{only}\""),
        _ => format!("one of \"{}\"", names.join("\", \"")),
    };
    let Value::Text(text) = value else {
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
