//! Figures of `stickslip work-precision` and of `stickslip certify --figure`.

use super::figure::{Axis, BELOW_LEAST_ERROR, Curve, CurveStyle, Figure, LEAST_ERROR, Panel, TIP_DOWN, drawn, extent};
use super::style::{BLACK, BLUE, GREEN, GREY, OLIVE, ORANGE, PALETTE, PURPLE, RGBColor, SKY, VERMILLION, WINE};
use crate::Error;
use std::path::Path;
use stickslip_analysis::analysis::stability::growth::{METHODS, Onset};
use stickslip_analysis::analysis::work_precision::{Knob, Measurement, MethodErrors, StudyResult};

/// Name of the figure and its files.
pub const WORK_PRECISION: &str = "work-precision";

/// Runs of one method with one kind of accuracy setting, in the order of the study.
struct MethodSeries<'a> {
    label: String,
    color: usize,
    fixed: bool,
    runs: Vec<&'a Measurement>,
}

/// The figure of a study's file. Nothing is run.
///
/// # Errors
/// The file is of another kind, of a newer version, or damaged.
pub fn of_file(path: &Path) -> Result<Figure, Error> {
    let (title, result) = StudyResult::read(path)?;
    Ok(work_precision_figure(&title, &result))
}

/// Errors over calls of the right-hand side, and over time. The dashed line is the uncertainty of the reference. Errors
/// within it are open circles, and those below the axis triangles at its floor.
pub fn work_precision_figure(title: &str, result: &StudyResult) -> Figure {
    let series = series(&result.measurements);
    let calls: fn(&Measurement) -> f64 = |m| m.rhs_evaluations as f64;
    let panel = |x: Axis, of_x: fn(&Measurement) -> f64, name: &str, error: fn(&MethodErrors) -> Option<f64>| {
        let uncertainty = error(&result.uncertainty).unwrap_or(0.0);
        let mut curves: Vec<Curve> = Vec::new();
        let (mut within, mut without) = (Vec::new(), Vec::new());
        for s in &series {
            let points: Vec<(f64, f64)> = s
                .runs
                .iter()
                .filter_map(|m| Some((of_x(m), error(&m.errors)?)))
                .filter(|point| point.0 > 0.0)
                .collect();
            let color = color(s.color);
            let style = if s.fixed { CurveStyle::Dashed } else { CurveStyle::Solid };
            let of = |chosen: &dyn Fn(f64) -> bool| -> Vec<(f64, f64)> {
                points.iter().copied().filter(|point| chosen(point.1)).collect()
            };
            let told = of(&|error| error > uncertainty);
            let untold = of(&|error| error <= uncertainty && error >= LEAST_ERROR);
            let below = of(&|error| error <= uncertainty && error < LEAST_ERROR);
            let at_floor = |points: Vec<(f64, f64)>| points.into_iter().map(|(x, y)| (x, y.max(LEAST_ERROR))).collect();
            let below: Vec<(f64, f64)> = at_floor(below);
            curves.push(Curve::line(&s.label, color, at_floor(points)).styled(style));
            curves.push(Curve::filled("", color, told));
            curves.push(Curve::open("", color, untold.clone()));
            curves.push(Curve::line("", color, below.clone()).styled(CurveStyle::Marks(TIP_DOWN)));
            within.extend(untold);
            without.extend(below);
        }
        // Names for the marks of all methods, below those.
        let of_all = [
            Curve::open("within uncertainty", BLACK, within),
            Curve::line(BELOW_LEAST_ERROR, BLACK, without).styled(CurveStyle::Marks(TIP_DOWN)),
        ];
        curves.splice(0..0, of_all);
        let (low, high) = extent(curves.iter().flat_map(Curve::points).map(|point| point.0)).unwrap_or((1.0, 10.0));
        let line = vec![
            (low, uncertainty.max(LEAST_ERROR)),
            (high, uncertainty.max(LEAST_ERROR)),
        ];
        curves.push(Curve::dashed("uncertainty of reference", GREY, line));
        Panel::new(x.by_powers(), Axis::new(name, "s").by_powers(), drawn(curves))
    };
    // Both panels share an axis. Only the first one also shows runs with another sequence of events.
    let counts = result.measurements.iter().filter(|m| m.failure.is_none()).map(calls);
    let (fewest, most) = extent(counts).unwrap_or((1.0, 1.0));
    let most = most.max(1.0);
    let by_calls = || Axis::new("calls of the right-hand side", "1").ranging(0.8 * fewest.min(most), 1.25 * most);
    let panels = vec![
        panel(by_calls(), calls, "onset error", |e| e.onset),
        panel(by_calls(), calls, "largest error", |e| e.largest),
        panel(Axis::new("time", "s"), |m| m.wall_time, "largest error", |e| e.largest),
    ];
    Figure::new(WORK_PRECISION, title, panels)
}

/// Colours of methods, of different hue or lightness.
const COLORS: [RGBColor; 9] = [BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK, WINE, OLIVE];

/// Colour of method `number` (from 0). Beyond nine the colours repeat in darker shades; fifteen are distinct.
pub fn color(number: usize) -> RGBColor {
    let RGBColor(r, g, b) = COLORS[number % COLORS.len()];
    let shades = i32::try_from(number / COLORS.len()).unwrap_or(i32::MAX);
    let darker = |part: u8| (f64::from(part) * 0.55f64.powi(shades)).round() as u8;
    RGBColor(darker(r), darker(g), darker(b))
}

fn series(measurements: &[Measurement]) -> Vec<MethodSeries<'_>> {
    let mut series: Vec<MethodSeries> = Vec::new();
    for m in measurements {
        let fixed = matches!(m.knob, Knob::FixedStep(_));
        // The colour of the method, or the next free one.
        let known = series.iter().find(|s| s.runs[0].method == m.method);
        let next = || series.iter().map(|s| s.color + 1).max().unwrap_or(0);
        let color = known.map_or_else(next, |s| s.color);
        match series.iter_mut().find(|s| s.color == color && s.fixed == fixed) {
            Some(s) => s.runs.push(m),
            None => series.push(MethodSeries {
                label: format!("{}{}", m.method.name(), if fixed { ", fixed steps" } else { "" }),
                color,
                fixed,
                runs: vec![m],
            }),
        }
    }
    series
}

/// Name of the figure and its files.
pub const ONSET: &str = "onset-against-tolerance";

/// Smallest drawn distance, s, about the spacing of doubles at the times. Zero has no logarithm.
const LEAST_DISTANCE: f64 = 1e-15;

/// Time of the first stick over the tolerance, without and with a kick on one scale, and its distance from the first
/// stick of the first method at its finest tolerance.
pub fn onset_figure(title: &str, onsets: &[Onset]) -> Figure {
    let times = extent(onsets.iter().filter_map(|onset| onset.first_stick));
    let reference = onsets
        .iter()
        .filter(|onset| onset.kicked && onset.method == METHODS[0].name())
        .filter_map(|onset| onset.first_stick)
        .next_back();
    let curves = |kicked: bool, value: &dyn Fn(f64) -> Option<f64>, skipped: usize| -> Vec<Curve> {
        let mut curves = Vec::new();
        for (method, color) in METHODS.iter().zip(PALETTE).skip(skipped) {
            let points: Vec<(f64, f64)> = onsets
                .iter()
                .filter(|onset| onset.kicked == kicked && onset.method == method.name())
                .filter_map(|onset| Some((onset.rtol, value(onset.first_stick?)?)))
                .collect();
            curves.push(Curve::line(method.name(), color, points.clone()));
            curves.push(Curve::filled("", color, points));
        }
        drawn(curves)
    };
    let panel = |y: Axis, curves| Panel::new(Axis::new("rtol", "1").by_powers(), y, curves);
    let first_stick = || {
        let range = times.map(|(low, high)| {
            // A margin of 5 % on each side, as without a fixed range.
            let margin = ((high - low) / 20.0).max(f64::EPSILON * high.abs());
            (low - margin, high + margin)
        });
        Axis {
            range,
            ..Axis::new("first stick", "s")
        }
    };
    let distance = |time: f64| Some((time - reference?).abs().max(LEAST_DISTANCE));
    let distances = Axis::new("distance", "s").by_powers();
    // On this scale the curves may lie on each other.
    let kicked = extent(
        onsets
            .iter()
            .filter(|onset| onset.kicked)
            .filter_map(|onset| onset.first_stick),
    );
    let coincide = times
        .zip(kicked)
        .is_some_and(|(all, kicked)| kicked.1 - kicked.0 < 0.01 * (all.1 - all.0));
    let with_kick = if coincide {
        "with the kick: all coincide"
    } else {
        "with the kick"
    };
    let to_reference = format!("with the kick, against {}", METHODS[0].name());
    let panels = vec![
        panel(first_stick(), curves(false, &Some, 0)).captioned("without a kick"),
        panel(first_stick(), curves(true, &Some, 0)).captioned(with_kick),
        panel(distances, curves(true, &distance, 1)).captioned(to_reference),
    ];
    Figure::new(ONSET, format!("First stick against tolerance: {title}"), panels)
}
