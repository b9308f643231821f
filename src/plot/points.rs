//! The page of a study or a continuation: columns of values, a value for each point, and how points are drawn and run.

use super::figure::{Axis, Curve};
use super::html::{Codes, Doubles};
use serde::Serialize;

/// Upper limit of a page's size, bytes: 20,000 points with all quantities of a brake.
pub(super) const SIZE_LIMIT: usize = 8_000_000;

/// Base64 letters of a double.
pub(super) const LETTERS: usize = 11;

/// Digits of values whose tolerance is unknown.
pub(super) const USUAL_DIGITS: usize = 9;

/// What a column is for: a parameter, which is exact; a quantity to draw; a text, which the pointer reads or only the
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
    /// Whether the points form a grid.
    pub(super) grid: bool,
    /// Colours from the lowest to the highest value.
    pub(super) scale: Vec<String>,
    /// Codes of the points: 0 complete, 1 failed, 2 missing. `None`: all are complete.
    pub(super) status: Option<Codes>,
    /// Number and message of each failed point.
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
