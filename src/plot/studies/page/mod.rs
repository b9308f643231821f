//! The interactive page of a study: one HTML file that a browser opens from disk, without a network. A map or dots of any
//! quantity over two axes; the pointer reads values, and a click shows the command that runs the point.

use super::data::{StudyAxis, StudyData, StudyQuantity};
use super::refused;
use crate::plot::critical::Boundary;
use crate::plot::figure::hex;
use crate::plot::target::{self, Product};
use crate::plot::{PlotError, colors, critical, html};
use crate::results::SweepFile;
use serde::Serialize;
use std::path::Path;

/// A page is smaller than this, bytes: 20,000 points with all quantities of a brake.
const SIZE_LIMIT: usize = 8_000_000;
/// Messages of failed points on a page.
const MESSAGES: usize = 2_000;
/// Colours of the scale.
const COLORS: usize = 64;

const TEMPLATE: &str = include_str!("study.html");
/// Style of the pages of studies and of branches.
pub(in crate::plot) const STYLE: &str = include_str!("study.css");
/// What their scripts share.
pub(in crate::plot) const COMMON: &str = include_str!("common.js");
const SCRIPT: &str = include_str!("study.js");

/// What a page holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct StudyPage {
    /// Points of the study.
    pub points: usize,
    /// Quantities of each.
    pub quantities: usize,
    /// Size of the page.
    pub bytes: u64,
}

#[derive(Serialize)]
struct Document<'a> {
    title: &'a str,
    file: String,
    /// What results of single points are named after.
    stem: String,
    complete: bool,
    is_grid: bool,
    points: usize,
    axes: &'a [StudyAxis],
    quantities: &'a [&'a StudyQuantity],
    first: usize,
    /// Code of each point, base64 of bytes.
    status: String,
    /// (number, message)
    failures: &'a [(u64, String)],
    command: &'a Option<String>,
    default_tolerance: Option<f64>,
    boundary: Option<Boundary>,
    colors: Vec<String>,
}

/// Writes the page of a sweep to `path`, with these quantities or with all that a run has.
///
/// # Errors
/// The file cannot be read, or has too many points for a page; `path` is in no folder, or a file that is no page of this
/// program and is not to be replaced by `force`; the disk is full.
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
