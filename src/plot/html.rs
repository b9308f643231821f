//! Interactive pages: the document of all kinds, a template with places in double braces, escaped texts, arrays as base64; the page of
//! a study or a continuation: columns of values, and how points are drawn and run.

use super::figure::{Axis, Curve};
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

/// HTML of a page, and its scripts in the order of their dependences.
pub(super) struct Assets {
    body: &'static str,
    scripts: &'static [&'static str],
}

const BASE: &str = include_str!("../../data/page/base.js");
const AXIS: &str = include_str!("../../data/page/axis.js");

pub(super) const RUN: Assets = Assets {
    body: include_str!("../../data/page/run.html"),
    scripts: &[
        BASE,
        AXIS,
        include_str!("../../data/page/trajectory.js"),
        include_str!("../../data/page/chart.js"),
        include_str!("../../data/page/overview.js"),
        include_str!("../../data/page/figures.js"),
        include_str!("../../data/page/lists.js"),
        include_str!("../../data/page/run.js"),
    ],
};

pub(super) const POINTS: Assets = Assets {
    body: include_str!("../../data/page/points.html"),
    scripts: &[BASE, AXIS, include_str!("../../data/page/points.js")],
};

/// An interactive page: one HTML file that works offline. The script of its kind draws the document.
#[derive(Debug, Serialize)]
pub(super) struct PageDocument<C> {
    pub(super) title: String,
    pub(super) subtitle: String,
    pub(super) notice: Option<String>,
    #[serde(flatten)]
    pub(super) content: C,
}

impl<C: Serialize> PageDocument<C> {
    /// `source`: names of the files, for the signature.
    pub(super) fn html(&self, assets: &Assets, source: &str) -> Result<String, Error> {
        let generator = format!("{} {}{source}\">", signature::PAGE, env!("CARGO_PKG_VERSION"));
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
        let page = self.html(assets, output.source())?;
        output.write(&[page.as_bytes()])?;
        Ok(page.len() as u64)
    }
}

pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Overrides of a case, as the end of a line: `; changed: friction.decay = 4 s/rad`; empty without any.
pub(super) fn changed(lines: &[String]) -> String {
    match lines {
        [] => String::new(),
        lines => format!("; {}", stickslip_case::changed_line(lines)),
    }
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
pub(crate) fn escaped(text: &str) -> String {
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

/// Upper limit of a page's size, bytes: 20,000 points with all quantities of a brake.
pub(super) const SIZE_LIMIT: usize = 8_000_000;

/// Base64 letters of a double.
pub(super) const LETTERS: usize = 11;

/// Digits of values whose tolerance is unknown.
pub(super) const USUAL_DIGITS: usize = 9;

/// Purpose of a column: a parameter, which is exact; a quantity to draw; a text, which the pointer reads or only the
/// list has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ColumnRole {
    Axis,
    Value,
    Brief,
    #[default]
    Text,
}

/// A column: a value of each point; NaN: none.
#[derive(Default, Serialize)]
pub(super) struct PointColumn {
    pub(super) role: ColumnRole,
    pub(super) name: String,
    pub(super) label: String,
    pub(super) symbol: String,
    /// UDUNITS.
    pub(super) units: String,
    pub(super) about: String,
    /// Codes and their meanings, if the values are codes.
    pub(super) words: Vec<(i64, String)>,
    /// Colour of each code from 0; empty: from the scale. Points of lower codes are drawn above the others.
    pub(super) colours: Vec<String>,
    pub(super) logarithmic: bool,
    /// Significant digits; `None`: exact.
    pub(super) digits: Option<usize>,
    /// Value of each point, or the lower one of two.
    pub(super) low: Doubles,
    pub(super) high: Option<Doubles>,
    pub(super) imaginary: Option<Doubles>,
}

impl PointColumn {
    pub(super) fn new(role: ColumnRole, name: &str, axis: Axis, about: &str, low: Doubles) -> PointColumn {
        PointColumn {
            role,
            name: name.to_owned(),
            label: axis.name,
            symbol: axis.symbol,
            units: axis.unit,
            about: about.to_owned(),
            digits: (role != ColumnRole::Axis).then_some(USUAL_DIGITS),
            low,
            ..PointColumn::default()
        }
    }
}

/// A line through points, piece by piece. `once`: of two values of a point only the lower one is drawn.
#[derive(Serialize)]
pub(super) struct PointLine {
    pub(super) label: String,
    pub(super) color: String,
    pub(super) style: &'static str,
    pub(super) pieces: Vec<Vec<usize>>,
    pub(super) once: bool,
}

/// The mark of a kind of special point. `path`: outline in SVG's syntax, within some 6 pixels around (0, 0).
#[derive(Serialize)]
pub(super) struct PointMark {
    pub(super) name: &'static str,
    pub(super) colour: String,
    pub(super) path: String,
    pub(super) filled: bool,
}

/// Curves and words in the plane of two columns, `x` and `y` by name.
#[derive(Serialize)]
pub(super) struct Overlay {
    pub(super) x: String,
    pub(super) y: String,
    pub(super) curves: Vec<Curve>,
    pub(super) labels: Vec<((f64, f64), String)>,
    /// Whether the curves frame what the page opens on.
    pub(super) region: bool,
}

/// A column, and some of its codes.
type ColumnCodes = (usize, Vec<usize>);

/// A command that computes points. After `start`, each option with its argument, in which {3} stands for the value in
/// column 3, {point} and {group} for the numbers of point and group; with a column and codes, the option is for these.
#[derive(Serialize)]
pub(super) struct PointCommand {
    pub(super) start: String,
    pub(super) options: Vec<(String, Option<ColumnCodes>)>,
    pub(super) hint: &'static str,
}

#[derive(Default, Serialize)]
pub(super) struct PointsContent<'a> {
    pub(super) count: usize,
    pub(super) columns: Vec<PointColumn>,
    /// Columns shown first: x, y, and colour.
    pub(super) first: [Option<usize>; 3],
    pub(super) grid: bool,
    pub(super) scale: Vec<String>,
    /// Codes of the points: 0 complete, 1 failed, 2 missing. `None`: all are complete.
    pub(super) status: Option<Codes>,
    pub(super) failures: &'a [(u64, String)],
    pub(super) lines: Vec<PointLine>,
    /// A column, and the marks of its codes.
    pub(super) marks: Option<(usize, Vec<PointMark>)>,
    /// Number of the first point of each group.
    pub(super) groups: Vec<usize>,
    pub(super) overlays: Vec<Overlay>,
    pub(super) commands: Vec<PointCommand>,
    /// Command of each point; -1: none. `None`: the first.
    pub(super) which: Option<Codes>,
    pub(super) hint: &'static str,
}

/// Size of the written page of a study or a continuation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct PointsPage {
    /// Number of points.
    pub points: usize,
    /// Number of branches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub branches: Option<usize>,
    /// Number of quantities per point.
    pub quantities: usize,
    /// Size, bytes.
    pub bytes: u64,
}
