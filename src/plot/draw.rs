//! Layout and drawing of figures.

use super::drawing::{Drawing, Sheet, draw_cell, draw_line, draw_piece, stroke};
use super::figure::{Area, Axis, Cell, ColorKey, Curve, CurveStyle, Figure, Map, Panel};
use super::labels::marks;
use super::scale::Scale;
use super::style::*;
use super::text::{self, text_width, wrapped_title};
use crate::Error;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::{
    Cartesian2d, ChartBuilder, ChartContext, Circle, IntoDrawingArea, LabelAreaPosition, PathElement, Polygon,
    Rectangle, TRANSPARENT, WHITE,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, IntoFont, RGBAColor, RGBColor, TextStyle};
use std::borrow::Cow;
use stickslip_system::record::EventKind;

/// Margin, drawing units.
const MARGIN: f64 = 150.0;
/// Largest width of a figure with square panels, drawing units.
const WIDEST_SQUARE: f64 = 11_000.0;
/// Widths in drawing units: samples of lines and areas in a legend, those of marks and events, gap to the text, gap to
/// the next entry.
const SWATCH: f64 = 330.0;
const NARROW_SWATCH: f64 = 130.0;
const SWATCH_GAP: f64 = 90.0;
const ENTRY_GAP: f64 = 300.0;
/// Height of a colour scale (title, bar and numbers), and of its bar alone.
const BAR_HEIGHT: f64 = 2.9 * LINE_HEIGHT;
const BAR: f64 = 0.6 * LINE_HEIGHT;
/// Length of a tick without label.
const MINOR_TICK: i32 = 30;
const COLORS: usize = 256;
const AREA_OPACITY: f64 = 0.35;
/// Overlap of cells (drawing units), so that the background is not visible between them, even with large pixels.
const CELL_OVERLAP: f64 = 40.0;
/// Least height of a panel, drawing units.
const LEAST_HEIGHT: f64 = 1300.0;
const HEADROOM: f64 = 0.05;

type Ground<'a> = Sheet<'a, Shift>;
type Axes = Cartesian2d<RangedCoordf64, RangedCoordf64>;
type Plane<'a> = Sheet<'a, Axes>;

impl Swatch {
    fn width(&self) -> f64 {
        match self {
            Swatch::Curve(_, style) if !style.is_line() => NARROW_SWATCH,
            Swatch::Event(_) => NARROW_SWATCH,
            _ => SWATCH,
        }
    }
}

#[derive(Clone, PartialEq)]
enum Swatch {
    Curve(RGBColor, CurveStyle),
    Ground(RGBColor, f64),
    Event(EventKind),
    Cell(Cell),
}

struct MeasuredText<'a> {
    panel: &'a Panel,
    x: Scale,
    y: Scale,
    width: f64,
    height: f64,
    x_ticks: usize,
    y_ticks: usize,
    y_title: String,
    last: bool,
    marks: Vec<(f64, EventKind)>,
    colors: Option<(&'a Axis, Scale)>,
}

/// Draws the figure with a layout, or in a column of a given width (mm).
pub fn draw(figure: &Figure, layout: impl Into<Layout>) -> Result<Drawing, Error> {
    let layout = layout.into();
    let square = figure.panels.iter().all(|panel| panel.square);
    let width = layout.width * layout.units_per_mm();
    let width = if square { width.min(WIDEST_SQUARE) } else { width };
    let title = if layout.title {
        wrapped_title(&figure.full_title(), TITLE_SIZE, width - 2.0 * MARGIN)
    } else {
        Vec::new()
    };
    let (measured, left, right) = measure(figure, width);
    let legend = legend_rows(&legend(&measured), width - 2.0 * MARGIN);
    // The panels of a figure have a common colour bar.
    let bar = measured.iter().find_map(|m| m.colors.as_ref());
    let bar_height = if bar.is_some() { BAR_HEIGHT } else { 0.0 };
    let top = MARGIN + (title.len() + legend.len()) as f64 * LINE_HEIGHT + bar_height + 0.3 * LINE_HEIGHT;
    let height = top + measured.iter().map(panel_height).sum::<f64>() + 0.4 * MARGIN;
    let mut drawing = Drawing {
        name: figure.name.clone(),
        title: figure.full_title(),
        source: String::new(),
        size: (width.round() as u32, height.round() as u32),
        units_per_mm: layout.units_per_mm(),
        elements: Vec::new(),
    };
    {
        let root = (&mut drawing).into_drawing_area();
        root.fill(&WHITE)?;
        let mut y = MARGIN;
        for line in &title {
            write(&root, line, TITLE_SIZE, (MARGIN, y))?;
            y += LINE_HEIGHT;
        }
        for row in &legend {
            draw_legend(&root, row, y)?;
            y += LINE_HEIGHT;
        }
        if let Some((axis, scale)) = bar {
            draw_color_bar(&root, axis, scale, (left, width - right), y)?;
        }
        let mut rest = root.clone();
        let mut above = top;
        for panel in &measured {
            let (_, below) = rest.split_vertically(above.round() as i32);
            draw_panel(&below, panel, (left, right))?;
            rest = below;
            above = panel_height(panel);
        }
    }
    Ok(drawing)
}

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for Error {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Error::drawing(error)
    }
}

fn measure(figure: &Figure, width: f64) -> (Vec<MeasuredText<'_>>, f64, f64) {
    let count = figure.panels.len();
    // Four or more panels together are as high as four, unless their ticks need more height.
    let share = if count == 1 {
        0.5
    } else {
        0.34f64.min(1.36 / count as f64)
    };
    let height = (share * width).clamp(LEAST_HEIGHT, 8000.0);
    let mut measured: Vec<MeasuredText> = figure
        .panels
        .iter()
        .enumerate()
        .map(|(k, panel)| {
            let scale = |axis: &Axis, of: fn((f64, f64)) -> f64, room: f64| {
                let range = axis.range.unwrap_or_else(|| {
                    let (low, high) = panel.extent(of);
                    if axis.logarithmic {
                        let margin = (high / low).powf(room);
                        return (low / margin, high * margin);
                    }
                    let margin = room * (high - low);
                    (low - margin, high + margin)
                });
                match axis.logarithmic {
                    true => Scale::by_powers(range, &axis.unit),
                    false => Scale::new(range, &axis.unit),
                }
            };
            let with_room = panel.square || panel.x.logarithmic;
            let x = scale(&panel.x, |p| p.0, if with_room { HEADROOM } else { 0.0 });
            let y = scale(&panel.y, |p| p.1, HEADROOM);
            MeasuredText {
                panel,
                x,
                y,
                width,
                height,
                x_ticks: 2,
                y_ticks: 2,
                y_title: String::new(),
                last: k + 1 == count || figure.panels[k + 1].x != panel.x,
                marks: Vec::new(),
                colors: panel.map.as_ref().and_then(|map| match &map.key {
                    ColorKey::Scale(axis) => Some((axis, scale(axis, |p| p.1, 0.0))),
                    ColorKey::Codes(_) => None,
                }),
            }
        })
        .collect();
    let right = MARGIN + measured.iter().map(|m| widest_label(&m.x, 4) / 2.0).fold(0.0, f64::max);
    let y_ticks = |m: &MeasuredText| m.y.best_count(((m.height / (1.7 * LINE_HEIGHT)) as usize).clamp(2, 9));
    let left_of = |measured: &[MeasuredText]| {
        let labels = measured.iter().map(|m| widest_label(&m.y, m.y_ticks));
        MARGIN + 1.2 * LINE_HEIGHT + labels.fold(0.0, f64::max) + 2.0 * f64::from(TICK) + 60.0
    };
    for m in &mut measured {
        m.y_ticks = y_ticks(m);
    }
    let mut left = left_of(&measured);
    // A square panel is as high as wide. More ticks can have wider labels.
    for m in measured.iter_mut().filter(|m| m.panel.square) {
        m.height = width - left - right;
        m.y_ticks = y_ticks(m);
    }
    left = left.max(left_of(&measured));
    let plot_width = width - left - right;
    for m in &mut measured {
        m.width = plot_width;
        if m.panel.square {
            m.height = plot_width;
        }
        m.x_ticks = fitting_ticks(&m.x, plot_width, 15);
        m.y_title = fitting_title(&m.y, &m.panel.y, m.height);
        let per_x = plot_width / (m.x.shown.1 - m.x.shown.0);
        m.marks = marks(&m.panel.events, |t| m.x.show(t) * per_x);
    }
    (measured, left, right)
}

fn fitting_title(scale: &Scale, axis: &Axis, room: f64) -> String {
    let titles = [axis.label().as_str(), axis.name.as_str(), axis.short()].map(|label| scale.title(label));
    let fits = titles.iter().find(|title| text_width(title, LABEL_SIZE) <= room);
    fits.or(titles.iter().min_by_key(|title| title.len()))
        .cloned()
        .unwrap_or_default()
}

/// The largest number of ticks, up to `most`, whose labels are at least a letter's width apart.
fn fitting_ticks(scale: &Scale, width: f64, most: usize) -> usize {
    let fits = |n: &usize| {
        let gaps = scale.ticks(*n).0.len().max(2) - 1;
        scale.best_count(*n) == *n && widest_label(scale, *n) + LABEL_SIZE < width / (gaps + 1) as f64
    };
    (2..=most).rev().find(fits).unwrap_or(2)
}

fn widest_label(scale: &Scale, count: usize) -> f64 {
    let (ticks, decimals) = scale.ticks(count);
    let width = |&t: &f64| text_width(&scale.label(t, decimals), LABEL_SIZE);
    ticks.iter().map(width).fold(0.0, f64::max)
}

fn label_height(m: &MeasuredText) -> f64 {
    2.0 * f64::from(TICK) + LINE_HEIGHT * if m.last { 2.0 } else { 0.3 }
}

fn panel_height(m: &MeasuredText) -> f64 {
    m.height + label_height(m) + caption_height(m)
}

fn caption_height(m: &MeasuredText) -> f64 {
    if m.panel.caption.is_empty() {
        0.0
    } else {
        1.1 * LINE_HEIGHT
    }
}

fn legend(measured: &[MeasuredText]) -> Vec<(String, Swatch)> {
    let mut entries: Vec<(String, Swatch)> = Vec::new();
    let mut add = |name: &str, swatch: Swatch| {
        if !name.is_empty() && !entries.iter().any(|e| e.0 == name && e.1 == swatch) {
            entries.push((name.to_owned(), swatch));
        }
    };
    for m in measured {
        for curve in &m.panel.curves {
            add(&curve.label, Swatch::Curve(curve.color, curve.style));
        }
        for area in &m.panel.areas {
            add(&area.label, Swatch::Ground(area.color, AREA_OPACITY));
        }
    }
    let maps = || measured.iter().filter_map(|m| m.panel.map.as_ref());
    for map in maps() {
        if let ColorKey::Codes(codes) = &map.key {
            for (number, (_, word)) in codes.iter().enumerate() {
                add(word, Swatch::Ground(shade_of_code(number, codes.len()), 1.0));
            }
        }
    }
    for (cell, word) in [
        (Cell::Nothing, "no value"),
        (Cell::Failed, "failed"),
        (Cell::Missing, "not run"),
    ] {
        if maps().any(|map| map.cells.contains(&cell)) {
            add(word, Swatch::Cell(cell));
        }
    }
    for m in measured {
        for &(_, _, mode) in &m.panel.modes {
            let (color, opacity) = ground(mode);
            add(&owned(&m.panel.shown_of, mode.name()), Swatch::Ground(color, opacity));
        }
        for &(_, kind) in &m.marks {
            let name = event_name(kind, m.panel.driven_by);
            add(&owned(&m.panel.shown_of, &name), Swatch::Event(kind));
        }
    }
    entries
}

/// The name of a mode or an event, after that of its run.
fn owned(run: &str, name: &str) -> String {
    match run {
        "" => name.to_owned(),
        run => format!("{run}: {name}"),
    }
}

/// Stick and slip are names of modes, too. The events are their beginnings.
fn event_name(kind: EventKind, driven_by: &str) -> Cow<'static, str> {
    match kind {
        EventKind::Stick => "stick begins".into(),
        EventKind::Slip => "slip begins".into(),
        EventKind::Destabilised => "loss of stability".into(),
        EventKind::Corner => format!("corner of {driven_by}").into(),
        kind => kind.name().into(),
    }
}

fn entry_width(name: &str, swatch: &Swatch) -> f64 {
    swatch.width() + SWATCH_GAP + text_width(name, LABEL_SIZE) + ENTRY_GAP
}

fn legend_rows(entries: &[(String, Swatch)], width: f64) -> Vec<Vec<(f64, String, Swatch)>> {
    let mut rows: Vec<Vec<(f64, String, Swatch)>> = Vec::new();
    let mut x = 0.0;
    for (name, swatch) in entries {
        let needed = entry_width(name, swatch);
        if rows.is_empty() || x + needed - ENTRY_GAP > width {
            rows.push(Vec::new());
            x = 0.0;
        }
        if let Some(row) = rows.last_mut() {
            row.push((MARGIN + x, name.clone(), swatch.clone()));
        }
        x += needed;
    }
    rows
}

fn text_style(size: f64, pos: Pos) -> TextStyle<'static> {
    (text::FAMILIES, size).into_font().color(&BLACK).pos(pos)
}

fn write(area: &Ground, text: &str, size: f64, (x, y): (f64, f64)) -> Result<(), Error> {
    let style = text_style(size, Pos::new(HPos::Left, VPos::Top));
    Ok(area.draw_text(text, &style, (x.round() as i32, y.round() as i32))?)
}

fn draw_legend(area: &Ground, row: &[(f64, String, Swatch)], y: f64) -> Result<(), Error> {
    let middle = (y + 0.4 * LABEL_SIZE).round() as i32;
    for (x, name, swatch) in row {
        let width = swatch.width();
        let (left, right) = (x.round() as i32, (x + width).round() as i32);
        let center = (x + width / 2.0).round() as i32;
        let corners = [(left, middle - 90), (right, middle + 90)];
        match *swatch {
            Swatch::Curve(color, style) if style.is_line() => {
                draw_piece(area, vec![(left, middle), (right, middle)], color, style)?;
            }
            Swatch::Curve(color, CurveStyle::OpenPoints) => {
                area.draw(&Circle::new((center, middle), POINT_RADIUS, stroke(color, THIN_STROKE)))?;
            }
            Swatch::Curve(color, style @ CurveStyle::Marks(_)) => {
                draw_piece(area, vec![(center, middle)], color, style)?
            }
            Swatch::Curve(color, _) => draw_piece(area, vec![(center, middle)], color, CurveStyle::Points)?,
            Swatch::Ground(color, opacity) => area.draw(&Rectangle::new(corners, color.mix(opacity).filled()))?,
            Swatch::Event(kind) => {
                let line = vec![(center, middle - 110), (center, middle + 110)];
                draw_line(area, line, (of_event(kind), THIN_STROKE + 4), line_of_event(kind))?;
            }
            Swatch::Cell(cell) => {
                draw_cell(area, cell, corners)?;
                area.draw(&Rectangle::new(corners, stroke(GREY, THIN_STROKE)))?;
            }
        }
        write(area, name, LABEL_SIZE, (x + width + SWATCH_GAP, y))?;
    }
    Ok(())
}

fn draw_panel(area: &Ground, m: &MeasuredText, (left, right): (f64, f64)) -> Result<(), Error> {
    let (own, _) = area.split_vertically(panel_height(m).round() as i32);
    let (x, y) = (m.x.shown, m.y.shown);
    if !m.panel.caption.is_empty() {
        write(&own, &m.panel.caption, LABEL_SIZE, (left, 0.1 * LINE_HEIGHT))?;
    }
    let mut chart = ChartBuilder::on(&own)
        .margin_top(caption_height(m).round() as i32)
        .margin_left(MARGIN.round() as i32)
        .margin_right(right.round() as i32)
        .set_label_area_size(LabelAreaPosition::Left, (left - MARGIN).round() as i32)
        .set_label_area_size(LabelAreaPosition::Bottom, label_height(m).round() as i32)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    draw_ground(chart.plotting_area(), m)?;
    draw_mesh(&mut chart, m)?;
    draw_minor_ticks(&own, chart.plotting_area(), m)?;
    draw_content(&own, chart.plotting_area(), m)
}

fn draw_minor_ticks(own: &Ground, plane: &Plane, m: &MeasuredText) -> Result<(), Error> {
    let (origin, corner) = (own.get_base_pixel(), (m.x.shown.0, m.y.shown.0));
    let place = |x: f64, y: f64| {
        let (x, y) = plane.map_coordinate(&(x, y));
        (x - origin.0, y - origin.1)
    };
    let line = |from: (i32, i32), to: (i32, i32)| PathElement::new([from, to], stroke(BLACK, THIN_STROKE));
    for x in m.x.minor_ticks() {
        let (x, y) = place(x, corner.1);
        own.draw(&line((x, y), (x, y + MINOR_TICK)))?;
    }
    for y in m.y.minor_ticks() {
        let (x, y) = place(corner.0, y);
        own.draw(&line((x, y), (x - MINOR_TICK, y)))?;
    }
    Ok(())
}

fn draw_ground(plane: &Plane, m: &MeasuredText) -> Result<(), Error> {
    let (x, y) = (m.x.shown, m.y.shown);
    for &(from, to, mode) in &m.panel.modes {
        let (color, opacity) = ground(mode);
        let corners = [(m.x.show(from).max(x.0), y.0), (m.x.show(to).min(x.1), y.1)];
        plane.draw(&Rectangle::new(corners, color.mix(opacity).filled()))?;
    }
    Ok(())
}

fn draw_content(own: &Ground, plane: &Plane, m: &MeasuredText) -> Result<(), Error> {
    let y = m.y.shown;
    if let Some(map) = &m.panel.map {
        draw_map(plane, m, map)?;
    }
    for area in &m.panel.areas {
        draw_area(plane, m, area)?;
    }
    for &(at, kind) in &m.marks {
        let at = m.x.show(at);
        let line = vec![(at, y.0), (at, y.1)];
        draw_line(plane, line, (of_event(kind), THIN_STROKE + 2), line_of_event(kind))?;
    }
    // Labels interrupt thin lines, which they name, and no others.
    let (origin, high) = (own.get_base_pixel(), (0.55 * LABEL_SIZE) as i32);
    let place = |at: (f64, f64)| {
        let (x, y) = plane.map_coordinate(&(m.x.show(at.0), m.y.show(at.1)));
        (x - origin.0, y - origin.1)
    };
    let (thin, others): (Vec<&Curve>, Vec<&Curve>) =
        (m.panel.curves.iter()).partition(|curve| curve.style == CurveStyle::Thin && !m.panel.labels.is_empty());
    for curve in thin {
        draw_curve(plane, m, curve)?;
    }
    for (at, text) in &m.panel.labels {
        let (x, y) = place(*at);
        let half = (text_width(text, LABEL_SIZE) / 2.0 + 40.0) as i32;
        let corners = [(x - half, y - high), (x + half, y + high)];
        own.draw(&Rectangle::new(corners, WHITE.filled()))?;
    }
    for curve in others {
        draw_curve(plane, m, curve)?;
    }
    for (at, text) in &m.panel.labels {
        let style = text_style(LABEL_SIZE, Pos::new(HPos::Center, VPos::Center));
        own.draw_text(text, &style, place(*at))?;
    }
    Ok(())
}

fn draw_mesh(chart: &mut ChartContext<&mut Drawing, Axes>, m: &MeasuredText) -> Result<(), Error> {
    let (_, x_decimals) = m.x.ticks(m.x_ticks);
    let (_, y_decimals) = m.y.ticks(m.y_ticks);
    let label = text_style(LABEL_SIZE, Pos::default());
    // Grid lines would look out at the edges of a map.
    let is_map = m.panel.map.as_ref().is_some_and(|map| !map.cells.is_empty());
    let grid: RGBAColor = GREY.mix(if is_map { 0.0 } else { 0.3 });
    let x_title = if m.last {
        fitting_title(&m.x, &m.panel.x, m.width)
    } else {
        String::new()
    };
    Ok(chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(grid.stroke_width(THIN_STROKE))
        .axis_style(stroke(BLACK, AXIS_STROKE))
        .set_all_tick_mark_size(TICK)
        .x_labels(m.x_ticks)
        .y_labels(m.y_ticks)
        .x_label_formatter(&|v| {
            if m.last {
                m.x.label(*v, x_decimals)
            } else {
                String::new()
            }
        })
        .y_label_formatter(&|v| m.y.label(*v, y_decimals))
        .label_style(label.clone())
        .axis_desc_style(label)
        .x_desc(x_title)
        .y_desc(m.y_title.clone())
        .draw()?)
}

fn is_dot(plane: &Plane, points: &[(f64, f64)]) -> bool {
    let mut places = points.iter().map(|point| plane.map_coordinate(point));
    let first = places.next();
    places.all(|place| Some(place) == first)
}

fn draw_curve(plane: &Plane, m: &MeasuredText, curve: &Curve) -> Result<(), Error> {
    for piece in &curve.pieces {
        let points: Vec<(f64, f64)> = piece.iter().map(|&(x, y)| (m.x.show(x), m.y.show(y))).collect();
        if curve.style.is_line() && is_dot(plane, &points) {
            // A line without length in the drawing is only visible as a dot.
            for point in points.into_iter().take(1) {
                plane.draw(&Circle::new(point, CURVE_STROKE, curve.color.filled()))?;
            }
        } else {
            draw_piece(plane, points, curve.color, curve.style)?;
        }
    }
    Ok(())
}

fn step(scale: &Scale, value: f64) -> usize {
    let share = (scale.show(value) - scale.shown.0) / (scale.shown.1 - scale.shown.0);
    ((share * COLORS as f64) as usize).min(COLORS - 1)
}

fn color_of(step: usize) -> RGBColor {
    shade((step as f64 + 0.5) / COLORS as f64)
}

fn draw_color_bar(area: &Ground, axis: &Axis, scale: &Scale, (left, right): (f64, f64), y: f64) -> Result<(), Error> {
    let width = right - left;
    // A long title starts left of the bar.
    let mut title = fitting_title(scale, axis, right - MARGIN);
    let whole = title.clone();
    // The name of a quantity that the user has defined may be wider than the figure.
    let mut letters = axis.name.chars().count();
    while text_width(&title, LABEL_SIZE) > right - MARGIN && letters > 4 {
        letters -= 1;
        let short: String = axis.name.chars().take(letters).collect();
        title = whole.replacen(&axis.name, &format!("{}…", short.trim_end()), 1);
    }
    let start = if text_width(&title, LABEL_SIZE) <= width {
        left
    } else {
        MARGIN
    };
    write(area, &title, LABEL_SIZE, (start, y))?;
    let (top, bottom) = (y + LINE_HEIGHT, y + LINE_HEIGHT + BAR);
    let at = |share: f64| (left + share * width).round() as i32;
    let (top, bottom) = (top.round() as i32, bottom.round() as i32);
    for step in 0..COLORS {
        let from = at(step as f64 / COLORS as f64);
        // The rectangle extends to the end of the bar, so that no background is visible between it and the next.
        let corners = [(from, top), (at(1.0), bottom)];
        area.draw(&Rectangle::new(corners, color_of(step).filled()))?;
    }
    let frame = [(at(0.0), top), (at(1.0), bottom)];
    area.draw(&Rectangle::new(frame, stroke(BLACK, AXIS_STROKE)))?;
    let (ticks, decimals) = scale.ticks(fitting_ticks(scale, width, 10));
    let style = text_style(LABEL_SIZE, Pos::new(HPos::Center, VPos::Top));
    for tick in scale.minor_ticks() {
        let x = at((tick - scale.shown.0) / (scale.shown.1 - scale.shown.0));
        area.draw(&PathElement::new(
            [(x, bottom), (x, bottom + MINOR_TICK)],
            stroke(BLACK, THIN_STROKE),
        ))?;
    }
    for tick in ticks {
        let x = at((tick - scale.shown.0) / (scale.shown.1 - scale.shown.0));
        let line = [(x, bottom), (x, bottom + TICK)];
        area.draw(&PathElement::new(line, stroke(BLACK, AXIS_STROKE)))?;
        let label = scale.label(tick, decimals);
        // The first and the last number stay within the figure.
        let half = (text_width(&label, LABEL_SIZE) / 2.0).ceil() as i32;
        let middle = x.clamp(half + 20, (right + MARGIN) as i32 - half);
        area.draw_text(&label, &style, (middle, bottom + 2 * TICK))?;
    }
    Ok(())
}

/// Joins neighbouring cells of one colour in one rectangle.
fn draw_map(plane: &Plane, m: &MeasuredText, map: &Map) -> Result<(), Error> {
    let columns = map.x_edges.len().saturating_sub(1);
    if columns == 0 {
        return Ok(());
    }
    let color = |cell: Cell| match (cell, &map.key, &m.colors) {
        (Cell::Value(value), ColorKey::Codes(codes), _) => {
            let place = codes.iter().position(|(code, _)| *code as f64 == value);
            place.map(|place| shade_of_code(place, codes.len()))
        }
        (Cell::Value(value), ColorKey::Scale(_), Some((_, scale))) => Some(color_of(step(scale, value))),
        _ => None,
    };
    let (more_x, more_y) = (
        CELL_OVERLAP * (m.x.shown.1 - m.x.shown.0) / m.width,
        CELL_OVERLAP * (m.y.shown.1 - m.y.shown.0) / m.height,
    );
    for (row, cells) in map.cells.chunks(columns).enumerate() {
        let Some(&[low, high]) = map.y_edges.get(row..row + 2).and_then(|edges| edges.first_chunk()) else {
            break;
        };
        let (low, high) = (m.y.show(low), m.y.show(high));
        let mut column = 0;
        while column < cells.len() {
            let own = color(cells[column]);
            let mut end = column + 1;
            while own.is_some() && end < cells.len() && color(cells[end]) == own {
                end += 1;
            }
            let (left, right) = (m.x.show(map.x_edges[column]), m.x.show(map.x_edges[end]));
            match own {
                Some(color) => {
                    let corner = ((right + more_x).min(m.x.shown.1), (high + more_y).min(m.y.shown.1));
                    plane.draw(&Rectangle::new([(left, low), corner], color.filled()))?;
                }
                None => draw_cell(plane, cells[column], [(left, low), (right, high)])?,
            }
            column = end;
        }
    }
    Ok(())
}

fn draw_area(plane: &Plane, m: &MeasuredText, area: &Area) -> Result<(), Error> {
    for piece in &area.pieces {
        let lower = piece.iter().map(|&(x, low, _)| (m.x.show(x), m.y.show(low)));
        let upper = piece.iter().rev().map(|&(x, _, high)| (m.x.show(x), m.y.show(high)));
        let outline: Vec<(f64, f64)> = lower.chain(upper).collect();
        plane.draw(&Polygon::new(outline, area.color.mix(AREA_OPACITY).filled()))?;
    }
    Ok(())
}
