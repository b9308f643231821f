//! The figure of `stickslip work-precision`.

use super::figure::{Axis, Curve, CurveStyle, Figure, Panel, drawn, extent};
use super::style::{GREY, PALETTE};
use crate::Error;
use plotters::style::RGBColor;
use std::path::Path;
use stickslip_analysis::analysis::work_precision::{Knob, Measurement, MethodErrors, StudyResult};

/// Smallest drawn error, s, below any uncertainty of seconds in doubles. Zero has no logarithm.
const LEAST: f64 = 1e-16;

/// Name of the figure and its files.
pub const NAME: &str = "work-precision";

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
    Ok(figure(&title, &result))
}

/// Errors over calls of the right-hand side, and over time. Open circles are errors within the uncertainty of the
/// reference, which is the dashed line.
pub fn figure(title: &str, result: &StudyResult) -> Figure {
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
    Figure::new(NAME, title, panels)
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
