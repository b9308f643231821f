//! `stickslip work-precision`: measures errors and costs of methods.

use super::arguments::{Common, FigureFormat, WorkPrecisionOptions};
use super::input::{interrupt_flag, overwrite};
use super::plot::{self, FigureOutput};
use super::progress::{Bar, BarKind};
use super::{CommandEnd, interrupted, tell};
use crate::Error;
use crate::output::Output;
use crate::plot::{signature, work_precision as figure};
use crate::report::PrecisionReport;
use std::path::{Path, PathBuf};
use stickslip_analysis::analysis::work_precision::{PrecisionStudy, STUDIES, StudyError, StudySource, run};
use stickslip_analysis::provenance;
use stickslip_files::Reservation;

pub(super) fn work_precision(options: &WorkPrecisionOptions, common: &Common) -> Result<CommandEnd, Error> {
    let source = StudySource::find(&options.study, STUDIES)?;
    let study = PrecisionStudy::parse(source)?;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}.h5", study.source.name)));
    // Everything is checked before minutes of computation.
    let stop = interrupt_flag()?;
    let place = Reservation::take(&path, overwrite(options.force), &study.files)?;
    let names = signature::source(std::slice::from_ref(&path));
    let figures = figure_outputs(options.figure.as_deref(), options.force, &study.files, &names)?;
    let started = provenance::now();
    let bar = Bar::new(common, BarKind::Parts, &stop);
    let result = run(&study, &bar);
    bar.finish();
    let result = result.map_err(|error| match error {
        StudyError::Truth(_) => Error::input(error),
        _ => Error::computation(error),
    })?;
    let Some(result) = result else {
        return interrupted(common, " before there was a reference; nothing is saved");
    };
    let file = result.write(&study, &started, &place).map_err(Error::computation)?;
    let drawn = !result.measurements.is_empty();
    let figures: &[FigureOutput] = if drawn { &figures } else { &[] };
    let figure = figure::figure(&study.title, &result);
    figures
        .iter()
        .try_for_each(|output| plot::draw(&figure, output, &names))?;
    let figures: Vec<PathBuf> = figures.iter().map(|(output, _)| output.path().to_owned()).collect();
    tell(common, &PrecisionReport::new(&study, &result, &file, &figures))?;
    if result.interrupted {
        let (done, all) = (result.measurements.len(), study.runs.len());
        let how = format!(" after {done} of {all} runs; they are saved in {}", file.display());
        return interrupted(common, &how);
    }
    Ok(CommandEnd::Done)
}

fn figure_outputs(
    folder: Option<&Path>,
    force: bool,
    inputs: &[PathBuf],
    source: &str,
) -> Result<Vec<FigureOutput>, Error> {
    let Some(folder) = folder else {
        return Ok(Vec::new());
    };
    std::fs::create_dir_all(folder).map_err(|source| {
        Error::computation(format!(
            "{}: creating the folder of the figure failed: {source}; choose another with --figure",
            folder.display()
        ))
    })?;
    let output = |format: FigureFormat| {
        let path = folder.join(format!("{}.{}", figure::NAME, format.extension()));
        let output = Output::new(&path, plot::OF_COMMAND, inputs, force)?;
        if !force {
            output.spare(source)?;
        }
        Ok((output, format))
    };
    [FigureFormat::Svg, FigureFormat::Png].into_iter().map(output).collect()
}
