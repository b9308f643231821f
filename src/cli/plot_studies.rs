//! `stickslip plot` of files that hold many runs: sweeps, calibrations, work-precision studies, continuations.

use super::arguments::PlotOptions;
use super::terminal;
use crate::analysis::distribution::{Distribution, PERCENTILES};
use crate::continuation::Stored;
use crate::plot::branches::{self, Branches};
use crate::plot::studies::{self, Choice, StudyQuantity};
use crate::plot::{Figure, PlotError, work_precision};
use crate::results::{Reason, ResultFile, SweepFile, WorkPrecisionFile, check_sound};
use serde::Serialize;
use std::path::Path;

/// What a file holds, as far as drawing it is concerned.
pub(super) enum Kind {
    /// One run, or nothing that is known.
    Run,
    /// Many runs of a sweep or a calibration.
    Sweep(SweepFile),
    /// Methods by tolerances.
    WorkPrecision,
    /// Branches of a continuation.
    Branches,
}

/// What there is to draw, and what a run does not have.
#[derive(Default)]
pub(super) struct Chosen {
    pub figures: Vec<Figure>,
    pub not_drawn: Vec<NotDrawn>,
    pub sampling: Option<String>,
    /// How the quantities of many runs are spread.
    pub distributions: Vec<(StudyQuantity, Distribution)>,
}

impl Chosen {
    /// These figures.
    pub fn of(figures: Vec<Figure>) -> Chosen {
        Chosen {
            figures,
            ..Chosen::default()
        }
    }
}

#[derive(Serialize)]
pub(super) struct NotDrawn {
    pub figure: &'static str,
    pub why: String,
}

/// What `path` holds, which is to be drawn.
///
/// # Errors
/// A shard of a sweep, which is no whole, and a damaged file.
pub(super) fn kind(path: &Path) -> Result<Kind, PlotError> {
    let kind = match SweepFile::open(path) {
        Ok(file) => Kind::Sweep(file),
        Err(error) if matches!(error.reason, Reason::OnlyAShard) => return Err(error.into()),
        Err(_) if WorkPrecisionFile::is_one(path) => Kind::WorkPrecision,
        Err(_) if Stored::is_one(path) => Kind::Branches,
        // Whoever draws it says what it is.
        Err(_) if ResultFile::open(path).is_err() => return Ok(Kind::Run),
        Err(_) => Kind::Run,
    };
    check_sound(path)?;
    Ok(kind)
}

/// The choice that the options make; an error of wrong usage for what is not about such files.
pub(super) fn choice(options: &PlotOptions) -> Result<Choice, String> {
    let place = |text: &String| match text.split_once('=') {
        Some((name, value)) => Ok((name.trim().to_owned(), value.trim().to_owned())),
        None => Err(format!("--at {text}: expected AXIS=VALUE, such as torsion.damping=22")),
    };
    Ok(Choice {
        quantities: options.quantities.clone(),
        axes: <[String; 2]>::try_from(options.axes.clone()).ok(),
        at: options.at.iter().map(place).collect::<Result<_, _>>()?,
    })
}

/// The figures of a sweep or a calibration: those of the names that are asked for, or all.
pub(super) fn of_sweep(file: &SweepFile, choice: &Choice, only: &[String]) -> Result<Chosen, PlotError> {
    let figures = named(studies::figures(file, choice)?, only, file.path())?;
    let mut chosen = Chosen::of(figures);
    chosen.distributions = studies::distributions(file, choice)?;
    Ok(chosen)
}

/// The figures of a continuation: of the quantities or names that are asked for, or the most important ones.
pub(super) fn of_branches(path: &Path, quantities: &[String], only: &[String]) -> Result<Chosen, PlotError> {
    let file = Branches::read(path)?;
    let figures = match (quantities, only) {
        ([], [_, ..]) => file.all()?,
        _ => file.figures(quantities)?,
    };
    Ok(Chosen::of(named(figures, only, path)?))
}

/// All figures of a continuation.
pub(super) fn all_of_branches(path: &Path) -> Result<Chosen, PlotError> {
    Ok(Chosen::of(Branches::read(path)?.all()?))
}

/// The figures of these names, or all.
fn named(mut figures: Vec<Figure>, only: &[String], path: &Path) -> Result<Vec<Figure>, PlotError> {
    if only.is_empty() {
        return Ok(figures);
    }
    let known: Vec<String> = figures.iter().map(|figure| figure.name.clone()).collect();
    figures.retain(|figure| only.iter().any(|name| is_named(figure, name)));
    match figures.is_empty() {
        true => Err(PlotError::Study {
            path: path.to_owned(),
            why: format!("has no figure {}; there are {}", only.join(", "), known.join(", ")),
        }),
        false => Ok(figures),
    }
}

/// By its whole name, the name of its kind, or its number in the paper.
fn is_named(figure: &Figure, name: &str) -> bool {
    let of_kind = figure.name.strip_prefix(name).is_some_and(|rest| rest.starts_with('-'));
    let mut entries = studies::ENTRIES.iter().chain(&branches::ENTRIES);
    let entry = entries.any(|entry| entry.name == name);
    let number = figure.paper_figure.map(|number| number.to_string());
    figure.name == name || entry && of_kind || number.as_deref() == Some(name)
}

/// The figure of a work-precision study.
pub(super) fn of_work_precision(path: &Path) -> Result<Chosen, PlotError> {
    Ok(Chosen::of(vec![work_precision::of_file(path)?]))
}

/// Percentiles as a table, and a histogram, of every quantity.
pub(super) fn report(distributions: &[(StudyQuantity, Distribution)]) -> String {
    let shown = |(quantity, found): &(StudyQuantity, Distribution)| {
        format!("\n{}", terminal::distribution(&quantity.name, &quantity.units, found))
    };
    distributions.iter().map(shown).collect()
}

/// A distribution as JSON.
pub(super) fn documents(distributions: &[(StudyQuantity, Distribution)]) -> Vec<serde_json::Value> {
    let document = |(quantity, distribution): &(StudyQuantity, Distribution)| {
        let percentiles = PERCENTILES.iter().zip(&distribution.percentiles);
        let percentiles: serde_json::Map<String, serde_json::Value> = percentiles
            .map(|(percent, value)| (percent.to_string(), (*value).into()))
            .collect();
        serde_json::json!({
            "quantity": quantity.name,
            "unit": quantity.units,
            "count": distribution.count,
            "without": distribution.without,
            "least": distribution.least,
            "largest": distribution.largest,
            "mean": distribution.mean,
            "percentiles": percentiles,
            "bars": distribution.bars,
        })
    };
    distributions.iter().map(document).collect()
}
