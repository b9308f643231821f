//! Figures as data: panels with curves in SI units. `draw` draws them.

use super::style::RGBColor;
use serde::{Serialize, Serializer};
use stickslip_system::model::Mode;
use stickslip_system::record::EventKind;

/// A figure: panels one below the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// File name without extension.
    pub name: String,
    /// Title above the panels.
    pub title: String,
    /// Number in the paper; `None` if it is not in the paper.
    pub paper_figure: Option<u32>,
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
}

/// A pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves in drawing order.
    pub curves: Vec<Curve>,
    /// Background coloured by mode: (from x, to x, mode).
    pub modes: Vec<(f64, f64, Mode)>,
    /// Marked events: (x, kind).
    pub events: Vec<(f64, EventKind)>,
    /// Name of the signal whose corners are among the events.
    pub driven_by: &'static str,
    /// The run whose modes and events are shown, if there are several; else empty.
    pub shown_of: String,
    /// Whether the height equals the width, as in a phase portrait.
    pub square: bool,
    /// Caption above the panel, which distinguishes panels that differ in a value; may be empty.
    pub caption: String,
    /// Areas below the curves: error bands, or bars of a histogram.
    pub areas: Vec<Area>,
    /// Colour map below everything else.
    pub map: Option<Map>,
    /// Words at points (x, y), in the units of the curves.
    pub labels: Vec<((f64, f64), String)>,
}

/// Translucent area between two lines over the same x.
#[derive(Debug, Clone, PartialEq)]
pub struct Area {
    /// Label in the legend; may be empty.
    pub label: String,
    /// Fill colour.
    pub color: RGBColor,
    /// Pieces of (x, lower y, upper y).
    pub pieces: Vec<Vec<(f64, f64, f64)>>,
}

/// Rectangular cells coloured by value.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Edges of the columns, in the unit of the x axis: number of columns + 1.
    pub x_edges: Vec<f64>,
    /// Edges of the rows, in the unit of the y axis: number of rows + 1.
    pub y_edges: Vec<f64>,
    /// Cells row by row, starting at the lowest x and y.
    pub cells: Vec<Cell>,
    /// Meaning of the colours.
    pub key: ColorKey,
}

/// Cell of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell {
    /// The cell has this value or code.
    Value(f64),
    /// The run has no such quantity.
    Nothing,
    /// The run failed.
    Failed,
    /// The run is missing.
    Missing,
}

/// Meaning of a map's colours.
#[derive(Debug, Clone, PartialEq)]
pub enum ColorKey {
    /// A colour scale over the range of this axis, which must be set.
    Scale(Axis),
    /// A colour for each (code, word), in this order.
    Codes(Vec<(i64, String)>),
}

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name of the quantity, without unit.
    pub name: String,
    /// Symbol, which follows the name, or stands alone if space is short; may be empty.
    pub symbol: String,
    /// Unit in the notation of UDUNITS; "1" for a pure number.
    pub unit: String,
    /// Least and largest value, in `unit`. `None` means the range of the curves plus a margin.
    pub range: Option<(f64, f64)>,
    /// Whether the axis is logarithmic, and shows positive values only.
    pub logarithmic: bool,
}

/// A line or set of points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    /// Legend label; empty: none.
    pub label: String,
    /// Colour of line and markers.
    #[serde(serialize_with = "as_name")]
    pub color: RGBColor,
    /// Style.
    #[serde(serialize_with = "in_a_word")]
    pub style: CurveStyle,
    /// Unbroken pieces of (x, y).
    pub pieces: Vec<Vec<(f64, f64)>>,
}

pub(super) fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn as_name<S: Serializer>(color: &RGBColor, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&super::style::name(*color))
}

fn in_a_word<S: Serializer>(style: &CurveStyle, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(style.name())
}

/// Style of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveStyle {
    /// A line.
    Solid,
    /// A thin line, which does not hide a line below it.
    Thin,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// Filled circles.
    Points,
    /// Open circles.
    OpenPoints,
    /// Small filled circles, for many points.
    Dots,
    /// Marks of this shape.
    Marks(MarkShape),
}

/// Shape of a mark, recognisable without colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MarkShape {
    /// In tenths of the radius, with y downwards; empty for a circle. A cross has two lines.
    corners: &'static [(i8, i8)],
    pub(super) filled: bool,
    pub(super) cross: bool,
}

/// Smallest drawn error or uncertainty of a time, s, about the spacing of doubles. Zero has no logarithm.
pub(super) const LEAST_ERROR: f64 = 1e-16;
/// Name of marks below [`LEAST_ERROR`].
pub(super) const BELOW_LEAST_ERROR: &str = "below 10⁻¹⁶ s";

/// A triangle on its tip, at the floor of a logarithmic axis: the value is below.
pub(super) const TIP_DOWN: MarkShape = MarkShape::open(&[(0, 12), (11, -8), (-11, -8)]);

impl MarkShape {
    pub(super) const fn open(corners: &'static [(i8, i8)]) -> MarkShape {
        MarkShape {
            corners,
            filled: false,
            cross: false,
        }
    }

    pub(super) const fn filled(self) -> MarkShape {
        MarkShape { filled: true, ..self }
    }

    pub(super) const fn crossed(self) -> MarkShape {
        MarkShape { cross: true, ..self }
    }

    /// Corners for a radius; none for a circle.
    pub(super) fn corners(self, radius: f64) -> impl ExactSizeIterator<Item = (f64, f64)> {
        let place = move |tenths: i8| f64::from(tenths) / 10.0 * radius;
        self.corners.iter().map(move |&(x, y)| (place(x), place(y)))
    }
}

impl CurveStyle {
    pub(super) fn name(self) -> &'static str {
        match self {
            CurveStyle::Solid => "solid",
            CurveStyle::Thin => "thin",
            CurveStyle::Dashed => "dashed",
            CurveStyle::Dotted => "dotted",
            CurveStyle::Points | CurveStyle::Dots | CurveStyle::Marks(_) => "points",
            CurveStyle::OpenPoints => "open",
        }
    }

    /// Lengths of a dash and a gap, drawing units; `None` for unbroken lines and for points.
    pub(super) fn dash(self) -> Option<[u32; 2]> {
        match self {
            CurveStyle::Dashed => Some([90, 60]),
            CurveStyle::Dotted => Some([24, 56]),
            _ => None,
        }
    }

    pub(super) fn is_line(self) -> bool {
        use CurveStyle::{Dashed, Dotted, Solid, Thin};
        matches!(self, Solid | Thin | Dashed | Dotted)
    }

    pub(super) fn of_many(count: usize, limit: usize, few: CurveStyle) -> CurveStyle {
        if count > limit { CurveStyle::Dots } else { few }
    }
}

impl Area {
    pub(super) fn unnamed(color: RGBColor, pieces: Vec<Vec<(f64, f64, f64)>>) -> Area {
        let label = String::new();
        Area { label, color, pieces }
    }

    /// All points of both lines.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let both = |&(x, low, high): &(f64, f64, f64)| [(x, low), (x, high)];
        self.pieces.iter().flatten().flat_map(both)
    }
}

impl Curve {
    /// A line through `points`.
    pub fn line(label: &str, color: RGBColor, points: Vec<(f64, f64)>) -> Curve {
        Curve::pieces(label, color, vec![points])
    }

    pub(super) fn dashed(label: &str, color: RGBColor, points: Vec<(f64, f64)>) -> Curve {
        Curve::line(label, color, points).styled(CurveStyle::Dashed)
    }

    pub(super) fn filled(label: &str, color: RGBColor, points: Vec<(f64, f64)>) -> Curve {
        Curve::line(label, color, points).styled(CurveStyle::Points)
    }

    pub(super) fn open(label: &str, color: RGBColor, points: Vec<(f64, f64)>) -> Curve {
        Curve::line(label, color, points).styled(CurveStyle::OpenPoints)
    }

    pub(crate) fn pieces(label: &str, color: RGBColor, pieces: Vec<Vec<(f64, f64)>>) -> Curve {
        Curve {
            label: label.to_owned(),
            color,
            style: CurveStyle::Solid,
            pieces,
        }
    }

    pub(crate) fn styled(self, style: CurveStyle) -> Curve {
        Curve { style, ..self }
    }

    /// All points.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.pieces.iter().flatten().copied()
    }
}

impl Axis {
    /// An axis that is scaled to its curves.
    pub fn new(name: &str, unit: &str) -> Axis {
        Axis {
            name: name.to_owned(),
            symbol: String::new(),
            unit: unit.to_owned(),
            range: None,
            logarithmic: false,
        }
    }

    /// Adds a symbol.
    pub fn with_symbol(self, symbol: &str) -> Axis {
        Axis {
            symbol: symbol.to_owned(),
            ..self
        }
    }

    /// Name and symbol.
    pub fn label(&self) -> String {
        format!("{} {}", self.name, self.symbol).trim().to_owned()
    }

    /// The symbol, or the name if there is no symbol.
    pub fn short(&self) -> &str {
        if self.symbol.is_empty() {
            &self.name
        } else {
            &self.symbol
        }
    }

    pub(crate) fn by_powers(self) -> Axis {
        self.logarithmic(true)
    }

    pub(crate) fn logarithmic(self, logarithmic: bool) -> Axis {
        Axis { logarithmic, ..self }
    }

    pub(crate) fn ranging(self, low: f64, high: f64) -> Axis {
        Axis {
            range: Some((low, high)),
            ..self
        }
    }
}

impl Panel {
    /// A pair of axes with curves.
    pub fn new(x: Axis, y: Axis, curves: Vec<Curve>) -> Panel {
        Panel {
            x,
            y,
            curves,
            modes: Vec::new(),
            events: Vec::new(),
            driven_by: "F(t)",
            shown_of: String::new(),
            square: false,
            caption: String::new(),
            areas: Vec::new(),
            map: None,
            labels: Vec::new(),
        }
    }

    pub(super) fn captioned(self, caption: impl Into<String>) -> Panel {
        let caption = caption.into();
        Panel { caption, ..self }
    }

    /// Range of the finite x or y of the curves; (0, 1) if there are none.
    pub(super) fn extent(&self, coordinate: impl Fn((f64, f64)) -> f64) -> (f64, f64) {
        let of_curves = self.curves.iter().flat_map(Curve::points);
        let of_areas = self.areas.iter().flat_map(Area::points);
        extent(of_curves.chain(of_areas).map(coordinate)).unwrap_or((0.0, 1.0))
    }
}

/// Curves with at least one point. The others are not in the legend.
pub(super) fn drawn(curves: impl IntoIterator<Item = Curve>) -> Vec<Curve> {
    curves
        .into_iter()
        .filter(|curve| curve.points().next().is_some())
        .collect()
}

pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(None, |found, value| {
        let (low, high) = found.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    })
}

impl Figure {
    /// A figure that is not in the paper.
    pub fn new(name: impl Into<String>, title: impl Into<String>, panels: Vec<Panel>) -> Figure {
        Figure {
            name: name.into(),
            title: title.into(),
            paper_figure: None,
            panels,
        }
    }

    /// The title, including the number in the paper if there is one.
    pub fn full_title(&self) -> String {
        match self.paper_figure {
            Some(number) => format!("{} (paper, Fig. {number})", self.title),
            None => self.title.clone(),
        }
    }
}
