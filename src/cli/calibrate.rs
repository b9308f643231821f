//! `stickslip calibrate`: finds parameters that reproduce measured values.

use super::arguments::{CalibrateOptions, Common};
use super::input::{interrupt_flag, overwrite};
use super::progress::{Bar, BarKind};
use super::{CommandEnd, CommandError, interrupted, tell};
use crate::plot::target::{self, Product};
use crate::report::CalibrationReport;
use std::path::{Path, PathBuf};
use std::time::Instant;
use stickslip_analysis::calibrate::{CALIBRATIONS, Calibration, CalibrationRun, CalibrationStudy};
use stickslip_analysis::sweep::StudySource;
use stickslip_case::CaseError;
use stickslip_files::disk::same_file;

pub(super) fn calibrate(options: &CalibrateOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    let study = read_study(options)?;
    let name = &study.runs.head.source.name;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{name}.h5")));
    // Set before the file is created, so that an interruption ends the calibration cleanly from then on.
    let stop = interrupt_flag()?;
    if let Some(case) = &options.case {
        check_case_target(case, &path, &study, options.force)?;
    }
    let jobs = options.runs.jobs.unwrap_or_else(stickslip_engine::workers::processors);
    let bar = Bar::new(common, BarKind::Parts, &stop);
    let clock = Instant::now();
    let result = CalibrationRun::new(&study, &path)
        .overwrite(overwrite(options.force))
        .workers(jobs)
        .watch(&bar)
        .start();
    bar.finish();
    let wall_time = clock.elapsed().as_secs_f64();
    let (file, calibration) = match result {
        Err(error) if error.is_interrupted() => {
            return interrupted(common, " before the first run was done; nothing is saved");
        }
        result => result?,
    };
    if let Some(case) = &options.case {
        write_case(case, &study, &calibration)?;
    }
    let paths = (&*file, options.case.as_deref());
    tell(
        common,
        &CalibrationReport::new((&study, &calibration), paths, (jobs, wall_time)),
    )?;
    if calibration.interrupted {
        let (runs, file) = (calibration.runs.len(), file.display());
        let how = format!("; the {runs} runs made so far are in {file}, and the best of them is shown");
        return interrupted(common, &how);
    }
    Ok(CommandEnd::Done)
}

fn read_study(options: &CalibrateOptions) -> Result<CalibrationStudy, CaseError> {
    let source = StudySource::find(&options.study, CALIBRATIONS)?;
    CalibrationStudy::parse(source, &options.runs.overrides()?)
}

fn check_case_target(case: &Path, result: &Path, study: &CalibrationStudy, force: bool) -> Result<(), CommandError> {
    if same_file(case, result) {
        return Err(CommandError::input(format!(
            "{}: is the result file, too; choose another name with --case or -o",
            case.display()
        )));
    }
    Ok(target::check(case, Product::Case, &study.runs.head.files, force)?)
}

fn write_case(path: &Path, study: &CalibrationStudy, calibration: &Calibration) -> Result<(), CommandError> {
    let case = study.case_at(&calibration.shares).map_err(|error| {
        CommandError::computation(format!("{}: the case cannot be written: {error}", path.display()))
    })?;
    let mut text = format!(
        "# Calibrated by stickslip {} from {}; free parameters:\n",
        env!("CARGO_PKG_VERSION"),
        study.runs.head.source.label()
    );
    for (axis, value) in study.runs.axes.iter().zip(&calibration.parameters) {
        text += &format!("#   {} = {value:?}\n", axis.keys.join(", "));
    }
    text += &case.resolved();
    Ok(target::write(path, Product::Case, &[text.as_bytes()])?)
}
