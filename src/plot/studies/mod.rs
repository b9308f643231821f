//! Figures of many runs. A sweep has a map, curves, a distribution and the boundary. A calibration has the region of
//! valid parameters.
//!
//! | module | contents |
//! |---|---|
//! | [`data`] | the file in memory |
//! | `plane` | a quantity over one or two axes, its distribution, and the points to draw |
//! | `region` | the region in which a calibration meets its targets |
//! | [`page`] | the interactive page |

pub mod data;
pub mod page;
mod plane;
mod region;

use super::figure::Figure;
use crate::Error;
pub use data::{StudyColumn, StudyData};
pub use plane::rank_correlation;
use std::path::Path;
use stickslip_analysis::analysis::distribution::Distribution;
use stickslip_files::StudyFile;

/// Requested figures of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Choice {
    /// Names of quantities. If empty, the quantities are those of the study, or one that varies.
    pub quantities: Vec<String>,
    /// Horizontal and vertical axis of a map, by name or key.
    pub axes: Option<[String; 2]>,
    /// Axes that are held constant: (name or key, value).
    pub at: Vec<(String, String)>,
}

impl Choice {
    /// Whether nothing is requested.
    pub fn is_empty(&self) -> bool {
        *self == Choice::default()
    }
}

/// A kind of figure for many runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StudyEntry {
    /// Prefix in the names of its figures.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Kind of file that has the figure.
    pub of: &'static str,
    /// Number in the paper; `None` if it is not in the paper.
    pub paper_figure: Option<u32>,
}

pub(super) const fn entry(name: &'static str, title: &'static str, of: &'static str) -> StudyEntry {
    StudyEntry {
        name,
        title,
        of,
        paper_figure: None,
    }
}

/// The kinds of figures.
pub const ENTRIES: [StudyEntry; 6] = [
    StudyEntry {
        paper_figure: Some(25),
        ..entry("critical-curve", "Boundary in its plane", "sweep with a [boundary]")
    },
    entry("map", "A quantity over two axes, as a map", "sweep of a grid"),
    entry("curves", "A quantity over one axis", "sweep of a grid"),
    entry(
        "samples",
        "Distribution of a quantity, and against each axis",
        "sweep of a sample or table",
    ),
    entry(
        "plane",
        "A quantity over two axes, as dots",
        "sweep of a sample, table or boundary",
    ),
    entry("region", "Where the targets of a calibration hold", "calibration"),
];

/// The figures of a file, at least one.
///
/// # Errors
/// The file is unreadable, a quantity, axis or value is unknown, or there is nothing to draw.
pub fn figures(file: &StudyFile, choice: &Choice) -> Result<Vec<Figure>, Error> {
    if choice.is_empty() && file.text("boundary/x")?.is_some() {
        return Ok(vec![super::critical::figure(file)?]);
    }
    let data = StudyData::read(file)?;
    if choice.is_empty() && !file.names("calibration")?.is_empty() {
        return region::figures(file, &data);
    }
    let mut figures = Vec::new();
    for quantity in quantities(&data, choice)? {
        if data.is_grid {
            let mut figure = plane::or_curves(&data, quantity, choice)?;
            if choice.quantities.is_empty() && !data.asks() {
                figure.title += if quantity.varies() {
                    ", the quantity that tells most points apart"
                } else {
                    ", as no quantity varies"
                };
            }
            figures.push(figure);
            continue;
        }
        let traced = file.text("boundary/x")?.is_some();
        if choice.axes.is_none() && !traced {
            figures.push(plane::samples(&data, quantity)?);
        }
        if choice.axes.is_some() || data.axes.iter().filter(|axis| axis.varies()).count() > 1 {
            let boundary = if traced { super::critical::boundary(file)? } else { None };
            figures.push(plane::dots(&data, quantity, choice, boundary)?);
        }
    }
    Ok(figures)
}

/// The distribution of each drawn quantity over a sample. A grid has none, because its points are chosen.
pub fn distributions(file: &StudyFile, choice: &Choice) -> Result<Vec<(StudyColumn, Distribution)>, Error> {
    let designed = file.is_grid()? || file.text("boundary/x")?.is_some() || !file.names("calibration")?.is_empty();
    if designed {
        return Ok(Vec::new());
    }
    let data = StudyData::read(file)?;
    let mut found = Vec::new();
    for quantity in quantities(&data, choice)? {
        if let Some(distribution) = Distribution::of(&quantity.values, quantity.whole) {
            found.push((quantity.clone(), distribution));
        }
    }
    Ok(found)
}

/// The requested quantities, or those of the study. Without any: a sample's onset, or a grid's most distinctive
/// result.
fn quantities<'a>(data: &'a StudyData, choice: &Choice) -> Result<Vec<&'a StudyColumn>, Error> {
    if choice.quantities.is_empty() {
        let wishes = ["onset_time", "attractor_period"];
        return Ok(data.of_interest(if data.is_grid { &[] } else { &wishes }));
    }
    choice.quantities.iter().map(|name| data.quantity(name)).collect()
}

/// The title of a study, complete or not, with what a figure of it shows.
pub(super) fn title((study, complete): (&str, bool), what: &str) -> String {
    let incomplete = if complete { "" } else { " (incomplete)" };
    format!("{study}{incomplete}: {what}")
}

pub(super) fn refused<T>(path: &Path, why: impl Into<String>) -> Result<T, Error> {
    Err(Error::of_file(path, why.into()))
}
