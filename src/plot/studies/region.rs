//! Region of a calibration: where the required targets are met, for each pair of parameters.

use super::data::{StudyColumn, StudyData};
use super::refused;
use crate::Error;
use crate::plot::figure::{Axis, Curve, CurveStyle, Figure, Panel, drawn, extent};
use crate::plot::html::Overlay;
use crate::plot::style::{BLACK, BLUE, GREY, ORANGE, RGBColor, VERMILLION};
use stickslip_files::StudyFile;

/// Largest residual that is coloured. Colours outside the region show the slope there.
const NEAR: f64 = 4.0;
/// Margin around the enlarged region, as a share of its width.
const ROOM: f64 = 0.15;
const HELD: f64 = 0.0;

/// Calibration result for a parameter; NaN for values that are not in the file.
struct RegionParameter {
    optimum: f64,
    compromise: f64,
    range: (f64, f64),
    least: f64,
    largest: f64,
}

/// A figure for each pair of parameters, with the ranges, and the region enlarged. A single one has its residual.
pub(super) fn figures(file: &StudyFile, data: &StudyData) -> Result<Vec<Figure>, Error> {
    let found = found(file, data)?;
    let worst = largest_residuals(file, data)?;
    if data.axes.len() == 1 {
        return Ok(vec![alone(data, &data.axes[0], &found[0], &worst)]);
    }
    let mut figures = Vec::new();
    for a in 0..data.axes.len() {
        for b in a + 1..data.axes.len() {
            figures.push(pair(data, [a, b], &found, &worst));
        }
    }
    if let [figure] = &mut figures[..] {
        figure.name = "region".to_owned();
    }
    Ok(figures)
}

/// Groups of runs by their largest residual, with their colours, the innermost first.
pub(super) const GROUPS: [(&str, RGBColor); 3] = [
    ("all held targets hold", BLUE),
    ("up to 4 half-widths off", ORANGE),
    ("other runs of the search", GREY),
];

/// The group of a run; NaN: none.
pub(super) fn group_of(worst: f64) -> f64 {
    match worst {
        worst if worst.is_nan() => f64::NAN,
        worst if worst <= 1.0 => 0.0,
        worst if worst <= NEAR => 1.0,
        _ => 2.0,
    }
}

/// For the page: optimum, compromise and bounds of each pair of parameters, and the largest residual of each run if a
/// target is held.
pub(super) fn of_page(file: &StudyFile, data: &StudyData) -> Result<(Vec<Overlay>, Option<Vec<f64>>), Error> {
    let found = found(file, data)?;
    let mut overlays = Vec::new();
    for (a, x) in data.axes.iter().enumerate() {
        for (b, y) in data.axes.iter().enumerate().filter(|(b, _)| *b != a) {
            let mut curves = marks(&found[a], &found[b]);
            let frame = bounds(&found[a], &found[b]);
            let extent = |of: &RegionParameter| of.largest - of.least;
            // Bounds that agree up to rounding have no interior.
            let region = [a, b]
                .iter()
                .all(|&k| extent(&found[k]) > 1e-12 * found[k].largest.abs());
            curves.push(frame);
            curves.retain(|curve| curve.points().all(|(x, y)| x.is_finite() && y.is_finite()));
            overlays.push(Overlay {
                x: x.name.clone(),
                y: y.name.clone(),
                curves,
                labels: Vec::new(),
                region,
            });
        }
    }
    Ok((overlays, largest_residuals(file, data).ok()))
}

fn marks(a: &RegionParameter, b: &RegionParameter) -> Vec<Curve> {
    let mut curves = vec![Curve::filled("optimum", BLACK, vec![(a.optimum, b.optimum)])];
    if a.compromise.is_finite() && b.compromise.is_finite() {
        let compromise = vec![(a.compromise, b.compromise)];
        curves.push(Curve::open("compromise", VERMILLION, compromise));
    }
    curves
}

/// The least and largest values with which all held targets hold.
fn bounds(a: &RegionParameter, b: &RegionParameter) -> Curve {
    let (left, right, low, high) = (a.least, a.largest, b.least, b.largest);
    let frame = vec![(left, low), (right, low), (right, high), (left, high), (left, low)];
    Curve::dashed("least and largest", BLACK, frame)
}

fn found(file: &StudyFile, data: &StudyData) -> Result<Vec<RegionParameter>, Error> {
    let count = data.axes.len();
    let there = file.names("calibration")?;
    let column = |name: &str| -> Result<Vec<f64>, Error> {
        if !there.iter().any(|known| known == name) {
            return Ok(vec![f64::NAN; count]);
        }
        let mut values = file.numbers(&format!("calibration/{name}"))?;
        values.resize(count, f64::NAN);
        Ok(values)
    };
    let [optimum, compromise] = [column("optimum")?, column("compromise")?];
    let [from, to] = [column("range_from")?, column("range_to")?];
    let [least, largest] = [column("least")?, column("largest")?];
    let of = |k: usize| RegionParameter {
        optimum: optimum[k],
        compromise: compromise[k],
        range: (from[k].min(to[k]), from[k].max(to[k])),
        least: least[k],
        largest: largest[k],
    };
    Ok((0..count).map(of).collect())
}

/// Largest residual of the required targets for each run, in half-widths; NaN for failed runs or missing quantities.
fn largest_residuals(file: &StudyFile, data: &StudyData) -> Result<Vec<f64>, Error> {
    let column = |name: &str| file.numbers(&format!("targets/{name}"));
    let (value, half_width, role) = (column("value")?, column("half_width")?, column("role")?);
    let names = file.variable("targets/target")?.flags;
    let mut worst = vec![0.0f64; data.status.len()];
    let mut held = 0;
    for (k, (_, name)) in names.iter().enumerate() {
        if role.get(k) != Some(&HELD) {
            continue;
        }
        held += 1;
        let quantity = data.quantity(name)?;
        for (worst, own) in worst.iter_mut().zip(&quantity.values) {
            let residual = ((own - value[k]) / half_width[k]).abs();
            *worst = if residual.is_nan() {
                f64::NAN
            } else {
                worst.max(residual)
            };
        }
    }
    if held == 0 {
        return refused(
            &data.path,
            "none of its targets is held, so there is no region; --quantity draws its runs",
        );
    }
    Ok(worst)
}

fn side(axis: &StudyColumn, found: &RegionParameter) -> Axis {
    let (low, high) = found.range;
    // Ranges of several decades were searched in the logarithm.
    axis.axis()
        .ranging(low, high)
        .logarithmic(low > 0.0 && high >= 100.0 * low)
}

fn pair(data: &StudyData, [a, b]: [usize; 2], found: &[RegionParameter], worst: &[f64]) -> Figure {
    let place = |point: usize| (data.axes[a].values[point], data.axes[b].values[point]);
    // The innermost group is drawn last.
    let mut curves = drawn([2, 1, 0].map(|group| {
        let points = (0..worst.len()).filter(|&point| group_of(worst[point]) == group as f64);
        let (label, color) = GROUPS[group];
        Curve::line(label, color, points.map(place).collect()).styled(CurveStyle::Dots)
    }));
    curves.extend(marks(&found[a], &found[b]));
    // The runs that come close, in the searched ranges. Without any, the whole ranges.
    let close = || (0..worst.len()).filter(|&point| worst[point] <= NEAR);
    let near = |k: usize| {
        let axis = side(&data.axes[k], &found[k]);
        let range = extent(
            close()
                .map(|point| data.axes[k].values[point])
                .chain([found[k].optimum]),
        );
        match range.filter(|(low, high)| low < high) {
            Some(range) => with_room(axis, range, Some(found[k].range)),
            None => axis,
        }
    };
    let (x, y) = (near(a), near(b));
    let mut nearby = within(&curves, (&x, &y));
    nearby.extend(finite(bounds(&found[a], &found[b])));
    let mut panels = vec![Panel::new(x, y, nearby).captioned("near the region")];
    panels.extend(enlarged(data, [a, b], found, &curves));
    let name = format!("region-{}-{}", data.axes[a].name, data.axes[b].name);
    data.figure(name, &region_of(data, &[a, b]), panels)
}

/// What a figure shows: the region of these parameters, by their symbols or names.
fn region_of(data: &StudyData, axes: &[usize]) -> String {
    let names: Vec<String> = axes.iter().map(|&k| data.axes[k].axis().short().to_owned()).collect();
    format!("region of {}", names.join(" and "))
}

/// The axis over a range with a margin, within `limits`.
fn with_room(axis: Axis, (low, high): (f64, f64), limits: Option<(f64, f64)>) -> Axis {
    // A logarithmic axis shows at least two powers, which would hide a smaller region.
    let logarithmic = axis.logarithmic && low > 0.0 && high >= 100.0 * low;
    let (low, high) = if logarithmic {
        let factor = (high / low).powf(ROOM);
        (low / factor, high * factor)
    } else {
        let margin = ROOM * (high - low);
        (low - margin, high + margin)
    };
    let limits = limits.unwrap_or((low, high));
    axis.logarithmic(logarithmic)
        .ranging(low.max(limits.0), high.min(limits.1))
}

/// The parts of curves of points within the ranges of the axes.
fn within(curves: &[Curve], (x, y): (&Axis, &Axis)) -> Vec<Curve> {
    let holds = |axis: &Axis, value: f64| axis.range.is_none_or(|(low, high)| value >= low && value <= high);
    let inside = |&(u, v): &(f64, f64)| holds(x, u) && holds(y, v);
    drawn(curves.iter().map(|curve| Curve {
        pieces: vec![curve.points().filter(inside).collect()],
        ..curve.clone()
    }))
}

fn finite(curve: Curve) -> Option<Curve> {
    let all = curve.points().all(|(x, y)| x.is_finite() && y.is_finite());
    all.then_some(curve)
}

fn enlarged(data: &StudyData, [a, b]: [usize; 2], found: &[RegionParameter], curves: &[Curve]) -> Option<Panel> {
    let window = |k: usize| {
        let own = &found[k];
        let axis = side(&data.axes[k], own);
        // Bounds that agree up to rounding have no interior.
        let extent = own.largest - own.least;
        if extent.is_nan() || extent <= 1e-12 * own.largest.abs() {
            return None;
        }
        Some(with_room(axis, (own.least, own.largest), None))
    };
    let (x, y) = (window(a)?, window(b)?);
    let mut curves = within(curves, (&x, &y));
    curves.push(bounds(&found[a], &found[b]));
    Some(Panel::new(x, y, curves).captioned("the region, enlarged"))
}

fn alone(data: &StudyData, axis: &StudyColumn, found: &RegionParameter, worst: &[f64]) -> Figure {
    let points: Vec<(f64, f64)> = axis
        .values
        .iter()
        .zip(worst)
        .filter(|(_, worst)| worst.is_finite())
        .map(|(x, worst)| (*x, worst.max(1e-3)))
        .collect();
    let (low, high) = found.range;
    let bounds = [found.least, found.largest]
        .into_iter()
        .filter(|bound| bound.is_finite());
    let bounds = bounds.map(|bound| vec![(bound, 1e-3), (bound, 1.0)]).collect();
    let bounds = Curve::pieces("least and largest", BLACK, bounds).styled(CurveStyle::Dashed);
    let curves = vec![
        Curve::line("runs of the search", BLUE, points).styled(CurveStyle::Dots),
        Curve::dashed("all held targets hold below", GREY, vec![(low, 1.0), (high, 1.0)]),
        bounds,
        Curve::filled("optimum", VERMILLION, vec![(found.optimum, 1.0)]),
    ];
    let residual = Axis::new("largest residual, half-widths", "1").by_powers();
    let panels = vec![Panel::new(side(axis, found), residual, curves)];
    data.figure("region".to_owned(), &region_of(data, &[0]), panels)
}
