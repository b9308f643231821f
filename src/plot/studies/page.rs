//! The interactive page of a study: a map or dots of any quantity over two axes, with the command that runs each point.

use super::data::{StudyAxis, StudyData, StudyQuantity, drawn_axis};
use super::{plane, refused, region};
use crate::plot::figure::hex;
use crate::plot::html::{self, PageDocument, counted, file_name};
use crate::plot::points::{
    CommandWord, LETTERS, Overlay, PointColumn, PointCommand, PointsContent, PointsPage, SIZE_LIMIT, USUAL_DIGITS,
    WordValue, digits_of,
};
use crate::plot::target::{self, Product};
use crate::plot::{PlotError, colors, critical};
use std::path::Path;
use stickslip_case::{Case, CaseSource};
use stickslip_files::SweepFile;

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
/// An unreadable file, too many points, an obstacle at `path` (see `target::check`), or a full disk.
pub fn write(file: &SweepFile, quantities: &[String], path: &Path, force: bool) -> Result<PointsPage, PlotError> {
    target::check(path, Product::Page, &[file.path().to_owned()], force)?;
    let data = StudyData::read(file)?;
    let chosen = match quantities {
        // Where every point failed, all are shown as empty.
        [] if !data.quantities.iter().any(StudyQuantity::is_known) => data.quantities.iter().collect(),
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
        return refused(&data, why);
    }
    let mut columns: Vec<PointColumn> = data.axes.iter().map(of_axis).collect();
    let digits = digits(file, &data);
    columns.extend(chosen.iter().map(|quantity| of_quantity(quantity, digits)));
    let interest = data.of_interest(&[]);
    let mut shown = chosen
        .iter()
        .position(|quantity| interest.first().is_some_and(|one| one.name == quantity.name));
    let (mut overlays, mut plane) = (Vec::new(), plane::first(&data));
    if let Some((x, y, panel)) = critical::panel(file)? {
        plane = data
            .axis(&x)
            .ok()
            .zip(data.axis(&y).ok())
            .map(|(x, y)| [x, y])
            .or(plane);
        let (curves, labels) = (panel.curves, panel.labels);
        overlays.push(Overlay { x, y, curves, labels });
    }
    if !file.variables("calibration").is_empty() {
        let (region, residuals) = region::of_page(file, &data)?;
        overlays.extend(region);
        shown = residuals.map(|residuals| {
            let axis = drawn_axis("largest_residual", "1", "");
            let about = "largest residual of the held targets, in half-widths: they hold below 1";
            columns.push(PointColumn {
                drawn: true,
                ..PointColumn::new("largest_residual", &axis, about, residuals.into_iter().collect())
            });
            chosen.len()
        });
    }
    let shown = data.axes.len() + shown.unwrap_or(0);
    let failed = data.status.iter().filter(|code| **code == 1.0).count();
    let failed = if failed > 0 {
        format!(", {failed} of them failed")
    } else {
        String::new()
    };
    let page = PageDocument {
        title: data.title.clone(),
        subtitle: format!(
            "{}: {}{failed}",
            file_name(file.path()),
            counted(points, "point", "points")
        ),
        notice: (!data.complete)
            .then(|| "This sweep is not complete: points that were not run are struck through.".to_owned()),
        content: PointsContent {
            count: points,
            columns,
            first: match plane {
                Some([x, y]) => [Some(x), Some(y), Some(shown)],
                None => {
                    let varying = data.axes.iter().position(StudyAxis::varies);
                    [Some(varying.unwrap_or(0)), Some(shown), None]
                }
            },
            grid: data.is_grid,
            scale: (0..COLORS)
                .map(|k| hex(colors::at((k as f64 + 0.5) / COLORS as f64)))
                .collect(),
            status: Some(data.status.iter().map(|code| *code as i8).collect()),
            failures: &data.failures[..data.failures.len().min(MESSAGES)],
            lines: Vec::new(),
            marks: None,
            groups: Vec::new(),
            overlays,
            commands: command(&data).into_iter().collect(),
            which: None,
            hint: HINT,
        },
    };
    Ok(PointsPage {
        points,
        branches: None,
        quantities: chosen.len(),
        bytes: page.write(&html::POINTS, path)?,
    })
}

fn of_axis(axis: &StudyAxis) -> PointColumn {
    let drawn = drawn_axis(&axis.name, &axis.units, &axis.long_name);
    let words = (0i64..).zip(axis.words.iter().cloned()).collect();
    PointColumn {
        words,
        logarithmic: axis.logarithmic,
        axis: true,
        drawn: true,
        digits: None,
        ..PointColumn::new(
            &axis.name,
            &drawn,
            &axis.long_name,
            axis.values.iter().copied().collect(),
        )
    }
}

fn of_quantity(quantity: &StudyQuantity, digits: usize) -> PointColumn {
    PointColumn {
        words: quantity.flags.clone(),
        drawn: true,
        digits: Some(digits),
        ..PointColumn::new(
            &quantity.name,
            &quantity.axis(),
            &quantity.long_name,
            quantity.values.iter().copied().collect(),
        )
    }
}

/// The digits that the tolerance of the runs leaves.
fn digits(file: &SweepFile, data: &StudyData) -> usize {
    let of_case = || {
        let case = CaseSource::result(file.path(), file.case_text()?);
        Some(Case::read(&case, &[]).ok()?.solver.rtol)
    };
    data.default_tolerance.or_else(of_case).map_or(USUAL_DIGITS, digits_of)
}

/// The command that runs a point; `None` for files of earlier versions.
fn command(data: &StudyData) -> Option<PointCommand> {
    let mut words = Vec::new();
    for (k, axis) in data.axes.iter().enumerate() {
        for key in &axis.keys {
            words.push(CommandWord::new("--set", format!("{key}="), Some(WordValue::Column(k))));
            if let Some(tolerance) = data.default_tolerance.filter(|_| key == "solver.method") {
                let methods = axis.words.iter().enumerate();
                let methods = methods.filter(|(_, word)| OF_TOLERANCE.contains(&word.as_str()));
                words.push(CommandWord {
                    only: Some((k, methods.map(|(code, _)| code).collect())),
                    ..CommandWord::new("--set", format!("solver.rtol={tolerance:e}"), None)
                });
            }
        }
    }
    let stem = data.path.file_stem().unwrap_or_default().to_string_lossy();
    words.push(CommandWord {
        after: ".h5",
        ..CommandWord::new("-o", format!("{stem}-"), Some(WordValue::Point))
    });
    Some(PointCommand {
        start: data.command.clone()?,
        words,
        hint: "Runs this point by itself. A case in a file is named as the study names it: run the command in the study's folder.",
    })
}
