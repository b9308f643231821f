//! The tables of a boundary in a sweep file.

use super::curves::{Boundaries, BoundaryPoint, Line};
use super::study::{Design, Study};
use crate::results::{Column, ColumnData, ResultError, SweepWriter};

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
        let column = |name: &str, units: &str, long_name: &str, data| Column {
            name: name.to_owned(),
            units: units.to_owned(),
            long_name: long_name.to_owned(),
            data,
        };
        let counts = |rows: Vec<usize>| ColumnData::Counts(rows.into_iter().map(|row| row as i64).collect());
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
                column(
                    &axis.name,
                    axis.unit.unwrap_or("1"),
                    axis.description,
                    ColumnData::Numbers(rows.iter().map(value).collect()),
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
        let numbers =
            |f: &dyn Fn(&BoundaryPoint) -> f64| ColumnData::Numbers(rows.iter().map(|row| f(row.2)).collect());
        let mut columns = vec![
            column(
                "boundary_point",
                "1",
                "index of the point",
                counts((0..rows.len()).collect()),
            ),
            column(
                "curve",
                "1",
                "which connected line",
                counts(rows.iter().map(|row| row.0).collect()),
            ),
            column("plane", "1", "which values of the other axes", counts(planes.clone())),
        ];
        columns.extend(outside(&planes));
        for (k, axis) in [x, y].into_iter().enumerate() {
            let units = axis.unit.unwrap_or("1");
            let named = |suffix: &str| format!("{}{suffix}", axis.name);
            columns.push(column(&axis.name, units, axis.description, numbers(&|p| p.middle()[k])));
            columns.push(column(
                &named("_met"),
                units,
                "of the run that meets the criterion",
                numbers(&|p| p.met[k]),
            ));
            columns.push(column(
                &named("_unmet"),
                units,
                "of the run that does not",
                numbers(&|p| p.unmet[k]),
            ));
        }
        let branches = [(0, "lower"), (1, "upper"), (2, "nose")];
        let branches = branches.map(|(code, word)| (code, word.to_owned())).to_vec();
        let codes = rows.iter().map(|row| row.2.branch as i8).collect();
        columns.push(column(
            "branch",
            "1",
            "which part of the line",
            ColumnData::Codes(codes, branches),
        ));
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
            let at = |k: usize| ColumnData::Numbers(rows.iter().map(|row| row.2[k]).collect());
            let mut columns = vec![
                column(dimension, "1", "index of the point", counts((0..rows.len()).collect())),
                column(
                    "line",
                    "1",
                    "which connected line",
                    counts(rows.iter().map(|row| row.0).collect()),
                ),
                column("plane", "1", "which values of the other axes", counts(planes.clone())),
                column(
                    "level",
                    "1",
                    what,
                    ColumnData::Numbers(rows.iter().map(|row| row.1.level).collect()),
                ),
            ];
            columns.extend(outside(&planes));
            columns.push(column(&x.name, x.unit.unwrap_or("1"), x.description, at(0)));
            columns.push(column(&y.name, y.unit.unwrap_or("1"), y.description, at(1)));
            writer.add_table(group, &[text("x", &x.name), text("y", &y.name)], &columns)?;
        }
        Ok(())
    }
}
