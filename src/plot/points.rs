//! The page of a study or a continuation: columns of values, a value for each point, and how points are drawn and run.

use super::figure::{Axis, Curve};
use super::html::{Codes, Doubles};
use serde::Serialize;

/// Upper limit of a page's size, bytes: 20,000 points with all quantities of a brake.
pub(super) const SIZE_LIMIT: usize = 8_000_000;

/// Base64 letters of a double.
pub(super) const LETTERS: usize = 11;

/// Least and largest number of digits of a computed value.
const DIGITS: (usize, usize) = (4, 15);

/// Digits of values whose tolerance is unknown.
pub(super) const USUAL_DIGITS: usize = 9;

/// A column: a value of each point; NaN: none.
#[derive(Serialize)]
pub(super) struct PointColumn {
    pub(super) name: String,
    pub(super) label: String,
    pub(super) symbol: String,
    /// UDUNITS.
    pub(super) units: String,
    pub(super) about: String,
    /// Codes and their meanings, if the values are codes.
    pub(super) words: Vec<(i64, String)>,
    pub(super) logarithmic: bool,
    /// Whether it is a parameter of the study.
    pub(super) axis: bool,
    /// Whether it can be drawn, not only listed.
    pub(super) drawn: bool,
    /// Whether the pointer reads it as well.
    pub(super) brief: bool,
    /// Significant digits; `None`: exact.
    pub(super) digits: Option<usize>,
    /// Value of each point, or the lower one of two.
    pub(super) low: Doubles,
    pub(super) high: Option<Doubles>,
    /// Imaginary part.
    pub(super) imaginary: Option<Doubles>,
}

impl PointColumn {
    /// A column to be listed, with the words of an axis.
    pub(super) fn new(name: &str, axis: &Axis, about: &str, low: Doubles) -> PointColumn {
        PointColumn {
            name: name.to_owned(),
            label: axis.name.clone(),
            symbol: axis.symbol.clone(),
            units: axis.unit.clone(),
            about: about.to_owned(),
            words: Vec::new(),
            logarithmic: false,
            axis: false,
            drawn: false,
            brief: false,
            digits: Some(USUAL_DIGITS),
            low,
            high: None,
            imaginary: None,
        }
    }
}

/// A line through points.
#[derive(Serialize)]
pub(super) struct PointLine {
    pub(super) label: String,
    pub(super) color: String,
    pub(super) style: &'static str,
    /// Numbers of its points, piece by piece.
    pub(super) pieces: Vec<Vec<usize>>,
    /// Whether only the lower of two values is drawn.
    pub(super) once: bool,
}

/// Marks of special points by the code of a column.
#[derive(Serialize)]
pub(super) struct PointMarks {
    pub(super) column: usize,
    pub(super) kinds: Vec<PointMark>,
}

#[derive(Serialize)]
pub(super) struct PointMark {
    pub(super) name: &'static str,
    pub(super) colour: String,
    /// Outline in SVG's syntax, within some 6 pixels around (0, 0).
    pub(super) path: String,
    pub(super) filled: bool,
}

/// Curves in the plane of two columns.
#[derive(Serialize)]
pub(super) struct Overlay {
    /// Name of the horizontal column.
    pub(super) x: String,
    pub(super) y: String,
    pub(super) curves: Vec<Curve>,
    pub(super) labels: Vec<((f64, f64), String)>,
}

/// A command that computes points.
#[derive(Serialize)]
pub(super) struct PointCommand {
    pub(super) start: String,
    pub(super) words: Vec<CommandWord>,
    pub(super) hint: &'static str,
}

/// An option with its argument: a text before a value, the value, a text after it.
#[derive(Serialize)]
pub(super) struct CommandWord {
    pub(super) option: &'static str,
    pub(super) before: String,
    pub(super) value: Option<WordValue>,
    pub(super) after: &'static str,
    /// A column, and those of its codes with which the option stands.
    pub(super) only: Option<(usize, Vec<usize>)>,
}

/// A value in a command.
#[derive(Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum WordValue {
    /// Number of the point, or of the point in its group.
    Point,
    /// Number of the group.
    Group,
    /// Value of this column.
    #[serde(untagged)]
    Column(usize),
}

impl CommandWord {
    pub(super) fn new(option: &'static str, before: impl Into<String>, value: Option<WordValue>) -> CommandWord {
        CommandWord {
            option,
            before: before.into(),
            value,
            after: "",
            only: None,
        }
    }
}

#[derive(Serialize)]
pub(super) struct PointsContent<'a> {
    pub(super) count: usize,
    pub(super) columns: Vec<PointColumn>,
    /// Columns shown first: x, y, and colour.
    pub(super) first: [Option<usize>; 3],
    /// Whether the points form a grid.
    pub(super) grid: bool,
    /// Colours from the lowest to the highest value.
    pub(super) scale: Vec<String>,
    /// Codes of the points: 0 complete, 1 failed, 2 missing. `None`: all are complete.
    pub(super) status: Option<Codes>,
    /// Number and message of each failed point.
    pub(super) failures: &'a [(u64, String)],
    pub(super) lines: Vec<PointLine>,
    pub(super) marks: Option<PointMarks>,
    /// Number of the first point of each group.
    pub(super) groups: Vec<usize>,
    pub(super) overlays: Vec<Overlay>,
    pub(super) commands: Vec<PointCommand>,
    /// Command of each point; -1: none. `None`: the first.
    pub(super) which: Option<Codes>,
    pub(super) hint: &'static str,
}

/// The digits that a relative tolerance leaves.
pub(super) fn digits_of(rtol: f64) -> usize {
    (-rtol.log10()).ceil().clamp(DIGITS.0 as f64, DIGITS.1 as f64) as usize
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
