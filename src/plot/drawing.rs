//! A figure as lines, areas and texts, from which all formats are written.
//!
//! Coordinates and lengths are in drawing units from the upper left corner. Lines have butt ends and round joins.

use super::figure::{Cell, CurveStyle, MarkShape};
use super::style::*;
use super::text;
use stickslip_system::quote;
use tiny_skia::{Path, PathBuilder, Rect, Transform};

/// A laid-out figure.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// Name of the figure.
    pub name: String,
    /// Title, even if it is not drawn.
    pub title: String,
    /// Files of the figure, in the form of [`super::signature::source`]; may be empty.
    pub source: String,
    /// Width and height.
    pub size: (u32, u32),
    /// Drawing units per millimetre.
    pub units_per_mm: f64,
    /// Elements in drawing order: later ones cover earlier ones.
    pub elements: Vec<DrawingElement>,
}

/// A line, an area or a text in one colour.
#[derive(Debug, Clone)]
pub struct DrawingElement {
    /// Form and position.
    pub form: ElementForm,
    /// Red, green and blue.
    pub color: [u8; 3],
    /// Opacity, 0 to 1.
    pub opacity: f64,
    /// Line width; `None` for a filled form.
    pub stroke: Option<u32>,
    /// Lengths of a dash and of the gap after it; `None` for an unbroken line.
    pub dash: Option<[u32; 2]>,
}

/// Horizontal and vertical position, drawing units.
pub type DrawnPoint = (i32, i32);

/// Form of an element.
#[derive(Debug, Clone)]
#[expect(missing_docs, reason = "each variant is called what it is")]
pub enum ElementForm {
    Line([DrawnPoint; 2]),
    Polyline(Vec<DrawnPoint>),
    Polygon(Vec<DrawnPoint>),
    Rectangle([DrawnPoint; 2]),
    Circle(DrawnPoint, u32),
    Text(Text),
}

/// A line of text.
#[derive(Debug, Clone)]
pub struct Text {
    /// The text.
    pub words: String,
    /// Anchor point.
    pub at: DrawnPoint,
    /// Font size.
    pub size: f64,
    /// `text-anchor` in SVG, and the share of the text's width to the left of the anchor point.
    pub anchor: (&'static str, f64),
    /// `dy` in SVG, and the distance of the baseline below the anchor point in font sizes.
    pub drop: (&'static str, f64),
    /// Clockwise rotation about the anchor point, degrees.
    pub turn: u32,
}

impl DrawingElement {
    /// The line, or the outline of a filled form; `None` if nothing is visible.
    pub fn outline(&self) -> Option<Path> {
        let point = |(x, y): DrawnPoint| (x as f32, y as f32);
        let through = |points: &[DrawnPoint], closed: bool| {
            let mut path = PathBuilder::new();
            for (k, (x, y)) in points.iter().copied().map(point).enumerate() {
                if k == 0 {
                    path.move_to(x, y);
                } else {
                    path.line_to(x, y);
                }
            }
            if closed {
                path.close();
            }
            path.finish()
        };
        match &self.form {
            ElementForm::Line(points) => through(points, false),
            ElementForm::Polyline(points) => through(points, false),
            ElementForm::Polygon(points) => through(points, true),
            ElementForm::Rectangle(corners) => {
                let [(left, top), (right, bottom)] = corners.map(point);
                let area = Rect::from_ltrb(left, top, right, bottom)?;
                (area.width() > 0.0 && area.height() > 0.0).then(|| PathBuilder::from_rect(area))
            }
            ElementForm::Circle(center, radius) => {
                let (x, y) = point(*center);
                PathBuilder::from_circle(x, y, *radius as f32)
            }
            ElementForm::Text(text) => text.outline(),
        }
    }
}

impl Text {
    fn outline(&self) -> Option<Path> {
        let (x, y) = (f64::from(self.at.0), f64::from(self.at.1));
        let mut letters = PathBuilder::new();
        let mut from = x - self.anchor.1 * text::text_width(&self.words, self.size);
        for (level, piece) in text::pieces(&self.words) {
            let (size, below) = level.place(self.size);
            let line = y + self.drop.1 * self.size + below;
            text::add_letters(&mut letters, &piece, size, (from, line));
            from += text::plain_width(&piece, size);
        }
        letters
            .finish()?
            .transform(Transform::from_rotate_at(self.turn as f32, x as f32, y as f32))
    }
}

impl Drawing {
    /// The same for a dark page: in lighter colours, and transparent where it is white.
    pub fn on_dark(mut self) -> Drawing {
        let (width, height) = self.size;
        let whole = |form: &ElementForm| match form {
            ElementForm::Rectangle([(0, 0), (right, bottom)]) => {
                (*right, *bottom) >= (width as i32 - 1, height as i32 - 1)
            }
            _ => false,
        };
        self.elements.retain(|element| !whole(&element.form));
        for element in &mut self.elements {
            element.color = on_dark(element.color);
        }
        self
    }
}

/// Horizontal and vertical position of a text at its anchor point: [`Text::anchor`] and [`Text::drop`].
pub(super) type TextAnchor = ((&'static str, f64), (&'static str, f64));

pub(super) const UPPER_LEFT: TextAnchor = (("start", 0.0), BELOW);
pub(super) const UPPER_MIDDLE: TextAnchor = (CENTRED, BELOW);
pub(super) const CENTRE: TextAnchor = (CENTRED, HALF_WAY);
pub(super) const LOWER_MIDDLE: TextAnchor = (CENTRED, ("-0.5ex", -0.25));
pub(super) const RIGHT_MIDDLE: TextAnchor = (("end", 1.0), HALF_WAY);
const CENTRED: (&str, f64) = ("middle", 0.5);
const BELOW: (&str, f64) = ("0.76em", 0.76);
const HALF_WAY: (&str, f64) = ("0.5ex", 0.25);

/// Colour and opacity of a surface.
pub(super) type Paint = (RGBColor, f64);

impl Drawing {
    fn add(&mut self, form: ElementForm, (RGBColor(red, green, blue), opacity): Paint, stroke: Option<u32>) {
        if opacity > 0.0 {
            self.elements.push(DrawingElement {
                form,
                color: [red, green, blue],
                opacity,
                stroke,
                dash: None,
            });
        }
    }

    /// A straight line of the grid.
    pub(super) fn grid_line(&mut self, ends: [DrawnPoint; 2], paint: Paint) {
        self.add(ElementForm::Line(ends), paint, Some(THIN_STROKE));
    }

    /// Styles of points are drawn as unbroken lines.
    pub(super) fn line(&mut self, points: Vec<DrawnPoint>, (color, width): (RGBColor, u32), style: CurveStyle) {
        self.add(ElementForm::Polyline(points), (color, 1.0), Some(width));
        if let Some(line) = self.elements.last_mut() {
            line.dash = style.dash();
        }
    }

    pub(super) fn polygon(&mut self, corners: Vec<DrawnPoint>, paint: Paint) {
        self.add(ElementForm::Polygon(corners), paint, None);
    }

    /// `corners`: any two that are opposite.
    pub(super) fn rectangle(&mut self, corners: [DrawnPoint; 2], paint: Paint) {
        self.add(ElementForm::Rectangle(ordered(corners)), paint, None);
    }

    /// A frame is always a hairline.
    pub(super) fn frame(&mut self, corners: [DrawnPoint; 2], color: RGBColor) {
        self.add(ElementForm::Rectangle(ordered(corners)), (color, 1.0), Some(1));
    }

    /// A disk, or a circle with this width of its line.
    pub(super) fn circle(&mut self, center: DrawnPoint, radius: u32, color: RGBColor, stroke: Option<u32>) {
        self.add(ElementForm::Circle(center, radius), (color, 1.0), stroke);
    }

    /// A line of text, turned clockwise by `turn` degrees.
    pub(super) fn text(&mut self, words: &str, size: f64, at: DrawnPoint, (anchor, drop): TextAnchor, turn: u32) {
        let words: Vec<&str> = words.split_ascii_whitespace().collect();
        if !words.is_empty() {
            let words = quote::for_terminal(&words.join(" "));
            let text = Text {
                words,
                at,
                size,
                anchor,
                drop,
                turn,
            };
            self.add(ElementForm::Text(text), (BLACK, 1.0), None);
        }
    }

    /// A line, or its points.
    pub(super) fn piece(&mut self, points: Vec<DrawnPoint>, color: RGBColor, style: CurveStyle) {
        let (radius, stroke) = match style {
            CurveStyle::Solid | CurveStyle::Dashed | CurveStyle::Dotted => {
                return self.line(points, (color, CURVE_STROKE), style);
            }
            CurveStyle::Thin => return self.line(points, (color, CURVE_STROKE / 2), style),
            CurveStyle::Marks(shape) => return points.into_iter().for_each(|point| self.mark(point, color, shape)),
            CurveStyle::Points => (POINT_RADIUS, None),
            CurveStyle::OpenPoints => (POINT_RADIUS, Some(THIN_STROKE + 4)),
            CurveStyle::Dots => (DOT_RADIUS, None),
        };
        for point in points {
            self.circle(point, radius, color, stroke);
        }
    }

    /// Open marks are white inside, so that they are visible on a line.
    fn mark(&mut self, (x, y): DrawnPoint, color: RGBColor, shape: MarkShape) {
        let width = THIN_STROKE + 6;
        let inner = if shape.filled { color } else { WHITE };
        let radius = POINT_RADIUS + THIN_STROKE;
        let corners = shape.corners(f64::from(radius));
        let mut places: Vec<DrawnPoint> = corners
            .map(|(right, below)| (x + right.round() as i32, y + below.round() as i32))
            .collect();
        if shape.cross {
            for line in places.chunks(2) {
                self.line(line.to_vec(), (color, width), CurveStyle::Solid);
            }
        } else if let Some(&first) = places.first() {
            self.polygon(places.clone(), (inner, 1.0));
            places.push(first);
            self.line(places, (color, width), CurveStyle::Solid);
        } else {
            self.circle((x, y), radius, inner, None);
            self.circle((x, y), radius, color, Some(width));
        }
    }

    /// A cell without a value is grey. A cross marks a failed run, a single stroke a missing one.
    pub(super) fn cell(&mut self, cell: Cell, corners: [DrawnPoint; 2]) {
        let [(left, low), (right, high)] = corners;
        let (up, down) = ([(left, low), (right, high)], [(left, high), (right, low)]);
        let (ground, lines) = match cell {
            Cell::Failed => (WHITE, &[up, down][..]),
            Cell::Missing => (WHITE, &[up][..]),
            Cell::Nothing | Cell::Value(_) => (NOTHING, &[][..]),
        };
        self.rectangle(corners, (ground, 1.0));
        for line in lines {
            self.line(line.to_vec(), (BLACK, THIN_STROKE), CurveStyle::Solid);
        }
    }
}

fn ordered([a, b]: [DrawnPoint; 2]) -> [DrawnPoint; 2] {
    [(a.0.min(b.0), a.1.min(b.1)), (a.0.max(b.0), a.1.max(b.1))]
}
