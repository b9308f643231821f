//! The interactive page of a study: one HTML file that works offline, with a map or dots of any quantity over two axes.
//! The pointer reads values, and a click shows the command for the point.

use super::data::{StudyAxis, StudyData, StudyQuantity};
use super::refused;
use crate::plot::critical::Boundary;
use crate::plot::figure::hex;
use crate::plot::target::{self, Product};
use crate::plot::{PlotError, colors, critical, html};
use serde::Serialize;
use std::path::Path;
use stickslip_files::SweepFile;

/// Bytes: 20,000 points with all quantities of a brake.
const SIZE_LIMIT: usize = 8_000_000;
/// Largest number of messages of failed points.
const MESSAGES: usize = 2_000;
const COLORS: usize = 64;

const TEMPLATE: &str = include_str!("study.html");
/// Style and script of the pages of studies and of branches.
pub(in crate::plot) const STYLE: &str = include_str!("study.css");
pub(in crate::plot) const COMMON: &str = include_str!("common.js");
const SCRIPT: &str = include_str!("study.js");

/// Contents of a written page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct StudyPage {
    /// Number of points.
    pub points: usize,
    /// Number of quantities per point.
    pub quantities: usize,
    /// Size, bytes.
    pub bytes: u64,
}

#[derive(Serialize)]
struct Document<'a> {
    title: &'a str,
    file: String,
    /// Stem of the names of single points' results.
    stem: String,
    complete: bool,
    is_grid: bool,
    points: usize,
    axes: &'a [StudyAxis],
    quantities: &'a [&'a StudyQuantity],
    first: usize,
    status: String,
    /// (number, message)
    failures: &'a [(u64, String)],
    command: &'a Option<String>,
    default_tolerance: Option<f64>,
    boundary: Option<Boundary>,
    colors: Vec<String>,
}

/// Writes the page of a sweep to `path`, with `quantities` (empty: all).
///
/// # Errors
/// An unreadable file, too many points, an obstacle at `path` (see `target::check`), or a full disk.
pub fn write(file: &SweepFile, quantities: &[String], path: &Path, force: bool) -> Result<StudyPage, PlotError> {
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
    // A double is eleven letters of base64.
    let room = points * (11 * (chosen.len() + data.axes.len()) + 2);
    if room > SIZE_LIMIT {
        let fit = (SIZE_LIMIT / points.max(1)).saturating_sub(2) / 11;
        let count = chosen.len();
        let why = match fit.saturating_sub(data.axes.len()) {
            0 => format!("{points} points are too many for a page; draw a figure with -o instead"),
            fit => format!(
                "{points} points with {count} quantities are too many for a page; choose up to {fit} with --quantity NAME"
            ),
        };
        return refused(&data, why);
    }
    let interest = data.of_interest(&[]);
    let first = chosen
        .iter()
        .position(|quantity| Some(quantity.name.as_str()) == interest.first().map(|q| q.name.as_str()));
    let name = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let document = Document {
        title: &data.title,
        file: name(file.path().file_name()),
        stem: name(file.path().file_stem()),
        complete: data.complete,
        is_grid: data.is_grid,
        points,
        axes: &data.axes,
        quantities: &chosen,
        first: first.unwrap_or(0),
        status: html::encoded(data.status.iter().map(|code| *code as u8)),
        failures: &data.failures[..data.failures.len().min(MESSAGES)],
        command: &data.command,
        default_tolerance: data.default_tolerance,
        boundary: critical::boundary(file)?,
        colors: (0..COLORS)
            .map(|k| hex(colors::at((k as f64 + 0.5) / COLORS as f64)))
            .collect(),
    };
    let data = html::json(&document)?;
    let page = html::page(
        TEMPLATE,
        document.title,
        &[
            ("style", STYLE),
            ("data", &data),
            ("script", &format!("{COMMON}\n{SCRIPT}")),
        ],
    );
    target::write(path, Product::Page, &[page.as_bytes()])?;
    Ok(StudyPage {
        points,
        quantities: chosen.len(),
        bytes: page.len() as u64,
    })
}
