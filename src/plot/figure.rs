//! What is drawn, as data: figures of panels of curves, in SI units. How it is drawn is another file's subject.

use crate::model::Mode;
use crate::record::EventKind;
use plotters::style::RGBColor;
use serde::{Serialize, Serializer};

/// One figure: panels below each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// File name without extension.
    pub name: String,
    /// Above the panels.
    pub title: String,
    /// Number in the paper, where it is known.
    pub paper_figure: Option<u32>,
    /// From top to bottom.
    pub panels: Vec<Panel>,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Horizontal.
    pub x: Axis,
    /// Vertical.
    pub y: Axis,
    /// Drawn in this order.
    pub curves: Vec<Curve>,
    /// Ground coloured by mode, over x; (from, to, mode).
    pub modes: Vec<(f64, f64, Mode)>,
    /// Events, over x.
    pub events: Vec<(f64, EventKind)>,
    /// What has the corners among the events.
    pub driven_by: &'static str,
    /// Equally high and wide, as for a phase portrait.
    pub square: bool,
    /// Above it, where several panels show the same for other values of something; may be empty.
    pub caption: String,
    /// Below the curves: error bands, bars of a histogram.
    pub areas: Vec<Area>,
    /// Below everything: a plane in colours.
    pub map: Option<Map>,
    /// Words at a point (x, y) of the panel, in the curves' units.
    pub labels: Vec<((f64, f64), String)>,
}

/// What lies between two lines over the same x, filled so that others show below it.
#[derive(Debug, Clone, PartialEq)]
pub struct Area {
    /// In the legend; empty: not there.
    pub label: String,
    /// Of the filling.
    pub color: RGBColor,
    /// Pieces of (x, lower y, upper y).
    pub pieces: Vec<Vec<(f64, f64, f64)>>,
}

/// Rectangular cells over a plane, each in the colour of its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Where the columns begin and end, in the unit of the horizontal axis: one more than there are columns.
    pub x_edges: Vec<f64>,
    /// The same of the rows.
    pub y_edges: Vec<f64>,
    /// Row after row, from the least y on; in a row from the least x on.
    pub cells: Vec<Cell>,
    /// What the colours mean.
    pub key: ColorKey,
}

/// What a cell of a map has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell {
    /// A value, or a code.
    Value(f64),
    /// The run has no such quantity.
    Nothing,
    /// The run failed.
    Failed,
    /// It has not been run.
    Missing,
}

/// What the colours of a map mean.
#[derive(Debug, Clone, PartialEq)]
pub enum ColorKey {
    /// A scale over the range of this axis, which is set.
    Scale(Axis),
    /// A colour for each code, in this order.
    Codes(Vec<(i64, String)>),
}

/// One axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What it shows, without unit.
    pub name: String,
    /// Its symbol, which stands after the name where there is room and alone where there is none; may be empty.
    pub symbol: String,
    /// UDUNITS, "1" for a pure number.
    pub unit: String,
    /// Least and largest value, in `unit`; `None`: that of the curves and a margin.
    pub range: Option<(f64, f64)>,
    /// Logarithmic: only values above zero are shown, by their powers of ten.
    pub logarithmic: bool,
}

/// One line or set of points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    /// In the legend; empty: not there.
    pub label: String,
    /// Of line and markers.
    #[serde(serialize_with = "as_hex")]
    pub color: RGBColor,
    /// Line or markers.
    #[serde(skip)]
    pub style: CurveStyle,
    /// Pieces of (x, y), each drawn without a gap.
    pub pieces: Vec<Vec<(f64, f64)>>,
}

/// A colour as HTML has it.
pub(super) fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn as_hex<S: Serializer>(color: &RGBColor, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&hex(*color))
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveStyle {
    /// A line.
    Solid,
    /// A line that lets another show below it.
    Thin,
    /// A broken line.
    Dashed,
    /// A line of dots.
    Dotted,
    /// Filled circles.
    Points,
    /// Open circles.
    OpenPoints,
    /// Small filled circles, for many.
    Dots,
    /// Marks of a shape.
    Marks(Shape),
}

/// A mark that its outline tells from the others, also without colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Filled.
    Disk,
    /// Filled.
    Square,
    /// Filled.
    Triangle,
    /// Filled.
    Diamond,
    /// Two lines across each other.
    Cross,
    /// An upright cross.
    Plus,
    /// Open.
    Circle,
    /// Open.
    Box,
    /// Open, upright.
    Tent,
    /// Open, upside down.
    Funnel,
    /// Open.
    Kite,
    /// Open, lying on its left.
    Pennant,
    /// Open.
    Hexagon,
}

impl Shape {
    /// Its corners over its radius, y downwards; `None` of a circle. Of crosses two lines.
    pub(super) fn corners(self) -> Option<&'static [(f64, f64)]> {
        Some(match self {
            Shape::Disk | Shape::Circle => return None,
            Shape::Square | Shape::Box => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
            Shape::Triangle | Shape::Tent => &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)],
            Shape::Funnel => &[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)],
            Shape::Diamond | Shape::Kite => &[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)],
            Shape::Pennant => &[(-0.8, -1.1), (1.2, 0.0), (-0.8, 1.1)],
            Shape::Hexagon => &[
                (-0.6, -1.0),
                (0.6, -1.0),
                (1.2, 0.0),
                (0.6, 1.0),
                (-0.6, 1.0),
                (-1.2, 0.0),
            ],
            Shape::Cross => &[(-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)],
            Shape::Plus => &[(-1.3, 0.0), (1.3, 0.0), (0.0, -1.3), (0.0, 1.3)],
        })
    }

    /// Whether it consists of lines alone.
    pub(super) fn is_cross(self) -> bool {
        matches!(self, Shape::Cross | Shape::Plus)
    }

    /// Whether it is filled.
    pub(super) fn is_filled(self) -> bool {
        matches!(self, Shape::Disk | Shape::Square | Shape::Triangle | Shape::Diamond)
    }
}

impl CurveStyle {
    /// Whether it joins its points.
    pub(super) fn is_line(self) -> bool {
        use CurveStyle::{Dashed, Dotted, Solid, Thin};
        matches!(self, Solid | Thin | Dashed | Dotted)
    }

    /// Of that many points: `few` up to a limit, dots beyond it.
    pub(super) fn of_many(count: usize, limit: usize, few: CurveStyle) -> CurveStyle {
        if count > limit { CurveStyle::Dots } else { few }
    }
}

impl Area {
    /// An area that the legend leaves out.
    pub(super) fn unnamed(color: RGBColor, pieces: Vec<Vec<(f64, f64, f64)>>) -> Area {
        let label = String::new();
        Area { label, color, pieces }
    }

    /// All points of both of its lines.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let both = |&(x, low, high): &(f64, f64, f64)| [(x, low), (x, high)];
        self.pieces.iter().flatten().flat_map(both)
    }
}

impl Curve {
    /// A line through all of `points`.
    pub fn line(label: &str, color: RGBColor, points: Vec<(f64, f64)>) -> Curve {
        Curve::pieces(label, color, vec![points])
    }

    /// A line for each of `pieces`.
    pub(crate) fn pieces(label: &str, color: RGBColor, pieces: Vec<Vec<(f64, f64)>>) -> Curve {
        Curve {
            label: label.to_owned(),
            color,
            style: CurveStyle::Solid,
            pieces,
        }
    }

    /// The same in another style.
    pub(crate) fn styled(self, style: CurveStyle) -> Curve {
        Curve { style, ..self }
    }

    /// All its points.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.pieces.iter().flatten().copied()
    }
}

impl Axis {
    /// An axis that fits its curves.
    pub fn new(name: &str, unit: &str) -> Axis {
        Axis {
            name: name.to_owned(),
            symbol: String::new(),
            unit: unit.to_owned(),
            range: None,
            logarithmic: false,
        }
    }

    /// With a symbol.
    pub fn with_symbol(self, symbol: &str) -> Axis {
        Axis {
            symbol: symbol.to_owned(),
            ..self
        }
    }

    /// Its name and symbol.
    pub fn label(&self) -> String {
        format!("{} {}", self.name, self.symbol).trim().to_owned()
    }

    /// Its symbol, or its name if it has none.
    pub fn short(&self) -> &str {
        if self.symbol.is_empty() {
            &self.name
        } else {
            &self.symbol
        }
    }

    /// With powers of ten.
    pub(crate) fn by_powers(self) -> Axis {
        self.logarithmic(true)
    }

    /// With powers of ten, or evenly.
    pub(crate) fn logarithmic(self, logarithmic: bool) -> Axis {
        Axis { logarithmic, ..self }
    }

    /// With a fixed range.
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
            square: false,
            caption: String::new(),
            areas: Vec::new(),
            map: None,
            labels: Vec::new(),
        }
    }

    /// Least and largest x or y of the curves that are finite; (0, 1) where there are none.
    pub(super) fn extent(&self, coordinate: impl Fn((f64, f64)) -> f64) -> (f64, f64) {
        let of_curves = self.curves.iter().flat_map(Curve::points);
        let of_areas = self.areas.iter().flat_map(Area::points);
        extent(of_curves.chain(of_areas).map(coordinate)).unwrap_or((0.0, 1.0))
    }
}

/// The curves that have a point: the others have no place in a legend.
pub(super) fn drawn(curves: impl IntoIterator<Item = Curve>) -> Vec<Curve> {
    curves
        .into_iter()
        .filter(|curve| curve.points().next().is_some())
        .collect()
}

/// Least and largest of the values that are finite; `None` without any.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(None, |found, value| {
        let (low, high) = found.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    })
}

impl Figure {
    /// A figure that is not the paper's.
    pub fn new(name: impl Into<String>, title: impl Into<String>, panels: Vec<Panel>) -> Figure {
        Figure {
            name: name.into(),
            title: title.into(),
            paper_figure: None,
            panels,
        }
    }

    /// The title, with the paper's number where it is known.
    pub fn full_title(&self) -> String {
        match self.paper_figure {
            Some(number) => format!("{} (paper, Fig. {number})", self.title),
            None => self.title.clone(),
        }
    }
}
