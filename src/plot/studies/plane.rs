//! A quantity over one axis, and over two: cells of a grid, dots of a sample; its distribution over a sample, and its
//! dependence on each axis.

use super::data::{self, StudyColumn, StudyData};
use super::{Choice, refused};
use crate::Error;
use crate::plot::critical::Boundary;
use crate::plot::figure::{Area, Axis, Cell, ColorKey, Curve, CurveStyle, Figure, Map, Panel, drawn, extent};
use crate::plot::style::{self, BLACK, BLUE, GREY, SKY, VERMILLION};
use stickslip_analysis::analysis::distribution::{Distribution, PERCENTILES};

const PANELS: usize = 6;
const SHADES: usize = 16;
/// Ratio of the largest to the least value from which on a colour scale is logarithmic.
const DECADES: f64 = 100.0;

fn levels(data: &StudyData, axis: usize, points: &[usize]) -> Vec<f64> {
    data::levels(points.iter().map(|&point| data.axes[axis].values[point]))
}

pub(super) fn or_curves(data: &StudyData, quantity: &StudyColumn, choice: &Choice) -> Result<Figure, Error> {
    let mut selection = selected(data, choice)?;
    let mut open: Vec<usize> = (0..data.axes.len())
        .filter(|&axis| levels(data, axis, &selection.points).len() > 1)
        .collect();
    let [x, y] = match (&choice.axes, plane_of(data, &open), &open[..]) {
        (Some([x, y]), ..) => [data.axis(x)?, data.axis(y)?],
        (None, Some(plane), _) => plane,
        (None, None, [x]) => return Ok(curves(data, quantity, *x, &selection)),
        (None, None, _) => {
            let why = "one point alone, which is no figure; `stickslip inspect` lists its values";
            return refused(&data.path, why);
        }
    };
    if x == y {
        let key = &data.axes[x].keys[0];
        return refused(&data.path, format!("{key} against {key} is no plane; name two axes"));
    }
    open.retain(|&axis| axis != x && axis != y);
    // The axis with the most levels is held at its middle level until the panels fit a figure.
    loop {
        let counts: Vec<usize> = open
            .iter()
            .map(|&axis| levels(data, axis, &selection.points).len())
            .collect();
        if counts.iter().product::<usize>() <= PANELS {
            break;
        }
        let most = (0..open.len()).max_by_key(|&place| counts[place]).unwrap_or(0);
        let axis = open.remove(most);
        let levels = levels(data, axis, &selection.points);
        let value = levels[levels.len() / 2];
        let own = &data.axes[axis];
        selection.points.retain(|&point| own.values[point] == value);
        selection
            .held
            .push(format!("{} (one of {})", own.said(value), levels.len()));
    }
    let key = key(quantity, &selection.points);
    let facets = facets(data, &open, &selection.points).into_iter();
    let panels = facets.map(|(caption, points)| map(data, quantity, [x, y], &points, &key).captioned(caption));
    let shows = format!("{}{}", quantity.long_name, selection.said());
    Ok(data.figure(format!("map-{}", quantity.name), &shows, panels.collect()))
}

/// The plane of the first two varying axes.
pub(super) fn first(data: &StudyData) -> Option<[usize; 2]> {
    let varying: Vec<usize> = (0..data.axes.len()).filter(|&axis| data.axes[axis].varies()).collect();
    plane_of(data, &varying)
}

/// The first two axes, numbers before words: words have no distances.
fn plane_of(data: &StudyData, axes: &[usize]) -> Option<[usize; 2]> {
    let mut order = axes.to_vec();
    order.sort_by_key(|&axis| !data.axes[axis].flags.is_empty());
    let [x, y] = *order.first_chunk()?;
    Some([x.min(y), x.max(y)])
}

/// Points grouped by their values on the axes outside the plane. The text names these values.
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

fn key(quantity: &StudyColumn, points: &[usize]) -> ColorKey {
    let values: Vec<f64> = points.iter().map(|&point| quantity.values[point]).collect();
    if !quantity.flags.is_empty() {
        let there = |code: i64| values.contains(&(code as f64));
        return ColorKey::Codes(quantity.flags.iter().filter(|flag| there(flag.0)).cloned().collect());
    }
    let (low, high) = extent(values).unwrap_or((0.0, 1.0));
    let by_powers = low > 0.0 && high >= DECADES * low;
    ColorKey::Scale(quantity.axis().ranging(low, high).logarithmic(by_powers))
}

/// Edges of cells: midpoints between the levels, or their geometric means on a logarithmic axis.
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

fn map(data: &StudyData, quantity: &StudyColumn, [x, y]: [usize; 2], points: &[usize], key: &ColorKey) -> Panel {
    let side = |axis: usize| {
        let own = &data.axes[axis];
        let levels = levels(data, axis, points);
        let edges = edges(&levels, own.logarithmic);
        let drawn = own.axis().ranging(edges[0], edges[edges.len() - 1]);
        (levels, edges, drawn)
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
    let key = key.clone();
    let map = Some(Map {
        x_edges,
        y_edges,
        cells,
        key,
    });
    Panel {
        map,
        ..Panel::new(x_axis, y_axis, Vec::new())
    }
}

pub(super) fn dots(
    data: &StudyData,
    quantity: &StudyColumn,
    choice: &Choice,
    boundary: Option<Boundary>,
) -> Result<Figure, Error> {
    let selection = selected(data, choice)?;
    let varying = || (0..data.axes.len()).filter(|&axis| data.axes[axis].varies());
    let [x, y] = match (&choice.axes, &boundary) {
        (Some([x, y]), _) => [data.axis(x)?, data.axis(y)?],
        (None, Some(boundary)) => [data.axis(&boundary.x)?, data.axis(&boundary.y)?],
        (None, None) => match plane_of(data, &varying().collect::<Vec<_>>()) {
            Some(plane) => plane,
            None => return refused(&data.path, "its points differ in one axis alone, which makes no plane"),
        },
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
    let style = CurveStyle::of_many(selection.points.len(), 400, CurveStyle::Points);
    let mut curves = Vec::new();
    curves.push(Curve::line("no value", GREY, nothing).styled(style));
    for (number, points) in groups.into_iter().enumerate().filter(|group| !group.1.is_empty()) {
        let (label, color) = match &key {
            ColorKey::Codes(codes) => (codes[number].1.as_str(), style::shade_of_code(number, codes.len())),
            ColorKey::Scale(_) => ("", style::shade((number as f64 + 0.5) / SHADES as f64)),
        };
        curves.push(Curve::line(label, color, points).styled(style));
    }
    curves.push(Curve::open("failed", BLACK, failed));
    let mut panel = Panel::new(data.axes[x].axis(), data.axes[y].axis(), drawn(curves));
    if let Some(boundary) = boundary {
        let same = [data.axes[x].name.as_str(), data.axes[y].name.as_str()] == [&boundary.x, &boundary.y];
        if same {
            panel.curves.extend(boundary.curves);
        }
    }
    // An empty map provides the colour scale.
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
    let mut words = format!("{}{}", quantity.long_name, selection.said());
    if !beside.is_empty() && selection.held.is_empty() {
        words += &format!(", whatever {}", beside.join(", "));
    }
    Ok(data.figure(format!("plane-{}", quantity.name), &words, vec![panel]))
}

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

/// A point for each run. Failed runs are on the lower edge.
fn curves(data: &StudyData, quantity: &StudyColumn, x: usize, selection: &Selection) -> Figure {
    let own = &data.axes[x];
    let mut points = selection.points.clone();
    points.sort_by(|&a, &b| own.values[a].total_cmp(&own.values[b]));
    let (mut pieces, mut failed) = (vec![Vec::new()], Vec::new());
    for point in points {
        let x = own.values[point];
        match (data.cell(point, quantity), pieces.last_mut()) {
            (Cell::Value(value), Some(piece)) => piece.push((x, value)),
            (cell, _) => {
                failed.extend((cell == Cell::Failed).then_some(x));
                // A line would hide the missing value.
                pieces.push(Vec::new());
            }
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    let all: Vec<(f64, f64)> = pieces.iter().flatten().copied().collect();
    let (lowest, _) = extent(all.iter().map(|point| point.1)).unwrap_or((0.0, 0.0));
    let line = Curve::pieces("", BLUE, pieces).styled(CurveStyle::Thin);
    let failed = failed.into_iter().map(|x| (x, lowest)).collect();
    let curves = drawn([
        line,
        Curve::filled("", BLUE, all),
        Curve::open("failed", VERMILLION, failed),
    ]);
    let shows = format!("{}{}", quantity.long_name, selection.said());
    let panels = vec![Panel::new(own.axis(), quantity.axis(), curves)];
    data.figure(format!("curves-{}", quantity.name), &shows, panels)
}

pub(super) struct Selection {
    pub points: Vec<usize>,
    /// Axes that are held constant, in words.
    pub held: Vec<String>,
}

impl Selection {
    pub(super) fn said(&self) -> String {
        match self.held.is_empty() {
            true => String::new(),
            false => format!(", at {}", self.held.join(", ")),
        }
    }
}

pub(super) fn selected(data: &StudyData, choice: &Choice) -> Result<Selection, Error> {
    let mut points: Vec<usize> = (0..data.status.len()).collect();
    let mut held = Vec::new();
    for (name, text) in &choice.at {
        let axis = &data.axes[data.axis(name)?];
        let wish = match axis.flags.iter().position(|(_, word)| word == text) {
            Some(code) => code as f64,
            None => text.parse().unwrap_or(f64::NAN),
        };
        // Relative to the value, so that no value is close to infinity.
        let close = |value: f64| (value - wish).abs() <= 1e-6 * value.abs();
        let Some(value) = axis.values.iter().copied().find(|value| close(*value)) else {
            let levels = data::levels(axis.values.iter().copied());
            let more = if levels.len() > 12 { ", ..." } else { "" };
            let levels: Vec<String> = levels.iter().take(12).map(|level| axis.said(*level)).collect();
            let (key, levels) = (&axis.keys[0], levels.join(", "));
            return refused(
                &data.path,
                format!("no point has {key}={text}; there are {levels}{more}"),
            );
        };
        points.retain(|&point| axis.values[point] == value);
        held.push(axis.said(value));
    }
    if points.is_empty() {
        return refused(&data.path, "no point has all of these values; ask for fewer with --at");
    }
    Ok(Selection { points, held })
}

/// Number of drawn axes, those with the strongest dependence.
const AXES: usize = 6;

/// Histogram with percentiles, and dots over each varying axis, by decreasing rank correlation.
pub(super) fn samples(data: &StudyData, quantity: &StudyColumn) -> Result<Figure, Error> {
    let Some(distribution) = Distribution::of(&quantity.values, quantity.whole) else {
        let name = &quantity.name;
        return refused(
            &data.path,
            format!("no run has a value of {name}, which leaves nothing to draw; name another with --quantity"),
        );
    };
    let mut panels = vec![histogram(quantity, &distribution)];
    let mut axes: Vec<(f64, &StudyColumn)> = data
        .axes
        .iter()
        .filter(|axis| axis.varies())
        .map(|axis| (rank_correlation(&axis.values, &quantity.values), axis))
        .collect();
    axes.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    let all = axes.len();
    for (correlation, axis) in axes.into_iter().take(AXES) {
        let points: Vec<(f64, f64)> = axis
            .values
            .iter()
            .zip(&quantity.values)
            .filter(|(_, value)| value.is_finite())
            .map(|(x, y)| (*x, *y))
            .collect();
        let style = CurveStyle::of_many(points.len(), 400, CurveStyle::OpenPoints);
        let dots = Curve::line("", BLUE, points).styled(style);
        let mut panel = Panel::new(axis.axis(), quantity.axis(), vec![dots]);
        if axis.flags.is_empty() {
            panel.caption = format!("rank correlation {}", crate::plot::scale::number(correlation, 2));
        }
        panels.push(panel);
    }
    let mut words = format!("{}, {} runs", quantity.long_name, distribution.count);
    if distribution.without > 0 {
        words += &format!(" and {} without", distribution.without);
    }
    if all > AXES {
        words += &format!("; the {AXES} of {all} axes that matter most");
    }
    Ok(data.figure(format!("samples-{}", quantity.name), &words, panels))
}

fn histogram(quantity: &StudyColumn, distribution: &Distribution) -> Panel {
    let pieces = distribution
        .bars
        .iter()
        .filter(|bar| bar.2 > 0)
        .map(|&(from, to, count)| vec![(from, 0.0, count as f64), (to, 0.0, count as f64)]);
    let highest = distribution.bars.iter().map(|bar| bar.2).max().unwrap_or(0) as f64;
    let outline = distribution.bars.iter().flat_map(|&(from, to, count)| {
        let count = count as f64;
        [(from, 0.0), (from, count), (to, count), (to, 0.0)]
    });
    let percentile = |wish: f64| {
        let place = PERCENTILES.iter().position(|percent| *percent == wish).unwrap_or(0);
        distribution.percentiles[place]
    };
    let upright = |x: f64| vec![(x, 0.0), (x, 1.05 * highest)];
    let ends = vec![upright(percentile(5.0)), upright(percentile(95.0))];
    let ends = Curve::pieces("5 % and 95 %", BLACK, ends).styled(CurveStyle::Dashed);
    let median = Curve::line("median", BLACK, upright(percentile(50.0)));
    let outline = Curve::line("", BLUE, outline.collect()).styled(CurveStyle::Thin);
    let mut panel = Panel::new(
        quantity.axis(),
        Axis::new("runs", "1").ranging(0.0, 1.1 * highest),
        vec![outline, ends, median],
    );
    panel.areas = vec![Area::unnamed(SKY, pieces.collect())];
    panel
}

/// Spearman's coefficient over the points that have both values; 0 if one of the two does not vary.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> f64 {
    let both: Vec<(f64, f64)> = x
        .iter()
        .zip(y)
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .map(|(x, y)| (*x, *y))
        .collect();
    let ranks = |value: fn(&(f64, f64)) -> f64| {
        let mut order: Vec<usize> = (0..both.len()).collect();
        order.sort_by(|&a, &b| value(&both[a]).total_cmp(&value(&both[b])));
        let mut ranks = vec![0.0; both.len()];
        let mut start = 0;
        while start < order.len() {
            let own = value(&both[order[start]]);
            let end = start + order[start..].iter().take_while(|&&k| value(&both[k]) == own).count();
            // Equal values share their mean rank.
            for &k in &order[start..end] {
                ranks[k] = 0.5 * (start + end - 1) as f64;
            }
            start = end;
        }
        ranks
    };
    let (a, b) = (ranks(|point| point.0), ranks(|point| point.1));
    let mean = 0.5 * (both.len().max(1) - 1) as f64;
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
    let size = (product(&a, &a) * product(&b, &b)).sqrt();
    if size > 0.0 { product(&a, &b) / size } else { 0.0 }
}
