//! Layout and drawing of figures.

use super::drawing::*;
use super::figure::{Axis, Cell, ColorKey, Curve, CurveStyle, Figure, Map, Panel};
use super::labels::marks;
use super::scale::Scale;
use super::style::*;
use super::text::{text_width, wrapped_title};
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
pub fn draw(figure: &Figure, layout: impl Into<Layout>) -> Drawing {
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
    drawing.rectangle([(0, 0), (drawing.size.0 as i32, drawing.size.1 as i32)], (WHITE, 1.0));
    let mut y = MARGIN;
    for line in &title {
        write(&mut drawing, line, TITLE_SIZE, (MARGIN, y));
        y += LINE_HEIGHT;
    }
    for row in &legend {
        draw_legend(&mut drawing, row, y);
        y += LINE_HEIGHT;
    }
    if let Some((axis, scale)) = bar {
        draw_color_bar(&mut drawing, axis, scale, (left, width - right), y);
    }
    let mut top = top.round() as i32;
    for panel in &measured {
        let height = panel_height(panel).round() as i32;
        draw_panel(&mut drawing, panel, (left, right), (top, top + height));
        top += height;
    }
    drawing
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

fn write(drawing: &mut Drawing, text: &str, size: f64, (x, y): (f64, f64)) {
    drawing.text(text, size, (x.round() as i32, y.round() as i32), UPPER_LEFT, 0);
}

fn draw_legend(drawing: &mut Drawing, row: &[(f64, String, Swatch)], y: f64) {
    let middle = (y + 0.4 * LABEL_SIZE).round() as i32;
    for (x, name, swatch) in row {
        let width = swatch.width();
        let (left, right) = (x.round() as i32, (x + width).round() as i32);
        let center = (x + width / 2.0).round() as i32;
        let corners = [(left, middle - 90), (right, middle + 90)];
        match *swatch {
            Swatch::Curve(color, style) if style.is_line() => {
                drawing.piece(vec![(left, middle), (right, middle)], color, style);
            }
            Swatch::Curve(color, CurveStyle::OpenPoints) => {
                drawing.circle((center, middle), POINT_RADIUS, color, Some(THIN_STROKE));
            }
            Swatch::Curve(color, CurveStyle::Dots) => drawing.piece(vec![(center, middle)], color, CurveStyle::Points),
            Swatch::Curve(color, style) => drawing.piece(vec![(center, middle)], color, style),
            Swatch::Ground(color, opacity) => drawing.rectangle(corners, (color, opacity)),
            Swatch::Event(kind) => {
                let line = vec![(center, middle - 110), (center, middle + 110)];
                drawing.line(line, (of_event(kind), THIN_STROKE + 4), line_of_event(kind));
            }
            Swatch::Cell(cell) => {
                drawing.cell(cell, corners);
                drawing.frame(corners, GREY);
            }
        }
        write(drawing, name, LABEL_SIZE, (x + width + SWATCH_GAP, y));
    }
}

/// A measured panel, and where its axes are.
struct Plane<'a> {
    m: &'a MeasuredText<'a>,
    /// Left and right edge, top and bottom edge.
    x: (i32, i32),
    y: (i32, i32),
}

/// The place of a shown value between the ends of an axis, which has the shown range.
fn along(value: f64, (low, high): (f64, f64), (start, end): (i32, i32)) -> i32 {
    let (share, length) = ((value - low) / (high - low), f64::from(end - start));
    match share {
        f64::INFINITY => end,
        f64::NEG_INFINITY => start,
        // A hair further, so that rounding does not end before the value.
        _ if length > 0.0 => start + (length * share + 1e-3).floor() as i32,
        _ => start + (length * share - 1e-3).ceil() as i32,
    }
}

impl Plane<'_> {
    fn across(&self, shown: f64) -> i32 {
        along(shown, self.m.x.shown, self.x)
    }

    fn up(&self, shown: f64) -> i32 {
        along(shown, self.m.y.shown, (self.y.1, self.y.0))
    }

    fn shown(&self, x: f64, y: f64) -> DrawnPoint {
        (self.across(x), self.up(y))
    }

    fn place(&self, (x, y): (f64, f64)) -> DrawnPoint {
        self.shown(self.m.x.show(x), self.m.y.show(y))
    }
}

/// `left` and `right`: widths beside the axes. `top` and `bottom`: edges of the panel with its caption and labels.
fn draw_panel(drawing: &mut Drawing, m: &MeasuredText, (left, right): (f64, f64), (top, bottom): (i32, i32)) {
    if !m.panel.caption.is_empty() {
        let below = (0.1 * LINE_HEIGHT).round() as i32;
        drawing.text(
            &m.panel.caption,
            LABEL_SIZE,
            (left.round() as i32, top + below),
            UPPER_LEFT,
            0,
        );
    }
    let first = MARGIN.round() as i32 + (left - MARGIN).round() as i32;
    let plane = &Plane {
        m,
        x: (first, drawing.size.0 as i32 - right.round() as i32 - 1),
        y: (
            top + caption_height(m).round() as i32,
            bottom - label_height(m).round() as i32 - 1,
        ),
    };
    for &(from, to, mode) in &m.panel.modes {
        let (from, to) = (m.x.show(from).max(m.x.shown.0), m.x.show(to).min(m.x.shown.1));
        drawing.rectangle(
            [(plane.across(from), plane.y.1), (plane.across(to), plane.y.0)],
            ground(mode),
        );
    }
    draw_mesh(drawing, plane, bottom);
    for x in m.x.minor_ticks().into_iter().map(|x| plane.across(x)) {
        tick(drawing, [(x, plane.y.1), (x, plane.y.1 + MINOR_TICK)], THIN_STROKE);
    }
    for y in m.y.minor_ticks().into_iter().map(|y| plane.up(y)) {
        tick(drawing, [(plane.x.0, y), (plane.x.0 - MINOR_TICK, y)], THIN_STROKE);
    }
    draw_content(drawing, plane);
}

fn tick(drawing: &mut Drawing, ends: [DrawnPoint; 2], width: u32) {
    drawing.line(ends.into(), (BLACK, width), CurveStyle::Solid);
}

fn draw_content(drawing: &mut Drawing, plane: &Plane) {
    let m = plane.m;
    if let Some(map) = &m.panel.map {
        draw_map(drawing, plane, map);
    }
    for area in &m.panel.areas {
        for piece in &area.pieces {
            let lower = piece.iter().map(|&(x, low, _)| plane.place((x, low)));
            let upper = piece.iter().rev().map(|&(x, _, high)| plane.place((x, high)));
            drawing.polygon(lower.chain(upper).collect(), (area.color, AREA_OPACITY));
        }
    }
    for &(at, kind) in &m.marks {
        let x = plane.across(m.x.show(at));
        let line = vec![(x, plane.y.1), (x, plane.y.0)];
        drawing.line(line, (of_event(kind), THIN_STROKE + 2), line_of_event(kind));
    }
    // Labels interrupt thin lines, which they name, and no others.
    let high = (0.55 * LABEL_SIZE) as i32;
    let (thin, others): (Vec<&Curve>, Vec<&Curve>) =
        (m.panel.curves.iter()).partition(|curve| curve.style == CurveStyle::Thin && !m.panel.labels.is_empty());
    for curve in thin {
        draw_curve(drawing, plane, curve);
    }
    for (at, text) in &m.panel.labels {
        let (x, y) = plane.place(*at);
        let half = (text_width(text, LABEL_SIZE) / 2.0 + 40.0) as i32;
        drawing.rectangle([(x - half, y - high), (x + half, y + high)], (WHITE, 1.0));
    }
    for curve in others {
        draw_curve(drawing, plane, curve);
    }
    for (at, text) in &m.panel.labels {
        drawing.text(text, LABEL_SIZE, plane.place(*at), CENTRE, 0);
    }
}

/// Grid, axes, ticks, and their labels. `bottom`: lower edge of the labels.
fn draw_mesh(drawing: &mut Drawing, plane: &Plane, bottom: i32) {
    let (m, (left, right), (top, low)) = (plane.m, plane.x, plane.y);
    let edge = MARGIN.round() as i32;
    drawing.text(
        &m.y_title,
        LABEL_SIZE,
        (edge, top + (low + 1 - top) / 2),
        UPPER_MIDDLE,
        270,
    );
    if m.last {
        let title = fitting_title(&m.x, &m.panel.x, m.width);
        drawing.text(
            &title,
            LABEL_SIZE,
            (left + (right + 1 - left) / 2, bottom),
            LOWER_MIDDLE,
            0,
        );
    }
    let ((x_ticks, x_decimals), (y_ticks, y_decimals)) = (m.x.ticks(m.x_ticks), m.y.ticks(m.y_ticks));
    let x_ticks: Vec<(i32, f64)> = x_ticks.into_iter().map(|tick| (plane.across(tick), tick)).collect();
    let y_ticks: Vec<(i32, f64)> = y_ticks.into_iter().map(|tick| (plane.up(tick), tick)).collect();
    // Grid lines would look out at the edges of a map.
    if m.panel.map.as_ref().is_none_or(|map| map.cells.is_empty()) {
        let across = x_ticks.iter().map(|&(x, _)| [(x, low), (x, top)]);
        let up = y_ticks.iter().map(|&(y, _)| [(left, y), (right, y)]);
        across.chain(up).for_each(|line| drawing.grid_line(line, (GREY, 0.3)));
    }
    let axis = left - 1;
    tick(drawing, [(axis, top), (axis, low)], AXIS_STROKE);
    for (y, value) in y_ticks {
        drawing.text(
            &m.y.label(value, y_decimals),
            LABEL_SIZE,
            (left - 2 * TICK, y),
            RIGHT_MIDDLE,
            0,
        );
        tick(drawing, [(axis - TICK, y), (axis, y)], AXIS_STROKE);
    }
    let axis = low + 1;
    tick(drawing, [(left, axis), (right, axis)], AXIS_STROKE);
    for (x, value) in x_ticks {
        if m.last {
            drawing.text(
                &m.x.label(value, x_decimals),
                LABEL_SIZE,
                (x, axis + 2 * TICK),
                UPPER_MIDDLE,
                0,
            );
        }
        tick(drawing, [(x, axis), (x, axis + TICK)], AXIS_STROKE);
    }
}

fn draw_curve(drawing: &mut Drawing, plane: &Plane, curve: &Curve) {
    for piece in &curve.pieces {
        let points: Vec<DrawnPoint> = piece.iter().map(|&point| plane.place(point)).collect();
        match points.first() {
            // A line without length in the drawing is only visible as a dot.
            Some(&first) if curve.style.is_line() && points.iter().all(|point| *point == first) => {
                drawing.circle(first, CURVE_STROKE, curve.color, None);
            }
            None if curve.style.is_line() => {}
            _ => drawing.piece(points, curve.color, curve.style),
        }
    }
}

fn step(scale: &Scale, value: f64) -> usize {
    let share = (scale.show(value) - scale.shown.0) / (scale.shown.1 - scale.shown.0);
    ((share * COLORS as f64) as usize).min(COLORS - 1)
}

fn color_of(step: usize) -> RGBColor {
    shade((step as f64 + 0.5) / COLORS as f64)
}

fn draw_color_bar(drawing: &mut Drawing, axis: &Axis, scale: &Scale, (left, right): (f64, f64), y: f64) {
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
    write(drawing, &title, LABEL_SIZE, (start, y));
    let (top, bottom) = ((y + LINE_HEIGHT).round() as i32, (y + LINE_HEIGHT + BAR).round() as i32);
    let at = |share: f64| (left + share * width).round() as i32;
    for step in 0..COLORS {
        // The rectangle extends to the end of the bar, so that no background is visible between it and the next.
        let corners = [(at(step as f64 / COLORS as f64), top), (at(1.0), bottom)];
        drawing.rectangle(corners, (color_of(step), 1.0));
    }
    drawing.frame([(at(0.0), top), (at(1.0), bottom)], BLACK);
    let place = |tick: f64| at((tick - scale.shown.0) / (scale.shown.1 - scale.shown.0));
    for x in scale.minor_ticks().into_iter().map(place) {
        tick(drawing, [(x, bottom), (x, bottom + MINOR_TICK)], THIN_STROKE);
    }
    let (ticks, decimals) = scale.ticks(fitting_ticks(scale, width, 10));
    for value in ticks {
        let x = place(value);
        tick(drawing, [(x, bottom), (x, bottom + TICK)], AXIS_STROKE);
        let label = scale.label(value, decimals);
        // The first and the last number stay within the figure.
        let half = (text_width(&label, LABEL_SIZE) / 2.0).ceil() as i32;
        let middle = x.clamp(half + 20, (right + MARGIN) as i32 - half);
        drawing.text(&label, LABEL_SIZE, (middle, bottom + 2 * TICK), UPPER_MIDDLE, 0);
    }
}

/// Joins neighbouring cells of one colour in one rectangle.
fn draw_map(drawing: &mut Drawing, plane: &Plane, map: &Map) {
    let (m, columns) = (plane.m, map.x_edges.len().saturating_sub(1));
    if columns == 0 {
        return;
    }
    let color = |cell: Cell| match (cell, &map.key, &m.colors) {
        (Cell::Value(value), ColorKey::Codes(codes), _) => {
            let place = codes.iter().position(|(code, _)| *code as f64 == value);
            place.map(|place| shade_of_code(place, codes.len()))
        }
        (Cell::Value(value), ColorKey::Scale(_), Some((_, scale))) => Some(color_of(step(scale, value))),
        _ => None,
    };
    let more = |(low, high): (f64, f64), size: f64| CELL_OVERLAP * (high - low) / size;
    let (more_x, more_y) = (more(m.x.shown, m.width), more(m.y.shown, m.height));
    for (cells, edges) in map.cells.chunks(columns).zip(map.y_edges.windows(2)) {
        let (low, high) = (m.y.show(edges[0]), m.y.show(edges[1]));
        let mut column = 0;
        while column < cells.len() {
            let own = color(cells[column]);
            let mut end = column + 1;
            while own.is_some() && end < cells.len() && color(cells[end]) == own {
                end += 1;
            }
            let (left, right) = (m.x.show(map.x_edges[column]), m.x.show(map.x_edges[end]));
            let lower = plane.shown(left, low);
            match own {
                Some(color) => {
                    let (right, high) = ((right + more_x).min(m.x.shown.1), (high + more_y).min(m.y.shown.1));
                    drawing.rectangle([lower, plane.shown(right, high)], (color, 1.0));
                }
                None => drawing.cell(cells[column], [lower, plane.shown(right, high)]),
            }
            column = end;
        }
    }
}
