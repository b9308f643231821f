//! `stickslip calibrate`: finds parameters that reproduce measured values.

use super::arguments::{CalibrateOptions, Common};
use super::input::{interrupt_flag, overwrite};
use super::progress::{Bar, BarKind};
use super::{CommandEnd, interrupted, tell};
use crate::Error;
use crate::output::{Output, Product};
use crate::report::CalibrationReport;
use std::path::{Path, PathBuf};
use std::time::Instant;
use stickslip_analysis::calibrate::{
    CALIBRATIONS, Calibration, CalibrationError, CalibrationStudy, calibrate as find, write_file,
};
use stickslip_analysis::sweep::StudySource;
use stickslip_case::CaseError;
use stickslip_files::Reservation;
use stickslip_files::disk::same_file;

pub(super) fn calibrate(options: &CalibrateOptions, common: &Common) -> Result<CommandEnd, Error> {
    let study = read_study(options)?;
    let name = &study.runs.source.name;
    let path = options
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{name}.h5")));
    // Set before the file is created, so that an interruption ends the calibration cleanly from then on.
    let stop = interrupt_flag()?;
    let place = Reservation::take(&path, overwrite(options.force), &study.runs.files)?;
    let case = options.case.as_deref();
    let case = case
        .map(|case| case_output(case, &path, &study, options.force))
        .transpose()?;
    let jobs = options.runs.jobs.unwrap_or_else(stickslip_engine::workers::processors);
    let bar = Bar::new(common, BarKind::Parts, &stop);
    let clock = Instant::now();
    let result = find(&study, jobs, &bar);
    bar.finish();
    let wall_time = clock.elapsed().as_secs_f64();
    let calibration = match result {
        Ok(calibration) => calibration,
        Err(CalibrationError::NothingRun) => {
            return interrupted(common, " before the first run was done; nothing is saved");
        }
        Err(error) => return Err(Error::computation(error)),
    };
    let file = write_file(&study, &calibration, place).map_err(Error::computation)?;
    if let Some(case) = &case {
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

fn case_output(case: &Path, result: &Path, study: &CalibrationStudy, force: bool) -> Result<Output, Error> {
    if same_file(case, result) {
        let why = "is the result file, too; choose another name with --case or -o";
        return Err(Error::of_file(case, why));
    }
    Output::new(case, Product::Case, &study.runs.files, force)
}

fn write_case(output: &Output, study: &CalibrationStudy, calibration: &Calibration) -> Result<(), Error> {
    let case = study.case_at(&calibration.shares).map_err(|error| {
        Error::computation(format!(
            "{}: the case cannot be written: {error}",
            output.path().display()
        ))
    })?;
    let mut text = format!(
        "# Calibrated by stickslip {} from {}; free parameters:\n",
        env!("CARGO_PKG_VERSION"),
        study.runs.source.label()
    );
    for (axis, value) in study.runs.axes.iter().zip(&calibration.parameters) {
        text += &format!("#   {} = {value:?}\n", axis.keys.join(", "));
    }
    text += &case.resolved();
    output.write(&[text.as_bytes()])
}
