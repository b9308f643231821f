//! Traced boundaries: curves, their points and branches, contours, and their tables in a sweep file.

use super::axis::{ParameterAxis, Spacing};
use super::study::{Design, Study};
use stickslip_case::Setting;
use stickslip_files::{Addition, FileColumn, ResultError, SweepWriter};

/// Part of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveBranch {
    /// Before the largest y, at smaller x.
    Lower = 0,
    /// After the largest y, at larger x.
    Upper = 1,
    /// Largest y of a curve that turns.
    Fold = 2,
}

/// Point of a boundary between two runs, one of which meets the criterion. Coordinates are in the units of the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundaryPoint {
    /// Run that meets the criterion.
    pub met: [f64; 2],
    /// Run that does not meet the criterion.
    pub unmet: [f64; 2],
    /// Part of the boundary.
    pub branch: CurveBranch,
}

impl BoundaryPoint {
    /// Middle of both runs.
    pub fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|k| 0.5 * (self.met[k] + self.unmet[k]))
    }
}

/// Connected line of a boundary.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundaryCurve {
    /// Plane, as an index in [`Boundaries::planes`].
    pub plane: usize,
    /// Points along the line. A closed line repeats its first point.
    pub points: Vec<BoundaryPoint>,
}

/// Additional line, such as a contour.
#[derive(Debug, Clone, PartialEq)]
pub struct ContourLine {
    /// Index in [`Boundaries::planes`].
    pub plane: usize,
    /// Constant value along the line.
    pub level: f64,
    /// Points (first axis, second axis) in the keys' units.
    pub points: Vec<[f64; 2]>,
}

/// Boundaries of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Boundaries {
    /// Values of the axes outside each plane.
    pub planes: Vec<Vec<Setting>>,
    /// Curves in the order of the planes.
    pub curves: Vec<BoundaryCurve>,
    /// For a brake: limit at which steady sliding loses its stability only at standstill, c_t = -2 r F mu'(0) under
    /// the largest force. For other systems: change of stability of steady sliding under their drives.
    pub linear_limit: Vec<ContourLine>,
    /// Contours of the growth exponent G.
    pub growth: Vec<ContourLine>,
}

fn spacing(axis: &ParameterAxis) -> &'static str {
    match axis.range {
        Some(range) if range.spacing == Spacing::Log => "log",
        _ => "linear",
    }
}

/// Line and plane of each row.
type BoundaryRows = Vec<(usize, usize)>;

impl Boundaries {
    pub(super) fn write(&self, study: &Study, writer: &mut SweepWriter) -> Result<(), ResultError> {
        let Design::Boundary(spec) = &study.design else {
            return Ok(());
        };
        let [x, y] = spec.plane.map(|k| &study.axes[k]);
        let of_plane = "which values of the other axes";
        let places = |point: &str, line: &str, rows: &[(usize, usize)]| {
            vec![
                FileColumn::counts(point, "index of the point", 0..rows.len() as i64),
                FileColumn::counts(line, "which connected line", rows.iter().map(|row| row.0 as i64)),
                FileColumn::counts("plane", of_plane, rows.iter().map(|row| row.1 as i64)),
            ]
        };
        let outside = |rows: &[(usize, usize)]| -> Vec<FileColumn> {
            let axes = study.axes.iter().enumerate();
            let axes = axes.filter(|(k, axis)| !spec.plane.contains(k) && axis.is_number());
            let column = |(k, axis): (usize, &ParameterAxis)| {
                let value = |row: &(usize, usize)| self.planes[row.1][k].as_number().unwrap_or(f64::NAN);
                axis.column(rows.iter().map(value))
            };
            axes.map(column).collect()
        };
        let curves = self.curves.iter().enumerate();
        let (rows, points): (BoundaryRows, Vec<&BoundaryPoint>) = curves
            .flat_map(|(k, curve)| curve.points.iter().map(move |point| ((k, curve.plane), point)))
            .unzip();
        let mut columns = places("boundary_point", "curve", &rows);
        columns.extend(outside(&rows));
        for (k, axis) in [x, y].into_iter().enumerate() {
            let end = |suffix: &str, long_name: &str, of: fn(&BoundaryPoint) -> [f64; 2]| {
                let name = format!("{}{suffix}", axis.name);
                let values = points.iter().map(|point| of(point)[k]);
                FileColumn::numbers(&name, axis.unit.unwrap_or("1"), long_name, values)
            };
            columns.push(end("", axis.description, BoundaryPoint::middle));
            columns.push(end("_met", "of the run that meets the criterion", |point| point.met));
            columns.push(end("_unmet", "of the run that does not", |point| point.unmet));
        }
        let branches = [(0, "lower"), (1, "upper"), (2, "nose")];
        let branches = branches.map(|(code, word)| (code, word.to_owned())).to_vec();
        let codes = points.iter().map(|point| point.branch as i8);
        columns.push(FileColumn::codes("branch", "which part of the line", codes, branches));
        let width = format!("{:e} of the range of the axis that was bisected", spec.width);
        let mut boundary = Addition::of_table("boundary", columns);
        for (name, text) in [
            ("criterion", spec.criterion.text().as_str()),
            ("x", &x.name),
            ("y", &y.name),
            ("x_spacing", spacing(x)),
            ("y_spacing", spacing(y)),
            ("width", &width),
        ] {
            boundary.attribute(name, text);
        }
        writer.add(&boundary)?;
        let (limit, margin) = match study.slows_down() {
            true => ("linear_limit", "margin of steady sliding at standstill, N m s/rad"),
            false => (
                "stability_limit",
                "margin of steady sliding under the drives of the case",
            ),
        };
        for (group, point, level, lines) in [
            (limit, "limit_point", margin, &self.linear_limit),
            ("growth_contours", "contour_point", "growth exponent G", &self.growth),
        ] {
            let lines = lines.iter().enumerate();
            let (rows, points): (BoundaryRows, Vec<(&ContourLine, [f64; 2])>) = lines
                .flat_map(|(k, line)| line.points.iter().map(move |&point| ((k, line.plane), (line, point))))
                .unzip();
            if rows.is_empty() {
                continue;
            }
            let mut columns = places(point, "line", &rows);
            let levels = points.iter().map(|row| row.0.level);
            columns.push(FileColumn::numbers("level", "1", level, levels));
            columns.extend(outside(&rows));
            columns.push(x.column(points.iter().map(|row| row.1[0])));
            columns.push(y.column(points.iter().map(|row| row.1[1])));
            let mut contours = Addition::of_table(group, columns);
            contours.attribute("x", &x.name);
            contours.attribute("y", &y.name);
            writer.add(&contours)?;
        }
        Ok(())
    }
}
