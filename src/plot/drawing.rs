//! A figure as lines, areas and texts, from which all formats are written.
//!
//! Coordinates and lengths are in drawing units from the upper left corner. Lines have butt ends and round joins.

use super::figure::{Cell, CurveStyle, MarkShape};
use super::style::*;
use super::text;
use crate::Error;
use plotters::coord::CoordTranslate;
use plotters::element::{Drawable, PointCollection};
use plotters::prelude::{Circle, DrawingArea, EmptyElement, PathElement, Polygon, Rectangle, WHITE};
use plotters::style::{Color, RGBColor, ShapeStyle};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontTransform,
};
use std::convert::Infallible;
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

/// Form of an element.
#[derive(Debug, Clone)]
#[expect(missing_docs, reason = "each variant is called what it is")]
pub enum ElementForm {
    Line([BackendCoord; 2]),
    Polyline(Vec<BackendCoord>),
    Polygon(Vec<BackendCoord>),
    Rectangle([BackendCoord; 2]),
    Circle(BackendCoord, u32),
    Text(Text),
}

/// A line of text.
#[derive(Debug, Clone)]
pub struct Text {
    /// The text.
    pub words: String,
    /// Anchor point.
    pub at: BackendCoord,
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
        let point = |(x, y): BackendCoord| (x as f32, y as f32);
        let through = |points: &[BackendCoord], closed: bool| {
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

type DrawnElement = Result<(), DrawingErrorKind<Infallible>>;

impl Drawing {
    fn add(&mut self, form: ElementForm, color: BackendColor, stroke: Option<u32>) -> DrawnElement {
        let (red, green, blue) = color.rgb;
        if color.alpha > 0.0 {
            self.elements.push(DrawingElement {
                form,
                color: [red, green, blue],
                opacity: color.alpha,
                stroke,
                dash: None,
            });
        }
        Ok(())
    }
}

/// Records the calls of the drawing library as elements.
impl DrawingBackend for &mut Drawing {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.size
    }

    fn ensure_prepared(&mut self) -> DrawnElement {
        Ok(())
    }

    fn present(&mut self) -> DrawnElement {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> DrawnElement {
        self.draw_rect((x, y), (x + 1, y + 1), &color, true)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> DrawnElement {
        self.add(ElementForm::Line([from, to]), style.color(), Some(style.stroke_width()))
    }

    /// A frame is always a hairline.
    fn draw_rect<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
        fill: bool,
    ) -> DrawnElement {
        self.add(ElementForm::Rectangle([from, to]), style.color(), (!fill).then_some(1))
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> DrawnElement {
        let points = path.into_iter().collect();
        self.add(ElementForm::Polyline(points), style.color(), Some(style.stroke_width()))
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> DrawnElement {
        let stroke = (!fill).then(|| style.stroke_width());
        self.add(ElementForm::Circle(center, radius), style.color(), stroke)
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> DrawnElement {
        let corners = corners.into_iter().collect();
        self.add(ElementForm::Polygon(corners), style.color(), None)
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> DrawnElement {
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        if words.is_empty() {
            return Ok(());
        }
        let text = Text {
            words: quote::for_terminal(&words.join(" ")),
            at,
            size: style.size(),
            anchor: match style.anchor().h_pos {
                HPos::Left => ("start", 0.0),
                HPos::Center => ("middle", 0.5),
                HPos::Right => ("end", 1.0),
            },
            drop: match style.anchor().v_pos {
                VPos::Top => ("0.76em", 0.76),
                VPos::Center => ("0.5ex", 0.25),
                VPos::Bottom => ("-0.5ex", -0.25),
            },
            turn: match style.transform() {
                FontTransform::None => 0,
                FontTransform::Rotate90 => 90,
                FontTransform::Rotate180 => 180,
                FontTransform::Rotate270 => 270,
            },
        };
        self.add(ElementForm::Text(text), style.color(), None)
    }
}

pub(super) type Sheet<'a, C> = DrawingArea<&'a mut Drawing, C>;

pub(super) fn stroke(color: RGBColor, width: u32) -> ShapeStyle {
    Color::stroke_width(&color, width)
}

/// A dashed line. It is one element, however many dashes it has.
struct DashedLine<P> {
    points: Vec<P>,
    color: RGBColor,
    width: u32,
    dash: [u32; 2],
}

impl<'p, P> PointCollection<'p, P> for &'p DashedLine<P> {
    type Point = &'p P;
    type IntoIter = &'p [P];

    fn point_iter(self) -> &'p [P] {
        &self.points
    }
}

impl<P> Drawable<&mut Drawing> for DashedLine<P> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        points: I,
        drawing: &mut &mut Drawing,
        _: (u32, u32),
    ) -> DrawnElement {
        let points = points.collect();
        drawing.add(
            ElementForm::Polyline(points),
            self.color.to_backend_color(),
            Some(self.width),
        )?;
        if let Some(line) = drawing.elements.last_mut() {
            line.dash = Some(self.dash);
        }
        Ok(())
    }
}

/// Draws a line with this style and width. Styles of points are drawn as unbroken lines.
pub(super) fn draw_line<C: CoordTranslate<From: Clone + 'static>>(
    area: &Sheet<C>,
    points: Vec<C::From>,
    (color, width): (RGBColor, u32),
    style: CurveStyle,
) -> Result<(), Error> {
    match style.dash() {
        Some(dash) => Ok(area.draw(&DashedLine {
            points,
            color,
            width,
            dash,
        })?),
        None => Ok(area.draw(&PathElement::new(points, stroke(color, width)))?),
    }
}

pub(super) fn draw_piece<C: CoordTranslate<From: Clone + 'static>>(
    area: &Sheet<C>,
    points: Vec<C::From>,
    color: RGBColor,
    style: CurveStyle,
) -> Result<(), Error> {
    let (radius, circle) = match style {
        CurveStyle::Solid | CurveStyle::Dashed | CurveStyle::Dotted => {
            return draw_line(area, points, (color, CURVE_STROKE), style);
        }
        CurveStyle::Thin => return draw_line(area, points, (color, CURVE_STROKE / 2), style),
        CurveStyle::Marks(shape) => {
            return points
                .into_iter()
                .try_for_each(|point| draw_mark(area, point, color, shape));
        }
        CurveStyle::Points => (POINT_RADIUS, color.filled()),
        CurveStyle::OpenPoints => (POINT_RADIUS, stroke(color, THIN_STROKE + 4)),
        CurveStyle::Dots => (DOT_RADIUS, color.filled()),
    };
    for point in points {
        area.draw(&Circle::new(point, radius, circle))?;
    }
    Ok(())
}

/// Draws a mark. Open marks are white inside, so that they are visible on a line.
fn draw_mark<C: CoordTranslate<From: Clone + 'static>>(
    area: &Sheet<C>,
    point: C::From,
    color: RGBColor,
    shape: MarkShape,
) -> Result<(), Error> {
    let edge = stroke(color, THIN_STROKE + 6);
    let inner = if shape.filled { color.filled() } else { WHITE.filled() };
    let radius = POINT_RADIUS + THIN_STROKE;
    let corners = shape.corners(f64::from(radius));
    if corners.len() == 0 {
        area.draw(&Circle::new(point.clone(), radius, inner))?;
        return Ok(area.draw(&Circle::new(point, radius, edge))?);
    }
    let places = corners.map(|(x, y)| (x.round() as i32, y.round() as i32));
    let mut places: Vec<(i32, i32)> = places.collect();
    if shape.cross {
        for line in places.chunks(2) {
            area.draw(&(EmptyElement::at(point.clone()) + PathElement::new(line.to_vec(), edge)))?;
        }
        return Ok(());
    }
    area.draw(&(EmptyElement::at(point.clone()) + Polygon::new(places.clone(), inner)))?;
    places.push(places[0]);
    Ok(area.draw(&(EmptyElement::at(point) + PathElement::new(places, edge)))?)
}

/// Draws a cell without a value in grey. A cross marks a failed run, a single stroke a missing one.
pub(super) fn draw_cell<X: Copy + 'static, C: CoordTranslate<From = (X, X)>>(
    area: &Sheet<C>,
    cell: Cell,
    corners: [(X, X); 2],
) -> Result<(), Error> {
    let [(left, low), (right, high)] = corners;
    let (up, down) = ([(left, low), (right, high)], [(left, high), (right, low)]);
    let (ground, lines) = match cell {
        Cell::Failed => (WHITE, &[up, down][..]),
        Cell::Missing => (WHITE, &[up][..]),
        Cell::Nothing | Cell::Value(_) => (NOTHING, &[][..]),
    };
    area.draw(&Rectangle::new(corners, ground.filled()))?;
    for line in lines {
        area.draw(&PathElement::new(*line, stroke(BLACK, THIN_STROKE)))?;
    }
    Ok(())
}
