//! A quantity over one axis.

use super::data::{StudyData, StudyQuantity};
use super::selection::Selection;
use super::title;
use crate::plot::PlotError;
use crate::plot::figure::{Cell, Curve, CurveStyle, Figure, Panel};
use crate::plot::style::{BLUE, VERMILLION};

/// The curve with a point for each run; those that failed stand on the lower edge.
pub(super) fn figure(
    data: &StudyData,
    quantity: &StudyQuantity,
    x: usize,
    selection: &Selection,
) -> Result<Figure, PlotError> {
    let own = &data.axes[x];
    let mut points = selection.points.clone();
    points.sort_by(|&a, &b| own.values[a].total_cmp(&own.values[b]));
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    let mut failed = Vec::new();
    for point in points {
        match data.cell(point, quantity) {
            Cell::Value(value) => {
                if let Some(piece) = pieces.last_mut() {
                    piece.push((own.values[point], value));
                }
            }
            // A line would hide that there is nothing.
            _ => {
                if data.cell(point, quantity) == Cell::Failed {
                    failed.push(own.values[point]);
                }
                if pieces.last().is_some_and(|piece| !piece.is_empty()) {
                    pieces.push(Vec::new());
                }
            }
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    let all: Vec<(f64, f64)> = pieces.iter().flatten().copied().collect();
    let lowest = all.iter().map(|point| point.1).fold(f64::INFINITY, f64::min);
    let line = Curve {
        label: String::new(),
        color: BLUE,
        style: CurveStyle::Thin,
        pieces,
    };
    let mut curves = vec![line, Curve::line("", BLUE, all).styled(CurveStyle::Points)];
    if !failed.is_empty() {
        let edge = if lowest.is_finite() { lowest } else { 0.0 };
        let points = failed.into_iter().map(|x| (x, edge)).collect();
        curves.push(Curve::line("failed", VERMILLION, points).styled(CurveStyle::OpenPoints));
    }
    let axis = own.axis();
    let x = if own.words.is_empty() && own.is_logarithmic() {
        axis.by_powers()
    } else {
        axis
    };
    let held = match selection.held.is_empty() {
        true => String::new(),
        false => format!(", at {}", selection.held.join(", ")),
    };
    Ok(Figure {
        name: format!("curves-{}", quantity.name),
        title: title(data, &format!("{}{held}", quantity.long_name)),
        paper_figure: None,
        panels: vec![Panel::new(x, quantity.axis(), curves)],
    })
}
