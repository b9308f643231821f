//! The tables of a boundary in a sweep file.

use super::curves::{Boundaries, BoundaryPoint, Line};
use super::study::{Design, Study};
use crate::results::{Column, ResultError, SweepWriter};

fn spacing(axis: &super::axis::Axis) -> &'static str {
    match axis.range {
        Some(range) if range.spacing == super::axis::Spacing::Log => "log",
        _ => "linear",
    }
}

impl Boundaries {
    /// Adds the tables of the boundary to a sweep file.
    pub(super) fn write(&self, study: &Study, writer: &mut SweepWriter) -> Result<(), ResultError> {
        let Design::Boundary(spec) = &study.design else {
            return Ok(());
        };
        let [x, y] = spec.plane.map(|k| &study.axes[k]);
        let counts = |name: &str, long_name: &str, rows: &mut dyn Iterator<Item = usize>| {
            Column::counts(name, long_name, rows.map(|row| row as i64))
        };
        let text = |name: &'static str, text: &str| (name, text.to_owned());
        // The values of the other axes at the plane of each row.
        let outside = |rows: &[usize]| -> Vec<Column> {
            let axes = study
                .axes
                .iter()
                .enumerate()
                .filter(|(k, axis)| !spec.plane.contains(k) && axis.is_number());
            axes.map(|(k, axis)| {
                let value = |&plane: &usize| self.planes[plane][k].as_number().unwrap_or(f64::NAN);
                Column::numbers(
                    &axis.name,
                    axis.unit.unwrap_or("1"),
                    axis.description,
                    rows.iter().map(value),
                )
            })
            .collect()
        };
        let rows: Vec<(usize, usize, &BoundaryPoint)> = self
            .curves
            .iter()
            .enumerate()
            .flat_map(|(k, curve)| curve.points.iter().map(move |point| (k, curve.plane, point)))
            .collect();
        let planes: Vec<usize> = rows.iter().map(|row| row.1).collect();
        let numbers = |name: &str, units: &str, long_name: &str, f: &dyn Fn(&BoundaryPoint) -> f64| {
            Column::numbers(name, units, long_name, rows.iter().map(|row| f(row.2)))
        };
        let of_planes = "which values of the other axes";
        let mut columns = vec![
            counts("boundary_point", "index of the point", &mut (0..rows.len())),
            counts("curve", "which connected line", &mut rows.iter().map(|row| row.0)),
            counts("plane", of_planes, &mut planes.iter().copied()),
        ];
        columns.extend(outside(&planes));
        for (k, axis) in [x, y].into_iter().enumerate() {
            let units = axis.unit.unwrap_or("1");
            let named = |suffix: &str| format!("{}{suffix}", axis.name);
            columns.push(numbers(&axis.name, units, axis.description, &|p| p.middle()[k]));
            let met = "of the run that meets the criterion";
            columns.push(numbers(&named("_met"), units, met, &|p| p.met[k]));
            let unmet = "of the run that does not";
            columns.push(numbers(&named("_unmet"), units, unmet, &|p| p.unmet[k]));
        }
        let branches = [(0, "lower"), (1, "upper"), (2, "nose")];
        let branches = branches.map(|(code, word)| (code, word.to_owned())).to_vec();
        let codes = rows.iter().map(|row| row.2.branch as i8);
        columns.push(Column::codes("branch", "which part of the line", codes, branches));
        let attributes = [
            text("criterion", &spec.criterion.text()),
            text("x", &x.name),
            text("y", &y.name),
            text("x_spacing", spacing(x)),
            text("y_spacing", spacing(y)),
            text(
                "width",
                &format!("{:e} of the range of the axis that was bisected", spec.width),
            ),
        ];
        writer.add_table("boundary", &attributes, &columns)?;
        for (group, dimension, what, lines) in [
            match study.words.lists_growth() {
                true => (
                    "linear_limit",
                    "limit_point",
                    "margin of steady sliding at standstill, N m s/rad",
                    &self.linear_limit,
                ),
                false => (
                    "stability_limit",
                    "limit_point",
                    "margin of steady sliding under the drives of the case",
                    &self.linear_limit,
                ),
            },
            ("growth_contours", "contour_point", "growth exponent G", &self.growth),
        ] {
            let rows: Vec<(usize, &Line, [f64; 2])> = lines
                .iter()
                .enumerate()
                .flat_map(|(k, line)| line.points.iter().map(move |&point| (k, line, point)))
                .collect();
            if rows.is_empty() {
                continue;
            }
            let planes: Vec<usize> = rows.iter().map(|row| row.1.plane).collect();
            let mut columns = vec![
                counts(dimension, "index of the point", &mut (0..rows.len())),
                counts("line", "which connected line", &mut rows.iter().map(|row| row.0)),
                counts("plane", of_planes, &mut planes.iter().copied()),
                Column::numbers("level", "1", what, rows.iter().map(|row| row.1.level)),
            ];
            columns.extend(outside(&planes));
            for (k, axis) in [x, y].into_iter().enumerate() {
                let values = rows.iter().map(|row| row.2[k]);
                columns.push(Column::numbers(
                    &axis.name,
                    axis.unit.unwrap_or("1"),
                    axis.description,
                    values,
                ));
            }
            writer.add_table(group, &[text("x", &x.name), text("y", &y.name)], &columns)?;
        }
        Ok(())
    }
}
