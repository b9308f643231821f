//! Elements of a drawing: lines, points, marks and cells.

use super::drawing::Drawing;
use super::figure::{Cell, CurveStyle, MarkShape};
use super::style::*;
use crate::Error;
use plotters::coord::CoordTranslate;
use plotters::element::DashedPathElement;
use plotters::prelude::{Circle, DrawingArea, EmptyElement, PathElement, Polygon, Rectangle, WHITE};
use plotters::style::{Color, RGBColor, ShapeStyle};

pub(super) type Sheet<'a, C> = DrawingArea<&'a mut Drawing, C>;

pub(super) fn stroke(color: RGBColor, width: u32) -> ShapeStyle {
    color.stroke_width(width)
}

pub(super) fn draw_piece<C: CoordTranslate<From: Clone + 'static>>(
    area: &Sheet<C>,
    points: Vec<C::From>,
    color: RGBColor,
    style: CurveStyle,
) -> Result<(), Error> {
    let line = stroke(color, CURVE_STROKE);
    let (radius, circle) = match style {
        CurveStyle::Solid => return Ok(area.draw(&PathElement::new(points, line))?),
        CurveStyle::Thin => return Ok(area.draw(&PathElement::new(points, stroke(color, CURVE_STROKE / 2)))?),
        CurveStyle::Dashed => return Ok(area.draw(&DashedPathElement::new(points, 90, 60, line))?),
        CurveStyle::Dotted => return Ok(area.draw(&DashedPathElement::new(points, 24, 56, line))?),
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
    let inner = if shape.is_filled() {
        color.filled()
    } else {
        WHITE.filled()
    };
    let Some(corners) = shape.corners() else {
        let radius = POINT_RADIUS + THIN_STROKE;
        area.draw(&Circle::new(point.clone(), radius, inner))?;
        return Ok(area.draw(&Circle::new(point, radius, edge))?);
    };
    let radius = f64::from(POINT_RADIUS + THIN_STROKE);
    let places = corners
        .iter()
        .map(|(x, y)| ((x * radius).round() as i32, (y * radius).round() as i32));
    let mut places: Vec<(i32, i32)> = places.collect();
    if shape.is_cross() {
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
