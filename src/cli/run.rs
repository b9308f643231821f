//! `stickslip run`: runs a case, and writes the result file.

use super::arguments::{Common, RunOptions};
use super::interrupt::interrupt_flag;
use super::progress::{BarKind, watched};
use super::{CommandEnd, complain, interrupted, strictly, tell};
use crate::Error;
use crate::report::RunSummary;
use stickslip_analysis::analysis::{SavedReport, SavedRun, Warning};
use stickslip_analysis::{GivenCase, overrides};
use stickslip_case::{Case, Origin};
use stickslip_engine::ErrorKind;
use stickslip_files::Overwrite;

pub(super) fn run(options: &RunOptions, common: &Common) -> Result<CommandEnd, Error> {
    let given = GivenCase::read(&options.case)?;
    let mut set = options.budget.over(&options.keys.over(&options.set));
    set.extend(options.method.as_ref().map(|method| format!("solver.method={method}")));
    let changes = overrides(&set)?;
    let case = &Case::read(&given.source, &changes)?;
    let (source, solver) = (&given.source, &case.solver);
    let suffix = match source.origin {
        Origin::Result(_) => ".repeat.h5",
        _ => ".h5",
    };
    let path = given.output(options.output.as_deref(), suffix)?;
    // Set before the partial file exists, so that an interruption ends the run cleanly from then on.
    let stop = interrupt_flag()?;
    log::info!(
        "{}: method {}, rtol {:e}",
        source.label(),
        solver.method.name(),
        solver.rtol
    );
    let saving = SavedRun::new(case, &path).text(&given.text).inputs(&given.files);
    let changed = given.changed(&changes);
    let saving = saving.changed(changed.clone());
    let saving = saving
        .overwrite(Overwrite::by_force(options.force))
        .witness(!options.no_witness);
    let result = watched(common, BarKind::Share, &stop, |bar| saving.watch(bar).start());
    let SavedReport {
        file,
        run,
        unsaved,
        saved,
    } = result?;
    let warnings: Vec<String> = run.warnings.iter().map(Warning::to_string).collect();
    let failure = run.failure.as_ref().map(|failure| &failure.error);
    let write_error = failure.filter(|error| error.kind == ErrorKind::Recorder);
    let write_error = write_error.map(ToString::to_string);
    let unsaved = unsaved.map(|error| error.to_string());
    let status = if unsaved.is_some() { "failed" } else { run.status.name() };
    let error = unsaved
        .clone()
        .or_else(|| run.failure.as_ref().map(ToString::to_string));
    let report = RunSummary {
        status,
        file: file.display().to_string(),
        source: source.label(),
        title: &case.title,
        changed: &changed,
        method: solver.method.name(),
        rtol: run.solver.rtol,
        wall_time: run.wall_time,
        summary: &run.summary,
        warnings: &warnings,
        saved: (write_error.is_some() || unsaved.is_some()).then_some(saved),
        witness: run.witness.as_ref(),
        error: error.as_deref(),
        case,
    };
    if common.json || error.is_none() {
        tell(common, &report)?;
    }
    if !common.quiet {
        for warning in &warnings {
            complain(&format!("warning: {warning}"));
        }
    }
    let path = file.display();
    match error {
        // Errors of the result file name it already.
        Some(error) => {
            Err(Error::computation(unsaved.or(write_error).unwrap_or_else(|| {
                format!("{error}. What was computed until then is in {path}")
            })))
        }
        None if run.report.interrupted => {
            let end = run.report.end;
            let how = format!(" at t = {end:.9} s; what was computed is saved in {path}");
            interrupted(common, &how)
        }
        None => strictly(options.strict, &warnings, !common.quiet, &file),
    }
}
