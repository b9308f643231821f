//! What is drawn, as data: figures of panels of curves, in SI units. How it is drawn is another file's subject.

use crate::model::Mode;
use crate::record::EventKind;
use plotters::style::RGBColor;

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
    /// Words at a point (x, y) of the panel, in the curves' units.
    pub labels: Vec<((f64, f64), String)>,
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
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// In the legend; empty: not there.
    pub label: String,
    /// Of line and markers.
    pub color: RGBColor,
    /// Line or markers.
    pub style: CurveStyle,
    /// Pieces of (x, y), each drawn without a gap.
    pub pieces: Vec<Vec<(f64, f64)>>,
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
    /// Filled circles.
    Points,
    /// Open circles.
    OpenPoints,
}

impl Curve {
    /// A line through all of `points`.
    pub fn line(label: &str, color: RGBColor, points: Vec<(f64, f64)>) -> Curve {
        Curve {
            label: label.to_owned(),
            color,
            style: CurveStyle::Solid,
            pieces: vec![points],
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
        Axis {
            logarithmic: true,
            ..self
        }
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
            labels: Vec::new(),
        }
    }

    /// Least and largest x or y of the curves that are finite; (0, 1) where there are none.
    pub(super) fn extent(&self, coordinate: impl Fn((f64, f64)) -> f64) -> (f64, f64) {
        let (low, high) = self
            .curves
            .iter()
            .flat_map(Curve::points)
            .map(coordinate)
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        if low <= high { (low, high) } else { (0.0, 1.0) }
    }
}

impl Figure {
    /// The title, with the paper's number where it is known.
    pub fn full_title(&self) -> String {
        match self.paper_figure {
            Some(number) => format!("{} (paper, Fig. {number})", self.title),
            None => self.title.clone(),
        }
    }
}
