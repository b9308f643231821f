//! Pages of one file: a template with places in double braces, texts as content of elements, a document of JSON, arrays as texts.

use super::{PlotError, signature};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::{Serialize, Serializer};

/// A text with what stands for the names in double braces; other braces stay.
pub(super) fn filled(template: &str, part: impl Fn(&str) -> Option<String>) -> String {
    let mut text = String::with_capacity(template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        text.push_str(before);
        let known = after
            .split_once("}}")
            .and_then(|(name, after)| Some((part(name)?, after)));
        match known {
            Some((part, after)) => {
                text.push_str(&part);
                rest = after;
            }
            None => {
                text.push_str("{{");
                rest = after;
            }
        }
    }
    text.push_str(rest);
    text
}

/// What stands for `generator` in a template.
pub(super) fn generator() -> String {
    format!("{} {}\">", signature::PAGE, env!("CARGO_PKG_VERSION"))
}

/// JSON that can stand in a script element: no text in it ends the element or opens a comment, or would steer a terminal on
/// which the page is listed.
pub(super) fn json(value: &impl Serialize) -> Result<String, PlotError> {
    let text = serde_json::to_string(value).map_err(|error| PlotError::Drawing(error.to_string()))?;
    Ok(crate::quote::in_json(&text, |c| c == '<'))
}

/// A text as the content of an element of HTML or SVG. Control characters are none that XML allows, and would steer a terminal on
/// which the file is listed.
pub(super) fn escaped(text: &str) -> String {
    crate::quote::for_terminal(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Bytes as base64.
pub(super) fn encoded(bytes: impl Iterator<Item = u8>) -> String {
    STANDARD.encode(bytes.collect::<Vec<u8>>())
}

/// Doubles, exactly: base64 of little-endian numbers.
pub(super) fn doubles(values: &[f64]) -> String {
    encoded(values.iter().flat_map(|value| value.to_le_bytes()))
}

/// The same, for serde.
pub(super) fn as_doubles<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&doubles(values))
}
