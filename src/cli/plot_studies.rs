//! `stickslip plot` for files of many runs: sweeps, calibrations, work-precision studies, continuations.

use super::arguments::PlotOptions;
use crate::plot::branches::{self, Branches};
use crate::plot::studies::{self, Choice, StudyQuantity};
use crate::plot::{Figure, PlotError, work_precision};
use serde::Serialize;
use std::path::Path;
use stickslip_analysis::analysis::distribution::Distribution;
use stickslip_analysis::continuation::Stored;
use stickslip_files::{Reason, ResultFile, StudyFile, check_sound, schema};

pub(super) enum StudyKind {
    Run,
    Sweep(Box<StudyFile>),
    WorkPrecision,
    Branches,
}

#[derive(Default)]
pub(super) struct Chosen {
    pub figures: Vec<Figure>,
    pub not_drawn: Vec<NotDrawn>,
    pub sampling: Option<String>,
    pub distributions: Vec<(StudyQuantity, Distribution)>,
}

impl Chosen {
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

pub(super) fn kind(path: &Path) -> Result<StudyKind, PlotError> {
    let kind = match StudyFile::open(path, schema::SWEEP_FORMAT) {
        Ok(file) => StudyKind::Sweep(Box::new(file)),
        Err(error) if matches!(error.reason, Reason::OnlyAShard | Reason::Uneven { .. }) => return Err(error.into()),
        Err(_) if StudyFile::is(path, schema::WORK_PRECISION_FORMAT) => StudyKind::WorkPrecision,
        Err(_) if Stored::is_one(path) => StudyKind::Branches,
        // The command that draws the file will report the error.
        Err(_) if ResultFile::open(path).is_err() => return Ok(StudyKind::Run),
        Err(_) => StudyKind::Run,
    };
    check_sound(path)?;
    Ok(kind)
}

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

pub(super) fn of_sweep(file: &StudyFile, choice: &Choice, only: &[String]) -> Result<Chosen, PlotError> {
    let figures = named(studies::figures(file, choice)?, only, file.path())?;
    let mut chosen = Chosen::of(figures);
    chosen.distributions = studies::distributions(file, choice)?;
    Ok(chosen)
}

/// The figures of a continuation with the requested quantities or names, or the most important ones.
pub(super) fn of_branches(path: &Path, quantities: &[String], only: &[String]) -> Result<Chosen, PlotError> {
    let file = Branches::read(path)?;
    let figures = match (quantities, only) {
        ([], [_, ..]) => file.all()?,
        _ => file.figures(quantities)?,
    };
    Ok(Chosen::of(named(figures, only, path)?))
}

pub(super) fn all_of_branches(path: &Path) -> Result<Chosen, PlotError> {
    Ok(Chosen::of(Branches::read(path)?.all()?))
}

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

fn is_named(figure: &Figure, name: &str) -> bool {
    let of_kind = figure.name.strip_prefix(name).is_some_and(|rest| rest.starts_with('-'));
    let mut entries = studies::ENTRIES.iter().chain(&branches::ENTRIES);
    let entry = entries.any(|entry| entry.name == name);
    let number = figure.paper_figure.map(|number| number.to_string());
    figure.name == name || entry && of_kind || number.as_deref() == Some(name)
}

pub(super) fn of_work_precision(path: &Path) -> Result<Chosen, PlotError> {
    Ok(Chosen::of(vec![work_precision::of_file(path)?]))
}
