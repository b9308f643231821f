//! A quantity over one axis.

use super::data::{StudyData, StudyQuantity};
use super::selection::Selection;
use super::title;
use crate::plot::figure::{Cell, Curve, CurveStyle, Figure, Panel, drawn, extent};
use crate::plot::style::{BLUE, VERMILLION};

/// A point for each run. Failed runs are on the lower edge.
pub(super) fn figure(data: &StudyData, quantity: &StudyQuantity, x: usize, selection: &Selection) -> Figure {
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
        Curve::line("", BLUE, all).styled(CurveStyle::Points),
        Curve::line("failed", VERMILLION, failed).styled(CurveStyle::OpenPoints),
    ]);
    let title = title(data, &format!("{}{}", quantity.long_name, selection.said()));
    let panels = vec![Panel::new(own.axis(), quantity.axis(), curves)];
    Figure::new(format!("curves-{}", quantity.name), title, panels)
}
