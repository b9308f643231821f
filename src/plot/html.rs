//! Pages in a single file: a template with names in double braces, escaped texts, a JSON document, arrays as base64.

use super::{PlotError, signature};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Serialize, Serializer};

/// Replaces the names of `parts` (name, text) in double braces. Other braces remain.
pub(super) fn filled(template: &str, parts: &[(&str, &str)]) -> String {
    let mut text = String::with_capacity(template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        text.push_str(before);
        let known = after.split_once("}}").and_then(|(name, after)| {
            let part = parts.iter().find(|part| part.0 == name)?;
            Some((part.1, after))
        });
        let (part, after) = known.unwrap_or(("{{", after));
        text.push_str(part);
        rest = after;
    }
    text.push_str(rest);
    text
}

pub(super) fn page(template: &str, title: &str, parts: &[(&str, &str)]) -> String {
    let generator = format!("{} {}\">", signature::PAGE, env!("CARGO_PKG_VERSION"));
    let title = escaped(title);
    filled(
        template,
        &[&[("generator", &*generator), ("title", &title)], parts].concat(),
    )
}

/// JSON for a script element, in which no text can end the element, open a comment, or control a terminal.
pub(super) fn json(value: &impl Serialize) -> Result<String, PlotError> {
    let text = serde_json::to_string(value).map_err(|error| PlotError::Drawing(error.to_string()))?;
    Ok(stickslip_system::quote::in_json(&text, |c| c == '<'))
}

/// Text for an HTML or SVG element. It has no control characters, which XML forbids and terminals obey.
pub(super) fn escaped(text: &str) -> String {
    stickslip_system::quote::for_terminal(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

pub(super) fn encoded(bytes: impl Iterator<Item = u8>) -> String {
    STANDARD.encode(bytes.collect::<Vec<u8>>())
}

/// Exact doubles: base64 of little-endian numbers.
#[derive(Debug, Default, Serialize)]
pub(super) struct Doubles(String);

impl FromIterator<f64> for Doubles {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        Doubles(encoded(values.into_iter().flat_map(f64::to_le_bytes)))
    }
}

#[derive(Debug, Serialize)]
pub(super) struct Codes(String);

impl FromIterator<i8> for Codes {
    fn from_iter<I: IntoIterator<Item = i8>>(values: I) -> Self {
        Codes(encoded(values.into_iter().map(i8::cast_unsigned)))
    }
}

pub(super) fn as_doubles<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    values.iter().copied().collect::<Doubles>().serialize(serializer)
}
