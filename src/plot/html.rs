//! Interactive pages: the document of all kinds, a template with places in double braces, escaped texts, arrays as base64.

use super::signature;
use crate::Error;
use crate::output::Output;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use std::path::Path;

/// Replaces the names of `parts` (name, text) in double braces; other braces stay.
fn filled(template: &str, parts: &[(&str, &str)]) -> String {
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

const TEMPLATE: &str = include_str!("../../data/page/page.html");
const STYLE: &str = include_str!("../../data/page/page.css");
const LIGHT: &str = include_str!("../../data/page/light.css");
const DARK: &str = include_str!("../../data/page/dark.css");

/// A style with the colours of all pages, light and dark.
pub(crate) fn styled(style: &str) -> String {
    filled(style, &[("light", LIGHT), ("dark", DARK)])
}

/// What is drawn on a page: its HTML, and its scripts in the order of their dependences.
pub(super) struct Assets {
    body: &'static str,
    scripts: &'static [&'static str],
}

const BASE: &str = include_str!("../../data/page/base.js");
const AXIS: &str = include_str!("../../data/page/axis.js");

/// A run, or two.
pub(super) const RUN: Assets = Assets {
    body: include_str!("../../data/page/run.html"),
    scripts: &[
        BASE,
        AXIS,
        include_str!("../../data/page/trajectory.js"),
        include_str!("../../data/page/chart.js"),
        include_str!("../../data/page/figures.js"),
        include_str!("../../data/page/lists.js"),
        include_str!("../../data/page/run.js"),
    ],
};

/// The points of a study or a continuation.
pub(super) const POINTS: Assets = Assets {
    body: include_str!("../../data/page/points.html"),
    scripts: &[BASE, AXIS, include_str!("../../data/page/points.js")],
};

/// An interactive page: one HTML file that works offline. The script of its kind draws the document.
#[derive(Debug, Serialize)]
pub(super) struct PageDocument<C> {
    pub(super) title: String,
    /// The files and their size.
    pub(super) subtitle: String,
    /// What is wrong with the file.
    pub(super) notice: Option<String>,
    #[serde(flatten)]
    pub(super) content: C,
}

impl<C: Serialize> PageDocument<C> {
    pub(super) fn html(&self, assets: &Assets) -> Result<String, Error> {
        let generator = format!("{} {}\">", signature::PAGE, env!("CARGO_PKG_VERSION"));
        let parts = [
            ("generator", &*generator),
            ("title", &escaped(&self.title)),
            ("style", &styled(STYLE)),
            ("main", assets.body),
            ("data", &json(self)?),
            ("script", &assets.scripts.concat()),
        ];
        Ok(filled(TEMPLATE, &parts))
    }

    /// Writes the page; returns its size, bytes.
    pub(super) fn write(&self, assets: &Assets, output: &Output) -> Result<u64, Error> {
        let page = self.html(assets)?;
        output.write(&[page.as_bytes()])?;
        Ok(page.len() as u64)
    }
}

/// A file's name without its folder.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A count with commas between thousands, and its noun: "1 branch", "13,507 samples".
pub(super) fn counted(count: usize, one: &str, many: &str) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    format!("{text} {}", if count == 1 { one } else { many })
}

/// JSON for a script element: no text can end the element, open a comment, or control a terminal.
fn json(value: &impl Serialize) -> Result<String, Error> {
    let text = serde_json::to_string(value).map_err(Error::drawing)?;
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
