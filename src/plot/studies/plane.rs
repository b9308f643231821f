//! A quantity over two axes: cells of a grid, dots of a sample.

use super::data::{StudyData, StudyQuantity, extent};
use super::selection::selected;
use super::{Choice, curves, refused, title};
use crate::plot::PlotError;
use crate::plot::colors;
use crate::plot::critical::Boundary;
use crate::plot::figure::{Axis, Cell, ColorKey, Curve, CurveStyle, Figure, Map, Panel};
use crate::plot::style::{BLACK, GREY};

/// Panels below each other in one figure.
const PANELS: usize = 6;
/// Colours of dots.
const SHADES: usize = 16;
/// From this ratio on a scale of colours shows powers of ten.
const DECADES: f64 = 100.0;

/// The levels of an axis among some points, in order.
fn levels(data: &StudyData, axis: usize, points: &[usize]) -> Vec<f64> {
    let mut levels: Vec<f64> = points.iter().map(|&point| data.axes[axis].values[point]).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

/// A map of a grid, or curves if only one axis of it has several levels.
pub(super) fn or_curves(data: &StudyData, quantity: &StudyQuantity, choice: &Choice) -> Result<Figure, PlotError> {
    let mut selection = selected(data, choice)?;
    let mut open: Vec<usize> = (0..data.axes.len())
        .filter(|&axis| levels(data, axis, &selection.points).len() > 1)
        .collect();
    let [x, y] = match &choice.axes {
        Some([x, y]) => [data.axis(x)?, data.axis(y)?],
        None => {
            // Numbers first: the words of an axis have no distances.
            let mut order = open.clone();
            order.sort_by_key(|&axis| !data.axes[axis].words.is_empty());
            match order[..] {
                [x, y, ..] => [x.min(y), x.max(y)],
                [x] => return curves::figure(data, quantity, x, &selection),
                [] => {
                    return Err(refused(
                        data,
                        "one point alone, which is no figure; `stickslip inspect` lists its values".to_owned(),
                    ));
                }
            }
        }
    };
    if x == y {
        return Err(refused(
            data,
            format!("{0} against {0} is no plane; name two axes", data.axes[x].keys[0]),
        ));
    }
    open.retain(|&axis| axis != x && axis != y);
    // As many panels as a figure has; the axis with most levels is held in its middle.
    loop {
        let counts: Vec<usize> = open
            .iter()
            .map(|&axis| levels(data, axis, &selection.points).len())
            .collect();
        if counts.iter().product::<usize>() <= PANELS {
            break;
        }
        let (place, _) = counts
            .iter()
            .enumerate()
            .max_by_key(|(_, count)| **count)
            .unwrap_or((0, &0));
        let axis = open.remove(place);
        let levels = levels(data, axis, &selection.points);
        let value = levels[levels.len() / 2];
        let own = &data.axes[axis];
        selection.points.retain(|&point| own.values[point] == value);
        selection
            .held
            .push(format!("{} (one of {})", own.said(value), levels.len()));
    }
    let key = key(quantity, &selection.points);
    let mut panels = Vec::new();
    for (caption, points) in facets(data, &open, &selection.points) {
        let mut panel = map(data, quantity, [x, y], &points, &key);
        panel.caption = caption;
        panels.push(panel);
    }
    let held = if selection.held.is_empty() {
        String::new()
    } else {
        format!(", at {}", selection.held.join(", "))
    };
    Ok(Figure {
        name: format!("map-{}", quantity.name),
        title: title(data, &format!("{}{held}", quantity.long_name)),
        paper_figure: None,
        panels,
    })
}

/// The points by their values on the axes beside the plane, with these in words.
fn facets(data: &StudyData, beside: &[usize], points: &[usize]) -> Vec<(String, Vec<usize>)> {
    let mut facets: Vec<(Vec<f64>, Vec<usize>)> = Vec::new();
    for &point in points {
        let place: Vec<f64> = beside.iter().map(|&axis| data.axes[axis].values[point]).collect();
        match facets.iter_mut().find(|facet| facet.0 == place) {
            Some(facet) => facet.1.push(point),
            None => facets.push((place, vec![point])),
        }
    }
    let said = |place: &[f64]| {
        let words = beside
            .iter()
            .zip(place)
            .map(|(&axis, &value)| data.axes[axis].said(value));
        words.collect::<Vec<_>>().join(", ")
    };
    facets
        .into_iter()
        .map(|(place, points)| (said(&place), points))
        .collect()
}

/// What the colours mean, over all points that are drawn.
fn key(quantity: &StudyQuantity, points: &[usize]) -> ColorKey {
    let values: Vec<f64> = points.iter().map(|&point| quantity.values[point]).collect();
    if !quantity.flags.is_empty() {
        let there = |code: i64| values.contains(&(code as f64));
        return ColorKey::Codes(quantity.flags.iter().filter(|flag| there(flag.0)).cloned().collect());
    }
    let (low, high) = extent(&values);
    let axis = quantity.axis().ranging(low, high);
    ColorKey::Scale(if low > 0.0 && high >= DECADES * low {
        axis.by_powers()
    } else {
        axis
    })
}

/// Where cells around these levels begin and end: in the middle between them, on a logarithmic axis of their logarithms.
fn edges(levels: &[f64], logarithmic: bool) -> Vec<f64> {
    let to = |value: f64| if logarithmic { value.ln() } else { value };
    let back = |value: f64| if logarithmic { value.exp() } else { value };
    let places: Vec<f64> = levels.iter().map(|level| to(*level)).collect();
    let [first, .., last] = places[..] else {
        let half = if places[0] == 0.0 { 0.5 } else { 0.05 * places[0].abs() };
        return vec![back(places[0] - half), back(places[0] + half)];
    };
    let middles: Vec<f64> = places.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    let ends = (2.0 * first - middles[0], 2.0 * last - middles[middles.len() - 1]);
    let all = std::iter::once(ends.0).chain(middles).chain([ends.1]);
    all.map(back).collect()
}

fn map(data: &StudyData, quantity: &StudyQuantity, [x, y]: [usize; 2], points: &[usize], key: &ColorKey) -> Panel {
    let side = |axis: usize| {
        let own = &data.axes[axis];
        let logarithmic = own.words.is_empty() && own.is_logarithmic();
        let levels = levels(data, axis, points);
        let edges = edges(&levels, logarithmic);
        let drawn = own.axis().ranging(edges[0], edges[edges.len() - 1]);
        (levels, edges, if logarithmic { drawn.by_powers() } else { drawn })
    };
    let (columns, x_edges, x_axis) = side(x);
    let (rows, y_edges, y_axis) = side(y);
    let mut cells = vec![Cell::Missing; columns.len() * rows.len()];
    let place = |levels: &[f64], value: f64| levels.iter().position(|level| *level == value).unwrap_or(0);
    for &point in points {
        let column = place(&columns, data.axes[x].values[point]);
        let row = place(&rows, data.axes[y].values[point]);
        cells[row * columns.len() + column] = data.cell(point, quantity);
    }
    let mut panel = Panel::new(x_axis, y_axis, Vec::new());
    panel.map = Some(Map {
        x_edges,
        y_edges,
        cells,
        key: key.clone(),
    });
    panel
}

/// Dots at the points of a sample or of a boundary, in the colours of a quantity.
pub(super) fn dots(
    data: &StudyData,
    quantity: &StudyQuantity,
    choice: &Choice,
    boundary: Option<Boundary>,
) -> Result<Figure, PlotError> {
    let selection = selected(data, choice)?;
    let varying = || (0..data.axes.len()).filter(|&axis| data.axes[axis].varies());
    let [x, y] = match (&choice.axes, &boundary) {
        (Some([x, y]), _) => [data.axis(x)?, data.axis(y)?],
        (None, Some(boundary)) => [data.axis(&boundary.x)?, data.axis(&boundary.y)?],
        (None, None) => {
            let mut order: Vec<usize> = varying().collect();
            order.sort_by_key(|&axis| !data.axes[axis].words.is_empty());
            match order[..] {
                [x, y, ..] => [x.min(y), x.max(y)],
                _ => {
                    return Err(refused(
                        data,
                        "its points differ in one axis alone, which makes no plane".to_owned(),
                    ));
                }
            }
        }
    };
    let key = key(quantity, &selection.points);
    let mut groups: Vec<Vec<(f64, f64)>> = vec![Vec::new(); SHADES];
    let (mut nothing, mut failed) = (Vec::new(), Vec::new());
    for &point in &selection.points {
        let place = (data.axes[x].values[point], data.axes[y].values[point]);
        match data.cell(point, quantity) {
            Cell::Value(value) => groups[shade(&key, value)].push(place),
            Cell::Nothing => nothing.push(place),
            Cell::Failed => failed.push(place),
            Cell::Missing => {}
        }
    }
    let many = selection.points.len() > 400;
    let style = if many { CurveStyle::Dots } else { CurveStyle::Points };
    let mut curves = Vec::new();
    if !nothing.is_empty() {
        curves.push(Curve::line("no value", GREY, nothing).styled(style));
    }
    for (number, points) in groups.into_iter().enumerate().filter(|group| !group.1.is_empty()) {
        let (label, color) = match &key {
            ColorKey::Codes(codes) => (codes[number].1.as_str(), colors::of_code(number, codes.len())),
            ColorKey::Scale(_) => ("", colors::at((number as f64 + 0.5) / SHADES as f64)),
        };
        curves.push(Curve::line(label, color, points).styled(style));
    }
    if !failed.is_empty() {
        curves.push(Curve::line("failed", BLACK, failed).styled(CurveStyle::OpenPoints));
    }
    let axis = |axis: usize| {
        let own = &data.axes[axis];
        let drawn = own.axis();
        if own.is_logarithmic() { drawn.by_powers() } else { drawn }
    };
    let mut panel = Panel::new(axis(x), axis(y), curves);
    if let Some(boundary) = boundary {
        let same = [data.axes[x].name.as_str(), data.axes[y].name.as_str()] == [&boundary.x, &boundary.y];
        if same {
            panel.curves.extend(boundary.curves);
        }
    }
    // An empty map, for its scale of colours.
    if matches!(key, ColorKey::Scale(_)) {
        panel.map = Some(Map {
            x_edges: Vec::new(),
            y_edges: Vec::new(),
            cells: Vec::new(),
            key,
        });
    }
    let beside: Vec<String> = varying()
        .filter(|&axis| axis != x && axis != y)
        .map(|axis| data.axes[axis].axis().label())
        .collect();
    let mut words = quantity.long_name.clone();
    if !selection.held.is_empty() {
        words += &format!(", at {}", selection.held.join(", "));
    }
    if !beside.is_empty() && selection.held.is_empty() {
        words += &format!(", whatever {}", beside.join(", "));
    }
    Ok(Figure {
        name: format!("plane-{}", quantity.name),
        title: title(data, &words),
        paper_figure: None,
        panels: vec![panel],
    })
}

/// Which colour a value has; its place among the codes.
fn shade(key: &ColorKey, value: f64) -> usize {
    match key {
        ColorKey::Codes(codes) => codes.iter().position(|code| code.0 as f64 == value).unwrap_or(0),
        ColorKey::Scale(axis @ Axis { range, .. }) => {
            let (low, high) = range.unwrap_or((0.0, 1.0));
            let share = if axis.logarithmic {
                (value / low).ln() / (high / low).ln()
            } else {
                (value - low) / (high - low)
            };
            ((share * SHADES as f64) as usize).min(SHADES - 1)
        }
    }
}
