//! Figures of `stickslip work-precision` and of `stickslip certify --figure`.

use super::figure::{Axis, Curve, CurveStyle, Figure, Panel, drawn, extent};
use super::style::{GREY, PALETTE};
use crate::Error;
use plotters::style::RGBColor;
use std::path::Path;
use stickslip_analysis::analysis::stability::onset::{METHODS, Onset};
use stickslip_analysis::analysis::work_precision::{Knob, Measurement, MethodErrors, StudyResult};

/// Smallest drawn error, s, below any uncertainty of seconds in doubles. Zero has no logarithm.
const LEAST: f64 = 1e-16;

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

/// Errors over calls of the right-hand side, and over time. Open circles are errors within the uncertainty of the
/// reference, which is the dashed line.
pub fn work_precision_figure(title: &str, result: &StudyResult) -> Figure {
    let series = series(&result.measurements);
    let calls: fn(&Measurement) -> f64 = |m| m.rhs_evaluations as f64;
    let panel = |x: Axis, of_x: fn(&Measurement) -> f64, name: &str, error: fn(&MethodErrors) -> Option<f64>| {
        let uncertainty = error(&result.uncertainty).unwrap_or(0.0);
        let mut curves: Vec<Curve> = Vec::new();
        for s in &series {
            let points: Vec<(f64, f64)> = s
                .runs
                .iter()
                .filter_map(|m| Some((of_x(m), error(&m.errors)?.max(LEAST))))
                .filter(|point| point.0 > 0.0)
                .collect();
            let color = color(s.color);
            let style = if s.fixed { CurveStyle::Dashed } else { CurveStyle::Solid };
            let (told, untold): (Vec<_>, Vec<_>) = points.iter().partition(|point| point.1 > uncertainty);
            curves.push(Curve::line(&s.label, color, points).styled(style));
            curves.push(Curve::line("", color, told).styled(CurveStyle::Points));
            curves.push(Curve::line("", color, untold).styled(CurveStyle::OpenPoints));
        }
        let (low, high) = extent(curves.iter().flat_map(Curve::points).map(|point| point.0)).unwrap_or((1.0, 10.0));
        let line = vec![(low, uncertainty.max(LEAST)), (high, uncertainty.max(LEAST))];
        curves.push(Curve::line("uncertainty of the reference", GREY, line).styled(CurveStyle::Dashed));
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

/// Colour of method `number` (from 0). Beyond the palette the colours repeat in darker shades; thirteen are distinct.
pub fn color(number: usize) -> RGBColor {
    let RGBColor(r, g, b) = PALETTE[number % PALETTE.len()];
    let shades = i32::try_from(number / PALETTE.len()).unwrap_or(i32::MAX);
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
            curves.push(Curve::line("", color, points).styled(CurveStyle::Points));
        }
        drawn(curves)
    };
    let panel = |y: Axis, curves| Panel::new(Axis::new("rtol", "1").by_powers(), y, curves);
    let first_stick = |name: &str| {
        let range = times.map(|(low, high)| {
            // A margin of 5 % on each side, as without a fixed range.
            let margin = ((high - low) / 20.0).max(f64::EPSILON * high.abs());
            (low - margin, high + margin)
        });
        Axis {
            range,
            ..Axis::new(name, "s")
        }
    };
    let distance = |time: f64| Some((time - reference?).abs().max(LEAST_DISTANCE));
    let distances = Axis::new("kicked, distance", "s").by_powers();
    let panels = vec![
        panel(first_stick("no kick"), curves(false, &Some, 0)),
        panel(first_stick("kicked"), curves(true, &Some, 0)),
        panel(distances, curves(true, &distance, 1)),
    ];
    Figure::new(ONSET, format!("First stick against tolerance: {title}"), panels)
}
