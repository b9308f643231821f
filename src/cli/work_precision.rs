//! `stickslip work-precision`: measures errors and costs of methods.

use super::arguments::{Common, FigureFormat, WorkPrecisionOptions};
use super::input::{interrupt_flag, overwrite};
use super::plot;
use super::progress::{Bar, BarKind};
use super::{CommandEnd, CommandError, interrupted, tell};
use crate::plot::{PlotError, signature, target, work_precision as figure};
use crate::report::PrecisionReport;
use std::path::{Path, PathBuf};
use stickslip_analysis::analysis::work_precision::{PrecisionRun, PrecisionStudy, STUDIES, StudyResult, StudySource};

pub(super) fn work_precision(options: &WorkPrecisionOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let source = StudySource::find(&options.study, STUDIES)?;
    let study = PrecisionStudy::parse(source)?;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}.h5", study.head.source.name)));
    // Everything is checked before minutes of computation.
    let stop = interrupt_flag()?;
    let names = signature::source(std::slice::from_ref(&path));
    let figures = figure_targets(options.figure.as_deref(), options.force, &study.head.files, &names)?;
    let bar = Bar::new(common, BarKind::Parts, &stop);
    let result = PrecisionRun::new(&study, &path)
        .overwrite(overwrite(options.force))
        .watch(&bar)
        .start();
    bar.finish();
    let (file, result) = match result {
        Err(error) if error.is_interrupted() => {
            return interrupted(common, " before there was a reference; nothing is saved");
        }
        result => result?,
    };
    let figures = draw(&study, &result, &figures, &names)?;
    tell(common, &PrecisionReport::new(&study, &result, &file, &figures))?;
    if result.interrupted {
        let (done, all) = (result.measurements.len(), study.runs.len());
        let how = format!(" after {done} of {all} runs; they are saved in {}", file.display());
        return interrupted(common, &how);
    }
    Ok(CommandEnd::Done)
}

fn figure_targets(
    folder: Option<&Path>,
    force: bool,
    inputs: &[PathBuf],
    source: &str,
) -> Result<Vec<(PathBuf, FigureFormat)>, CommandError> {
    let Some(folder) = folder else {
        return Ok(Vec::new());
    };
    std::fs::create_dir_all(folder).map_err(|source| {
        CommandError::computation(format!(
            "{}: creating the folder of the figure failed: {source}; choose another with --figure",
            folder.display()
        ))
    })?;
    let mut targets = Vec::with_capacity(2);
    for format in [FigureFormat::Svg, FigureFormat::Png] {
        let path = folder.join(format!("{}.{}", figure::NAME, format.extension()));
        target::check(&path, plot::OF_COMMAND, inputs, force)?;
        if !force {
            plot::spare(&path, source, plot::OF_COMMAND)?;
        }
        targets.push((path, format));
    }
    Ok(targets)
}

fn draw(
    study: &PrecisionStudy,
    result: &StudyResult,
    targets: &[(PathBuf, FigureFormat)],
    source: &str,
) -> Result<Vec<PathBuf>, PlotError> {
    if targets.is_empty() || result.measurements.is_empty() {
        return Ok(Vec::new());
    }
    let figure = figure::figure(&study.head.title, result);
    targets
        .iter()
        .map(|(path, format)| plot::draw(&figure, (path, *format), source.to_owned()).map(|()| path.clone()))
        .collect()
}
