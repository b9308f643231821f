//! The interactive page of a study: a map or dots of any quantity over two axes, with the command that runs each point.

use super::data::{StudyColumn, StudyData, drawn_axis};
use super::{plane, refused, region};
use crate::output::{Output, Product};
use crate::plot::figure::{Axis, hex};
use crate::plot::html::{self, PageDocument, counted, file_name};
use crate::plot::html::{
    ColumnRole, LETTERS, Overlay, PointColumn, PointCommand, PointsContent, PointsPage, SIZE_LIMIT, USUAL_DIGITS,
};
use crate::plot::{Error, critical, style};
use std::path::Path;
use stickslip_case::{Case, CaseSource};
use stickslip_files::StudyFile;
use stickslip_files::schema::INPUT_CASE;

/// Largest number of messages of failed points.
const MESSAGES: usize = 2_000;
const COLORS: usize = 64;

const HINT: &str = "The pointer reads values. A click chooses a point, and shows its values and the command that runs it. Arrow keys, \
                    with the figure in focus, go from point to point.";

/// Methods that take the study's own tolerance.
const OF_TOLERANCE: [&str; 4] = ["auto", "cvode", "arkode", "series"];

/// Writes the page of a sweep to `path`, with `quantities` (empty: all).
///
/// # Errors
/// An unreadable file, too many points, an obstacle at `path` (see [`Output::new`]), or a full disk.
pub fn write(file: &StudyFile, quantities: &[String], path: &Path, force: bool) -> Result<PointsPage, Error> {
    let output = Output::new(path, Product::Page, &[file.path().to_owned()], force)?;
    let data = StudyData::read(file)?;
    let chosen = match quantities {
        // Where every point failed, all are shown as empty.
        [] if !data.quantities.iter().any(StudyColumn::is_known) => data.quantities.iter().collect(),
        [] => data.quantities.iter().filter(|quantity| quantity.is_known()).collect(),
        names => names
            .iter()
            .map(|name| data.quantity(name))
            .collect::<Result<Vec<_>, _>>()?,
    };
    let points = data.status.len();
    let room = points * (LETTERS * (chosen.len() + data.axes.len()) + 2);
    if room > SIZE_LIMIT {
        let fit = (SIZE_LIMIT / points.max(1)).saturating_sub(2) / LETTERS;
        let count = chosen.len();
        let why = match fit.saturating_sub(data.axes.len()) {
            0 => format!("{points} points are too many for a page; draw a figure with -o instead"),
            fit => format!(
                "{points} points with {count} quantities are too many for a page; choose up to {fit} with --quantity NAME"
            ),
        };
        return refused(&data.path, why);
    }
    let mut columns: Vec<PointColumn> = data.axes.iter().map(|axis| point_column(axis, None)).collect();
    let digits = Some(digits(file, &data));
    columns.extend(chosen.iter().map(|quantity| point_column(quantity, digits)));
    let interest = data.of_interest(&[]);
    let mut shown = chosen
        .iter()
        .position(|quantity| interest.first().is_some_and(|one| one.name == quantity.name));
    let (mut overlays, mut plane) = (Vec::new(), plane::first(&data));
    if let Some((x, y, panel)) = critical::panel(file)? {
        plane = Some([data.axis(&x)?, data.axis(&y)?]);
        let (curves, labels) = (panel.curves, panel.labels);
        overlays.push(Overlay {
            x,
            y,
            curves,
            labels,
            region: false,
        });
    }
    if !file.names("calibration")?.is_empty() {
        let (region, residuals) = region::of_page(file, &data)?;
        overlays.extend(region);
        shown = residuals.map(|residuals| {
            let (axis, about) = (
                Axis::new("held targets", "1"),
                "by the largest residual of a held target",
            );
            let groups = residuals.iter().map(|&worst| region::group_of(worst)).collect();
            columns.push(PointColumn {
                words: (0..).zip(region::GROUPS.map(|group| group.0.to_owned())).collect(),
                colours: region::GROUPS.map(|group| style::name(group.1)).into(),
                ..PointColumn::new(ColumnRole::Value, "held_targets", axis, about, groups)
            });
            let axis = Axis::new("largest residual", "1");
            let about = "largest residual of the held targets, in half-widths: they hold below 1";
            let values = residuals.into_iter().collect();
            columns.push(PointColumn::new(
                ColumnRole::Value,
                "largest_residual",
                axis,
                about,
                values,
            ));
            chosen.len()
        });
    }
    let shown = data.axes.len() + shown.unwrap_or(0);
    let failed = match data.status.iter().filter(|code| **code == 1.0).count() {
        0 => String::new(),
        failed => format!(", {failed} of them failed"),
    };
    let varying = data.axes.iter().position(StudyColumn::varies);
    let page = PageDocument {
        title: data.title.clone(),
        subtitle: format!(
            "{}: {}{failed}{}",
            file_name(file.path()),
            counted(points, "point", "points"),
            html::changed(&file.changed())
        ),
        notice: (!data.complete)
            .then(|| "This sweep is not complete: points that were not run are struck through.".to_owned()),
        content: PointsContent {
            count: points,
            columns,
            first: match plane {
                Some([x, y]) => [Some(x), Some(y), Some(shown)],
                None => [Some(varying.unwrap_or(0)), Some(shown), None],
            },
            grid: data.is_grid,
            scale: (0..COLORS)
                .map(|k| hex(style::shade((k as f64 + 0.5) / COLORS as f64)))
                .collect(),
            status: Some(data.status.iter().map(|code| *code as i8).collect()),
            failures: &data.failures[..data.failures.len().min(MESSAGES)],
            overlays,
            commands: command(&data).into_iter().collect(),
            hint: HINT,
            ..PointsContent::default()
        },
    };
    Ok(PointsPage {
        points,
        branches: None,
        quantities: chosen.len(),
        bytes: page.write(&html::POINTS, &output)?,
    })
}

fn point_column(column: &StudyColumn, digits: Option<usize>) -> PointColumn {
    let role = digits.map_or(ColumnRole::Axis, |_| ColumnRole::Value);
    let drawn = drawn_axis(&column.name, &column.units, &column.long_name);
    let values = column.values.iter().copied().collect();
    PointColumn {
        words: column.flags.clone(),
        logarithmic: column.logarithmic,
        digits,
        ..PointColumn::new(role, &column.name, drawn, &column.long_name, values)
    }
}

/// The digits that the tolerance of the runs leaves.
fn digits(file: &StudyFile, data: &StudyData) -> usize {
    let of_case = || {
        let case = CaseSource::result(file.path(), file.input(INPUT_CASE).ok()??);
        Some(Case::read(&case, &[]).ok()?.solver.rtol)
    };
    let rtol = data.default_tolerance.or_else(of_case);
    rtol.map_or(USUAL_DIGITS, |rtol| (-rtol.log10()).ceil().clamp(4.0, 15.0) as usize)
}

/// The command that runs a point; `None` for files of earlier versions.
fn command(data: &StudyData) -> Option<PointCommand> {
    let mut options = Vec::new();
    for (k, axis) in data.axes.iter().enumerate() {
        for key in &axis.keys {
            options.push((format!("--set {key}={{{k}}}"), None));
            if let Some(tolerance) = data.default_tolerance.filter(|_| key == "solver.method") {
                let methods = axis.flags.iter().enumerate();
                let methods = methods.filter(|(_, (_, word))| OF_TOLERANCE.contains(&word.as_str()));
                let codes = methods.map(|(code, _)| code).collect();
                options.push((format!("--set solver.rtol={tolerance:e}"), Some((k, codes))));
            }
        }
    }
    let stem = data.path.file_stem().unwrap_or_default().to_string_lossy();
    options.push((format!("-o {stem}-{{point}}.h5"), None));
    Some(PointCommand {
        start: data.command.clone()?,
        options,
        hint: "Runs this point by itself. A case in a file is named as the study names it: run the command in the study's folder.",
    })
}
