//! The critical curve: the boundaries of a sweep in their plane, with the linear limit and contours of G (Fig. 25).

use super::error::PlotError;
use super::figure::{Curve, CurveStyle, Figure, Panel};
use super::studies::data::{drawn_axis, short};
use super::style::{BLACK, GREY, PALETTE};
use crate::results::{ResultError, SweepFile};

/// The figure of a sweep file that has boundaries.
///
/// # Errors
/// If the file has none, or cannot be read.
pub fn figure(file: &SweepFile) -> Result<Figure, PlotError> {
    let boundary = |name: &str| file.text(&format!("boundary/{name}"));
    let (Some(x), Some(y)) = (boundary("x"), boundary("y")) else {
        let path = file.path().to_owned();
        return Err(ResultError::NoBoundary { path }.into());
    };
    let mut curves = Vec::new();
    let contours = lines(file, "growth_contours", "line", &x, &y)?;
    let label = levels_label(&contours);
    for contour in contours {
        curves.push(Curve::line(&label, GREY, contour.points).styled(CurveStyle::Thin));
    }
    merge_by_label(&mut curves);
    for limit in lines(file, "linear_limit", "line", &x, &y)? {
        curves.push(Curve::line("stable at every speed", BLACK, limit.points).styled(CurveStyle::Dashed));
    }
    merge_by_label(&mut curves);
    curves.extend(boundary_curves(file, &x, &y)?);
    let axis = |name: &str, spacing: &str| {
        let units = file
            .attribute(&format!("boundary/{name}"), "units")
            .unwrap_or_else(|| "1".to_owned());
        let axis = drawn_axis(name, &units, "");
        if boundary(spacing).as_deref() == Some("log") {
            axis.by_powers()
        } else {
            axis
        }
    };
    let is_the_papers = x == "friction_decay" && y == "torsion_damping";
    Ok(Figure {
        name: "critical-curve".to_owned(),
        title: match boundary("criterion") {
            Some(criterion) if !is_the_papers => format!("Where {criterion} ends"),
            _ => "Critical curve: where stick-slip ends".to_owned(),
        },
        paper_figure: is_the_papers.then_some(25),
        panels: vec![Panel::new(axis(&x, "x_spacing"), axis(&y, "y_spacing"), curves)],
    })
}

/// The boundaries of a sweep and the names of the axes of their plane.
pub(super) struct Boundary {
    /// Name of the variable of the horizontal axis.
    pub x: String,
    /// Of the vertical one.
    pub y: String,
    /// One for each plane.
    pub curves: Vec<Curve>,
}

/// The boundaries of a sweep file; `None` if it has none.
pub(super) fn boundary(file: &SweepFile) -> Result<Option<Boundary>, PlotError> {
    let (Some(x), Some(y)) = (file.text("boundary/x"), file.text("boundary/y")) else {
        return Ok(None);
    };
    let curves = boundary_curves(file, &x, &y)?;
    Ok(Some(Boundary { x, y, curves }))
}

fn boundary_curves(file: &SweepFile, x: &str, y: &str) -> Result<Vec<Curve>, PlotError> {
    // One colour for each plane, named by the axes outside the plane.
    let known = ["boundary_point", "curve", "plane", "branch"];
    let outside: Vec<String> = file
        .variables("boundary")
        .into_iter()
        .filter(|name| !known.contains(&name.as_str()) && !name.starts_with(x) && !name.starts_with(y))
        .collect();
    let mut values = Vec::new();
    for name in &outside {
        values.push(file.numbers(&format!("boundary/{name}"))?);
    }
    let mut boundaries: Vec<Curve> = Vec::new();
    for line in lines(file, "boundary", "curve", x, y)? {
        let words = outside.iter().zip(&values).map(|(name, values)| {
            let units = file.attribute(&format!("boundary/{name}"), "units").unwrap_or_default();
            format!("{} = {:?} {units}", short(name), values[line.first])
        });
        let label = words.collect::<Vec<_>>().join(", ");
        let label = if label.is_empty() {
            file.text("boundary/criterion").unwrap_or_default()
        } else {
            label
        };
        let color = PALETTE[line.plane % PALETTE.len()];
        boundaries.push(Curve::line(&label, color, line.points));
    }
    merge_by_label(&mut boundaries);
    Ok(boundaries)
}

/// One label for all contours, which have one colour: their levels in increasing order.
fn levels_label(contours: &[Line]) -> String {
    let mut levels: Vec<f64> = contours.iter().map(|contour| contour.level).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    let levels: Vec<String> = levels.iter().map(f64::to_string).collect();
    format!("G = {}", levels.join(", "))
}

/// A connected line of one of the file's tables.
struct Line {
    /// The first row of it.
    first: usize,
    plane: usize,
    level: f64,
    points: Vec<(f64, f64)>,
}

/// The lines of a table, told apart by the column `by`; none if there is no such table.
fn lines(file: &SweepFile, group: &str, by: &str, x: &str, y: &str) -> Result<Vec<Line>, ResultError> {
    let names = file.variables(group);
    if names.is_empty() {
        return Ok(Vec::new());
    }
    let column = |name: &str| file.numbers(&format!("{group}/{name}"));
    let (which, plane, x, y) = (column(by)?, column("plane")?, column(x)?, column(y)?);
    let level = if names.iter().any(|name| name == "level") {
        column("level")?
    } else {
        vec![0.0; x.len()]
    };
    let mut lines: Vec<Line> = Vec::new();
    for row in 0..x.len() {
        if row == 0 || which[row] != which[row - 1] {
            lines.push(Line {
                first: row,
                plane: plane[row] as usize,
                level: level[row],
                points: Vec::new(),
            });
        }
        if let Some(line) = lines.last_mut() {
            line.points.push((x[row], y[row]));
        }
    }
    Ok(lines)
}

/// Lines of one name become the pieces of one curve, so that the legend names it once.
fn merge_by_label(curves: &mut Vec<Curve>) {
    let mut merged: Vec<Curve> = Vec::new();
    for curve in curves.drain(..) {
        match merged.iter_mut().find(|other| other.label == curve.label) {
            Some(other) => other.pieces.extend(curve.pieces),
            None => merged.push(curve),
        }
    }
    *curves = merged;
}
